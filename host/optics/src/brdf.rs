//! The microfacet Mueller BRDF of paper eq. 6: f_r without Fresnel, times M_rot(φ) M_ref M_rot(−ψ).
//!
//! φ is the angle of the s axis (along ω_i × ω_o) in the outgoing frame and ψ its angle in the incident frame; Fresnel is
//! in M_ref only. Nothing here contains the cosine n·ω_i of the measure.

use crate::frames::s_axis;
use crate::{Frame, Ggx, Incidence, Ior, Turn};
use glam::DVec3;
use protocol_polar::{Mueller, Reflectance};

/// A Mueller matrix on linear Stokes (L, Q, U): what a camera without a retarder can see of one. Row-major.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearMueller(pub [[f64; 3]; 3]);

impl LinearMueller {
    /// The light after it.
    #[inline]
    #[must_use]
    pub fn apply(&self, s: [f64; 3]) -> [f64; 3] {
        self.0.map(|[a, b, c]| a * s[0] + b * s[1] + c * s[2])
    }
}

/// One reflection with its two frame changes: M_rot(φ) M_ref M_rot(−ψ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    /// From the incident frame to the plane of incidence: turn by −ψ.
    pub into_plane: Turn,
    /// Paper eq. 2 in the plane of incidence.
    pub reflectance: Reflectance,
    /// From the plane of incidence to the outgoing frame: turn by φ.
    pub out_of_plane: Turn,
}

impl Reflection {
    /// At the facet that mirrors `wi` into `wo` (unit, away from the surface). Retro-reflection and grazing included.
    #[inline]
    #[must_use]
    pub fn at_facet(ior: Ior, wi: DVec3, incident: &Frame, wo: DVec3, outgoing: &Frame) -> Self {
        let s = s_axis(wi, wo);
        Self {
            into_plane: incident.turn_to(s).inverse(),
            reflectance: ior.reflectance(Incidence::on_facet(wi, wo)),
            out_of_plane: outgoing.turn_to(s),
        }
    }

    /// The 4 × 4 matrix.
    #[must_use]
    pub fn mueller(&self) -> Mueller {
        self.out_of_plane.mueller().after(&Mueller::reflection(self.reflectance)).after(&self.into_plane.mueller())
    }

    /// Linear light (L, Q, U), s3 = 0, after the reflection: the product of the matrices without forming them.
    #[inline]
    #[must_use]
    pub fn apply(&self, light: [f64; 3]) -> [f64; 3] {
        let [l, q, u] = self.into_plane.apply_linear(light);
        // Along the s axis and across it: no cancellation, as in [`crate::trs::MirrorFacet::stokes`].
        let perpendicular = 0.5 * self.reflectance.perpendicular * (l + q);
        let parallel = 0.5 * self.reflectance.parallel * (l - q);
        let s2 = self.reflectance.rr_cos_delta * u;
        self.out_of_plane.apply_linear([perpendicular + parallel, perpendicular - parallel, s2])
    }

    /// The upper left 3 × 3 of [`Self::mueller`].
    #[must_use]
    pub fn linear(&self) -> LinearMueller {
        let columns = [self.apply([1.0, 0.0, 0.0]), self.apply([0.0, 1.0, 0.0]), self.apply([0.0, 0.0, 1.0])];
        let [a, b, c] = columns;
        LinearMueller([[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]])
    }
}

/// A rough surface: index of its facets and their distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    /// Index of the facets.
    pub ior: Ior,
    /// Their distribution.
    pub ggx: Ggx,
}

impl Microfacet {
    /// f_r without Fresnel, D G2/(4 n·ω_i n·ω_o), per steradian; 0 unless both directions are above the surface.
    #[inline]
    #[must_use]
    pub fn factor(&self, wi: DVec3, wo: DVec3, normal: DVec3) -> f64 {
        let (i, o) = (Incidence::between(normal, wi), Incidence::between(normal, wo));
        self.ggx.d(half_vector(wi, wo, normal)) * self.ggx.visibility(i, o)
    }

    /// ∂f_r/∂α of [`Self::factor`].
    #[must_use]
    pub fn factor_by_alpha(&self, wi: DVec3, wo: DVec3, normal: DVec3) -> f64 {
        let (i, o) = (Incidence::between(normal, wi), Incidence::between(normal, wo));
        let h = half_vector(wi, wo, normal);
        self.ggx.d_by_alpha(h) * self.ggx.visibility(i, o) + self.ggx.d(h) * self.ggx.visibility_by_alpha(i, o)
    }

    /// f_r M of eq. 6, 4 × 4, per steradian, from `incident` to `outgoing` frame.
    #[must_use]
    pub fn mueller(&self, wi: DVec3, incident: &Frame, wo: DVec3, outgoing: &Frame, normal: DVec3) -> Mueller {
        let f = self.factor(wi, wo, normal);
        Mueller(Reflection::at_facet(self.ior, wi, incident, wo, outgoing).mueller().0.map(|row| row.map(|m| f * m)))
    }

    /// f_r M of eq. 6 on linear Stokes.
    #[must_use]
    pub fn linear(&self, wi: DVec3, incident: &Frame, wo: DVec3, outgoing: &Frame, normal: DVec3) -> LinearMueller {
        let f = self.factor(wi, wo, normal);
        LinearMueller(
            Reflection::at_facet(self.ior, wi, incident, wo, outgoing).linear().0.map(|row| row.map(|m| f * m)),
        )
    }
}

/// The angle between the half vector of `wi` and `wo` and the normal. Where ω_i = −ω_o there is none: the normal itself
/// stands in (such directions are never both above the surface).
fn half_vector(wi: DVec3, wo: DVec3, normal: DVec3) -> Incidence {
    match crate::frames::direction(wi + wo) {
        Ok(h) => Incidence::between(normal, h),
        Err(_) => Incidence { cosine: 1.0, sine_squared: 0.0 },
    }
}
