//! The true angles of the polarizer wheel, from the frames themselves (Schechner 2015, "Self-calibrating imaging
//! polarimetry").
//!
//! Frame k was taken at φ_k + δ_k; every pixel and band i gives N signals x_i = A(δ) s_i + noise with rows A_k = ½ t_k
//! [1, ε_k cos 2(φ_k + δ_k), ε_k sin 2(φ_k + δ_k)] and its own s_i. Gain and exposure are locked, so that t_k is known.
//! Eliminating s_i (variable projection) leaves Σ_i w_i |P⊥(δ) x_i|² + Σ_k δ_k²/σ², P⊥ the projector on what no light
//! explains: the pixels enter by their N × N moment matrix alone, less the noise's own share of it (or unequal noise
//! would pull the angles).
//!
//! What can be known: a turn of all angles together is a turn of the picture and is never seen; beyond that all is seen
//! with N >= 5, one direction is not with N = 4, nothing is with N = 3. What is not seen stays where the prior holds
//! it. All of it needs a scene with a spread of AoLP: [`Identifiability`] says what this scene told.

mod moments;
mod zero;

use protocol_polar::fixed::Noise;
use protocol_polar::{Analyzer, MAX_FRAMES, Radians};

use crate::FitError;
use crate::register::dense::{Cholesky, symmetric_eigenvalues};
pub use zero::{Zero, zeros};

use moments::{Moments, Projector};

/// Settings of [`calibrate_wheel`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelOptions {
    /// Standard deviation of a frame's angle about its nominal one, before any picture is seen.
    pub prior: Radians,
    /// Noise of one raw sample.
    pub noise: Noise,
}

/// What the pictures told of the angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identifiability {
    /// All but the turn of all angles together.
    Complete,
    /// `free` directions, that turn among them, are known from the prior alone: N = 4, or little spread of AoLP.
    Partial {
        /// How many of the N directions.
        free: usize,
    },
    /// Nothing: three frames, or a scene of one AoLP or without polarization. The corrections are 0 to the prior.
    Nothing,
}

/// Angles from the pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelEstimate {
    /// δ_k, to be added to the nominal angles.
    pub corrections: Vec<Radians>,
    /// Posterior covariance of the δ_k, prior included, rad², N × N, row-major. Their common turn has the prior's
    /// variance/N.
    pub covariance: Vec<f64>,
    /// What was told.
    pub identifiability: Identifiability,
    /// χ² per degree of freedom of the pixels used, at the corrected angles: 1 where noise is all; light that drifts,
    /// and pictures that move, raise it (and widen the covariance).
    pub chi2_per_freedom: f64,
    /// Samples (pixels times bands) used.
    pub samples: usize,
}

/// Samples beyond this many are thinned out: the angles are known far better by then than anything else.
const MOST_SAMPLES: usize = 1_000_000;

/// A direction counts as seen where the pictures hold it this many times tighter than the prior.
const SEEN: f64 = 4.0;

/// Estimates the angle errors of one capture.
///
/// `analyzers` are nominal. `signals(i, x)` writes the N dark-subtracted, linear signals (DN) of sample i of `count`
/// and answers whether all are good: saturated samples and what lies beyond the scene are not.
///
/// # Errors
/// [`FitError::NotIdentifiable`], [`FitError::BadFrame`], [`FitError::TooManyFrames`] for frames that give no Stokes
/// vector even with the nominal angles.
pub fn calibrate_wheel(
    analyzers: &[Analyzer],
    options: WheelOptions,
    count: usize,
    signals: impl Fn(usize, &mut [f64]) -> bool + Sync,
) -> Result<WheelEstimate, FitError> {
    let n = analyzers.len();
    if n > MAX_FRAMES {
        return Err(FitError::TooManyFrames { frames: n });
    }
    if !(options.prior.0 > 0.0 && options.prior.0.is_finite()) {
        return Err(FitError::BadFrame { frame: 0 });
    }
    let stride = count.div_ceil(MOST_SAMPLES).max(1);
    let mut fit =
        Fit { nominal: analyzers, corrections: vec![0.0; n], information: options.prior.0.powi(-2), scale: 1.0 };
    // The first pass takes every sample; each further one leaves out what the last angles do not explain.
    let mut moments = Moments::gather(count, stride, n, options.noise, &signals, None);
    fit.descend(&moments)?;
    for _ in 0..2 {
        let projector = Projector::new(&fit.analyzers())?;
        moments = Moments::gather(count, stride, n, options.noise, &signals, Some(&projector));
        fit.scale = moments.chi2_per_freedom(&projector).max(1.0);
        fit.descend(&moments)?;
    }
    fit.estimate(&moments)
}

/// Gauss-Newton on the moments.
struct Fit<'a> {
    nominal: &'a [Analyzer],
    corrections: Vec<f64>,
    /// 1/σ² of the prior.
    information: f64,
    /// Variance of the samples, in units of what the noise model says.
    scale: f64,
}

impl Fit<'_> {
    fn analyzers(&self) -> Vec<Analyzer> {
        let turned = |(a, d): (&Analyzer, &f64)| Analyzer { angle: Radians(a.angle.0 + d), ..*a };
        self.nominal.iter().zip(&self.corrections).map(turned).collect()
    }

    /// To the maximum of the posterior: a handful of steps, errors of some degrees being nearly linear.
    fn descend(&mut self, moments: &Moments) -> Result<(), FitError> {
        for _ in 0..30 {
            let analyzers = self.analyzers();
            let step = Linearized::new(&analyzers, moments, self.scale)?;
            let pull = step.pull.iter().zip(&self.corrections).map(|(b, d)| b - self.information * d);
            let Some(system) = Cholesky::new(&step.with_prior(self.information), analyzers.len()) else { break };
            let change = system.solve(&pull.collect::<Vec<_>>());
            self.corrections.iter_mut().zip(&change).for_each(|(d, c)| *d += c);
            if change.iter().all(|c| c.abs() < 1e-9) {
                break;
            }
        }
        Ok(())
    }

    fn estimate(self, moments: &Moments) -> Result<WheelEstimate, FitError> {
        let analyzers = self.analyzers();
        let n = analyzers.len();
        let end = Linearized::new(&analyzers, moments, self.scale)?;
        let threshold = SEEN * SEEN * self.information;
        let free = symmetric_eigenvalues(&end.information, n).iter().filter(|l| **l < threshold).count();
        let covariance = Cholesky::new(&end.with_prior(self.information), n).map_or_else(Vec::new, |c| c.inverse());
        Ok(WheelEstimate {
            corrections: self.corrections.into_iter().map(Radians).collect(),
            covariance,
            identifiability: match free {
                _ if free >= n => Identifiability::Nothing,
                0 | 1 => Identifiability::Complete,
                _ => Identifiability::Partial { free },
            },
            chi2_per_freedom: moments.chi2_per_freedom(&Projector::new(&analyzers)?),
            samples: moments.samples,
        })
    }
}

/// The problem about one set of angles.
struct Linearized {
    /// What the samples know of the angles, N × N, row-major, rad⁻².
    information: Vec<f64>,
    /// Their pull: information times the errors that are left, and chance.
    pull: Vec<f64>,
}

impl Linearized {
    /// With Kaufman's Jacobian of the projected residual, ∂r_i/∂δ_k = −P⊥ e_k (a′_k·s_i), a′ the derivative of a row:
    /// over all samples H = JᵀJ = P⊥ ∘ (A′ S A′ᵀ) with S = A⁺ C A⁺ᵀ = Σ w s sᵀ, and g = −Jᵀr = diag(P⊥ C A⁺ᵀ A′ᵀ).
    ///
    /// s_i is itself estimated: g scatters about H (δ_true − δ) by V = P⊥ ∘ (A′ (S + noise of s) A′ᵀ), which in a scene
    /// with little polarization is far more than H. So the information is H V⁻¹ H, and H V⁻¹ g what it weighs.
    fn new(analyzers: &[Analyzer], moments: &Moments, scale: f64) -> Result<Self, FitError> {
        let n = analyzers.len();
        let projector = Projector::new(analyzers)?;
        let [_, q, u] = projector.least_squares.weights();
        // Columns of C A⁺ᵀ that matter: a′ has no s0 part.
        let fitted = [q, u].map(|row| moments.times(row));
        let s = positive_part([dot(q, &fitted[0]), dot(q, &fitted[1]), dot(u, &fitted[1])]);
        let chance = [moments.noise_between(q, q), moments.noise_between(q, u), moments.noise_between(u, u)];
        let slopes: Vec<[f64; 2]> = analyzers
            .iter()
            .map(|a| {
                let (cos, sin) = a.angle.cos_sin_double();
                [-a.throughput * a.efficiency * sin, a.throughput * a.efficiency * cos]
            })
            .collect();
        let p = projector.matrix();
        let curvature = |s: [f64; 3], factor: f64| -> Vec<f64> {
            let spread =
                |a: &[f64; 2], b: &[f64; 2]| a[0] * (s[0] * b[0] + s[1] * b[1]) + a[1] * (s[1] * b[0] + s[2] * b[1]);
            let pairs = slopes.iter().flat_map(|a| slopes.iter().map(move |b| (a, b)));
            pairs.zip(&p).map(|((a, b), p)| factor * p * spread(a, b)).collect()
        };
        let hessian = curvature(s, 1.0);
        let mut scatter = curvature([0, 1, 2].map(|k| s[k] + scale * chance[k]), scale);
        let rows = p.chunks_exact(n).zip(&slopes);
        let gradient: Vec<f64> =
            rows.map(|(row, a)| dot(row, &fitted[0]) * a[0] + dot(row, &fitted[1]) * a[1]).collect();
        // What neither sees, the common turn, must not make V singular.
        let floor = 1e-9 * scatter.iter().step_by(n + 1).sum::<f64>() + f64::MIN_POSITIVE;
        scatter.iter_mut().step_by(n + 1).for_each(|d| *d += floor);
        let Some(scatter) = Cholesky::new(&scatter, n) else {
            return Ok(Self { information: vec![0.0; n * n], pull: vec![0.0; n] });
        };
        let through = |v: &[f64]| -> Vec<f64> {
            let weighed = scatter.solve(v);
            hessian.chunks_exact(n).map(|row| dot(row, &weighed)).collect()
        };
        // H is symmetric: its rows are its columns, and so are those of H V⁻¹ H.
        let information = hessian.chunks_exact(n).flat_map(through).collect();
        Ok(Self { information, pull: through(&gradient) })
    }

    fn with_prior(&self, information: f64) -> Vec<f64> {
        let n = self.pull.len();
        let mut sum = self.information.clone();
        sum.iter_mut().step_by(n + 1).for_each(|d| *d += information);
        sum
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The 2 × 2 matrix (00, 01, 11) with its negative eigenvalues set to 0: what is left of a spread that is none, after
/// noise was taken off, may be negative.
fn positive_part([a, b, c]: [f64; 3]) -> [f64; 3] {
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let radius = half.hypot(b);
    if mean >= radius {
        return [a, b, c];
    }
    let largest = (mean + radius).max(0.0);
    // Projector on the larger eigenvalue's axis: ½ (1 + (M − mean)/radius).
    let (x, y) = if radius > 0.0 { (half / radius, b / radius) } else { (0.0, 0.0) };
    [0.5 * largest * (1.0 + x), 0.5 * largest * y, 0.5 * largest * (1.0 - x)]
}

#[cfg(test)]
mod tests;
