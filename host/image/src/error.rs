//! What can go wrong with a picture, and the bounds every reader asks before it allocates.
//!
//! *Malformed* is a file that breaks its own format (cut short, bad checksum, contradiction), *unsupported* is a sound
//! file of a kind this crate does not read, *I/O* is the machine. Each names the path.

use std::path::{Path, PathBuf};

/// Most pixels a picture may have: 400 million, several times the largest sensor in use.
pub const MAX_PIXELS: u64 = 400_000_000;

/// No format read here packs better than this: LZW spends 12 bits on at most 3839 bytes (2559 : 1), deflate reaches
/// 1032 : 1. A header that promises more pixels than the file could hold is refused before anything is allocated.
const MAX_EXPANSION: u64 = 4096;

/// Why a picture could not be read, written or drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The machine refused: missing file, no permission, disk full.
    #[error("{}: {source}", path.display())]
    Io {
        /// File (or folder) in question.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file breaks its own format.
    #[error("{}: malformed: {what}", path.display())]
    Malformed {
        /// File in question.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// A sound file of a kind that is not read or written here.
    #[error("{}: unsupported: {what}", path.display())]
    Unsupported {
        /// File in question.
        path: PathBuf,
        /// What was found, and what is read instead.
        what: String,
    },
    /// More pixels than [`MAX_PIXELS`].
    #[error("{}: {width} x {height} pixels; at most {MAX_PIXELS} are read", path.display())]
    TooLarge {
        /// File in question.
        path: PathBuf,
        /// Columns the header states.
        width: u64,
        /// Rows the header states.
        height: u64,
    },
    /// A sample that is NaN or infinite.
    #[error("{}: {sample}", path.display())]
    NotFinite {
        /// File in question.
        path: PathBuf,
        /// Where it is and what it is.
        sample: NonFinite,
    },
    /// A channel or attribute that a Stokes image must have.
    #[error("{}: {name} is missing", path.display())]
    Missing {
        /// File in question.
        path: PathBuf,
        /// The channel or attribute, e.g. `channel S0.Y` or `attribute brewster:frame`.
        name: String,
    },
    /// An image in memory that contradicts itself: it is refused before a file is touched.
    #[error("the image contradicts itself: {what}")]
    Inconsistent {
        /// The two things that do not agree.
        what: String,
    },
    /// A preview of a plane that this image does not have.
    #[error("this image has no {plane} plane")]
    NoPlane {
        /// `flags` or `residual`.
        plane: &'static str,
    },
}

/// The first sample of a picture that is NaN or infinite.
#[derive(Clone, Debug, PartialEq)]
pub struct NonFinite {
    /// Column, from the left, counted from 0.
    pub column: usize,
    /// Row, from the top, counted from 0.
    pub row: usize,
    /// Channel: `R`, `G`, `B`, `Y`, or a Stokes channel such as `S1.Y`.
    pub channel: String,
    /// NaN, inf or -inf; a 64-bit value that 32 bits cannot hold is named as it was.
    pub value: f64,
}

impl std::fmt::Display for NonFinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} at column {}, row {}, channel {}", self.value, self.column, self.row, self.channel)
    }
}

/// An open file as errors and bounds see it.
#[derive(Clone, Copy)]
pub(crate) struct FileContext<'a> {
    pub(crate) path: &'a Path,
    /// Bytes in the file.
    pub(crate) length: u64,
}

impl FileContext<'_> {
    pub(crate) fn io(&self, source: std::io::Error) -> ImageError {
        io_error(self.path, source)
    }

    pub(crate) fn malformed(&self, what: impl Into<String>) -> ImageError {
        ImageError::Malformed { path: self.path.into(), what: what.into() }
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> ImageError {
        ImageError::Unsupported { path: self.path.into(), what: what.into() }
    }

    pub(crate) fn missing(&self, name: impl Into<String>) -> ImageError {
        ImageError::Missing { path: self.path.into(), name: name.into() }
    }

    /// The size a header states, once it is known to be affordable: (width, height), at most [`MAX_PIXELS`], and no
    /// more than the file's bytes could unpack to at `bytes_per_pixel`.
    pub(crate) fn bounded(&self, width: u64, height: u64, bytes_per_pixel: u64) -> Result<(usize, usize), ImageError> {
        if width == 0 || height == 0 {
            return Err(self.malformed(format!("{width} x {height} pixels")));
        }
        let too_large = || ImageError::TooLarge { path: self.path.into(), width, height };
        let pixels = width.checked_mul(height).filter(|&n| n <= MAX_PIXELS).ok_or_else(too_large)?;
        if pixels.saturating_mul(bytes_per_pixel) > self.length.saturating_mul(MAX_EXPANSION) {
            return Err(self.malformed(format!(
                "the header states {width} x {height} pixels, more than a file of {} bytes can hold",
                self.length
            )));
        }
        match (usize::try_from(width), usize::try_from(height)) {
            (Ok(w), Ok(h)) => Ok((w, h)),
            _ => Err(too_large()),
        }
    }

    /// Refuses a plane with a NaN or an infinity; `samples` is row-major height × width.
    pub(crate) fn finite(&self, samples: &[f32], width: usize, channel: &str) -> Result<(), ImageError> {
        match first_non_finite(samples, width, channel) {
            None => Ok(()),
            Some(sample) => Err(ImageError::NotFinite { path: self.path.into(), sample }),
        }
    }
}

/// The first NaN or infinity of one plane, in row order. `samples` is row-major, height × `width`; `channel` is the
/// name the answer carries.
#[must_use]
pub fn first_non_finite(samples: &[f32], width: usize, channel: &str) -> Option<NonFinite> {
    let index = samples.iter().position(|v| !v.is_finite())?;
    let value = samples.get(index).copied().map_or(f64::NAN, f64::from);
    let width = width.max(1);
    Some(NonFinite { column: index % width, row: index / width, channel: channel.into(), value })
}

pub(crate) fn io_error(path: &Path, source: std::io::Error) -> ImageError {
    ImageError::Io { path: path.into(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_file_cannot_ask_for_much_memory() {
        let file = FileContext { path: Path::new("bomb.png"), length: 100 };
        assert!(matches!(file.bounded(20_000, 20_001, 1), Err(ImageError::TooLarge { .. })));
        assert!(matches!(file.bounded(u64::MAX, 2, 1), Err(ImageError::TooLarge { .. })));
        assert!(matches!(file.bounded(20_000, 20_000, 1), Err(ImageError::Malformed { .. })));
        assert!(matches!(file.bounded(0, 3, 1), Err(ImageError::Malformed { .. })));
        assert_eq!(file.bounded(640, 640, 1).unwrap(), (640, 640));
    }

    #[test]
    fn the_first_bad_sample_is_the_first_in_row_order() {
        let plane = [0.0, 1.0, 2.0, 3.0, f32::NEG_INFINITY, f32::NAN];
        let found = first_non_finite(&plane, 3, "S1.Y").unwrap();
        assert_eq!((found.column, found.row, found.value), (1, 1, f64::NEG_INFINITY));
        assert_eq!(found.to_string(), "-inf at column 1, row 1, channel S1.Y");
        assert_eq!(first_non_finite(&plane[..4], 3, "Y"), None);
    }
}
