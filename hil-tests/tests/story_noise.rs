//! What noise does to Stokes: the laws of docs/EQUATIONS.md, measured through the whole device.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use boards::Board;
use firmware_emulator::{Camera, Clock, uniform};
use hil_tests::{Bench, Fetched, board_of, capture_request, statistics};
use protocol_polar::{Degrees, Flags, Stokes};
use protocol_wire::{Exposure, Word};
use std::ops::ControlFlow;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

/// One capture of a uniform light at the reference exposure.
fn capture(board: &Board, light: (f64, f64, f64), angles_deg: &[f64]) -> Fetched {
    let (s0_dn, dolp, aolp_deg) = light;
    let field = uniform(board.sensor.width_px, board.sensor.height_px, s0_dn, dolp, Degrees(aolp_deg));
    let bench = Bench::start(Camera::analytic(board, field, Clock::virtual_time()).unwrap());
    let mut client = bench.connect();
    let mut request = capture_request(angles_deg, Exposure::Fixed(10_000));
    request.word = Word::I32;
    let id = client.capture(request, |_| ControlFlow::Continue(())).unwrap();
    Fetched::fetch(&mut client, id)
}

fn equispaced(n: u8) -> Vec<f64> {
    (0..n).map(|k| 180.0 * f64::from(k) / f64::from(n)).collect()
}

/// A sensor whose noise is the same at any signal: `sigma_dn`, with a well so large that shot noise drowns in it.
fn additive(sigma_dn: f64) -> Board {
    let mut board = board_of(WIDTH, HEIGHT);
    board.sensor.gain_e_per_dn = 1000.0;
    board.sensor.full_well_e = 1e7;
    board.sensor.read_noise_e = sigma_dn * 1000.0;
    board
}

/// Trace of the covariance of (s0, s1, s2) is 10 σ² for 0/45/90 and 20/3 σ² for 0/60/120.
#[test]
fn the_default_axes_have_two_thirds_of_the_variance() {
    let board = board_of(WIDTH, HEIGHT);
    let [even, paper] = [[0.0, 60.0, 120.0], [0.0, 45.0, 90.0]].map(|angles| {
        let fetched = capture(&board, (2000.0, 0.0, 0.0), &angles);
        assert!(fetched.flags().len() >= 100_000);
        [0, 1, 2].map(|component| statistics(&fetched.stokes_dn(component)).variance)
    });
    let ratio = paper.iter().sum::<f64>() / even.iter().sum::<f64>();
    println!("trace of the variance, 0/45/90 over 0/60/120: {ratio:.4}");
    assert!((ratio / 1.5 - 1.0).abs() < 0.03, "{ratio}");
    let lopsided = paper[2] / paper[1];
    assert!((lopsided / 3.0 - 1.0).abs() < 0.03, "var s2 / var s1 of 0/45/90: {lopsided}");
    // And the noise is what the sensor says: shot noise of 1000 DN, read noise, rounding.
    let gain = board.sensor.gain_e_per_dn;
    let sample = 1000.0 / gain + (board.sensor.read_noise_e / gain).powi(2) + 1.0 / 12.0;
    let trace = even.iter().sum::<f64>();
    assert!((trace / (20.0 / 3.0 * sample) - 1.0).abs() < 0.02, "{trace} for {}", 20.0 / 3.0 * sample);
}

/// σ_AoLP = σ/(s0 P) √(2/N), σ_DoLP = σ/s0 √(8/N) √(1 + P²/2), N equispaced frames of additive noise σ.
#[test]
fn angle_and_degree_scatter_as_the_formulas_say() {
    let sigma = 20.0;
    let board = additive(sigma);
    let (s0, p) = (2000.0, 0.5);
    for n in [3_u8, 4, 8] {
        let fetched = capture(&board, (s0, p, 30.0), &equispaced(n));
        let planes = [0, 1, 2].map(|component| fetched.stokes_dn(component));
        let light = (0..planes[0].len()).map(|i| Stokes([planes[0][i], planes[1][i], planes[2][i], 0.0]));
        let angles: Vec<f64> = light.clone().map(|s| s.aolp().axis_difference(Degrees(30.0).to_radians()).0).collect();
        let degrees: Vec<f64> = light.map(Stokes::dolp).collect();
        let count = f64::from(n);
        let wanted_angle = sigma / (s0 * p) * (2.0 / count).sqrt();
        let wanted_degree = sigma / s0 * (8.0 / count).sqrt() * (1.0 + p * p / 2.0).sqrt();
        let (angle, degree) = (statistics(&angles), statistics(&degrees));
        let (a, d) = (angle.variance.sqrt() / wanted_angle, degree.variance.sqrt() / wanted_degree);
        println!("N = {n}: AoLP noise {a:.4} of the formula, DoLP noise {d:.4}");
        // Three frames: the noise of s0 goes with that of the DoLP; the formula holds for N >= 3 equispaced alike.
        assert!((a - 1.0).abs() < 0.02 && (d - 1.0).abs() < 0.02, "N = {n}: {a}, {d}");
        assert!(angle.mean.abs() < 0.004, "N = {n}: the wheel is measured to a tenth of a degree, off {}", angle.mean);
        assert!((degree.mean - p).abs() < 0.004, "N = {n}: {}", degree.mean);
    }
}

/// One clipped frame of four would turn DoLP 0.8 into 0.667 at its worst; dropped, it stays 0.8.
#[test]
fn a_clipped_sample_is_dropped_not_used() {
    let mut board = board_of(64, 64);
    board.emulation.as_mut().unwrap().sensor_noise = false;
    let fetched = capture(&board, (5000.0, 0.8, 0.0), &equispaced(4));
    // The frame at 0° would hold 4500 DN above black; the range ends at 3839.
    let raw = fetched.raw();
    assert!(raw[0].iter().all(|sample| *sample == 4095) && raw[1..].iter().flatten().all(|sample| *sample < 4095));
    assert!(fetched.flags().iter().all(|flags| *flags == Flags::SATURATED));
    let [s0, s1, s2] = [0, 1, 2].map(|component| statistics(&fetched.stokes_dn(component)).mean);
    let dolp = Stokes([s0, s1, s2, 0.0]).dolp();
    assert!((dolp - 0.8).abs() < 2e-3, "{dolp}");
    assert!((s0 / 5000.0 - 1.0).abs() < 2e-3, "{s0}");
    // What using the clipped value would have said.
    let signal = |k: usize| f64::from(raw[k][0]) - 256.0;
    let clipped = 2.0 * (signal(0) - signal(2)).hypot(signal(1) - signal(3)) / (0..4).map(signal).sum::<f64>();
    assert!(clipped < 0.75, "{clipped}");
}
