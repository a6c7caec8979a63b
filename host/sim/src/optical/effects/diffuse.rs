//! Light that enters the body and comes out again; left out, the surface only reflects.

use crate::Assessment;
use crate::optical::bounds::Lobe;
use crate::optical::{OpticalFacts, Surface, SurfaceExtent};

const COST_NS: f64 = 45.0;

/// The diffuse part is at most D = ρ_d sup L (and E_sun/π ρ_d), the specular part at least S: left out, at most D/(S + D) is
/// missing.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let albedo = facts.shown().map(|(_, e)| e.albedo[1]).fold(0.0, f64::max);
    if albedo <= 0.0 {
        return Assessment::new(0.0, COST_NS, "nothing has a diffuse albedo".into());
    }
    let bound = facts.worst(|surface, extent, lobe| share(facts, surface, extent, lobe));
    Assessment::new(bound, COST_NS, format!("diffuse albedo up to {albedo:.3}"))
}

/// Largest share of the diffuse part in s0.
pub(crate) fn share(facts: &OpticalFacts<'_>, _: &Surface, extent: &SurfaceExtent, lobe: &Lobe<'_>) -> f64 {
    let sun = facts.light.sun.map_or([0.0; 3], |s| s.radiance.map(|l| l * s.angular_radius_rad.sin().powi(2)));
    // A polarized sky passes an interface by up to 1 + P more.
    let p = facts.bounds.max_dolp;
    super::worst_band(|k| {
        let most = extent.albedo[1] * (facts.bounds.range[k][1] * (1.0 + p) + sun[k]);
        if most == 0.0 { 0.0 } else { most / (most + super::least_specular(lobe, k)) }
    })
}
