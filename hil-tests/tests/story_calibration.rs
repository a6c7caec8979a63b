//! Dark map and flat field, measured against photosites whose differences are known.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use firmware_emulator::{AnalyticCamera, BoardWheel, Camera, Clock, EmulatedAs5600, EmulatedServo, FixedPattern};
use firmware_emulator::{Light, World, uniform};
use hil_tests::{Bench, Fetched, board_of, capture_request, statistics};
use host_link::in_process::HostEnd;
use host_link::{Client, LinkError};
use protocol_polar::Degrees;
use protocol_wire::{Calibrate, Exposure, Refusal};
use std::ops::ControlFlow;

const WIDTH: u32 = 160;
const HEIGHT: u32 = 128;
const S0_DN: f64 = 3000.0;

/// A camera with 5 % of unevenness in gain and up to 40 DN in the dark, without noise.
fn uneven() -> (Bench, Light) {
    let mut board = board_of(WIDTH, HEIGHT);
    board.emulation.as_mut().unwrap().sensor_noise = false;
    let clock = Clock::virtual_time();
    let world = World::new(&board, clock.clone());
    let servo = EmulatedServo::new(world.clone(), board.wheel.servo.pwm_period_us);
    let chip = EmulatedAs5600::new(world.clone(), board.wheel.encoder.clone().unwrap());
    let wheel = BoardWheel::new(&board, servo, chip, clock.clone()).unwrap();
    let field = uniform(WIDTH, HEIGHT, S0_DN, 0.3, Degrees(70.0));
    let pattern = FixedPattern {
        gain: (0..WIDTH * HEIGHT).map(|i| 1.0 + 0.05 * wave(i, 17)).collect(),
        dark_dn: (0..WIDTH * HEIGHT).map(|i| 20.0 + 20.0 * wave(i, 23)).collect(),
    };
    let camera = AnalyticCamera::new(&board, world, field).with_pattern(pattern);
    let light = camera.light();
    (Bench::start(Camera::of(&board, wheel, camera, clock)), light)
}

/// A pattern without a period of strips or of 2, in [−1, 1].
fn wave(i: u32, step: u32) -> f32 {
    #[expect(clippy::cast_precision_loss, reason = "below 101")]
    let place = (i.wrapping_mul(step) % 101) as f32;
    place / 50.0 - 1.0
}

fn capture(client: &mut Client<HostEnd>) -> Fetched {
    let request = capture_request(&[0.0, 60.0, 120.0], Exposure::Fixed(10_000));
    let id = client.capture(request, |_| ControlFlow::Continue(())).unwrap();
    let fetched = Fetched::fetch(client, id);
    client.release(id).unwrap();
    fetched
}

fn calibrate(client: &mut Client<HostEnd>, what: Calibrate) -> Result<(), Refusal> {
    match client.calibrate(what, |_| ControlFlow::Continue(())) {
        Ok(()) => Ok(()),
        Err(LinkError::Refused(refusal)) => Err(refusal),
        Err(other) => panic!("{other}"),
    }
}

/// Standard deviation of s0 relative to its mean.
fn unevenness(fetched: &Fetched) -> f64 {
    let s0 = statistics(&fetched.stokes_dn(0));
    s0.variance.sqrt() / s0.mean
}

#[test]
fn maps_take_the_pattern_out() {
    let (bench, light) = uneven();
    let mut client = bench.connect();
    let bare = capture(&mut client);
    assert!(unevenness(&bare) > 0.02, "{}", unevenness(&bare));
    light.cap();
    calibrate(&mut client, Calibrate::Dark { frames: 8 }).unwrap();
    // Capped, every photosite now reads nothing at all.
    let dark = capture(&mut client);
    for component in 0..3 {
        assert!(dark.stokes_dn(component).iter().all(|dn| dn.abs() < 1e-9));
    }
    assert!(dark.description.calibration.dark_map && !dark.description.calibration.flat_map);
    assert_eq!(dark.replay().differing, 0);
    light.flat(4000.0);
    calibrate(&mut client, Calibrate::Flat { frames: 4 }).unwrap();
    light.scene();
    let even = capture(&mut client);
    assert!(even.description.calibration.dark_map && even.description.calibration.flat_map);
    assert_eq!(even.replay().differing, 0, "the host replays the maps too");
    println!("s0 uneven by {:.4}, with maps by {:.6}", unevenness(&bare), unevenness(&even));
    // Samples and dark levels are whole DN of 1500: rounding is what is left.
    assert!(unevenness(&even) < 5e-4, "{}", unevenness(&even));
    let s0 = statistics(&even.stokes_dn(0)).mean;
    assert!((s0 / S0_DN - 1.0).abs() < 2e-3, "{s0}: the mean photosite keeps gain 1");
    calibrate(&mut client, Calibrate::Clear).unwrap();
    let cleared = capture(&mut client);
    assert!((unevenness(&cleared) - unevenness(&bare)).abs() < 1e-3);
}

#[test]
fn pictures_that_are_no_calibration_are_refused() {
    let (bench, light) = uneven();
    let mut client = bench.connect();
    capture(&mut client);
    let told = |result: Result<(), Refusal>, hint: &str| match result {
        Err(Refusal::BadCalibration(why)) => assert!(why.contains(hint), "{why}"),
        other => panic!("{other:?}, expected {hint}"),
    };
    light.flat(4000.0);
    told(calibrate(&mut client, Calibrate::Dark { frames: 2 }), "cap the lens");
    // Dimmer than the longest exposure brings out, brighter than the shortest bears.
    light.flat(0.5);
    told(calibrate(&mut client, Calibrate::Flat { frames: 3 }), "more light");
    light.flat(1e8);
    assert_eq!(calibrate(&mut client, Calibrate::Flat { frames: 3 }), Err(Refusal::TooBright));
    assert!(matches!(calibrate(&mut client, Calibrate::Dark { frames: 0 }), Err(Refusal::OutOfRange(_))));
    light.scene();
    let after = capture(&mut client).description.calibration;
    assert!(!after.dark_map && !after.flat_map, "what was refused is not applied: {after:?}");
}
