//! Fresnel reflection from outside, in the forms that survive f64 and f32 at normal incidence, Brewster and grazing.
//!
//! c = cos θ and s² = sin² θ come in as one [`Incidence`], a cosine below 0 counts as 0; q = √(η² − 1 + c²). The sign of
//! r_p is that of right-handed frames on both sides: r_s r_p < 0 at normal incidence, δ = arg r_p − arg r_s (180° below
//! Brewster, 0° above), fields exp(−iωt) with η = n + ik.
//!
//! R⊥ = (η² − 1)²/(c + q)⁴ takes the roundings of c + q four times. So (c + q)² is not squared but summed: it equals
//! 4c² + (η² − 1) + 2c (q − c), and q − c = (η² − 1)/(c + q) keeps its digits where it is small. Worst error of every
//! function over the whole domain: 8 ulp of itself (of R⊥ for R∥ and the δ terms); docs/NUMERICS.md has each.

use crate::{Conductor, Dielectric, Incidence, Ior, OpticsError, Real};
use protocol_polar::Reflectance;

/// How R⊥ and t of a dielectric change; see [`Dielectric::gradient`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient<T = f64> {
    /// ∂R⊥/∂η.
    pub perpendicular_by_eta: T,
    /// ∂t/∂η.
    pub t_by_eta: T,
    /// ∂R⊥/∂c along the circle c² + s² = 1 (∂/∂θ = −s ∂/∂c).
    pub perpendicular_by_cosine: T,
    /// ∂t/∂c along the circle c² + s² = 1.
    pub t_by_cosine: T,
}

impl Dielectric {
    /// R⊥, R∥ and √(R⊥R∥) cos δ of [`Self::terms`] as the entries of paper eq. 2.
    #[inline]
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        let [perpendicular, parallel, rr_cos_delta] = self.terms(at);
        Reflectance { perpendicular, parallel, rr_cos_delta, rr_sin_delta: 0.0 }
    }
}

impl<T: Real> Dielectric<T> {
    /// r_s = −(η² − 1)/(c + q)², in [−1, 0]; without contrast there is no interface, at grazing incidence included.
    #[inline]
    #[must_use]
    pub fn r_s(self, at: Incidence<T>) -> T {
        -Refracted::new(self, at).reflected()
    }

    /// t = −r_p/r_s = (cq − s²)/(cq + s²), in [−1, 1]: 1 at normal incidence, 0 at the Brewster angle, −1 at grazing.
    #[inline]
    #[must_use]
    pub fn t(self, at: Incidence<T>) -> T {
        Refracted::new(self, at).t()
    }

    /// \[R⊥, R∥, √(R⊥R∥) cos δ\] with R∥ = R⊥ t² and √(R⊥R∥) cos δ = −R⊥ t, which crosses zero at Brewster without a
    /// square root.
    #[inline]
    #[must_use]
    pub fn terms(self, at: Incidence<T>) -> [T; 3] {
        let refracted = Refracted::new(self, at);
        let (r, m) = (refracted.reflected(), refracted.smaller_share());
        // |r_p| = r |t| = r (1 − 2m). Their product first: it lets compilers divide for both at once.
        let rm = r * m;
        let r_p = (r - T::TWO * rm).with_sign(refracted.cq - refracted.s2);
        [r.squared(), r_p.squared(), -(r * r_p)]
    }

    /// R⊥ − R∥ = 4 R⊥ c q s²/(cq + s²)², accurate relative to itself down to normal incidence.
    #[inline]
    #[must_use]
    pub fn difference(self, at: Incidence<T>) -> T {
        let refracted = Refracted::new(self, at);
        let m = refracted.smaller_share();
        T::FOUR * refracted.reflected().squared() * (m - m * m)
    }

    /// DoLP (R⊥ − R∥)/(R⊥ + R∥) = 2cqs²/(c²q² + s⁴) of reflected unpolarized light, in [0, 1].
    #[inline]
    #[must_use]
    pub fn specular_dolp(self, at: Incidence<T>) -> T {
        let Refracted { cq, s2, .. } = Refracted::new(self, at);
        (T::TWO * cq * s2).over(cq * cq + s2 * s2)
    }

    /// Derivatives of R⊥ and t by η and by the cosine:
    /// ∂R⊥/∂η = 4ηc(η² − 1)/(q (c + q)⁴), ∂t/∂η = 2cs²η/(q (cq + s²)²),
    /// ∂R⊥/∂c = −4R⊥/q, ∂t/∂c = 2 (s²(q² + c²) + 2c²q²)/(q (cq + s²)²).
    ///
    /// Finite everywhere; at η = 1 and grazing incidence together (q = 0), where the limit depends on the way there, all
    /// four are 0.
    #[inline]
    #[must_use]
    pub fn gradient(self, at: Incidence<T>) -> Gradient<T> {
        let eta = self.eta();
        let refracted = Refracted::new(self, at);
        let (r, m) = (refracted.reflected(), refracted.smaller_share());
        let Refracted { e, c, s2, q, cq, sum_squared } = refracted;
        let (c2, b) = (c * c, cq + s2);
        // r/(q (c + q)²), with which R⊥/q is (η² − 1) times this.
        let slope = T::FOUR * r.over(q * sum_squared);
        Gradient {
            perpendicular_by_eta: eta * c * slope,
            // 2 cqs²/b² · η/q², the first factor with the two shares of b and the second with q² as it was before its root.
            t_by_eta: T::TWO * (m - m * m) * eta.over(e + c2),
            perpendicular_by_cosine: -e * slope,
            t_by_cosine: (T::TWO * (s2 * (q * q + c2) + T::TWO * (cq * cq))).over(q * (b * b)),
        }
    }

    /// Transmittances (T⊥, T∥) into the medium, 4cq/(c + q)² and 4cqη²/(η²c + q)²: 1 − R without its cancellation.
    #[inline]
    #[must_use]
    pub fn transmittance(self, at: Incidence<T>) -> [T; 2] {
        let Refracted { e, c, q, cq, sum_squared, .. } = Refracted::new(self, at);
        if e <= T::ZERO {
            return [T::ONE, T::ONE];
        }
        let eta = self.eta();
        [T::FOUR * cq / sum_squared, T::FOUR * cq * (eta / (eta * eta * c + q)).squared()]
    }

    /// The inverse: η from R⊥ in [0, 1) at one incidence, η = √(s² + c²((1 + ρ)/(1 − ρ))²), ρ = √R⊥.
    ///
    /// # Errors
    /// [`OpticsError::NotADielectric`] if R⊥ is outside [0, 1), the incidence is grazing or worse (c <= 0), or the
    /// index found is beyond 1000.
    #[inline]
    pub fn from_perpendicular(reflectance: T, at: Incidence<T>) -> Result<Self, OpticsError> {
        let refused = OpticsError::NotADielectric { reflectance: reflectance.into(), cosine: at.cosine.into() };
        if !(T::ZERO..T::ONE).contains(&reflectance) || at.cosine <= T::ZERO {
            return Err(refused);
        }
        let rho = reflectance.sqrt();
        // η − 1 from η² − 1 = c² ((1 + ρ)² − (1 − ρ)²)/(1 − ρ)² = 4ρc²/(1 − ρ)²: exact near η = 1. And 1 − ρ from 1 − R⊥,
        // which keeps all that R⊥ near 1 says at grazing incidence; the root's rounding would drown it.
        let e = T::FOUR * rho * (at.cosine * (T::ONE + rho) / (T::ONE - reflectance)).squared();
        Self::found(T::ONE + e / (T::ONE + (T::ONE + e).sqrt())).ok_or(refused)
    }

    /// The Brewster angle's cosine and sin²: tan θ = η.
    #[inline]
    #[must_use]
    pub fn brewster(self) -> Incidence<T> {
        let eta2 = self.eta().squared();
        Incidence { cosine: T::ONE / (T::ONE + eta2).sqrt(), sine_squared: eta2 / (T::ONE + eta2) }
    }

    /// η² − 1, from η − 1 where that is exact.
    #[inline]
    fn contrast(self) -> T {
        let eta = self.eta();
        let d = eta - T::ONE;
        if eta < T::TWO { T::TWO * d + d * d } else { eta * eta - T::ONE }
    }
}

/// What the functions of a dielectric share at one incidence.
#[derive(Clone, Copy)]
struct Refracted<T> {
    /// η² − 1.
    e: T,
    /// cos θ, not below 0.
    c: T,
    /// sin² θ.
    s2: T,
    /// η cos θ_t = √(η² − 1 + c²).
    q: T,
    cq: T,
    /// (c + q)².
    sum_squared: T,
}

impl<T: Real> Refracted<T> {
    #[inline]
    fn new(interface: Dielectric<T>, at: Incidence<T>) -> Self {
        let (e, c, s2) = (interface.contrast(), at.cosine.at_least(T::ZERO), at.sine_squared);
        let c2 = c * c;
        let root = (e + c2).sqrt();
        // q − c, of which c takes the larger part of the root's rounding away.
        let excess = e.over(c + root);
        let q = if excess < c { c + excess } else { root };
        Self { e, c, s2, q, cq: c * q, sum_squared: T::FOUR * c2 + (e + T::TWO * c * excess) }
    }

    /// |r_s|.
    #[inline]
    fn reflected(&self) -> T {
        self.e.over(self.sum_squared)
    }

    /// The share in [0, ½] of the smaller of cq and s² in their sum.
    #[inline]
    fn smaller_share(&self) -> T {
        self.cq.at_most(self.s2).over(self.cq + self.s2)
    }

    /// t as 1 minus twice the smaller share: at both ends as 1 minus what is small.
    #[inline]
    fn t(&self) -> T {
        (T::ONE - T::TWO * self.smaller_share()).with_sign(self.cq - self.s2)
    }
}

impl Conductor {
    /// R⊥ = |r_s|², R∥ = R⊥|t|², √(R⊥R∥) cos δ = −R⊥ Re t, √(R⊥R∥) sin δ = −R⊥ Im t.
    #[inline]
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        let [perpendicular, parallel, rr_cos_delta, rr_sin_delta] = self.terms(at);
        Reflectance { perpendicular, parallel, rr_cos_delta, rr_sin_delta }
    }
}

impl<T: Real> Conductor<T> {
    /// \[R⊥, R∥, √(R⊥R∥) cos δ, √(R⊥R∥) sin δ\], as [`Conductor::reflectance`].
    #[inline]
    #[must_use]
    pub fn terms(self, at: Incidence<T>) -> [T; 4] {
        let wave = Absorbed::new(self, at);
        let perpendicular = wave.perpendicular(norm);
        // t = (cq − s²)/(cq + s²) with the denominator made real.
        let (q, correction, s2) = (wave.q, wave.correction, wave.s2);
        let (a, b) = (wave.c * (q.0 + correction.0), wave.c * (q.1 + correction.1));
        let share = perpendicular.over(wave.even + wave.cross);
        // R∥ as R⊥ minus what it lacks, unless too little is left.
        let lost = T::TWO * wave.cross;
        let parallel = if T::TWO * lost < wave.even + wave.cross {
            perpendicular - share * lost
        } else {
            share * ((a - s2).squared() + b * b)
        };
        let cos_delta = share * (wave.c2 * wave.modulus - s2 * s2);
        [perpendicular, parallel, -cos_delta, -(share * (T::TWO * (b * s2)))]
    }

    /// R⊥ − R∥ = 4 R⊥ c Re(q) s²/|cq + s²|².
    #[inline]
    #[must_use]
    pub fn difference(self, at: Incidence<T>) -> T {
        let wave = Absorbed::new(self, at);
        // cq and |cq + s²|² rounded once each: with the roundings of the terms this would not stay within 8 ulp.
        let (c, s2, q, correction) = (wave.c, wave.s2, wave.q, wave.correction);
        let ((a, a_low), (b, b_low)) = (c.product(q.0), c.product(q.1));
        let (a_low, b_low) = (a_low + c * correction.0, b_low + c * correction.1);
        let (sum, sum_low) = a.sum(s2);
        let denominator = norm_rounded_once((sum, sum_low + a_low), (b, b_low));
        let (product, low) = a.product(s2);
        wave.perpendicular(norm_rounded_once) * (T::FOUR * (product + (low + a_low * s2))).over(denominator)
    }

    /// DoLP 2c Re(q) s²/(c²|q|² + s⁴) of reflected unpolarized light.
    #[inline]
    #[must_use]
    pub fn specular_dolp(self, at: Incidence<T>) -> T {
        let wave = Absorbed::new(self, at);
        wave.cross.over(wave.even)
    }
}

/// What the functions of a conductor share at one incidence.
struct Absorbed<T> {
    c: T,
    c2: T,
    s2: T,
    /// η² − 1.
    e: (T, T),
    /// q = √(η² − 1 + c²) in the first quadrant: the transmitted wave decays.
    q: (T, T),
    /// What is missing from q.
    correction: (T, T),
    /// |q|².
    modulus: T,
    /// c²|q|² + s⁴; |cq ± s²|² is this ± `cross`.
    even: T,
    /// 2 c Re(q) s².
    cross: T,
}

impl<T: Real> Absorbed<T> {
    #[inline]
    fn new(interface: Conductor<T>, at: Incidence<T>) -> Self {
        let (n, k, c, s2) = (interface.n(), interface.k(), at.cosine.at_least(T::ZERO), at.sine_squared);
        // Near the critical angle of n < 1 the squares cancel to nothing but 2nk: they are summed with their rounding errors.
        let ((n2, n2_low), (k2, k2_low), (c2, c2_low)) = (n.product(n), k.product(k), c.product(c));
        let (first, first_low) = n2.sum(-T::ONE);
        let (second, second_low) = first.sum(-k2);
        let low = first_low + second_low + (n2_low - k2_low);
        let (third, third_low) = second.sum(c2);
        let (real, real_low) = third.sum(third_low + (low + c2_low));
        let (imaginary, imaginary_low) = (T::TWO * n).product(k);
        // Where the squares underflow the larger part is all there is.
        let larger = real.at_least(-real).at_least(imaginary);
        let modulus = (real * real + imaginary * imaginary).sqrt().at_least(larger);
        // The larger part from a sum, the smaller from the product 2 Re Im: no cancellation in either half plane.
        let (re, im) = if real >= T::ZERO {
            let x = (T::HALF * (modulus + real)).sqrt();
            (x, (T::HALF * imaginary).over(x))
        } else {
            let y = (T::HALF * (modulus - real)).sqrt();
            ((T::HALF * imaginary).over(y), y)
        };
        // One step of Newton's takes their roundings off: q += (q² as it should be − q²)/(2q).
        let ((a2, a2_low), (b2, b2_low), (ab, ab_low)) = (re.product(re), im.product(im), re.product(im));
        let off_re = ((real - a2) + b2) + (real_low - a2_low + b2_low);
        let off_im = (imaginary - T::TWO * ab) + (imaginary_low - T::TWO * ab_low);
        let step = T::HALF.over(modulus);
        let correction = (step * (off_re * re + off_im * im), step * (off_im * re - off_re * im));
        let cross = T::TWO * (c * (re + correction.0)) * s2;
        Self {
            c,
            c2,
            s2,
            e: (second + low, imaginary),
            q: (re, im),
            correction,
            modulus,
            even: c2 * modulus + s2 * s2,
            cross,
        }
    }

    /// |r_s|² = |q − c|²/|q + c|²: from 1 − R⊥ = 4c Re(q)/|q + c|² if that is small, and from |η² − 1|²/|(c + q)²|², with the
    /// square as for a dielectric, if q − c has nothing left.
    #[inline]
    fn perpendicular(&self, norm: impl Fn((T, T), (T, T)) -> T) -> T {
        let Self { c, c2, e: (e_re, e_im), q: (re, im), correction, .. } = *self;
        let ((sum, sum_low), (rest, rest_low)) = (c.sum(re), c.sum(-re));
        let (sum_low, rest_low) = (sum_low + correction.0, rest_low - correction.0);
        let sum_squared = norm((sum, sum_low), (im, correction.1));
        let transmitted = T::FOUR * (c * (re + correction.0));
        if T::TWO * transmitted < sum_squared {
            return T::ONE - transmitted / sum_squared;
        }
        let difference_squared = norm((rest, rest_low), (im, correction.1));
        if difference_squared > T::LITTLE * sum_squared {
            return difference_squared / sum_squared;
        }
        let (sum_re, sum_im) = (sum + sum_low, im + correction.1);
        let excess_re = (e_re * sum_re + e_im * sum_im).over(sum_squared);
        let excess_im = (e_im * sum_re - e_re * sum_im).over(sum_squared);
        let (x, y) = (T::FOUR * c2 + (e_re + T::TWO * c * excess_re), e_im + T::TWO * c * excess_im);
        (e_re * e_re + e_im * e_im).over(x * x + y * y)
    }
}

/// x² + y² of numbers with what is missing from them.
#[inline]
fn norm<T: Real>(x: (T, T), y: (T, T)) -> T {
    (x.0 + x.1).squared() + (y.0 + y.1).squared()
}

/// The same, to first order in what is missing, rounded once.
#[inline]
fn norm_rounded_once<T: Real>(x: (T, T), y: (T, T)) -> T {
    let ((x2, x2_low), (y2, y2_low)) = (x.0.product(x.0), y.0.product(y.0));
    let (sum, low) = x2.sum(y2);
    sum + (low + (x2_low + y2_low + T::TWO * (x.0 * x.1 + y.0 * y.1)))
}

impl Ior {
    /// The reflectance terms of paper eq. 2.
    #[inline]
    #[must_use]
    pub fn reflectance(self, at: Incidence) -> Reflectance {
        match self {
            Self::Dielectric(d) => d.reflectance(at),
            Self::Conductor(c) => c.reflectance(at),
        }
    }

    /// R⊥ − R∥ without cancellation.
    #[inline]
    #[must_use]
    pub fn difference(self, at: Incidence) -> f64 {
        match self {
            Self::Dielectric(d) => d.difference(at),
            Self::Conductor(c) => c.difference(at),
        }
    }

    /// DoLP of reflected unpolarized light.
    #[inline]
    #[must_use]
    pub fn specular_dolp(self, at: Incidence) -> f64 {
        match self {
            Self::Dielectric(d) => d.specular_dolp(at),
            Self::Conductor(c) => c.specular_dolp(at),
        }
    }
}
