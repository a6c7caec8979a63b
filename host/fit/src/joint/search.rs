//! From where to descend, and which minima there are.

use super::Reasons;
use super::descend::{Descent, Minimum, Scratch};
use super::outcome::{Alternative, Fit};
use super::point::{Theta, facets, theta};
use super::problem::Problem;
use super::profile::profile;
use super::settings::{Settings, Starts};
use crate::material::{Facets, Forward, Observation};
use glam::{DQuat, DVec3};

/// Roughnesses of the grid; a descent from one of them first settles everything else with α held.
const ALPHAS: [f64; 6] = [0.01, 0.04, 0.1, 0.2, 0.35, 0.6];

/// Indices of the grid.
const ETAS: [f64; 2] = [1.35, 1.7];

/// Evaluations with α held.
const SETTLING: u32 = 4;

/// A start where nothing better is known.
const GUESS: Facets = Facets { eta: 1.5, alpha: 0.15, slope: [0.0; 2] };

/// Δχ² below which a second minimum makes uncertain whatever differs between the two, at 95 %.
const LIKELY: f64 = 4.0;

/// What asks for more starts.
const DOUBTS: [Reasons; 7] = [
    Reasons::ALBEDO,
    Reasons::INDEX,
    Reasons::ROUGHNESS,
    Reasons::NORMAL,
    Reasons::OUTSIDE_MODEL,
    Reasons::NOT_CONVERGED,
    Reasons::AT_BOUND,
];

/// See [`super::fit`].
pub(super) fn fit<F: Forward + ?Sized>(
    forward: &F,
    observations: &[Observation],
    starts: &[Facets],
    settings: &Settings,
) -> Fit {
    let problem = Problem::new(observations, settings);
    let guess = starts.iter().copied().find(is_finite).unwrap_or(GUESS);
    if problem.views == 0 {
        return Fit::unknown(&problem, guess, 0, Reasons::TOO_FEW_DATA);
    }
    let descent = Descent::new(forward, &problem, settings);
    let mut scratch = Scratch::NEW;
    let mut minima = Minima::default();
    first(&descent, starts, settings, &mut scratch, &mut minima);
    let index_is_free = forward.index_is_free();
    let verdict = |minima: &Minima| minima.best.map(|best| Fit::at(&problem, &best, index_is_free, 0, settings));
    let doubtful = |fit: &Fit| DOUBTS.iter().any(|doubt| fit.reasons.contains(*doubt));
    let widen = match settings.starts {
        Starts::Given => minima.best.is_none(),
        Starts::Auto => verdict(&minima).is_none_or(|fit| doubtful(&fit)),
        Starts::All => true,
    };
    if widen && settings.iterations > 0 {
        grid(&descent, guess.slope, &mut scratch, &mut minima);
        turned(&descent, &mut scratch, &mut minima);
    }
    if settings.profile && settings.iterations > 0 {
        // Following the likelihood along α may lead to a better minimum; then it is followed once more from there.
        for _ in 0..2 {
            let (Some(best), Some(fit)) = (minima.best, verdict(&minima)) else { break };
            let found = profile(&descent, &best, &fit, settings, &mut scratch);
            let Some(found) = found else { break };
            let further = descent.besides(Some(&best));
            if let Some(end) = found.lowest.and_then(|start| further.run(start, &mut scratch)) {
                minima.add(end);
            }
            if minima.best.is_some_and(|now| now.cost >= best.cost - 1e-3) {
                minima.along_alpha = Some((found.interval, found.reasons));
                break;
            }
        }
    }
    if settings.loss != descent.loss {
        let mut finish = |end: Minimum| descent.finish(settings.loss, &end, &mut scratch).unwrap_or(end);
        minima.best = minima.best.map(&mut finish);
        minima.rival = minima.rival.map(&mut finish);
    }
    let Some(mut fit) = verdict(&minima) else {
        return Fit::unknown(&problem, guess, scratch.evaluations, Reasons::NO_MODEL);
    };
    if let Some((interval, reasons)) = minima.along_alpha {
        fit.alpha_interval = interval;
        fit.reasons |= reasons;
    }
    if let (Some(best), Some(rival)) = (minima.best, minima.rival)
        && rival.cost - best.cost < settings.limits.second_minimum
    {
        fit.second = Some(Alternative::at(&rival));
        fit.reasons |= Reasons::SECOND_MINIMUM;
        let turned = is_turned(&problem, fit.facets.normal(), facets(&rival.theta).normal());
        fit.reasons.note(Reasons::AMBIGUOUS_AZIMUTH, turned);
        if rival.cost - best.cost < LIKELY {
            let other = Fit::at(&problem, &rival, index_is_free, 0, settings);
            fit.reasons |= other.unidentifiable() | fit.apart(&other, &settings.limits);
        }
    }
    fit.evaluations = scratch.evaluations;
    fit
}

/// Up to two different minima, the best first.
#[derive(Clone, Copy, Debug, Default)]
struct Minima {
    best: Option<Minimum>,
    rival: Option<Minimum>,
    /// Profile interval of α of the best, and what is not identifiable within it.
    along_alpha: Option<([f64; 2], Reasons)>,
}

impl Minima {
    fn add(&mut self, new: Minimum) {
        let Some(best) = self.best else {
            self.best = Some(new);
            return;
        };
        if same(&best, &new) {
            // Of two descents to one minimum the one that arrived counts, or got further.
            if (new.converged, -new.cost) > (best.converged, -best.cost) {
                self.best = Some(new);
            }
        } else if new.cost < best.cost {
            self.best = Some(new);
            self.rival = self.rival.filter(|rival| !same(rival, &new));
            self.oppose(best);
        } else {
            self.oppose(new);
        }
    }

    fn oppose(&mut self, rival: Minimum) {
        if rival.converged && self.rival.is_none_or(|now| rival.cost < now.cost) {
            self.rival = Some(rival);
        }
    }
}

/// Whether two ends of descents are within half a σ of each other as both see it.
fn same(a: &Minimum, b: &Minimum) -> bool {
    let step: Theta = [0, 1, 2, 3].map(|k| a.theta[k] - b.theta[k]);
    a.reduced.square(&step).max(b.reduced.square(&step)) < 0.25
}

/// From the best of the given starts, or from all; without any, from the best of the grid.
fn first<F: Forward + ?Sized>(
    descent: &Descent<F>,
    starts: &[Facets],
    settings: &Settings,
    scratch: &mut Scratch,
    minima: &mut Minima,
) {
    let mut best: Option<(f64, Theta)> = None;
    let mut offer = |cost: f64, at: Theta| {
        if cost.is_finite() && best.is_none_or(|(lowest, _)| cost < lowest) {
            best = Some((cost, at));
        }
    };
    let good = || starts.iter().filter(|start| is_finite(start)).map(theta);
    let all = settings.starts == Starts::All && settings.iterations > 0;
    if good().nth(1).is_none() {
        good().for_each(|start| offer(0.0, start));
    } else if all {
        good().filter_map(|start| descent.run(start, scratch)).for_each(|end| minima.add(end));
    } else {
        good().for_each(|start| offer(descent.cost(start, scratch), start));
    }
    if best.is_none() && minima.best.is_none() {
        for alpha in ALPHAS {
            for eta in ETAS {
                let start = theta(&Facets { eta, alpha, ..GUESS });
                best = best.filter(|(lowest, _)| lowest.is_finite());
                let cost = descent.cost(start, scratch);
                if cost.is_finite() && best.is_none_or(|(lowest, _)| cost < lowest) {
                    best = Some((cost, start));
                }
            }
        }
    }
    if let Some(end) = best.and_then(|(_, start)| descent.run(start, scratch)) {
        minima.add(end);
    }
}

/// From every roughness of the grid, with the normal of the best minimum so far.
fn grid<F: Forward + ?Sized>(descent: &Descent<F>, slope: [f64; 2], scratch: &mut Scratch, minima: &mut Minima) {
    let settling = descent.holding(1).within(SETTLING);
    for (alpha, eta) in ALPHAS.into_iter().flat_map(|alpha| ETAS.map(|eta| (alpha, eta))) {
        let slope = minima.best.map_or(slope, |best| [best.theta[2], best.theta[3]]);
        let settled = settling.run(theta(&Facets { eta, alpha, slope }), scratch);
        let further = descent.besides(minima.best.as_ref());
        if let Some(end) = settled.and_then(|settled| further.run(settled.theta, scratch)) {
            minima.add(end);
        }
    }
}

/// From the best normal turned by ±90° and 180° about each view: where the sky's polarization exceeds what the facets make of
/// unpolarized light, the angle of polarization shows one of these instead of the normal's azimuth.
fn turned<F: Forward + ?Sized>(descent: &Descent<F>, scratch: &mut Scratch, minima: &mut Minima) {
    let Some(best) = minima.best else { return };
    let problem = descent.problem;
    let views = &problem.direction[..problem.views];
    let normal = facets(&best.theta).normal();
    for axis in views {
        for quarter in [1.0, 2.0, 3.0] {
            let n = DQuat::from_axis_angle(*axis, quarter * core::f64::consts::FRAC_PI_2) * normal;
            // A turn of less than some degrees is no other start; one beyond the horizon or out of sight is no surface.
            if n.dot(normal) > 0.99 || n.z < 0.3 || views.iter().any(|view| n.dot(*view) < 0.1) {
                continue;
            }
            let start = [best.theta[0], best.theta[1], n.x / n.z, n.y / n.z];
            if let Some(end) = descent.besides(Some(&best)).run(start, scratch) {
                minima.add(end);
            }
        }
    }
}

/// Whether `b` is `a` turned by more than 45° about a view that sees either obliquely.
fn is_turned(problem: &Problem, a: DVec3, b: DVec3) -> bool {
    problem.direction[..problem.views].iter().any(|view| {
        let across = |n: DVec3| (n - *view * n.dot(*view)).try_normalize();
        let oblique = |n: DVec3| n.cross(*view).length_squared() > 0.01;
        match (across(a), across(b)) {
            (Some(x), Some(y)) if oblique(a) && oblique(b) => x.dot(y) < core::f64::consts::FRAC_1_SQRT_2,
            _ => false,
        }
    })
}

fn is_finite(facets: &Facets) -> bool {
    facets.eta > 1.0
        && facets.alpha > 0.0
        && [facets.eta, facets.alpha, facets.slope[0], facets.slope[1]].iter().all(|x| x.is_finite())
}
