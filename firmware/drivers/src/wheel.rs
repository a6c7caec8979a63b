//! The wheel as a capture sees it: a servo that turns it and, where there is one, an encoder that says where it is.
//!
//! Without an encoder a move is believed after the servo's own slew and settling time. With one it is over when the
//! encoder sees the polarizer at the commanded axis and at rest, and the reading is what travels with the frame.

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;
use embedded_hal::pwm::SetDutyCycle;
use protocol_polar::Degrees;

use crate::{EncoderError, Move, ServoError, ServoWheel, WheelEncoder, axis_distance};

/// Time between two looks at the encoder, beyond the 2.2 ms its slowest filter takes to settle (AS5600 datasheet v1-06,
/// "Step Response and Filter Settings").
const POLL_US: u32 = 5000;
/// Two looks closer than this see a wheel at rest: three times the chip's noise, and 30°/s over [`POLL_US`].
const AT_REST: Degrees = Degrees(0.15);

/// When the encoder counts a move as over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrivalConfig {
    /// Farthest the polarizer may rest from the commanded axis.
    pub tolerance: Degrees,
    /// How long to wait for that after the servo's own slew and settling time.
    pub timeout_us: u32,
}

/// Where a move ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The axis the PWM asks for, in [0°, 180°).
    pub commanded: Degrees,
    /// The axis the encoder saw at rest, where there is an encoder.
    pub measured: Option<Degrees>,
    /// Time spent waiting, the encoder's polls included.
    pub waited_us: u32,
}

/// Why the wheel is not where it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum WheelError<P, I> {
    /// The servo: axis out of reach, or its PWM.
    Servo(ServoError<P>),
    /// The encoder: unplugged, or its magnet. The servo may have moved.
    Encoder(EncoderError<I>),
    /// Jammed or without power: the polarizer is where it was before the move.
    Stuck {
        /// The axis asked for.
        asked: Degrees,
        /// The axis the encoder sees.
        seen: Degrees,
    },
    /// Slipping, blocked on the way, or hunting: the polarizer moved, and is elsewhere or not at rest.
    Missed {
        /// The axis asked for.
        asked: Degrees,
        /// The axis the encoder saw last.
        seen: Degrees,
    },
}

/// Servo and encoder on one polarizer; owns all three peripherals.
#[derive(Debug)]
pub struct EncodedWheel<PWM, D, I2C> {
    servo: ServoWheel<PWM, D>,
    encoder: Option<(WheelEncoder<I2C>, ArrivalConfig)>,
}

impl Arrival {
    /// The best knowledge of where the polarizer is: measured, else commanded.
    #[must_use]
    pub fn axis(&self) -> Degrees {
        self.measured.unwrap_or(self.commanded)
    }
}

impl<PWM: SetDutyCycle, D: DelayNs, I2C: I2c> EncodedWheel<PWM, D, I2C> {
    /// A wheel that has not moved yet.
    pub const fn new(servo: ServoWheel<PWM, D>, encoder: Option<(WheelEncoder<I2C>, ArrivalConfig)>) -> Self {
        Self { servo, encoder }
    }

    /// Turns the polarizer to `axis`; with an encoder, until it is seen there, at rest.
    ///
    /// # Errors
    /// [`WheelError::Encoder`] before anything moves where the encoder is already silent; see [`WheelError`].
    pub fn move_to(&mut self, axis: Degrees) -> Result<Arrival, WheelError<PWM::Error, I2C::Error>> {
        let before = self.seen().map_err(WheelError::Encoder)?;
        let moved = self.servo.move_to(axis).map_err(WheelError::Servo)?;
        match (&mut self.encoder, before) {
            (Some((encoder, config)), Some(before)) => {
                let watch = Watch { asked: axis, before, moved, config: *config };
                watch.until_arrived(&mut self.servo, encoder)
            }
            _ => Ok(Arrival { commanded: moved.commanded, measured: None, waited_us: moved.waited_us }),
        }
    }

    /// Where the encoder sees the polarizer now; `None` without an encoder.
    ///
    /// # Errors
    /// The encoder's.
    pub fn seen(&mut self) -> Result<Option<Degrees>, EncoderError<I2C::Error>> {
        self.encoder.as_mut().map(|(encoder, _)| encoder.axis()).transpose()
    }

    /// Lets the servo rest; see [`ServoWheel::park`].
    ///
    /// # Errors
    /// [`ServoError::Pwm`].
    pub fn park(&mut self) -> Result<(), ServoError<PWM::Error>> {
        self.servo.park()
    }

    /// Gives servo and encoder back.
    pub fn release(self) -> (ServoWheel<PWM, D>, Option<WheelEncoder<I2C>>) {
        (self.servo, self.encoder.map(|(encoder, _)| encoder))
    }
}

/// One move that the encoder is asked about.
struct Watch {
    asked: Degrees,
    before: Degrees,
    moved: Move,
    config: ArrivalConfig,
}

impl Watch {
    fn until_arrived<PWM: SetDutyCycle, D: DelayNs, I2C: I2c>(
        &self,
        servo: &mut ServoWheel<PWM, D>,
        encoder: &mut WheelEncoder<I2C>,
    ) -> Result<Arrival, WheelError<PWM::Error, I2C::Error>> {
        let Self { asked, moved, config, .. } = *self;
        let mut previous = encoder.axis().map_err(WheelError::Encoder)?;
        let mut polled_us = 0;
        loop {
            // At least one wait, whatever the timeout: rest shows only between two looks.
            servo.wait_us(POLL_US);
            polled_us += POLL_US;
            let seen = encoder.axis().map_err(WheelError::Encoder)?;
            let there = axis_distance(seen, moved.commanded).0 <= config.tolerance.0;
            if there && axis_distance(seen, previous).0 <= AT_REST.0 {
                let waited_us = moved.waited_us.saturating_add(polled_us);
                return Ok(Arrival { commanded: moved.commanded, measured: Some(seen), waited_us });
            }
            if polled_us >= config.timeout_us {
                let stuck = !there && axis_distance(seen, self.before).0 <= config.tolerance.0;
                return Err(if stuck { WheelError::Stuck { asked, seen } } else { WheelError::Missed { asked, seen } });
            }
            previous = seen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EncoderConfig;
    use crate::test_bench::{Event, Recorder, SERVO, nak, raw_angles, status};
    use core::convert::Infallible;
    use embedded_hal::i2c::ErrorKind;
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
    use std::vec::Vec;

    /// Four polls.
    const ARRIVAL: ArrivalConfig = ArrivalConfig { tolerance: Degrees(2.0), timeout_us: 20_000 };
    const ENCODER: EncoderConfig = EncoderConfig { address: 0x36, offset: Degrees(0.0), turns_per_polarizer_turn: 1.0 };
    /// Counts of 60°: 682.67.
    const AT_60: u16 = 683;

    type Outcome = Result<Arrival, WheelError<Infallible, ErrorKind>>;

    /// What one look at a healthy encoder puts on the bus.
    fn look(raw: u16) -> Vec<Transaction> {
        [std::vec![status(0x20)], raw_angles([raw; 4])].concat()
    }

    /// A move from power-up to 60°, with an encoder that sees `looks` in turn (the first before the move), then `last`.
    fn move_to_60(looks: &[u16], last: &[Transaction]) -> (Outcome, Vec<Event>) {
        let script: Vec<_> = looks.iter().flat_map(|raw| look(*raw)).chain(last.iter().cloned()).collect();
        let bench = Recorder::new(20_000);
        let servo = ServoWheel::new(bench.clone(), bench.clone(), SERVO).unwrap();
        let mut wheel = EncodedWheel::new(servo, Some((WheelEncoder::new(Mock::new(&script), ENCODER), ARRIVAL)));
        let outcome = wheel.move_to(Degrees(60.0));
        wheel.release().1.unwrap().release().done();
        (outcome, bench.take())
    }

    fn degrees(raw: u16) -> Degrees {
        Degrees(f64::from(raw) * 360.0 / 4096.0)
    }

    #[test]
    fn a_wheel_at_rest_on_its_axis_has_arrived_with_the_measured_angle() {
        let (outcome, log) = move_to_60(&[0, AT_60 + 5, AT_60 + 4], &[]);
        let arrival = outcome.unwrap();
        assert!(axis_distance(arrival.axis(), degrees(AT_60 + 4)).0 < 1e-9, "{arrival:?}");
        assert!(axis_distance(arrival.commanded, Degrees(60.0)).0 <= 1.5 * 0.045);
        // The servo's two motions, then one poll.
        let [Event::Duty(1259), Event::WaitUs(a), Event::Duty(1315), Event::WaitUs(b), Event::WaitUs(poll)] = log[..]
        else {
            panic!("{log:?}")
        };
        assert_eq!(poll, u64::from(POLL_US));
        assert_eq!(u64::from(arrival.waited_us), a + b + poll);
    }

    #[test]
    fn a_slow_wheel_is_waited_for_and_half_a_turn_is_the_same_axis() {
        // 30°, 50°, 59° (within tolerance, still moving), 60°, 60°, all plus 180°.
        let (outcome, log) = move_to_60(&[0, 2389, 2617, 2719, 2731, 2731], &[]);
        assert!(axis_distance(outcome.unwrap().axis(), degrees(2731)).0 < 1e-9);
        assert_eq!(log.iter().filter(|e| **e == Event::WaitUs(POLL_US.into())).count(), 4);
    }

    #[test]
    fn a_wheel_that_never_moved_is_stuck() {
        let (outcome, _) = move_to_60(&[100, 100, 101, 99, 100, 100], &[]);
        let Err(WheelError::Stuck { asked, seen }) = outcome else { panic!("{outcome:?}") };
        assert_eq!(asked, Degrees(60.0));
        assert!(axis_distance(seen, degrees(100)).0 < 1e-9);
    }

    #[test]
    fn a_wheel_that_stopped_short_has_missed() {
        let (outcome, _) = move_to_60(&[0, 600, 600, 600, 600, 600], &[]);
        let Err(WheelError::Missed { asked, seen }) = outcome else { panic!("{outcome:?}") };
        assert_eq!(asked, Degrees(60.0));
        assert!(axis_distance(seen, degrees(600)).0 < 1e-9);
    }

    #[test]
    fn a_wheel_that_hunts_around_its_axis_has_missed() {
        let (outcome, _) = move_to_60(&[0, AT_60 + 9, AT_60 - 9, AT_60 + 9, AT_60 - 9, AT_60 + 9], &[]);
        assert!(matches!(outcome, Err(WheelError::Missed { .. })), "{outcome:?}");
    }

    #[test]
    fn an_encoder_unplugged_before_the_move_leaves_the_servo_alone() {
        let (outcome, log) = move_to_60(&[], &[status(0x20).with_error(nak())]);
        assert_eq!(outcome, Err(WheelError::Encoder(EncoderError::Bus(nak()))));
        assert_eq!(log, []);
    }

    #[test]
    fn an_encoder_unplugged_during_the_move_is_told_as_such() {
        for looks in [&[0][..], &[0, 300], &[0, 300, 301]] {
            let (outcome, _) = move_to_60(looks, &[status(0x20).with_error(nak())]);
            assert_eq!(outcome, Err(WheelError::Encoder(EncoderError::Bus(nak()))), "{looks:?}");
        }
    }

    #[test]
    fn a_magnet_lost_on_the_way_is_told_as_such() {
        let (outcome, _) = move_to_60(&[0, 300], &[status(0x10)]);
        assert_eq!(outcome, Err(WheelError::Encoder(EncoderError::MagnetMissing)));
    }

    #[test]
    fn without_an_encoder_the_commanded_axis_is_all_there_is() {
        let bench = Recorder::new(20_000);
        let servo = ServoWheel::new(bench.clone(), bench.clone(), SERVO).unwrap();
        let mut wheel = EncodedWheel::<_, _, Mock>::new(servo, None);
        let arrival = wheel.move_to(Degrees(60.0)).unwrap();
        assert_eq!((arrival.measured, arrival.axis()), (None, arrival.commanded));
        assert_eq!(wheel.seen(), Ok(None));
        wheel.park().unwrap();
        assert_eq!(bench.take().last(), Some(&Event::Duty(0)));
        let unreachable = wheel.move_to(Degrees(f64::NAN));
        assert!(matches!(unreachable, Err(WheelError::Servo(ServoError::Unreachable { .. }))));
    }
}
