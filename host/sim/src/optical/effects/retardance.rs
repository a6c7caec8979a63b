//! Retardance of metals: δ = arg r_p − arg r_s away from 180°. Left out, δ stays 180° at every angle, and light polarized
//! diagonally to the plane of incidence is mirrored without the part that turns elliptical.

use crate::Assessment;
use crate::optical::OpticalFacts;
use host_optics::Ior;

const COST_NS: f64 = 1.0;

/// Only diagonal light is touched: |Δ(s1, s2)| <= √(R⊥R∥) (1 + cos δ) P L <= 2 R P L, of an s0 of at least R L (1 − P).
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let metal = facts.shown().any(|(s, _)| s.ior.iter().any(|ior| matches!(ior, Ior::Conductor(_))));
    let p = facts.bounds.max_dolp;
    let (bound, reason) = match (metal, p > 0.0) {
        (false, _) => (0.0, "no surface is a metal".into()),
        (true, false) => (0.0, "a metal's phase does not show in unpolarized light".into()),
        (true, true) => (super::share(2.0 * p, p), format!("light polarized up to {p:.2} on a metal")),
    };
    Assessment::new(bound, COST_NS, reason)
}
