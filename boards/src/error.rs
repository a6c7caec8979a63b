//! What can be wrong with a board file, and where.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::locate;

/// Where in which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file as the caller named it.
    pub file: PathBuf,
    /// Line, counted from 1. A key that is missing has the line of the table it belongs in.
    pub line: usize,
    /// Dotted key, such as `wheel.servo.pulse_min_us`; empty where the text is not yet a key.
    pub key: String,
}

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

impl BoardError {
    /// Gives a parser error its file, line and key, and its kind.
    pub(crate) fn from_toml(file: &Path, text: &str, error: &toml::de::Error) -> Self {
        let place = locate::place_at(file, text, error.span().map_or(0, |span| span.start));
        let expected = error.message().to_owned();
        // toml has no error kinds; these two openings are serde's own (`de::Error::unknown_field`, `unknown_variant`).
        if expected.starts_with("unknown field") {
            Self::UnknownKey { place, expected }
        } else if expected.starts_with("unknown variant") {
            Self::UnknownValue { place, expected }
        } else {
            Self::Parse { place, expected }
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)?;
        if self.key.is_empty() { Ok(()) } else { write!(f, ": `{}`", self.key) }
    }
}
