//! The functions in 256 bits, in their textbook forms: at that precision cancellation costs nothing that counts.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use host_optics::Incidence;
use std::sync::LazyLock;

pub(super) type Big = FBig<HalfEven, 2>;

const BITS: usize = 256;

static PI: LazyLock<Big> = LazyLock::new(|| Big::pi(BITS));

/// The f64 as it is. What is not finite becomes 0: no point of a domain is.
pub(super) fn big(x: f64) -> Big {
    Big::try_from(x).unwrap_or(Big::ZERO).with_precision(BITS).value()
}

/// |found − exact| in last places of the exact value, or of `scale` where the exact value may vanish.
pub(super) fn ulps(found: f64, exact: &Big, scale: Option<f64>) -> f64 {
    let miss = (big(found) - exact).to_f64().value().abs();
    let of = scale.unwrap_or_else(|| exact.to_f64().value()).abs();
    // The last place of numbers in [2^e, 2^(e + 1)) is 2^(e − 52).
    let last_place = of.next_up() - of;
    if miss > 0.0 { miss / last_place } else { 0.0 }
}

/// Fresnel terms of a dielectric.
pub(super) struct Fresnel {
    pub(super) r_s: Big,
    pub(super) t: Big,
    pub(super) perpendicular: Big,
    pub(super) parallel: Big,
    pub(super) difference: Big,
    pub(super) dolp: Big,
}

impl Fresnel {
    /// q = √(η² − 1 + c²), r_s = (c − q)/(c + q), t = (cq − s²)/(cq + s²).
    pub(super) fn new(eta: f64, at: Incidence) -> Self {
        let (eta, c, s2) = (big(eta), big(at.cosine), big(at.sine_squared));
        let q = (&eta * &eta - big(1.0) + &c * &c).sqrt();
        let r_s = (&c - &q) / (&c + &q);
        let cq = &c * &q;
        let t = (&cq - &s2) / (&cq + &s2);
        let perpendicular = &r_s * &r_s;
        let parallel = &perpendicular * &t * &t;
        let difference = &perpendicular - &parallel;
        let dolp = &difference / (&perpendicular + &parallel);
        Self { r_s, t, perpendicular, parallel, difference, dolp }
    }
}

/// η² = 1 + c² (((1 + ρ)/(1 − ρ))² − 1), ρ = √R⊥.
pub(super) fn inverse(reflectance: f64, at: Incidence) -> Big {
    let (rho, c) = (big(reflectance).sqrt(), big(at.cosine));
    let ratio = (big(1.0) + &rho) / (big(1.0) - &rho);
    (big(1.0) + &c * &c * (&ratio * &ratio - big(1.0))).sqrt()
}

/// D = α²/(π (α²c² + s²)²).
pub(super) fn d(alpha: f64, h: Incidence) -> Big {
    let (a, c, s2) = (big(alpha), big(h.cosine), big(h.sine_squared));
    let a2 = &a * &a;
    let sum = &a2 * &c * &c + s2;
    a2 / (&*PI * &sum * &sum)
}

/// Λ = (√(1 + α² s²/c²) − 1)/2.
pub(super) fn lambda(alpha: f64, v: Incidence) -> Big {
    let (a, c, s2) = (big(alpha), big(v.cosine), big(v.sine_squared));
    ((big(1.0) + &a * &a * s2 / (&c * &c)).sqrt() - big(1.0)) / big(2.0)
}

/// 1/(1 + Σ Λ): G1 of one Λ, the height-correlated G2 of two.
pub(super) fn masking(lambdas: &[Big]) -> Big {
    big(1.0) / lambdas.iter().fold(big(1.0), |sum, lambda| sum + lambda)
}

/// p − σ² (1 − exp(−p²/σ²))/(2p).
pub(super) fn mas(p: f64, sigma: f64) -> Big {
    let (p, sigma) = (big(p), big(sigma));
    let (p2, sigma2) = (&p * &p, &sigma * &sigma);
    let x = &p2 / &sigma2;
    // Beyond 256 bits of nothing.
    let tail = if x > big(200.0) { big(0.0) } else { (-x).exp() };
    &p - sigma2 * (big(1.0) - tail) / (big(2.0) * &p)
}
