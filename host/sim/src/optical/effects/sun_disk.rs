//! The sun's disk; left out, all of its power comes from its center.

use crate::Assessment;
use crate::optical::light::SunPoints;
use crate::optical::{EffectSet, OpticalEffect, OpticalFacts, Sun, Surface, SurfaceExtent};
use host_optics::{Ior, OpticsError, frames};

const COST_NS: f64 = 5.0;

/// Directions that stand for the sun, none without a sun. Both choices carry the same irradiance to a plane that sees the
/// whole disk: a point of solid angle π sin² r.
pub(crate) fn points(sun: Option<&Sun>, effects: EffectSet) -> Result<SunPoints, OpticsError> {
    let Some(sun) = sun else { return Ok(SunPoints::default()) };
    let disk = sun.disk()?;
    let points = if effects.contains(OpticalEffect::SunDisk) {
        disk.points()
    } else {
        let solid_angle = core::f64::consts::PI * sun.angular_radius_rad.sin().powi(2);
        vec![(frames::direction(sun.direction)?, solid_angle)]
    };
    Ok(SunPoints { points, disk: Some(disk), radiance: sun.radiance })
}

/// Over a disk of radius ρ every factor of the lobe changes by at most a known exponent against its center:
/// - D: |d ln D/dθ_h| <= 2/α, and h turns by at most ρ/(2 cos θ_d);
/// - G2 (n·ω_i) and the transmittance, log-derivatives by n·ω_i of at most 1/c_i and 2/c_i: three times ln(c_i/(c_i − ρ));
/// - R⊥: |d ln R⊥/dθ| <= 4/√(η² − 1), θ_d turns by at most ρ/2.
///
/// The polarized part besides by |Δt| <= 4η²/(√(η² − 1) min(1, η² − 1)) ρ/2 and by the turn of its plane, whose degree of
/// polarization times 2Δφ is at most 4η/min(1, η² − 1) ρ. First order in ρ where the truth is second: for α of 0.1 some twenty
/// times too large.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let Some(sun) = facts.light.sun else {
        return Assessment::new(0.0, COST_NS, "no sun apart from the sky".into());
    };
    let bound = facts.worst(|surface, extent, _| bound(&sun, surface, extent));
    let reason =
        format!("a disk of {:.3} degrees radius against the lobe's width", sun.angular_radius_rad.to_degrees());
    Assessment::new(bound, COST_NS, reason)
}

fn bound(sun: &Sun, surface: &Surface, extent: &SurfaceExtent) -> f64 {
    let rho = sun.angular_radius_rad;
    let Ok(direction) = frames::direction(sun.direction) else { return f64::INFINITY };
    let cosine = direction.dot(extent.mean_normal) - extent.normal_radius - rho;
    let half = 0.5 * ((direction + extent.mean_view).length() - extent.view_radius - rho);
    if cosine <= rho || half <= 0.0 || direction.z <= rho.sin() {
        return f64::INFINITY;
    }
    let mut worst = 0.0_f64;
    for ior in surface.ior {
        let Ior::Dielectric(ior) = ior else { return f64::INFINITY };
        let contrast = (ior.eta() - 1.0) * (ior.eta() + 1.0);
        let floor = contrast.min(1.0);
        if floor <= 0.0 {
            return f64::INFINITY;
        }
        let exponent = (2.0 / surface.ggx.alpha()) * rho / (2.0 * half)
            + 3.0 * (cosine / (cosine - rho)).ln()
            + 2.0 * rho / contrast.sqrt()
            + rho * rho;
        let turned = rho * (2.0 * ior.eta().powi(2) / (contrast.sqrt() * floor) + 4.0 * ior.eta() / floor);
        // Of the center's s0, and the picture's own s0 is at least e^(−exponent) of it.
        worst = worst.max(((exponent.exp_m1()) * (1.0 + turned) + turned) * exponent.exp());
    }
    worst
}
