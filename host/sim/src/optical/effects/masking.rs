//! Masking and shadowing of facets, G2; left out, every facet that faces both ways is seen: G2 = 1.

use crate::Assessment;
use crate::optical::{EffectSet, OpticalEffect, OpticalFacts};

const COST_NS: f64 = 2.0;
use host_optics::{Incidence, Masking};

/// How facets hide each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Smith(Masking),
    LeftOut,
}

/// What a set of effects makes of a surface's masking.
pub(crate) fn kind(masking: Masking, effects: EffectSet) -> Kind {
    if effects.contains(OpticalEffect::Masking) { Kind::Smith(masking) } else { Kind::LeftOut }
}

impl Kind {
    /// G2/(4 cos θ_i cos θ_o), cosines positive.
    pub(crate) fn visibility(self, alpha: f64, i: Incidence, o: Incidence) -> f64 {
        let slant = |v: Incidence| (v.cosine * v.cosine + alpha * alpha * v.sine_squared).sqrt();
        match self {
            Self::Smith(Masking::HeightCorrelated) => 0.5 / (o.cosine * slant(i) + i.cosine * slant(o)),
            Self::Smith(Masking::Separable) => 1.0 / ((i.cosine + slant(i)) * (o.cosine + slant(o))),
            Self::LeftOut => 0.25 / (i.cosine * o.cosine),
        }
    }
}

/// By rings of slopes, G the least G2 of each: facets of the innermost weigh at most (1 − G)/G more than they did, further ones
/// gain at most 1 − G of their mass times the brightest mirror among them, and those beyond the last ring add at most their whole
/// unmasked tail; of an s0 of at least [`super::least_specular`]. For the best of several last rings.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let bound = facts.worst(|_, _, lobe| {
        if facts.light.sun.is_some() {
            return f64::INFINITY;
        }
        super::worst_band(|k| {
            let least = super::least_specular(lobe, k);
            let (mut inner, mut masked, mut best) = (0.0, 0.0, f64::INFINITY);
            for share in [0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 0.98] {
                let r = share * lobe.reach;
                let g = lobe.least_masking(r);
                // Either as a share of what the ring shows, or as a part of all its mass; 1 + m·t is at most 2.
                let mass = lobe.mass_beyond(inner) - lobe.mass_beyond(r);
                let part = 2.0 * mass * (1.0 - g) * lobe.mirror_range(r, k)[1];
                masked += if inner == 0.0 { (1.0 - g) / g * least } else { part };
                inner = r;
                best = f64::min(best, (masked + lobe.tail(r, k)) / least);
            }
            best
        })
    });
    Assessment::new(bound, COST_NS, "facets hide each other at oblique angles and where slopes are large".into())
}
