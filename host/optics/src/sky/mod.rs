//! Light from the environment: radiance and linear polarization by direction.
//!
//! One [`Light`] is one color band. A formula answers for every direction, below the horizon too; that the sky is black
//! there is the business of [`crate::integral`], which stops at ω.z = 0.

mod clear;
mod map;
mod overcast;
mod pattern;
mod sun;

use glam::DVec3;

pub use clear::ClearSky;
pub use map::StokesMap;
pub use overcast::{MoonSpencer, Uniform};
pub use pattern::{Berry, Pattern, Polarized, Rayleigh};
pub use sun::SunDisk;

/// Light that arrives from every direction, one color band.
pub trait Light {
    /// (L, Q, U) of the light out of unit `direction`, in [`crate::Frame::sky`] of that direction.
    fn stokes(&self, direction: DVec3) -> [f64; 3];
}

impl<T: Light + ?Sized> Light for &T {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        (**self).stokes(direction)
    }
}

impl<T: Light + ?Sized> Light for Box<T> {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        (**self).stokes(direction)
    }
}
