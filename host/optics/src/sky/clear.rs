//! A clear sky in five numbers: brighter towards the horizon and around the sun. Smooth, so that integrals over it can be
//! known to 1e-13; not a measured sky.

use crate::Light;
use glam::DVec3;

/// L(ω) = base + horizon (1 − max(0, ω_z))² + aureole exp(−|ω − sun|²/(2 width²)), unpolarized. Without the sun's disk.
///
/// For its polarization see [`super::Polarized`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearSky {
    /// Radiance of a zenith far from the sun.
    pub base: f64,
    /// What the horizon has more.
    pub horizon: f64,
    /// What the sun's surroundings have more.
    pub aureole: f64,
    /// Width of the aureole, as a chord (about radians).
    pub width: f64,
    /// Unit direction of the sun.
    pub sun: DVec3,
}

impl Light for ClearSky {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let low = 1.0 - direction.z.max(0.0);
        let chord = (direction - self.sun).length_squared();
        let aureole = self.aureole * (-0.5 * chord / (self.width * self.width)).exp();
        [self.base + self.horizon * low * low + aureole, 0.0, 0.0]
    }
}
