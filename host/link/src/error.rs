//! What can go wrong between host and camera.

use protocol_wire::{CaptureId, PlaneKind, Refusal};

/// Why the camera could not be reached, or did not do what was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The other end is no longer there: unplugged, switched off, or its program ended. Connect again to resume.
    #[error("the camera is gone")]
    Gone,
    /// Nothing useful came in time.
    #[error("no `{waiting_for}` from the camera in time")]
    Timeout {
        /// Path of the message that was awaited, or what else was.
        waiting_for: &'static str,
    },
    /// The camera speaks another version of the protocol.
    #[error("the camera speaks protocol version {theirs}, this program version {ours}")]
    Version {
        /// The camera's.
        theirs: u8,
        /// This program's.
        ours: u8,
    },
    /// One side does not know a message of the other: the builds differ.
    #[error("`{path}` is not supported (key {})", hex(key))]
    Unsupported {
        /// Path of the request.
        path: &'static str,
        /// Key of the message that is not known.
        key: [u8; 8],
    },
    /// A verified frame does not hold what its key says, or not what the request calls for.
    #[error("malformed `{path}`")]
    Malformed {
        /// Path of the message.
        path: &'static str,
    },
    /// The camera refused, or the capture failed.
    #[error("the camera refused: {0:?}")]
    Refused(Refusal),
    /// The values of a strip do not have their CRC however often they are sent: the camera's storage lost them.
    #[error("strip {index} of {plane:?} is damaged in the camera")]
    CorruptStrip {
        /// The plane.
        plane: PlaneKind,
        /// The strip.
        index: u16,
    },
    /// The capture has no such plane.
    #[error("capture {} has no plane {plane:?}", id.0)]
    NoPlane {
        /// The capture.
        id: CaptureId,
        /// The plane asked for.
        plane: PlaneKind,
    },
    /// A plane is described in a way that contradicts itself or is larger than this program takes.
    #[error("plane {plane:?} cannot be: {what}")]
    BadPlane {
        /// The plane.
        plane: PlaneKind,
        /// What is wrong with it.
        what: &'static str,
    },
    /// A plane was begun from a capture that had the same name but is not this one.
    #[error("capture {} is not the one this plane was begun from", id.0)]
    OtherCapture {
        /// The name they share.
        id: CaptureId,
    },
    /// An address that cannot be read.
    #[error("`{text}` is not an address: expected {expected}")]
    Address {
        /// As given.
        text: String,
        /// What would have been right.
        expected: &'static str,
    },
    /// No camera is on USB, or none with this serial number.
    #[error("no camera on USB{}", with_serial(serial.as_deref()))]
    NoCamera {
        /// The serial number asked for.
        serial: Option<String>,
    },
    /// More than one camera, and it was not said which. They are listed as people read them.
    #[error("several cameras on USB: {}", .0.join(", "))]
    SeveralCameras(Vec<String>),
    /// The camera is there and may not be opened by this user.
    #[error("no permission to open {device}; on Linux a udev rule gives it: {rule}")]
    Permission {
        /// The device, as people read it.
        device: String,
        /// The line for a file in `/etc/udev/rules.d`.
        rule: String,
    },
    /// Another program has the camera open.
    #[error("the camera is in use by another program")]
    InUse,
    /// A USB device that cannot be a camera's: its interface lacks a bulk endpoint in some direction.
    #[error("the camera's USB interface has no bulk endpoints in both directions")]
    NoEndpoints,
    /// USB failed otherwise.
    #[error("USB: {0}")]
    Usb(rusb::Error),
    /// The socket failed otherwise.
    #[error(transparent)]
    Io(std::io::Error),
}

fn hex(key: &[u8; 8]) -> String {
    key.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn with_serial(serial: Option<&str>) -> String {
    serial.map(|serial| format!(" with serial number {serial}")).unwrap_or_default()
}

impl From<std::io::Error> for LinkError {
    /// What every system says when the other side has ended is [`LinkError::Gone`].
    fn from(error: std::io::Error) -> Self {
        use std::io::ErrorKind as Kind;
        match error.kind() {
            Kind::BrokenPipe
            | Kind::ConnectionReset
            | Kind::ConnectionAborted
            | Kind::NotConnected
            | Kind::UnexpectedEof
            | Kind::WriteZero => Self::Gone,
            _ => Self::Io(error),
        }
    }
}
