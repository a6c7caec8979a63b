//! Mosaics of polarization sensors: four axes side by side behind one shutter.

use super::album::{Album, Picture, read_grey};
use crate::EmulatorError;
use protocol_polar::Degrees;
use std::path::Path;

/// Which axis each photosite of a superpixel has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mosaic {
    /// Sony IMX250MZR (and its relatives): 90° 45° above 135° 0°.
    Imx250mzr,
}

impl Mosaic {
    /// Axis, row and column in the superpixel, in the order of the axes.
    fn layout(self) -> [(f64, usize, usize); 4] {
        match self {
            Self::Imx250mzr => [(0.0, 1, 1), (45.0, 0, 1), (90.0, 0, 0), (135.0, 1, 0)],
        }
    }

    /// Splits a mosaic in four pictures of half its width and height: each superpixel becomes one photosite.
    pub(super) fn read(self, path: &Path) -> Result<Album, EmulatorError> {
        let (width, height, samples) = read_grey(path)?;
        if !width.is_multiple_of(2) || !height.is_multiple_of(2) {
            let what = format!("{width}x{height} is no mosaic of superpixels of 2x2");
            return Err(EmulatorError::Unsupported { path: path.to_owned(), what });
        }
        let pictures = self.layout().map(|(axis_deg, row, column)| {
            let rows = samples.chunks_exact(width as usize).skip(row).step_by(2);
            let samples = rows.flat_map(|row| row.iter().skip(column).step_by(2).copied()).collect();
            Picture { axis: Degrees(axis_deg), samples }
        });
        Ok(Album { width: width / 2, height: height / 2, pictures: pictures.into() })
    }
}
