//! What can be wrong with a board file, and where.

use std::path::PathBuf;

use crate::locate::{Fault, FaultKind, Place};

/// Why a board file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The file could not be read.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file as the caller named it.
        file: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Malformed: not TOML, a value of the wrong type, or a key missing.
    #[error("{place}: {expected}")]
    Parse {
        /// Where.
        place: Place,
        /// What stands there and what was expected, in the parser's words.
        expected: String,
    },
    /// The file follows another schema than this program knows.
    #[error("{place}: schema {found} is not supported, expected {supported}")]
    UnknownSchema {
        /// Where.
        place: Place,
        /// The number in the file.
        found: i64,
        /// The number this crate reads.
        supported: i64,
    },
    /// A key the schema does not have.
    #[error("{place}: {expected}")]
    UnknownKey {
        /// Where; its `key` is the one that is not known.
        place: Place,
        /// The key and those that may stand there, in the parser's words.
        expected: String,
    },
    /// A word the schema does not have for this key.
    #[error("{place}: {expected}")]
    UnknownValue {
        /// Where.
        place: Place,
        /// The word and those that may stand there, in the parser's words.
        expected: String,
    },
    /// A value of the right type that no device can have, or that contradicts another.
    #[error("{place}: {value} is out of range, allowed: {allowed}")]
    OutOfRange {
        /// Where.
        place: Place,
        /// The value in the file.
        value: String,
        /// What would have been accepted.
        allowed: String,
    },
}

impl From<Fault> for BoardError {
    fn from(Fault { kind, place, expected }: Fault) -> Self {
        match kind {
            FaultKind::Malformed => Self::Parse { place, expected },
            FaultKind::UnknownKey => Self::UnknownKey { place, expected },
            FaultKind::UnknownValue => Self::UnknownValue { place, expected },
        }
    }
}
