//! How a point of the unit cube becomes arguments, in the type of the function under test.
//!
//! θ: a quarter each down to 1e-9, even up to 90°, down to 1e-6 from 90°, and down to one ulp on both sides of the interface's
//! own angle (Brewster's, the critical one of a metal with n < 1). η: half of it as 1 + 1e-15 to 2 (f32: 1 + 1e-6), half
//! logarithmic to 1000. α: 1e-5 to 1, logarithmic. n: .05 to 10, logarithmic. k: half of it even up to 10, half logarithmic
//! from 1e-6.

use super::exact::Precision;
use host_optics::{Conductor, Dielectric, Ggx, Incidence, Masking};
use protocol_polar::Radians;
use std::f64::consts::FRAC_PI_2;

pub(super) fn dielectric<T: Precision>([eta, theta, _]: [f64; 3]) -> Option<(Dielectric<T>, Incidence<T>)> {
    let (dielectric, own_angle) = (T::dielectric(index::<T>(eta))?, index::<T>(eta).atan());
    Some((dielectric, T::incidence(Radians(angle(theta, Some(own_angle))))))
}

pub(super) fn conductor<T: Precision>([n, theta, k]: [f64; 3]) -> Option<(Conductor<T>, Incidence<T>)> {
    let (n, k) = (real_part(n), imaginary_part(k));
    Some((T::conductor(n, k)?, T::incidence(Radians(angle(theta, Some(own_angle(n)))))))
}

pub(super) fn surface<T: Precision>(
    [alpha, i, o]: [f64; 3],
    masking: Masking,
) -> Option<(Ggx<T>, Incidence<T>, Incidence<T>)> {
    let at = |u: f64| T::incidence(Radians(angle(u, None)));
    Some((T::surface(roughness(alpha), masking)?, at(i), at(o)))
}

pub(super) fn measured([dolp, ratio, _]: [f64; 3]) -> (f64, f64) {
    let dolp = between(1e-9, 1.0, dolp);
    (dolp, dolp / between(1e-8, 100.0, ratio))
}

/// The arguments in words.
pub(super) fn dielectric_words<T: Precision>([eta, theta, _]: [f64; 3]) -> String {
    let eta = index::<T>(eta);
    format!("η = {eta:?}, {}", angle_words(angle(theta, Some(eta.atan()))))
}

pub(super) fn conductor_words([n, theta, k]: [f64; 3]) -> String {
    let (n, k) = (real_part(n), imaginary_part(k));
    format!("η = {n:?} + {k:?}i, {}", angle_words(angle(theta, Some(own_angle(n)))))
}

pub(super) fn surface_words([alpha, i, _]: [f64; 3]) -> String {
    format!("α = {:e}, {}", roughness(alpha), angle_words(angle(i, None)))
}

pub(super) fn two_angle_words(p: [f64; 3]) -> String {
    format!("{}; {}", surface_words(p), angle_words(angle(p[2], None)))
}

pub(super) fn measured_words(p: [f64; 3]) -> String {
    let (dolp, sigma) = measured(p);
    format!("p = {dolp:e}, σ = {sigma:e}")
}

fn index<T: Precision>(u: f64) -> f64 {
    let least = T::LEAST_CONTRAST;
    if u < 0.5 { 1.0 + between(least, 1.0, 2.0 * u) } else { between(1.0 + least, 1e3, 2.0 * u - 1.0) }
}

fn real_part(u: f64) -> f64 {
    between(0.05, 10.0, u)
}

fn imaginary_part(u: f64) -> f64 {
    if u < 0.5 { (20.0 * u).max(1e-6) } else { between(1e-6, 10.0, 2.0 * u - 1.0) }
}

fn own_angle(n: f64) -> f64 {
    if n < 1.0 { n.asin() } else { n.atan() }
}

fn roughness(u: f64) -> f64 {
    between(1e-5, 1.0, u)
}

/// Radians. Without an angle of its own the fourth quarter is even like the second.
fn angle(u: f64, own: Option<f64>) -> f64 {
    let (quarter, v) = ((4.0 * u).floor(), (4.0 * u).fract());
    if u <= 0.0 {
        0.0
    } else if quarter < 1.0 {
        between(1e-9, 1.0, v)
    } else if quarter < 2.0 {
        (FRAC_PI_2 - 1e-6) * v
    } else if quarter < 3.0 {
        FRAC_PI_2 - between(1e-6, 1.0, v)
    } else if let Some(own) = own {
        let side = if v < 0.5 { -1.0 } else { 1.0 };
        let off = between(f64::EPSILON, 0.1, (2.0 * v).fract());
        (own * (1.0 + side * off)).min(FRAC_PI_2 - 1e-6)
    } else {
        (FRAC_PI_2 - 1e-6) * v
    }
}

/// Logarithmic from `low` to `high`, both reached.
fn between(low: f64, high: f64, u: f64) -> f64 {
    (low * (high / low).powf(u)).clamp(low, high)
}

fn angle_words(theta: f64) -> String {
    let rest = FRAC_PI_2 - theta;
    if rest < 0.01 { format!("θ = 90° − {rest:e} rad") } else { format!("θ = {theta:e} rad") }
}
