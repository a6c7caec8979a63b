//! Talking to a camera from the host: byte transports, one per file, and a typed client on top.
//!
//! docs/PROTOCOL.md is the specification of what is said. Whatever bytes come from the other side are bounded before they
//! are stored and checked before they are believed; a plane is either as the camera computed it or an error.

mod address;
mod client;
mod error;
pub mod in_process;
mod plane;
pub mod replay;
mod socket;
pub mod tcp;
mod transport;
#[cfg(unix)]
pub mod unix;
pub mod usb;

pub use address::Address;
pub use client::{Client, Counters, Options};
pub use error::LinkError;
pub use plane::{MAX_PLANE_BYTES, PlaneBuffer};
pub use transport::Transport;
