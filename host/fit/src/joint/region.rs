//! One material for a group of pixels: η and α shared, albedos and normal each pixel's own.
//!
//! Gauss-Newton over (ln(η − 1), ln α) with everything of a pixel eliminated: each pixel descends with the shared two held, and
//! passes on what is left of its gradient and information. The cost is linear in pixels; they are summed in their order, so that
//! the answer does not depend on the number of threads.

use super::Reasons;
use super::descend::{Descent, Minimum, Scratch};
use super::linear::{Cholesky, restricted};
use super::outcome::{Fit, misfit};
use super::point::{NOTHING, facets, theta};
use super::problem::Problem;
use super::settings::Settings;
use crate::material::{Facets, Forward, Observation};
use rayon::prelude::*;

/// Most steps of the shared two.
const STEPS: u32 = 40;

/// Longest step of either.
const LONGEST: f64 = 1.0;

/// The answer for a group of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Shared η.
    pub eta: f64,
    /// Shared α.
    pub alpha: f64,
    /// Covariance of (η, α), from all pixels; 0 for a known index.
    pub covariance: [[f64; 2]; 2],
    /// χ² of all pixels that have one.
    pub chi2: f64,
    /// Measurements less parameters, the shared ones counted once.
    pub freedom: u32,
    /// What speaks against the answer for the group.
    pub reasons: Reasons,
    /// Each pixel's answer; its covariance knows that η and α are shared. Neither second minima nor profiles.
    pub pixels: Vec<Fit>,
}

/// Fits `pixels` with one η and one α.
///
/// `starts` are the pixels' own fits, or one guess for all; the shared two start at their medians. Starts and profile of
/// `settings` have no meaning here.
#[must_use]
pub fn fit_region<F, P>(forward: &F, pixels: &[P], starts: &[Facets], settings: &Settings) -> Region
where
    F: Forward + ?Sized,
    P: AsRef<[Observation]> + Sync,
{
    let median = |of: fn(&Facets) -> f64, otherwise: f64| {
        let mut values: Vec<f64> = starts.iter().map(of).filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(otherwise)
    };
    let shared = Facets { eta: median(|f| f.eta, 1.5), alpha: median(|f| f.alpha, 0.15), slope: [0.0; 2] };
    let slope = |k: usize| starts.get(k).or(starts.first()).map_or([0.0; 2], |start| start.slope);
    let group = Group { forward, pixels, settings };
    group.descend(theta(&shared), (0..pixels.len()).map(slope).collect())
}

struct Group<'a, F: ?Sized, P> {
    forward: &'a F,
    pixels: &'a [P],
    settings: &'a Settings,
}

/// What a pixel says about the shared two, everything else at its best.
#[derive(Clone, Copy, Debug)]
struct Share {
    cost: f64,
    matrix: [[f64; 2]; 2],
    gradient: [f64; 2],
    slope: [f64; 2],
    /// How the slope follows the shared two.
    follow: [[f64; 2]; 2],
}

/// All pixels at one value of the shared two.
struct Sum {
    shares: Vec<Option<Share>>,
    cost: f64,
    matrix: [[f64; 2]; 2],
    gradient: [f64; 2],
    /// Pixels without a finite χ².
    left_out: usize,
}

impl<F: Forward + ?Sized, P: AsRef<[Observation]> + Sync> Group<'_, F, P> {
    fn descend(&self, start: [f64; 4], mut slopes: Vec<[f64; 2]>) -> Region {
        // A problem without data is enough for the bounds.
        let nothing = Problem::new(&[], self.settings);
        let bounds = Descent::new(self.forward, &nothing, self.settings);
        let [u, v, ..] = bounds.inside(start);
        let mut here = [u, v];
        let mut sum = self.sum(here, &slopes);
        let (mut damping, mut growth, mut converged, mut held) = (1e-3, 2.0, false, [false; 2]);
        for _ in 0..STEPS {
            sum.keep(&mut slopes);
            let Some(step) = sum.step(here, damping, &bounds) else { break };
            held = step.1;
            let step = step.0;
            let square = sum.square(step);
            if square <= self.settings.tolerance * self.settings.tolerance && damping <= 1.0 {
                converged = true;
                break;
            }
            let to = [here[0] + step[0], here[1] + step[1]];
            let trial = self.sum(to, &sum.ahead(&slopes, step));
            let gain = 2.0 * (sum.gradient[0] * step[0] + sum.gradient[1] * step[1]) - square;
            if trial.left_out <= sum.left_out && sum.cost - trial.cost > 1e-4 * gain {
                let ratio = (sum.cost - trial.cost) / gain;
                damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 2.0);
                growth = 2.0;
                (here, sum) = (to, trial);
            } else {
                damping *= growth;
                growth *= 2.0;
                // The pixels' own descents end within their tolerance: a gain below that cannot be judged.
                converged = gain <= 1e-9 * (1.0 + sum.cost);
                if converged {
                    break;
                }
            }
        }
        sum.keep(&mut slopes);
        self.answer(here, &slopes, &sum, converged, held.contains(&true))
    }

    /// One pixel with the shared two held.
    fn pixel(&self, problem: &Problem, shared: [f64; 2], slope: [f64; 2], scratch: &mut Scratch) -> Option<Minimum> {
        let descent = Descent::new(self.forward, problem, self.settings);
        let start = [shared[0], shared[1], slope[0], slope[1]];
        (problem.views > 0).then(|| descent.holding(0).holding(1).run(start, scratch)).flatten()
    }

    fn sum(&self, shared: [f64; 2], slopes: &[[f64; 2]]) -> Sum {
        let share = |(pixel, slope): (&P, &[f64; 2])| {
            let problem = Problem::new(pixel.as_ref(), self.settings);
            let mut scratch = Scratch::NEW;
            let minimum = self.pixel(&problem, shared, *slope, &mut scratch)?;
            Share::of(&minimum)
        };
        let shares: Vec<_> = self.pixels.par_iter().zip(slopes).map(share).collect();
        let mut sum =
            Sum { shares, cost: 0.0, matrix: [[NOTHING, 0.0], [0.0, NOTHING]], gradient: [0.0; 2], left_out: 0 };
        for share in &sum.shares {
            let Some(share) = share else {
                sum.left_out += 1;
                continue;
            };
            sum.cost += share.cost;
            for i in 0..2 {
                sum.gradient[i] += share.gradient[i];
                for j in 0..2 {
                    sum.matrix[i][j] += share.matrix[i][j];
                }
            }
        }
        sum
    }

    fn answer(&self, shared: [f64; 2], slopes: &[[f64; 2]], sum: &Sum, converged: bool, at_bound: bool) -> Region {
        let index_is_free = self.forward.index_is_free();
        let common = facets(&[shared[0], shared[1], 0.0, 0.0]);
        let two = if index_is_free { 2 } else { 1 };
        let pixel = |((pixel, slope), share): ((&P, &[f64; 2]), &Option<Share>)| {
            let problem = Problem::new(pixel.as_ref(), self.settings);
            let mut scratch = Scratch::NEW;
            let minimum = self.pixel(&problem, shared, *slope, &mut scratch);
            let (Some(mut minimum), Some(share)) = (minimum, share) else {
                let guess = Facets { slope: *slope, ..common };
                return Fit::unknown(&problem, guess, scratch.evaluations, Reasons::NO_MODEL);
            };
            // What the others say, with all that is theirs eliminated, is about the shared two alone.
            for i in 0..2 {
                for j in 0..2 {
                    minimum.normal.theta[i][j] += sum.matrix[i][j] - share.matrix[i][j];
                }
            }
            let mut fit = Fit::at(&problem, &minimum, index_is_free, two, self.settings);
            fit.evaluations = scratch.evaluations;
            fit
        };
        let pixels: Vec<Fit> = self.pixels.par_iter().zip(slopes).zip(&sum.shares).map(pixel).collect();
        let covariance = sum.covariance(&common, index_is_free);
        let freedom = pixels.iter().map(|fit| fit.freedom).fold(0, u32::saturating_add).saturating_sub(two);
        let limits = &self.settings.limits;
        let [sigma_eta, sigma_alpha] = [0, 1].map(|k| covariance[k][k].sqrt());
        let mut reasons = Reasons::NONE;
        reasons.note(Reasons::NO_MODEL, sum.left_out == self.pixels.len());
        reasons.note(Reasons::INDEX, sigma_eta > limits.eta);
        let rough = sigma_alpha > limits.alpha || sigma_alpha > limits.alpha_relative * common.alpha;
        reasons.note(Reasons::ROUGHNESS, rough);
        reasons.note(Reasons::OUTSIDE_MODEL, misfit(sum.cost, freedom) > limits.misfit);
        reasons.note(Reasons::NOT_CONVERGED, !converged);
        reasons.note(Reasons::AT_BOUND, at_bound);
        Region { eta: common.eta, alpha: common.alpha, covariance, chi2: sum.cost, freedom, reasons, pixels }
    }
}

impl Share {
    /// With the slopes eliminated.
    fn of(minimum: &Minimum) -> Option<Self> {
        let (m, g) = (&minimum.reduced.matrix, &minimum.reduced.gradient);
        let own = Cholesky::new(&[[m[2][2], m[2][3]], [m[3][2], m[3][3]]])?;
        let (by_u, by_v) = (own.solve(&[m[2][0], m[3][0]]), own.solve(&[m[2][1], m[3][1]]));
        let rest = own.solve(&[g[2], g[3]]);
        let taken = |i: usize, x: [f64; 2]| m[i][2] * x[0] + m[i][3] * x[1];
        Some(Self {
            cost: minimum.cost,
            matrix: [
                [m[0][0] - taken(0, by_u), m[0][1] - taken(0, by_v)],
                [m[1][0] - taken(1, by_u), m[1][1] - taken(1, by_v)],
            ],
            gradient: [g[0] - taken(0, rest), g[1] - taken(1, rest)],
            slope: [minimum.theta[2], minimum.theta[3]],
            follow: [[-by_u[0], -by_v[0]], [-by_u[1], -by_v[1]]],
        })
    }
}

impl Sum {
    /// Slopes at their best; a pixel without an answer keeps its own.
    fn keep(&self, slopes: &mut [[f64; 2]]) {
        for (slope, share) in slopes.iter_mut().zip(&self.shares) {
            *slope = share.map_or(*slope, |share| share.slope);
        }
    }

    /// Slopes after a step of the shared two, to first order.
    fn ahead(&self, slopes: &[[f64; 2]], step: [f64; 2]) -> Vec<[f64; 2]> {
        let follow = |(slope, share): (&[f64; 2], &Option<Share>)| {
            share.map_or(*slope, |share| {
                [0, 1].map(|k| slope[k] + share.follow[k][0] * step[0] + share.follow[k][1] * step[1])
            })
        };
        slopes.iter().zip(&self.shares).map(follow).collect()
    }

    /// A damped step inside the bounds, and which of the two a bound stopped.
    fn step<F: Forward + ?Sized>(
        &self,
        from: [f64; 2],
        damping: f64,
        bounds: &Descent<F>,
    ) -> Option<([f64; 2], [bool; 2])> {
        let mut damped = self.matrix;
        for (k, row) in damped.iter_mut().enumerate() {
            row[k] *= 1.0 + damping;
        }
        let mut moving = [bounds.moving[0], bounds.moving[1]];
        let mut held = [false; 2];
        for _ in 0..3 {
            let right = [0, 1].map(|k| if moving[k] { self.gradient[k] } else { 0.0 });
            let step = Cholesky::new(&restricted(&damped, &moving))?.solve(&right);
            let longest = step.iter().fold(1.0, |longest, x| f64::max(longest, x.abs() / LONGEST));
            let to = [0, 1].map(|k| (from[k] + step[k] / longest).clamp(bounds.low[k], bounds.high[k]));
            let outward = |k: usize| {
                moving[k] && (step[k] < 0.0 && from[k] <= bounds.low[k] || step[k] > 0.0 && from[k] >= bounds.high[k])
            };
            let stopped = [outward(0), outward(1)];
            if !stopped.contains(&true) {
                return Some(([to[0] - from[0], to[1] - from[1]], held));
            }
            for k in 0..2 {
                held[k] |= stopped[k];
                moving[k] &= !stopped[k];
            }
        }
        Some(([0.0; 2], held))
    }

    fn square(&self, step: [f64; 2]) -> f64 {
        let m = &self.matrix;
        m[0][0] * step[0] * step[0] + 2.0 * m[0][1] * step[0] * step[1] + m[1][1] * step[1] * step[1]
    }

    /// Of (η, α).
    fn covariance(&self, common: &Facets, index_is_free: bool) -> [[f64; 2]; 2] {
        let free = [index_is_free, true];
        let chain = [if index_is_free { common.eta - 1.0 } else { 0.0 }, common.alpha];
        let inverse = Cholesky::new(&restricted(&self.matrix, &free)).map(|factor| factor.inverse());
        inverse.map_or([[f64::INFINITY, 0.0], [0.0, f64::INFINITY]], |inverse| {
            [0, 1].map(|i| [0, 1].map(|j| chain[i] * inverse[i][j] * chain[j]))
        })
    }
}
