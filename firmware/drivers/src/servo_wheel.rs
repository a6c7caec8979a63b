//! A hobby servo that turns a polarizer through a gear.
//!
//! Polarizer axis = zero offset + gear ratio × servo angle, in the camera frame. Every position is reached by a last
//! motion in one direction over at least backlash + overshoot, so the play of the gear always lies on the same side and
//! belongs to the zero offset. One axis always has one servo position, whatever came before: the reachable one nearest
//! the middle of the travel. What the gear's eccentricity and the polarizer's wedge do there, they do every time.

use embedded_hal::delay::DelayNs;
use embedded_hal::pwm::SetDutyCycle;
use protocol_polar::Degrees;

use crate::as_axis;

/// Direction of the last motion of every move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Approach {
    /// Towards longer pulses.
    Increasing,
    /// Towards shorter pulses.
    Decreasing,
}

/// A servo, its gear and how to move it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoConfig {
    /// Pulse at servo angle 0, and the shortest ever sent.
    pub pulse_min_us: u32,
    /// Pulse at the end of the travel, and the longest ever sent.
    pub pulse_max_us: u32,
    /// Servo angle between the two pulses, > 0.
    pub travel: Degrees,
    /// One frame of the servo signal; the PWM runs at this period.
    pub pwm_period_us: u32,
    /// Polarizer turns per servo turn; negative where the gear reverses, never 0.
    pub gear_ratio: f64,
    /// Polarizer axis at servo angle 0, reached by the one-sided approach.
    pub zero_offset: Degrees,
    /// Servo speed under load, degrees per second, > 0.
    pub slew_deg_per_s: f64,
    /// Rest after a motion before the wheel counts as still.
    pub settle_us: u32,
    /// Play of gear and servo together, at the servo, >= 0.
    pub backlash: Degrees,
    /// How far beyond the backlash a run-up starts, at the servo, >= 0.
    pub overshoot: Degrees,
    /// Direction of the last motion of every move.
    pub approach: Approach,
}

/// What one move did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// The axis the PWM really asks for, in [0°, 180°): within half a PWM step of the one asked.
    pub commanded: Degrees,
    /// Time spent waiting for it, run-up included.
    pub waited_us: u32,
}

/// Why the wheel did not move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ServoError<E> {
    /// The named field of [`ServoConfig`] makes no sense, alone or with this PWM's resolution.
    Config(&'static str),
    /// No servo position with room for its run-up carries this axis.
    Unreachable {
        /// The axis asked for.
        asked: Degrees,
    },
    /// The PWM refused. Where the servo is now is not known.
    Pwm(E),
}

/// A polarizer turned by a servo; owns the PWM channel and the delay.
#[derive(Debug)]
pub struct ServoWheel<PWM, D> {
    pwm: PWM,
    delay: D,
    config: ServoConfig,
    scale: Scale,
    /// Where the servo is; `None` at power-up, after parking and after a PWM error.
    position: Option<Duty>,
}

/// A PWM duty value: the servo position as the hardware has it.
type Duty = u16;

/// Where a move ends and where its last motion starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Target {
    run_up: Duty,
    end: Duty,
}

impl<PWM: SetDutyCycle, D: DelayNs> ServoWheel<PWM, D> {
    /// A wheel at rest in an unknown position; the PWM is not touched but for its resolution.
    ///
    /// # Errors
    /// [`ServoError::Config`] with the first field that cannot be.
    pub fn new(pwm: PWM, delay: D, config: ServoConfig) -> Result<Self, ServoError<PWM::Error>> {
        let scale = Scale::new(&config, pwm.max_duty_cycle()).map_err(ServoError::Config)?;
        Ok(Self { pwm, delay, config, scale, position: None })
    }

    /// Turns the polarizer to `axis` and waits until it is still by the servo's own figures.
    ///
    /// Goes straight where that is a motion of at least backlash + overshoot in the approach direction; else first to the
    /// start of a run-up of that length. Asking for the present axis runs up to it again.
    ///
    /// # Errors
    /// [`ServoError::Unreachable`] before anything moves, [`ServoError::Pwm`] at any time.
    pub fn move_to(&mut self, axis: Degrees) -> Result<Move, ServoError<PWM::Error>> {
        let target = self.target(axis).ok_or(ServoError::Unreachable { asked: axis })?;
        let straight = self.position.is_some_and(|p| match self.config.approach {
            Approach::Increasing => p <= target.run_up,
            Approach::Decreasing => p >= target.run_up,
        });
        let run_up_us = if straight { 0 } else { self.go(target.run_up)? };
        let waited_us = run_up_us.saturating_add(self.go(target.end)?);
        Ok(Move { commanded: self.axis_at(target.end), waited_us })
    }

    /// Stops the pulses: the servo draws no holding current and may be turned by hand, so its position is forgotten.
    ///
    /// # Errors
    /// [`ServoError::Pwm`].
    pub fn park(&mut self) -> Result<(), ServoError<PWM::Error>> {
        self.position = None;
        self.pwm.set_duty_cycle_fully_off().map_err(ServoError::Pwm)
    }

    /// Gives PWM and delay back. The servo keeps the last pulse: [`ServoWheel::park`] first where it shall rest.
    pub fn release(self) -> (PWM, D) {
        (self.pwm, self.delay)
    }

    /// Waits on the wheel's own clock, for whoever waits for the wheel by other means.
    pub(crate) fn wait_us(&mut self, us: u32) {
        self.delay.delay_us(us);
    }

    /// One motion: sets the pulse, waits for it to be over. Returns the time waited.
    fn go(&mut self, to: Duty) -> Result<u32, ServoError<PWM::Error>> {
        let from = self.position.take();
        self.pwm.set_duty_cycle(to).map_err(ServoError::Pwm)?;
        let worst_deg = libm::fmax(self.scale.angle_deg(to), self.config.travel.0 - self.scale.angle_deg(to));
        let distance_deg = from.map_or(worst_deg, |f| libm::fabs(self.scale.angle_deg(f) - self.scale.angle_deg(to)));
        let slew_us = whole_us(distance_deg / self.config.slew_deg_per_s * 1e6);
        // The servo hears of the new pulse one frame late at worst.
        let waited_us = slew_us.saturating_add(self.config.pwm_period_us).saturating_add(self.config.settle_us);
        self.delay.delay_us(waited_us);
        self.position = Some(to);
        Ok(waited_us)
    }

    /// The one servo position for `axis`: nearest the middle of what leaves room for the run-up.
    fn target(&self, axis: Degrees) -> Option<Target> {
        let c = &self.config;
        let run_up_deg = match c.approach {
            Approach::Increasing => -(c.backlash.0 + c.overshoot.0),
            Approach::Decreasing => c.backlash.0 + c.overshoot.0,
        };
        // Positions from max(0, −run-up) to min(travel, travel − run-up) have their run-up inside the travel too.
        let middle_deg = 0.5 * (c.travel.0 - run_up_deg);
        let half_turn_deg = 180.0 / c.gear_ratio;
        let base_deg = (axis.0 - c.zero_offset.0) / c.gear_ratio;
        let nearest_deg = base_deg + half_turn_deg * libm::round((middle_deg - base_deg) / half_turn_deg);
        let end = self.scale.duty(nearest_deg)?;
        let run_up = self.scale.duty(nearest_deg + run_up_deg)?;
        Some(Target { run_up, end })
    }

    fn axis_at(&self, duty: Duty) -> Degrees {
        as_axis(Degrees(self.config.zero_offset.0 + self.config.gear_ratio * self.scale.angle_deg(duty)))
    }
}

/// Servo angle ↔ pulse ↔ duty value. Pulses are whole nanoseconds, and all rounding after that is in integers.
#[derive(Clone, Copy, Debug)]
struct Scale {
    pulse_min_us: u32,
    pulse_max_us: u32,
    travel_deg: f64,
    period_ns: u64,
    max_duty: Duty,
}

impl Scale {
    /// Checks the whole configuration, for a PWM of resolution `max_duty`; the error is the field at fault.
    fn new(c: &ServoConfig, max_duty: Duty) -> Result<Self, &'static str> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let scale = Self {
            pulse_min_us: c.pulse_min_us,
            pulse_max_us: c.pulse_max_us,
            travel_deg: c.travel.0,
            period_ns: u64::from(c.pwm_period_us) * 1000,
            max_duty,
        };
        // A servo period is some 20 ms; a second keeps every product below in range.
        let faults = [
            ("pwm_period_us", c.pwm_period_us == 0 || c.pwm_period_us > 1_000_000 || max_duty == 0),
            ("pulse_max_us", c.pulse_max_us >= c.pwm_period_us),
            ("pulse_min_us", c.pulse_min_us == 0 || c.pulse_min_us >= c.pulse_max_us),
            ("travel", !positive(c.travel.0)),
            ("gear_ratio", !positive(libm::fabs(c.gear_ratio))),
            ("zero_offset", !c.zero_offset.0.is_finite()),
            ("slew_deg_per_s", !positive(c.slew_deg_per_s)),
            ("backlash", !(c.backlash.0.is_finite() && c.backlash.0 >= 0.0)),
            ("overshoot", !(c.overshoot.0.is_finite() && c.overshoot.0 >= 0.0)),
        ];
        if let Some((field, _)) = faults.iter().find(|(_, fault)| *fault) {
            return Err(field);
        }
        // A run-up shorter than one PWM step would be no motion at all.
        let step_deg = scale.degrees_per_us() * f64::from(c.pwm_period_us) / f64::from(max_duty);
        if c.backlash.0 + c.overshoot.0 < step_deg { Err("overshoot") } else { Ok(scale) }
    }

    fn degrees_per_us(&self) -> f64 {
        self.travel_deg / f64::from(self.pulse_max_us - self.pulse_min_us)
    }

    /// The duty value nearest to `servo_deg`; `None` where its pulse would leave [min, max].
    fn duty(&self, servo_deg: f64) -> Option<Duty> {
        let pulse_ns = libm::round(1000.0 * (f64::from(self.pulse_min_us) + servo_deg / self.degrees_per_us()));
        // Far enough out not to refuse what rounding brings back in; the exact bound is below, in integers.
        if !(0.0..=f64::from(u32::MAX)).contains(&pulse_ns) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range: checked above"
        )]
        let pulse_ns = pulse_ns as u64;
        let max_duty = u64::from(self.max_duty);
        let duty = (pulse_ns * max_duty + self.period_ns / 2) / self.period_ns;
        // duty / max_duty × period within [min, max], without a division.
        let allowed = u64::from(self.pulse_min_us) * 1000 * max_duty..=u64::from(self.pulse_max_us) * 1000 * max_duty;
        if allowed.contains(&(duty * self.period_ns)) { Duty::try_from(duty).ok() } else { None }
    }

    /// The servo angle a duty value stands for.
    fn angle_deg(&self, duty: Duty) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most 1e9: exact")]
        let pulse_us = f64::from(duty) * (self.period_ns as f64) / f64::from(self.max_duty) / 1000.0;
        (pulse_us - f64::from(self.pulse_min_us)) * self.degrees_per_us()
    }
}

/// Whole microseconds, rounded up; saturates. `us` >= 0.
fn whole_us(us: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "float casts saturate, as is wanted")]
    let whole = libm::ceil(us) as u32;
    whole
}

#[cfg(test)]
#[path = "servo_wheel_tests.rs"]
mod tests;
