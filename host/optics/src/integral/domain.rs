//! Where eq. 6 integrates: the sky above both the surface's and the world's horizon, cut into rays on which the ends of the
//! domain are known in closed form.
//!
//! In half-vector (slope) space h ∝ n + r e(φ) with e(φ) = t cos φ + b sin φ, and ω_i·a > 0 is a quadratic inequality in r:
//! 2(ω_o·(n + re))(a·(n + re)) − (ω_o·a)(1 + r²) > 0.

use crate::frames::{direction, tangents};
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use glam::DVec3;

/// Geometry of one integral.
#[derive(Clone, Copy, Debug)]
pub(super) struct Domain {
    pub(super) normal: DVec3,
    tangent: DVec3,
    bitangent: DVec3,
}

/// Up to three intervals.
pub(super) type Intervals = [Option<[f64; 2]>; 3];

impl Domain {
    pub(super) fn new(normal: DVec3) -> Self {
        let (tangent, bitangent) = tangents(normal);
        Self { normal, tangent, bitangent }
    }

    /// e(φ), a unit vector across the normal.
    pub(super) fn ray(&self, phi: f64) -> DVec3 {
        let (s, c) = phi.sin_cos();
        self.tangent * c + self.bitangent * s
    }

    /// Components (t, b, n).
    pub(super) fn local(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }

    /// The slopes r > 0 along e for which the mirrored view `wo` (n·ω_o > 0) sees the sky.
    pub(super) fn slopes(&self, wo: DVec3, e: DVec3) -> Intervals {
        let (along, up) = (wo.dot(e), wo.dot(self.normal));
        // Own horizon: −up r² + 2 along r + up > 0, whose one positive root is written without cancellation.
        let root = along.hypot(up);
        let end = if along >= 0.0 { (along + root) / up } else { up / (root - along) };
        // A view along the surface has no end; nothing is left of the distribution this far out.
        let end = end.min(1e100);
        // World horizon: a r² + 2 b r + c > 0.
        let a = 2.0 * along * e.z - wo.z;
        let b = up * e.z + along * self.normal.z;
        let c = 2.0 * up * self.normal.z - wo.z;
        let mut cuts = [0.0, end, end, end];
        let discriminant = b * b - a * c;
        if discriminant > 0.0 {
            let sum = -(b + discriminant.sqrt().copysign(b));
            for (cut, r) in cuts.iter_mut().skip(1).zip([sum / a, c / sum]) {
                if r > 0.0 && r < end {
                    *cut = r;
                }
            }
            if cuts[1] > cuts[2] {
                cuts.swap(1, 2);
            }
        }
        let [r0, r1, r2, r3] = cuts;
        let lit = |[low, high]: [f64; 2]| {
            let r = 0.5 * (low + high);
            (high > low && (a * r + 2.0 * b) * r + c > 0.0).then_some([low, high])
        };
        [lit([r0, r1]), lit([r1, r2]), lit([r2, r3])]
    }

    /// Azimuths at which [`Self::slopes`] is not smooth in φ, or may change fast: corners where both horizons meet, rays
    /// tangent to the world horizon, and rays along it.
    pub(super) fn slope_breaks(&self, wo: DVec3) -> Vec<f64> {
        let mut breaks = Vec::with_capacity(16);
        for corner in self.corners() {
            let h = self.local(wo + corner);
            breaks.push(h.y.atan2(h.x));
        }
        let (o, z) = (self.local(wo), self.local(DVec3::Z));
        // b(e) = e·(up z + n_z ω_o): the linear term.
        let linear = [o.z * z.x + z.z * o.x, o.z * z.y + z.z * o.y];
        let across = linear[1].atan2(linear[0]) + FRAC_PI_2;
        breaks.extend([across, across + PI]);
        // b² − ac = 0 as a quadratic form eᵀSe = m + d cos 2φ + f sin 2φ.
        let c = 2.0 * o.z * z.z - wo.z;
        let s11 = linear[0] * linear[0] - c * (2.0 * o.x * z.x - wo.z);
        let s22 = linear[1] * linear[1] - c * (2.0 * o.y * z.y - wo.z);
        let f = linear[0] * linear[1] - c * (o.x * z.y + o.y * z.x);
        let (m, d) = (0.5 * (s11 + s22), 0.5 * (s11 - s22));
        let cosine = -m / d.hypot(f);
        if cosine.abs() <= 1.0 {
            let (middle, half) = (0.5 * f.atan2(d), 0.5 * cosine.acos());
            breaks.extend([middle + half, middle - half, middle + half + PI, middle - half + PI]);
        }
        panels(breaks)
    }

    /// The polar angles θ in [0, π/2] from the normal, along e, above the world horizon.
    pub(super) fn polar(&self, e: DVec3) -> [f64; 2] {
        if e.z >= 0.0 {
            [if self.normal.z < 0.0 { (-self.normal.z).atan2(e.z) } else { 0.0 }, FRAC_PI_2]
        } else {
            [0.0, self.normal.z.max(0.0).atan2(-e.z)]
        }
    }

    /// Azimuths at which [`Self::polar`] is not smooth in φ.
    pub(super) fn polar_breaks(&self) -> Vec<f64> {
        let z = self.local(DVec3::Z);
        let across = z.y.atan2(z.x) + FRAC_PI_2;
        panels(vec![across, across + PI])
    }

    /// The two directions on both horizons, if they differ.
    fn corners(&self) -> Vec<DVec3> {
        direction(self.normal.cross(DVec3::Z)).map_or_else(|_| Vec::new(), |c| vec![c, -c])
    }
}

/// Sorted ends of panels that cover the full turn and are no wider than a quarter of it.
fn panels(breaks: Vec<f64>) -> Vec<f64> {
    let mut ends: Vec<f64> = breaks.into_iter().filter(|b| b.is_finite()).map(|b| b.rem_euclid(TAU)).collect();
    ends.sort_by(f64::total_cmp);
    let first = ends.first().copied().unwrap_or(0.0);
    ends.push(first + TAU);
    let mut out = vec![first];
    let mut last = first;
    for end in ends {
        // Breaks closer than rounding are one.
        if end - last < 1e-14 {
            continue;
        }
        let (low, width) = (last, end - last);
        let pieces = [1.0, 2.0, 3.0, 4.0].into_iter().find(|p| width / p <= FRAC_PI_2 + 1e-9).unwrap_or(4.0);
        let mut k = 1.0;
        while k < pieces {
            out.push(low + width * k / pieces);
            k += 1.0;
        }
        out.push(end);
        last = end;
    }
    out
}
