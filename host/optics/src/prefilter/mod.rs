//! Stokes light prefiltered, and paper eq. 6 as a sum over it: for light with more detail than a lobe can see (environment
//! maps), where [`crate::integral`] would need points without end.
//!
//! - [`Pyramid`]: three bands of light above the world horizon, in cells that carry what arrives through them.
//! - [`Reflector::specular`], [`irradiance`]: sums over as many cells as the lobe has features. [`Fineness`] is the
//!   setting, with its measured error.
//! - [`Sources`]: what is too small and bright for a cell (the sun's disk), by its own points.
//!
//! A texel of the map counts as one point at its center: where α is below about 1.5 times the step of the map, texels show
//! as points, and [`crate::integral::FixedPoints`] on the map is the better rule.

mod body;
mod pyramid;
mod reflector;

pub use body::irradiance;
pub use pyramid::{Cell, Found, Pyramid};
pub use reflector::{Fineness, Reflector};

use glam::{DVec3, Vec3};

/// \[band R, G, B\]\[s0, s1, s2\].
pub type Rgb = [[f64; 3]; 3];

/// Unpolarized light of one radiance out of a few directions, such as [`crate::sky::SunDisk::points`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// Unit directions with their solid angles in steradians. Those below the world horizon are dark.
    pub points: Vec<(DVec3, f64)>,
    /// Radiance, R, G, B.
    pub radiance: [f64; 3],
}

impl Sources {
    /// Those above the world horizon.
    fn risen(&self) -> impl Iterator<Item = &(DVec3, f64)> {
        self.points.iter().filter(|(w, _)| w.z > 0.0)
    }
}

#[expect(clippy::cast_precision_loss, reason = "rows and columns of an image are far below 2^52")]
fn real(count: usize) -> f64 {
    count as f64
}

#[expect(clippy::cast_possible_truncation, reason = "cells are f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}

fn single3(v: DVec3) -> Vec3 {
    Vec3::new(single(v.x), single(v.y), single(v.z))
}

#[cfg(test)]
mod tests;
