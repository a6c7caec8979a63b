//! The camera as a whole: session, capture, calibration, store. Polled with the time; never waits for the host.

mod calibrate;
mod capture;
mod session;

use crate::compute::ComputeError;
use crate::hardware::{ByteLink, CaptureStore, FrameSource, Micros, StoreError, Wheel, WheelError, text};
use crate::memory::{Lengths, Memory};
use calibrate::CalibrationJob;
use capture::CaptureJob;
use heapless::{String, Vec};
use protocol_polar::MAX_FRAMES;
use protocol_wire::{
    Calibration, CaptureId, Done, FrameRequest, FromDevice, Log, LogLevel, Refusal, Refused, SensorInfo, State, Word,
};
use session::Session;

/// Who the camera is and what its board file says.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Serial number.
    pub serial: String<24>,
    /// Board name.
    pub board: String<32>,
    /// Firmware version.
    pub firmware: String<16>,
    /// The sensor.
    pub sensor: SensorInfo,
    /// Shortest and longest exposure, µs.
    pub exposure_limits_us: (u32, u32),
    /// Efficiency of the polarizer, from its extinction ratio.
    pub polarizer_efficiency: f64,
    /// Standard deviations that count as misfit.
    pub misfit_sigma: f64,
    /// Frames of a capture when nothing else is asked.
    pub default_frames: Vec<FrameRequest, MAX_FRAMES>,
    /// Word when nothing else is asked.
    pub default_word: Word,
    /// Rows of a strip, a multiple of 16.
    pub strip_rows: u16,
    /// A number that differs from boot to boot: sessions start from it, and captures carry it.
    pub boot: u32,
    /// The first capture gets this name; above all that the store holds.
    pub first_capture: CaptureId,
}

/// Why a camera cannot start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SetupError {
    /// Strip rows are 0, not a multiple of 16, or make strips too large for a frame.
    StripRows {
        /// The rows given.
        rows: u16,
    },
    /// A piece of memory is shorter than [`Lengths`] says.
    Memory,
}

/// What a poll came to: whether to poll again at once or to wait a little.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Something was done.
    Busy,
    /// There was nothing to do.
    Idle,
}

/// The camera. See the module.
#[derive(Debug)]
pub struct Device<'a, W, C, S> {
    setup: Setup,
    wheel: W,
    camera: C,
    store: S,
    memory: Memory<'a>,
    session: Session,
    work: Work,
    next_id: CaptureId,
    last_exposure_us: u32,
    calibration: Calibration,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and nothing is allocated")]
enum Work {
    Idle,
    Capture(CaptureJob),
    Calibration(CalibrationJob),
}

/// How a step of work ended.
enum Step {
    More,
    Done(Option<CaptureId>),
}

impl<'a, W: Wheel, C: FrameSource, S: CaptureStore> Device<'a, W, C, S> {
    /// A camera at rest.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn new(setup: Setup, wheel: W, camera: C, store: S, memory: Memory<'a>) -> Result<Self, SetupError> {
        let rows = setup.strip_rows;
        let lengths = Lengths::new(&setup.sensor, rows);
        if rows == 0 || !rows.is_multiple_of(16) || lengths.bytes > protocol_wire::MAX_PAYLOAD / 2 {
            return Err(SetupError::StripRows { rows });
        }
        if !lengths.fit(&memory) {
            return Err(SetupError::Memory);
        }
        let (shortest, longest) = setup.exposure_limits_us;
        Ok(Self {
            session: Session::new(setup.boot),
            work: Work::Idle,
            next_id: setup.first_capture,
            last_exposure_us: (longest / 16).max(shortest),
            calibration: Calibration { dark_map: false, flat_map: false },
            setup,
            wheel,
            camera,
            store,
            memory,
        })
    }

    /// Does a little: takes commands, sends what is due, and one step of the running work. `link` is `None` while no host
    /// is connected; work goes on.
    ///
    /// The step of work may take as long as a wheel move and an exposure.
    pub fn poll(&mut self, now: Micros, link: Option<&mut impl ByteLink>) -> Activity {
        let mut activity = Activity::Idle;
        match link {
            Some(link) => {
                if self.serve(now, link) == Activity::Busy {
                    activity = Activity::Busy;
                }
            }
            None => self.session.close(),
        }
        if self.step(now) == Activity::Busy {
            activity = Activity::Busy;
        }
        activity
    }

    /// What the camera is doing.
    #[must_use]
    pub fn state(&self) -> State {
        match &self.work {
            Work::Capture(job) => State::Capturing(job.id()),
            Work::Calibration(_) => State::Calibrating,
            Work::Idle => match self.session.fetching() {
                Some(id) => State::Sending(id),
                None => State::Idle,
            },
        }
    }

    /// Gives the parts back.
    pub fn release(self) -> (W, C, S) {
        (self.wheel, self.camera, self.store)
    }

    fn step(&mut self, now: Micros) -> Activity {
        let (sequence, result, before) = match core::mem::replace(&mut self.work, Work::Idle) {
            Work::Idle => return Activity::Idle,
            Work::Capture(mut job) => {
                let before = job.progress();
                let result = self.capture_step(&mut job, now);
                let sequence = job.sequence();
                if result.is_err() {
                    self.store.remove(job.id()).ok(); // what there is of it is of no use; the error says why
                }
                if matches!(result, Ok(Step::More)) {
                    self.work = Work::Capture(job);
                }
                (sequence, result, before)
            }
            Work::Calibration(mut job) => {
                let before = job.progress();
                let result = self.calibration_step(&mut job, now);
                let sequence = job.sequence();
                if matches!(result, Ok(Step::More)) {
                    self.work = Work::Calibration(job);
                }
                (sequence, result, before)
            }
        };
        match result {
            Ok(Step::More) => self.session.report(sequence, before),
            Ok(Step::Done(id)) => self.session.tell(sequence, FromDevice::Done(Done { id })),
            Err(refusal) => self.session.tell(sequence, FromDevice::Refused(Refused { refusal })),
        }
        Activity::Busy
    }

    fn warn(&mut self, sequence: u16, what: &str) {
        self.session.tell(sequence, FromDevice::Log(Log { level: LogLevel::Warning, text: text(what) }));
    }
}

impl From<WheelError> for Refusal {
    fn from(error: WheelError) -> Self {
        match error {
            WheelError::Stuck { asked, seen } => Self::WheelStuck { asked_deg: asked.0, seen_deg: seen.0 },
            WheelError::Missed { asked, seen } => Self::WheelMissed { asked_deg: asked.0, seen_deg: seen.0 },
            WheelError::Failed(what) => Self::WheelFailed(what),
        }
    }
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Full { needed, free } => Self::StorageFull { needed, free },
            StoreError::Missing => Self::StorageFailed(text("a strip is missing")),
            StoreError::Failed(what) => Self::StorageFailed(what),
        }
    }
}

impl From<ComputeError> for Refusal {
    fn from(error: ComputeError) -> Self {
        match error {
            ComputeError::Camera(error) => Self::CameraFailed(error.0),
            ComputeError::Store(error) => error.into(),
            ComputeError::Memory => Self::CameraFailed(text("a strip does not fit the working memory")),
        }
    }
}
