//! The weight of a direction of light in the specular part of eq. 6, f_r (n·ω_i) = D G2/(4 n·ω_o) without Fresnel, and how it
//! changes with α and the normal while ω_i stays where it is.
//!
//! The half vector depends on ω_i and ω_o alone, so that α and the normal enter through D and G2 only. The surface's own
//! horizon moves with the normal, but the weight is 0 there: no boundary term.

use glam::DVec3;
use host_optics::{Ggx, Incidence, Masking};

/// The lobe of one normal towards one view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    pub(super) ggx: Ggx,
    pub(super) normal: DVec3,
    pub(super) wo: DVec3,
}

/// The weight of one direction, per steradian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weight {
    pub(super) value: f64,
    pub(super) by_alpha: f64,
    /// Gradient by the normal; only its part across the normal has a meaning.
    pub(super) by_normal: DVec3,
}

impl Lobe {
    /// `None` for directions below the surface.
    pub(super) fn weight(&self, wi: DVec3) -> Option<Weight> {
        let (i, o) = (Incidence::between(self.normal, wi), Incidence::between(self.normal, self.wo));
        if i.cosine <= 0.0 || o.cosine <= 0.0 {
            return None;
        }
        let half = (wi + self.wo).normalize();
        let h = Incidence::between(self.normal, half);
        let (d, v) = (self.ggx.d(h), self.ggx.visibility(i, o));
        let (d_by_alpha, v_by_alpha) = (self.ggx.d_by_alpha(h), self.ggx.visibility_by_alpha(i, o));
        let alpha_squared = self.ggx.alpha().powi(2);
        let rest = 1.0 - alpha_squared;
        // ln D = −2 ln(1 − c_h² (1 − α²)) + const.
        let ln_d_by_h = 4.0 * h.cosine * rest / (alpha_squared * h.cosine * h.cosine + h.sine_squared);
        // r = √(α² + c² (1 − α²)), ∂r/∂c = c (1 − α²)/r; see `Ggx::visibility`.
        let slant = |at: Incidence| (at.cosine * at.cosine + alpha_squared * at.sine_squared).sqrt();
        let (ri, ro) = (slant(i), slant(o));
        let (ri_by_c, ro_by_c) = (i.cosine * rest / ri, o.cosine * rest / ro);
        let (ln_v_by_i, ln_v_by_o) = match self.ggx.masking() {
            Masking::HeightCorrelated => (-2.0 * v * (o.cosine * ri_by_c + ro), -2.0 * v * (ri + i.cosine * ro_by_c)),
            Masking::Separable => (-(1.0 + ri_by_c) / (i.cosine + ri), -(1.0 + ro_by_c) / (o.cosine + ro)),
        };
        let value = d * v * i.cosine;
        Some(Weight {
            value,
            by_alpha: (d_by_alpha * v + d * v_by_alpha) * i.cosine,
            by_normal: half * (value * ln_d_by_h) + wi * (d * v + value * ln_v_by_i) + self.wo * (value * ln_v_by_o),
        })
    }
}
