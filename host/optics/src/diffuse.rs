//! Diffuse reflection that knows about the interface: T_out · depolarize · T_in, in the normalization of Baek et al. 2018
//! and Mitsuba's `pplastic` (no 1/η², no internal-bounce factor).
//!
//! (1/π) M_rot(φ) T(θ_o) diag(ρ_d, 0, 0, 0) T(θ_i) M_rot(−φ_i), with the s axes along n × ω and
//! T = ½ [[T⊥ + T∥, T⊥ − T∥], [T⊥ − T∥, T⊥ + T∥]]. It replaces the Lambert term of paper eq. 6, which is ρ_d/π on s0 alone.
//! What leaves is polarized in the plane of n and ω_o: opposite in sign to specular reflection.

use crate::{Dielectric, Frame, Incidence, LinearMueller};
use core::f64::consts::FRAC_1_PI;
use glam::DVec3;

/// A diffuse body with albedo ρ_d under an interface of index η.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolarizedDiffuse {
    /// Index of the interface.
    pub ior: Dielectric,
    /// ρ_d in [0, 1], albedo of the body below the interface.
    pub albedo: f64,
}

impl PolarizedDiffuse {
    /// The BRDF on linear Stokes, per steradian and without n·ω_i; 0 unless both directions are above the surface. The
    /// fourth row and column of the full matrix are zero.
    #[must_use]
    pub fn linear(&self, wi: DVec3, incident: &Frame, wo: DVec3, outgoing: &Frame, normal: DVec3) -> LinearMueller {
        let row = transmitted_row(self.ior, wi, incident, normal);
        let column = self.emission(wo, outgoing, normal);
        LinearMueller(column.map(|c| row.map(|r| c * r)))
    }

    /// Stokes leaving towards `wo` for a transmitted irradiance of 1 (see [`transmitted_row`]), per steradian.
    #[must_use]
    pub fn emission(&self, wo: DVec3, outgoing: &Frame, normal: DVec3) -> [f64; 3] {
        transmitted_row(self.ior, wo, outgoing, normal).map(|x| FRAC_1_PI * self.albedo * x)
    }
}

/// The row a with a·(L, Q, U) = the part of a beam along `w` that passes the interface, in `frame` of that beam; 0 at and
/// below the horizon. By reciprocity also the Stokes vector of unit light from below that leaves towards `w`.
#[must_use]
pub fn transmitted_row(ior: Dielectric, w: DVec3, frame: &Frame, normal: DVec3) -> [f64; 3] {
    let at = Incidence::between(normal, w);
    if at.cosine <= 0.0 {
        return [0.0; 3];
    }
    let [perpendicular, parallel] = ior.transmittance(at);
    // T⊥ − T∥ = −(R⊥ − R∥), whose stable form vanishes as s² at the normal where the axis n × ω is lost.
    let half = -0.5 * ior.difference(at);
    let turn = frame.turn_to(normal.cross(w));
    [0.5 * (perpendicular + parallel), half * turn.cos, half * turn.sin]
}
