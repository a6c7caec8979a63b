//! The GGX microfacet distribution (Walter 2007, Heitz 2014): D, Smith Λ, G1, G2, visible-normal sampling, and their
//! derivatives by α.
//!
//! Angles come as [`Incidence`] against the mean normal, so that D = α²/(π (α²c² + s²)²) and Λ hold to a few ulp down to
//! α = 1e-6. The limit α → 0 is the mirror: D cos θ_h tends to a delta at the normal, Λ to 0, a sampled facet to the
//! normal itself; [`crate::integral::mirror`] is that limit in closed form.
//!
//! For unit vectors α²c² + s² >= α². Lower bounds of half of that, and of [`Real::TINY`] for products of cosines, do nothing
//! to them and keep what is made of other vectors finite.

use crate::real::single;
use crate::{Incidence, OpticsError, Real};
use core::f64::consts::TAU;
use glam::DVec3;

/// Smallest roughness: below it the lobe (0.1 mrad at 1e-4 already) is a mirror to any camera.
pub const MIN_ALPHA: f64 = 1e-6;

/// How masking of ω_o and shadowing of ω_i combine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Masking {
    /// G2 = 1/(1 + Λ_i + Λ_o), height-correlated (Heitz 2014, eq. 99).
    #[default]
    HeightCorrelated,
    /// G2 = G1(ω_i) G1(ω_o) (Walter 2007; Mitsuba).
    Separable,
}

/// An isotropic GGX surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx<T = f64> {
    alpha: T,
    masking: Masking,
}

impl Ggx {
    /// Roughness α in [1e-6, 1].
    ///
    /// # Errors
    /// [`OpticsError::Roughness`] outside it.
    pub fn new(alpha: f64, masking: Masking) -> Result<Self, OpticsError> {
        if (MIN_ALPHA..=1.0).contains(&alpha) {
            Ok(Self { alpha, masking })
        } else {
            Err(OpticsError::Roughness(alpha))
        }
    }

    /// The same surface with α rounded to f32, for lanes.
    #[must_use]
    pub fn single(&self) -> Ggx<f32> {
        Ggx { alpha: single(self.alpha), masking: self.masking }
    }

    /// A facet normal visible from `wo`, both in the local frame (mean normal +z, `wo.z > 0`), for (u1, u2) in [0, 1)².
    ///
    /// Density: [`Ggx::visible_density`]. Smooth in α and `wo` for fixed (u1, u2). Spherical caps: Dupuy and Benyoub
    /// 2023, "Sampling Visible GGX Normals with Spherical Caps", listing 3, with sin² and z + w_z rewritten so that
    /// α → 0 and grazing views lose no digits.
    #[must_use]
    pub fn sample_visible(&self, wo: DVec3, [u1, u2]: [f64; 2]) -> DVec3 {
        let w = DVec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let height = (1.0 - u2) * (1.0 + w.z);
        // The cap point has z = height − w_z; 1 − z = u2 (1 + w_z) and 1 + z = height + (1 − w_z).
        let below = (w.x * w.x + w.y * w.y) / (1.0 + w.z);
        let sine = (u2 * (1.0 + w.z) * (height + below)).sqrt();
        let (sin_phi, cos_phi) = (TAU * u1).sin_cos();
        let h = DVec3::new(self.alpha * (sine * cos_phi + w.x), self.alpha * (sine * sin_phi + w.y), height);
        // height = 0 only at the very rim of the cap (u2 → 1): a vertical facet.
        h.try_normalize().unwrap_or(DVec3::Z)
    }
}

impl<T: Real> Ggx<T> {
    /// α.
    #[inline]
    #[must_use]
    pub fn alpha(&self) -> T {
        self.alpha
    }

    /// How masking and shadowing combine.
    #[inline]
    #[must_use]
    pub fn masking(&self) -> Masking {
        self.masking
    }

    /// D(h), per steradian; 0 for facets that look down. ∫ D cos θ_h dω = 1.
    #[inline]
    #[must_use]
    pub fn d(&self, h: Incidence<T>) -> T {
        if h.cosine <= T::ZERO {
            return T::ZERO;
        }
        T::FRAC_1_PI * (T::ONE / self.spread(h)).squared()
    }

    /// ∂D/∂α = 2α (s² − α²c²)/(π (α²c² + s²)³).
    #[inline]
    #[must_use]
    pub fn d_by_alpha(&self, h: Incidence<T>) -> T {
        if h.cosine <= T::ZERO {
            return T::ZERO;
        }
        let spread = self.spread(h);
        let root = T::ONE / spread;
        // (s² − α²c²)/(s² + α²c²), at both ends as 1 minus what is small.
        let (narrow, wide) = (self.alpha * (h.cosine * h.cosine), h.sine_squared / self.alpha);
        let m = narrow.at_most(wide) / spread;
        let ratio = if m > T::HALF * T::HALF {
            (wide - narrow) / spread
        } else if wide < narrow {
            T::TWO * m - T::ONE
        } else {
            T::ONE - T::TWO * m
        };
        T::TWO * T::FRAC_1_PI * (root * root) * ratio / self.alpha
    }

    /// Smith Λ = x/(2 (1 + √(1 + x))), x = α² tan² θ; infinite at and below the horizon.
    #[inline]
    #[must_use]
    pub fn lambda(&self, v: Incidence<T>) -> T {
        if v.cosine <= T::ZERO {
            return T::INFINITY;
        }
        // With r = √(c² + α²s²): Λ = α²s²/(2c (c + r)), free of tan².
        T::HALF * self.alpha * self.alpha * v.sine_squared / (v.cosine * (v.cosine + self.slant(v))).at_least(T::TINY)
    }

    /// ∂Λ/∂α = α s²/(2c √(c² + α²s²)).
    #[inline]
    #[must_use]
    pub fn lambda_by_alpha(&self, v: Incidence<T>) -> T {
        if v.cosine <= T::ZERO {
            return T::ZERO;
        }
        T::HALF * self.alpha * v.sine_squared / (v.cosine * self.slant(v)).at_least(T::TINY)
    }

    /// G1 = 1/(1 + Λ), in [0, 1].
    #[inline]
    #[must_use]
    pub fn g1(&self, v: Incidence<T>) -> T {
        if v.cosine <= T::ZERO { T::ZERO } else { T::TWO * v.cosine / (v.cosine + self.slant(v)) }
    }

    /// G2 in [0, 1]; 0 if either direction is at or below the horizon.
    #[inline]
    #[must_use]
    pub fn g2(&self, i: Incidence<T>, o: Incidence<T>) -> T {
        if i.cosine <= T::ZERO || o.cosine <= T::ZERO {
            return T::ZERO;
        }
        match self.masking {
            Masking::HeightCorrelated => T::ONE / (T::ONE + self.lambda(i) + self.lambda(o)),
            Masking::Separable => self.g1(i) * self.g1(o),
        }
    }

    /// G2/(4 cos θ_i cos θ_o), which stays finite where the cosines vanish: with r = √(c² + α²s²),
    /// 1/(2 (c_o r_i + c_i r_o)) height-correlated, 1/((c_i + r_i)(c_o + r_o)) separable.
    #[inline]
    #[must_use]
    pub fn visibility(&self, i: Incidence<T>, o: Incidence<T>) -> T {
        if i.cosine <= T::ZERO || o.cosine <= T::ZERO {
            return T::ZERO;
        }
        let (ri, ro) = (self.slant(i), self.slant(o));
        match self.masking {
            Masking::HeightCorrelated => T::HALF / (o.cosine * ri + i.cosine * ro).at_least(T::TINY),
            Masking::Separable => T::ONE / ((i.cosine + ri) * (o.cosine + ro)),
        }
    }

    /// ∂/∂α of [`Self::visibility`].
    #[inline]
    #[must_use]
    pub fn visibility_by_alpha(&self, i: Incidence<T>, o: Incidence<T>) -> T {
        if i.cosine <= T::ZERO || o.cosine <= T::ZERO {
            return T::ZERO;
        }
        let (wi, wo) = (self.slant_squared(i), self.slant_squared(o));
        let (ri, ro) = (wi.sqrt(), wo.sqrt());
        // ∂r/∂α = α s²/r.
        let (ai, ao) = (self.alpha * i.sine_squared, self.alpha * o.sine_squared);
        match self.masking {
            Masking::HeightCorrelated => {
                let (a, b) = (o.cosine * ri, i.cosine * ro);
                let sum = (a + b).at_least(T::TINY);
                -T::HALF * ((a * (ai / wi) + b * (ao / wo)) / sum) / sum
            }
            Masking::Separable => {
                let (a, b) = (i.cosine + ri, o.cosine + ro);
                -(ai / (ri * a) + ao / (ro * b)) / (a * b)
            }
        }
    }

    /// Density per steradian of h of [`Ggx::sample_visible`]: G1(ω_o) D(h) (ω_o·h)/(n·ω_o). For ω_i mirrored at h divide
    /// by 4 (ω_o·h).
    #[inline]
    #[must_use]
    pub fn visible_density(&self, o: Incidence<T>, h: Incidence<T>, o_dot_h: T) -> T {
        if o.cosine <= T::ZERO {
            return T::ZERO;
        }
        // G1/c = 2/(c + r) has no pole at grazing.
        T::TWO * self.d(h) * o_dot_h.at_least(T::ZERO) / (o.cosine + self.slant(o))
    }

    /// G2/G1(ω_o), the weight f_r (n·ω_i)/density of a sampled visible normal, in [0, 1]; finite at grazing ω_o.
    #[inline]
    #[must_use]
    pub fn visible_weight(&self, i: Incidence<T>, o: Incidence<T>) -> T {
        T::TWO * i.cosine * (o.cosine + self.slant(o)) * self.visibility(i, o)
    }

    /// αc² + s²/α = 1/√(πD), which has fewer roundings than α²c² + s².
    #[inline]
    fn spread(&self, h: Incidence<T>) -> T {
        (self.alpha * (h.cosine * h.cosine) + h.sine_squared / self.alpha).at_least(T::HALF * self.alpha)
    }

    /// r = √(c² + α²s²) = c (1 + 2Λ).
    #[inline]
    fn slant(&self, v: Incidence<T>) -> T {
        (v.cosine * v.cosine + self.alpha * self.alpha * v.sine_squared).sqrt().at_least(T::HALF * self.alpha)
    }

    /// r² rounded once, for derivatives: they divide by r three times.
    #[inline]
    fn slant_squared(&self, v: Incidence<T>) -> T {
        let (c2, c2_low) = v.cosine.product(v.cosine);
        let (a2, a2_low) = self.alpha.product(self.alpha);
        let (t2, t2_low) = a2.product(v.sine_squared);
        let (sum, low) = c2.sum(t2);
        (sum + (low + (c2_low + (t2_low + a2_low * v.sine_squared)))).at_least((T::HALF * self.alpha).squared())
    }
}
