//! Pinhole geometry: rays, the plane of the sample, and the Stokes frame of every ray.
//!
//! The camera's own axes are those of the picture: right, up, and back (towards whoever looks at the picture), right × up =
//! back. Pixel coordinates are continuous, x right and y **down** from the upper left corner of the picture, so the center of
//! column c, row r is (c + ½, r + ½) and the optical axis meets the middle of the picture.

mod truth;

use glam::{DMat3, DVec2, DVec3};
use host_optics::OpticsError;
use host_optics::frames::direction;
use host_optics::integral::View;
use protocol_polar::Radians;

pub use truth::Truth;

/// Where a camera stands and how it is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// In m.
    pub position: DVec3,
    /// Unit axis to the right in the picture.
    pub right: DVec3,
    /// Unit axis up in the picture.
    pub up: DVec3,
    /// Unit axis against the line of sight.
    pub back: DVec3,
}

/// A camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Where it is.
    pub pose: Pose,
    /// Focal length in pixels.
    pub focal_px: f64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Pose {
    /// Looking at the origin from `distance` (m) at zenith angle θ in [0, π/2) and azimuth φ (from +x towards +y). The
    /// picture's horizontal is level, (−sin φ, cos φ, 0) also at θ = 0; `roll` then turns the camera counter-clockwise as seen
    /// from behind it, so that what it shows turns clockwise.
    #[must_use]
    pub fn orbit(theta: Radians, phi: Radians, distance: f64, roll: Radians) -> Self {
        let ((st, ct), (sp, cp)) = (theta.0.sin_cos(), phi.0.sin_cos());
        let back = DVec3::new(st * cp, st * sp, ct);
        Self::held(back * distance, DVec3::new(-sp, cp, 0.0), back, roll)
    }

    /// From `position` towards `target` (m), the picture's horizontal level, then rolled as by [`Self::orbit`]. Straight down,
    /// +y is up.
    ///
    /// # Errors
    /// [`OpticsError::Direction`] if the two are one.
    pub fn look_at(position: DVec3, target: DVec3, roll: Radians) -> Result<Self, OpticsError> {
        let back = direction(position - target)?;
        let right = direction(DVec3::Z.cross(back)).unwrap_or(DVec3::X);
        Ok(Self::held(position, right, back, roll))
    }

    fn held(position: DVec3, level: DVec3, back: DVec3, roll: Radians) -> Self {
        let (s, c) = roll.0.sin_cos();
        let right = level * c + back.cross(level) * s;
        Self { position, right, up: back.cross(right), back }
    }
}

impl Pinhole {
    /// Unit direction from the camera through `pixel`.
    #[must_use]
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let Pose { right, up, back, .. } = self.pose;
        let beside = self.beside_axis(pixel);
        (right * beside.x - up * beside.y - back * self.focal_px).normalize()
    }

    /// Where the ray through `pixel` meets the plane z = 0, (x, y) in m; `None` for rays that miss it.
    #[must_use]
    pub fn plane_point(&self, pixel: DVec2) -> Option<DVec2> {
        let ray = self.ray(pixel);
        let distance = -self.pose.position.z / ray.z;
        (ray.z < 0.0).then(|| (self.pose.position + ray * distance).truncate())
    }

    /// Pixel coordinates of a point in the world (m); `None` behind the camera.
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        let to = point - self.pose.position;
        let depth = -to.dot(self.pose.back);
        let across = DVec2::new(to.dot(self.pose.right), -to.dot(self.pose.up));
        (depth > 0.0).then(|| self.center() + across * (self.focal_px / depth))
    }

    /// The homography H with pixel ~ H (x, y, 1) for points (x, y) in m of the plane z = 0: K [r₁ r₂ t].
    #[must_use]
    pub fn plane_to_pixel(&self) -> DMat3 {
        let (rotation, translation) = self.world_to_camera();
        self.intrinsics() * DMat3::from_cols(rotation.x_axis, rotation.y_axis, translation)
    }

    /// K, px: pixel ~ K X for X in the camera's own axes as computer vision has them, x right, y **down**, z along the line of
    /// sight.
    #[must_use]
    pub fn intrinsics(&self) -> DMat3 {
        DMat3::from_cols(DVec3::X * self.focal_px, DVec3::Y * self.focal_px, self.center().extend(1.0))
    }

    /// (R, t) with X = R x + t from the world (m) into the axes of [`Self::intrinsics`].
    #[must_use]
    pub fn world_to_camera(&self) -> (DMat3, DVec3) {
        let Pose { position, right, up, back } = self.pose;
        let rotation = DMat3::from_cols(right, -up, -back).transpose();
        (rotation, rotation * -position)
    }

    /// The ray from `point` in the plane (m) to the camera, with its camera frame: x̂ = normalize(right − (right·k) k), ŷ = k × x̂.
    ///
    /// # Errors
    /// [`OpticsError`] for a point at the camera, or 90° beside the line of sight; no point in the picture is either.
    pub fn view_of(&self, point: DVec2) -> Result<View, OpticsError> {
        View::new(self.pose.position - point.extend(0.0), self.pose.right)
    }

    /// Cosine of the angle between the ray through `pixel` and the optical axis.
    #[must_use]
    pub fn off_axis_cosine(&self, pixel: DVec2) -> f64 {
        self.focal_px / self.focal_px.hypot(self.beside_axis(pixel).length())
    }

    /// Middle of the pixel at `row` and `column`.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "rows and columns of a picture are far below 2^52")]
    pub fn pixel(row: usize, column: usize) -> DVec2 {
        DVec2::new(column as f64 + 0.5, row as f64 + 0.5)
    }

    /// How far `pixel` is from where the optical axis meets the picture, px, x right and y **down**.
    pub(crate) fn beside_axis(&self, pixel: DVec2) -> DVec2 {
        pixel - self.center()
    }

    /// Where the optical axis meets the picture.
    fn center(&self) -> DVec2 {
        0.5 * (Self::pixel(self.height, self.width) - 0.5)
    }
}

#[cfg(test)]
mod tests;
