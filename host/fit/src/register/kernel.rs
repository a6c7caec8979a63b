//! Weights of the pixels that make a node of the grid: interpolation where the grid is finer than the picture, the mean
//! over the node's cell where it is coarser.
//!
//! The colors of a raw mosaic are lattices of their own, of every second row and column, resampled as pictures of half
//! the size; green is the mean of its two.

use glam::{DMat2, DVec2};
use host_image::BayerPattern;

/// How to interpolate between pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Between four: never leaves the range of what was measured, blurs by up to a pixel.
    Bilinear,
    /// Between sixteen, Catmull and Rom's: keeps detail; overshoots at edges.
    #[default]
    Cubic,
}

/// Sites of one color in a picture: pixel (first + step · (i, j)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lattice {
    pub(super) first: [usize; 2],
    pub(super) step: usize,
}

impl Lattice {
    /// Every pixel.
    pub(super) const ALL: Self = Self { first: [0, 0], step: 1 };

    /// Those of R, G and B.
    pub(super) fn of_bands(bayer: Option<BayerPattern>) -> [Vec<Self>; 3] {
        let Some(pattern) = bayer else { return [const { Self::ALL }; 3].map(|all| vec![all]) };
        let cell = pattern.name().as_bytes();
        ["R", "G", "B"].map(|color| {
            let is_here = |k: &usize| cell[*k] == color.as_bytes()[0];
            (0..4).filter(is_here).map(|k| Self { first: [k % 2, k / 2], step: 2 }).collect()
        })
    }
}

/// Pixels and their weights.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Footprint {
    /// ([column, row], weight); weights sum to 1; each pixel once.
    pub(super) taps: Vec<([usize; 2], f64)>,
    /// Dense weights while they are summed.
    scratch: Vec<f64>,
}

/// A cell larger than this many pixels a side is sampled, no longer averaged.
const MOST_SAMPLES: f64 = 64.0;

/// How far from its middle a node reaches into the picture at most, pixels, for cells with these sides.
pub(super) fn reach(cell: &DMat2, step: usize) -> f64 {
    let half = 0.5 * (cell.x_axis.abs() + cell.y_axis.abs()).max_element();
    half + 2.5 * step as f64
}

impl Footprint {
    /// Of the node at `pixel` (continuous, in a picture of `size`), whose cell has the sides `cell` (pixels), on the
    /// lattices of one color, each with the same share. Sites beyond the picture are those at its edge.
    pub(super) fn fill(
        &mut self,
        pixel: DVec2,
        cell: &DMat2,
        lattices: &[Lattice],
        size: [usize; 2],
        interpolation: Interpolation,
    ) {
        self.taps.clear();
        for lattice in lattices {
            self.add(pixel, cell, *lattice, size, interpolation, 1.0 / lattices.len() as f64);
        }
    }

    fn add(
        &mut self,
        pixel: DVec2,
        cell: &DMat2,
        lattice: Lattice,
        size: [usize; 2],
        interpolation: Interpolation,
        share: f64,
    ) {
        let step = lattice.step as f64;
        let count = [0, 1].map(|k| (size[k] - lattice.first[k]).div_ceil(lattice.step));
        // Sites at whole numbers.
        let first = DVec2::new(lattice.first[0] as f64, lattice.first[1] as f64);
        let center = (pixel - 0.5 - first) / step;
        let sides = *cell * (1.0 / step);
        // Cells up to one and a half sites wide are interpolated, larger ones averaged over samples about a site apart.
        let [n, m] = [sides.x_axis, sides.y_axis].map(|side| side.length().round().clamp(1.0, MOST_SAMPLES));
        let extent = 0.5 * (sides.x_axis.abs() + sides.y_axis.abs());
        let low = (center - extent).floor() - 1.0;
        let span = ((center + extent).floor() + 2.0 - low + 1.0).max(DVec2::splat(4.0));
        let columns = index(span.x, usize::MAX);
        self.scratch.clear();
        self.scratch.resize(columns * index(span.y, usize::MAX), 0.0);
        let weight = share / (n * m);
        for i in 0..index(n, 64) {
            for j in 0..index(m, 64) {
                let offset = sides * DVec2::new((i as f64 + 0.5) / n - 0.5, (j as f64 + 0.5) / m - 0.5);
                let at = center + offset;
                let part = at - at.floor();
                let (wx, wy) = match interpolation {
                    Interpolation::Bilinear => (linear(part.x), linear(part.y)),
                    Interpolation::Cubic => (cubic(part.x), cubic(part.y)),
                };
                // The first of the four taps is one site before the one below.
                let (x0, y0) =
                    (index(at.x.floor() - 1.0 - low.x, columns), index(at.y.floor() - 1.0 - low.y, usize::MAX));
                for (dy, wy) in wy.iter().enumerate() {
                    for (dx, wx) in wx.iter().enumerate() {
                        if let Some(sum) = self.scratch.get_mut((y0 + dy) * columns + x0 + dx) {
                            *sum += weight * wx * wy;
                        }
                    }
                }
            }
        }
        let site = |k: usize| [low.x + (k % columns) as f64, low.y + (k / columns) as f64];
        let is_inside = |k: usize| [0, 1].iter().all(|a| (0.0..count[*a] as f64).contains(&site(k)[*a]));
        let pixel = |k: usize| [0, 1].map(|a| lattice.first[a] + lattice.step * index(site(k)[a], count[a] - 1));
        let weighted = || self.scratch.iter().enumerate().filter(|(_, w)| **w != 0.0);
        self.taps.extend(weighted().filter(|(k, _)| is_inside(*k)).map(|(k, w)| (pixel(k), *w)));
        for (k, w) in weighted().filter(|(k, _)| !is_inside(*k)) {
            let pixel = pixel(k);
            match self.taps.iter_mut().find(|(p, _)| *p == pixel) {
                Some((_, sum)) => *sum += w,
                None => self.taps.push((pixel, *w)),
            }
        }
    }
}

/// Weights of the sites at −1, 0, 1, 2.
fn linear(t: f64) -> [f64; 4] {
    [0.0, 1.0 - t, t, 0.0]
}

/// Catmull and Rom 1974; Keys 1981 with a = −1/2.
fn cubic(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (-t3 + 2.0 * t2 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (-3.0 * t3 + 4.0 * t2 + t), 0.5 * (t3 - t2)]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number, clamped to [0, largest]")]
fn index(whole: f64, largest: usize) -> usize {
    (whole.max(0.0) as usize).min(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weighted(footprint: &Footprint, value: impl Fn(f64, f64) -> f64) -> f64 {
        footprint.taps.iter().map(|([x, y], w)| w * value(*x as f64 + 0.5, *y as f64 + 0.5)).sum()
    }

    /// Constants and ramps come back exactly from every kernel, lattice and footprint; what is quadratic does from the
    /// cubic one, and averages to its mean over the cell.
    #[test]
    fn polynomials_are_reproduced() {
        let mut footprint = Footprint::default();
        let size = [64, 48];
        let cells = [
            DMat2::IDENTITY * 0.4,
            DMat2::from_cols_array(&[0.6, 0.3, -0.2, 0.8]),
            DMat2::from_cols_array(&[5.0, 2.0, -1.5, 4.2]),
        ];
        let bands = Lattice::of_bands(Some(BayerPattern::Grbg));
        for at in [DVec2::new(30.2, 20.9), DVec2::new(31.0, 22.5), DVec2::new(25.99, 24.01)] {
            for cell in &cells {
                for lattices in [&[Lattice::ALL][..], &bands[0], &bands[1], &bands[2]] {
                    for kernel in [Interpolation::Bilinear, Interpolation::Cubic] {
                        footprint.fill(at, cell, lattices, size, kernel);
                        assert!((weighted(&footprint, |_, _| 1.0) - 1.0).abs() < 1e-12);
                        let ramp = weighted(&footprint, |x, y| 2.0 * x - 3.0 * y);
                        assert!((ramp - (2.0 * at.x - 3.0 * at.y)).abs() < 1e-10, "{at} {cell} {kernel:?}: {ramp}");
                    }
                }
            }
            footprint.fill(at, &cells[0], &[Lattice::ALL], size, Interpolation::Cubic);
            let square = weighted(&footprint, |x, y| (x - 28.0) * (y - 21.0) + (x - 28.0).powi(2));
            assert!((square - ((at.x - 28.0) * (at.y - 21.0) + (at.x - 28.0).powi(2))).abs() < 1e-10);
            // Mean of (x − x₀)² over a parallelogram is (a_x² + b_x²)/12; of n samples along a side (1 − 1/n²) of its
            // share.
            footprint.fill(at, &cells[2], &[Lattice::ALL], size, Interpolation::Cubic);
            let spread = weighted(&footprint, |x, _| (x - at.x).powi(2));
            let exact = (5.0_f64.powi(2) + 1.5_f64.powi(2)) / 12.0;
            assert!(spread > 0.93 * exact && spread < exact, "{spread} {exact}");
        }
    }

    /// The colors of a mosaic come from their own sites only.
    #[test]
    #[expect(clippy::float_cmp, reason = "shares rounded to nine places")]
    fn colors_of_a_mosaic_stay_apart() {
        let [red, green, blue] = Lattice::of_bands(Some(BayerPattern::Rggb));
        assert_eq!((red.len(), green.len(), blue.len()), (1, 2, 1));
        let mut footprint = Footprint::default();
        for at in [DVec2::new(0.2, 0.2), DVec2::new(10.7, 3.3), DVec2::new(15.9, 11.9)] {
            let mut parities = |lattices: &[Lattice]| {
                footprint.fill(at, &DMat2::IDENTITY, lattices, [16, 12], Interpolation::Cubic);
                assert!((weighted(&footprint, |_, _| 1.0) - 1.0).abs() < 1e-12);
                let sum = |x: usize, y: usize| {
                    footprint.taps.iter().filter(|([a, b], _)| (a % 2, b % 2) == (x, y)).map(|t| t.1).sum::<f64>()
                };
                [sum(0, 0), sum(1, 0), sum(0, 1), sum(1, 1)].map(|s| (s * 1e9).round() / 1e9)
            };
            assert_eq!(parities(&red), [1.0, 0.0, 0.0, 0.0]);
            assert_eq!(parities(&green), [0.0, 0.5, 0.5, 0.0]);
            assert_eq!(parities(&blue), [0.0, 0.0, 0.0, 1.0]);
        }
    }
}
