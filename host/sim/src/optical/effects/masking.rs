//! Masking and shadowing of facets, G2; left out, every facet that faces both ways is seen: G2 = 1.

use crate::Assessment;
use crate::optical::{OpticalFacts, Sun, Surface, SurfaceExtent};

const COST_NS: f64 = 2.0;
use host_optics::{Incidence, Masking};

/// In each direction of light G2 = 1 becomes of G2, so that a share (1 − G2)/G2 = Λ_i + Λ_o of it (height-correlated) is added; summed over the
/// cells of slope space ([`crate::optical::bounds::Cells`]) of an s0 that has the body's part as well. Of the sun, in its one direction.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let sky = facts.enclosed(|e| e.share(e.lobe.masked));
    let of_sun = facts.light.sun.map_or(0.0, |sun| facts.worst(|surface, extent, _| sun_share(&sun, surface, extent)));
    Assessment::new(
        sky.max(of_sun),
        COST_NS,
        "facets hide each other at oblique angles and where slopes are large".into(),
    )
}

/// 1/G2 − 1 at most, for light from anywhere in the sun's disk.
fn sun_share(sun: &Sun, surface: &Surface, extent: &SurfaceExtent) -> f64 {
    let Some(cosine) = super::sun_cosine(sun, extent).filter(|_| !surface.is_mirror()) else {
        return if surface.is_mirror() { 0.0 } else { f64::INFINITY };
    };
    let lambda = |c: f64| surface.ggx.lambda(Incidence { cosine: c, sine_squared: (1.0 - c) * (1.0 + c) });
    let (i, o) = (lambda(cosine), lambda((extent.cosine[0] - 1e-6).max(0.0)));
    match surface.ggx.masking() {
        Masking::HeightCorrelated => i + o,
        Masking::Separable => (1.0 + i) * (1.0 + o) - 1.0,
    }
}
