//! Transcripts with values worked out by hand, and laws over random wheels.

use super::*;
use crate::axis_distance;
use crate::test_bench::{Event, Recorder, SERVO};
use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::pwm::{Mock, Transaction};
use proptest::prelude::*;
use std::io::ErrorKind;
use std::vec::Vec;

/// The duty values a wheel sends for moves to `axes` from power-up, checked by transcript.
fn transcript(config: ServoConfig, max_duty: u16, axes: &[f64], duties: &[u16]) {
    let script: Vec<_> = [Transaction::max_duty_cycle(max_duty)]
        .into_iter()
        .chain(duties.iter().map(|d| Transaction::set_duty_cycle(*d)))
        .collect();
    let mut wheel = ServoWheel::new(Mock::new(&script), NoopDelay, config).unwrap();
    for axis in axes {
        wheel.move_to(Degrees(*axis)).unwrap();
    }
    wheel.release().0.done();
}

#[test]
fn a_sweep_runs_up_once_and_then_goes_straight() {
    // One duty count is 1 µs = 0.09°. Servo angle (axis + 50)/1.5 = 33.33, 73.33, 113.33; pulse 500 + 100/9 × angle.
    transcript(SERVO, 20_000, &[0.0, 60.0, 120.0], &[815, 870, 1315, 1759]);
    // The same pulses at 16 bits: × 65535/20000.
    transcript(SERVO, 65_535, &[0.0, 60.0, 120.0], &[2670, 2852, 4308, 5765]);
}

#[test]
fn going_back_goes_past_the_target_first() {
    transcript(SERVO, 20_000, &[120.0, 0.0], &[1704, 1759, 815, 870]);
    let decreasing = ServoConfig { approach: Approach::Decreasing, ..SERVO };
    // 120° → 0°: now the straight way; 0° → 60°: past it (78.33° = 1370 µs) and back.
    transcript(decreasing, 20_000, &[120.0, 0.0, 60.0], &[1815, 1759, 870, 1370, 1315]);
}

#[test]
fn too_short_a_way_is_run_up_to_as_well() {
    // 6° of polarizer are 4° of servo, less than the run-up of 5°; and the present axis is no motion at all.
    transcript(SERVO, 20_000, &[0.0, 6.0, 6.0], &[815, 870, 859, 915, 859, 915]);
}

#[test]
fn a_reversed_gear_turns_the_other_way() {
    // Servo angle (axis − 220)/−1.5 = 146.67, 106.67.
    let reversed = ServoConfig { gear_ratio: -1.5, zero_offset: Degrees(220.0), ..SERVO };
    transcript(reversed, 20_000, &[0.0, 60.0], &[2074, 2130, 1630, 1685]);
}

#[test]
fn every_pulse_is_followed_by_slew_frame_and_settling() {
    let bench = Recorder::new(20_000);
    let mut wheel = ServoWheel::new(bench.clone(), bench.clone(), SERVO).unwrap();
    let first = wheel.move_to(Degrees(0.0)).unwrap();
    let second = wheel.move_to(Degrees(60.0)).unwrap();
    let log = bench.take();
    let [Event::Duty(815), Event::WaitUs(a), Event::Duty(870), Event::WaitUs(b), Event::Duty(1315), Event::WaitUs(c)] =
        log[..]
    else {
        panic!("{log:?}")
    };
    // From anywhere: 815 is 28.35° from one end and 151.65° from the other. Then 55 and 445 counts of 0.09°.
    for (waited, distance_deg) in [(a, 151.65), (b, 4.95), (c, 40.05)] {
        #[expect(clippy::cast_precision_loss, reason = "under a second of microseconds")]
        let over_us = waited as f64 - (distance_deg / 300.0 * 1e6 + 20_000.0 + 80_000.0);
        assert!((-1e-3..1.001).contains(&over_us), "{waited} for {distance_deg}");
    }
    assert_eq!((u64::from(first.waited_us), u64::from(second.waited_us)), (a + b, c));
}

#[test]
fn after_parking_the_position_is_unknown_again() {
    let bench = Recorder::new(20_000);
    let mut wheel = ServoWheel::new(bench.clone(), bench.clone(), SERVO).unwrap();
    wheel.move_to(Degrees(0.0)).unwrap();
    wheel.park().unwrap();
    bench.take();
    wheel.move_to(Degrees(60.0)).unwrap();
    let log = bench.take();
    // Unparked this were the straight 870 -> 1315. 1259 is 68.31° from one end and 111.69° from the other.
    let [Event::Duty(1259), Event::WaitUs(worst), Event::Duty(1315), Event::WaitUs(_)] = log[..] else {
        panic!("{log:?}")
    };
    assert!(worst >= 372_300 + 80_000, "{worst}");
}

#[test]
fn a_pwm_error_is_passed_on_and_the_position_forgotten() {
    let broken = MockError::Io(ErrorKind::BrokenPipe);
    let script = [
        Transaction::max_duty_cycle(20_000),
        Transaction::set_duty_cycle(815),
        Transaction::set_duty_cycle(870),
        Transaction::set_duty_cycle(1315).with_error(broken.clone()),
        Transaction::set_duty_cycle(1259),
        Transaction::set_duty_cycle(1315),
    ];
    let mut wheel = ServoWheel::new(Mock::new(&script), NoopDelay, SERVO).unwrap();
    wheel.move_to(Degrees(0.0)).unwrap();
    assert_eq!(wheel.move_to(Degrees(60.0)), Err(ServoError::Pwm(broken)));
    wheel.move_to(Degrees(60.0)).unwrap();
    wheel.release().0.done();
}

#[test]
fn an_axis_beyond_the_travel_moves_nothing() {
    let bench = Recorder::new(20_000);
    let short = ServoConfig { gear_ratio: 0.5, ..SERVO };
    let mut wheel = ServoWheel::new(bench.clone(), bench.clone(), short).unwrap();
    // The polarizer turns from −47.5° (end of the run-up) to 40°.
    for asked in [45.0, 90.0, 132.0, f64::INFINITY] {
        assert_eq!(wheel.move_to(Degrees(asked)), Err(ServoError::Unreachable { asked: Degrees(asked) }));
    }
    assert!(matches!(wheel.move_to(Degrees(f64::NAN)), Err(ServoError::Unreachable { .. })));
    assert_eq!(bench.take(), []);
    for asked in [39.9, -47.4, 132.6, 0.0] {
        assert!(wheel.move_to(Degrees(asked)).is_ok(), "{asked}");
    }
}

#[test]
fn a_configuration_that_cannot_be_names_its_field() {
    let cases = [
        ("pwm_period_us", ServoConfig { pwm_period_us: 0, ..SERVO }),
        ("pulse_max_us", ServoConfig { pwm_period_us: 2500, ..SERVO }),
        ("pulse_min_us", ServoConfig { pulse_min_us: 2500, ..SERVO }),
        ("travel", ServoConfig { travel: Degrees(0.0), ..SERVO }),
        ("gear_ratio", ServoConfig { gear_ratio: 0.0, ..SERVO }),
        ("zero_offset", ServoConfig { zero_offset: Degrees(f64::NAN), ..SERVO }),
        ("slew_deg_per_s", ServoConfig { slew_deg_per_s: -1.0, ..SERVO }),
        ("backlash", ServoConfig { backlash: Degrees(-1.0), ..SERVO }),
        ("overshoot", ServoConfig { overshoot: Degrees(f64::INFINITY), ..SERVO }),
    ];
    for (field, config) in cases {
        let bench = Recorder::new(20_000);
        let refused = ServoWheel::new(bench.clone(), bench, config).map(|_| ());
        assert_eq!(refused, Err(ServoError::Config(field)));
    }
    // 8 bits over 20 ms are steps of 7°: a run-up of 5° would be no motion.
    let coarse = Recorder::new(255);
    assert_eq!(ServoWheel::new(coarse.clone(), coarse, SERVO).map(|_| ()), Err(ServoError::Config("overshoot")));
}

/// Wheels that reach every axis, half of them with hardly any travel to spare.
fn any_wheel() -> impl Strategy<Value = (ServoConfig, u16)> {
    let reach_deg = prop_oneof![182.0..184.0_f64, 184.0..700.0_f64];
    let approach = prop_oneof![Just(Approach::Increasing), Just(Approach::Decreasing)];
    (reach_deg, any::<bool>(), -360.0..360.0_f64, approach, 0.0..3.0_f64, 2.0..8.0_f64, 5000..=u16::MAX).prop_map(
        |(reach_deg, reversed, zero, approach, backlash, overshoot, max_duty)| {
            let gear_ratio = reach_deg / (180.0 - backlash - overshoot) * if reversed { -1.0 } else { 1.0 };
            let zero_offset = Degrees(zero);
            let (backlash, overshoot) = (Degrees(backlash), Degrees(overshoot));
            (ServoConfig { gear_ratio, zero_offset, approach, backlash, overshoot, ..SERVO }, max_duty)
        },
    )
}

proptest! {
    #[test]
    fn moves_keep_their_promises((config, max_duty) in any_wheel(), axes in prop::collection::vec(-400.0..400.0_f64, 1..6)) {
        let bench = Recorder::new(max_duty);
        let mut wheel = ServoWheel::new(bench.clone(), bench.clone(), config).unwrap();
        let step_us = 20_000.0 / f64::from(max_duty);
        let step_deg = step_us * 0.09;
        let servo_deg = |duty: u16| (f64::from(duty) * step_us - 500.0) * 0.09;
        let mut before = None;
        for asked in axes {
            let moved = wheel.move_to(Degrees(asked)).unwrap();
            let log = bench.take();

            // Half a PWM step (and the half nanosecond a pulse is rounded to), seen at the polarizer.
            let error_deg = axis_distance(moved.commanded, Degrees(asked)).0;
            let bound_deg = config.gear_ratio.abs() * (0.5 * step_deg + 0.5e-3 * 0.09);
            prop_assert!(error_deg <= bound_deg + 1e-9, "{error_deg} > {bound_deg}");

            let mut waited_us = 0;
            let mut last_motion_deg = 0.0;
            for pair in log.chunks(2) {
                let [Event::Duty(duty), Event::WaitUs(wait_us)] = *pair else { panic!("{log:?}") };
                let thousandths = u64::from(duty) * 20_000;
                prop_assert!((500 * u64::from(max_duty)..=2500 * u64::from(max_duty)).contains(&thousandths), "{duty}");
                let from = before.map_or(if servo_deg(duty) < 90.0 { 180.0 } else { 0.0 }, servo_deg);
                last_motion_deg = servo_deg(duty) - from;
                #[expect(clippy::cast_precision_loss, reason = "seconds of microseconds")]
                let spare_us = wait_us as f64 - (last_motion_deg.abs() / 300.0 * 1e6 + 80_000.0);
                prop_assert!(spare_us >= 0.0, "{spare_us}");
                waited_us += wait_us;
                before = Some(duty);
            }
            prop_assert_eq!(waited_us, u64::from(moved.waited_us));
            let towards = if config.approach == Approach::Increasing { last_motion_deg } else { -last_motion_deg };
            prop_assert!(towards >= config.backlash.0 + config.overshoot.0 - step_deg, "{towards}");

            // The end pulse is the commanded axis, worked out here from the pulse alone.
            let end_axis = config.zero_offset.0 + config.gear_ratio * servo_deg(before.unwrap());
            prop_assert!(axis_distance(moved.commanded, Degrees(end_axis)).0 < 1e-9);
        }
    }

    #[test]
    fn one_axis_has_one_servo_position((config, max_duty) in any_wheel(), axis in 0.0..180.0_f64, detour in 0.0..180.0_f64) {
        let bench = Recorder::new(max_duty);
        let mut wheel = ServoWheel::new(bench.clone(), bench.clone(), config).unwrap();
        let mut end_of = |a: f64| {
            wheel.move_to(Degrees(a)).unwrap();
            bench.take().into_iter().rev().find(|e| matches!(e, Event::Duty(_)))
        };
        let at_first = end_of(axis);
        end_of(detour);
        prop_assert_eq!(end_of(axis), at_first);
    }
}
