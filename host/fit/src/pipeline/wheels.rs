//! The wheels' angles before the fit, and what stays uncertain of them.

use protocol_polar::{Analyzer, LeastSquares, Radians};

use super::{PipelineError, zero};
use crate::session::{Session, ViewData};
use crate::wheel::WheelEstimate;

/// Corrects the angles of every view of frames: from its own pictures, and their common turn, which those do not show, from the
/// reference strip if the session has one. `None` for views that are Stokes images, and for all where the angles are exact
/// (`sigma_deg` 0).
///
/// # Errors
/// [`PipelineError`] for frames that give no Stokes vector, and for a light no table can be made of.
pub fn calibrate_wheels(session: &mut Session, sigma_deg: f64) -> Result<Vec<Option<WheelEstimate>>, PipelineError> {
    let calibrate = |data: &mut ViewData| -> Result<_, PipelineError> {
        match data {
            ViewData::Frames(frames) if sigma_deg > 0.0 => {
                let estimate = frames.calibrate(Radians(sigma_deg.to_radians()))?;
                frames.correct(&estimate);
                Ok(Some(estimate))
            }
            _ => Ok(None),
        }
    };
    let mut estimates =
        session.views.iter_mut().map(|view| calibrate(&mut view.data)).collect::<Result<Vec<_>, _>>()?;
    zero::read(session, &mut estimates)?;
    Ok(estimates)
}

/// Upper triangle 00, 01, 02, 11, 12, 22.
type Triangle = [f64; 6];

/// What uncertain angles do to a view's Stokes vectors.
///
/// Frame k at φ_k + δ_k changes by t ε (s2 cos 2φ − s1 sin 2φ) δ_k; through the weights W of the least squares that is δs =
/// (s1 A + s2 B) δ. Of δ the mean is a turn of the picture, a nuisance of the fit; the rest is noise here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WheelNoise {
    /// Covariance of s for s1², s1 s2, s2².
    by_square: [Triangle; 3],
    /// σ of the mean angle, degrees.
    pub(super) turn_deg: f64,
}

impl WheelNoise {
    pub(super) const NONE: Self = Self { by_square: [[0.0; 6]; 3], turn_deg: 0.0 };

    pub(super) fn new(analyzers: &[Analyzer], estimate: Option<&WheelEstimate>) -> Self {
        let n = analyzers.len();
        let (Some(estimate), Ok(solver)) = (estimate, LeastSquares::new(analyzers)) else { return Self::NONE };
        if estimate.covariance.len() != n * n {
            return Self::NONE;
        }
        let c = &estimate.covariance;
        let row_mean: Vec<f64> = c.chunks_exact(n).map(|row| row.iter().sum::<f64>() / n as f64).collect();
        let mean = row_mean.iter().sum::<f64>() / n as f64;
        // P C P with P = 1 − 11ᵀ/N.
        let rest = |k: usize, l: usize| c[k * n + l] - row_mean[k] - row_mean[l] + mean;
        let w = solver.weights();
        let slopes: Vec<[f64; 2]> = analyzers
            .iter()
            .map(|a| {
                let (cos, sin) = a.angle.cos_sin_double();
                [-a.throughput * a.efficiency * sin, a.throughput * a.efficiency * cos]
            })
            .collect();
        let through = |p: usize, q: usize| {
            let mut at = 0;
            let mut out = [0.0; 6];
            for i in 0..3 {
                for j in i..3 {
                    for k in 0..n {
                        for l in 0..n {
                            let pair = w[i][k] * w[j][l] * slopes[k][p] * slopes[l][q]
                                + if p == q { 0.0 } else { w[i][k] * w[j][l] * slopes[k][q] * slopes[l][p] };
                            out[at] += pair * rest(k, l);
                        }
                    }
                    at += 1;
                }
            }
            out
        };
        let by_square = [through(0, 0), through(0, 1), through(1, 1)];
        Self { by_square, turn_deg: mean.max(0.0).sqrt().to_degrees() }
    }

    /// Covariance of a Stokes vector with these s1, s2, beside its sensor's.
    pub(super) fn covariance(&self, s1: f64, s2: f64) -> Triangle {
        let [a, b, c] = self.by_square;
        std::array::from_fn(|e| s1 * s1 * a[e] + s1 * s2 * b[e] + s2 * s2 * c[e])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel::Identifiability;
    use protocol_polar::Degrees;

    fn analyzers(degrees: &[f64]) -> Vec<Analyzer> {
        degrees.iter().map(|d| Analyzer::ideal(Degrees(*d).to_radians())).collect()
    }

    fn estimate(covariance: Vec<f64>, n: usize) -> WheelEstimate {
        let corrections = vec![Radians(0.0); n];
        let identifiability = Identifiability::Nothing;
        WheelEstimate { corrections, covariance, identifiability, chi2_per_freedom: 1.0, samples: 0 }
    }

    /// Every angle moved by itself, in turn, and the frames solved anew: the outer products of what comes out, less the
    /// common turn's, sum up to the covariance.
    #[test]
    fn noise_is_what_moved_angles_do() {
        let nominal = analyzers(&[0.0, 31.0, 60.0, 92.0, 121.0, 150.0]);
        let (n, sigma) = (nominal.len(), 1e-5);
        let mut covariance = vec![0.0; n * n];
        covariance.iter_mut().step_by(n + 1).for_each(|c| *c = sigma * sigma);
        let noise = WheelNoise::new(&nominal, Some(&estimate(covariance, n)));
        assert!((noise.turn_deg.to_radians() - sigma / (n as f64).sqrt()).abs() < 1e-15);
        let solver = LeastSquares::new(&nominal).unwrap();
        let truth = [1.0, 0.4, -0.25];
        let seen = |moved: &dyn Fn(usize) -> f64| {
            let signal = |(k, a): (usize, &Analyzer)| {
                let row = Analyzer { angle: Radians(a.angle.0 + moved(k)), ..*a }.row();
                row.iter().zip(truth).map(|(r, s)| r * s).sum::<f64>()
            };
            let solved = solver.solve(&nominal.iter().enumerate().map(signal).collect::<Vec<_>>());
            [0, 1, 2].map(|i| solved[i] - truth[i])
        };
        let mut expected = [0.0; 6];
        for j in 0..n {
            let d = seen(&|k| sigma * (f64::from(u8::from(k == j)) - 1.0 / n as f64));
            for (e, (a, b)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
                expected[e] += d[a] * d[b];
            }
        }
        for (found, expected) in noise.covariance(truth[1], truth[2]).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-4 * sigma * sigma, "{found} {expected}");
        }
    }

    /// A wheel that is turned as a whole makes no noise.
    #[test]
    fn a_common_turn_is_no_noise() {
        let nominal = analyzers(&[0.0, 60.0, 120.0, 150.0]);
        let noise = WheelNoise::new(&nominal, Some(&estimate(vec![1e-4; 16], 4)));
        assert!(noise.covariance(0.5, 0.3).iter().all(|c| c.abs() < 1e-16) && (noise.turn_deg - 0.573).abs() < 1e-3);
    }
}
