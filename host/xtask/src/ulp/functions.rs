//! The functions with their domains: how a point of the unit cube becomes arguments.
//!
//! θ: a quarter each down to 1e-9, even up to 90°, down to 1e-6 from 90°, and down to one ulp on both sides of Brewster. η: half
//! of it as 1 + 1e-15 to 2, half logarithmic to 1000. α: 1e-5 to 1, logarithmic.

use super::exact::{self, Fresnel, ulps};
use host_fit::mas;
use host_optics::{Dielectric, Ggx, Incidence, Masking};
use protocol_polar::Radians;
use std::f64::consts::FRAC_PI_2;

/// A function under test.
pub(super) struct Function {
    pub(super) name: &'static str,
    pub(super) domain: &'static str,
    /// Last places of what.
    pub(super) unit: &'static str,
    /// Most last places allowed.
    pub(super) bound: f64,
    /// The error at a point of the unit cube; `None` where the function refuses, as it should.
    pub(super) error: fn([f64; 3]) -> Option<f64>,
    /// The arguments of a point, in words.
    pub(super) place: fn([f64; 3]) -> String,
}

/// What is demanded.
const BOUND: f64 = 8.0;
/// What products with R⊥ = e²/(c + q)⁴ take: the fourth power of a sum with 3.5 roundings in it has 14, besides its own. An
/// η² − 1 and c² in twice the precision would bring them below [`BOUND`]; no use of them asks for it.
const POWERS: f64 = 16.0;

const FRESNEL: &str = "η 1 + 1e-15 … 1000, θ 0 … 90° − 1e-6 rad";
const LOBE: &str = "α 1e-5 … 1, θ 0 … 90° − 1e-6 rad";

pub(super) const FUNCTIONS: [Function; 13] = [
    fresnel("r_s", "itself", BOUND, |p| at_interface(p, |d, at, x| ulps(d.r_s(at), &x.r_s, None))),
    fresnel("t = −r_p/r_s", "1", BOUND, |p| at_interface(p, |d, at, x| ulps(d.t(at), &x.t, Some(1.0)))),
    fresnel("R⊥", "itself", POWERS, |p| {
        at_interface(p, |d, at, x| ulps(d.reflectance(at).perpendicular, &x.perpendicular, None))
    }),
    fresnel("R∥", "R⊥", POWERS, |p| {
        at_interface(p, |d, at, x| {
            let r = d.reflectance(at);
            ulps(r.parallel, &x.parallel, Some(r.perpendicular))
        })
    }),
    fresnel("√(R⊥R∥) cos δ", "R⊥", POWERS, |p| {
        at_interface(p, |d, at, x| {
            let r = d.reflectance(at);
            ulps(r.rr_cos_delta, &(-(&x.perpendicular * &x.t)), Some(r.perpendicular))
        })
    }),
    fresnel("R⊥ − R∥", "itself", POWERS, |p| {
        at_interface(p, |d, at, x| ulps(d.difference(at), &x.difference, None))
    }),
    fresnel("DoLP", "itself", BOUND, |p| at_interface(p, |d, at, x| ulps(d.specular_dolp(at), &x.dolp, None))),
    fresnel("η from R⊥", "itself", BOUND, |p| {
        let (dielectric, at) = interface(p)?;
        let reflectance = dielectric.reflectance(at).perpendicular;
        let found = Dielectric::from_perpendicular(reflectance, at).ok()?;
        Some(ulps(found.eta(), &exact::inverse(reflectance, at), None))
    }),
    lobe("GGX D", |p| {
        let (ggx, at) = facets(p)?;
        Some(ulps(ggx.d(at), &exact::d(ggx.alpha(), at), None))
    }),
    lobe("Smith Λ", |p| {
        let (ggx, at) = facets(p)?;
        Some(ulps(ggx.lambda(at), &exact::lambda(ggx.alpha(), at), None))
    }),
    lobe("G1", |p| {
        let (ggx, at) = facets(p)?;
        Some(ulps(ggx.g1(at), &exact::masking(&[exact::lambda(ggx.alpha(), at)]), None))
    }),
    lobe("G2, height-correlated", |p| {
        let (ggx, i) = facets(p)?;
        let o = incidence(p[2], None);
        let exact = exact::masking(&[exact::lambda(ggx.alpha(), i), exact::lambda(ggx.alpha(), o)]);
        Some(ulps(ggx.g2(i, o), &exact, None))
    }),
    Function {
        name: "DoLP without bias (MAS)",
        domain: "p 1e-9 … 1, p/σ 1e-8 … 100",
        unit: "itself",
        bound: BOUND,
        error: |p| {
            let (dolp, sigma) = measured(p);
            Some(ulps(mas(dolp, sigma), &exact::mas(dolp, sigma), None))
        },
        place: |p| {
            let (dolp, sigma) = measured(p);
            format!("p = {dolp:e}, σ = {sigma:e}")
        },
    },
];

const fn fresnel(name: &'static str, unit: &'static str, bound: f64, error: fn([f64; 3]) -> Option<f64>) -> Function {
    let place = |p: [f64; 3]| format!("η = {:?}, {}", index(p[0]), angle_words(angle(p[1], Some(index(p[0])))));
    Function { name, domain: FRESNEL, unit, bound, error, place }
}

const fn lobe(name: &'static str, error: fn([f64; 3]) -> Option<f64>) -> Function {
    let place = |p: [f64; 3]| format!("α = {:e}, {}", roughness(p[0]), angle_words(angle(p[1], None)));
    Function { name, domain: LOBE, unit: "itself", bound: BOUND, error, place }
}

fn at_interface(p: [f64; 3], error: impl Fn(Dielectric, Incidence, &Fresnel) -> f64) -> Option<f64> {
    let (dielectric, at) = interface(p)?;
    Some(error(dielectric, at, &Fresnel::new(dielectric.eta(), at)))
}

fn interface([eta, theta, _]: [f64; 3]) -> Option<(Dielectric, Incidence)> {
    let dielectric = Dielectric::new(index(eta)).ok()?;
    Some((dielectric, incidence(theta, Some(dielectric.eta()))))
}

fn facets([alpha, theta, _]: [f64; 3]) -> Option<(Ggx, Incidence)> {
    Some((Ggx::new(roughness(alpha), Masking::HeightCorrelated).ok()?, incidence(theta, None)))
}

fn measured([dolp, ratio, _]: [f64; 3]) -> (f64, f64) {
    let dolp = between(1e-9, 1.0, dolp);
    (dolp, dolp / between(1e-8, 100.0, ratio))
}

fn incidence(u: f64, brewster_of: Option<f64>) -> Incidence {
    Incidence::from_angle(Radians(angle(u, brewster_of)))
}

fn index(u: f64) -> f64 {
    if u < 0.5 { 1.0 + between(1e-15, 1.0, 2.0 * u) } else { between(1.0 + 1e-15, 1e3, 2.0 * u - 1.0) }
}

fn roughness(u: f64) -> f64 {
    between(1e-5, 1.0, u)
}

/// Radians. Without an interface the fourth quarter is even like the second.
fn angle(u: f64, brewster_of: Option<f64>) -> f64 {
    let (quarter, v) = ((4.0 * u).floor(), (4.0 * u).fract());
    if u <= 0.0 {
        0.0
    } else if quarter < 1.0 {
        between(1e-9, 1.0, v)
    } else if quarter < 2.0 {
        (FRAC_PI_2 - 1e-6) * v
    } else if quarter < 3.0 {
        FRAC_PI_2 - between(1e-6, 1.0, v)
    } else if let Some(eta) = brewster_of {
        let side = if v < 0.5 { -1.0 } else { 1.0 };
        let off = between(f64::EPSILON, 0.1, (2.0 * v).fract());
        (eta.atan() * (1.0 + side * off)).min(FRAC_PI_2 - 1e-6)
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
