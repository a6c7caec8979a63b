//! Directions for the lobe integral under a smooth sky, spread over the part of the sky that both horizons leave.
//!
//! The sky above the surface's own horizon and the world's is a lune: two half planes of directions that meet in the axis
//! c ∝ n × ẑ. In ω = c sin a + (x cos b + ẑ sin b) cos a it is the rectangle |a| < π/2, b₀ < b < b₁, whatever the normal and the
//! view. So nothing is cut, and the sum is as smooth a function of both as the light is: [`host_optics::integral::FixedPoints`],
//! whose rays end at one horizon or the other, bends by up to 1e-3 of s0 where that changes, which interpolation cannot follow.
//!
//! Either coordinate is walked as m + w sinh u about the mirror direction, in which GGX of width w has its nearest pole at
//! |Im u| = π/2 for all of its tail, by Fejér's first rule. So the error falls as (√(1 + s²) + s)⁻ⁿ or faster in the number n of
//! nodes, s = π/(2L) for a range of 2L in u.

use super::numbers::{count_above, real};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use glam::DVec3;
use host_optics::frames::{direction, tangents};

/// The rule for one roughness.
#[derive(Clone, Debug)]
pub(crate) struct Lune {
    alpha: f64,
    /// Node and weight on [−1, 1].
    nodes: Vec<[f64; 2]>,
}

/// Of a lobe narrower than this there is no need: its tail at the horizons is below 1e-4 of s0.
pub(crate) const LEAST_ALPHA: f64 = 0.01;

/// How many times the nodes that the nearest pole calls for: light and shadowing have poles of their own.
const RESERVE: f64 = 1.15;

impl Lune {
    /// For lobes of roughness `alpha`, to errors of about `tolerance` of s0.
    pub(crate) fn new(alpha: f64, tolerance: f64) -> Self {
        let half = (FRAC_PI_2 / alpha).asinh();
        let digits = (1.0 / tolerance).ln().max(1.0);
        Self::with_nodes(alpha, count_above(RESERVE * digits / (FRAC_PI_2 / half).asinh()))
    }

    fn with_nodes(alpha: f64, count: usize) -> Self {
        let n = real(count);
        let node = |k: usize| {
            let theta = PI * (real(k) + 0.5) / n;
            let sum: f64 = (1..=count / 2).map(|j| (2.0 * real(j) * theta).cos() / (4.0 * real(j * j) - 1.0)).sum();
            [theta.cos(), 2.0 / n * (1.0 - 2.0 * sum)]
        };
        Self { alpha, nodes: (0..count).map(node).collect() }
    }

    /// Directions with their solid angles, which add up to that of the lune, for a unit normal and a view ω_o above the surface.
    pub(crate) fn points(&self, normal: DVec3, wo: DVec3) -> Vec<(DVec3, f64)> {
        // Any axis across the vertical does for a normal along it.
        let axis = direction(normal.cross(DVec3::Z)).unwrap_or_else(|_| tangents(DVec3::Z).0);
        let x = DVec3::Z.cross(axis);
        let around = |v: DVec3| v.z.atan2(v.dot(x));
        let up = around(normal);
        let [low, high] = [(up - FRAC_PI_2).max(0.0), (up + FRAC_PI_2).min(PI)];
        let cosine = normal.dot(wo);
        let mirror = normal * (2.0 * cosine) - wo;
        let along = mirror.dot(axis).clamp(-1.0, 1.0).asin();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let turned = (around(mirror) - middle + PI).rem_euclid(TAU) - PI;
        // The lobe is 2α wide along the plane of incidence and 2α n·ω_o across it.
        let width = 2.0 * self.alpha * cosine.clamp(0.1, 1.0);
        let across = (width / along.cos().max(1e-3)).min(2.0);
        let a = self.line(along, width, [-FRAC_PI_2, FRAC_PI_2]);
        let b = self.line(middle + turned.clamp(-half, half), across, [low, high]);
        let mut points = Vec::with_capacity(a.len() * b.len());
        let turns: Vec<(DVec3, f64)> = b.into_iter().map(|[b, w]| (x * b.cos() + DVec3::Z * b.sin(), w)).collect();
        for [a, weight] in a {
            let (sine, cosine) = a.sin_cos();
            points.extend(turns.iter().map(|(v, w)| (axis * sine + *v * cosine, weight * w * cosine)));
        }
        points
    }

    /// Nodes and weights of ∫ dx over a range, dense within `width` of `center`.
    fn line(&self, center: f64, width: f64, [low, high]: [f64; 2]) -> Vec<[f64; 2]> {
        let [u0, u1] = [low, high].map(|end| ((end - center) / width).asinh());
        let (middle, half) = (0.5 * (u0 + u1), 0.5 * (u1 - u0));
        let at = |[t, weight]: [f64; 2]| {
            let u = middle + half * t;
            [center + width * u.sinh(), weight * half * width * u.cosh()]
        };
        self.nodes.iter().map(|node| at(*node)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_optics::integral::{Adaptive, View, discrete};
    use host_optics::sky::{ClearSky, Pattern, Rayleigh};
    use host_optics::{Ggx, Ior, Light, Masking, Microfacet};

    struct Sky {
        clear: ClearSky,
        pattern: Rayleigh,
    }

    impl Light for Sky {
        fn stokes(&self, w: DVec3) -> [f64; 3] {
            let [l, ..] = self.clear.stokes(w);
            let [q, u] = self.pattern.fraction(w);
            [l, l * q, l * u]
        }
    }

    /// (normal, view) up to 69° from the vertical, with normals that lean up to 11° whichever way.
    fn cases() -> Vec<(DVec3, View)> {
        let mut cases = Vec::new();
        for theta in [0.2_f64, 1.0, 1.2] {
            for tilt in [0.0_f64, 0.05, 0.2] {
                for turn in [0.0_f64, 1.0, 2.5, 4.0] {
                    let wo = DVec3::new(theta.sin(), 0.0, theta.cos());
                    let normal = DVec3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
                    cases.push((normal, View::new(wo, DVec3::Y).unwrap()));
                }
            }
        }
        cases
    }

    /// The lune between half planes at an angle β to each other has the area 2β.
    #[test]
    fn solid_angles_are_those_of_the_sky_above_both_horizons() {
        for alpha in [0.02, 0.1, 0.5] {
            let rule = Lune::new(alpha, 1e-5);
            for (normal, view) in cases() {
                let sum: f64 = rule.points(normal, view.direction).iter().map(|(_, w)| w).sum();
                let area = 2.0 * (PI - normal.z.min(1.0).acos());
                assert!((sum / area - 1.0).abs() < 2e-3, "{alpha} {normal}: {sum} against {area}");
                for (w, _) in rule.points(normal, view.direction) {
                    assert!(w.z > 0.0 && w.dot(normal) > -1e-12 && (w.length() - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    /// Under a clear polarized sky, against adaptive quadrature.
    #[test]
    fn the_lobe_integral_is_met_to_the_tolerance() {
        let sun = DVec3::new(-0.9, 0.1, 0.3).normalize();
        let clear = ClearSky { base: 0.7, horizon: 0.8, aureole: 2.5, width: 0.35, sun };
        let light = Sky { clear, pattern: Rayleigh::new(sun, 0.75).unwrap() };
        for alpha in [0.03, 0.12, 0.5] {
            let ggx = Ggx::new(alpha, Masking::HeightCorrelated).unwrap();
            let surface = Microfacet { ior: Ior::new(1.5, 0.0).unwrap(), ggx };
            for tolerance in [1e-3, 1e-5] {
                let rule = Lune::new(alpha, tolerance);
                let error = |(normal, view): (DVec3, View)| {
                    let exact = Adaptive::new(1e-8).specular(&light, &surface, normal, &view).value;
                    let found = discrete(&light, &rule.points(normal, view.direction), &surface, normal, &view);
                    (0..3).map(|k| (found[k] - exact[k]).abs() / exact[0]).fold(0.0, f64::max)
                };
                let mut errors: Vec<f64> = cases().into_iter().map(error).collect();
                errors.sort_by(f64::total_cmp);
                let (middle, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
                println!("alpha {alpha}, tolerance {tolerance:e}: {middle:.1e} in the middle, {worst:.1e} at worst");
                assert!(middle < tolerance && worst < 5.0 * tolerance, "{alpha} {tolerance}: {middle:e} {worst:e}");
            }
        }
    }
}
