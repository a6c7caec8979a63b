//! Light is polarized before it meets the surface; left out, only its radiance counts and Q and U are never asked for.

use crate::Assessment;
use crate::optical::OpticalFacts;
use core::f64::consts::FRAC_PI_2;
use protocol_polar::{Radians, Reflectance};

const COST_NS: f64 = 15.0;

/// A facet turns L (1, p) into at least L R (1 − P d), R = (R⊥ + R∥)/2 and d <= 1 its degree of polarization, and (0, p) into at
/// most L R P; the same holds of transmission. Sums over facets keep the ratio: P/(1 − P).
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let p = facts.bounds.max_dolp;
    if p == 0.0 {
        return Assessment::new(0.0, COST_NS, "the light is not polarized".into());
    }
    let worst = facts.shown().map(|(surface, extent)| {
        let cosines = extent.cosine.map(|c| host_optics::Incidence::from_angle(Radians(c.clamp(0.0, 1.0).acos())));
        let at = |c| surface.ior.iter().map(move |ior| azimuth_error(p, ior.reflectance(c)).0).fold(0.0, f64::max);
        cosines.map(at).into_iter().fold(0.0, f64::max)
    });
    let degrees = worst.fold(0.0, f64::max).to_degrees();
    let reason =
        format!("light is polarized up to {p:.2}: azimuths of mirror facets would err by {degrees:.1} degrees");
    Assessment::new(super::polarization_share(facts, p), COST_NS, reason)
}

/// The largest error, over all directions of incident polarization, of reading a mirror facet's azimuth off the angle of
/// polarization under light of this degree of polarization:
/// ½ atan(P R⊥|t|/√(((R⊥ − R∥)/2)² − (P (R⊥ + R∥)/2)²)), and 90° once P is no less than the facet's own DoLP.
#[must_use]
pub fn azimuth_error(dolp: f64, r: Reflectance) -> Radians {
    let half = 0.5 * (r.perpendicular - r.parallel);
    let mean = 0.5 * dolp * (r.perpendicular + r.parallel);
    let square = (half - mean) * (half + mean);
    if square <= 0.0 {
        return Radians(FRAC_PI_2);
    }
    Radians(0.5 * (dolp * r.rr_cos_delta.abs()).atan2(square.sqrt()))
}
