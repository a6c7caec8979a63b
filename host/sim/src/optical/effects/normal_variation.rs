//! Normals that differ over a surface; left out, every pixel has its surface's mean normal.

use crate::optical::bounds::MirrorBox;
use crate::optical::{OpticalFacts, SurfaceExtent};
use crate::{Assessment, Effect, EffectSet};
use glam::DVec3;
use host_optics::Ior;

const COST_NS: f64 = 90.0;

/// Normals this close (a chord) are equal but for the rounding of f32 pixels.
const EQUAL: f64 = 1e-6;

/// The normal that stands for all.
pub(crate) fn mean(surface: &SurfaceExtent) -> DVec3 {
    surface.mean_normal
}

/// Of rough surfaces under the sky: with f(ω) the lobe without its Fresnel terms, another normal changes the picture by
/// ∫ (f̄/f − 1) f L R dω, and each component of it by no more than the integral of the modulus, summed over the cells of slope space
/// ([`crate::optical::bounds::Cells`]); the body's part by its own derivatives ([`crate::optical::bounds::Body`]). Nothing cancels in
/// the first: it is of first order in the angle over α even where the truth, under even light, is of second.
///
/// Of a mirror under light without edges and polarization:
/// from the mean normal to a pixel's own is a slope of at most r = tan of their angle, along which each of s0 and √(s1² + s2²)
/// changes by at most r sup |∂F/∂r|, of an s0 of at least ½ R⊥ L at its least. Infinite elsewhere.
pub(crate) fn assess(facts: &OpticalFacts<'_>, on: EffectSet) -> Assessment {
    let widest = facts.shown().map(|(_, e)| e.normal_radius).fold(0.0, f64::max);
    if widest <= EQUAL {
        return Assessment::new(0.0, COST_NS, "every surface has one normal".into());
    }
    let reason = format!("normals up to {:.2} degrees from their mean", widest.to_degrees());
    // A pixel that shows its back would light up.
    let facing = facts.shown().all(|(_, e)| e.hidden == 0);
    let bound = match (facing && facts.light.sun.is_none(), on.contains(Effect::Roughness)) {
        (false, _) => f64::INFINITY,
        (true, true) => rough(facts, on),
        (true, false) => mirror(facts, on),
    };
    Assessment::new(bound, COST_NS, reason)
}

/// With masking and roughness on.
fn rough(facts: &OpticalFacts<'_>, on: EffectSet) -> f64 {
    let mirrors = facts.shown().any(|(s, e)| s.is_mirror() && e.normal_radius > EQUAL);
    if mirrors || !on.contains(Effect::Masking) {
        return f64::INFINITY;
    }
    let diffuse = on.contains(Effect::Diffuse);
    facts.enclosed(|e| {
        let least = e.lobe.least + if diffuse { e.body.least } else { 0.0 };
        let moved = e.lobe.moved + if diffuse { e.body.moved } else { 0.0 };
        if e.moved > 0.0 { moved / least } else { 0.0 }
    })
}

fn mirror(facts: &OpticalFacts<'_>, on: EffectSet) -> f64 {
    let bare = !on.contains(Effect::Diffuse) || facts.shown().all(|(_, e)| e.albedo[1] <= 0.0);
    let unpolarized = !on.contains(Effect::IncidentPolarization) || facts.bounds.max_dolp == 0.0;
    if !(bare && unpolarized) {
        return f64::INFINITY;
    }
    facts.worst(|surface, extent, lobe| {
        let r = 1.02 * extent.normal_radius + EQUAL;
        if r > 0.2 || r > lobe.reach {
            return f64::INFINITY;
        }
        let center = MirrorBox {
            normal: extent.mean_normal,
            normal_radius: 0.0,
            view: extent.mean_view,
            view_radius: extent.view_radius + EQUAL,
        };
        super::worst_band(|k| {
            let Ior::Dielectric(ior) = surface.ior[k] else { return f64::INFINITY };
            let found = center.suprema(&facts.light.radiance[k], ior, r);
            found.map_or(f64::INFINITY, |f| r * f.first / lobe.mirror_range(0.0, k)[0])
        })
    })
}
