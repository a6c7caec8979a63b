//! The camera's decisions: capture sequence, exposure, fixed-point Stokes, session.
//!
//! Generic over what it needs from the world ([`Wheel`], [`FrameSource`], [`CaptureStore`], [`ByteLink`]), with time as an
//! argument. The same code runs on the board, in the emulator and in tests. No allocation: the caller lends the memory.
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

mod compute;
mod device;
mod exposure;
mod hardware;
pub mod kernel;
mod memory;
mod sequence;

pub use device::{Activity, Device, Setup, SetupError};
pub use memory::{Lengths, Memory};

pub use hardware::{
    ByteLink, CameraError, CaptureStore, FrameSource, LinkGone, Micros, StoreError, Wheel, WheelAxis, WheelError, text,
};
