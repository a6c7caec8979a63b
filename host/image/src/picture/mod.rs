//! A picture from any camera: one frame, as its file stores it.
//!
//! Samples are interleaved, row-major: height × width × channels; rows run *down*. Values are the file's own numbers
//! (DN for integers): nothing is linearized or scaled here, [`Encoding`] says what is known about them.

mod exr;
mod png;
mod tiff;

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use crate::ImageError;
use crate::error::{FileContext, NonFinite, io_error};
use crate::npy;

/// One frame: grey (1 channel) or RGB (3 channels); alpha is dropped on reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 (grey, or the raw photosites of a mosaic) or 3 (R, G, B).
    pub channels: usize,
    /// height × width × channels, row-major, interleaved.
    pub samples: Samples,
    /// What the file says about how its numbers follow the light.
    pub encoding: Encoding,
}

/// The samples of a [`Picture`], in the type the file stores.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 8-bit integers, 0-255.
    U8(Vec<u8>),
    /// 16-bit integers, 0-65535.
    U16(Vec<u16>),
    /// 32-bit floats; finite.
    F32(Vec<f32>),
}

/// How the numbers of a file follow the light. Stokes needs linear ones.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Encoding {
    /// Proportional to light, by the format's own definition (OpenEXR) or statement (PNG with `gAMA` = 1).
    Linear,
    /// The file says it is sRGB coded.
    Srgb,
    /// The file states a power law: sample = light^exponent (PNG `gAMA`; 0.45455 is the usual 1/2.2).
    Gamma {
        /// The exponent.
        exponent: f32,
    },
    /// The file refers to a color profile (ICC, cICP), which is not interpreted here.
    Profile,
    /// An 8-bit PNG or TIFF which does not say: nearly always gamma coded for display.
    ProbablyGamma,
    /// Nothing is said, and the type does not suggest it: 16-bit, float TIFF, npy.
    Unstated,
}

impl Picture {
    /// Reads a PNG (8 or 16 bit; grey, RGB, either with alpha), TIFF (8 or 16 bit integer, 32-bit float; grey or RGB;
    /// its first image), OpenEXR (half or float; one layer `Y` or `R`, `G`, `B`) or npy (u8, u16, f32, f64 rounded to
    /// f32; C order, H × W or H × W × 3). The kind is told from the content, not from the name.
    ///
    /// # Errors
    /// Each names the path. [`ImageError::Io`]; [`ImageError::Malformed`] for a file that is cut short or corrupt;
    /// [`ImageError::Unsupported`] for other types and layouts; [`ImageError::TooLarge`];
    /// [`ImageError::NotFinite`] for a float file with NaN or an infinity.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let (mut reader, file) = open(path)?;
        let mut magic = Vec::new();
        reader.by_ref().take(8).read_to_end(&mut magic).map_err(|e| file.io(e))?;
        reader.rewind().map_err(|e| file.io(e))?;
        let picture = match magic.as_slice() {
            [0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a] => png::read(reader, file),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => tiff::read(reader, file),
            [0x76, 0x2f, 0x31, 0x01, ..] => exr::read(reader, file),
            [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => npy::read(reader, file),
            [] => Err(file.malformed("the file is empty")),
            [0xff, 0xd8, ..] => Err(file.unsupported(
                "JPEG: its samples are gamma coded and lossy, so Stokes from them are wrong; PNG, TIFF, OpenEXR and npy \
                 are read",
            )),
            other if is_cut_short(other) => Err(file.malformed(format!("only {} bytes", file.length))),
            other => Err(file.unsupported(format!(
                "the file starts with {other:02x?}; PNG, TIFF, OpenEXR and npy are read"
            ))),
        }?;
        match picture.first_non_finite() {
            Some(sample) => Err(ImageError::NotFinite { path: path.into(), sample }),
            None => Ok(picture),
        }
    }

    /// The first NaN or infinity of a float picture, in row order; `None` for a sound one.
    #[must_use]
    pub fn first_non_finite(&self) -> Option<NonFinite> {
        let Samples::F32(samples) = &self.samples else { return None };
        let per_row = self.width.saturating_mul(self.channels).max(1);
        let index = samples.iter().position(|v| !v.is_finite())?;
        let value = samples.get(index).copied().map_or(f64::NAN, f64::from);
        let within = index % per_row;
        let channels = self.channels.max(1);
        let channel = self.channel_names().get(within % channels).copied().unwrap_or("?").to_owned();
        Some(NonFinite { column: within / channels, row: index / per_row, channel, value })
    }

    /// Writes a PNG: 8 or 16 bit, grey or RGB, with the `sRGB` or `gAMA` chunk of [`Picture::encoding`]. Atomic.
    ///
    /// # Errors
    /// [`ImageError::Unsupported`] for float samples, [`ImageError::Inconsistent`], [`ImageError::Io`].
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        self.check()?;
        png::write(self, path)
    }

    /// Writes an OpenEXR file of float samples: `Y`, or `R`, `G`, `B`; lossless. Atomic.
    ///
    /// # Errors
    /// [`ImageError::Unsupported`] for integer samples, [`ImageError::Inconsistent`], [`ImageError::Io`].
    pub fn write_exr(&self, path: &Path) -> Result<(), ImageError> {
        self.check()?;
        exr::write(self, path)
    }

    /// Writes an npy file (format 1.0, little-endian, C order) of shape H × W, or H × W × 3 for RGB. Atomic.
    ///
    /// # Errors
    /// [`ImageError::Inconsistent`], [`ImageError::Io`].
    pub fn write_npy(&self, path: &Path) -> Result<(), ImageError> {
        self.check()?;
        let shape: &[usize] =
            if self.channels == 1 { &[self.height, self.width] } else { &[self.height, self.width, self.channels] };
        match &self.samples {
            Samples::U8(v) => npy::write(path, shape, v),
            Samples::U16(v) => npy::write(path, shape, v),
            Samples::F32(v) => npy::write(path, shape, v),
        }
    }

    fn channel_names(&self) -> &'static [&'static str] {
        if self.channels == 1 { &["Y"] } else { &["R", "G", "B"] }
    }

    fn check(&self) -> Result<(), ImageError> {
        let stated = self.width.checked_mul(self.height).and_then(|n| n.checked_mul(self.channels));
        let held = self.samples.len();
        if !matches!(self.channels, 1 | 3) || held == 0 || stated != Some(held) {
            return Err(ImageError::Inconsistent {
                what: format!(
                    "{held} samples for {} x {} pixels of {} channels",
                    self.width, self.height, self.channels
                ),
            });
        }
        Ok(())
    }
}

impl Samples {
    /// How many samples: height × width × channels.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Opens a file and takes its length, for the bounds.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, FileContext<'_>), ImageError> {
    let io = |source| io_error(path, source);
    let opened = File::open(path).map_err(io)?;
    let length = opened.metadata().map_err(io)?.len();
    Ok((BufReader::with_capacity(1 << 18, opened), FileContext { path, length }))
}

/// Whether these few bytes could be the start of a file that is read here.
fn is_cut_short(start: &[u8]) -> bool {
    const STARTS: [&[u8]; 6] = [b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*", b"II+\0", b"\x76\x2f\x31\x01", b"\x93NUMPY"];
    STARTS.iter().any(|s| s.starts_with(start))
}

/// Keeps the first `channels` of every `stored` interleaved samples: what is left out is alpha.
fn drop_alpha<T: Copy>(samples: Vec<T>, stored: usize, channels: usize) -> Vec<T> {
    if stored == channels {
        return samples;
    }
    samples.chunks_exact(stored).flat_map(|pixel| pixel.iter().take(channels).copied()).collect()
}

#[cfg(test)]
mod tests;
