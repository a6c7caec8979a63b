//! Photographs in place of a camera: a folder of pictures taken at known angles, or the mosaic of a polarization sensor.
//!
//! The wheel goes exactly to the angle of a picture and to no other; the exposure is what it was. Samples are taken as
//! linear.

mod album;
mod mosaic;
mod wheel;

pub use mosaic::Mosaic;
pub use wheel::{ReplayCamera, ReplayWheel};

use crate::{Clock, EmulatorError};
use album::Album;
use std::path::PathBuf;

/// Where the photographs are and what is known of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReplaySource {
    /// A folder of pictures, or one mosaic.
    pub path: PathBuf,
    /// How the mosaic is laid out; `None` for a folder.
    pub mosaic: Option<Mosaic>,
    /// Of a folder, only pictures whose name begins like this.
    pub prefix: String,
    /// DN without light; 0 where not given.
    pub black_level_dn: Option<u16>,
    /// DN from which a sample is saturated; the end of the range where not given.
    pub white_level_dn: Option<u16>,
    /// Bits of a sample; where not given, as many as the largest sample needs, at least 8.
    pub bit_depth: Option<u8>,
}

impl ReplaySource {
    /// Reads all pictures.
    pub(crate) fn open(&self, clock: &Clock) -> Result<(ReplayWheel, ReplayCamera), EmulatorError> {
        let album = match self.mosaic {
            Some(mosaic) => mosaic.read(&self.path)?,
            None => Album::read_folder(&self.path, &self.prefix)?,
        };
        let largest = album.pictures.iter().flat_map(|picture| &picture.samples).max().copied().unwrap_or(0);
        let needed = 8.max(16 - u8::try_from(largest.leading_zeros()).unwrap_or(0));
        let bit_depth = self.bit_depth.unwrap_or(needed);
        let unsupported = |what: String| Err(EmulatorError::Unsupported { path: self.path.clone(), what });
        if !(needed..=16).contains(&bit_depth) {
            return unsupported(format!("{bit_depth} bits do not hold a sample of {largest}"));
        }
        let top = u16::MAX >> (16 - bit_depth);
        let white_level_dn = self.white_level_dn.unwrap_or(top);
        let black_level_dn = self.black_level_dn.unwrap_or(0);
        if white_level_dn > top || black_level_dn >= white_level_dn {
            return unsupported(format!("black {black_level_dn} and white {white_level_dn} in a range up to {top}"));
        }
        let range = wheel::Range { bit_depth, black_level_dn, white_level_dn };
        Ok(wheel::replay(album, range, clock.clone()))
    }
}
