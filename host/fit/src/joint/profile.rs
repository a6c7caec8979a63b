//! The likelihood along α with everything else at its best: what there is to know of a roughness whose curvature says little.
//!
//! For a nearly smooth facet the light depends on α² and the likelihood is far from a parabola in α: flat down to the mirror,
//! steep above. Then the 68 % interval has one end at 0.

use super::Reasons;
use super::descend::{Descent, Minimum, Scratch};
use super::outcome::Fit;
use super::point::Theta;
use super::settings::Settings;
use crate::material::Forward;

/// Relative σ of α from which on its curvature is doubted.
const DOUBTFUL: f64 = 0.15;

/// Δχ² at a mirror below which α is not known to be above 0, at 95 %.
const MIRROR: f64 = 4.0;

/// Descents for each end of the interval.
const ROUNDS: u32 = 5;

/// How closely √Δχ² must be 1 at an end.
const TOLERANCE: f64 = 0.05;

/// Evaluations for each of them.
const SETTLING: u32 = 8;

/// What was found.
pub(super) struct Profile {
    pub(super) interval: [f64; 2],
    /// What is not identifiable anywhere within it, and α if a mirror fits as well.
    pub(super) reasons: Reasons,
    /// Where χ² is lower than at the minimum, or flat at the mirror: a start for another descent.
    pub(super) lowest: Option<Theta>,
}

/// `None` where curvature will do.
pub(super) fn profile<F: Forward + ?Sized>(
    descent: &Descent<F>,
    best: &Minimum,
    fit: &Fit,
    settings: &Settings,
    scratch: &mut Scratch,
) -> Option<Profile> {
    let (alpha, sigma) = (fit.facets.alpha, fit.covariance[4][4].sqrt());
    if sigma < DOUBTFUL * alpha && !best.held[1] {
        return None;
    }
    let settling = descent.holding(1).within(SETTLING);
    let [low, high] = [descent.low[1].exp(), descent.high[1].exp()];
    let mut lowest: Option<(f64, Theta)> = None;
    let mut at = best.theta;
    let mut reasons = Reasons::NONE;
    // √Δχ² at α² = x, about linear in x.
    let mut root = |x: f64| -> f64 {
        let start = [at[0], 0.5 * x.ln(), at[2], at[3]];
        let Some(end) = settling.run(start, scratch) else { return f64::INFINITY };
        at = end.theta;
        if lowest.is_none_or(|(cost, _)| end.cost < cost) {
            lowest = Some((end.cost, end.theta));
        }
        let root = (end.cost - best.cost).max(0.0).sqrt();
        if root < 1.0 + TOLERANCE {
            reasons |= Fit::at(descent.problem, &end, descent.forward.index_is_free(), 0, settings).unidentifiable();
        }
        root
    };
    let (x, bottom, top) = (alpha * alpha, low * low, high * high);
    let at_mirror = root(bottom);
    let lower = if at_mirror <= 1.0 { bottom } else { crossing(&mut root, [x, 0.0], [bottom, at_mirror]) };
    let guess = (x + 2.0 * alpha * sigma.max(0.1 * alpha)).min(top).max(4.0 * bottom);
    let mut upper = [guess, root(guess)];
    for _ in 0..ROUNDS {
        if upper[1] >= 1.0 || upper[0] >= top {
            break;
        }
        let next = (2.0 * upper[0]).min(top);
        upper = [next, root(next)];
    }
    let upper = if upper[1] <= 1.0 { upper[0] } else { crossing(&mut root, [x, 0.0], upper) };
    let lowest = lowest.filter(|(cost, _)| *cost < best.cost + MIRROR).map(|(_, theta)| theta);
    reasons.note(Reasons::ROUGHNESS, at_mirror * at_mirror < MIRROR);
    Some(Profile { interval: [lower.sqrt(), upper.sqrt()], reasons, lowest })
}

/// Where `root` crosses 1 between an inner point below and an outer point above it: false position.
fn crossing(root: &mut impl FnMut(f64) -> f64, mut inner: [f64; 2], mut outer: [f64; 2]) -> f64 {
    for _ in 0..ROUNDS {
        let x = if outer[1].is_finite() {
            inner[0] + (outer[0] - inner[0]) * (1.0 - inner[1]) / (outer[1] - inner[1])
        } else {
            0.5 * (inner[0] + outer[0])
        };
        let value = root(x);
        if (value - 1.0).abs() < TOLERANCE {
            return x;
        }
        if value < 1.0 {
            inner = [x, value];
        } else {
            outer = [x, value];
        }
    }
    0.5 * (inner[0] + outer[0])
}
