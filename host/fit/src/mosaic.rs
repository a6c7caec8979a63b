//! Sensors with a polarizer on every photosite (division of focal plane): one exposure holds four frames.

use protocol_polar::Degrees;

use crate::FitError;

/// Polarizer angles of the repeating 2 × 2 cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolarizerMosaic {
    /// Row by row from the top left photosite; transmission axes in the picture's frame.
    pub cell: [[Degrees; 2]; 2],
}

impl PolarizerMosaic {
    /// Sony IMX250MZR (and the other mono Polarsens sensors), as FLIR and Lucid cameras deliver it: row 0 is 90, 45; row
    /// 1 is 135, 0.
    pub const IMX250MZR: Self = Self { cell: [[Degrees(90.0), Degrees(45.0)], [Degrees(135.0), Degrees(0.0)]] };

    /// Angles of the frames [`Self::split`] returns, in its order.
    #[must_use]
    pub fn angles(&self) -> [Degrees; 4] {
        let [[a, b], [c, d]] = self.cell;
        [a, b, c, d]
    }

    /// The four quarter frames (height/2 × width/2, row-major) of a raw mosaic (height × `width`, row-major), in the
    /// order top left, top right, bottom left, bottom right of the cell.
    ///
    /// Nothing is interpolated: the four samples of a cell lie up to one photosite diagonal apart on the object, so edges
    /// in the scene show false polarization in the quarter frames.
    ///
    /// # Errors
    /// [`FitError::Size`] where width or height is odd, or the samples are not a whole number of rows.
    pub fn split(&self, samples: &[f32], width: usize) -> Result<[Vec<f32>; 4], FitError> {
        let odd = |what, found: usize| FitError::Size { what, found, expected: found + 1 };
        if width == 0 || !width.is_multiple_of(2) {
            return Err(odd("columns of a polarizer mosaic", width));
        }
        let height = samples.len() / width;
        if height * width != samples.len() {
            return Err(FitError::Size { what: "samples", found: samples.len(), expected: height * width });
        }
        if !height.is_multiple_of(2) {
            return Err(odd("rows of a polarizer mosaic", height));
        }
        let mut quarters = [(); 4].map(|()| Vec::with_capacity(samples.len() / 4));
        for (y, row) in samples.chunks_exact(width).enumerate() {
            let first = 2 * (y % 2);
            for pair in row.as_chunks::<2>().0 {
                quarters[first].push(pair[0]);
                quarters[first + 1].push(pair[1]);
            }
        }
        Ok(quarters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_the_four_corners_of_each_cell() {
        let raw: Vec<f32> = (0..24_u8).map(f32::from).collect();
        let [a, b, c, d] = PolarizerMosaic::IMX250MZR.split(&raw, 6).unwrap();
        assert_eq!(a, [0.0, 2.0, 4.0, 12.0, 14.0, 16.0]);
        assert_eq!(b, [1.0, 3.0, 5.0, 13.0, 15.0, 17.0]);
        assert_eq!(c, [6.0, 8.0, 10.0, 18.0, 20.0, 22.0]);
        assert_eq!(d, [7.0, 9.0, 11.0, 19.0, 21.0, 23.0]);
    }

    #[test]
    fn odd_sizes_are_refused() {
        let split = |count: usize, width| PolarizerMosaic::IMX250MZR.split(&vec![0.0; count], width);
        assert!(matches!(split(15, 5), Err(FitError::Size { found: 5, .. })));
        assert!(matches!(split(12, 4), Err(FitError::Size { found: 3, .. })));
        assert!(matches!(split(13, 4), Err(FitError::Size { found: 13, .. })));
    }
}
