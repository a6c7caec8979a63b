//! `views.json`: what a program that fits the pictures has to know of each view (docs/CONVENTIONS.md).
//!
//! Field names are those of a photographed capture's `capture.json`, so that one reader reads both.

use std::path::{Path, absolute};

use host_sim::Scene;
use host_sim::camera::Pinhole;
use host_sim::optical::SkyPattern;
use host_sim::scene::{SkyBand, SkyRadiance};
use serde_json::{Value, json};

use super::{View, explain, files};
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures;

/// Writes it.
pub(super) fn write(scene: &Scene, views: &[View], folder: &OutputFolder) -> Result<(), Failure> {
    let views: Vec<Value> = views.iter().map(|view| one(scene, view)).collect();
    let document = json!({ "version": 1, "capture": scene.name, "views": views });
    let text = format!("{document:#}\n");
    std::fs::write(folder.path().join("views.json"), text).map_err(|error| pictures::unwritable(folder, &error))
}

fn one(scene: &Scene, view: &View) -> Value {
    let Some(camera) = scene.views.get(view.index) else { return Value::Null };
    let name = files::name(view);
    let frames: Vec<Value> = view
        .schedule
        .iter()
        .zip(files::frame_names(scene, &view.schedule))
        .map(|(spec, file)| {
            let mut frame = json!({
                "nominal_angle_deg": explain::degrees(spec.commanded),
                "exposure_s": 1e-6 * spec.exposure_us,
                "start_s": spec.start_s,
            });
            if let Some(object) = frame.as_object_mut().filter(|_| view.frames.is_some()) {
                object.insert("file".into(), json!(format!("{name}/frames/{file}")));
            }
            frame
        })
        .collect();
    let same = view.schedule.windows(2).all(|pair| pair[0].exposure_us.to_bits() == pair[1].exposure_us.to_bits());
    json!({
        "view": name,
        "stokes": { "file": format!("{name}/stokes.exr"), "unit": "radiance", "channels": "R, G, B" },
        "image": {
            "width": camera.width,
            "height": camera.height,
            "channels": scene.camera.bayer.map_or("mono", |pattern| pattern.name()),
            "linear": true,
            "container": "PNG, 16 bit, grey",
        },
        "sensor": sensor(scene),
        "exposure_s": view.schedule.first().filter(|_| same).map(|spec| 1e-6 * spec.exposure_us),
        "camera": geometry(camera),
        "plane": plane(scene, camera),
        "polarizer": {
            "angle_convention": "transmission axis, counter-clockwise from image right as seen in the picture; s1>0 \
                                 horizontal, s2>0 at +45 deg (right-up)",
            "angles": "nominal (commanded); the wheel is not perfect",
            "extinction_ratio": scene.polarizer.extinction_ratio,
            "transmission": scene.polarizer.transmission,
        },
        "light": light(scene),
        "sequences": { "plan": frames },
    })
}

fn sensor(scene: &Scene) -> Value {
    let camera = &scene.camera;
    // A grey sensor takes the mean of the three bands.
    let share = if camera.bayer.is_some() { 1.0 } else { 1.0 / 3.0 };
    let per_second = 1e3 * share * scene.polarizer.throughput() / camera.gain_e_per_dn;
    json!({
        "bit_depth": camera.bit_depth,
        "black_level_dn": camera.black_level_dn,
        "white_level_dn": camera.white_level_dn(),
        "full_well_e": camera.full_well_e,
        "gain_e_per_dn": camera.gain_e_per_dn,
        "read_noise_e": camera.read_noise_e,
        "dark_current_e_per_s": camera.dark_current_e_per_s,
        "prnu_percent": camera.prnu_percent,
        "vignetting_exponent": camera.vignetting_exponent,
        "psf_sigma_px": camera.psf_sigma_px,
        "pixel_pitch_um": camera.pixel_pitch_um,
        "responsivity_dn_per_radiance_s": camera.response_e_per_ms.map(|response| per_second * response),
        "response": "DN = black + sum over bands of responsivity*exposure_s*I(phi), I(phi)=(s0+s1 cos2phi+s2 sin2phi)/2, \
                     polarizer's transmission included; behind a mosaic only the photosite's own band",
    })
}

fn geometry(camera: &Pinhole) -> Value {
    let (rotation, translation) = camera.world_to_camera();
    let rows = |m: [[f64; 3]; 3]| [0, 1, 2].map(|row| [0, 1, 2].map(|column: usize| m[column][row]));
    let back = camera.pose.back;
    json!({
        "model": "pinhole, no distortion",
        "K": rows(camera.intrinsics().to_cols_array_2d()),
        "R_world_to_camera": rows(rotation.to_cols_array_2d()),
        "t_world_to_camera": translation.to_array(),
        "centre_world": camera.pose.position.to_array(),
        "axes": "camera x right, y down, z forward (OpenCV)",
        "pixel_convention": "u to the right, v down, centre of pixel (row 0, col 0) is u=v=0.5",
        "theta_deg": back.truncate().length().atan2(back.z).to_degrees(),
        "azimuth_deg": back.y.atan2(back.x).to_degrees(),
    })
}

fn plane(scene: &Scene, camera: &Pinhole) -> Value {
    let half = 0.5 * scene.sample.side_m;
    let corners = [[-half, half], [half, half], [half, -half], [-half, -half]];
    let homography = camera.plane_to_pixel().to_cols_array_2d();
    let row = |k: usize| [homography[0][k], homography[1][k], homography[2][k]];
    let pixel = |[x, y]: [f64; 2]| {
        let at = |k: usize| row(k)[0] * x + row(k)[1] * y + row(k)[2];
        // Behind the camera there is no picture of a corner.
        (at(2) > 0.0).then(|| [at(0) / at(2), at(1) / at(2)])
    };
    json!({
        "unit": "1 = 1 m",
        "sample": format!("square [-{half},{half}]^2 in z=0, normal +z"),
        "side": scene.sample.side_m,
        "H_plane_to_pixel": [row(0), row(1), row(2)],
        "sample_corners_plane": corners,
        "sample_corners_px": corners.map(pixel),
    })
}

/// A map by its file, a formula by its numbers as in the scene; numbers per band are [R, G, B].
fn light(scene: &Scene) -> Value {
    let light = &scene.light;
    let bands =
        |value: fn(&SkyRadiance) -> Option<f64>| light.bands.each_ref().map(|band: &SkyBand| value(&band.radiance));
    let mut sky = match &light.bands[0].radiance {
        SkyRadiance::Uniform(_) => json!({
            "type": "uniform",
            "radiance": bands(|sky| if let SkyRadiance::Uniform(sky) = sky { Some(sky.radiance) } else { None }),
        }),
        SkyRadiance::Overcast(_) => json!({
            "type": "overcast",
            "zenith_radiance": bands(|sky| if let SkyRadiance::Overcast(sky) = sky { Some(sky.zenith) } else { None }),
        }),
        SkyRadiance::Clear(clear) => json!({
            "type": "clear",
            "base_radiance": bands(|sky| if let SkyRadiance::Clear(sky) = sky { Some(sky.base) } else { None }),
            "horizon_radiance": bands(|sky| if let SkyRadiance::Clear(sky) = sky { Some(sky.horizon) } else { None }),
            "aureole_radiance": bands(|sky| if let SkyRadiance::Clear(sky) = sky { Some(sky.aureole) } else { None }),
            "aureole_width_deg": clear.width.to_degrees(),
        }),
        SkyRadiance::Map(map) => {
            let source = map.source();
            json!({
                "type": "probe",
                "file": whole_path(&source.file),
                "layout": "equirectangular, zenith up, seen from inside: azimuth falls to the right",
                "center_azimuth_deg": explain::degrees(source.center_azimuth),
                "scale": source.scale,
            })
        }
    };
    let polarization = match light.pattern {
        None => json!("none"),
        Some(SkyPattern::Rayleigh { max_dolp, .. }) => json!({ "type": "rayleigh", "max_dolp": max_dolp }),
        Some(SkyPattern::Berry { max_dolp, splitting_deg, .. }) => {
            json!({ "type": "berry", "max_dolp": max_dolp, "splitting_deg": splitting_deg })
        }
    };
    if let Some(sky) = sky.as_object_mut() {
        sky.insert("polarization".into(), polarization);
        if let Some(sun) = light.sun {
            sky.insert("sun_azimuth_deg".into(), json!(sun.y.atan2(sun.x).to_degrees()));
            sky.insert("sun_elevation_deg".into(), json!(sun.z.atan2(sun.truncate().length()).to_degrees()));
        }
        if let Some(disk) = &light.disk {
            let radius_deg = disk.angular_radius_rad.to_degrees();
            sky.insert("sun_disk".into(), json!({ "radiance": disk.radiance, "angular_radius_deg": radius_deg }));
        }
    }
    sky
}

fn whole_path(file: &Path) -> String {
    absolute(file).unwrap_or_else(|_| file.to_owned()).display().to_string()
}
