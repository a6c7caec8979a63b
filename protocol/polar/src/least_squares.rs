//! Weighted linear least squares for (s0, s1, s2) from N >= 3 frames (paper eq. 5 in its general form).
//!
//! Householder QR of the whitened N × 3 analyzer matrix gives, in one pass, the pseudo-inverse, the covariance and an
//! orthonormal basis of what the model cannot explain (the residual). f64 throughout, no allocation; pure-Rust `libm`,
//! so the result is the same on every target, bit for bit.
#![expect(clippy::indexing_slicing, reason = "every index runs over an array length fixed at compile time")]

use crate::{Analyzer, MAX_FRAMES};

/// The solved system: how to turn N signals into Stokes components and residuals.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    frames: usize,
    weights: [[f64; MAX_FRAMES]; 3],
    residual_rows: [[f64; MAX_FRAMES]; MAX_FRAMES - 3],
    covariance: [[f64; 3]; 3],
    condition: f64,
}

/// Why (s0, s1, s2) cannot be had from these frames.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SolveError {
    /// Fewer than three or more than [`MAX_FRAMES`] frames.
    FrameCount {
        /// How many were given.
        frames: usize,
    },
    /// A throughput, efficiency, angle or σ that is not finite, or not positive where it must be.
    BadFrame {
        /// Index of the frame.
        frame: usize,
    },
    /// The frames do not determine three components: fewer than three distinct axes modulo 180°, or no efficiency.
    RankDeficient,
}

impl LeastSquares {
    /// Above this condition number the answer is mostly noise; cameras and tools refuse such a set of angles.
    /// (0/60/120 has 1.4; three axes 1° apart have 3700.)
    pub const USABLE_CONDITION: f64 = 1e3;

    /// Solves for frames with equal additive noise.
    ///
    /// # Errors
    /// [`SolveError`] as its variants say; `RankDeficient` beyond a condition number of 1e12.
    pub fn new(frames: &[Analyzer]) -> Result<Self, SolveError> {
        Self::weighted(frames, &[1.0; MAX_FRAMES][..frames.len().min(MAX_FRAMES)])
    }

    /// Solves for frames with additive noise of standard deviation `sigma[k]` (same unit as the signals).
    ///
    /// # Errors
    /// As [`Self::new`]; `BadFrame` also where `sigma` is shorter than `frames`.
    pub fn weighted(frames: &[Analyzer], sigma: &[f64]) -> Result<Self, SolveError> {
        let n = frames.len();
        if !(3..=MAX_FRAMES).contains(&n) {
            return Err(SolveError::FrameCount { frames: n });
        }
        let mut a = [[0.0; 3]; MAX_FRAMES];
        for (k, frame) in frames.iter().enumerate() {
            let noise = sigma.get(k).copied().unwrap_or(f64::NAN);
            let row = frame.row();
            let usable = frame.throughput > 0.0 && noise > 0.0 && noise.is_finite();
            if !usable || row.iter().any(|x| !x.is_finite()) {
                return Err(SolveError::BadFrame { frame: k });
            }
            a[k] = row.map(|x| x / noise);
        }
        let mut qt = [[0.0; MAX_FRAMES]; MAX_FRAMES];
        for (k, row) in qt.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        for j in 0..3 {
            reflect(&mut a, &mut qt, j, n);
        }
        let r = [a[0], [0.0, a[1][1], a[1][2]], [0.0, 0.0, a[2][2]]];
        let condition = condition_number(r);
        // Not a plain `>`: a NaN condition must be refused as well.
        if !matches!(condition.partial_cmp(&1e12), Some(core::cmp::Ordering::Less)) {
            return Err(SolveError::RankDeficient);
        }
        let inverse = invert_upper(r);
        let mut solved = Self {
            frames: n,
            weights: [[0.0; MAX_FRAMES]; 3],
            residual_rows: [[0.0; MAX_FRAMES]; MAX_FRAMES - 3],
            covariance: [[0.0; 3]; 3],
            condition,
        };
        for i in 0..3 {
            for k in 0..n {
                let whitened: f64 = (i..3).map(|m| inverse[i][m] * qt[m][k]).sum();
                solved.weights[i][k] = whitened / sigma[k];
            }
            for m in 0..3 {
                solved.covariance[i][m] = (0..3).map(|l| inverse[i][l] * inverse[m][l]).sum();
            }
        }
        for (to, from) in solved.residual_rows.iter_mut().zip(&qt[3..n]) {
            for k in 0..n {
                to[k] = from[k] / sigma[k];
            }
        }
        Ok(solved)
    }

    /// Number of frames N.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The pseudo-inverse, 3 × N: row j times the signals is component j.
    #[must_use]
    pub fn weights(&self) -> [&[f64]; 3] {
        self.weights.each_ref().map(|row| &row[..self.frames])
    }

    /// (N − 3) × N, orthonormal after whitening: row m times the signals is a residual of standard deviation 1 (in units
    /// of the given σ) and mean 0 for any light that follows the model.
    pub fn residual_rows(&self) -> impl Iterator<Item = &[f64]> {
        self.residual_rows.iter().take(self.frames - 3).map(|row| &row[..self.frames])
    }

    /// Covariance (AᵀWA)⁻¹ of (s0, s1, s2), in units of σ² as given.
    #[must_use]
    pub fn covariance(&self) -> [[f64; 3]; 3] {
        self.covariance
    }

    /// Ratio of the largest to the smallest singular value of the whitened analyzer matrix.
    #[must_use]
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// (s0, s1, s2) from N signals (dark-subtracted, linear; the frames' order).
    #[must_use]
    pub fn solve(&self, signals: &[f64]) -> [f64; 3] {
        self.weights.map(|row| row.iter().zip(signals).map(|(w, x)| w * x).sum())
    }

    /// χ² of N signals against the model: the sum of squares of the N − 3 whitened residuals.
    #[must_use]
    pub fn chi2(&self, signals: &[f64]) -> f64 {
        self.residual_rows()
            .map(|row| {
                let r: f64 = row.iter().zip(signals).map(|(w, x)| w * x).sum();
                r * r
            })
            .sum()
    }
}

/// One Householder step: zeroes column `j` of `a` below the diagonal and accumulates Qᵀ.
fn reflect(a: &mut [[f64; 3]; MAX_FRAMES], qt: &mut [[f64; MAX_FRAMES]; MAX_FRAMES], j: usize, n: usize) {
    let mut v = [0.0; MAX_FRAMES];
    for k in j..n {
        v[k] = a[k][j];
    }
    let norm = libm::sqrt(v.iter().map(|x| x * x).sum());
    // The sign that adds magnitudes: no cancellation in v[j].
    v[j] += libm::copysign(norm, v[j]);
    let vv: f64 = v.iter().map(|x| x * x).sum();
    if vv <= 0.0 {
        return; // a zero column: the condition number will say so
    }
    let beta = 2.0 / vv;
    reflect_columns(a, &v, beta, j, n, 3);
    reflect_columns(qt, &v, beta, j, n, n);
}

/// Applies I − β v vᵀ to the first `columns` columns of rows j..n.
fn reflect_columns<const C: usize>(
    rows: &mut [[f64; C]; MAX_FRAMES],
    v: &[f64; MAX_FRAMES],
    beta: f64,
    j: usize,
    n: usize,
    columns: usize,
) {
    for c in 0..columns {
        let dot: f64 = rows[j..n].iter().zip(&v[j..n]).map(|(row, v)| v * row[c]).sum();
        for (row, v) in rows[j..n].iter_mut().zip(&v[j..n]) {
            row[c] -= beta * dot * v;
        }
    }
}

/// Inverse of an upper triangular 3 × 3 matrix with non-zero diagonal.
fn invert_upper(r: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let d = [1.0 / r[0][0], 1.0 / r[1][1], 1.0 / r[2][2]];
    let a = -r[0][1] * d[0] * d[1];
    let b = -r[1][2] * d[1] * d[2];
    let c = -(r[0][1] * b + r[0][2] * d[2]) * d[0];
    [[d[0], a, c], [0.0, d[1], b], [0.0, 0.0, d[2]]]
}

/// 2-norm condition number of a 3 × 3 matrix by one-sided Jacobi (accurate for small singular values too).
fn condition_number(r: [[f64; 3]; 3]) -> f64 {
    let mut columns = [[r[0][0], r[1][0], r[2][0]], [r[0][1], r[1][1], r[2][1]], [r[0][2], r[1][2], r[2][2]]];
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    for _sweep in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (x, y) = (columns[p], columns[q]);
            let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
            if libm::fabs(xy) <= 1e-17 * libm::sqrt(xx * yy) {
                continue;
            }
            let zeta = (yy - xx) / (2.0 * xy);
            let t = libm::copysign(1.0, zeta) / (libm::fabs(zeta) + libm::hypot(1.0, zeta));
            let c = 1.0 / libm::hypot(1.0, t);
            let s = c * t;
            for i in 0..3 {
                columns[p][i] = c * x[i] - s * y[i];
                columns[q][i] = s * x[i] + c * y[i];
            }
        }
    }
    let norms = columns.map(|c| libm::sqrt(dot(c, c)));
    let largest = norms.iter().copied().fold(0.0, f64::max);
    let smallest = norms.iter().copied().fold(f64::INFINITY, f64::min);
    largest / smallest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Degrees, Radians, Stokes};
    use proptest::prelude::*;

    fn ideal(degrees: &[f64]) -> ([Analyzer; MAX_FRAMES], usize) {
        let mut set = [Analyzer::ideal(Radians(0.0)); MAX_FRAMES];
        for (slot, d) in set.iter_mut().zip(degrees) {
            slot.angle = Degrees(*d).to_radians();
        }
        (set, degrees.len())
    }

    fn trace(degrees: &[f64]) -> f64 {
        let (set, n) = ideal(degrees);
        let c = LeastSquares::new(&set[..n]).unwrap().covariance();
        c[0][0] + c[1][1] + c[2][2]
    }

    /// PHYSICS: 0/45/90 gives 10, 0/60/120 gives 20/3, N equispaced 20/N.
    #[test]
    fn equispaced_angles_have_less_noise_than_the_papers_set() {
        assert!((trace(&[0.0, 45.0, 90.0]) - 10.0).abs() < 1e-12);
        assert!((trace(&[0.0, 60.0, 120.0]) - 20.0 / 3.0).abs() < 1e-12);
        assert!((trace(&[0.0, 30.0, 60.0, 90.0, 120.0, 150.0]) - 20.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn the_papers_three_angles_give_its_equation_5() {
        let (set, n) = ideal(&[0.0, 45.0, 90.0]);
        let (h, d, v) = (0.9, 0.4, 0.3);
        let s = LeastSquares::new(&set[..n]).unwrap().solve(&[h, d, v]);
        for (got, want) in s.iter().zip([h + v, h - v, 2.0 * d - h - v]) {
            assert!((got - want).abs() < 1e-15, "{s:?}");
        }
    }

    #[test]
    fn degenerate_sets_are_refused() {
        for set in [&[0.0, 180.0, 90.0][..], &[10.0, 10.0, 10.0], &[0.0, 90.0, 0.0, 90.0]] {
            let (a, n) = ideal(set);
            assert_eq!(LeastSquares::new(&a[..n]).err(), Some(SolveError::RankDeficient), "{set:?}");
        }
        let (a, _) = ideal(&[0.0, 60.0]);
        assert_eq!(LeastSquares::new(&a[..2]).err(), Some(SolveError::FrameCount { frames: 2 }));
        let (mut a, n) = ideal(&[0.0, 60.0, 120.0]);
        a[1].throughput = f64::NAN;
        assert_eq!(LeastSquares::new(&a[..n]).err(), Some(SolveError::BadFrame { frame: 1 }));
        a[1].throughput = 1.0;
        a.iter_mut().for_each(|f| f.efficiency = 0.0);
        assert_eq!(LeastSquares::new(&a[..n]).err(), Some(SolveError::RankDeficient));
    }

    proptest! {
        #[test]
        fn any_light_through_any_usable_set_comes_back(
            angles in prop::collection::vec(0.0..180.0_f64, 3..=MAX_FRAMES),
            efficiency in 0.5..1.0_f64,
            (s0, p, psi) in (0.1..10.0_f64, 0.0..1.0_f64, 0.0..3.2_f64),
        ) {
            let (mut set, n) = ideal(&angles);
            set.iter_mut().for_each(|a| a.efficiency = efficiency);
            let Ok(solver) = LeastSquares::new(&set[..n]) else { return Ok(()) };
            let light = Stokes::linear(s0, p, Radians(psi));
            let mut signals = [0.0; MAX_FRAMES];
            for (x, a) in signals.iter_mut().zip(&set) {
                *x = a.row().iter().zip(light.0).map(|(r, s)| r * s).sum();
            }
            let back = solver.solve(&signals[..n]);
            for (b, s) in back.iter().zip(light.0) {
                prop_assert!((b - s).abs() <= 1e-13 * solver.condition() * s0, "{back:?} {light:?}");
            }
            prop_assert!(solver.chi2(&signals[..n]) < 1e-24 * s0 * s0);
        }
    }
}
