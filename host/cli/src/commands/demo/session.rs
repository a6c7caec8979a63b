//! A simulated scene as a session: frames as its camera would have stored them, and what is known of camera and light.

use host_fit::Noise;
use host_fit::session::{
    BandLight, Camera, Frames, LightSpec, Placement, Polarization, PoseOrigin, Radiance, ReferenceAxis, Sample,
    Session, ViewCapture, ViewData,
};
use host_image::{Encoding, Picture, Samples};
use host_sim::frames::{Exposer, FramePlan};
use host_sim::scene::{SkyBand, SkyPattern, SkyRadiance};
use host_sim::simulate::simulate;
use host_sim::{Facts, Scene, SimError};
use protocol_polar::{Analyzer, efficiency_from_extinction_ratio};

/// Of simulation and fit, relative to s0: about the noise of the camera.
pub(super) const TOLERANCE: f64 = 2e-3;

/// Frames of every view of a scene under an analytic sky without a disk.
pub(super) fn session(scene: &Scene) -> Result<Session, SimError> {
    let views = (0..scene.views.len()).map(|index| view(scene, index)).collect::<Result<_, _>>()?;
    let half = 0.5 * scene.sample.side_m;
    Ok(Session { views, light: light(scene)?, sample: Sample { x: [-half, half], y: [-half, half] }, strip: None })
}

fn view(scene: &Scene, index: usize) -> Result<ViewCapture, SimError> {
    let pinhole = scene.views.get(index).ok_or(SimError::NoView { view: index, views: scene.views.len() })?;
    let simulation = simulate(scene, index, TOLERANCE, false)?;
    let plan = FramePlan::new(&Facts::new(scene, index, &simulation.image)?, TOLERANCE);
    let exposer = Exposer::new(scene, index, &simulation.image, plan.effects)?;
    let specs = exposer.frames();
    let first_us = specs.first().ok_or(SimError::NoLight)?.exposure_us;
    let efficiency = efficiency_from_extinction_ratio(scene.polarizer.extinction_ratio);
    let analyzers = specs
        .iter()
        .map(|s| Analyzer { angle: s.commanded, throughput: s.exposure_us / first_us, efficiency })
        .collect();
    let picture = |k| Picture {
        width: pinhole.width,
        height: pinhole.height,
        channels: 1,
        samples: Samples::U16(exposer.raw(k)),
        encoding: Encoding::Linear,
    };
    let sensor = &scene.camera;
    let per_radiance =
        sensor.response_e_per_ms.map(|e| e * 1e-3 * first_us * scene.polarizer.throughput() / sensor.gain_e_per_dn);
    let (rotation, translation) = pinhole.world_to_camera();
    let camera = Camera::new([pinhole.width, pinhole.height], pinhole.intrinsics(), rotation, translation);
    let frames = Frames {
        sequence: "plan".into(),
        analyzers,
        pictures: (0..specs.len()).map(picture).collect(),
        black_dn: f32::from(sensor.black_level_dn),
        white_dn: Some(single(sensor.white_level_dn())),
        noise: Noise {
            read_dn: sensor.read_noise_e / sensor.gain_e_per_dn,
            electrons_per_dn: sensor.gain_e_per_dn,
            misfit_sigma: 5.0,
        },
        radiance_per_dn: per_radiance.map(|dn| 1.0 / dn),
        bayer: sensor.bayer,
    };
    Ok(ViewCapture {
        name: format!("view-{index}"),
        // A scene's camera stands above its sample: this was checked when it was read.
        camera: camera.map_err(|_| SimError::NoView { view: index, views: scene.views.len() })?,
        placement: Placement { origin: PoseOrigin::Pose, residual_px: None },
        reference: ReferenceAxis::Sheet,
        data: ViewData::Frames(frames),
    })
}

/// [`SimError::NoLight`] for a map, of which there is none in a scene without a folder.
fn light(scene: &Scene) -> Result<LightSpec, SimError> {
    let band = |band: &SkyBand| {
        let radiance = match &band.radiance {
            SkyRadiance::Uniform(sky) => Radiance::Uniform(*sky),
            SkyRadiance::Overcast(sky) => Radiance::Overcast(*sky),
            SkyRadiance::Clear(sky) => Radiance::Clear(*sky),
            SkyRadiance::Map(_) => return Err(SimError::NoLight),
        };
        let polarization = band.polarization.map(|pattern| match pattern {
            SkyPattern::Rayleigh(pattern) => Polarization::Rayleigh(pattern),
            SkyPattern::Berry(pattern) => Polarization::Berry(pattern),
        });
        Ok(BandLight { radiance, polarization })
    };
    let [r, g, b] = &scene.light.bands;
    Ok(LightSpec { bands: [band(r)?, band(g)?, band(b)?], sun: None, photograph_sigma: None })
}

#[expect(clippy::cast_possible_truncation, reason = "levels of a few thousand DN")]
fn single(value: f64) -> f32 {
    value as f32
}
