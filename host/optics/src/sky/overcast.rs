//! Unpolarized skies: uniform, and the standard overcast sky of Moon and Spencer.

use crate::Light;
use glam::DVec3;

/// The same radiance from everywhere; irradiance on a horizontal plane is πL.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uniform {
    /// L.
    pub radiance: f64,
}

impl Light for Uniform {
    fn stokes(&self, _: DVec3) -> [f64; 3] {
        [self.radiance, 0.0, 0.0]
    }
}

/// CIE traditional overcast sky (Moon and Spencer 1942): L = L_z (1 + 2 sin(elevation))/3; at and below the horizon L_z/3.
/// Irradiance on a horizontal plane is 7πL_z/9.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoonSpencer {
    /// L_z, radiance of the zenith.
    pub zenith: f64,
}

impl Light for MoonSpencer {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        [self.zenith * (1.0 + 2.0 * direction.z.max(0.0)) / 3.0, 0.0, 0.0]
    }
}
