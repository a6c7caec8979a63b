//! Why an emulated camera cannot be had.

use firmware_core::SetupError;
use std::path::PathBuf;

/// Why an emulated camera cannot be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EmulatorError {
    /// Malformed: a source that cannot be read.
    #[error("source `{spec}`: {expected}")]
    Source {
        /// As given.
        spec: String,
        /// What was expected.
        expected: String,
    },
    /// A file or folder could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Malformed: not a PNG, or a damaged one.
    #[error("{}: {source}", path.display())]
    Png {
        /// Which.
        path: PathBuf,
        /// What the decoder said.
        source: png::DecodingError,
    },
    /// A sound picture or folder of a kind that cannot be replayed.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// Which.
        path: PathBuf,
        /// What it is and what was expected.
        what: String,
    },
    /// Malformed: the table of angles beside the pictures.
    #[error("{}: {what}", path.display())]
    Table {
        /// Which.
        path: PathBuf,
        /// What the parser said.
        what: String,
    },
    /// The board's servo cannot be driven.
    #[error("{0}")]
    Servo(String),
    /// The camera does not start.
    #[error("the camera does not start: {0:?}")]
    Setup(SetupError),
    /// An address that would let other machines in.
    #[error("{0} is not a loopback address: the emulated camera has no password")]
    NotLoopback(std::net::SocketAddr),
}
