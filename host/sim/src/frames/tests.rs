//! Frames as a whole: determinism, and the numbers a sensor's data sheet is tested by.

use super::testing::{flat, moments, picture, studio};
use super::{Exposer, FrameSpec};
use crate::scene::{Exposure, Scene};
use crate::{Effect, EffectSet, SimError};
use host_image::BayerPattern;
use protocol_polar::Degrees;

/// A scene in which every effect does something.
fn faulty() -> Scene {
    let mut scene = studio(42);
    scene.camera.bayer = Some(BayerPattern::Grbg);
    scene.camera.read_noise_e = 5.0;
    scene.camera.dark_current_e_per_s = 500.0;
    scene.camera.prnu_percent = 1.0;
    scene.camera.vignetting_exponent = 4.0;
    scene.camera.psf_sigma_px = 0.8;
    scene.polarizer.extinction_ratio = 300.0;
    scene.polarizer.beam_deviation_arcmin = 3.0;
    scene.wheel.angle_sigma = Degrees(0.5).to_radians();
    scene.plan.light_drift_percent_per_s = 2.0;
    scene
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    let scene = faulty();
    let image = picture(&scene);
    let frames = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let exposer = Exposer::new(&scene, 0, &image, EffectSet::ALL).unwrap();
            (0..exposer.frames().len()).map(|k| exposer.raw(k)).collect::<Vec<_>>()
        })
    };
    let one = frames(1);
    assert_eq!(one, frames(2));
    assert_eq!(one, frames(7));
}

/// Leaving an effect out does not change the draws of another: the noise of a frame is the same, draw by draw.
#[test]
fn effects_do_not_disturb_each_other() {
    let scene = faulty();
    let image = flat(&scene, [1.0, 0.0, 0.0]);
    let read = EffectSet::NONE.with(Effect::Read);
    let electrons = |effects| Exposer::new(&scene, 0, &image, effects).unwrap().electrons(1);
    let noise = |effects: EffectSet| -> Vec<f32> {
        let clean = electrons(effects.without(Effect::Read));
        electrons(effects).iter().zip(clean).map(|(a, b)| a - b).collect()
    };
    for (alone, beside) in noise(read).iter().zip(noise(read.with(Effect::Shot).with(Effect::Prnu))) {
        assert!((alone - beside).abs() < 2e-3, "{alone} {beside}");
    }
}

#[test]
fn frames_views_and_seeds_have_noise_of_their_own() {
    let mut scene = faulty();
    scene.plan.repeats = 2;
    scene.views.push(scene.views[0]);
    let image = flat(&scene, [1.0, 0.0, 0.0]);
    let shot = EffectSet::NONE.with(Effect::Shot);
    let frame = |scene: &Scene, view, k| Exposer::new(scene, view, &image, shot).unwrap().raw(k);
    let first = frame(&scene, 0, 0);
    assert_eq!(first, frame(&scene, 0, 0));
    assert_ne!(first, frame(&scene, 0, 1));
    assert_ne!(first, frame(&scene, 1, 0));
    scene.seed += 1;
    assert_ne!(first, frame(&scene, 0, 0));
}

/// Photon transfer in DN: variance = read² /K² + 1/12 + (mean − black)/K at every level, K in e/DN.
#[test]
fn the_photon_transfer_curve_has_the_slope_of_the_gain() {
    let mut scene = studio(8);
    (scene.camera.width_px, scene.camera.height_px) = (250, 120);
    scene.camera.read_noise_e = 6.0;
    let effects = [Effect::Shot, Effect::Read, Effect::Quantization, Effect::Saturation];
    let effects = effects.into_iter().fold(EffectSet::NONE, EffectSet::with);
    for exposure_us in [500.0, 4000.0, 20_000.0] {
        scene.plan.exposure = Exposure::Fixed(vec![exposure_us]);
        let image = flat(&scene, [1.0, 0.0, 0.0]);
        let raw: Vec<f32> =
            Exposer::new(&scene, 0, &image, effects).unwrap().raw(0).into_iter().map(f32::from).collect();
        let (mean, variance) = moments(&raw);
        let gain = scene.camera.gain_e_per_dn;
        let expected = (6.0 / gain).powi(2) + 1.0 / 12.0 + (mean - 64.0) / gain;
        assert!((variance / expected - 1.0).abs() < 0.05, "{variance} for {expected} at {mean} DN");
    }
}

#[test]
fn a_plan_that_fills_reaches_its_level_and_no_more() {
    let mut scene = studio(9);
    scene.plan.exposure = Exposure::Fill(0.75);
    scene.camera.bayer = Some(BayerPattern::Rggb);
    scene.camera.response_e_per_ms = [500.0, 900.0, 700.0];
    let mut image = picture(&scene);
    // All pixels alike, so that the brightest band is seen somewhere.
    image.colors.iter_mut().for_each(|c| {
        let (s0, s1, s2) = (c.s0[0], c.s1[0], c.s2[0]);
        c.s0.fill(s0);
        c.s1.fill(s1);
        c.s2.fill(s2);
    });
    let exposer = Exposer::new(&scene, 0, &image, EffectSet::NONE.with(Effect::Bayer)).unwrap();
    let brightest = (0..exposer.frames().len()).flat_map(|k| exposer.electrons(k)).fold(0.0_f32, f32::max) / 0.75;
    assert!((f64::from(brightest) / scene.camera.saturation_e() - 1.0).abs() < 1e-5, "{brightest}");
}

#[test]
fn frames_follow_the_plan_in_time() {
    let mut scene = studio(1);
    scene.plan.exposure = Exposure::Fixed(vec![1000.0, 4000.0]);
    scene.plan.repeats = 2;
    let exposer = Exposer::new(&scene, 0, &picture(&scene), EffectSet::NONE).unwrap();
    let frames = exposer.frames();
    assert_eq!(frames.len(), 4 * 2 * 2);
    let exposures: Vec<f64> = frames[..4].iter().map(|f| f.exposure_us).collect();
    assert_eq!(exposures, [1000.0, 4000.0, 1000.0, 4000.0]);
    // Four exposures (10 ms), a turn of 45° at 300°/s and 80 ms of rest.
    let FrameSpec { start_s, angle, .. } = frames[4];
    assert!(angle == 1 && (start_s - (0.010 + 0.150 + 0.080)).abs() < 1e-12, "{start_s}");
}

#[test]
fn images_that_do_not_fit_are_refused() {
    let scene = studio(1);
    let image = picture(&scene);
    assert!(matches!(Exposer::new(&scene, 1, &image, EffectSet::NONE), Err(SimError::NoView { view: 1, views: 1 })));
    let mut larger = scene.clone();
    larger.camera.width_px += 1;
    assert!(matches!(Exposer::new(&larger, 0, &image, EffectSet::NONE), Err(SimError::ImageSize { .. })));
    let mut dark = scene.clone();
    dark.plan.exposure = Exposure::Fill(0.5);
    let black = flat(&scene, [0.0; 3]);
    assert!(matches!(Exposer::new(&dark, 0, &black, EffectSet::NONE), Err(SimError::NoLight)));
}
