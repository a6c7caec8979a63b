//! All that the samples of a capture say about its angles: Σ w x xᵀ.

use protocol_polar::fixed::Noise;
use protocol_polar::{Analyzer, Degrees, LeastSquares, MAX_FRAMES, Radians, SolveError, distinct_axes};
use rayon::prelude::*;

use crate::FitError;

/// The projector on what no light explains, P⊥ = Σ q qᵀ over the residual rows.
pub(super) struct Projector {
    pub(super) least_squares: LeastSquares,
}

/// Moment matrix of N signals.
pub(super) struct Moments {
    n: usize,
    /// Σ w (x xᵀ − diag(v)), w = 1/mean of the variances v; N × N, row-major.
    signal: Vec<f64>,
    /// Σ w diag(v).
    noise: Vec<f64>,
    /// How many samples.
    pub(super) samples: usize,
}

impl Projector {
    pub(super) fn new(analyzers: &[Analyzer]) -> Result<Self, FitError> {
        let least_squares = LeastSquares::new(analyzers).map_err(|e| match e {
            SolveError::BadFrame { frame } => FitError::BadFrame { frame },
            _ => {
                let angles: Vec<Radians> = analyzers.iter().map(|a| a.angle).collect();
                let axes = distinct_axes(&angles, Degrees(0.01).to_radians());
                FitError::NotIdentifiable { axes, condition: f64::INFINITY }
            }
        })?;
        Ok(Self { least_squares })
    }

    /// N × N, row-major.
    pub(super) fn matrix(&self) -> Vec<f64> {
        let n = self.least_squares.frames();
        let mut p = vec![0.0; n * n];
        for q in self.least_squares.residual_rows() {
            for (row, a) in p.chunks_exact_mut(n).zip(q) {
                row.iter_mut().zip(q).for_each(|(p, b)| *p += a * b);
            }
        }
        p
    }

    /// Degrees of freedom N − 3.
    fn freedom(&self) -> usize {
        self.least_squares.frames() - 3
    }
}

impl Moments {
    /// Of every `stride`-th sample; with a projector only of those it explains, to 5 σ of χ² (and never less than the
    /// better half: where the noise model is wrong, all samples are off by as much).
    pub(super) fn gather(
        count: usize,
        stride: usize,
        n: usize,
        noise: Noise,
        signals: &(impl Fn(usize, &mut [f64]) -> bool + Sync),
        explained_by: Option<&Projector>,
    ) -> Self {
        let chunk = stride * 4096;
        let chunks: Vec<usize> = (0..count).step_by(chunk).collect();
        let each = |limit: Option<(&Projector, f64)>| {
            let parts: Vec<Self> = chunks
                .par_iter()
                .map(|&first| {
                    let mut part = Self::empty(n);
                    let mut x = [0.0; MAX_FRAMES];
                    for i in (first..(first + chunk).min(count)).step_by(stride) {
                        if signals(i, &mut x[..n]) {
                            part.add(&x[..n], noise, limit);
                        }
                    }
                    part
                })
                .collect();
            // In order: the sum does not depend on the number of threads.
            parts.into_iter().fold(Self::empty(n), Self::merged)
        };
        let Some(projector) = explained_by.filter(|p| p.freedom() > 0) else { return each(None) };
        let freedom = projector.freedom() as f64;
        let median = Self::median_chi2(count, stride, n, noise, signals, projector);
        // Median of χ² by Wilson and Hilferty; Laurent and Massart's bound at 5 σ.
        let expected = freedom * (1.0 - 2.0 / (9.0 * freedom)).powi(3);
        let bound = freedom + 5.0 * (2.0 * freedom).sqrt() + 25.0;
        each(Some((projector, bound * (median / expected).max(1.0))))
    }

    fn empty(n: usize) -> Self {
        Self { n, signal: vec![0.0; n * n], noise: vec![0.0; n], samples: 0 }
    }

    fn add(&mut self, x: &[f64], noise: Noise, limit: Option<(&Projector, f64)>) {
        let (variances, mean) = variances(x, noise);
        let weight = 1.0 / mean;
        if let Some((projector, largest)) = limit
            && projector.least_squares.chi2(x) * weight > largest
        {
            return;
        }
        for (i, (a, v)) in x.iter().zip(variances).enumerate() {
            let row = &mut self.signal[i * self.n..(i + 1) * self.n];
            row.iter_mut().zip(x).for_each(|(sum, b)| *sum += weight * a * b);
            row[i] -= weight * v;
            self.noise[i] += weight * v;
        }
        self.samples += 1;
    }

    fn merged(mut self, other: Self) -> Self {
        self.signal.iter_mut().zip(&other.signal).for_each(|(a, b)| *a += b);
        self.noise.iter_mut().zip(&other.noise).for_each(|(a, b)| *a += b);
        self.samples += other.samples;
        self
    }

    /// C v.
    pub(super) fn times(&self, v: &[f64]) -> Vec<f64> {
        let rows = self.signal.chunks_exact(self.n);
        rows.map(|row| row.iter().zip(v).map(|(c, v)| c * v).sum()).collect()
    }

    /// The noise's share of aᵀ C b.
    pub(super) fn noise_between(&self, a: &[f64], b: &[f64]) -> f64 {
        self.noise.iter().zip(a).zip(b).map(|((v, a), b)| v * a * b).sum()
    }

    /// Mean χ² per degree of freedom of the samples; 1 where there is no freedom or no sample.
    pub(super) fn chi2_per_freedom(&self, projector: &Projector) -> f64 {
        let freedom = projector.freedom() * self.samples;
        if freedom == 0 {
            return 1.0;
        }
        let of_row = |q: &[f64]| {
            let signal: f64 = self.times(q).iter().zip(q).map(|(c, q)| c * q).sum();
            signal + self.noise_between(q, q)
        };
        projector.least_squares.residual_rows().map(of_row).sum::<f64>() / freedom as f64
    }

    fn median_chi2(
        count: usize,
        stride: usize,
        n: usize,
        noise: Noise,
        signals: &(impl Fn(usize, &mut [f64]) -> bool + Sync),
        projector: &Projector,
    ) -> f64 {
        // A few thousand samples give a median to some percent.
        let stride = (count / 10_000).max(stride).max(1);
        let mut x = [0.0; MAX_FRAMES];
        let mut found: Vec<f64> = Vec::new();
        for i in (0..count).step_by(stride) {
            if signals(i, &mut x[..n]) {
                found.push(projector.least_squares.chi2(&x[..n]) / variances(&x[..n], noise).1);
            }
        }
        if found.is_empty() {
            return 0.0;
        }
        let middle = found.len() / 2;
        *found.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// Variances of the signals and their mean, DN².
fn variances(x: &[f64], noise: Noise) -> ([f64; MAX_FRAMES], f64) {
    let mut v = [0.0; MAX_FRAMES];
    for (v, x) in v.iter_mut().zip(x) {
        let shot = if noise.electrons_per_dn > 0.0 { x.max(0.0) / noise.electrons_per_dn } else { 0.0 };
        // 1/12 DN² is the rounding of the samples.
        *v = noise.read_dn * noise.read_dn + shot + 1.0 / 12.0;
    }
    (v, v.iter().sum::<f64>() / x.len() as f64)
}
