//! Faults as wrappers: each call of what is wrapped asks [`Faults`] whether this one goes wrong.

use embedded_hal::i2c::{self, I2c, NoAcknowledgeSource, Operation};
use embedded_hal::pwm::{self, Error as _, SetDutyCycle};
use firmware_core::{ByteLink, CameraError, FrameSource, LinkGone, Micros, text};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard};

/// When things go wrong. Shared: clones are the same plan, so that a story can break and repair what runs elsewhere.
#[derive(Clone, Debug)]
pub struct Faults(Arc<Mutex<Plan>>);

#[derive(Debug)]
struct Plan {
    /// Of 1000 calls, at random.
    per_mille: u64,
    calls_that_fail: Range<u64>,
    random: u64,
    calls: u64,
    struck: u64,
}

impl Faults {
    /// Nothing goes wrong yet. The seed is for [`Self::at_rate`].
    #[must_use]
    pub fn none(seed: u64) -> Self {
        Self(Arc::new(Mutex::new(Plan { per_mille: 0, calls_that_fail: 0..0, random: seed, calls: 0, struck: 0 })))
    }

    /// From now on so many of 1000 calls go wrong.
    pub fn at_rate(&self, per_mille: u64) {
        self.plan().per_mille = per_mille;
    }

    /// Of the calls to come, those with these numbers (from 0) go wrong.
    pub fn at_calls(&self, calls: Range<u64>) {
        let mut plan = self.plan();
        plan.calls_that_fail = plan.calls + calls.start..plan.calls.saturating_add(calls.end);
    }

    /// Every call goes wrong from now on.
    pub fn always(&self) {
        self.at_calls(0..u64::MAX);
    }

    /// Nothing goes wrong any more.
    pub fn repair(&self) {
        let mut plan = self.plan();
        (plan.per_mille, plan.calls_that_fail) = (0, 0..0);
    }

    /// How many calls went wrong so far.
    #[must_use]
    pub fn struck(&self) -> u64 {
        self.plan().struck
    }

    /// Whether this call goes wrong.
    fn strike(&self) -> bool {
        let mut plan = self.plan();
        // Xorshift64* (Marsaglia 2003, Vigna 2016).
        plan.random ^= plan.random << 13;
        plan.random ^= plan.random >> 7;
        plan.random ^= plan.random << 17;
        let drawn = plan.random.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32;
        let fails = drawn % 1000 < plan.per_mille || plan.calls_that_fail.contains(&plan.calls);
        plan.calls += 1;
        plan.struck += u64::from(fails);
        fails
    }

    fn plan(&self) -> MutexGuard<'_, Plan> {
        self.0.lock().unwrap()
    }
}

/// Something that fails when its [`Faults`] say so: a PWM and a bus with an error, a camera without a picture; on a link one
/// bit of what passes is turned.
#[derive(Debug)]
pub struct Faulty<T> {
    inner: T,
    faults: Faults,
}

impl<T> Faulty<T> {
    /// `inner` with these faults.
    #[must_use]
    pub fn new(inner: T, faults: &Faults) -> Self {
        Self { inner, faults: faults.clone() }
    }
}

impl<T> pwm::ErrorType for Faulty<T> {
    type Error = pwm::ErrorKind;
}

impl<T: SetDutyCycle> SetDutyCycle for Faulty<T> {
    fn max_duty_cycle(&self) -> u16 {
        self.inner.max_duty_cycle()
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), pwm::ErrorKind> {
        if self.faults.strike() {
            return Err(pwm::ErrorKind::Other);
        }
        self.inner.set_duty_cycle(duty).map_err(|error| error.kind())
    }
}

impl<T> i2c::ErrorType for Faulty<T> {
    type Error = i2c::ErrorKind;
}

impl<T: I2c<Error = i2c::ErrorKind>> I2c for Faulty<T> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        if self.faults.strike() {
            return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        self.inner.transaction(address, operations)
    }
}

impl<T: FrameSource> FrameSource for Faulty<T> {
    fn expose(&mut self, slot: u8, exposure_us: u32, now: Micros) -> Result<Micros, CameraError> {
        if self.faults.strike() {
            return Err(CameraError(text("the sensor did not answer")));
        }
        self.inner.expose(slot, exposure_us, now)
    }

    fn read_rows(&mut self, slot: u8, first_row: u32, rows: &mut [u16]) -> Result<(), CameraError> {
        self.inner.read_rows(slot, first_row, rows)
    }
}

impl<T: ByteLink> ByteLink for Faulty<T> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        let n = self.inner.read(bytes)?;
        if n > 0 && self.faults.strike() {
            bytes[n / 2] ^= 0x10;
        }
        Ok(n)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        if bytes.is_empty() || !self.faults.strike() {
            return self.inner.write(bytes);
        }
        let mut damaged = bytes.to_vec();
        damaged[bytes.len() / 2] ^= 0x10;
        self.inner.write(&damaged)
    }
}

/// A servo without power while its [`Faults`] say so: pulses are taken and nothing moves.
#[derive(Debug)]
pub struct Jammed<T> {
    inner: T,
    faults: Faults,
}

impl<T> Jammed<T> {
    /// `inner`, powerless when `faults` strike.
    #[must_use]
    pub fn new(inner: T, faults: &Faults) -> Self {
        Self { inner, faults: faults.clone() }
    }
}

impl<T: SetDutyCycle> pwm::ErrorType for Jammed<T> {
    type Error = T::Error;
}

impl<T: SetDutyCycle> SetDutyCycle for Jammed<T> {
    fn max_duty_cycle(&self) -> u16 {
        self.inner.max_duty_cycle()
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), T::Error> {
        if self.faults.strike() { Ok(()) } else { self.inner.set_duty_cycle(duty) }
    }
}

/// A cable that is pulled after so many bytes to the host; both ends notice.
#[derive(Debug)]
pub struct Cut<T> {
    inner: Option<T>,
    bytes_left: usize,
}

impl<T> Cut<T> {
    /// `inner`, pulled after `bytes`.
    #[must_use]
    pub fn new(inner: T, bytes: usize) -> Self {
        Self { inner: Some(inner), bytes_left: bytes }
    }
}

impl<T: ByteLink> ByteLink for Cut<T> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        self.inner.as_mut().ok_or(LinkGone)?.read(bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        let within = bytes.len().min(self.bytes_left);
        let sent = self.inner.as_mut().ok_or(LinkGone)?.write(&bytes[..within])?;
        self.bytes_left -= sent;
        if self.bytes_left == 0 {
            self.inner = None;
        }
        Ok(sent)
    }
}
