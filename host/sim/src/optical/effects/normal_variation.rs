//! Normals that differ over a surface; left out, every pixel has its surface's mean normal.

use crate::Assessment;
use crate::optical::bounds::MirrorBox;
use crate::optical::{EffectSet, OpticalEffect, OpticalFacts, SurfaceExtent};
use glam::DVec3;
use host_optics::Ior;

const COST_NS: f64 = 90.0;

/// Normals this close (a chord) are equal but for the rounding of f32 pixels.
const EQUAL: f64 = 1e-6;

/// The normal that stands for all.
pub(crate) fn mean(surface: &SurfaceExtent) -> DVec3 {
    surface.mean_normal
}

/// No bound is proved for rough or diffuse surfaces: infinite there. Of a mirror under light without edges and polarization:
/// from the mean normal to a pixel's own is a slope of at most r = tan of their angle, along which each of s0 and √(s1² + s2²)
/// changes by at most r sup |∂F/∂r|, of an s0 of at least ½ R⊥ L at its least.
pub(crate) fn assess(facts: &OpticalFacts<'_>, on: EffectSet) -> Assessment {
    let widest = facts.shown().map(|(_, e)| e.normal_radius).fold(0.0, f64::max);
    if widest <= EQUAL {
        return Assessment::new(0.0, COST_NS, "every surface has one normal".into());
    }
    let reason = format!("normals up to {:.2} degrees from their mean", widest.to_degrees());
    let mirror = !on.contains(OpticalEffect::Roughness) && facts.light.sun.is_none();
    let bare = !on.contains(OpticalEffect::Diffuse) || facts.shown().all(|(_, e)| e.albedo[1] <= 0.0);
    let unpolarized = !on.contains(OpticalEffect::IncidentPolarization) || facts.bounds.max_dolp == 0.0;
    // A pixel that shows its back would light up.
    let facing = facts.shown().all(|(_, e)| e.hidden == 0);
    if !(mirror && bare && unpolarized && facing) {
        return Assessment::new(f64::INFINITY, COST_NS, reason);
    }
    let bound = facts.worst(|surface, extent, lobe| {
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
    });
    Assessment::new(bound, COST_NS, reason)
}
