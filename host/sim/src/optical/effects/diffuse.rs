//! Light that enters the body and comes out again; left out, the surface only reflects.

use crate::Assessment;
use crate::optical::bounds::Lobe;
use crate::optical::light::SunPoints;
use crate::optical::prefilter::Pyramid;
use crate::optical::{OpticalFacts, Surface, SurfaceExtent};
use glam::DVec3;
use host_optics::diffuse::transmitted_row;
use host_optics::{Dielectric, Frame};

const COST_NS: f64 = 45.0;

/// Largest radius of a cell of the sky, radians, above and about the surface's horizon.
const CELL: f64 = 0.07;
const CELL_AT_HORIZON: f64 = 0.02;

/// Irradiance of three bands, or what of it passes the interface of `body` inwards.
pub(crate) fn irradiance(sky: &Pyramid, sun: &SunPoints, body: Option<[Dielectric; 3]>, normal: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let row =
        |k: usize, w: DVec3, frame: &Frame| body.map_or([1.0, 0.0, 0.0], |b| transmitted_row(b[k], w, frame, normal));
    let gray = body.is_none_or(|[r, g, b]| r == g && g == b);
    let rows = |w: DVec3, frame: &Frame| {
        let first = row(0, w, frame);
        if gray { [first; 3] } else { [first, row(1, w, frame), row(2, w, frame)] }
    };
    sky.walk(|found| {
        let w = found.cell.direction.as_dvec3();
        let cosine = normal.dot(w);
        let radius = f64::from(found.cell.radius);
        if cosine < -radius {
            return true;
        }
        if radius > CELL || (radius > CELL_AT_HORIZON && cosine < radius + 0.2) {
            return false;
        }
        if cosine > 0.0 {
            let length = f64::from(found.cell.length);
            let rows = rows(w, &Frame::sky(w));
            for (k, (s, [a, b, c])) in sum.iter_mut().zip(rows).enumerate() {
                let [q, u] = found.polarization[k].map(f64::from);
                *s += cosine * length * (a * f64::from(found.cell.power[k]) + b * q + c * u);
            }
        }
        true
    });
    for (w, solid_angle) in &sun.points {
        let cosine = normal.dot(*w);
        if cosine > 0.0 && w.z > 0.0 {
            let rows = rows(*w, &Frame::sky(*w));
            for (k, s) in sum.iter_mut().enumerate() {
                *s += cosine * solid_angle * sun.radiance[k] * rows[k][0];
            }
        }
    }
    sum
}

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
