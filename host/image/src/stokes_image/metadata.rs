//! How a Stokes image was measured.

use serde::{Deserialize, Serialize};

/// The one frame convention written and read: as seen in the picture.
pub const FRAME_CONVENTION: &str =
    "picture: x right, y up, angles counter-clockwise; s1 > 0 horizontal, s2 > 0 at +45 degrees (right-up)";

/// Everything a reader must know beside the planes. `None` is "not known", never a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StokesMetadata {
    /// Unit of s0, s1, s2 and the residual, e.g. `DN`.
    pub unit: String,
    /// Polarizer angle of each frame, degrees counter-clockwise from x right; empty if there were no frames (a
    /// simulation).
    pub angles_deg: Vec<f64>,
    /// Exposure of each frame, in µs; as many as angles, or empty if not known.
    pub exposure_us: Vec<f64>,
    /// Sensor gain, a factor; the same for all frames.
    pub gain: Option<f64>,
    /// Sensor output without light, in DN; already subtracted from s0.
    pub black_level_dn: Option<f64>,
    /// Sensor output at saturation, in DN.
    pub white_level_dn: Option<f64>,
    /// Bits of one raw sample, 1 to 32.
    pub bit_depth: Option<u8>,
    /// The format the planes had if they came from fixed-point arithmetic.
    pub fixed_point: Option<FixedPointFormat>,
    /// Color filters of the photosites, for a `Y` plane that is a raw mosaic.
    pub bayer: Option<BayerPattern>,
    /// What it was made from: a camera model, file names, a scene.
    pub source: String,
    /// Serial number of the camera.
    pub camera_serial: Option<String>,
    /// Name of the capture.
    pub capture_id: Option<String>,
    /// Program and version that made it.
    pub software_version: String,
}

/// A fixed-point word: value = integer / 2^`fractional_bits`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedPointFormat {
    /// Bits of the word, 1 to 64, sign included.
    pub word_bits: u8,
    /// Bits behind the binary point.
    pub fractional_bits: u8,
    /// Proved bound of the arithmetic's error in s0, s1, s2, in DN.
    pub error_bound_dn: [f64; 3],
}

/// The 2 × 2 color filters, named row by row from the top left photosite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum BayerPattern {
    /// Red, green / green, blue.
    Rggb,
    /// Blue, green / green, red.
    Bggr,
    /// Green, red / blue, green.
    Grbg,
    /// Green, blue / red, green.
    Gbrg,
}

impl BayerPattern {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Rggb, Self::Bggr, Self::Grbg, Self::Gbrg];

    /// Its name in files: four capitals.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rggb => "RGGB",
            Self::Bggr => "BGGR",
            Self::Grbg => "GRBG",
            Self::Gbrg => "GBRG",
        }
    }
}

impl StokesMetadata {
    /// The first value that makes no sense, in words.
    pub(super) fn check(&self) -> Result<(), String> {
        let (frames, exposures) = (self.angles_deg.len(), self.exposure_us.len());
        if exposures != 0 && exposures != frames {
            return Err(format!("{exposures} exposures for {frames} angles"));
        }
        let positive = |name: &str, v: f64| {
            if v > 0.0 && v.is_finite() { Ok(()) } else { Err(format!("{name} is {v}, not a positive number")) }
        };
        let finite = |name: &str, v: f64| if v.is_finite() { Ok(()) } else { Err(format!("{name} is {v}")) };
        self.angles_deg.iter().try_for_each(|&v| finite("an angle", v))?;
        self.exposure_us.iter().try_for_each(|&v| positive("an exposure", v))?;
        self.gain.map_or(Ok(()), |v| positive("the gain", v))?;
        self.black_level_dn.map_or(Ok(()), |v| finite("the black level", v))?;
        self.white_level_dn.map_or(Ok(()), |v| finite("the white level", v))?;
        if let (Some(black), Some(white)) = (self.black_level_dn, self.white_level_dn)
            && white <= black
        {
            return Err(format!("the white level {white} is not above the black level {black}"));
        }
        if let Some(bits) = self.bit_depth.filter(|b| !(1..=32).contains(b)) {
            return Err(format!("a bit depth of {bits}"));
        }
        if let Some(format) = self.fixed_point {
            if !(1..=64).contains(&format.word_bits) {
                return Err(format!("fixed-point words of {} bits", format.word_bits));
            }
            if let Some(bound) = format.error_bound_dn.iter().find(|b| !(b.is_finite() && **b >= 0.0)) {
                return Err(format!("a fixed-point error bound of {bound} DN"));
            }
        }
        Ok(())
    }
}
