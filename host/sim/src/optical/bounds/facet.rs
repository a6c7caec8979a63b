//! How fast what a mirror sends to the camera changes as the mirror tilts: suprema over a box of normals and views, proved by
//! interval derivatives along rays of slopes h ∝ n + r e(φ).
//!
//! With U = ω_o·(n + r e): c = U/√(1 + r²), ω_i·v = 2U (n + r e)·v/(1 + r²) − ω_o·v, and the s axis h × ω_o has the components
//! (h·y, −h·x) in the camera frame, so that (R⊥ − R∥)/2 (cos 2φ, sin 2φ) = 2 R⊥ c q/(cq + s²)² ((h·y)² − (h·x)², −2 h·x h·y)
//! has no singularity at normal incidence. s1 and s2 enter as their modulus: it does not depend on the frame chosen.

use super::{Interval, Jet};
use crate::optical::Radiance;
use core::f64::consts::TAU;
use glam::DVec3;
use host_optics::frames::tangents;
use host_optics::{Dielectric, Frame};

/// Normals and views, each within a chord of its center.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MirrorBox {
    pub(crate) normal: DVec3,
    pub(crate) normal_radius: f64,
    pub(crate) view: DVec3,
    pub(crate) view_radius: f64,
}

/// Suprema over a [`MirrorBox`] and slopes, absolute, worst of s0 and √(s1² + s2²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Suprema {
    /// Infimum of s0.
    pub(crate) least: f64,
    /// |F|.
    pub(crate) value: f64,
    /// |∂F/∂r|.
    pub(crate) first: f64,
    /// |∂²((1 + m·t) F)/∂r²|.
    pub(crate) second: f64,
}

/// Directions of slope the half turn is cut into; each ray is followed both ways.
const DIRECTIONS: u16 = 12;

impl MirrorBox {
    /// For slopes up to `reach`. `None` where the light has edges.
    pub(crate) fn suprema(&self, radiance: &Radiance, ior: Dielectric, reach: f64) -> Option<Suprema> {
        let (t, b) = tangents(self.normal);
        let mut worst = Suprema { least: f64::INFINITY, value: 0.0, first: 0.0, second: 0.0 };
        let half = 0.25 * TAU / f64::from(DIRECTIONS);
        for k in 0..DIRECTIONS {
            let (s, c) = (half * f64::from(2 * k + 1)).sin_cos();
            // An arc is within its half angle of its middle; directions across n are those across the center, transported.
            let ray = Ray {
                e: t * c + b * s,
                e_radius: half + 1.01 * self.normal_radius,
                r: Interval::new(-reach, reach),
                at: self,
            };
            let [s0, s1, s2] = ray.mirror(radiance, ior)?;
            // 1 + m·t = U/(ω_o·n).
            let weight = ray.up().scale_by(self.cosine().reciprocal());
            let weighted = [s0, s1, s2].map(|s| s * weight);
            let worst_of = |f: [Interval; 3]| f[0].magnitude().max(f[1].magnitude().hypot(f[2].magnitude()));
            worst.least = worst.least.min(s0.value.low);
            worst.value = worst.value.max(worst_of([s0, s1, s2].map(|s| s.value)));
            worst.first = worst.first.max(worst_of([s0, s1, s2].map(|s| s.first)));
            worst.second = worst.second.max(worst_of(weighted.map(|s| s.second)));
        }
        let finite = worst.value.is_finite() && worst.first.is_finite() && worst.second.is_finite();
        finite.then_some(worst)
    }

    /// n·ω_o.
    fn cosine(&self) -> Interval {
        let (c, radius) = (self.normal.dot(self.view), self.normal_radius + self.view_radius);
        Interval::new(c - radius, c + radius)
    }
}

struct Ray<'a> {
    e: DVec3,
    e_radius: f64,
    r: Interval,
    at: &'a MirrorBox,
}

impl Ray<'_> {
    /// (n + r e)·v for a fixed vector v of length at most 1.
    fn along(&self, v: DVec3, v_radius: f64) -> Jet {
        let around = |center: f64, radius: f64| Interval::new((center - radius).max(-1.0), (center + radius).min(1.0));
        Jet::linear(
            around(self.at.normal.dot(v), self.at.normal_radius + v_radius),
            around(self.e.dot(v), self.e_radius + v_radius),
            self.r,
        )
    }

    /// U = ω_o·(n + r e).
    fn up(&self) -> Jet {
        self.along(self.at.view, self.at.view_radius)
    }

    /// (s0, s1, s2) of the mirror at slope r.
    fn mirror(&self, radiance: &Radiance, ior: Dielectric) -> Option<[Jet; 3]> {
        let r = Jet { value: self.r, first: Interval::at(1.0), second: Interval::at(0.0) };
        let inverse = r.square().offset(1.0).reciprocal();
        let u = self.up();
        let c2 = u.square() * inverse;
        let c = u * inverse.sqrt();
        let s2 = c2.scale(-1.0).offset(1.0);
        let contrast = (ior.eta() - 1.0) * (ior.eta() + 1.0);
        let q = c2.offset(contrast).sqrt();
        let perpendicular = (c + q).square().reciprocal().square().scale(contrast * contrast);
        let cq = c * q;
        let sum = (cq + s2).reciprocal();
        let t = (cq - s2) * sum;
        let light = self.light(radiance, u * inverse)?;
        let power = perpendicular * light;
        // The frame: its x axis across the box's own plane of incidence, carried along as the view moves.
        let view = self.at.view;
        let across = self.at.normal.cross(view).try_normalize().unwrap_or_else(|| tangents(view).0);
        let frame = Frame::camera(view, across).ok()?;
        let moved = core::f64::consts::SQRT_2 * self.at.view_radius
            / (1.0 - core::f64::consts::SQRT_2 * self.at.view_radius).max(1e-3);
        let hx = self.along(frame.x, moved);
        let hy = self.along(frame.y, moved + self.at.view_radius);
        let polarized = power * cq * sum.square() * inverse;
        Some([
            power * t.square().offset(1.0).scale(0.5),
            (polarized * (hy.square() - hx.square())).scale(2.0),
            (polarized * hx * hy).scale(-4.0),
        ])
    }

    /// L of the mirrored direction, with `u` = U/(1 + r²).
    fn light(&self, radiance: &Radiance, u: Jet) -> Option<Jet> {
        let mirrored = |v: DVec3| {
            let out = self.at.view.dot(v);
            let view = Interval::new(out - self.at.view_radius, out + self.at.view_radius);
            (u * self.along(v, 0.0)).scale(2.0) - Jet::constant(view)
        };
        match radiance {
            Radiance::Uniform(l) => Some(Jet::constant(Interval::at(l.radiance))),
            Radiance::Overcast(l) => Some(mirrored(DVec3::Z).scale(2.0).offset(1.0).scale(l.zenith / 3.0)),
            Radiance::Clear(l) => {
                let low = mirrored(DVec3::Z).scale(-1.0).offset(1.0).square().scale(l.horizon);
                let chord = mirrored(l.sun).offset(-1.0).scale(1.0 / (l.width * l.width));
                Some((low + chord.exp().scale(l.aureole)).offset(l.base))
            }
            Radiance::Map(_) => None,
        }
    }
}
