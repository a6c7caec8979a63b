//! What leaves the body through the interface is polarized in the plane of n and ω_o. Left out, it leaves unpolarized with the
//! same power; the light it lives on still enters as the interface lets it.

use super::diffuse;
use crate::Assessment;
use crate::optical::{Body, OpticalFacts};
use glam::Vec3;
use host_optics::{Dielectric, Incidence, Ior};

const COST_NS: f64 = 20.0;

/// ½ (T⊥ + T∥) and ½ (T⊥ − T∥)/sin² θ of three bands at cos θ in [0, 1].
pub(crate) fn transmission(body: [Dielectric; 3], cosine: f64) -> [[f64; 2]; 3] {
    body.map(|ior| {
        // The quotient by sin² is smooth at the normal; 1e-9 stands in for its zero.
        let sine_squared = ((1.0 - cosine) * (1.0 + cosine)).max(1e-9);
        let at = Incidence { cosine, sine_squared };
        let [perpendicular, parallel] = ior.transmittance(at);
        [0.5 * (perpendicular + parallel), -0.5 * ior.difference(at) / sine_squared]
    })
}

/// sin² θ (cos 2φ, sin 2φ) of the axis n × ω_o in the camera frame of ω_o: with x' = x_cam − (x_cam·ω_o) ω_o,
/// (n × ω_o)·x' = x'·(n × ω_o) and (n × ω_o)·(ω_o × x') = −n·x'.
pub(crate) fn double_axis(normal: Vec3, wo: Vec3, camera_x: Vec3) -> [f32; 2] {
    let x = camera_x - wo * camera_x.dot(wo);
    let a = normal.cross(wo).dot(x);
    let b = -normal.dot(x);
    let scale = 1.0 / x.length_squared().max(1e-12);
    [(a - b) * (a + b) * scale, 2.0 * a * b * scale]
}

/// The diffuse part loses its degree of polarization |T⊥ − T∥|/(T⊥ + T∥), which grows from 0 at the normal: at most its value
/// at the most oblique view, times the diffuse share of s0.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let bound = facts.worst(|surface, extent, lobe| {
        if surface.body == Body::Lambert || extent.albedo[1] <= 0.0 {
            return 0.0;
        }
        let dolp = |ior: Ior| {
            let Ior::Dielectric(ior) = ior else { return 0.0 };
            let cosine = (extent.cosine[0] - 1e-6).max(0.0);
            let at = Incidence { cosine, sine_squared: (1.0 - cosine) * (1.0 + cosine) };
            let [perpendicular, parallel] = ior.transmittance(at);
            if parallel > 0.0 { (parallel - perpendicular) / (parallel + perpendicular) } else { 1.0 }
        };
        diffuse::share(facts, surface, extent, lobe) * surface.ior.map(dolp).into_iter().fold(0.0, f64::max)
    });
    let reason =
        if bound > 0.0 { "the body's light leaves partly polarized" } else { "no light leaves through an interface" };
    Assessment::new(bound, COST_NS, reason.into())
}
