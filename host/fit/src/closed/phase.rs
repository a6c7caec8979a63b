//! What one view sees of a pixel, and the phase its bands share (paper eq. 5): cleaned, weighted, with its variance.

use super::plane::{Azimuth, axis};
use super::real::{Real, Triple};
use crate::material::BANDS;

/// What one view sees of a pixel, in units of a white sample.
#[derive(Clone, Copy)]
pub(super) struct Seen<R> {
    /// 1, or 0 for a place without a view.
    pub(super) present: R,
    /// Unit ω_o.
    pub(super) direction: Triple<R>,
    /// Frame of the ray.
    pub(super) x: Triple<R>,
    pub(super) y: Triple<R>,
    pub(super) stokes: [Triple<R>; BANDS],
    /// 00, 01, 02, 11, 12, 22.
    pub(super) covariance: [[R; 6]; BANDS],
}

impl<R: Real> Seen<R> {
    /// A place without a view.
    #[inline(always)]
    pub(super) fn nothing() -> Self {
        let (zero, one) = (R::of(0.0), R::of(1.0));
        Self {
            present: zero,
            direction: [zero, zero, one],
            x: [one, zero, zero],
            y: [zero, one, zero],
            stokes: [[zero; 3]; BANDS],
            covariance: [[zero; 6]; BANDS],
        }
    }
}

/// One band of one view, turned to the phase u of its view and v = u + 45°.
#[derive(Clone, Copy)]
pub(super) struct Band<R> {
    /// 1 if it can be used, else 0.
    pub(super) ok: R,
    pub(super) s0: R,
    /// p: polarized power along the phase.
    pub(super) polarized: R,
    /// ∂φ/∂v.
    pub(super) share: R,
    pub(super) c00: R,
    pub(super) c0u: R,
    pub(super) c0v: R,
    pub(super) cuu: R,
    pub(super) cuv: R,
}

/// What one view says.
#[derive(Clone, Copy)]
pub(super) struct Phase<R> {
    pub(super) azimuth: Azimuth<R>,
    pub(super) bands: [Band<R>; BANDS],
    /// Variance of φ by the noise alone.
    pub(super) noise: R,
    /// 1 if some band can be used, else 0.
    pub(super) known: R,
    /// 1 if some band is more polarized than light can be.
    pub(super) impossible: R,
}

/// The bands of one view, cleaned, and the phase they share.
#[inline(always)]
pub(super) fn phase<R: Real>(seen: &Seen<R>, out: &mut Phase<R>) {
    let (zero, one, two) = (R::of(0.0), R::of(1.0), R::of(2.0));
    let mut stokes = [[zero; 3]; BANDS];
    let mut covariance = [[zero; 6]; BANDS];
    let mut share = [zero; BANDS];
    let (mut total, mut known) = (R::of(1e-30), zero);
    for b in 0..BANDS {
        let s = &seen.stokes[b];
        let c = &seen.covariance[b];
        let mut size = s[0].abs() + s[1].abs() + s[2].abs();
        for x in c {
            size = size + x.abs();
        }
        // NaN, infinities and what is not above three sigma.
        let noise = (c[0].max(zero)).sqrt();
        let ok = size.is_less(R::of(1e12)) * (R::of(3.0) * noise + R::of(1e-6)).is_less(s[0]);
        for k in 0..3 {
            stokes[b][k] = R::of(0.5).less(ok, s[k], zero);
        }
        for k in 0..6 {
            covariance[b][k] = R::of(0.5).less(ok, c[k], zero);
        }
        // Without noise all weights stay finite.
        let floor = (R::of(1e-5) * stokes[b][0]).squared() + R::of(1e-14);
        for k in [0, 3, 5] {
            covariance[b][k] = covariance[b][k].max(zero) + floor;
        }
        share[b] = ok / (covariance[b][3] + covariance[b][5]);
        total = total + share[b];
        out.bands[b].ok = ok;
        known = known.max(ok);
    }
    let per_total = one / total;
    let (mut s1, mut s2) = (zero, zero);
    for b in 0..BANDS {
        share[b] = share[b] * per_total;
        s1 = s1 + share[b] * stokes[b][1];
        s2 = s2 + share[b] * stokes[b][2];
    }
    let length = (s1 * s1 + s2 * s2).max(R::of(1e-24)).sqrt();
    let per_length = one / length;
    let (c, s) = (length.less(R::of(2e-12), one, s1 * per_length), s2 * per_length);
    let (cc, ss, cs) = (c * c, s * s, c * s);
    let half_length = R::of(0.5) * per_length;
    let (mut variance, mut impossible) = (zero, zero);
    for b in 0..BANDS {
        let [c00, c01, c02, c11, c12, c22] = covariance[b];
        let band = &mut out.bands[b];
        band.s0 = stokes[b][0];
        band.polarized = stokes[b][1] * c + stokes[b][2] * s;
        band.share = share[b] * half_length;
        band.c00 = c00;
        band.c0u = c01 * c + c02 * s;
        band.c0v = c02 * c - c01 * s;
        let both = two * c12 * cs;
        band.cuu = c11 * cc + both + c22 * ss;
        band.cuv = (c22 - c11) * cs + c12 * (cc - ss);
        variance = variance + band.share.squared() * (c11 * ss - both + c22 * cc);
        // More polarized than light can be, by three sigma.
        let excess = band.polarized - band.s0;
        let sigma = (band.cuu + band.c00 - two * band.c0u).max(zero).sqrt();
        impossible = impossible.max((R::of(3.0) * sigma + R::of(1e-3) * band.s0).is_less(excess));
    }
    let double = [c, s];
    out.azimuth = Azimuth { double, axis: axis(seen.x, seen.y, double), variance: variance.max(R::of(1e-14)) };
    (out.noise, out.known, out.impossible) = (variance, known, impossible);
}

impl<R: Real> Phase<R> {
    /// Of a place without a view.
    #[inline(always)]
    pub(super) fn nothing() -> Self {
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let band = Band {
            ok: zero,
            s0: zero,
            polarized: zero,
            share: zero,
            c00: zero,
            c0u: zero,
            c0v: zero,
            cuu: zero,
            cuv: zero,
        };
        let azimuth = Azimuth { double: [one, zero], axis: [one, zero, zero], variance: one };
        Self { azimuth, bands: [band; BANDS], noise: zero, known: zero, impossible: zero }
    }
}

/// The phase of one view: what `sky-aware` corrects; and 1 if there is one.
pub(super) fn azimuth(seen: &Seen<f64>) -> (Azimuth<f64>, f64) {
    let mut out = Phase::nothing();
    phase(seen, &mut out);
    (out.azimuth, out.known)
}
