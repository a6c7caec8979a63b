//! Paper eq. 6 evaluated: the light that leaves a rough, partly diffuse surface towards a camera.
//!
//! s_o = ∫ [(ρ_d/π)(L, 0, 0) + f_r M (L, Q, U)] (n·ω_i) dω_i over {n·ω_i > 0, ω_i.z > 0}: the sky is black below the world
//! horizon, L enters once, Fresnel is in M only. Three ways, by how much they cost:
//! [`mirror`] (the limit α → 0, closed form), [`FixedPoints`] (what renderings and fits use) and [`Adaptive`]
//! (reference, with an error estimate). Small bright sources are summed apart by [`discrete`].

mod adaptive;
mod domain;
pub(crate) mod quadrature;
mod samples;

use crate::frames::s_axis;
use crate::{Frame, Incidence, Ior, Light, Microfacet, OpticsError, PolarizedDiffuse, Reflection};
use core::f64::consts::FRAC_1_PI;
use glam::DVec3;

pub use adaptive::{Adaptive, Estimate};
pub use samples::FixedPoints;

/// The ray towards the camera: its direction and the Stokes frame of what is seen along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Unit ω_o, from the surface to the camera.
    pub direction: DVec3,
    /// Camera frame of that ray, see [`Frame::camera`].
    pub frame: Frame,
}

impl View {
    /// Along `direction` (any length), with `x_camera` to the right in the picture.
    ///
    /// # Errors
    /// [`OpticsError::Direction`] or [`OpticsError::AxisAlongRay`].
    pub fn new(direction: DVec3, x_camera: DVec3) -> Result<Self, OpticsError> {
        let direction = crate::frames::direction(direction)?;
        Ok(Self { direction, frame: Frame::camera(direction, x_camera)? })
    }
}

/// The limit α → 0 (paper eq. 8): one mirror facet with unit `normal`. (L, Q, U) in the camera frame; 0 where the camera is
/// below the surface or the mirrored ray below a horizon.
#[must_use]
pub fn mirror(light: &impl Light, ior: Ior, normal: DVec3, view: &View) -> [f64; 3] {
    let wo = view.direction;
    let cosine = normal.dot(wo);
    let wi = normal * (2.0 * cosine) - wo;
    if cosine <= 0.0 || wi.z <= 0.0 {
        return [0.0; 3];
    }
    reflected(light, ior, normal, wi, view)
}

/// The specular part of eq. 6 from a few directions with their solid angles (steradians), such as
/// [`crate::sky::SunDisk::points`]: Σ f_r M (L, Q, U) (n·ω) Ω over those above both horizons.
#[must_use]
pub fn discrete(
    light: &impl Light,
    directions: &[(DVec3, f64)],
    surface: &Microfacet,
    normal: DVec3,
    view: &View,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (wi, solid_angle) in directions {
        let cosine = normal.dot(*wi);
        if cosine <= 0.0 || wi.z <= 0.0 {
            continue;
        }
        let weight = surface.factor(*wi, view.direction, normal) * cosine * solid_angle;
        let reflection = Reflection::at_facet(surface.ior, *wi, &Frame::sky(*wi), view.direction, &view.frame);
        for (total, x) in sum.iter_mut().zip(reflection.apply(light.stokes(*wi))) {
            *total += weight * x;
        }
    }
    sum
}

/// The Lambert term of eq. 6, unpolarized: [ρ_d E/π, 0, 0] for an irradiance E and albedo ρ_d.
#[must_use]
pub fn lambert(albedo: f64, irradiance: f64) -> [f64; 3] {
    [FRAC_1_PI * albedo * irradiance, 0.0, 0.0]
}

/// The polarized diffuse term in the camera frame, for the irradiance E_T that passes the interface inwards
/// ([`FixedPoints::transmitted_irradiance`], [`Adaptive::transmitted_irradiance`]).
#[must_use]
pub fn polarized_diffuse(body: &PolarizedDiffuse, normal: DVec3, view: &View, transmitted_irradiance: f64) -> [f64; 3] {
    body.emission(view.direction, &view.frame, normal).map(|x| x * transmitted_irradiance)
}

/// What the facet `h` reflects out of `wi` (the view mirrored at it) into the camera frame. The angle of incidence comes from
/// the facet, which is known better than the mirrored ray.
fn reflected(light: &impl Light, ior: Ior, h: DVec3, wi: DVec3, view: &View) -> [f64; 3] {
    let s = s_axis(wi, view.direction);
    let reflection = Reflection {
        into_plane: Frame::sky(wi).turn_to(s).inverse(),
        reflectance: ior.reflectance(Incidence::between(h, view.direction)),
        out_of_plane: view.frame.turn_to(s),
    };
    reflection.apply(light.stokes(wi))
}
