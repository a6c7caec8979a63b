//! The servo's PWM channel: duty in, pulse to the world.

use crate::World;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use std::convert::Infallible;

/// A PWM channel at the servo's signal period, in 65 535 steps.
#[derive(Clone, Debug)]
pub struct EmulatedServo {
    world: World,
    period_us: f64,
}

impl EmulatedServo {
    /// The channel of this world's servo.
    #[must_use]
    pub fn new(world: World, pwm_period_us: u32) -> Self {
        Self { world, period_us: pwm_period_us.into() }
    }
}

impl ErrorType for EmulatedServo {
    type Error = Infallible;
}

impl SetDutyCycle for EmulatedServo {
    fn max_duty_cycle(&self) -> u16 {
        u16::MAX
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.world.pulse(f64::from(duty) / f64::from(u16::MAX) * self.period_us);
        Ok(())
    }
}
