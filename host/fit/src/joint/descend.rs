//! Levenberg-Marquardt from one start: damping by the gain ratio (Nielsen 1999), bounds by an active set, every step's
//! prediction and the step's length in σ as tests of convergence.

use super::linear::{Cholesky, restricted};
use super::point::{Normal, Point, Reduced, Theta};
use super::problem::{FULL, Problem, Weights};
use super::settings::{Loss, Settings};
use crate::material::{BANDS, Forward};

/// Longest step in each coordinate: factors of e^1.5 in η − 1 and α.
const LONGEST: Theta = [1.5, 1.5, 0.5, 0.5];

/// Damping at the start, in units of the information's diagonal.
const DAMPING: f64 = 1e-3;

/// Promised gain in χ² (0.03 σ) below which a failed step says that derivatives are no better.
const ROUGH: f64 = 1e-3;

/// Everything a descent needs besides its start.
pub(super) struct Descent<'a, F: ?Sized> {
    pub(super) forward: &'a F,
    pub(super) problem: &'a Problem,
    pub(super) loss: Loss,
    pub(super) low: Theta,
    pub(super) high: Theta,
    pub(super) iterations: u32,
    pub(super) tolerance: f64,
    /// Which coordinates may move.
    pub(super) moving: [bool; 4],
    /// A minimum not to descend into once more.
    known: Option<&'a Minimum>,
}

/// Where a descent ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Minimum {
    pub(super) theta: Theta,
    pub(super) albedo: [f64; BANDS],
    pub(super) free: [bool; BANDS],
    pub(super) cost: f64,
    /// At the last point evaluated, at most one converged step away.
    pub(super) normal: Normal,
    pub(super) reduced: Reduced,
    pub(super) specular: f64,
    pub(super) converged: bool,
    /// Coordinates at their bounds, held there by χ².
    pub(super) held: [bool; 4],
    weights: Weights,
}

/// Two points and a count: what descents of one pixel share.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    points: [Point; 2],
    /// Evaluations of the forward model in all views.
    pub(super) evaluations: u32,
}

impl Scratch {
    pub(super) const NEW: Self = Self { points: [Point::EMPTY; 2], evaluations: 0 };
}

impl<'a, F: Forward + ?Sized> Descent<'a, F> {
    pub(super) fn new(forward: &'a F, problem: &'a Problem, settings: &Settings) -> Self {
        let ([eta_low, eta_high], [alpha_low, alpha_high]) = (settings.eta, settings.alpha);
        Self {
            forward,
            problem,
            loss: settings.loss.convex(),
            low: [(eta_low - 1.0).ln(), alpha_low.ln(), -settings.slope, -settings.slope],
            high: [(eta_high - 1.0).ln(), alpha_high.ln(), settings.slope, settings.slope],
            iterations: settings.iterations,
            tolerance: settings.tolerance,
            moving: [forward.index_is_free(), true, true, true],
            known: None,
        }
    }

    /// With coordinate `k` held where the start has it.
    pub(super) fn holding(&self, k: usize) -> Self {
        let mut moving = self.moving;
        moving[k] = false;
        Self { moving, ..*self }
    }

    /// With at most so many evaluations.
    pub(super) fn within(self, iterations: u32) -> Self {
        Self { iterations, ..self }
    }

    /// Not into `known` again.
    pub(super) fn besides<'b>(&'b self, known: Option<&'b Minimum>) -> Descent<'b, F> {
        Descent { known, ..*self }
    }

    /// `theta` inside the bounds; what is not a number goes to the middle.
    pub(super) fn inside(&self, theta: Theta) -> Theta {
        [0, 1, 2, 3].map(|k| {
            let (low, high) = (self.low[k], self.high[k]);
            if theta[k].is_nan() { 0.5 * (low + high) } else { theta[k].max(low).min(high) }
        })
    }

    /// χ² at a start, infinite where there is none.
    pub(super) fn cost(&self, at: Theta, scratch: &mut Scratch) -> f64 {
        scratch.evaluations += 1;
        let point = &mut scratch.points[0];
        point.evaluate(self.forward, self.problem, self.loss, self.inside(at), &FULL);
        point.cost
    }

    /// Descends from `start`; `None` if the start has no finite χ², or the descent comes within a σ of the known minimum at about
    /// its χ².
    pub(super) fn run(&self, start: Theta, scratch: &mut Scratch) -> Option<Minimum> {
        self.run_weighted(start, &FULL, scratch)
    }

    /// From a minimum of another loss on with `loss`.
    pub(super) fn finish(&self, loss: Loss, minimum: &Minimum, scratch: &mut Scratch) -> Option<Minimum> {
        let finishing = Descent { loss, known: None, ..*self };
        finishing.run_weighted(minimum.theta, &minimum.weights, scratch)
    }

    fn run_weighted(&self, start: Theta, weights: &Weights, scratch: &mut Scratch) -> Option<Minimum> {
        let index_is_free = self.forward.index_is_free();
        let Scratch { points: [first, second], evaluations } = scratch;
        let (mut here, mut trial) = (first, second);
        *evaluations += 1;
        if !here.evaluate(self.forward, self.problem, self.loss, self.inside(start), weights) {
            return None;
        }
        let mut normal = here.normal(self.problem, index_is_free);
        let mut reduced = normal.reduce(&here.free)?;
        let (mut damping, mut growth) = (DAMPING, 2.0);
        let mut last = None;
        let mut tries = 0;
        while tries < self.iterations {
            let Some((step, held)) = self.step(&here.theta, &reduced, damping) else {
                damping *= growth;
                growth *= 2.0;
                tries += 1;
                continue;
            };
            let square = reduced.square(&step);
            let gain = 2.0 * dot(&reduced.gradient, &step) - square;
            if square <= self.tolerance * self.tolerance && damping <= 1.0 {
                last = Some((step, gain, held));
                break;
            }
            let to = [0, 1, 2, 3].map(|k| here.theta[k] + step[k]);
            tries += 1;
            *evaluations += 1;
            let finite = trial.evaluate(self.forward, self.problem, self.loss, self.inside(to), here.weights());
            let gained = if finite { here.cost - trial.cost } else { f64::NEG_INFINITY };
            let ratio = gained / gain;
            let next = (ratio > 1e-4).then(|| trial.normal(self.problem, index_is_free));
            if let Some((next, less)) = next.and_then(|next| Some((next, next.reduce(&trial.free)?))) {
                core::mem::swap(&mut here, &mut trial);
                (normal, reduced) = (next, less);
                damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).clamp(0.1, 2.0);
                growth = 2.0;
                if self.is_known(here) {
                    return None;
                }
            } else {
                damping *= growth;
                growth *= 2.0;
                // A table's derivatives are not quite those of its values: a step that promises this little and fails has met the
                // minimum as closely as they know it. Much damped steps promise little anywhere.
                if gain <= if damping <= 1.0 { ROUGH } else { 1e-2 * ROUGH } {
                    last = Some(([0.0; 4], 0.0, held));
                    break;
                }
            }
        }
        let converged = last.is_some();
        let (step, gain, held) = last.unwrap_or(([0.0; 4], 0.0, [false; 4]));
        // The last step is so short that its prediction is as good as an evaluation.
        let follow = if converged { reduced.albedo_step(&step) } else { [0.0; BANDS] };
        Some(Minimum {
            theta: self.inside([0, 1, 2, 3].map(|k| here.theta[k] + step[k])),
            albedo: [0, 1, 2].map(|k| if here.free[k] { (here.albedo[k] + follow[k]).max(0.0) } else { 0.0 }),
            free: here.free,
            cost: (here.cost - gain.max(0.0)).max(0.0),
            normal,
            reduced,
            specular: here.specular,
            converged,
            held,
            weights: *here.weights(),
        })
    }

    fn is_known(&self, here: &Point) -> bool {
        self.known.is_some_and(|known| {
            let step = [0, 1, 2, 3].map(|k| here.theta[k] - known.theta[k]);
            here.cost < known.cost + 0.5 && here.cost > known.cost && known.reduced.square(&step) < 1.0
        })
    }

    /// A damped step inside the bounds, and which coordinates a bound stopped. `None` if the damped matrix is not positive.
    fn step(&self, from: &Theta, reduced: &Reduced, damping: f64) -> Option<(Theta, [bool; 4])> {
        let mut damped = reduced.matrix;
        for (k, row) in damped.iter_mut().enumerate() {
            row[k] *= 1.0 + damping;
        }
        let mut held = [false; 4];
        // Each round holds at least one more.
        for _ in 0..4 {
            let moving = [0, 1, 2, 3].map(|k| self.moving[k] && !held[k]);
            let right = [0, 1, 2, 3].map(|k| if moving[k] { reduced.gradient[k] } else { 0.0 });
            let step = Cholesky::new(&restricted(&damped, &moving))?.solve(&right);
            let stopped = [0, 1, 2, 3].map(|k| {
                moving[k] && (step[k] < 0.0 && from[k] <= self.low[k] || step[k] > 0.0 && from[k] >= self.high[k])
            });
            if stopped.contains(&true) {
                for (held, stopped) in held.iter_mut().zip(stopped) {
                    *held |= stopped;
                }
                continue;
            }
            let longest = (0..4).map(|k| step[k].abs() / LONGEST[k]).fold(1.0, f64::max);
            let step = [0, 1, 2, 3].map(|k| (from[k] + step[k] / longest).clamp(self.low[k], self.high[k]) - from[k]);
            return step.iter().all(|x| x.is_finite()).then_some((step, held));
        }
        Some(([0.0; 4], held))
    }
}

fn dot(a: &Theta, b: &Theta) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
