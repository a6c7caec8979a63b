//! Auto exposure: one exposure for all angles, at which none clips, and never darker than it must be.

use firmware_emulator::{AnalyticCamera, BoardWheel, Camera, Clock, EmulatedAs5600, EmulatedServo, World};
use hil_tests::{Bench, Fetched, board_of, capture_request, statistics};
use host_link::LinkError;
use protocol_polar::{Degrees, Flags, Radians, Stokes};
use protocol_wire::{Exposure, Refusal, Word};
use std::ops::ControlFlow;

const WIDTH: u32 = 160;
const HEIGHT: u32 = 120;

/// Brightness rising from left to right, the angle of polarization turning downwards: no frame is the brightest everywhere.
fn ramp() -> Vec<[f32; 3]> {
    let at = |row: u32, column: u32| {
        let s0 = 100.0 + 1900.0 * f64::from(column) / f64::from(WIDTH);
        let aolp = Radians(std::f64::consts::PI * f64::from(row) / f64::from(HEIGHT));
        let [s0, s1, s2, _] = Stokes::linear(s0, 0.6, aolp).0;
        #[expect(clippy::cast_possible_truncation, reason = "24 bits will do")]
        let stokes = [s0 as f32, s1 as f32, s2 as f32];
        stokes
    };
    (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| at(row, column))).collect()
}

#[test]
fn from_dim_to_bright_no_angle_clips_and_none_is_darker_than_needed() {
    let board = board_of(WIDTH, HEIGHT);
    let clock = Clock::virtual_time();
    let world = World::new(&board, clock.clone());
    let servo = EmulatedServo::new(world.clone(), board.wheel.servo.pwm_period_us);
    let chip = EmulatedAs5600::new(world.clone(), board.wheel.encoder.clone().unwrap());
    let wheel = BoardWheel::new(&board, servo, chip, clock.clone()).unwrap();
    let camera = AnalyticCamera::new(&board, world, ramp());
    let light = camera.light();
    let bench = Bench::start(Camera::of(&board, wheel, camera, clock));
    let mut client = bench.connect();
    let sensor = client.identity().sensor.clone();
    let range = f64::from(sensor.white_level_dn - sensor.black_level_dn);
    let (mut at_limit, mut within) = (0, 0);
    // Up and down: each search starts from the exposure of the one before.
    for factor in [1.0, 0.1, 0.01, 0.001, 10.0, 100.0, 300.0, 3.0, 0.03] {
        light.dimmed(factor);
        let request = capture_request(&[0.0, 60.0, 120.0], Exposure::Auto);
        let id = client.capture(request, |_| ControlFlow::Continue(())).unwrap();
        let fetched = Fetched::fetch(&mut client, id);
        client.release(id).unwrap();
        let exposure_us = fetched.description.frames[0].exposure_us;
        assert!(fetched.description.frames.iter().all(|frame| frame.exposure_us == exposure_us), "one for all angles");
        assert!(fetched.flags().iter().all(|flags| !flags.contains(Flags::SATURATED)), "light {factor}: clips");
        let peak = fetched.raw().into_iter().flatten().max().unwrap();
        let share = f64::from(peak - sensor.black_level_dn) / range;
        println!("light {factor}: {exposure_us} µs, brightest sample at {share:.2} of the range");
        if exposure_us == board.sensor.exposure_max_us {
            at_limit += 1;
        } else {
            within += 1;
            assert!(share > 0.75, "light {factor}: {share} of the range at {exposure_us} µs");
        }
    }
    assert!(at_limit > 0 && within > 4, "{at_limit} at the longest exposure, {within} within");
    light.dimmed(1e6);
    let blinded = client.capture(capture_request(&[0.0, 60.0, 120.0], Exposure::Auto), |_| ControlFlow::Continue(()));
    assert!(matches!(blinded, Err(LinkError::Refused(Refusal::TooBright))), "{blinded:?}");
    assert_eq!(client.list().unwrap(), []);
}

/// Three axes, each at full and at a sixteenth of the exposure: what clips in the long frames is read from the short ones,
/// and the planes' format has four bits more for it.
#[test]
fn a_bracket_reads_a_lamp_and_the_shade_beside_it() {
    let lights = [(100.0, 0.2, 10.0), (20_000.0, 0.4, 130.0)];
    let halves = lights.map(|(s0, dolp, aolp_deg)| Stokes::linear(s0, dolp, Degrees(aolp_deg).to_radians()).0);
    #[expect(clippy::cast_possible_truncation, reason = "24 bits will do")]
    let field = (0..HEIGHT * WIDTH).map(|i| {
        let [s0, s1, s2, _] = halves[usize::from(i % WIDTH >= WIDTH / 2)];
        [s0 as f32, s1 as f32, s2 as f32]
    });
    let camera = Camera::analytic(&board_of(WIDTH, HEIGHT), field.collect(), Clock::virtual_time()).unwrap();
    let light = camera.sensor.light();
    let bench = Bench::start(camera);
    let mut client = bench.connect();
    let mut request = capture_request(&[0.0, 60.0, 120.0, 0.0, 60.0, 120.0], Exposure::Fixed(10_000));
    request.word = Word::I32;
    let long_only = request.clone();
    for frame in &mut request.frames[3..] {
        frame.exposure_ratio = 1.0 / 16.0;
    }
    let mut capture = |request| {
        let id = client.capture(request, |_| ControlFlow::Continue(())).unwrap();
        let fetched = Fetched::fetch(&mut client, id);
        assert_eq!(fetched.replay().differing, 0);
        fetched
    };
    let bracket = capture(request.clone());
    let flags = bracket.flags();
    for (half, (s0_dn, dolp, aolp_deg)) in lights.into_iter().enumerate() {
        let inside = |i: &usize| usize::from(i % WIDTH as usize >= WIDTH as usize / 2) == half;
        let mean = [0, 1, 2].map(|component| {
            let plane = bracket.stokes_dn(component);
            statistics(&(0..plane.len()).filter(inside).map(|i| plane[i]).collect::<Vec<_>>()).mean
        });
        let seen = Stokes([mean[0], mean[1], mean[2], 0.0]);
        let off = seen.aolp().axis_difference(Degrees(aolp_deg).to_radians()).to_degrees();
        println!("s0 {:.1}, DoLP {:.4}, AoLP off by {:.3}°", seen.0[0], seen.dolp(), off.0);
        assert!((seen.0[0] / s0_dn - 1.0).abs() < 0.01 && (seen.dolp() - dolp).abs() < 0.01 && off.0.abs() < 0.7);
        assert!((0..flags.len()).filter(inside).all(|i| flags[i].contains(Flags::SATURATED) == (half == 1)));
        assert!(flags.iter().all(|flags| !flags.contains(Flags::TOO_FEW)));
    }
    // Twice the light: the long frames hold no part of the lamp, the short ones all of it, and so do the planes.
    light.dimmed(2.0);
    let brighter = capture(request);
    let out_of_range = |flags: &Flags| flags.contains(Flags::OUT_OF_RANGE);
    assert!(!brighter.flags().iter().any(out_of_range));
    assert!((brighter.stokes_dn(0)[WIDTH as usize - 1] / 40_000.0 - 1.0).abs() < 0.2);
    light.scene();
    let blind = capture(long_only).flags();
    assert_eq!(blind.iter().filter(|flags| flags.contains(Flags::TOO_FEW)).count(), blind.len() / 2);
}
