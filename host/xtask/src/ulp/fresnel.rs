//! Every function of an interface, as it is computed and in its textbook form.

use super::domain::{conductor, dielectric};
use super::exact::{Big, Precision, big, ulps};
use host_optics::{Dielectric, Incidence};

/// A function of a dielectric.
#[derive(Clone, Copy)]
pub(super) enum Term {
    Rs,
    T,
    Perpendicular,
    Parallel,
    CosDelta,
    Difference,
    Dolp,
    PerpendicularByEta,
    TByEta,
    PerpendicularByCosine,
    TByCosine,
    TransmittedPerpendicular,
    TransmittedParallel,
    Inverse,
    BrewsterCosine,
    BrewsterSine,
}

/// A function of a conductor.
#[derive(Clone, Copy)]
pub(super) enum Metal {
    Perpendicular,
    Parallel,
    CosDelta,
    SinDelta,
    Difference,
    Dolp,
}

/// The error of a function of a dielectric; `None` where it refuses, as it should.
pub(super) fn of_dielectric<T: Precision>(term: Term, p: [f64; 3]) -> Option<f64> {
    let (interface, at) = dielectric::<T>(p)?;
    let x = Exact::new(interface.eta(), at);
    let itself = |found: T, exact: Big| Some(ulps(found, &exact, &exact));
    match term {
        Term::Rs => itself(interface.r_s(at), x.r_s()),
        Term::T => Some(ulps(interface.t(at), &x.t(), &big(1.0))),
        Term::Perpendicular => itself(interface.terms(at)[0], x.perpendicular()),
        Term::Parallel => Some(ulps(interface.terms(at)[1], &(x.perpendicular() * x.t() * x.t()), &x.perpendicular())),
        Term::CosDelta => Some(ulps(interface.terms(at)[2], &-(x.perpendicular() * x.t()), &x.perpendicular())),
        Term::Difference => itself(interface.difference(at), x.perpendicular() * (big(1.0) - x.t() * x.t())),
        Term::Dolp => {
            let t2 = x.t() * x.t();
            itself(interface.specular_dolp(at), (big(1.0) - &t2) / (big(1.0) + &t2))
        }
        // From the forms before any simplification: ∂q/∂η = η/q, ∂q/∂c = c/q, ∂s²/∂c = −2c.
        Term::PerpendicularByEta => {
            itself(interface.gradient(at).perpendicular_by_eta, x.perpendicular_slope(&x.eta, None))
        }
        Term::TByEta => itself(interface.gradient(at).t_by_eta, x.t_slope(&x.eta, None)),
        Term::PerpendicularByCosine => {
            itself(interface.gradient(at).perpendicular_by_cosine, x.perpendicular_slope(&x.c, Some(big(1.0))))
        }
        Term::TByCosine => itself(interface.gradient(at).t_by_cosine, x.t_slope(&x.c, Some(big(1.0)))),
        Term::TransmittedPerpendicular => itself(interface.transmittance(at)[0], big(1.0) - x.perpendicular()),
        // 1 − r_p², r_p = (η²c − q)/(η²c + q): with c and s² as two numbers t is not the same function of them.
        Term::TransmittedParallel => {
            let e2c = &x.eta * &x.eta * &x.c;
            let r_p = (&e2c - &x.q) / (&e2c + &x.q);
            itself(interface.transmittance(at)[1], big(1.0) - &r_p * &r_p)
        }
        Term::Inverse => {
            let reflectance = interface.terms(at)[0];
            let found = Dielectric::from_perpendicular(reflectance, at).ok()?;
            itself(found.eta(), inverse(reflectance, at))
        }
        Term::BrewsterCosine => itself(interface.brewster().cosine, big(1.0) / (big(1.0) + &x.eta * &x.eta).sqrt()),
        Term::BrewsterSine => {
            let eta2 = &x.eta * &x.eta;
            itself(interface.brewster().sine_squared, &eta2 / (big(1.0) + &eta2))
        }
    }
}

struct Exact {
    eta: Big,
    c: Big,
    s2: Big,
    q: Big,
}

impl Exact {
    /// q = √(η² − 1 + c²).
    fn new<T: Precision>(eta: T, at: Incidence<T>) -> Self {
        let (eta, c, s2) = (big(eta), big(at.cosine), big(at.sine_squared));
        let q = (&eta * &eta - big(1.0) + &c * &c).sqrt();
        Self { eta, c, s2, q }
    }

    /// (c − q)/(c + q).
    fn r_s(&self) -> Big {
        (&self.c - &self.q) / (&self.c + &self.q)
    }

    /// (cq − s²)/(cq + s²).
    fn t(&self) -> Big {
        let cq = &self.c * &self.q;
        (&cq - &self.s2) / (&cq + &self.s2)
    }

    fn perpendicular(&self) -> Big {
        self.r_s() * self.r_s()
    }

    /// ∂R⊥ = 2 r_s ∂r_s for ∂q = `toward`/q and ∂c as given.
    fn perpendicular_slope(&self, toward: &Big, dc: Option<Big>) -> Big {
        let (dq, dc) = (toward / &self.q, dc.unwrap_or(Big::ZERO));
        let sum = &self.c + &self.q;
        let slope = ((&dc - &dq) * &sum - (&self.c - &self.q) * (&dc + &dq)) / (&sum * &sum);
        big(2.0) * self.r_s() * slope
    }

    /// ∂t for ∂q = `toward`/q, ∂c as given and ∂s² = −2c ∂c.
    fn t_slope(&self, toward: &Big, dc: Option<Big>) -> Big {
        let (dq, dc) = (toward / &self.q, dc.unwrap_or(Big::ZERO));
        let cq = &self.c * &self.q;
        let (dcq, ds2) = (&dc * &self.q + &self.c * &dq, big(-2.0) * &self.c * &dc);
        let sum = &cq + &self.s2;
        ((&dcq - &ds2) * &sum - (&cq - &self.s2) * (&dcq + &ds2)) / (&sum * &sum)
    }
}

/// η² = 1 + c² (((1 + ρ)/(1 − ρ))² − 1), ρ = √R⊥.
fn inverse<T: Precision>(reflectance: T, at: Incidence<T>) -> Big {
    let (rho, c) = (big(reflectance).sqrt(), big(at.cosine));
    let ratio = (big(1.0) + &rho) / (big(1.0) - &rho);
    (big(1.0) + &c * &c * (&ratio * &ratio - big(1.0))).sqrt()
}

/// The error of a function of a conductor. q and t are written out in real and imaginary parts.
pub(super) fn of_conductor<T: Precision>(term: Metal, p: [f64; 3]) -> Option<f64> {
    let (interface, at) = conductor::<T>(p)?;
    let (n, k, c, s2) = (big(interface.n()), big(interface.k()), big(at.cosine), big(at.sine_squared));
    let (re, im) = (&n * &n - &k * &k - big(1.0) + &c * &c, big(2.0) * &n * &k);
    let modulus = (&re * &re + &im * &im).sqrt();
    let a = ((&modulus + &re) / big(2.0)).sqrt();
    let b = &im / (big(2.0) * &a);
    let square = |x: Big| &x * &x;
    let b2 = square(b.clone());
    let perpendicular = (square(&c - &a) + &b2) / (square(&c + &a) + &b2);
    let (ca, cb) = (&c * &a, &c * &b);
    let cb2 = square(cb.clone());
    let below = square(&ca + &s2) + &cb2;
    let parallel = &perpendicular * (square(&ca - &s2) + &cb2) / &below;
    let itself = |found: T, exact: Big| Some(ulps(found, &exact, &exact));
    let of_perpendicular = |found: T, exact: Big| Some(ulps(found, &exact, &perpendicular));
    match term {
        Metal::Perpendicular => itself(interface.terms(at)[0], perpendicular.clone()),
        Metal::Parallel => of_perpendicular(interface.terms(at)[1], parallel),
        Metal::CosDelta => {
            let exact = -(&perpendicular * (square(ca) + cb2 - square(s2)) / below);
            of_perpendicular(interface.terms(at)[2], exact)
        }
        Metal::SinDelta => of_perpendicular(interface.terms(at)[3], big(-2.0) * &perpendicular * cb * s2 / below),
        Metal::Difference => itself(interface.difference(at), big(4.0) * &perpendicular * ca * s2 / below),
        Metal::Dolp => {
            let exact = big(2.0) * &ca * &s2 / (square(ca) + cb2 + square(s2));
            itself(interface.specular_dolp(at), exact)
        }
    }
}
