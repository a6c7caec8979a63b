//! The disk of the sun: uniform radiance within an angular radius, unpolarized.

use crate::error::in_range;
use crate::frames::{direction, tangents};
use crate::integral::quadrature::GaussLegendre;
use crate::{Light, OpticsError};
use core::f64::consts::{PI, TAU};
use glam::DVec3;

/// A disk of uniform radiance on the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunDisk {
    direction: DVec3,
    angular_radius: f64,
    radiance: f64,
}

impl SunDisk {
    /// The sun's mean angular radius, 16 arc minutes.
    pub const SOLAR_RADIUS_RAD: f64 = 0.004_654;

    /// Direction of the center (any length), angular radius in radians in (0, π/2], radiance.
    ///
    /// # Errors
    /// [`OpticsError::Direction`] or [`OpticsError::Range`].
    pub fn new(center: DVec3, angular_radius: f64, radiance: f64) -> Result<Self, OpticsError> {
        Ok(Self {
            direction: direction(center)?,
            angular_radius: in_range("angular radius in radians", angular_radius, 1e-9, 0.5 * PI)?,
            radiance,
        })
    }

    /// Ω = 2π (1 − cos r), steradians.
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        4.0 * PI * (0.5 * self.angular_radius).sin().powi(2)
    }

    /// Irradiance π L sin² r (n·center) on a plane that sees the whole disk.
    #[must_use]
    pub fn irradiance(&self, normal: DVec3) -> f64 {
        PI * self.radiance * self.angular_radius.sin().powi(2) * normal.dot(self.direction)
    }

    /// Directions over the disk with their weights in steradians, for ∫ f dω = Σ w f(ω): 8 Gauss-Legendre rings of 16.
    ///
    /// For [`crate::integral::discrete`], where the lobe is wider than the disk (α above the radius); a narrower lobe wants
    /// the points on the lobe instead, [`crate::integral::FixedPoints`].
    #[must_use]
    pub fn points(&self) -> Vec<(DVec3, f64)> {
        let (t, b) = tangents(self.direction);
        let cap = 2.0 * (0.5 * self.angular_radius).sin().powi(2);
        let rule = GaussLegendre::new(8);
        let ring = |(x, w): (f64, f64)| {
            // 1 − cos θ is uniform in solid angle.
            let versine = cap * x;
            let sine = (versine * (2.0 - versine)).sqrt();
            (0..16u8).map(move |k| {
                let (s, c) = (TAU * (f64::from(k) + 0.5) / 16.0).sin_cos();
                ((t * c + b * s) * sine + self.direction * (1.0 - versine), cap * w * TAU / 16.0)
            })
        };
        rule.unit().flat_map(ring).collect()
    }
}

impl Light for SunDisk {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let chord = 2.0 * (0.5 * self.angular_radius).sin();
        let inside = (direction - self.direction).length_squared() <= chord * chord;
        [if inside { self.radiance } else { 0.0 }, 0.0, 0.0]
    }
}
