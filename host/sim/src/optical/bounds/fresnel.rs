//! Reflectance over an interval of angles of incidence.

use super::Interval;
use host_optics::{Incidence, Ior};

/// The interface of one band.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fresnel {
    ior: Ior,
    /// cos of Brewster's angle, where R∥ of a dielectric vanishes.
    brewster: Option<f64>,
}

/// Over the interval, for light of radiance 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// s0, of light whose polarization is up to a degree and may have any direction.
    pub(crate) power: Interval,
    /// R⊥ − R∥.
    pub(crate) difference: Interval,
}

impl Fresnel {
    pub(crate) fn new(ior: Ior) -> Self {
        let brewster = if let Ior::Dielectric(d) = ior { Some(d.brewster().cosine) } else { None };
        Self { ior, brewster }
    }

    /// R⊥ grows with θ; R∥ falls to one minimum, at Brewster's angle 0, and grows from there. Of a metal only 0 is known of it. Light of
    /// degree of polarization P reflects between ½ ((1 − P) R⊥ + (1 + P) R∥) and ½ ((1 + P) R⊥ + (1 − P) R∥), where R⊥ >= R∥.
    pub(crate) fn range(&self, cosine: Interval, dolp: f64) -> Seen {
        let at = |c: f64| self.ior.reflectance(Incidence { cosine: c, sine_squared: (1.0 - c) * (1.0 + c) });
        let (oblique, steep) = (at(cosine.low), at(cosine.high));
        let perpendicular = Interval::new(steep.perpendicular, oblique.perpendicular);
        let least = match self.brewster {
            Some(zero) if zero < cosine.low || zero > cosine.high => steep.parallel.min(oblique.parallel),
            _ => 0.0,
        };
        let parallel = Interval::new(least, steep.parallel.max(oblique.parallel));
        let mixed = |s: f64, p: f64, dolp: f64| 0.5 * ((1.0 + dolp) * s + (1.0 - dolp) * p);
        let power = Interval::new(
            mixed(perpendicular.low, parallel.low, -dolp),
            mixed(perpendicular.high, parallel.high, dolp),
        );
        let difference = perpendicular - parallel;
        Seen { power, difference: Interval::new(difference.low.max(0.0), difference.high) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_what_is_between_their_ends() {
        for ior in [Ior::new(1.5, 0.0).unwrap(), Ior::new(0.2, 3.4).unwrap(), Ior::new(2.9, 3.0).unwrap()] {
            let fresnel = Fresnel::new(ior);
            for k in 0..40 {
                let (low, high) = (f64::from(k) / 41.0, f64::from(k + 2) / 41.0);
                let seen = fresnel.range(Interval::new(low, high), 0.3);
                for j in 0..=20 {
                    let c = low + (high - low) * f64::from(j) / 20.0;
                    let r = ior.reflectance(Incidence { cosine: c, sine_squared: 1.0 - c * c });
                    let (mean, half) = (0.5 * (r.perpendicular + r.parallel), 0.5 * (r.perpendicular - r.parallel));
                    for power in [mean - 0.3 * half, mean, mean + 0.3 * half] {
                        assert!(power >= seen.power.low - 1e-12 && power <= seen.power.high + 1e-12, "{ior:?} {c}");
                    }
                    assert!(2.0 * half >= seen.difference.low - 1e-12 && 2.0 * half <= seen.difference.high + 1e-12);
                }
            }
        }
    }
}
