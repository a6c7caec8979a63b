//! What goes over the cable: messages, their schema keys, frames, strips and flow control.
//!
//! docs/PROTOCOL.md is the specification; this crate is it in code. Integers in frame headers are little-endian, message
//! bodies are postcard, and each message carries a key hashed from its path and schema: two builds that disagree about a
//! message say "unsupported" instead of reading garbage. Every length is bounded before anything is stored.
#![no_std]
#![warn(clippy::indexing_slicing, clippy::expect_used, clippy::panic)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "tests choose numbers that fit"
    )
)]

mod frame;
mod messages;

pub use frame::{Deframer, Event, FrameError, HEADER_BYTES, Header, MAGIC, MAX_PAYLOAD, VERSION, seal};
pub use messages::capture::{
    Bayer, Calibration, CaptureDescription, CaptureId, CaptureRequest, CaptureState, CaptureSummary, Exposure,
    FrameInfo, FrameRequest, MAX_CAPTURES, MAX_PLANES, PlaneInfo, PlaneKind, SensorInfo, Word,
};
pub use messages::control::{
    Accepted, Calibrate, Cancel, CaptureList, Describe, Done, Fetch, GetStatus, Grant, Identify, Identity,
    ListCaptures, Log, LogLevel, Progress, Refusal, Refused, Release, Released, Stage, StartCapture, State, Status,
};
pub use messages::strip::{Coding, Strip, StripHeader};
pub use messages::{FromDevice, FromHost, Key, Name};
