//! Eq. 6 to nearly full precision, with an error estimate: the reference that faster rules are held against.
//!
//! Specular: polar slope coordinates (φ, r = α sinh v) about the mirror direction, in which the distribution is
//! sinh v/cosh³ v whatever α, the ends of every ray are exact ([`super::domain`]) and bisection does the rest. Each panel in
//! φ is walked as a smoothstep, which removes the square roots where rays become tangent to the world horizon.

use super::domain::Domain;
use super::quadrature::{GaussLegendre, Sum, bisect};
use super::{FixedPoints, View, reflected};
use crate::diffuse::transmitted_row;
use crate::{Dielectric, Frame, Incidence, Light, Microfacet};
use core::f64::consts::FRAC_1_PI;
use glam::DVec3;

/// Most bisections of one panel, along a ray and around the normal: smooth skies reach their tolerance well within them, light
/// with edges must not run for hours.
const INNER_LIMIT: u32 = 60;
const OUTER_LIMIT: u32 = 200;

/// A result and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const K: usize> {
    /// The integrals.
    pub value: [f64; K],
    /// Absolute quadrature error of the worst component as bisection sees it: far above the true error for smooth light,
    /// honest but no proof for light with edges. A source so small that no node falls on it is not seen at all: sum it with
    /// [`super::discrete`].
    pub error: f64,
}

/// The adaptive rule.
#[derive(Clone, Debug)]
pub struct Adaptive {
    rule: GaussLegendre,
    tolerance: f64,
}

impl Default for Adaptive {
    fn default() -> Self {
        Self::new(1e-13)
    }
}

impl Adaptive {
    /// `tolerance`: at which difference, relative to s0 (or to the irradiance), a panel counts as done. 1e-13 costs some
    /// 10 ms for a smooth sky; light with edges (a disk) runs into a limit of bisections instead and says so in its
    /// error: ask 1e-4 of it.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        Self { rule: GaussLegendre::new(10), tolerance }
    }

    /// The specular part of eq. 6 in the camera frame.
    #[must_use]
    pub fn specular(&self, light: &impl Light, surface: &Microfacet, normal: DVec3, view: &View) -> Estimate<3> {
        let wo = view.direction;
        if normal.dot(wo) <= 0.0 {
            return Estimate { value: [0.0; 3], error: 0.0 };
        }
        let [rough, ..] = FixedPoints::new(24).specular(light, surface, normal, view);
        let tolerance = self.tolerance * rough;
        let domain = Domain::new(normal);
        let alpha = surface.ggx.alpha();
        let mut along_ray = |phi: f64| {
            let e = domain.ray(phi);
            let mut total = Sum::ZERO;
            for [low, high] in domain.slopes(wo, e).into_iter().flatten() {
                let mut f = |v: f64| facet(light, surface, normal, view, e, v);
                let (mut from, to) = ((low / alpha).asinh(), (high / alpha).asinh());
                let layer = alpha.max(mirrored_cosine(normal, wo, e, high));
                while from < to {
                    let next = panel_end(from, to, layer);
                    total.add(&bisect(&self.rule, &mut f, [from, next], 0.1 * tolerance, INNER_LIMIT));
                    from = next;
                }
            }
            total.value
        };
        self.around(&domain.slope_breaks(wo), &mut along_ray, tolerance)
    }

    /// E = ∫ L (n·ω) dω over the sky above both horizons.
    #[must_use]
    pub fn irradiance(&self, light: &impl Light, normal: DVec3) -> Estimate<1> {
        self.hemisphere(normal, |w| {
            let [l, ..] = light.stokes(w);
            l
        })
    }

    /// The irradiance that passes the interface inwards, for [`super::polarized_diffuse`].
    #[must_use]
    pub fn transmitted_irradiance(&self, light: &impl Light, ior: Dielectric, normal: DVec3) -> Estimate<1> {
        self.hemisphere(normal, |w| {
            let s = light.stokes(w);
            transmitted_row(ior, w, &Frame::sky(w), normal).iter().zip(s).map(|(t, x)| t * x).sum()
        })
    }

    /// ∫ f(ω) (n·ω) dω in polar coordinates about the normal.
    fn hemisphere(&self, normal: DVec3, f: impl Fn(DVec3) -> f64) -> Estimate<1> {
        let domain = Domain::new(normal);
        let tolerance = self.tolerance * f(normal).abs().max(f(DVec3::Z).abs());
        let mut along_ray = |phi: f64| {
            let e = domain.ray(phi);
            let mut g = |theta: f64| {
                let (s, c) = theta.sin_cos();
                [s * c * f(normal * c + e * s)]
            };
            bisect(&self.rule, &mut g, domain.polar(e), 0.1 * tolerance, INNER_LIMIT).value
        };
        self.around(&domain.polar_breaks(), &mut along_ray, tolerance)
    }

    /// ∫ over φ between `ends`, each panel walked as t²(3 − 2t).
    fn around<const K: usize>(&self, ends: &[f64], f: &mut impl FnMut(f64) -> [f64; K], tolerance: f64) -> Estimate<K> {
        let mut total = Sum::ZERO;
        for pair in ends.windows(2) {
            let [low, high] = [pair[0], pair[1]];
            let mut g = |t: f64| {
                let speed = 6.0 * t * (1.0 - t) * (high - low);
                f(low + (high - low) * t * t * (3.0 - 2.0 * t)).map(|x| x * speed)
            };
            total.add(&bisect(&self.rule, &mut g, [0.0, 1.0], tolerance, OUTER_LIMIT));
        }
        // Inner sums stop at a tenth of the tolerance each, over a turn of 2π.
        Estimate { value: total.value, error: total.error + tolerance }
    }
}

/// The end of the panel of a ray that begins at `from`, all in v: at most 2 on, the distribution's own width being about 1.
///
/// Shadowing bends within n·ω_i < α of the own horizon, in a layer so thin that a panel and its halves miss it alike and
/// agree on a wrong value (1e-11 of s0 at α = 1e-4). So panels shrink towards the end until they are as short as `layer`.
fn panel_end(from: f64, to: f64, layer: f64) -> f64 {
    let rest = to - from;
    if rest <= layer { to } else { from + (0.875 * rest).min(2.0) }
}

/// n·ω_i of the view `wo` mirrored at slope `r` along `e`.
fn mirrored_cosine(normal: DVec3, wo: DVec3, e: DVec3, r: f64) -> f64 {
    let (along, up) = (wo.dot(e), wo.dot(normal));
    2.0 * (up + along * r) / 1.0_f64.hypot(r).powi(2) - up
}

/// Integrand per dv dφ at slope r = α sinh v along e: the distribution P22 r dr dφ = sinh v/(π cosh³ v) dv dφ times
/// f_r (n·ω_i) dω_i per P22 dm = 4 G2/(4 c_i c_o) c_i (ω_o·h)/(n·h).
fn facet(light: &impl Light, surface: &Microfacet, normal: DVec3, view: &View, e: DVec3, v: f64) -> [f64; 3] {
    let (sinh, cosh) = (v.sinh(), v.cosh());
    let r = surface.ggx.alpha() * sinh;
    let length = 1.0_f64.hypot(r);
    let h = (normal + e * r) / length;
    let wo = view.direction;
    let o_dot_h = wo.dot(h);
    let wi = h * (2.0 * o_dot_h) - wo;
    let (i, o) = (Incidence::between(normal, wi), Incidence::between(normal, wo));
    let weight = FRAC_1_PI * sinh / cosh.powi(3) * 4.0 * surface.ggx.visibility(i, o) * i.cosine * o_dot_h * length;
    if weight <= 0.0 {
        return [0.0; 3];
    }
    reflected(light, surface.ior, h, wi, view).map(|x| x * weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x/√(x² + α²) over [0, 2], x the distance to the horizon, has the closed form √(4 + α²) − α. Seen through the weight
    /// α² of a lobe's tail, one panel and its halves agree to the tolerance and are wrong by α³.
    #[test]
    fn panels_find_the_layer_at_the_horizon() {
        let rule = GaussLegendre::new(10);
        for alpha in [1e-2_f64, 1e-3, 1e-4, 1e-5] {
            let weight = alpha * alpha;
            let exact = weight * ((4.0 + weight).sqrt() - alpha);
            let mut f = |v: f64| [weight * (2.0 - v) / alpha.hypot(2.0 - v)];
            let (mut from, mut sum) = (0.0, Sum::ZERO);
            while from < 2.0 {
                let next = panel_end(from, 2.0, alpha);
                sum.add(&bisect(&rule, &mut f, [from, next], 1e-14, INNER_LIMIT));
                from = next;
            }
            assert!((sum.value[0] - exact).abs() <= 1e-6 * weight * alpha, "{alpha}: {sum:?} against {exact:e}");
            if alpha < 5e-4 {
                let one = bisect(&rule, &mut f, [0.0, 2.0], 1e-14, INNER_LIMIT);
                assert!((one.value[0] - exact).abs() > 0.5 * weight * alpha, "{alpha}: {one:?}");
            }
        }
    }
}
