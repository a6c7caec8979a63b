//! Fresnel reflection from outside, in the forms that survive f64 and f32 at normal incidence, Brewster and grazing.
//!
//! c = cos θ and s² = sin² θ come in as one [`Incidence`]; q = √(η² − 1 + c²) is formed from (η − 1)(η + 1). The sign of
//! r_p is that of right-handed frames on both sides: r_s r_p < 0 at normal incidence, δ = arg r_p − arg r_s (180° below
//! Brewster, 0° above), fields exp(−iωt) with η = n + ik. Worst error of every form over the whole domain: 16 ulp of
//! itself (of R⊥ for R∥ and the δ terms); docs/NUMERICS.md has each.

use crate::{Conductor, Dielectric, Incidence, Ior, OpticsError};
use protocol_polar::Reflectance;

/// How R⊥ and t of a dielectric change; see [`Dielectric::gradient`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// ∂R⊥/∂η.
    pub perpendicular_by_eta: f64,
    /// ∂t/∂η.
    pub t_by_eta: f64,
    /// ∂R⊥/∂c along the circle c² + s² = 1 (∂/∂θ = −s ∂/∂c).
    pub perpendicular_by_cosine: f64,
    /// ∂t/∂c along the circle c² + s² = 1.
    pub t_by_cosine: f64,
}

impl Dielectric {
    /// r_s = −(η² − 1)/(c + q)², in [−1, 0].
    #[must_use]
    pub fn r_s(self, at: Incidence) -> f64 {
        let e = self.contrast();
        // Without contrast there is no interface, at grazing incidence included (where the form is 0/0).
        if e == 0.0 { 0.0 } else { -e / (at.cosine + self.q(at)).powi(2) }
    }

    /// t = −r_p/r_s = (cq − s²)/(cq + s²), in [−1, 1]: 1 at normal incidence, 0 at the Brewster angle, −1 at grazing.
    #[must_use]
    pub fn t(self, at: Incidence) -> f64 {
        let cq = at.cosine * self.q(at);
        (cq - at.sine_squared) / (cq + at.sine_squared)
    }

    /// R⊥, R∥ = R⊥ t² and √(R⊥R∥) cos δ = −R⊥ t, which crosses zero at Brewster without a square root.
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        let perpendicular = self.r_s(at).powi(2);
        let t = self.t(at);
        Reflectance {
            perpendicular,
            parallel: perpendicular * t * t,
            rr_cos_delta: -perpendicular * t,
            rr_sin_delta: 0.0,
        }
    }

    /// R⊥ − R∥ = 4 R⊥ c q s²/(cq + s²)², accurate relative to itself down to normal incidence.
    #[must_use]
    pub fn difference(self, at: Incidence) -> f64 {
        let cq = at.cosine * self.q(at);
        4.0 * self.r_s(at).powi(2) * cq * at.sine_squared / (cq + at.sine_squared).powi(2)
    }

    /// DoLP (R⊥ − R∥)/(R⊥ + R∥) = 2cqs²/(c²q² + s⁴) of reflected unpolarized light, in [0, 1].
    #[must_use]
    pub fn specular_dolp(self, at: Incidence) -> f64 {
        let cq = at.cosine * self.q(at);
        2.0 * cq * at.sine_squared / (cq * cq + at.sine_squared * at.sine_squared)
    }

    /// Derivatives of R⊥ and t by η and by the cosine:
    /// ∂R⊥/∂η = 4ηc(η² − 1)/(q (c + q)⁴), ∂t/∂η = 2cs²η/(q (cq + s²)²),
    /// ∂R⊥/∂c = −4R⊥/q, ∂t/∂c = 2 (s²(q² + c²) + 2c²q²)/(q (cq + s²)²).
    ///
    /// Finite everywhere; at η = 1 and grazing incidence together (q = 0), where the limit depends on the way there, all
    /// four are 0.
    #[must_use]
    pub fn gradient(self, at: Incidence) -> Gradient {
        let (c, s2, q, e, eta) = (at.cosine, at.sine_squared, self.q(at), self.contrast(), self.eta());
        if q == 0.0 {
            return Gradient {
                perpendicular_by_eta: 0.0,
                t_by_eta: 0.0,
                perpendicular_by_cosine: 0.0,
                t_by_cosine: 0.0,
            };
        }
        let sum_squared = (c + q).powi(2);
        let w = q * (c * q + s2).powi(2);
        Gradient {
            perpendicular_by_eta: 4.0 * eta * (c / q) * e / (sum_squared * sum_squared),
            t_by_eta: 2.0 * c * s2 * eta / w,
            perpendicular_by_cosine: -4.0 * self.r_s(at).powi(2) / q,
            t_by_cosine: 2.0 * (s2 * (q * q + c * c) + 2.0 * (c * q).powi(2)) / w,
        }
    }

    /// Transmittances (T⊥, T∥) into the medium, 4cq/(c + q)² and 4cqη²/(η²c + q)²: 1 − R without its cancellation.
    #[must_use]
    pub fn transmittance(self, at: Incidence) -> [f64; 2] {
        let (c, q, eta2) = (at.cosine, self.q(at), self.eta().powi(2));
        if self.contrast() == 0.0 {
            return [1.0, 1.0];
        }
        [4.0 * c * q / (c + q).powi(2), 4.0 * c * q * eta2 / (eta2 * c + q).powi(2)]
    }

    /// The inverse: η from R⊥ in [0, 1) at one incidence, η = √(s² + c²((1 + ρ)/(1 − ρ))²), ρ = √R⊥.
    ///
    /// # Errors
    /// [`OpticsError::NotADielectric`] if R⊥ is outside [0, 1), the incidence is grazing or worse (c <= 0), or the
    /// index found is beyond 1000.
    pub fn from_perpendicular(reflectance: f64, at: Incidence) -> Result<Self, OpticsError> {
        let refused = OpticsError::NotADielectric { reflectance, cosine: at.cosine };
        if !(0.0..1.0).contains(&reflectance) || at.cosine <= 0.0 {
            return Err(refused);
        }
        let rho = reflectance.sqrt();
        // η − 1 from η² − 1 = c² ((1 + ρ)² − (1 − ρ)²)/(1 − ρ)² = 4ρc²/(1 − ρ)²: exact near η = 1. And 1 − ρ from 1 − R⊥,
        // which keeps all that R⊥ near 1 says at grazing incidence; the root's rounding would drown it.
        let e = 4.0 * rho * (at.cosine * (1.0 + rho) / (1.0 - reflectance)).powi(2);
        Self::new(1.0 + e / (1.0 + (1.0 + e).sqrt())).map_err(|_| refused)
    }

    /// The Brewster angle's cosine and sin²: tan θ = η.
    #[must_use]
    pub fn brewster(self) -> Incidence {
        let eta2 = self.eta().powi(2);
        Incidence { cosine: 1.0 / (1.0 + eta2).sqrt(), sine_squared: eta2 / (1.0 + eta2) }
    }

    /// η² − 1.
    fn contrast(self) -> f64 {
        (self.eta() - 1.0) * (self.eta() + 1.0)
    }

    /// q = η cos θ_t = √(η² − 1 + c²).
    fn q(self, at: Incidence) -> f64 {
        (self.contrast() + at.cosine * at.cosine).sqrt()
    }
}

impl Conductor {
    /// R⊥ = |r_s|², R∥ = R⊥|t|², √(R⊥R∥) cos δ = −R⊥ Re t, √(R⊥R∥) sin δ = −R⊥ Im t.
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        let (re, im) = self.q(at);
        let (c, s2) = (at.cosine, at.sine_squared);
        let perpendicular = self.perpendicular(at);
        // t = (cq − s²)/(cq + s²) with the denominator made real.
        let (a, b) = (c * re, c * im);
        let inverse = 1.0 / ((a + s2).powi(2) + b * b);
        let t_re = ((a - s2) * (a + s2) + b * b) * inverse;
        let t_im = 2.0 * b * s2 * inverse;
        Reflectance {
            perpendicular,
            parallel: perpendicular * ((a - s2).powi(2) + b * b) * inverse,
            rr_cos_delta: -perpendicular * t_re,
            rr_sin_delta: -perpendicular * t_im,
        }
    }

    /// R⊥ − R∥ = 4 R⊥ c Re(q) s²/|cq + s²|².
    #[must_use]
    pub fn difference(self, at: Incidence) -> f64 {
        let (re, im) = self.q(at);
        let (c, s2) = (at.cosine, at.sine_squared);
        4.0 * self.perpendicular(at) * c * re * s2 / ((c * re + s2).powi(2) + (c * im).powi(2))
    }

    /// DoLP 2c Re(q) s²/(c²|q|² + s⁴) of reflected unpolarized light.
    #[must_use]
    pub fn specular_dolp(self, at: Incidence) -> f64 {
        let (re, im) = self.q(at);
        let (c, s2) = (at.cosine, at.sine_squared);
        2.0 * c * re * s2 / (c * c * (re * re + im * im) + s2 * s2)
    }

    /// |r_s|² = |η² − 1|²/|c + q|⁴.
    fn perpendicular(self, at: Incidence) -> f64 {
        let (re, im) = self.q(at);
        let (e_re, e_im) = self.contrast();
        (e_re * e_re + e_im * e_im) / ((at.cosine + re).powi(2) + im * im).powi(2)
    }

    /// η² − 1.
    fn contrast(self) -> (f64, f64) {
        let (n, k) = (self.n(), self.k());
        ((n - 1.0) * (n + 1.0) - k * k, 2.0 * n * k)
    }

    /// q = √(η² − 1 + c²) in the first quadrant: the transmitted wave decays.
    fn q(self, at: Incidence) -> (f64, f64) {
        let (e, im) = self.contrast();
        let re = e + at.cosine * at.cosine;
        let modulus = re.hypot(im);
        // The larger part from a sum, the smaller from the product 2 Re Im: no cancellation in either half plane.
        if re >= 0.0 {
            let x = (0.5 * (modulus + re)).sqrt();
            (x, 0.5 * im / x)
        } else {
            let y = (0.5 * (modulus - re)).sqrt();
            (0.5 * im / y, y)
        }
    }
}

impl Ior {
    /// The reflectance terms of paper eq. 2.
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        match self {
            Self::Dielectric(d) => d.reflectance(at),
            Self::Conductor(c) => c.reflectance(at),
        }
    }

    /// R⊥ − R∥ without cancellation.
    #[must_use]
    pub fn difference(self, at: Incidence) -> f64 {
        match self {
            Self::Dielectric(d) => d.difference(at),
            Self::Conductor(c) => c.difference(at),
        }
    }

    /// DoLP of reflected unpolarized light.
    #[must_use]
    pub fn specular_dolp(self, at: Incidence) -> f64 {
        match self {
            Self::Dielectric(d) => d.specular_dolp(at),
            Self::Conductor(c) => c.specular_dolp(at),
        }
    }
}
