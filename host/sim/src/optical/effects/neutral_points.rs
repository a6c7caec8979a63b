//! Neutral points of the sky; left out, Berry's pattern is replaced by Rayleigh's of the same sun and P_max.

use crate::optical::{OpticalFacts, SkyPattern};
use crate::{Assessment, Effect, EffectSet};

const COST_NS: f64 = 2.0;

/// The pattern a set of effects leaves.
pub(crate) fn pattern(pattern: Option<SkyPattern>, effects: EffectSet) -> Option<SkyPattern> {
    match pattern {
        Some(SkyPattern::Berry { sun, max_dolp, .. }) if !effects.contains(Effect::NeutralPoints) => {
            Some(SkyPattern::Rayleigh { sun, max_dolp })
        }
        other => other,
    }
}

/// With W of [`host_optics::sky::Berry`], W_Berry − W_Rayleigh = −4 (ζ² − 1)²/((1 + |ζ|²)² (A + 1/A)²), whose modulus is at most
/// 4/(A + 1/A)² = sin²(splitting/2). The step from W to the degree of polarization, W/(2 − |W|), stretches at most twofold. So
/// (Q, U)/L moves by Δp <= 2 P_max sin²(splitting/2), which every reflection and transmission carries on to at most Δp of what
/// it makes of L; and what it makes of L is at most s0/(1 − P_max).
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let Some(SkyPattern::Berry { splitting_deg, max_dolp, .. }) = facts.light.pattern else {
        return Assessment::new(0.0, COST_NS, "the sky has no Babinet, Brewster, Arago or fourth point".into());
    };
    let moved = 2.0 * max_dolp * (0.5 * splitting_deg.to_radians()).sin().powi(2);
    let reason = format!("(Q, U)/L moves by at most {moved:.3} for a splitting of {splitting_deg} degrees");
    Assessment::new(super::polarization_share(facts, moved), COST_NS, reason)
}
