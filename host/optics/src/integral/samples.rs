//! Eq. 6 by fixed points: what renderings and fits use.
//!
//! Visible-normal sampling loses points beyond the horizons, and its result jumps whenever one crosses. Here every azimuth
//! of slope space is cut exactly where the sky ends ([`super::domain`]) and its points are spread between those ends, so that
//! the result is a continuous function of α, η, the normal and the view (smooth but for a bend where an azimuth's end
//! changes from one horizon to the other) and converges fast.

use super::domain::Domain;
use super::quadrature::GaussLegendre;
use super::{View, reflected};
use crate::diffuse::transmitted_row;
use crate::{Dielectric, Frame, Incidence, Light, Microfacet};
use core::f64::consts::TAU;
use glam::DVec3;

/// 2 r² fixed points: r Gauss-Legendre rings of 2r equal steps in azimuth, each ring turned against the last.
///
/// Error of the specular part under a smooth polarized sky, α from 1e-4 to 0.6, views to 82° and mirror directions below
/// the horizon included, in units of s0 (median / worst): 4 rings 2e-3 / 6e-2, 8 rings 3e-4 / 6e-3, 16 rings 2e-5 / 4e-4,
/// 32 rings 1e-6 / 3e-5. Under light with edges it falls as for any N points.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedPoints {
    /// Azimuth in turns, radial coordinate, weight; all in [0, 1), the weights sum to 1.
    points: Vec<[f64; 3]>,
}

impl FixedPoints {
    /// 2 `rings`² points; `rings` = 0 counts as 1.
    #[must_use]
    pub fn new(rings: u32) -> Self {
        let rings = rings.max(1);
        let step = 0.5 / f64::from(rings);
        // A turn of the golden ratio from ring to ring: no azimuth is privileged.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let rule = GaussLegendre::new(rings);
        let ring = |(j, (x, w)): (u32, (f64, f64))| {
            let turn = (f64::from(j) * golden).fract();
            (0..2 * rings).map(move |k| [(f64::from(k) + turn) * step, x, w * step])
        };
        Self { points: (0..).zip(rule.unit()).flat_map(ring).collect() }
    }

    /// The specular part of eq. 6 in the camera frame.
    ///
    /// With u = r²/(α² + r²) the distribution P22 of slopes is uniform in (φ, u); points are even in t = 1 − √(1 − u), which
    /// also resolves the tail of slopes ~ 1 that faces an oblique view.
    #[must_use]
    pub fn specular(&self, light: &impl Light, surface: &Microfacet, normal: DVec3, view: &View) -> [f64; 3] {
        let wo = view.direction;
        let o = Incidence::between(normal, wo);
        let mut sum = [0.0; 3];
        if o.cosine <= 0.0 {
            return sum;
        }
        let domain = Domain::new(normal);
        let alpha = surface.ggx.alpha();
        let radial = |r: f64| {
            let slant = alpha.hypot(r);
            (r / slant) * (r / (slant + alpha))
        };
        for [turn, x, share] in &self.points {
            let e = domain.ray(TAU * turn);
            for [low, high] in domain.slopes(wo, e).into_iter().flatten().map(|ends| ends.map(radial)) {
                let t = low + (high - low) * x;
                let rest = 1.0 - t;
                let r = alpha * (t * (2.0 - t)).sqrt() / rest;
                let length = 1.0_f64.hypot(r);
                let h = (normal + e * r) / length;
                let o_dot_h = wo.dot(h);
                let wi = h * (2.0 * o_dot_h) - wo;
                let i = Incidence::between(normal, wi);
                // f_r (n·ω_i) dω_i per P22 dm is G2 (ω_o·h)/(n·ω_o n·h).
                let density = 4.0 * surface.ggx.visibility(i, o) * i.cosine * o_dot_h * length;
                let weight = share * 2.0 * rest * (high - low) * density;
                if weight > 0.0 {
                    for (total, x) in sum.iter_mut().zip(reflected(light, surface.ior, h, wi, view)) {
                        *total += weight * x;
                    }
                }
            }
        }
        sum
    }

    /// E = ∫ L (n·ω) dω over the sky above both horizons.
    #[must_use]
    pub fn irradiance(&self, light: &impl Light, normal: DVec3) -> f64 {
        self.hemisphere(normal, |w| {
            let [l, ..] = light.stokes(w);
            l
        })
    }

    /// The irradiance that passes the interface inwards, for [`super::polarized_diffuse`].
    #[must_use]
    pub fn transmitted_irradiance(&self, light: &impl Light, ior: Dielectric, normal: DVec3) -> f64 {
        self.hemisphere(normal, |w| {
            let s = light.stokes(w);
            transmitted_row(ior, w, &Frame::sky(w), normal).iter().zip(s).map(|(t, x)| t * x).sum()
        })
    }

    /// ∫ f(ω) (n·ω) dω: points even in cos θ, in which Fresnel terms are smooth to grazing, between the exact ends of every
    /// azimuth.
    fn hemisphere(&self, normal: DVec3, f: impl Fn(DVec3) -> f64) -> f64 {
        let domain = Domain::new(normal);
        let mut sum = 0.0;
        for [turn, x, share] in &self.points {
            let e = domain.ray(TAU * turn);
            let [high, low] = domain.polar(e).map(f64::cos);
            let c = low + (high - low) * x;
            let sine = ((1.0 - c) * (1.0 + c)).sqrt();
            sum += share * (high - low) * c * f(normal * c + e * sine);
        }
        TAU * sum
    }
}
