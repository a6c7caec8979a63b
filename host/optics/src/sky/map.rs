//! An environment map: one color band of equirectangular radiance, with or without polarization.
//!
//! Layout: row-major, height × width; row 0 at the zenith, the last row at the nadir; column centers at azimuth
//! 2π (c + ½)/width, from +x towards +y (counter-clockwise seen from above). (Q, U) of a pixel are in the sky frame of its
//! center, which winds twice around the pole: a look-up carries its four neighbors' (Q, U) to the direction asked for by
//! parallel transport before it mixes them, across the poles too.

use crate::frames::transport;
use crate::{Frame, Light, OpticsError};
use core::f64::consts::{PI, TAU};
use glam::DVec3;

/// Radiance and polarization of one band over the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct StokesMap {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    /// (sin, cos) of the rows' polar angles.
    rows: Vec<(f64, f64)>,
    /// (sin, cos) of the columns' azimuths.
    columns: Vec<(f64, f64)>,
}

impl StokesMap {
    /// From (L, Q, U) pixels, row-major, height × width. `width` is even (a pixel's neighbor across the pole is a pixel).
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] if there are not width × height pixels, there are none, or `width` is odd.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Self, OpticsError> {
        check(width, height, 1, pixels.len())?;
        Ok(Self::checked(width, height, pixels))
    }

    /// The R, G and B bands of an unpolarized image, interleaved RGB, row-major, height × width × 3.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] as [`Self::new`].
    pub fn from_rgb(width: usize, height: usize, rgb: &[f32]) -> Result<[Self; 3], OpticsError> {
        check(width, height, 3, rgb.len())?;
        let band =
            |k: usize| Self::checked(width, height, rgb.iter().skip(k).step_by(3).map(|l| [*l, 0.0, 0.0]).collect());
        Ok([band(0), band(1), band(2)])
    }

    /// A map of `light`, each pixel its value at the pixel's center.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] for a size without pixels or an odd width.
    pub fn sample(width: usize, height: usize, light: &impl Light) -> Result<Self, OpticsError> {
        check(width, height, 1, width.saturating_mul(height))?;
        let mut map = Self::checked(width, height, Vec::with_capacity(width * height));
        for row in 0..height {
            for column in 0..width {
                let [l, q, u] = light.stokes(map.center(row, column));
                map.pixels.push([single(l), single(q), single(u)]);
            }
        }
        Ok(map)
    }

    /// (width, height).
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// (L, Q, U) pixels, row-major, height × width.
    #[must_use]
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// Direction of a pixel's center; panics beyond the map's size.
    #[must_use]
    pub fn center(&self, row: usize, column: usize) -> DVec3 {
        let (sin_theta, cos_theta) = self.rows[row];
        let (s, c) = self.columns[column];
        DVec3::new(sin_theta * c, sin_theta * s, cos_theta)
    }

    /// Irradiance on a plane with unit `normal` from the part of the map above the world horizon.
    ///
    /// ∫ ω dω over every pixel is exact, so pixels wholly above both horizons carry no quadrature error; those cut by
    /// the plane's horizon are taken whole or not (an error of second order in the pixel's size). Of the world horizon an
    /// even number of rows cuts nothing.
    #[must_use]
    pub fn irradiance(&self, normal: DVec3) -> f64 {
        let half_step = PI / real(self.width);
        let mut sum = 0.0;
        for (row, line) in self.pixels.chunks_exact(self.width).enumerate() {
            let upper = PI * real(row) / real(self.height);
            let lower = (PI * real(row + 1) / real(self.height)).min(0.5 * PI);
            if lower <= upper {
                break;
            }
            // ∫ sin² θ dθ and ∫ sin θ cos θ dθ over the row.
            let flat = 0.5 * (lower - upper) - 0.25 * ((2.0 * lower).sin() - (2.0 * upper).sin());
            let up = 0.5 * (lower.sin().powi(2) - upper.sin().powi(2)) * 2.0 * half_step;
            let flat = flat * 2.0 * half_step.sin();
            for (pixel, (s, c)) in line.iter().zip(&self.columns) {
                let seen = normal.dot(DVec3::new(flat * c, flat * s, up)).max(0.0);
                sum += f64::from(pixel[0]) * seen;
            }
        }
        sum
    }

    fn checked(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        let angles =
            |count: usize, turn: f64| (0..count).map(|k| (turn * (real(k) + 0.5) / real(count)).sin_cos()).collect();
        Self { width, height, pixels, rows: angles(height, PI), columns: angles(width, TAU) }
    }

    /// Pixel of a row that may lie one beyond a pole, and a column that may lie beyond the seam.
    fn neighbor(&self, row: Option<usize>, column: usize) -> (usize, usize) {
        match row {
            Some(row) if row < self.height => (row, column % self.width),
            Some(_) => (self.height - 1, (column + self.width / 2) % self.width),
            None => (0, (column + self.width / 2) % self.width),
        }
    }
}

impl Light for StokesMap {
    /// Bilinear in (azimuth, polar angle) between pixel centers. A mix of physical pixels is physical.
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let theta = direction.x.hypot(direction.y).atan2(direction.z);
        let azimuth = direction.y.atan2(direction.x).rem_euclid(TAU);
        // Half a pixel up and left, plus one so that the integer part is never negative.
        let (row, fy) = split(theta / PI * real(self.height) + 0.5);
        let (column, fx) = split(azimuth / TAU * real(self.width) + 0.5);
        let frame = Frame::sky(direction);
        let left = column + self.width - 1;
        let mut sum = [0.0; 3];
        for (row, column, weight) in [
            (row.checked_sub(1), left, (1.0 - fx) * (1.0 - fy)),
            (row.checked_sub(1), left + 1, fx * (1.0 - fy)),
            (Some(row), left, (1.0 - fx) * fy),
            (Some(row), left + 1, fx * fy),
        ] {
            let (row, column) = self.neighbor(row, column);
            let [l, q, u] = self.pixels[row * self.width + column].map(f64::from);
            sum[0] += weight * l;
            if q != 0.0 || u != 0.0 {
                let center = self.center(row, column);
                let axis = transport(Frame::sky(center).x, center, direction);
                let [q, u] = frame.turn_to(axis).apply([q, u]);
                sum[1] += weight * q;
                sum[2] += weight * u;
            }
        }
        sum
    }
}

fn check(width: usize, height: usize, channels: usize, found: usize) -> Result<(), OpticsError> {
    let expected = width.saturating_mul(height).saturating_mul(channels);
    if expected == 0 || !width.is_multiple_of(2) || expected != found {
        return Err(OpticsError::MapSize { width, height, expected, found });
    }
    Ok(())
}

#[expect(clippy::cast_precision_loss, reason = "rows and columns of an image are far below 2^52")]
fn real(index: usize) -> f64 {
    index as f64
}

#[expect(clippy::cast_possible_truncation, reason = "radiance maps are f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}

/// Integer and fractional part of a coordinate that is not negative.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the float-to-integer cast saturates, and coordinates are between 0 and the image's size"
)]
fn split(coordinate: f64) -> (usize, f64) {
    let whole = coordinate.floor();
    (whole as usize, coordinate - whole)
}
