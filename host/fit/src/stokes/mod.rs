//! Weighted least squares for (s0, s1, s2) of every pixel (paper eq. 5 in its general form).
//!
//! Saturated samples are dropped, never clipped in: each pixel is solved with the frames it has left. The few masks of
//! dropped frames that occur are solved once each and kept.

mod image;

use std::sync::OnceLock;

use protocol_polar::fixed::Noise;
use protocol_polar::{Analyzer, Degrees, Flags, LeastSquares, MAX_FRAMES, Radians, SolveError, distinct_axes};

pub use image::{Dark, FrameSamples, StokesPlanes, UpperTriangle};

use crate::FitError;

/// One frame as the estimator weighs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Angle, throughput and efficiency of the polarizer.
    pub analyzer: Analyzer,
    /// Standard deviation that gives the frame its weight 1/σ². Only ratios matter for the Stokes vector; residuals are in
    /// units of signal/σ.
    pub sigma: f64,
}

impl Frame {
    /// A frame with weight 1.
    #[must_use]
    pub const fn new(analyzer: Analyzer) -> Self {
        Self { analyzer, sigma: 1.0 }
    }
}

/// Settings of a [`StokesEstimator`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorOptions {
    /// A raw sample at or above this is saturated and left out, DN; `None`: nothing saturates.
    pub white_dn: Option<f32>,
    /// Noise of one raw sample, for the covariance and the misfit flag; `None`: neither is computed.
    pub noise: Option<Noise>,
    /// Above this condition number a set of frames is not identifiable.
    pub condition_limit: f64,
}

impl Default for EstimatorOptions {
    fn default() -> Self {
        Self { white_dn: None, noise: None, condition_limit: LeastSquares::USABLE_CONDITION }
    }
}

/// One pixel's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StokesEstimate {
    /// s0, s1, s2 in the unit of the signals.
    pub stokes: [f64; 3],
    /// rms residual per degree of freedom, in units of signal/σ; 0 with three frames.
    pub residual: f64,
    /// Covariance of (s0, s1, s2), if the variances of the signals were given.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// What happened.
    pub flags: Flags,
}

/// How to turn N samples of a pixel into a Stokes vector; see the module.
pub struct StokesEstimator {
    frames: Vec<Frame>,
    options: EstimatorOptions,
    condition: f64,
    /// By mask of dropped frames (bit k = frame k); `None` where the others do not suffice.
    solvers: Vec<OnceLock<Option<Box<Solver>>>>,
}

/// The system of one mask.
struct Solver {
    least_squares: LeastSquares,
    /// Indices of the frames in use, in order.
    kept: Vec<usize>,
    /// max_k |w_jk| of each row of W.
    largest: [f64; 3],
}

impl StokesEstimator {
    /// Checks and solves the complete set of frames.
    ///
    /// # Errors
    /// [`FitError::NotIdentifiable`] for fewer than three frames or axes, and beyond the condition limit;
    /// [`FitError::TooManyFrames`]; [`FitError::BadFrame`].
    pub fn new(frames: &[Frame], options: EstimatorOptions) -> Result<Self, FitError> {
        if frames.len() > MAX_FRAMES {
            return Err(FitError::TooManyFrames { frames: frames.len() });
        }
        let mut estimator = Self {
            frames: frames.to_vec(),
            options,
            condition: f64::INFINITY,
            solvers: std::iter::repeat_with(OnceLock::new).take(1 << frames.len()).collect(),
        };
        let solver = estimator.solve_without(0)?;
        estimator.condition = solver.least_squares.condition();
        if let Some(complete) = estimator.solvers.first() {
            complete.get_or_init(|| Some(Box::new(solver)));
        }
        Ok(estimator)
    }

    /// Condition number of the complete set of frames (1.4 for equispaced angles).
    #[must_use]
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// Number of frames N.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// Estimates one pixel from N signals: linear, dark-subtracted, in the order of the frames.
    ///
    /// `dropped` has bit k set where frame k is not to be used. `variances` are those of the signals; with them the
    /// covariance is W diag(variances) Wᵀ of the linear estimate W (exact for any weights), and a residual beyond what
    /// they allow is flagged `MISFIT`. The flag `SATURATED` says that a frame was dropped. A component that is no more than
    /// rounding is 0.
    #[must_use]
    pub fn estimate(&self, signals: &[f64], variances: Option<&[f64]>, dropped: u16) -> StokesEstimate {
        let mut flags = if dropped == 0 { Flags::default() } else { Flags::SATURATED };
        let Some(solver) = self.solver(dropped) else {
            flags = flags.with(Flags::TOO_FEW);
            return StokesEstimate { flags, covariance: variances.map(|_| [[0.0; 3]; 3]), ..StokesEstimate::default() };
        };
        let pick = |from: &[f64]| {
            let mut used = [0.0; MAX_FRAMES];
            for (to, &k) in used.iter_mut().zip(&solver.kept) {
                *to = from[k];
            }
            used
        };
        let n = solver.kept.len();
        let picked;
        // Nearly every pixel has all its frames: no copy for those.
        let used = if n == signals.len() {
            signals
        } else {
            picked = pick(signals);
            &picked[..n]
        };
        let stokes = solver.without_rounding(solver.least_squares.solve(used), used);
        let freedom = (n - 3) as f64;
        let mean_square = if n > 3 { solver.least_squares.chi2(used) / freedom } else { 0.0 };
        let covariance = variances.map(|variances| {
            let variances = pick(variances);
            if n > 3 && self.is_misfit(mean_square, freedom, solver, &variances) {
                flags = flags.with(Flags::MISFIT);
            }
            solver.covariance(&variances)
        });
        StokesEstimate { stokes, residual: mean_square.sqrt(), covariance, flags }
    }

    /// χ² of d degrees of freedom exceeds d + n√(2d) + n² with probability at most exp(−n²/2) (Laurent & Massart 2000, lemma
    /// 1); the largest whitened variance stands for all, so the rate of false alarms stays below that.
    fn is_misfit(&self, mean_square: f64, freedom: f64, solver: &Solver, variances: &[f64]) -> bool {
        let n = self.options.noise.map_or(0.0, |noise| noise.misfit_sigma);
        let whitened = solver.kept.iter().zip(variances).map(|(&k, v)| v / self.frames[k].sigma.powi(2));
        let largest = whitened.fold(0.0, f64::max);
        n > 0.0 && mean_square * freedom > largest * (freedom + n * (2.0 * freedom).sqrt() + n * n)
    }

    fn solver(&self, dropped: u16) -> Option<&Solver> {
        let slot = self.solvers.get(usize::from(dropped))?;
        slot.get_or_init(|| self.solve_without(dropped).ok().map(Box::new)).as_deref()
    }

    fn solve_without(&self, dropped: u16) -> Result<Solver, FitError> {
        let kept: Vec<usize> = (0..self.frames.len()).filter(|k| dropped >> k & 1 == 0).collect();
        let analyzers: Vec<Analyzer> = kept.iter().map(|&k| self.frames[k].analyzer).collect();
        let sigmas: Vec<f64> = kept.iter().map(|&k| self.frames[k].sigma).collect();
        let not_identifiable = |condition| {
            let angles: Vec<Radians> = analyzers.iter().map(|a| a.angle).collect();
            FitError::NotIdentifiable { axes: distinct_axes(&angles, Degrees(0.01).to_radians()), condition }
        };
        let least_squares = LeastSquares::weighted(&analyzers, &sigmas).map_err(|e| match e {
            SolveError::BadFrame { frame } => FitError::BadFrame { frame: kept[frame] },
            _ => not_identifiable(f64::INFINITY),
        })?;
        if least_squares.condition() > self.options.condition_limit {
            return Err(not_identifiable(least_squares.condition()));
        }
        let largest = least_squares.weights().map(|row| row.iter().map(|w| w.abs()).fold(0.0, f64::max));
        Ok(Solver { least_squares, kept, largest })
    }
}

/// A component s_j = Σ w_jk x_k is 0 where |s_j| is at most this times max_k |w_jk| Σ |x_k|: 4 ε is the rounding of the
/// products, of their sum and of the weights (a weight that should be 0 is some ε of the largest of its row). Nothing
/// measured is that small, and light that cancels exactly is exactly none.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

impl Solver {
    /// `stokes`, which is W `signals`, without what is rounding alone: see [`ROUNDING`].
    fn without_rounding(&self, mut stokes: [f64; 3], signals: &[f64]) -> [f64; 3] {
        let total: f64 = signals.iter().map(|x| x.abs()).sum();
        for (s, largest) in stokes.iter_mut().zip(self.largest) {
            if s.abs() <= ROUNDING * largest * total {
                *s = 0.0;
            }
        }
        stokes
    }

    /// W diag(variances) Wᵀ; `variances` of the kept frames.
    fn covariance(&self, variances: &[f64]) -> [[f64; 3]; 3] {
        let weights = self.least_squares.weights();
        weights.map(|a| weights.map(|b| a.iter().zip(b).zip(variances).map(|((a, b), v)| a * b * v).sum()))
    }
}

#[cfg(test)]
mod tests;
