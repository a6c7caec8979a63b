//! Commands, answers and reports.

use super::capture::{
    CaptureId, CaptureRequest, CaptureSummary, FrameRequest, MAX_CAPTURES, PlaneKind, SensorInfo, Word,
};
use heapless::{String, Vec};
use postcard_schema::Schema;
use protocol_polar::MAX_FRAMES;
use serde::{Deserialize, Serialize};

/// Opens a session. Answer: [`Identity`], whose frame header carries the session to use from then on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Identify {
    /// Program and version, for the camera's log.
    pub host: String<32>,
}

/// Who the camera is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Identity {
    /// Session for all further frames, both ways.
    pub session: u32,
    /// Serial number.
    pub serial: String<24>,
    /// Board name.
    pub board: String<32>,
    /// Firmware version.
    pub firmware: String<16>,
    /// The sensor.
    pub sensor: SensorInfo,
    /// Frames the board takes when nothing else is asked.
    pub default_frames: Vec<FrameRequest, MAX_FRAMES>,
    /// Word it uses when nothing else is asked.
    pub default_word: Word,
}

/// Asks for [`Status`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct GetStatus;

/// What the camera is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum State {
    /// Nothing.
    Idle,
    /// Taking or computing this capture.
    Capturing(CaptureId),
    /// Sending strips of this capture.
    Sending(CaptureId),
    /// Taking a dark map or a flat field.
    Calibrating,
}

/// The camera's state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// What it is doing.
    pub state: State,
    /// Time since it started, µs.
    pub uptime_us: u64,
    /// Captures held.
    pub captures: u8,
    /// Storage left for captures, bytes.
    pub free_bytes: u64,
    /// Bytes received that belonged to no good frame.
    pub skipped_bytes: u64,
}

/// Starts a capture. Answers: [`Accepted`], then [`Progress`] reports, then [`Done`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct StartCapture {
    /// What to take.
    pub request: CaptureRequest,
}

/// The capture was taken on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Accepted {
    /// Its name.
    pub id: CaptureId,
}

/// Stops the running capture; what it had is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Cancel;

/// Which correction to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Calibrate {
    /// Lens capped: the mean of this many frames becomes the dark map.
    Dark {
        /// Frames to average, 1..=16.
        frames: u8,
    },
    /// A uniform bright field: the flat gain makes it even.
    Flat {
        /// Frames to average, 1..=16.
        frames: u8,
    },
    /// Forget both maps.
    Clear,
}

/// A stage of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Stage {
    /// Finding the exposure.
    Metering,
    /// Taking frames.
    Exposing,
    /// Computing strips.
    Computing,
    /// Averaging a dark or flat map.
    Calibrating,
}

/// How far the running work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Progress {
    /// The stage.
    pub stage: Stage,
    /// Steps of it done.
    pub done: u16,
    /// Steps it has.
    pub total: u16,
}

/// The running capture or calibration is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Done {
    /// The capture; `None` for a calibration.
    pub id: Option<CaptureId>,
}

/// Asks for [`CaptureList`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ListCaptures;

/// The captures the camera holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CaptureList {
    /// Oldest first.
    pub captures: Vec<CaptureSummary, MAX_CAPTURES>,
}

/// Asks for a [`super::capture::CaptureDescription`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Describe {
    /// Of this capture.
    pub id: CaptureId,
}

/// Asks for strips of one plane. The camera sends no more strips than it was granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Fetch {
    /// Of this capture.
    pub id: CaptureId,
    /// This plane.
    pub plane: PlaneKind,
    /// From this strip on.
    pub first: u16,
    /// This many.
    pub count: u16,
    /// Strips that may be sent at once; replaces what was granted before.
    pub credit: u16,
}

/// Lets the camera send this many strips more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Grant {
    /// Strips.
    pub credit: u16,
}

/// The host has the capture whole and verified: the camera may forget it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Release {
    /// This capture.
    pub id: CaptureId,
}

/// The capture is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Released {
    /// This capture.
    pub id: CaptureId,
}

/// Why a command was not carried out, or a capture failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// No message with this key in this firmware.
    Unsupported {
        /// The key received.
        key: [u8; 8],
    },
    /// The payload is not what its key says.
    Malformed,
    /// The frame belongs to no session that is open; identify again.
    WrongSession,
    /// Another capture or calibration is running.
    Busy,
    /// No capture of this name.
    UnknownCapture(CaptureId),
    /// The capture has no such plane or strip.
    UnknownStrip,
    /// Fewer than three distinct polarizer axes modulo 180°.
    TooFewAxes {
        /// How many there are.
        distinct: u8,
    },
    /// The axes are too close together.
    IllConditioned {
        /// Condition number of the analyzer matrix.
        condition: f64,
    },
    /// An angle, exposure, ratio or frame count out of range; which, by name.
    OutOfRange(String<32>),
    /// This word cannot hold this sensor's samples.
    WordTooNarrow,
    /// Not enough storage; release captures first.
    StorageFull {
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        free: u64,
    },
    /// The wheel did not move.
    WheelStuck {
        /// Axis asked, degrees.
        asked_deg: f64,
        /// Axis seen, degrees.
        seen_deg: f64,
    },
    /// The wheel moved but did not arrive.
    WheelMissed {
        /// Axis asked, degrees.
        asked_deg: f64,
        /// Axis seen, degrees.
        seen_deg: f64,
    },
    /// The wheel, its PWM or its encoder does not answer, or cannot reach the axis.
    WheelFailed(String<64>),
    /// The camera module failed.
    CameraFailed(String<64>),
    /// Even the shortest exposure clips.
    TooBright,
    /// A calibration picture cannot be used: the dark map is bright, or the flat field is dark or clipped.
    BadCalibration(String<64>),
    /// Stored data could not be read or written.
    StorageFailed(String<64>),
    /// The command was cancelled.
    Cancelled,
}

/// A command that was not carried out, or a capture that failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Refused {
    /// Why.
    pub refusal: Refusal,
}

/// Weight of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LogLevel {
    /// Something a user should know.
    Warning,
    /// What happened.
    Info,
}

/// A line of the camera's log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Log {
    /// Its weight.
    pub level: LogLevel,
    /// The text.
    pub text: String<96>,
}
