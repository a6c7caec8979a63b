//! Closed forms: normal, η and ρ_d of a pixel without a search. Two fast modes, and the start of the joint fit.
//!
//! - [`pixel`] and [`planes`], mode *closed* (paper eq. 5, 7, 10): the light is taken as unpolarized, the facet as a mirror on
//!   Lambert's ground. Phase → plane of incidence → normal; I_max − I_min = ½ L (R⊥ − R∥) → η; what is left is diffuse.
//! - [`sky_aware`] and [`sky_aware_planes`], mode *sky-aware* (paper eq. 8): the same facet under light whose polarization is
//!   known.
//!
//! Both are exact for mirror facets and biased for rough ones, because a lobe reflects less polarized light than a mirror
//! (true η 1.5 reads 1.28 at α .3 under a uniform sky), and for bodies that polarize diffuse light. α is not estimated: it is a start
//! value, and [`Reasons::ROUGHNESS`] is always set. σ are first-order propagations of the Stokes
//! covariances, without those biases. No input makes NaN or a panic; σ is infinite where there is no answer.

mod fresnel;
mod image;
mod kernel;
mod phase;
mod plane;
mod real;
mod sky;
mod sky_aware;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::material::{BANDS, Facets, MAX_VIEWS, Observation};
use glam::DVec3;
use host_optics::Frame;
use kernel::Found;
use phase::Seen;

pub use crate::joint::Reasons;
pub use image::{Covariance, Grid, SurfacePlanes, ViewPlanes, planes, sky_aware_planes};
pub use sky::SkyTable;
pub use sky_aware::sky_aware;

/// What a closed form says about a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// ρ_d of R, G, B, in [0, 1].
    pub albedo: [f64; BANDS],
    /// η, α and normal.
    pub facets: Facets,
    /// How well.
    pub sigma: Sigma,
    /// What stands against it.
    pub reasons: Reasons,
}

impl Estimate {
    /// Unit normal.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.facets.normal()
    }
}

/// First-order standard deviations; infinite where there is no answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigma {
    /// Of ρ_d.
    pub albedo: [f64; BANDS],
    /// Of η.
    pub eta: f64,
    /// rms angle of the normal, radians.
    pub normal_rad: f64,
}

/// Mode *closed* for one pixel: up to [`MAX_VIEWS`] observations (more are ignored), `x_axes[observation.view]` the camera's x
/// axis in the world. A view that has none, or a ray along it, is as if it were not there.
#[must_use]
pub fn pixel(observations: &[Observation], x_axes: &[DVec3], sky: &SkyTable) -> Estimate {
    let (seen, count) = seen(observations, x_axes, sky);
    Estimate::from(&solve_f64(&seen, count, sky))
}

/// What every observation saw, in units of a white sample; the places beyond the count are empty.
fn seen(observations: &[Observation], x_axes: &[DVec3], sky: &SkyTable) -> ([Seen<f64>; MAX_VIEWS], usize) {
    let mut seen = [Seen::nothing(); MAX_VIEWS];
    let mut count = 0;
    for (place, observation) in seen.iter_mut().zip(observations) {
        count += 1;
        place.present = 1.0;
        let Some(axis) = x_axes.get(observation.view) else { continue };
        let Ok(direction) = host_optics::frames::direction(observation.direction) else { continue };
        let Ok(frame) = Frame::camera(direction, *axis) else { continue };
        place.direction = direction.to_array();
        (place.x, place.y) = (frame.x.to_array(), frame.y.to_array());
        for (b, white) in sky.white().into_iter().enumerate() {
            if white > 0.0 {
                place.stokes[b] = observation.stokes[b].map(|s| f64::from(s) / white);
                place.covariance[b] = observation.covariance[b].map(|c| f64::from(c) / (white * white));
            }
        }
    }
    (seen, count)
}

fn solve_f64(seen: &[Seen<f64>; MAX_VIEWS], count: usize, sky: &SkyTable) -> Found<f64> {
    let [a, b, c, d, ..] = *seen;
    match count {
        0..=2 => kernel::solve(&[a, b], sky),
        3 => kernel::solve(&[a, b, c], sky),
        4 => kernel::solve(&[a, b, c, d], sky),
        _ => kernel::solve(seen, sky),
    }
}

impl From<&Found<f64>> for Estimate {
    fn from(found: &Found<f64>) -> Self {
        let [x, y, z] = found.normal;
        Self {
            albedo: found.albedo,
            facets: Facets { eta: found.eta, alpha: found.alpha, slope: [x / z, y / z] },
            sigma: Sigma { albedo: found.sigma_albedo, eta: found.sigma_eta, normal_rad: found.sigma_normal },
            reasons: reasons(found.reasons),
        }
    }
}

/// The bits a lane carried as a whole number, below 2^24.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a sum of bits; the cast saturates")]
fn reasons(bits: f64) -> Reasons {
    Reasons(bits as u32)
}
