//! A Stokes image: s0, s1, s2 per photosite, and everything one must know to use them.
//!
//! Planes are row-major height × width; rows run *down*, but the frame of the Stokes vectors is the picture's: x right,
//! y **up**, angles counter-clockwise, s1 > 0 horizontal, s2 > 0 at +45° (right-up). s0 is the full power.

mod attributes;
mod exr;
mod metadata;
mod npy;

use std::path::Path;

pub use metadata::{BayerPattern, FRAME_CONVENTION, FixedPointFormat, StokesMetadata};

use crate::error::{MAX_PIXELS, first_non_finite};
use crate::{ImageError, NonFinite};

/// Stokes planes of one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct StokesImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// One entry [`Color::Y`] (mono, or the photosites of a mosaic, each with its own color filter), or the three
    /// entries R, G, B in this order.
    pub colors: Vec<ColorPlanes>,
    /// How it was measured.
    pub metadata: StokesMetadata,
}

/// The planes of one color; each height × width, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorPlanes {
    /// Which color.
    pub color: Color,
    /// Full power, in [`StokesMetadata::unit`].
    pub s0: Vec<f32>,
    /// Horizontal minus vertical.
    pub s1: Vec<f32>,
    /// +45° minus −45°.
    pub s2: Vec<f32>,
    /// Bits of `protocol_polar::Flags`.
    pub flags: Option<Vec<u8>>,
    /// Misfit of the Stokes model per photosite, in the unit of s0.
    pub residual: Option<Vec<f32>>,
}

/// Name of a color plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Color {
    /// Grey, or raw mosaic photosites.
    Y,
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
}

impl Color {
    /// The channel suffix in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "Y",
            Self::R => "R",
            Self::G => "G",
            Self::B => "B",
        }
    }
}

impl StokesImage {
    /// Whether sizes, colors, values and metadata agree: what every writer here asks first.
    ///
    /// # Errors
    /// [`ImageError::Inconsistent`] with the first disagreement, NaN and infinities included.
    pub fn check(&self) -> Result<(), ImageError> {
        let wrong = |what: String| Err(ImageError::Inconsistent { what });
        let pixels = match self.width.checked_mul(self.height) {
            Some(n) if n > 0 && n as u64 <= MAX_PIXELS => n,
            _ => return wrong(format!("{} x {} pixels; 1 to {MAX_PIXELS} are held", self.width, self.height)),
        };
        let names: Vec<Color> = self.colors.iter().map(|c| c.color).collect();
        if !matches!(names.as_slice(), [Color::Y] | [Color::R, Color::G, Color::B]) {
            return wrong(format!("colors {names:?}; [Y] or [R, G, B] are held"));
        }
        for color in &self.colors {
            let lengths = color.float_planes().map(|(plane, v)| (plane, v.len()));
            let flags = color.flags.iter().map(|f| ("FLAGS", f.len()));
            for (plane, held) in lengths.chain(flags) {
                if held != pixels {
                    let (name, w, h) = (color.color.name(), self.width, self.height);
                    return wrong(format!("{held} values in plane {plane}.{name} of {w} x {h} pixels"));
                }
            }
        }
        if let Some(sample) = self.first_non_finite() {
            return wrong(sample.to_string());
        }
        self.metadata.check().map_err(|what| ImageError::Inconsistent { what })
    }

    /// The first NaN or infinity of the float planes, plane by plane; `None` for a sound image.
    #[must_use]
    pub fn first_non_finite(&self) -> Option<NonFinite> {
        self.colors.iter().find_map(|c| {
            c.float_planes()
                .find_map(|(plane, v)| first_non_finite(v, self.width, &format!("{plane}.{}", c.color.name())))
        })
    }

    /// Saves as one OpenEXR file: float channels `S0.R` ... `S2.B` (or `S0.Y`, `S1.Y`, `S2.Y`) and `RESIDUAL.R` ...,
    /// uint channels `FLAGS.R` ..., attributes `brewster:...`; lossless. Atomic.
    ///
    /// # Errors
    /// [`ImageError::Inconsistent`] before anything is written; [`ImageError::Io`].
    pub fn save_exr(&self, path: &Path) -> Result<(), ImageError> {
        self.check()?;
        exr::save(self, path)
    }

    /// Loads what [`StokesImage::save_exr`] saved, with the same bits.
    ///
    /// # Errors
    /// [`ImageError::Missing`] for a channel or attribute that is not there; [`ImageError::Unsupported`] for another
    /// frame convention, schema or channel type; [`ImageError::Malformed`] for files cut short and values that make no
    /// sense; [`ImageError::NotFinite`]; [`ImageError::TooLarge`]; [`ImageError::Io`].
    pub fn load_exr(path: &Path) -> Result<Self, ImageError> {
        exr::load(path)
    }

    /// Saves as a new folder: `S0.Y.npy`, ... (float32, H × W), `FLAGS.Y.npy` (uint8), `metadata.json` (every field of
    /// [`StokesMetadata`], the frame convention, the size and the names of the planes). Atomic: the folder appears
    /// whole; one that has files in it is refused.
    ///
    /// # Errors
    /// [`ImageError::Inconsistent`] before anything is written; [`ImageError::Io`].
    pub fn save_npy(&self, folder: &Path) -> Result<(), ImageError> {
        self.check()?;
        npy::save(self, folder)
    }
}

impl ColorPlanes {
    /// The float planes that are there, with their names in files.
    fn float_planes(&self) -> impl Iterator<Item = (&'static str, &Vec<f32>)> {
        let always = [("S0", &self.s0), ("S1", &self.s1), ("S2", &self.s2)];
        always.into_iter().chain(self.residual.iter().map(|r| ("RESIDUAL", r)))
    }
}

#[cfg(test)]
mod tests;
