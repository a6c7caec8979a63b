//! The board's wheel: the drivers of its chips, as the camera's decisions want it.

use crate::{Clock, EmulatorError};
use boards::{Approach, Board};
use embedded_hal::i2c::I2c;
use embedded_hal::pwm::SetDutyCycle;
use firmware_core::{Wheel, WheelAxis, WheelError, text};
use firmware_drivers::{
    ArrivalConfig, EncodedWheel, EncoderConfig, EncoderError, ServoConfig, ServoError, ServoWheel, WheelEncoder,
    WheelError as DriverError,
};
use protocol_polar::Degrees;
use std::fmt::Debug;

/// Servo and encoder of a board file, behind any PWM channel and I²C bus.
#[derive(Debug)]
pub struct BoardWheel<PWM, I2C>(EncodedWheel<PWM, Clock, I2C>);

impl<PWM: SetDutyCycle, I2C: I2c> BoardWheel<PWM, I2C> {
    /// Wires the wheel of `board`; `i2c` is the encoder's bus and is not used where the board has none.
    ///
    /// # Errors
    /// [`EmulatorError::Servo`] where the board's servo does not go with this PWM.
    pub fn new(board: &Board, pwm: PWM, i2c: I2C, clock: Clock) -> Result<Self, EmulatorError> {
        let (wheel, servo) = (&board.wheel, &board.wheel.servo);
        let config = ServoConfig {
            pulse_min_us: servo.pulse_min_us,
            pulse_max_us: servo.pulse_max_us,
            travel: Degrees(servo.travel_deg),
            pwm_period_us: servo.pwm_period_us,
            gear_ratio: wheel.gear_ratio,
            zero_offset: Degrees(wheel.zero_offset_deg),
            slew_deg_per_s: servo.slew_deg_per_s,
            settle_us: servo.settle_ms * 1000,
            backlash: Degrees(servo.backlash_deg),
            overshoot: Degrees(servo.overshoot_deg),
            approach: match servo.approach {
                Approach::Increasing => firmware_drivers::Approach::Increasing,
                Approach::Decreasing => firmware_drivers::Approach::Decreasing,
            },
        };
        let servo = ServoWheel::new(pwm, clock, config).map_err(|error| EmulatorError::Servo(servo_text(&error)))?;
        let encoder = wheel.encoder.as_ref().map(|encoder| {
            let config = EncoderConfig {
                address: encoder.i2c_address,
                offset: Degrees(encoder.offset_deg),
                turns_per_polarizer_turn: encoder.turns_per_polarizer_turn,
            };
            let tolerance = Degrees(encoder.tolerance_deg);
            let arrival = ArrivalConfig { tolerance, timeout_us: encoder.timeout_ms * 1000 };
            (WheelEncoder::new(i2c, config), arrival)
        });
        Ok(Self(EncodedWheel::new(servo, encoder)))
    }
}

impl<PWM: SetDutyCycle, I2C: I2c> Wheel for BoardWheel<PWM, I2C> {
    fn move_to(&mut self, axis: Degrees) -> Result<WheelAxis, WheelError> {
        match self.0.move_to(axis) {
            Ok(arrival) => Ok(WheelAxis { angle: arrival.axis(), measured: arrival.measured.is_some() }),
            Err(DriverError::Stuck { asked, seen }) => Err(WheelError::Stuck { asked, seen }),
            Err(DriverError::Missed { asked, seen }) => Err(WheelError::Missed { asked, seen }),
            Err(DriverError::Servo(error)) => Err(WheelError::Failed(text(&servo_text(&error)))),
            Err(DriverError::Encoder(error)) => Err(WheelError::Failed(text(&encoder_text(&error)))),
            Err(other) => Err(WheelError::Failed(text(&format!("{other:?}")))),
        }
    }
}

fn servo_text<E: Debug>(error: &ServoError<E>) -> String {
    match error {
        ServoError::Config(field) => format!("servo: `{field}` cannot be"),
        ServoError::Unreachable { asked } => format!("servo: no position for axis {}°", asked.0),
        ServoError::Pwm(error) => format!("servo PWM: {error:?}"),
        other => format!("servo: {other:?}"),
    }
}

fn encoder_text<E: Debug>(error: &EncoderError<E>) -> String {
    match error {
        EncoderError::Bus(error) => format!("encoder bus: {error:?}"),
        EncoderError::MagnetMissing => "encoder: no magnet".to_owned(),
        EncoderError::MagnetTooWeak => "encoder: magnet too far".to_owned(),
        EncoderError::MagnetTooStrong => "encoder: magnet too near".to_owned(),
        other => format!("encoder: {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EmulatedAs5600, EmulatedServo, World};
    use std::path::Path;

    /// The drivers' model of the wheel and the world's are written apart; here they meet.
    #[test]
    fn what_the_wheel_says_is_where_the_polarizer_is() {
        for encoded in [true, false] {
            let mut board = Board::parse(boards::EMULATED_TOML, Path::new("emulated.toml")).unwrap();
            let clock = Clock::virtual_time();
            let world = World::new(&board, clock.clone());
            let servo = EmulatedServo::new(world.clone(), board.wheel.servo.pwm_period_us);
            let chip = EmulatedAs5600::new(world.clone(), board.wheel.encoder.clone().unwrap());
            if !encoded {
                board.wheel.encoder = None;
            }
            let mut wheel = BoardWheel::new(&board, servo, chip, clock).unwrap();
            // Half a count of the encoder and what is left of the ringing; four standard deviations of the jitter.
            let limit_deg = if encoded { 0.05 } else { 0.4 };
            for asked in [0.0, 60.0, 120.0, 45.0, 90.0, 0.0, 179.9, -33.0, 1000.0] {
                let said = wheel.move_to(Degrees(asked)).unwrap();
                assert_eq!(said.measured, encoded);
                let off = said.angle.to_radians().axis_difference(world.axis_radians()).to_degrees();
                assert!(off.0.abs() < limit_deg, "asked {asked}, said {said:?}, off by {off:?}");
                let missed = Degrees(asked).to_radians().axis_difference(world.axis_radians()).to_degrees();
                assert!(missed.0.abs() < 0.5, "asked {asked}, missed by {missed:?}");
            }
        }
    }
}
