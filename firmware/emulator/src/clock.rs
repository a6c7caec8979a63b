//! The camera's clock: virtual, where a wait is over at once and the time has passed; or the real one.

use embedded_hal::delay::DelayNs;
use firmware_core::Micros;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A clock that starts at 0 and is shared by everything that waits or asks for the time.
#[derive(Clone, Debug)]
pub struct Clock(Kind);

#[derive(Clone, Debug)]
enum Kind {
    /// Nanoseconds.
    Virtual(Arc<AtomicU64>),
    Real(Instant),
}

impl Clock {
    /// Time passes by waiting only, and waiting takes none.
    #[must_use]
    pub fn virtual_time() -> Self {
        Self(Kind::Virtual(Arc::default()))
    }

    /// Time passes as it does.
    #[must_use]
    pub fn real_time() -> Self {
        Self(Kind::Real(Instant::now()))
    }

    /// Time since the start.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        match &self.0 {
            Kind::Virtual(ns) => Duration::from_nanos(ns.load(Ordering::SeqCst)),
            Kind::Real(start) => start.elapsed(),
        }
    }

    /// Time since the start, as the firmware takes it.
    #[must_use]
    pub fn now(&self) -> Micros {
        Micros(u64::try_from(self.elapsed().as_micros()).unwrap_or(u64::MAX))
    }

    /// Lets `time` pass.
    pub fn wait(&self, time: Duration) {
        match &self.0 {
            Kind::Virtual(ns) => {
                ns.fetch_add(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX), Ordering::SeqCst);
            }
            Kind::Real(_) => std::thread::sleep(time),
        }
    }
}

impl DelayNs for Clock {
    fn delay_ns(&mut self, ns: u32) {
        self.wait(Duration::from_nanos(ns.into()));
    }

    fn delay_us(&mut self, us: u32) {
        self.wait(Duration::from_micros(us.into()));
    }
}
