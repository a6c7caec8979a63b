//! 256 bits: at that precision cancellation costs nothing that counts; and what a function's type makes of its arguments.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use host_optics::{Conductor, Dielectric, Ggx, Incidence, Masking, Real};
use protocol_polar::Radians;
use std::sync::LazyLock;

pub(super) type Big = FBig<HalfEven, 2>;

const BITS: usize = 256;

pub(super) static PI: LazyLock<Big> = LazyLock::new(|| Big::pi(BITS));

/// The number as it is. What is not finite becomes 0: no point of a domain is.
pub(super) fn big(x: impl Into<f64>) -> Big {
    Big::try_from(x.into()).unwrap_or(Big::ZERO).with_precision(BITS).value()
}

/// A type of the functions, and the last place of its numbers.
pub(super) trait Precision: Real {
    /// Least η − 1 of the domain.
    const LEAST_CONTRAST: f64;

    /// The interface, in this type.
    fn dielectric(eta: f64) -> Option<Dielectric<Self>>;

    /// The interface, in this type.
    fn conductor(n: f64, k: f64) -> Option<Conductor<Self>>;

    /// The surface, in this type.
    fn surface(alpha: f64, masking: Masking) -> Option<Ggx<Self>>;

    /// (cos θ, sin² θ), in this type.
    fn incidence(theta: Radians) -> Incidence<Self>;

    /// Distance from |x|, rounded to this type, to the next larger number: 2^(e − 52) or 2^(e − 23) in [2^e, 2^(e + 1)).
    fn last_place(x: f64) -> f64;
}

impl Precision for f64 {
    const LEAST_CONTRAST: f64 = 1e-15;

    fn dielectric(eta: f64) -> Option<Dielectric> {
        Dielectric::new(eta).ok()
    }

    fn conductor(n: f64, k: f64) -> Option<Conductor> {
        Conductor::new(n, k).ok()
    }

    fn surface(alpha: f64, masking: Masking) -> Option<Ggx> {
        Ggx::new(alpha, masking).ok()
    }

    fn incidence(theta: Radians) -> Incidence {
        Incidence::from_angle(theta)
    }

    fn last_place(x: f64) -> f64 {
        x.abs().next_up() - x.abs()
    }
}

impl Precision for f32 {
    const LEAST_CONTRAST: f64 = 1e-6;

    fn dielectric(eta: f64) -> Option<Dielectric<Self>> {
        Dielectric::new(eta).ok().map(Dielectric::single)
    }

    fn conductor(n: f64, k: f64) -> Option<Conductor<Self>> {
        Conductor::new(n, k).ok().map(Conductor::single)
    }

    fn surface(alpha: f64, masking: Masking) -> Option<Ggx<Self>> {
        Ggx::new(alpha, masking).ok().map(|ggx| ggx.single())
    }

    fn incidence(theta: Radians) -> Incidence<Self> {
        Incidence::from_angle(theta).single()
    }

    #[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is meant")]
    fn last_place(x: f64) -> f64 {
        let x = x.abs() as Self;
        f64::from(x.next_up()) - f64::from(x)
    }
}

/// |found − exact| in last places of `scale`, which is the exact value itself unless that may vanish.
pub(super) fn ulps<T: Precision>(found: T, exact: &Big, scale: &Big) -> f64 {
    let miss = (big(found) - exact).to_f64().value().abs();
    let last_place = T::last_place(scale.to_f64().value());
    if miss > 0.0 { miss / last_place } else { 0.0 }
}

/// p − σ² (1 − exp(−p²/σ²))/(2p).
pub(super) fn mas(p: Big, sigma: Big) -> Big {
    let (p2, sigma2) = (&p * &p, &sigma * &sigma);
    let x = &p2 / &sigma2;
    // Beyond 256 bits of nothing.
    let tail = if x > big(200.0) { big(0.0) } else { (-x).exp() };
    &p - sigma2 * (big(1.0) - tail) / (big(2.0) * &p)
}
