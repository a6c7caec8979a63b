//! Ranges and contradictions: what the types of the schema cannot say.

use std::fmt::Display;
use std::ops::RangeInclusive;

use protocol_polar::{Degrees, MAX_FRAMES, distinct_axes};

use crate::schema::{Board, BoardKind, Encoder, Memory, Polarizer, Sensor, Servo, Stokes, Wheel};

/// Axes closer than this are the same measurement.
const SAME_AXIS: Degrees = Degrees(1.0);

/// Polarizer travel that reaches every axis: half a turn, and a degree for pulses that fall between two PWM steps at the
/// ends of the travel.
const NEEDED_REACH_DEG: f64 = 181.0;

/// A value that cannot be, by its dotted key.
pub(crate) struct Violation {
    pub(crate) key: &'static str,
    pub(crate) value: String,
    pub(crate) allowed: String,
}

/// The first value of `board`, in the order of the schema, that lies outside its range.
pub(crate) fn first_violation(board: &Board) -> Option<Violation> {
    let sensor_height_px = board.sensor.height_px;
    [
        named("board.name", &board.identity.name),
        named("board.serial", &board.identity.serial),
        sensor(&board.sensor),
        servo(&board.wheel.servo),
        wheel(&board.wheel),
        polarizer(&board.wheel.polarizer),
        board.wheel.encoder.as_ref().and_then(encoder),
        stokes(&board.stokes),
        within("usb.vendor_id", board.usb.vendor_id, 1.0..=f64::from(u16::MAX)),
        memory(&board.memory, sensor_height_px),
        emulation(board),
    ]
    .into_iter()
    .flatten()
    .next()
}

fn sensor(s: &Sensor) -> Option<Violation> {
    within("sensor.width_px", s.width_px, 16.0..=16384.0)
        .or_else(|| within("sensor.height_px", s.height_px, 16.0..=16384.0))
        .or_else(|| within("sensor.pixel_pitch_um", s.pixel_pitch_um, 0.5..=50.0))
        .or_else(|| within("sensor.bit_depth", s.bit_depth, 8.0..=16.0))
        .or_else(|| within("sensor.white_level_dn", s.white_level_dn, 1.0..=f64::from(s.bit_depth).exp2() - 1.0))
        .or_else(|| within("sensor.black_level_dn", s.black_level_dn, 0.0..=f64::from(s.white_level_dn) - 1.0))
        .or_else(|| within("sensor.full_well_e", s.full_well_e, 100.0..=1e7))
        .or_else(|| within("sensor.read_noise_e", s.read_noise_e, 0.0..=1000.0))
        .or_else(|| within("sensor.gain_e_per_dn", s.gain_e_per_dn, 1e-3..=1e4))
        .or_else(|| within("sensor.exposure_max_us", s.exposure_max_us, 1.0..=600e6))
        .or_else(|| within("sensor.exposure_min_us", s.exposure_min_us, 1.0..=f64::from(s.exposure_max_us)))
}

fn servo(s: &Servo) -> Option<Violation> {
    within("wheel.servo.pwm_period_us", s.pwm_period_us, 2000.0..=50_000.0)
        .or_else(|| within("wheel.servo.pulse_max_us", s.pulse_max_us, 200.0..=f64::from(s.pwm_period_us) - 1.0))
        .or_else(|| within("wheel.servo.pulse_min_us", s.pulse_min_us, 100.0..=f64::from(s.pulse_max_us) - 100.0))
        .or_else(|| within("wheel.servo.travel_deg", s.travel_deg, 10.0..=3600.0))
        .or_else(|| within("wheel.servo.slew_deg_per_s", s.slew_deg_per_s, 1.0..=5000.0))
        .or_else(|| within("wheel.servo.settle_ms", s.settle_ms, 0.0..=10_000.0))
        .or_else(|| within("wheel.servo.backlash_deg", s.backlash_deg, 0.0..=30.0))
        .or_else(|| within("wheel.servo.overshoot_deg", s.overshoot_deg, 0.5..=45.0))
}

fn wheel(w: &Wheel) -> Option<Violation> {
    let reach_deg = w.gear_ratio.abs() * (w.servo.travel_deg - w.servo.backlash_deg - w.servo.overshoot_deg);
    let turns_far_enough = w.gear_ratio.is_finite() && reach_deg >= NEEDED_REACH_DEG;
    violation_unless(turns_far_enough, "wheel.gear_ratio", w.gear_ratio, || {
        format!("|gear_ratio| × (travel_deg − backlash_deg − overshoot_deg) >= {NEEDED_REACH_DEG}, here {reach_deg:.1}")
    })
    .or_else(|| within("wheel.gear_ratio", w.gear_ratio, -20.0..=20.0))
    .or_else(|| within("wheel.zero_offset_deg", w.zero_offset_deg, -360.0..=360.0))
}

fn polarizer(p: &Polarizer) -> Option<Violation> {
    within("wheel.polarizer.extinction_ratio", p.extinction_ratio, 2.0..=1e8)
        .or_else(|| within("wheel.polarizer.transmission", p.transmission, 0.01..=1.0))
}

fn encoder(e: &Encoder) -> Option<Violation> {
    // One turn of the encoder must be a whole number of half turns of the polarizer, or a reading names no single axis.
    let half_turns = (2.0 / e.turns_per_polarizer_turn).abs();
    let names_one_axis = half_turns.is_finite() && half_turns > 0.5 && (half_turns - half_turns.round()).abs() < 1e-6;
    within("wheel.encoder.i2c_address", e.i2c_address, f64::from(0x08)..=f64::from(0x77))
        .or_else(|| within("wheel.encoder.offset_deg", e.offset_deg, -360.0..=360.0))
        .or_else(|| {
            violation_unless(
                names_one_axis,
                "wheel.encoder.turns_per_polarizer_turn",
                e.turns_per_polarizer_turn,
                || "±2/n for a whole n >= 1, so that a reading names one axis".to_owned(),
            )
        })
        .or_else(|| within("wheel.encoder.tolerance_deg", e.tolerance_deg, 0.1..=20.0))
        .or_else(|| within("wheel.encoder.timeout_ms", e.timeout_ms, 1.0..=10_000.0))
}

fn stokes(s: &Stokes) -> Option<Violation> {
    let axes: Vec<_> = s.angles_deg.iter().map(|a| Degrees(*a).to_radians()).collect();
    let key = "stokes.angles_deg";
    let listed = format!("{:?}", s.angles_deg);
    violation_unless((3..=MAX_FRAMES).contains(&axes.len()), key, &listed, || format!("3 to {MAX_FRAMES} angles"))
        .or_else(|| {
            let allowed = -360.0..=360.0;
            violation_unless(s.angles_deg.iter().all(|a| allowed.contains(a)), key, &listed, || {
                "each from -360 to 360".to_owned()
            })
        })
        .or_else(|| {
            violation_unless(distinct_axes(&axes, SAME_AXIS.to_radians()) >= 3, key, &listed, || {
                format!("at least 3 axes more than {}° apart (0° and 180° are one axis)", SAME_AXIS.0)
            })
        })
        .or_else(|| within("stokes.misfit_sigma", s.misfit_sigma, 1.0..=100.0))
}

fn memory(m: &Memory, sensor_height_px: u32) -> Option<Violation> {
    within("memory.budget_mb", m.budget_mb, 1.0..=65536.0)
        .or_else(|| within("memory.strip_rows", m.strip_rows, 1.0..=f64::from(sensor_height_px)))
}

fn emulation(board: &Board) -> Option<Violation> {
    let emulation = board.emulation.as_ref()?;
    violation_unless(board.identity.kind == BoardKind::Emulated, "emulation", "a table", || {
        "none, unless board.kind is \"emulated\"".to_owned()
    })
    .or_else(|| within("emulation.wheel_jitter_deg", emulation.wheel_jitter_deg, 0.0..=10.0))
}

fn named(key: &'static str, text: &str) -> Option<Violation> {
    violation_unless(!text.trim().is_empty(), key, format!("{text:?}"), || "a name that is not blank".to_owned())
}

/// NaN is in no range, so it is refused like every other value that makes no sense.
fn within(key: &'static str, value: impl Into<f64>, allowed: RangeInclusive<f64>) -> Option<Violation> {
    let value = value.into();
    violation_unless(allowed.contains(&value), key, value, || format!("{} to {}", allowed.start(), allowed.end()))
}

fn violation_unless(
    holds: bool,
    key: &'static str,
    value: impl Display,
    allowed: impl FnOnce() -> String,
) -> Option<Violation> {
    (!holds).then(|| Violation { key, value: value.to_string(), allowed: allowed() })
}
