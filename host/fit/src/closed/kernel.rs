//! `closed`, branch-free: Stokes of V views in, normal, η, albedo and their σ out.
//!
//! Everything is counted in the radiance of a white sample ([`SkyTable::white`]). Values that cannot be used have weight 0.
//! First-order propagation: the noise of one band of one view is split along its phase (δp) and across it (δφ); weights and the
//! sky's radiance count as constants.

#![expect(clippy::needless_range_loop, reason = "one index walks several arrays side by side")]

use super::fresnel::{ETA, Fresnel, Inverse};
use super::phase::{Phase, Seen, phase};
use super::plane::intersect;
use super::real::{Real, Triple, along, cross, dot, times};
use super::{Reasons, SkyTable};
use crate::material::BANDS;

/// What is known of a pixel afterwards; σ is infinite where there is no answer.
pub(super) struct Found<R> {
    pub(super) normal: Triple<R>,
    pub(super) eta: R,
    pub(super) alpha: R,
    pub(super) albedo: Triple<R>,
    pub(super) sigma_normal: R,
    pub(super) sigma_eta: R,
    pub(super) sigma_albedo: Triple<R>,
    /// Bits of [`Reasons`] as a whole number.
    pub(super) reasons: R,
}

/// σ of an answer that is of use, and what stands for "none".
const USEFUL_ETA: f64 = 0.25;
const USEFUL_ALBEDO: f64 = 0.1;
const NONE: f64 = f64::INFINITY;
/// Start values where nothing is known.
const START_ETA: f64 = 1.5;
const START_ALPHA: f64 = 0.1;

/// How one view says η (paper eq. 7: I_max − I_min = ½ L (R⊥ − R∥)).
#[derive(Clone, Copy)]
struct Index<R> {
    /// Cosine and sin² of the angle of incidence.
    cosine: R,
    sine2: R,
    /// By band: weight in η; ∂η/∂p; and the sum of weight · ∂η/∂c.
    weight: [R; BANDS],
    by_polarized: [R; BANDS],
    by_cosine: R,
    /// Σ weight · η and Σ weight.
    eta: R,
    total: R,
    /// 1 if light is mirrored; 1 if no dielectric polarizes that much light.
    lit: R,
    off_scale: R,
}

impl<R: Real> Index<R> {
    #[inline(always)]
    fn nothing() -> Self {
        let zero = R::of(0.0);
        Self {
            cosine: zero,
            sine2: zero,
            weight: [zero; BANDS],
            by_polarized: [zero; BANDS],
            by_cosine: zero,
            eta: zero,
            total: zero,
            lit: zero,
            off_scale: zero,
        }
    }

    /// η of every band by paper eq. 7. From [`Self::nothing`]; `half_tilt` is half the variance of the normal.
    #[inline(always)]
    fn read(&mut self, view: &Phase<R>, direction: Triple<R>, normal: Triple<R>, half_tilt: R, sky: &SkyTable) {
        let (one, two, half) = (R::of(1.0), R::of(2.0), R::of(0.5));
        let facing = dot(normal, direction);
        let faces = R::of(0.02).is_less(facing);
        let c = facing.max(R::of(0.02));
        let across = cross(normal, direction);
        let s2 = dot(across, across).max(R::of(1e-6));
        (self.cosine, self.sine2) = (c, s2);
        let radiance = sky.radiance(along(times(direction, -one), normal, two * c));
        let inverse = Inverse::at(c, s2);
        let most = Fresnel::at(R::of(ETA[1]), c, s2).difference;
        let tilt = half_tilt * s2;
        let white = sky.white();
        let (mut usable, mut per_light, mut difference) = ([one; BANDS], [one; BANDS], [one; BANDS]);
        for b in 0..BANDS {
            let l = radiance[b] * R::of(if white[b] > 0.0 { 1.0 / white[b] } else { 0.0 });
            let band = &view.bands[b];
            usable[b] = band.ok * faces * R::of(1e-6).is_less(l);
            per_light[b] = two / half.less(usable[b], l, one);
            difference[b] = per_light[b] * band.polarized;
            self.lit = self.lit.max(usable[b]);
            self.off_scale = self.off_scale.max(usable[b] * most.is_less(difference[b]));
        }
        let found = inverse.eta(difference);
        for b in 0..BANDS {
            let band = &view.bands[b];
            let found = found[b].max(R::of(ETA[0])).min(R::of(ETA[1])).finite_or(one);
            let at = Fresnel::at(found, c, s2);
            let by_difference = one / at.difference_by_eta;
            let by_polarized = per_light[b] * by_difference;
            let by_cosine = -at.difference_by_cosine * by_difference;
            let variance = by_polarized.squared() * band.cuu + tilt * by_cosine.squared() + R::of(1e-12);
            let weight = (usable[b] / variance).finite_or(R::of(0.0));
            self.weight[b] = weight;
            self.by_polarized[b] = by_polarized;
            self.by_cosine = self.by_cosine + weight * by_cosine;
            self.eta = self.eta + weight * found;
            self.total = self.total + weight;
        }
    }
}

/// All of it for one pixel (or eight).
#[inline(always)]
pub(super) fn solve<R: Real, const V: usize>(seen: &[Seen<R>; V], sky: &SkyTable) -> Found<R> {
    let (zero, one, two, half) = (R::of(0.0), R::of(1.0), R::of(2.0), R::of(0.5));
    let none = R::of(NONE);
    let mut phases = [Phase::nothing(); V];
    let mut azimuths = [phases[0].azimuth; V];
    let (mut directions, mut known) = ([[zero; 3]; V], [zero; V]);
    for v in 0..V {
        phase(&seen[v], &mut phases[v]);
        azimuths[v] = phases[v].azimuth;
        directions[v] = seen[v].direction;
        known[v] = phases[v].known;
    }
    let plane = intersect(&azimuths, &directions, &known);
    let normal = plane.normal;

    let mut sigma_normal = zero;
    for v in 0..V {
        sigma_normal = sigma_normal + azimuths[v].variance * dot(plane.by_phase[v], plane.by_phase[v]);
    }
    let half_tilt = half * sigma_normal;

    let mut says = [Index::nothing(); V];
    let (mut eta, mut total, mut lit, mut off_scale) = (zero, R::of(1e-30), zero, zero);
    for v in 0..V {
        says[v].read(&phases[v], directions[v], normal, half_tilt, sky);
        eta = eta + says[v].eta;
        total = total + says[v].total;
        lit = lit.max(says[v].lit);
        off_scale = off_scale.max(says[v].off_scale);
    }
    let eta_known = R::of(1e-12).is_less(total);
    let per_total = one / total;
    let eta = half.less(eta_known, eta * per_total, R::of(START_ETA)).max(R::of(ETA[0])).min(R::of(ETA[1]));

    // How η follows the phases, by way of the angles of incidence.
    let mut eta_by_phase = [zero; V];
    let mut cosine_by_phase = [[zero; V]; V];
    for i in 0..V {
        let slope = says[i].by_cosine * per_total;
        for j in 0..V {
            cosine_by_phase[i][j] = dot(directions[i], plane.by_phase[j]);
            eta_by_phase[j] = eta_by_phase[j] + slope * cosine_by_phase[i][j];
        }
    }
    // What of the variances of all results runs through η: Σ over bands of ∂η/∂p² cuu, and of ∂η/∂p ∂φ/∂v cuv.
    let (mut through_eta, mut through_both) = ([zero; V], [zero; V]);
    let mut eta_by = [[zero; BANDS]; V];
    let mut variance_eta = zero;
    for v in 0..V {
        for b in 0..BANDS {
            let (u, band) = (says[v].weight[b] * per_total * says[v].by_polarized[b], &phases[v].bands[b]);
            eta_by[v][b] = u;
            through_eta[v] = through_eta[v] + u * u * band.cuu;
            through_both[v] = through_both[v] + u * band.share * band.cuv;
        }
        let w = eta_by_phase[v];
        variance_eta = variance_eta + through_eta[v] + w * (two * through_both[v] + w * phases[v].noise);
    }

    // Diffuse light: what is left once the specular part p/DoLP(η, θ) is taken off (at the Brewster angle 2 I_min).
    let (mut diffuse, mut diffuse_total) = ([zero; BANDS], [R::of(1e-30); BANDS]);
    let (mut per_dolp, mut by_eta, mut by_cosine) = ([zero; V], [zero; V], [zero; V]);
    let mut weights = [[zero; BANDS]; V];
    let mut highest = zero;
    for v in 0..V {
        let at = Fresnel::at(eta, says[v].cosine, says[v].sine2);
        let inverse = one / at.dolp;
        let square = inverse * inverse;
        let tilt = half_tilt * says[v].sine2 * (square * at.dolp_by_cosine).squared();
        (per_dolp[v], by_eta[v], by_cosine[v]) = (inverse, square * at.dolp_by_eta, square * at.dolp_by_cosine);
        for b in 0..BANDS {
            let band = &phases[v].bands[b];
            let variance = band.c00 - two * band.c0u * inverse + band.cuu * square + tilt * band.polarized.squared();
            let weight = (band.ok / variance.max(R::of(1e-14))).finite_or(zero);
            weights[v][b] = weight;
            diffuse[b] = diffuse[b] + weight * (band.s0 - band.polarized * inverse);
            diffuse_total[b] = diffuse_total[b] + weight;
            highest = highest.max(band.ok * band.polarized / (band.s0 * at.dolp).max(R::of(1e-6)));
        }
    }
    let (mut albedo, mut sigma_albedo) = ([zero; BANDS], [none; BANDS]);
    let (mut bound, mut albedo_unknown) = (off_scale, zero);
    for b in 0..BANDS {
        let per_total = one / diffuse_total[b];
        // A tilted sample gets other light: δρ = −ρ δE/E.
        let per_light = one / sky.irradiance(b, normal);
        let raw = (diffuse[b] * per_total * per_light).finite_or(zero);
        let mut diffuse_by_eta = zero;
        let mut by_phase = [zero; V];
        for v in 0..V {
            let slope = weights[v][b] * per_total * phases[v].bands[b].polarized;
            diffuse_by_eta = diffuse_by_eta + slope * by_eta[v];
            for j in 0..V {
                by_phase[j] = by_phase[j] + slope * by_cosine[v] * cosine_by_phase[v][j];
            }
            by_phase[v] = by_phase[v] - raw * sky.irradiance_along(b, plane.by_phase[v]);
        }
        let mut variance = zero;
        for v in 0..V {
            // Through η and φ, by any band; and of this band straight.
            let w = diffuse_by_eta * eta_by_phase[v] + by_phase[v];
            let (share, band) = (weights[v][b] * per_total, &phases[v].bands[b]);
            let (p, u) = (-share * per_dolp[v], diffuse_by_eta * eta_by[v][b]);
            let along_phase = w * band.share;
            variance = variance
                + diffuse_by_eta * (diffuse_by_eta * through_eta[v] + two * w * through_both[v])
                + w * w * phases[v].noise
                + p * ((p + two * u) * band.cuu + two * along_phase * band.cuv)
                + share * (share * band.c00 + two * ((p + u) * band.c0u + along_phase * band.c0v));
        }
        let seen = R::of(1e-12).is_less(diffuse_total[b]);
        albedo[b] = half.less(seen, raw.max(zero).min(one), half);
        bound = bound.max(seen * raw.is_less(zero).max(one.is_less(raw)));
        let sigma = (variance.max(zero).sqrt() * per_light).finite_or(none);
        sigma_albedo[b] = half.less(seen, sigma, none);
        albedo_unknown = albedo_unknown.max(one - sigma_albedo[b].is_less(R::of(USEFUL_ALBEDO)));
    }
    let sigma_eta = half.less(eta_known * plane.determined, variance_eta.max(zero).sqrt().finite_or(none), none);
    let eta_at_bound = eta.is_less(R::of(ETA[0] + 1e-4)).max(R::of(ETA[1] - 1e-4).is_less(eta));

    let (mut views, mut dark, mut clear, mut impossible) = (zero, zero, zero, zero);
    for v in 0..V {
        views = views + known[v];
        dark = dark.max(seen[v].present - known[v]);
        clear = clear + known[v] * azimuths[v].variance.is_less(R::of(0.04));
        impossible = impossible.max(phases[v].impossible);
    }
    let mut reasons = zero;
    for (reason, set) in [
        (Reasons::ROUGHNESS, one),
        (Reasons::TOO_DARK, dark),
        (Reasons::AMBIGUOUS_AZIMUTH, clear.is_less(R::of(1.5))),
        (Reasons::INDEX, one - sigma_eta.is_less(R::of(USEFUL_ETA))),
        (Reasons::ALBEDO, albedo_unknown),
        (Reasons::NORMAL, one - plane.determined),
        (Reasons::VIEWS_TOO_PARALLEL, half.less(views, plane.separation.is_less(R::of(0.03)), zero)),
        (Reasons::ONE_VIEW, views.is_less(R::of(1.5))),
        (Reasons::OUTSIDE_MODEL, impossible),
        (Reasons::NO_MIRRORED_LIGHT, one - lit),
        (Reasons::AT_BOUND, bound.max(eta_at_bound)),
    ] {
        reasons = reasons + R::of(f64::from(reason.0)) * set;
    }
    Found {
        normal,
        eta,
        alpha: start_alpha(highest),
        albedo,
        sigma_normal: half.less(plane.determined, sigma_normal.sqrt(), none),
        sigma_eta,
        sigma_albedo,
        reasons,
    }
}

/// A start for α: 0.1, or less where the pixel is polarized more than that roughness allows.
///
/// The depression of DoLP below that of a mirror facet is 2.85 α^(16/11) of it under a uniform sky (.991/.906/.669 at α
/// .02/.1/.3, PHYSICS: 1/DoLP − 1 = .009/.104/.49), but diffuse light depresses it alike: `highest`, the largest DoLP of the
/// pixel relative to a mirror's, bounds α from above and says no more.
#[inline(always)]
fn start_alpha<R: Real>(highest: R) -> R {
    let depression = (R::of(1.0) / highest.max(R::of(1e-3)) - R::of(1.0)).max(R::of(1e-6)) * R::of(1.0 / 2.85);
    // x^(11/16) = √x · x^(1/8) · x^(1/16).
    let half = depression.sqrt();
    let eighth = half.sqrt().sqrt();
    (half * eighth * eighth.sqrt()).min(R::of(START_ALPHA)).max(R::of(0.01))
}
