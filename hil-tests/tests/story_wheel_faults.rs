//! A wheel that jams, slips or loses its encoder: the capture is refused with what happened, nothing is left behind, and
//! after the repair the next one works.
#![expect(clippy::unwrap_used, reason = "a bench that cannot be set up is a failed story")]

use boards::Board;
use firmware_emulator::{AnalyticCamera, BoardWheel, Camera, Clock, EmulatedAs5600, EmulatedServo, World, uniform};
use hil_tests::{Bench, Faults, Faulty, Fetched, Jammed, board_of, capture_request, statistics};
use host_link::in_process::HostEnd;
use host_link::{Client, LinkError};
use protocol_polar::{Degrees, Flags, Stokes};
use protocol_wire::{CaptureId, Exposure, Refusal};
use std::ops::ControlFlow;

const AXES: [f64; 3] = [0.0, 60.0, 120.0];
const AOLP_DEG: f64 = 25.0;

/// A camera whose every chip can fail.
struct Rig {
    bench: Bench,
    world: World,
    servo_power: Faults,
    pwm: Faults,
    bus: Faults,
    sensor: Faults,
}

impl Rig {
    fn new(board: &Board) -> Self {
        let clock = Clock::virtual_time();
        let world = World::new(board, clock.clone());
        let [servo_power, pwm, bus, sensor] = [1, 2, 3, 4].map(Faults::none);
        let servo = EmulatedServo::new(world.clone(), board.wheel.servo.pwm_period_us);
        let servo = Faulty::new(Jammed::new(servo, &servo_power), &pwm);
        let encoder = board_of(16, 16).wheel.encoder.unwrap();
        let chip = Faulty::new(EmulatedAs5600::new(world.clone(), encoder), &bus);
        let wheel = BoardWheel::new(board, servo, chip, clock.clone()).unwrap();
        let field = uniform(board.sensor.width_px, board.sensor.height_px, 2000.0, 0.6, Degrees(AOLP_DEG));
        let camera = Faulty::new(AnalyticCamera::new(board, world.clone(), field), &sensor);
        let bench = Bench::start(Camera::of(board, wheel, camera, clock));
        Self { bench, world, servo_power, pwm, bus, sensor }
    }
}

fn capture(client: &mut Client<HostEnd>, axes: &[f64]) -> Result<CaptureId, Refusal> {
    match client.capture(capture_request(axes, Exposure::Fixed(10_000)), |_| ControlFlow::Continue(())) {
        Ok(id) => Ok(id),
        Err(LinkError::Refused(refusal)) => Err(refusal),
        Err(other) => panic!("{other}"),
    }
}

/// The next capture works, and reads the light as it is.
fn assert_works(client: &mut Client<HostEnd>, axes: &[f64]) {
    let id = capture(client, axes).unwrap();
    let fetched = Fetched::fetch(client, id);
    let [s0, s1, s2] = [0, 1, 2].map(|component| statistics(&fetched.stokes_dn(component)).mean);
    let light = Stokes([s0, s1, s2, 0.0]);
    let off = light.aolp().axis_difference(Degrees(AOLP_DEG).to_radians()).to_degrees();
    assert!(off.0.abs() < 0.3 && (light.dolp() - 0.6).abs() < 0.01, "{light:?}");
    client.release(id).unwrap();
}

#[test]
fn each_fault_is_told_apart_and_leaves_nothing_behind() {
    let rig = Rig::new(&board_of(128, 96));
    let mut client = rig.bench.connect();
    let free = client.status().unwrap().free_bytes;
    let slip = || rig.world.slip(Degrees(12.0));
    let unslip = || rig.world.slip(Degrees(-12.0));
    let is_stuck = |r: &Refusal| matches!(r, Refusal::WheelStuck { .. });
    let is_missed = |r: &Refusal| matches!(r, Refusal::WheelMissed { .. });
    let failed_with =
        |text: &'static str| move |r: &Refusal| matches!(r, Refusal::WheelFailed(why) if why.contains(text));
    let is_camera = |r: &Refusal| matches!(r, Refusal::CameraFailed(why) if why.contains("did not answer"));
    assert_works(&mut client, &AXES);
    type Story<'a> = (&'a str, &'a dyn Fn(), &'a dyn Fn(), &'a dyn Fn(&Refusal) -> bool);
    let stories: [Story<'_>; 7] = [
        ("servo without power", &|| rig.servo_power.always(), &|| rig.servo_power.repair(), &is_stuck),
        ("polarizer loose on its hub", &slip, &unslip, &is_missed),
        ("encoder unplugged", &|| rig.bus.always(), &|| rig.bus.repair(), &failed_with("encoder bus")),
        (
            "encoder unplugged on the way",
            &|| rig.bus.at_calls(8..u64::MAX),
            &|| rig.bus.repair(),
            &failed_with("encoder bus"),
        ),
        ("PWM refuses", &|| rig.pwm.always(), &|| rig.pwm.repair(), &failed_with("servo PWM")),
        ("sensor silent", &|| rig.sensor.always(), &|| rig.sensor.repair(), &is_camera),
        ("sensor silent at the second frame", &|| rig.sensor.at_calls(1..2), &|| rig.sensor.repair(), &is_camera),
    ];
    for (name, harm, repair, is_right) in stories {
        harm();
        let refusal = capture(&mut client, &AXES).unwrap_err();
        assert!(is_right(&refusal), "{name}: {refusal:?}");
        assert_eq!(client.list().unwrap(), [], "{name}");
        assert_eq!(client.status().unwrap().free_bytes, free, "{name}");
        repair();
        assert_works(&mut client, &AXES);
    }
}

#[test]
fn a_wheel_that_jams_says_where_it_is() {
    let rig = Rig::new(&board_of(64, 64));
    let mut client = rig.bench.connect();
    assert_works(&mut client, &AXES);
    rig.servo_power.always();
    let refusal = capture(&mut client, &AXES).unwrap_err();
    // It was left at the last axis.
    let Refusal::WheelStuck { asked_deg, seen_deg } = refusal else { panic!("{refusal:?}") };
    assert!(asked_deg.abs() < 1e-9 && (seen_deg - 120.0).abs() < 1.0, "{refusal:?}");
}

#[test]
fn a_shaky_bus_costs_captures_never_their_truth() {
    let rig = Rig::new(&board_of(64, 64));
    let mut client = rig.bench.connect();
    rig.bus.at_rate(20);
    let (mut good, mut bad) = (0, 0);
    for _ in 0..30 {
        match capture(&mut client, &AXES) {
            Ok(id) => {
                good += 1;
                client.release(id).unwrap();
            }
            Err(Refusal::WheelFailed(_)) => bad += 1,
            Err(other) => panic!("{other:?}"),
        }
    }
    rig.bus.repair();
    assert_works(&mut client, &AXES);
    assert!(good > 3 && bad > 3, "{good} good, {bad} bad");
}

/// Without an encoder nobody sees the wheel, but the light no longer follows the Stokes model.
#[test]
fn without_an_encoder_the_misfit_tells() {
    let mut board = board_of(128, 96);
    board.wheel.encoder = None;
    let rig = Rig::new(&board);
    let mut client = rig.bench.connect();
    let six = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0];
    let mut misfits = || {
        let id = capture(&mut client, &six).unwrap();
        let fetched = Fetched::fetch(&mut client, id);
        assert!(fetched.description.frames.iter().all(|frame| !frame.measured));
        client.release(id).unwrap();
        fetched.flags().iter().filter(|flags| flags.contains(Flags::MISFIT)).count()
    };
    let healthy = misfits();
    // Two motions to the first frame, one to each after it: the fourth frame and all behind it show the third's axis.
    rig.servo_power.at_calls(4..u64::MAX);
    let jammed = misfits();
    rig.servo_power.repair();
    let repaired = misfits();
    println!("misfits of {} photosites: {healthy} healthy, {jammed} jammed, {repaired} repaired", 128 * 96);
    assert!(healthy < 128 * 96 / 100 && repaired < 128 * 96 / 100, "{healthy}, {repaired}");
    // The fit takes up part of it, and a single photosite needs five standard deviations to be flagged.
    assert!(jammed > 128 * 96 / 5, "{jammed}");
}
