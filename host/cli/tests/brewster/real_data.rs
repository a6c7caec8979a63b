//! Photographs of a real sensor, and rendered ones whose truth is known; skipped on a machine without them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use host_image::{ColorPlanes, StokesImage};
use protocol_polar::{Flags, Stokes};

use crate::world::World;

/// A path in the shared data, if they are there.
fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let found = root.join(path);
    if !found.exists() {
        println!("skipped: no ../shared");
        return None;
    }
    Some(found)
}

/// Mean light of a square of valid pixels about (column, row).
fn mean(image: &StokesImage, (column, row): (usize, usize), half: usize) -> Stokes {
    let ColorPlanes { s0, s1, s2, flags, .. } = &image.colors[0];
    let mut sum = [0.0; 4];
    for y in row - half..row + half {
        for x in column - half..column + half {
            let i = y * image.width + x;
            if !Flags(flags.as_ref().unwrap()[i]).contains(Flags::TOO_FEW) {
                [s0, s1, s2].iter().zip(&mut sum).for_each(|(p, s)| *s += f64::from(p[i]));
            }
        }
    }
    Stokes(sum)
}

/// Water reflects near-horizontal polarization; a mirrored convention would show as the other side of horizontal (AoLP 168
/// degrees and DoLP 0.64 are on record for the middle of this water).
#[test]
fn a_pond_is_polarized_horizontally() {
    let Some(file) = shared("data/real/imx250mzr/carps_IMX250MZR.png") else { return };
    let w = World::new();
    w.ok(&["stokes", file.to_str().unwrap(), "--mosaic", "imx250mzr", "-o", "r"]);
    let image = w.stokes("r");
    assert_eq!((image.width, image.height), (1224, 1024));
    let water = mean(&image, (612, 512), 20);
    let from_horizontal = 90.0 - (water.aolp().to_degrees().0 - 90.0).abs();
    assert!(from_horizontal < 15.0 && (0.55..0.72).contains(&water.dolp()), "{:?} {}", water.aolp(), water.dolp());
    assert!(water.aolp().to_degrees().0 > 160.0, "on this side of horizontal: {:?}", water.aolp().to_degrees());
}

/// Six frames of a rendered concrete plate (nominal wheel angles, off by 1 degree rms) against its noise-free Stokes image:
/// DN = 256 + 3839 · exposure · I.
#[test]
fn a_rendered_capture_agrees_with_its_truth() {
    let Some(capture) = shared("captures/S1") else { return };
    let w = World::new();
    let frames: Vec<String> = (0..6).map(|k| format!("{}/v0/six_{:03}.png", capture.display(), 30 * k)).collect();
    let mut arguments = vec!["stokes", "--black", "256", "--white", "4095", "-o", "r"];
    arguments.extend(frames.iter().map(String::as_str));
    w.ok(&arguments);
    let image = w.stokes("r");
    let text = std::fs::read_to_string(capture.join("v0/capture.json")).unwrap();
    let capture_json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let dn_per_radiance = 3839.0 * capture_json["exposure_s"].as_f64().unwrap();
    let truth = planes(&capture.join("truth/v0/stokes.exr"));
    let mask = &planes(&capture.join("truth/v0/maps.exr"))["mask"];
    for color in &image.colors {
        let name = color.color.name();
        let truth_of = |k: usize, i: usize| f64::from(truth[&format!("s{k}.{name}")][i]) * dn_per_radiance;
        for (k, plane) in [&color.s0, &color.s1, &color.s2].into_iter().enumerate() {
            let errors: Vec<f64> = (0..plane.len())
                .filter(|i| (mask[*i] - 10.0).abs() < 0.5)
                .map(|i| (f64::from(plane[i]) - truth_of(k, i)) / truth_of(0, i))
                .collect();
            let n = errors.len() as f64;
            let bias = errors.iter().sum::<f64>() / n;
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
            println!("{name} s{k}: bias {bias:+.5}, rms {rms:.5} of s0 over {n} pixels");
            assert!(n > 10_000.0 && bias.abs() < 2e-3 && rms < 0.015, "{name} s{k}: {bias} {rms}");
        }
    }
}

/// All float channels of a flat OpenEXR file.
fn planes(path: &Path) -> HashMap<String, Vec<f32>> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let channels = image.layer_data.channel_data.list;
    channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}
