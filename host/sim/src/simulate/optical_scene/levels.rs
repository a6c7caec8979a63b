//! Surfaces of constant α and η that stand for maps of them.
//!
//! Levels are equally spaced in ln α and in ln (η − 1), at most a step h apart; what lies between two is blended linearly in
//! these coordinates. That errs by at most h²/8 sup |f″|/f of what is blended, f:
//!
//! - α: the specular part follows D G2. |(ln D)′| <= 2, |(ln D)″| <= 2, for the height-correlated G2 |(ln G2)′| <= 1 and
//!   |(ln G2)″| <= 2, hence |f″|/f <= 3² + 4 = 13 under any light.
//! - η: R⊥, R∥ and r_s r_p have second derivatives of at most 4 · ½(R⊥ + R∥), attained as η → 1 (a test scans angles and
//!   indices). s0 is at least ½ (1 − P)(R⊥ + R∥) L under light of DoLP P, a change at most √2 · 4 · ½ (1 + P)(R⊥ + R∥) L. Light
//!   through the interface both ways has less than that: 0.9 + 0.9 + 2 · 0.9². So |f″|/f <= 6 (1 + P)/(1 − P); P above 0.95
//!   counts as 0.95, since light of DoLP 1 can vanish in a mirror altogether.
//!
//! η below 1.0001 counts as 1.0001, which reflects 2.5e-9 at normal incidence.

use host_optics::ggx::MIN_ALPHA;

use super::whole;
use crate::optical::Pixel;
use crate::optical::numbers::real;
use crate::scene::{Field, Index, Surface};
use crate::signal::single;

/// |f″|/f in ln α.
const ALPHA_CURVATURE: f64 = 13.0;
/// The same in ln (η − 1), under unpolarized light.
const ETA_CURVATURE: f64 = 6.0;
/// Least η − 1.
const MIN_EXCESS: f64 = 1e-4;
/// Largest step, however much may be lost.
const MAX_STEP: f64 = 0.2;

/// The surfaces that stand for one surface of the scene: a grid of α and η, α in a row.
#[derive(Clone, Debug)]
pub(super) struct Levels {
    first: usize,
    /// α where it is the same everywhere.
    constant_alpha: Option<f64>,
    /// ln α.
    alpha: Line,
    /// ln (η − 1).
    eta: Line,
    corners: Vec<Corner>,
    /// At most this is lost, as a share of s0.
    pub(super) bound: f64,
}

/// Equally spaced levels of a logarithm; one alone where nothing varies.
#[derive(Clone, Copy, Debug)]
struct Line {
    start: f64,
    step: f64,
    last: usize,
}

/// Which of the levels around a pixel's values a picture is of: the lower (false) or upper of α and of η; and of which bands' η.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    alpha: bool,
    eta: bool,
    /// One band, where each has an index of its own; else all.
    band: Option<usize>,
}

impl Levels {
    /// Of `surface`, the first of them being number `first` of all. They err by at most `tolerance` under light of DoLP `max_dolp`.
    pub(super) fn of(surface: &Surface, first: usize, tolerance: f64, max_dolp: f64) -> Self {
        let (alpha_map, eta_map) = (
            if let Field::Map(map) = &surface.alpha { Some(map) } else { None },
            if let Index::Map { eta, .. } = &surface.ior { Some(eta) } else { None },
        );
        let share = if alpha_map.is_some() && eta_map.is_some() { 0.5 * tolerance } else { tolerance };
        let dolp = max_dolp.min(0.95);
        let eta_curvature = ETA_CURVATURE * (1.0 + dolp) / (1.0 - dolp);
        let step = |curvature: f64| (8.0 * share / curvature).sqrt().min(MAX_STEP);
        let (low, high) = match &surface.alpha {
            Field::Constant(alpha) => (*alpha, *alpha),
            Field::Map(map) => map.range(),
        };
        let alpha = Line::over(low.clamp(MIN_ALPHA, 1.0).ln(), high.clamp(MIN_ALPHA, 1.0).ln(), step(ALPHA_CURVATURE));
        let excess = |eta: f64| (eta - 1.0).max(MIN_EXCESS).ln();
        let (least, most) = eta_map.map_or((2.0, 2.0), |map| map.range());
        let eta = Line::over(excess(least), excess(most), step(eta_curvature));
        let bands: &[Option<usize>] = match eta_map {
            Some(map) if !map.is_grey() && eta.last > 0 => &[Some(0), Some(1), Some(2)],
            _ => &[None],
        };
        let ends = |line: &Line| if line.last > 0 { &[false, true][..] } else { &[false] };
        let mut corners = Vec::new();
        for band in bands {
            for upper in ends(&eta) {
                corners.extend(ends(&alpha).iter().map(|a| Corner { alpha: *a, eta: *upper, band: *band }));
            }
        }
        let bound = alpha.loss(ALPHA_CURVATURE) + eta.loss(eta_curvature);
        let constant_alpha = (alpha.last == 0).then(|| low.clamp(MIN_ALPHA, 1.0));
        Self { first, constant_alpha, alpha, eta, corners, bound }
    }

    /// How many surfaces.
    pub(super) fn count(&self) -> usize {
        (self.alpha.last + 1) * (self.eta.last + 1)
    }

    /// (α, η) of each; η means nothing for a surface whose index is not a map.
    pub(super) fn values(&self) -> impl Iterator<Item = (f64, f64)> {
        let alpha = move |k: usize| self.constant_alpha.unwrap_or_else(|| self.alpha.at(k).exp().min(1.0));
        let alphas = move |eta: f64| (0..=self.alpha.last).map(move |k| (alpha(k), eta));
        (0..=self.eta.last).flat_map(move |k| alphas(1.0 + self.eta.at(k).exp()))
    }

    /// The pictures that are blended.
    pub(super) fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// The surface of one of them at a pixel, and its share of R, G, B there.
    pub(super) fn at(&self, corner: Corner, alpha: f32, eta: [f32; 3]) -> (u16, [f32; 3]) {
        let (k, alpha_share) = self.alpha.around(f64::from(alpha).max(MIN_ALPHA).ln(), corner.alpha);
        let of_band = |band: usize| self.eta.around((f64::from(eta[band]) - 1.0).max(MIN_EXCESS).ln(), corner.eta);
        let (j, eta_share) = of_band(corner.band.unwrap_or(0));
        let share = single(alpha_share * eta_share);
        let shares = [0, 1, 2].map(|band| if corner.band.is_none_or(|own| own == band) { share } else { 0.0 });
        (u16::try_from(self.first + j * (self.alpha.last + 1) + k).unwrap_or(Pixel::NOTHING), shares)
    }
}

impl Line {
    fn over(start: f64, end: f64, step: f64) -> Self {
        if end - start <= 0.0 {
            return Self { start, step: 0.0, last: 0 };
        }
        let cells = ((end - start) / step).ceil();
        Self { start, step: (end - start) / cells, last: whole(single(cells)) }
    }

    fn at(&self, level: usize) -> f64 {
        self.start + self.step * real(level)
    }

    /// The level below (or above) `x`, and its share of the blend.
    fn around(&self, x: f64, upper: bool) -> (usize, f64) {
        if self.last == 0 {
            return (0, 1.0);
        }
        let place = ((x - self.start) / self.step).clamp(0.0, real(self.last));
        let low = whole(single(place)).min(self.last - 1);
        let above = (place - real(low)).clamp(0.0, 1.0);
        if upper { (low + 1, above) } else { (low, 1.0 - above) }
    }

    /// What blending between the levels loses.
    fn loss(&self, curvature: f64) -> f64 {
        self.step * self.step / 8.0 * curvature
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_optics::{Dielectric, Incidence};

    fn reflectance(x: f64, cosine: f64) -> [f64; 3] {
        let at = Incidence { cosine, sine_squared: 1.0 - cosine * cosine };
        let r = Dielectric::new(1.0 + x.exp()).unwrap().reflectance(at);
        [r.perpendicular, r.parallel, r.rr_cos_delta]
    }

    /// Second differences over angles and indices, and those of the transmittance both ways.
    #[test]
    fn curvatures_are_as_stated() {
        let h = 2e-3;
        let (mut specular, mut through) = (0.0_f64, [0.0_f64; 2]);
        for step in 0..230_u16 {
            let x = MIN_EXCESS.ln() + f64::from(step) * (9.0_f64.ln() - MIN_EXCESS.ln()) / 229.0;
            for cosine in (0..=200_u16).map(|k| (f64::from(k) / 200.0).powi(3).max(1e-6)) {
                let [a, b, c] = [x - h, x, x + h].map(|x| reflectance(x, cosine));
                let second = |k: usize| (a[k] - 2.0 * b[k] + c[k]) / (h * h);
                let mean = 0.5 * (b[0] + b[1]);
                specular = specular.max((second(0).abs() + second(1).abs()) / (2.0 * mean)).max(second(2).abs() / mean);
                let first = (c[0] + c[1] - a[0] - a[1]) / (4.0 * h);
                let passed = 1.0 - mean;
                through[0] = through[0].max(first.abs() / passed);
                through[1] = through[1].max((second(0).abs() + second(1).abs()) / (2.0 * passed));
            }
        }
        assert!((3.9..=4.01).contains(&specular), "{specular}");
        assert!(2f64.sqrt() * specular <= ETA_CURVATURE);
        let [first, second] = through;
        assert!(2.0 * second + 2.0 * first * first < ETA_CURVATURE, "{through:?}");
    }

    #[test]
    fn shares_add_up_and_levels_lie_around_the_value() {
        let line = Line::over(-2.0, -1.0, 0.3);
        assert!(line.last == 4 && (line.at(4) + 1.0).abs() < 1e-12);
        for x in [-3.0, -2.0, -1.9, -1.5, -1.000_001, -1.0, 0.0] {
            let ((low, below), (high, above)) = (line.around(x, false), line.around(x, true));
            let blend = below * line.at(low) + above * line.at(high);
            assert!(high == low + 1 && (below + above - 1.0).abs() < 1e-12);
            assert!((blend - x.clamp(-2.0, -1.0)).abs() < 1e-12, "{x}: {blend}");
        }
    }
}
