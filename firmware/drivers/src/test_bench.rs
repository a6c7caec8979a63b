//! What the tests of several drivers share: the emulated board's wheel, AS5600 bus transcripts, and a recorder that keeps
//! the order of pulses and waits (the mocks of two peripherals do not know each other).

use core::convert::Infallible;
use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use embedded_hal_mock::eh1::i2c::Transaction;
use protocol_polar::Degrees;

use crate::{Approach, ServoConfig};

/// Hobby servo, 500 to 2500 µs over 180° every 20 ms, gear 1.5, run-up 5°.
pub(crate) const SERVO: ServoConfig = ServoConfig {
    pulse_min_us: 500,
    pulse_max_us: 2500,
    travel: Degrees(180.0),
    pwm_period_us: 20_000,
    gear_ratio: 1.5,
    zero_offset: Degrees(-50.0),
    slew_deg_per_s: 300.0,
    settle_us: 80_000,
    backlash: Degrees(1.0),
    overshoot: Degrees(4.0),
    approach: Approach::Increasing,
};

/// The STATUS register, 0x0B, reads `bits`.
pub(crate) fn status(bits: u8) -> Transaction {
    Transaction::write_read(0x36, std::vec![0x0B], std::vec![bits])
}

/// RAW ANGLE, high byte at 0x0C, reads each value in turn.
pub(crate) fn raw_angles(values: [u16; 4]) -> Vec<Transaction> {
    values.iter().map(|v| Transaction::write_read(0x36, std::vec![0x0C], v.to_be_bytes().to_vec())).collect()
}

/// Nobody at that address.
pub(crate) fn nak() -> ErrorKind {
    ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    Duty(u16),
    WaitUs(u64),
}

/// PWM channel and delay in one, writing into one log.
#[derive(Clone, Debug)]
pub(crate) struct Recorder {
    pub(crate) max_duty: u16,
    pub(crate) log: Rc<RefCell<Vec<Event>>>,
}

impl Recorder {
    pub(crate) fn new(max_duty: u16) -> Self {
        Self { max_duty, log: Rc::default() }
    }

    pub(crate) fn take(&self) -> Vec<Event> {
        self.log.take()
    }
}

impl ErrorType for Recorder {
    type Error = Infallible;
}

impl SetDutyCycle for Recorder {
    fn max_duty_cycle(&self) -> u16 {
        self.max_duty
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.log.borrow_mut().push(Event::Duty(duty));
        Ok(())
    }
}

impl DelayNs for Recorder {
    fn delay_ns(&mut self, ns: u32) {
        self.delay_us(ns.div_ceil(1000));
    }

    fn delay_us(&mut self, us: u32) {
        self.log.borrow_mut().push(Event::WaitUs(us.into()));
    }
}
