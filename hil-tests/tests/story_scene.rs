//! A simulated scene before the real firmware: what comes over the wire is the scene's noise-free Stokes image within the noise
//! of its sensor, because the wheel knows where it really stands.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use boards::Board;
use firmware_emulator::{Camera, Clock, Exposure as Taken, World};
use hil_tests::{Bench, Fetched, board_of, capture_request};
use host_sim::frames::{Exposer, FrameSpec};
use host_sim::{Effect, EffectSet, Scene, simulate};
use protocol_polar::{Analyzer, Degrees, Flags, LeastSquares};
use protocol_wire::{Exposure, Word};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

const ANGLES: [f64; 4] = [0.0, 45.0, 90.0, 135.0];

/// The ink print behind a lens without faults: between light and frames there is noise alone.
fn scene() -> Scene {
    let text = include_str!("../../host/sim/scenes/ink-print.toml");
    let mut scene = Scene::parse(text, Path::new("ink-print.toml")).unwrap().resized(96, 72);
    scene.camera.prnu_percent = 0.0;
    scene.camera.dark_current_e_per_s = 0.0;
    scene
}

/// A board with that sensor, and a wheel that misses by half a degree rms.
fn board(scene: &Scene) -> Board {
    let camera = &scene.camera;
    let mut board = board_of(camera.width_px.into(), camera.height_px.into());
    board.sensor.black_level_dn = camera.black_level_dn;
    board.sensor.full_well_e = camera.full_well_e;
    board.sensor.gain_e_per_dn = camera.gain_e_per_dn;
    board.sensor.read_noise_e = camera.read_noise_e;
    board.wheel.polarizer.extinction_ratio = scene.polarizer.extinction_ratio;
    board.emulation.as_mut().unwrap().wheel_jitter_deg = 0.5;
    board
}

/// χ² per degree of freedom of Stokes planes (DN) against `truth` (DN), over the photosites of `chosen`; the noise is that of
/// four frames of photoelectrons through the weights of `analyzers`.
fn chi_squared(
    found: &[Vec<f64>; 3],
    truth: &[[f64; 3]],
    chosen: &[bool],
    analyzers: &[Analyzer],
    scene: &Scene,
) -> f64 {
    let solved = LeastSquares::new(analyzers).unwrap();
    let weights = solved.weights();
    let (gain, read) = (scene.camera.gain_e_per_dn, scene.camera.read_noise_e);
    let (mut sum, mut count) = (0.0, 0.0);
    for index in (0..truth.len()).filter(|index| chosen[*index]) {
        let variances: Vec<f64> = analyzers
            .iter()
            .map(|analyzer| {
                let dn: f64 = analyzer.row().iter().zip(truth[index]).map(|(w, s)| w * s).sum();
                (dn * gain + read * read) / (gain * gain) + 1.0 / 12.0
            })
            .collect();
        for j in 0..3 {
            let variance: f64 = weights[j].iter().zip(&variances).map(|(w, v)| w * w * v).sum();
            sum += (found[j][index] - truth[index][j]).powi(2) / variance;
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn a_scene_comes_over_the_wire_as_it_is() {
    let scene = scene();
    let simulation = simulate(&scene, 0, 2e-3, false).unwrap();
    let effects = [Effect::Shot, Effect::Read, Effect::Quantization, Effect::Saturation, Effect::Extinction];
    let effects = effects.into_iter().fold(EffectSet::NONE, EffectSet::with);
    let exposer = Exposer::new(&scene, 0, &simulation.image, effects).unwrap().into_owned();
    let (board, taken) = (board(&scene), Arc::new(Mutex::new(Vec::<Taken>::new())));
    let log = Arc::clone(&taken);
    let eye = Box::new(move |exposure: &Taken| {
        log.lock().unwrap().push(*exposure);
        let frame = FrameSpec {
            angle: 0,
            commanded: exposure.axis,
            exposure_us: 1e6 * exposure.duration.as_secs_f64(),
            start_s: exposure.began.as_secs_f64(),
        };
        exposer.raw_of(&frame, usize::try_from(exposure.number).unwrap())
    });
    let world = World::new(&board, Clock::virtual_time());
    let bench = Bench::start(Camera::live(&board, world, eye).unwrap());
    let mut client = bench.connect();
    let mut request = capture_request(&ANGLES, Exposure::Auto);
    request.word = Word::I32;
    let id = client.capture(request, |_| ControlFlow::Continue(())).unwrap();
    let fetched = Fetched::fetch(&mut client, id);
    assert_eq!(fetched.replay().differing, 0);

    // The wheel missed, and says so: by half a count of the encoder (0.044 degrees) and what is left of the ringing.
    let taken = taken.lock().unwrap();
    let frames = &taken[taken.len() - ANGLES.len()..];
    let (mut missed, mut misjudged) = (0.0_f64, 0.0_f64);
    for ((frame, said), asked) in frames.iter().zip(&fetched.description.frames).zip(ANGLES) {
        missed = missed.max(frame.axis.axis_difference(Degrees(asked).to_radians()).to_degrees().0.abs());
        misjudged =
            misjudged.max(frame.axis.axis_difference(Degrees(said.angle_deg).to_radians()).to_degrees().0.abs());
    }
    assert!(missed > 0.2 && misjudged < 0.05, "missed by {missed}, misjudged by {misjudged}");

    // DN per radiance and exposure of a grey sensor, which takes the mean of three bands.
    let ms = 1e3 * frames[0].duration.as_secs_f64();
    let scale = ms * scene.polarizer.throughput() / scene.camera.gain_e_per_dn / 3.0;
    let colors = &simulation.image.colors;
    let truth: Vec<[f64; 3]> = (0..colors[0].s0.len())
        .map(|index| {
            [0, 1, 2].map(|j: usize| {
                let bands = colors.iter().zip(scene.camera.response_e_per_ms);
                bands.map(|(c, e)| scale * e * f64::from([&c.s0, &c.s1, &c.s2][j][index])).sum()
            })
        })
        .collect();
    let flags = fetched.flags();
    let chosen: Vec<bool> =
        (0..truth.len()).map(|k| truth[k][0] > 0.0 && !flags[k].contains(Flags::SATURATED)).collect();
    let seen = chosen.iter().filter(|c| **c).count();
    assert!(seen > 2000, "{seen} photosites");

    let found = [0, 1, 2].map(|component| fetched.stokes_dn(component));
    let good = chi_squared(&found, &truth, &chosen, &fetched.analyzers(), &scene);
    // 3 × 2000 degrees of freedom: ±0.018; what the encoder misjudges adds a little.
    assert!((0.93..1.12).contains(&good), "chi squared {good} per degree of freedom");

    // A camera that believes its servo sees another light.
    let commanded: Vec<Analyzer> = fetched
        .analyzers()
        .iter()
        .zip(ANGLES)
        .map(|(a, d)| Analyzer { angle: Degrees(d).to_radians(), ..*a })
        .collect();
    let (raw, solved) = (fetched.raw(), LeastSquares::new(&commanded).unwrap());
    let black = f64::from(scene.camera.black_level_dn);
    let believed = [0, 1, 2].map(|j: usize| -> Vec<f64> {
        let at =
            |index: usize| raw.iter().zip(solved.weights()[j]).map(|(f, w)| w * (f64::from(f[index]) - black)).sum();
        (0..truth.len()).map(at).collect()
    });
    let bad = chi_squared(&believed, &truth, &chosen, &commanded, &scene);
    println!("chi squared per degree of freedom: {good:.3} with the measured angles, {bad:.3} with the commanded ones");
    assert!(bad > good + 0.2, "{bad} with the commanded angles");
}
