//! When each frame is taken and how long it is exposed.

use host_image::StokesImage;

use super::FrameSpec;
use crate::SimError;
use crate::scene::{Exposure, Plan, Scene};
use crate::signal::brightest;

/// The frames for a checked image: for every angle, the exposures in turn, as often as the plan repeats them. The wheel turns straight at
/// its speed and rests between angles.
pub(crate) fn schedule(scene: &Scene, image: &StokesImage) -> Result<Vec<FrameSpec>, SimError> {
    let exposures = match &scene.plan.exposure {
        Exposure::Fixed(exposures) => exposures.clone(),
        Exposure::Fill(share) => vec![filling(scene, image, *share)?],
    };
    let Plan { angles, repeats, .. } = &scene.plan;
    let mut frames: Vec<FrameSpec> = Vec::with_capacity(angles.len() * exposures.len() * usize::from(*repeats));
    let mut start_s = 0.0;
    for (angle, commanded) in angles.iter().enumerate() {
        if let Some(last) = frames.last() {
            let turn_deg = (commanded.0 - last.commanded.0).abs().to_degrees();
            start_s += turn_deg / scene.wheel.slew_deg_per_s + 1e-3 * scene.wheel.settle_ms;
        }
        for exposure_us in (0..*repeats).flat_map(|_| exposures.iter().copied()) {
            frames.push(FrameSpec { angle, commanded: *commanded, exposure_us, start_s });
            start_s += 1e-6 * exposure_us;
        }
    }
    Ok(frames)
}

/// The exposure (µs) at which the brightest photosite reaches `share` of saturation at the brightest angle.
fn filling(scene: &Scene, image: &StokesImage, share: f64) -> Result<f64, SimError> {
    let axes: Vec<(f64, f64)> = scene.plan.angles.iter().map(|a| a.cos_sin_double()).collect();
    let e_per_ms = brightest(&scene.camera, image, &axes) * scene.polarizer.throughput();
    if e_per_ms > 0.0 { Ok(1e3 * share * scene.camera.saturation_e() / e_per_ms) } else { Err(SimError::NoLight) }
}
