//! The optical effects, one file each: when it applies, a bound of what leaving it out changes, its cost, and what it does.

pub mod diffuse;
pub mod diffuse_polarization;
pub mod incident_polarization;
pub mod masking;
pub mod neutral_points;
pub mod normal_variation;
pub mod retardance;
pub mod roughness;
pub mod sun_disk;

use crate::optical::{OpticalFacts, Sun, SurfaceExtent};

/// A change of (Q, U)/L by `moved` as a share of s0 under light of degree of polarization up to `dolp`.
fn share(moved: f64, dolp: f64) -> f64 {
    if moved == 0.0 {
        0.0
    } else if dolp < 1.0 {
        moved / (1.0 - dolp)
    } else {
        f64::INFINITY
    }
}

/// The least n·ω_i over a surface's normals and the sun's disk; `None` where it may be at a horizon.
fn sun_cosine(sun: &Sun, extent: &SurfaceExtent) -> Option<f64> {
    let direction = host_optics::frames::direction(sun.direction).ok()?;
    let radius = sun.angular_radius_rad;
    let cosine = direction.dot(extent.mean_normal) - extent.normal_radius - radius - 1e-6;
    (cosine > 0.0 && direction.z > radius.sin()).then_some(cosine)
}

/// A change of (Q, U)/L by `moved` at most as a share of s0, with the least of two proofs: [`share`] of every facet and the body, and the
/// enclosures of both against that of s0, which knows that unpolarized light from the body dilutes it.
fn polarization_share(facts: &OpticalFacts<'_>, moved: f64) -> f64 {
    let bare = share(moved, facts.bounds.max_dolp);
    if facts.shown().any(|(s, _)| s.is_mirror()) {
        return bare;
    }
    bare.min(facts.enclosed(|e| e.share(moved * (e.lobe.most + e.body.tint))))
}

/// Shares of a lobe's reach at which bounds are tried.
const REACHES: [f64; 6] = [0.99, 0.7, 0.4, 0.2, 0.1, 0.05];

fn worst_band(bound: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(bound).fold(0.0, |worst, b| if b.is_nan() { f64::INFINITY } else { worst.max(b) })
}

/// The least specular s0 a band of a surface shows, from whatever slopes prove most.
fn least_specular(lobe: &crate::optical::bounds::Lobe<'_>, k: usize) -> f64 {
    let rough = REACHES.map(|share| lobe.least(share * lobe.reach, k)).into_iter().fold(0.0, f64::max);
    rough.max(0.0)
}
