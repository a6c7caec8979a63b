//! Structural similarity: Wang, Bovik, Sheikh and Simoncelli 2004, "Image quality assessment: from error visibility to
//! structural similarity", eq. 13.
//!
//! Gaussian window of 11 × 11, σ = 1.5, weights that sum to 1, variances of the population, K1 = 0.01, K2 = 0.03; the mean
//! is over the positions where the window lies inside the picture, as in the authors' program.

use rayon::prelude::*;

/// Side of the window.
pub(super) const WINDOW: usize = 11;
const SIGMA: f64 = 1.5;
const K1: f64 = 0.01;
const K2: f64 = 0.03;

/// Weighted means under the window: x, y, x², y², xy.
type Moments = [f64; 5];

/// Mean SSIM of two planes, row-major with rows of `width`, at least 11 × 11; `peak` is L, the range of the values.
/// The result does not depend on the number of threads. Memory: five numbers per column and thread.
pub(super) fn ssim(x: &[f64], y: &[f64], width: usize, peak: f64) -> f64 {
    let height = x.len() / width;
    let weights = window();
    let [c1, c2] = [K1, K2].map(|k| (k * peak).powi(2));
    let row_sum = |row: usize| -> f64 {
        let down: Vec<Moments> =
            (0..width).map(|column| vertical(x, y, row * width + column, width, &weights)).collect();
        down.windows(WINDOW).map(|across| local(across, &weights, c1, c2)).sum()
    };
    let rows: Vec<f64> = (0..=height - WINDOW).into_par_iter().map(row_sum).collect();
    rows.iter().sum::<f64>() / (rows.len() * (width + 1 - WINDOW)) as f64
}

/// One dimension of the separable window.
fn window() -> [f64; WINDOW] {
    let half = (WINDOW / 2) as f64;
    let weights: [f64; WINDOW] = std::array::from_fn(|i| (-0.5 * ((i as f64 - half) / SIGMA).powi(2)).exp());
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

/// Moments of the column that starts at `start`.
fn vertical(x: &[f64], y: &[f64], start: usize, width: usize, weights: &[f64; WINDOW]) -> Moments {
    let mut sums = [0.0; 5];
    for (k, w) in weights.iter().enumerate() {
        let (x, y) = (x[start + k * width], y[start + k * width]);
        for (sum, v) in sums.iter_mut().zip([x, y, x * x, y * y, x * y]) {
            *sum += w * v;
        }
    }
    sums
}

/// SSIM at one position, eq. 13.
fn local(across: &[Moments], weights: &[f64; WINDOW], c1: f64, c2: f64) -> f64 {
    let mut sums = [0.0; 5];
    for (moments, w) in across.iter().zip(weights) {
        for (sum, m) in sums.iter_mut().zip(moments) {
            *sum += w * m;
        }
    }
    let [x, y, xx, yy, xy] = sums;
    let (var_x, var_y, cov) = (xx - x * x, yy - y * y, xy - x * y);
    (2.0 * x * y + c1) * (2.0 * cov + c2) / ((x * x + y * y + c1) * (var_x + var_y + c2))
}
