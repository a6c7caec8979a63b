//! The sun's disk; left out, all of its power comes from its center.

use crate::optical::light::SunPoints;
use crate::optical::{OpticalFacts, Sun, Surface, SurfaceExtent};
use crate::{Assessment, Effect, EffectSet};
use host_optics::prefilter::Sources;
use host_optics::{Ior, OpticsError, frames};

const COST_NS: f64 = 5.0;

/// Directions that stand for the sun, none without a sun. Both choices carry the same irradiance to a plane that sees the
/// whole disk: a point of solid angle π sin² r.
pub(crate) fn points(sun: Option<&Sun>, effects: EffectSet) -> Result<SunPoints, OpticsError> {
    let Some(sun) = sun else { return Ok(SunPoints::default()) };
    let disk = sun.disk()?;
    let center = frames::direction(sun.direction)?;
    let points = if effects.contains(Effect::SunDisk) {
        disk.points()
    } else {
        let solid_angle = core::f64::consts::PI * sun.angular_radius_rad.sin().powi(2);
        vec![(center, solid_angle)]
    };
    let angular_radius = sun.angular_radius_rad;
    let sources = Sources { points, radiance: sun.radiance };
    Ok(SunPoints { sources, disk: Some(disk), center, angular_radius })
}

/// Both have the same irradiance at a pixel that sees all of the disk, so that they differ by the average of f over the disk, weights
/// cos θ, against f at its center. Along a great circle through the center f(δ) = f(0) + δ f′(0) + ½ δ² f″: opposite points cancel f′, and
/// the average of δ² is at most ½ ρ² (to ρ² of itself). So the change is at most ¼ ρ² sup |f″|, and sup |f″|/f <= a² + b with the first and
/// second logarithmic derivatives a, b of all factors together:
/// - D: |d ln D/dθ_h| <= 2/α and |d² ln D/dθ_h²| <= 4/α² + 4, and h turns by at most 1/(2 cos θ_d) per radian, itself turning by
///   no more than 1/(2 cos² θ_d);
/// - G2 and the transmittance, log-derivatives by n·ω_i of at most 1/c_i and 2/c_i, second ones of at most twice their squares;
/// - R⊥: |d ln R⊥/dθ| <= 4/√(η² − 1), θ_d turns by ½ per radian; second of at most its square.
///
/// The polarized part has besides the factor t (|t′| <= 4η²/(√(η² − 1) min(1, η² − 1)) at θ_d) and the turn of its plane, whose degree of
/// polarization times 2φ′ is at most 4η/min(1, η² − 1): they count as further logarithmic derivatives. The point's
/// solid angle π sin² ρ is the disk's but for ¼ ρ² of itself: 1 more in b. f at the center is at
/// most exp(a ρ) of what the disk sends.
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
    // A mirror sees the disk in either case.
    if surface.is_mirror() {
        return 0.0;
    }
    let rho = sun.angular_radius_rad;
    let (Some(cosine), Ok(direction)) = (super::sun_cosine(sun, extent), frames::direction(sun.direction)) else {
        return f64::INFINITY;
    };
    let half = 0.5 * ((direction + extent.mean_view).length() - extent.view_radius - rho);
    if half <= 0.0 {
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
        let alpha = surface.ggx.alpha();
        let turned = 2.0 * ior.eta().powi(2) / (contrast.sqrt() * floor) + 4.0 * ior.eta() / floor;
        let a = 1.0 / (alpha * half) + 3.0 / cosine + 2.0 / contrast.sqrt() + turned;
        let b = (1.0 / (alpha * alpha) + 1.0) / (half * half)
            + 1.0 / (alpha * half * half)
            + 6.0 / (cosine * cosine)
            + 4.0 / contrast
            + turned * turned
            + 1.0;
        worst = worst.max(0.25 * rho * rho * (a * a + b) * (1.0 + rho * rho) * (2.0 * a * rho).exp());
    }
    worst
}
