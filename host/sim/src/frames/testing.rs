//! A small scene, random light, and the difference an effect really makes: what the tests of every effect share.

use std::path::Path;

use host_image::{Color, ColorPlanes, StokesImage, StokesMetadata};
use proptest::test_runner::TestCaseError;
use rand::Rng;

use super::true_difference;
use crate::rng::{Draw, Stream};
use crate::signal::single;
use crate::{Assessment, Effect, EffectSet, Facts, Scene};

/// A grey camera without a fault, 20 × 14 photosites.
pub(crate) fn studio(seed: u64) -> Scene {
    let text = format!("seed = {seed}\n{}", include_str!("studio.toml"));
    Scene::parse(&text, Path::new("studio.toml")).unwrap()
}

/// Random physical light in every pixel, following the scene's seed.
pub(crate) fn picture(scene: &Scene) -> StokesImage {
    let (width, height) = (usize::from(scene.camera.width_px), usize::from(scene.camera.height_px));
    let mut random = Stream::new(scene.seed, Draw::Bumps, 99, 0).at(0);
    let colors = [Color::R, Color::G, Color::B].map(|color| {
        let mut planes = [Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..width * height {
            let s0 = 0.05 + random.random::<f64>();
            let (dolp, turn) = (0.95 * random.random::<f64>(), std::f64::consts::TAU * random.random::<f64>());
            for (plane, value) in planes.iter_mut().zip([s0, s0 * dolp * turn.cos(), s0 * dolp * turn.sin()]) {
                plane.push(single(value));
            }
        }
        let [s0, s1, s2] = planes;
        ColorPlanes { color, s0, s1, s2, flags: None, residual: None }
    });
    StokesImage { width, height, colors: colors.into(), metadata: metadata() }
}

/// The same light everywhere.
pub(crate) fn flat(scene: &Scene, stokes: [f32; 3]) -> StokesImage {
    let mut image = picture(scene);
    for planes in &mut image.colors {
        planes.s0.fill(stokes[0]);
        planes.s1.fill(stokes[1]);
        planes.s2.fill(stokes[2]);
    }
    image
}

/// Mean and variance.
pub(crate) fn moments(values: &[f32]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    (mean, values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / (n - 1.0))
}

/// Simulates with and without `effect`, estimates Stokes of both as [`Facts`] says, and holds the largest difference against
/// the bound. Answers with both.
pub(crate) fn check_bound(scene: &Scene, effect: Effect) -> Result<(f64, Assessment), TestCaseError> {
    let image = picture(scene);
    let assessed = Facts::new(scene, 0, &image).unwrap().assess(effect).unwrap();
    // Photosites are compared under their own filters, but for the filters themselves.
    let base = if effect == Effect::Bayer { EffectSet::NONE } else { EffectSet::NONE.with(Effect::Bayer) };
    let worst = true_difference(scene, 0, &image, base.with(effect), base).unwrap();
    // Frames are f32: a few parts in 10^7 of the brightest light, relative to the darkest.
    let rounding = 3e-5;
    if worst > assessed.bound * (1.0 + 1e-5) + rounding {
        return Err(TestCaseError::fail(format!("{effect:?} changes Stokes by {worst}, bound {assessed:?}")));
    }
    Ok((worst, assessed))
}

fn metadata() -> StokesMetadata {
    StokesMetadata {
        unit: "radiance".into(),
        angles_deg: Vec::new(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: "test".into(),
        camera_serial: None,
        capture_id: None,
        software_version: "test".into(),
    }
}
