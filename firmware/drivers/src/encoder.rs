//! Where the polarizer is: an AS5600 magnetic encoder, read as a polarizer axis.
//!
//! The chip is ams AS5600, datasheet v1-06 (2018-Jun-20): 12 bits, 4096 counts per turn of its magnet, I²C address 0x36.
//! RAW ANGLE is read, not ANGLE: the latter has a 10-count hysteresis at the turn of the circle ("ANGLE/RAW ANGLE
//! Register") and follows whatever range somebody programmed into the chip.

use as5600::As5600;
use as5600::error::Error as ChipError;
use as5600::status::{Error as StatusError, Status};
use embedded_hal::i2c::I2c;
use protocol_polar::Degrees;

use crate::as_axis;

/// Counts per turn of the magnet.
const COUNTS: u16 = 4096;
/// Readings averaged into one: the chip's noise is 0.015 to 0.043° rms ("Step Response and Filter Settings").
const READINGS: u16 = 4;
/// MD, ML and MH in STATUS (Figure 21): all clear where there is no magnet and nothing overflows.
const STATUS_BITS: u8 = 0b0011_1000;

/// How the encoder sits on the wheel: encoder angle = `turns_per_polarizer_turn` × (axis − `offset`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderConfig {
    /// 7-bit I²C address.
    pub address: u8,
    /// Polarizer axis where the chip reads 0, in the camera frame.
    pub offset: Degrees,
    /// Turns of the magnet per turn of the polarizer: ±2/n for a whole n, or a reading names no single axis. Negative
    /// where it counts the other way; the chip's DIR pin at ground counts clockwise, seen from above it.
    pub turns_per_polarizer_turn: f64,
}

/// Why there is no reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncoderError<E> {
    /// The bus failed: unplugged, or another fault of the wire.
    Bus(E),
    /// The chip answers and sees no magnet (MD clear).
    MagnetMissing,
    /// The magnet is too far (ML set: the gain cannot rise further).
    MagnetTooWeak,
    /// The magnet is too near (MH set: the gain cannot fall further).
    MagnetTooStrong,
    /// A STATUS no AS5600 gives, too weak and too strong at once: another chip, or a disturbed bus.
    BadStatus(u8),
    /// The chip's driver reports what only configuring or programming it can cause, neither of which is done here.
    Unexpected,
}

/// An encoder that knows the polarizer; owns its bus.
#[derive(Debug)]
pub struct WheelEncoder<I2C> {
    chip: As5600<I2C>,
    config: EncoderConfig,
}

impl<I2C: I2c> WheelEncoder<I2C> {
    /// An encoder at the configuration's address; the bus is not touched.
    pub fn new(i2c: I2C, config: EncoderConfig) -> Self {
        Self { chip: As5600::with_address(config.address, i2c), config }
    }

    /// The polarizer axis in [0°, 180°), the mean of four readings taken at once.
    ///
    /// # Errors
    /// What the magnet lacks, before an angle is read; [`EncoderError::Bus`] at any time.
    pub fn axis(&mut self) -> Result<Degrees, EncoderError<I2C::Error>> {
        self.check_magnet()?;
        let first = self.chip.raw_angle().map_err(chip_error)?;
        let mut offsets = 0;
        for _ in 1..READINGS {
            offsets += i32::from(counts_between(first, self.chip.raw_angle().map_err(chip_error)?));
        }
        let counts = f64::from(first) + f64::from(offsets) / f64::from(READINGS);
        let magnet_deg = counts * 360.0 / f64::from(COUNTS);
        Ok(as_axis(Degrees(self.config.offset.0 + magnet_deg / self.config.turns_per_polarizer_turn)))
    }

    /// Gives the bus back.
    pub fn release(self) -> I2C {
        self.chip.release()
    }

    /// MD = 0 is "absence of the magnet" whatever the gain does ("Magnet Detection"): without one ML is set as well.
    fn check_magnet(&mut self) -> Result<(), EncoderError<I2C::Error>> {
        match self.chip.magnet_status().map_err(chip_error)? {
            Status::MagnetDetected => Ok(()),
            Status::MagnetLow => Err(EncoderError::MagnetMissing),
            Status::MagnetDetectedLow => Err(EncoderError::MagnetTooWeak),
            Status::MagnetHigh | Status::MagnetDetectedHigh => Err(EncoderError::MagnetTooStrong),
        }
    }
}

fn chip_error<E>(error: ChipError<E>) -> EncoderError<E> {
    match error {
        ChipError::Communication(e) => EncoderError::Bus(e),
        ChipError::Status(StatusError::InvalidBitPattern(bits)) if bits & STATUS_BITS == 0 => {
            EncoderError::MagnetMissing
        }
        ChipError::Status(StatusError::InvalidBitPattern(bits)) => EncoderError::BadStatus(bits),
        ChipError::Configuration(_)
        | ChipError::MaximumPositionPersistsReached
        | ChipError::MagnetRequired
        | ChipError::MangConfigPersistenceExhausted => EncoderError::Unexpected,
    }
}

/// Counts from `a` to `b` the short way round the circle, in [−2048, 2047].
fn counts_between(a: u16, b: u16) -> i16 {
    // Sixteenths of a count make the circle exactly the 16-bit circle, and wrapping arithmetic does the rest.
    (b.wrapping_mul(16).wrapping_sub(a.wrapping_mul(16))).cast_signed() / 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis_distance;
    use crate::test_bench::{nak, raw_angles, status};
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
    use proptest::prelude::*;
    use std::vec::Vec;

    const COUNT_DEG: f64 = 360.0 / 4096.0;

    /// One reading of an encoder that answers with `script`.
    fn read(script: &[Transaction], config: EncoderConfig) -> Result<f64, EncoderError<embedded_hal::i2c::ErrorKind>> {
        let mut encoder = WheelEncoder::new(Mock::new(script), config);
        let axis = encoder.axis().map(|a| a.0);
        encoder.release().done();
        axis
    }

    fn good(raw: [u16; 4]) -> Vec<Transaction> {
        [std::vec![status(0x20)], raw_angles(raw)].concat()
    }

    fn config(offset: f64, turns: f64) -> EncoderConfig {
        EncoderConfig { address: 0x36, offset: Degrees(offset), turns_per_polarizer_turn: turns }
    }

    #[test]
    fn quarter_turns_of_the_magnet_are_where_figure_35_has_them() {
        // "Raw Angle in Clockwise Direction": 0, 90, 180, 270 degrees read 0, 1024, 2048, 3072.
        for (raw, axis) in [(0, 0.0), (1024, 90.0), (2048, 0.0), (3072, 90.0), (512, 45.0)] {
            let seen = read(&good([raw; 4]), config(0.0, 1.0)).unwrap();
            assert!(axis_distance(Degrees(seen), Degrees(axis)).0 < 1e-12, "{raw}: {seen}");
        }
    }

    #[test]
    fn readings_either_side_of_the_turn_average_across_it() {
        for (raw, counts) in [([4095, 0, 4095, 0], -0.5), ([1, 4095, 0, 0], 0.0), ([4094, 2, 4094, 2], 0.0)] {
            let seen = read(&good(raw), config(30.0, 1.0)).unwrap();
            assert!((seen - (30.0 + counts * COUNT_DEG)).abs() < 1e-12, "{raw:?}: {seen}");
        }
    }

    #[test]
    fn bits_above_the_twelfth_are_not_the_angle() {
        let seen = read(&good([0xF400, 0x0400, 0x8400, 0x1400]), config(0.0, 1.0)).unwrap();
        assert!((seen - 90.0).abs() < 1e-12, "{seen}");
    }

    #[test]
    fn every_fault_of_the_magnet_has_its_name() {
        // STATUS (0x0B), Figures 21 and 23: MD bit 5, ML bit 4 "magnet too weak", MH bit 3 "magnet too strong".
        let cases = [
            (0x00, EncoderError::MagnetMissing),
            (0x47, EncoderError::MagnetMissing), // unused bits may be anything
            (0x10, EncoderError::MagnetMissing),
            (0x30, EncoderError::MagnetTooWeak),
            (0x28, EncoderError::MagnetTooStrong),
            (0x08, EncoderError::MagnetTooStrong),
            (0x38, EncoderError::BadStatus(0x38)),
            (0xFF, EncoderError::BadStatus(0xFF)), // a bus with nothing on it but pull-ups
        ];
        for (bits, error) in cases {
            assert_eq!(read(&[status(bits)], config(0.0, 1.0)), Err(error), "{bits:#04x}");
        }
    }

    #[test]
    fn a_bus_that_does_not_answer_is_told_at_any_step() {
        let whole = good([100; 4]);
        for broken in 0..whole.len() {
            let mut script = whole[..=broken].to_vec();
            script[broken] = script[broken].clone().with_error(nak());
            assert_eq!(read(&script, config(0.0, 1.0)), Err(EncoderError::Bus(nak())), "step {broken}");
        }
    }

    #[test]
    fn the_address_is_the_configured_one() {
        let script: Vec<_> = [Transaction::write_read(0x40, std::vec![0x0B], std::vec![0x20])]
            .into_iter()
            .chain((0..4).map(|_| Transaction::write_read(0x40, std::vec![0x0C], std::vec![0x04, 0x00])))
            .collect();
        let at_0x40 = EncoderConfig { address: 0x40, ..config(0.0, 1.0) };
        assert!((read(&script, at_0x40).unwrap() - 90.0).abs() < 1e-12);
    }

    proptest! {
        /// Turn the polarizer, gear the magnet, round to counts: the axis comes back within half a count.
        #[test]
        fn any_axis_is_read_back(axis in 0.0..180.0_f64, half_turns in 0..4, offset in -360.0..360.0_f64,
                                 n in 1..5, reversed: bool) {
            let turns = 2.0 / f64::from(n) * if reversed { -1.0 } else { 1.0 };
            let polarizer_deg = axis + 180.0 * f64::from(half_turns);
            let counts = ((polarizer_deg - offset) * turns / COUNT_DEG).round().rem_euclid(4096.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, in 0..4096")]
            let raw = counts as u16;
            let seen = read(&good([raw; 4]), config(offset, turns)).unwrap();
            let half_count_deg = 0.5 * COUNT_DEG / turns.abs();
            prop_assert!(axis_distance(Degrees(seen), Degrees(axis)).0 <= half_count_deg + 1e-9, "{seen}");
        }

        #[test]
        fn counts_between_is_the_short_way(a in 0..4096_u16, b in 0..4096_u16) {
            let d = i32::from(counts_between(a, b));
            prop_assert_eq!((i32::from(a) + d).rem_euclid(4096), i32::from(b));
            prop_assert!((-2048..=2047).contains(&d));
        }
    }
}
