//! The camera of a view: a pinhole with a pose over the sample plane.
//!
//! World: right-handed, the sample in z = 0 with mean normal +z, in units of the plane. Camera axes as in OpenCV: x
//! right, y down, z forward; point_camera = R point_world + t. Pixels: u right, v down, center of the first pixel at ½,
//! ½.

use glam::{DMat3, DVec2, DVec3};

use super::homography;
use crate::register::dense::NormalEquations;

/// A camera without distortion and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    width: usize,
    height: usize,
    intrinsics: DMat3,
    /// World to camera.
    rotation: DMat3,
    translation: DVec3,
}

/// Why numbers are no camera over the plane.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseFault {
    /// A number that is NaN or infinite, or a picture without pixels.
    #[error("a number that is not finite, or a picture without pixels")]
    NotFinite,
    /// K is not upper triangular with positive focal lengths and 1 at its end.
    #[error("K is not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx, fy > 0")]
    Intrinsics,
    /// R is not a rotation.
    #[error(
        "R is not a rotation: R times its transpose is off the identity by {error:.1e}, its determinant is {determinant:.6}"
    )]
    Rotation {
        /// Largest element of |R Rᵀ − 1|.
        error: f64,
        /// Determinant: −1 for a mirrored picture.
        determinant: f64,
    },
    /// The camera is not on the side of the sample's normal.
    #[error("the camera is at z = {z}, below the sample plane: z points up from the sample's front")]
    Behind {
        /// Its height.
        z: f64,
    },
    /// The points in the picture are not the image of the points in the plane.
    #[error("the points do not determine a view: fewer than four, or three on a line")]
    Degenerate,
    /// The corners are in an order or a place no camera shows.
    #[error(
        "the four corners in the picture do not form a convex quadrilateral in the order of the corners in the plane"
    )]
    NotConvex,
    /// The corners run the other way round than in the plane.
    #[error("the corners in the picture run the wrong way round: the sample is mirrored, or seen from behind")]
    Mirrored,
}

impl Camera {
    /// From K, R (world to camera) and t; R is made orthonormal to rounding.
    ///
    /// # Errors
    /// [`PoseFault`] as its variants say.
    pub fn new(
        [width, height]: [usize; 2],
        intrinsics: DMat3,
        rotation: DMat3,
        translation: DVec3,
    ) -> Result<Self, PoseFault> {
        check_intrinsics([width, height], &intrinsics)?;
        if !rotation.is_finite() || !translation.is_finite() {
            return Err(PoseFault::NotFinite);
        }
        let deviation = rotation * rotation.transpose() - DMat3::IDENTITY;
        let error = deviation.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        let determinant = rotation.determinant();
        if error > 1e-4 || determinant < 0.0 {
            return Err(PoseFault::Rotation { error, determinant });
        }
        let camera = Self { width, height, intrinsics, rotation: orthonormal(rotation), translation };
        let z = camera.position().z;
        if z > 0.0 { Ok(camera) } else { Err(PoseFault::Behind { z }) }
    }

    /// The pose that puts points of the plane where they are in the picture, given K: homography, its decomposition,
    /// and Gauss-Newton on the distances in the picture. The second answer is the rms of those distances, in pixels:
    /// for four or more points the test that the sample is plane and K is right. Four points in order around must be
    /// convex in both.
    ///
    /// # Errors
    /// [`PoseFault`] as its variants say.
    pub fn from_plane_points(
        size: [usize; 2],
        intrinsics: DMat3,
        plane: &[DVec2],
        pixels: &[DVec2],
    ) -> Result<(Self, f64), PoseFault> {
        check_intrinsics(size, &intrinsics)?;
        if plane.iter().chain(pixels).any(|p| !p.is_finite()) {
            return Err(PoseFault::NotFinite);
        }
        let four = (<&[DVec2; 4]>::try_from(plane), <&[DVec2; 4]>::try_from(pixels));
        if let (Ok(a), Ok(b)) = four
            && !(homography::is_convex(a) && homography::is_convex(b))
        {
            return Err(PoseFault::NotConvex);
        }
        let h = homography::from_points(plane, pixels).ok_or(PoseFault::Degenerate)?;
        let (rotation, translation) = decomposed(&(intrinsics.inverse() * h))?;
        let start = Self::new(size, intrinsics, rotation, translation)?;
        let refined = start.refined(plane, pixels).ok_or(PoseFault::Degenerate)?;
        Ok((refined, refined.rms_distance(plane, pixels)))
    }

    /// Columns and rows of the picture.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Where the camera is.
    #[must_use]
    pub fn position(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// Unit axis to the right in the picture, in the world.
    #[must_use]
    pub fn right(&self) -> DVec3 {
        self.rotation.row(0)
    }

    /// Unit axis up in the picture, in the world.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        -self.rotation.row(1)
    }

    /// Unit ω_o: from a point of the plane to the camera.
    #[must_use]
    pub fn towards(&self, point: DVec2) -> DVec3 {
        (self.position() - point.extend(0.0)).normalize()
    }

    /// H with pixel ~ H (x, y, 1) for points of the plane: K [r₁ r₂ t].
    #[must_use]
    pub fn plane_to_pixel(&self) -> DMat3 {
        self.intrinsics * DMat3::from_cols(self.rotation.x_axis, self.rotation.y_axis, self.translation)
    }

    /// Rms distance in the picture, in pixels, between points of the plane as this camera sees them and `pixels`;
    /// infinite for points behind it.
    #[must_use]
    pub fn rms_distance(&self, plane: &[DVec2], pixels: &[DVec2]) -> f64 {
        let h = self.plane_to_pixel();
        let squared =
            |(p, q): (&DVec2, &DVec2)| homography::project(&h, *p).map_or(f64::INFINITY, |r| r.distance_squared(*q));
        (plane.iter().zip(pixels).map(squared).sum::<f64>() / plane.len() as f64).sqrt()
    }

    /// Least squares of the distances in the picture, over a turn ω of the camera and t.
    fn refined(mut self, plane: &[DVec2], pixels: &[DVec2]) -> Option<Self> {
        for _ in 0..20 {
            let mut equations = NormalEquations::<6>::new();
            for (p, q) in plane.iter().zip(pixels) {
                let arm = self.rotation * p.extend(0.0);
                let homogeneous = self.intrinsics * (arm + self.translation);
                let pixel = homogeneous.truncate() / homogeneous.z;
                // Point_camera moves by ω × arm + Δt; the picture by the projection's derivative of that.
                let moved = |v: DVec3| {
                    let k = self.intrinsics * v;
                    (k.truncate() - pixel * k.z) / homogeneous.z
                };
                let by = [DVec3::X, DVec3::Y, DVec3::Z];
                let [a, b, c] = by.map(|w| moved(w.cross(arm)));
                let [d, e, f] = by.map(moved);
                let residual = *q - pixel;
                equations.add(&[a.x, b.x, c.x, d.x, e.x, f.x], residual.x);
                equations.add(&[a.y, b.y, c.y, d.y, e.y, f.y], residual.y);
            }
            let [a, b, c, d, e, f] = equations.solve()?;
            let turn = DVec3::new(a, b, c);
            self.rotation = DMat3::from_quat(glam::DQuat::from_scaled_axis(turn)) * self.rotation;
            self.translation += DVec3::new(d, e, f);
            if turn.length() < 1e-13 {
                break;
            }
        }
        self.rotation = orthonormal(self.rotation);
        Some(self)
    }
}

fn check_intrinsics([width, height]: [usize; 2], k: &DMat3) -> Result<(), PoseFault> {
    if !k.is_finite() || width == 0 || height == 0 {
        return Err(PoseFault::NotFinite);
    }
    let lower = [k.x_axis.y, k.x_axis.z, k.y_axis.z, k.z_axis.z - 1.0];
    let sound = k.x_axis.x > 0.0 && k.y_axis.y > 0.0 && lower.iter().all(|x| x.abs() < 1e-12);
    if sound { Ok(()) } else { Err(PoseFault::Intrinsics) }
}

/// R and t of λ[r₁ r₂ t], t in front of the camera (Zhang 2000, "A flexible new technique for camera calibration",
/// section 3.1).
fn decomposed(m: &DMat3) -> Result<(DMat3, DVec3), PoseFault> {
    let scale = (m.x_axis.length() * m.y_axis.length()).sqrt().recip();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(PoseFault::Degenerate);
    }
    let [r1, r2, t] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c * scale * m.z_axis.z.signum());
    let r3 = r1.cross(r2);
    // The camera's height over the plane, −r₃·t, decides the side.
    if r3.dot(t) > 0.0 {
        return Err(PoseFault::Mirrored);
    }
    Ok((orthonormal(DMat3::from_cols(r1, r2, r3.normalize())), t))
}

/// The nearest rotation: Newton's iteration for the polar factor (Higham 1986).
fn orthonormal(mut m: DMat3) -> DMat3 {
    for _ in 0..30 {
        let next = (m + m.inverse().transpose()) * 0.5;
        let change = (next - m).to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        m = next;
        if change < 1e-15 {
            break;
        }
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec2; 4] =
        [DVec2::new(-0.5, 0.5), DVec2::new(0.5, 0.5), DVec2::new(0.5, -0.5), DVec2::new(-0.5, -0.5)];

    fn intrinsics() -> DMat3 {
        DMat3::from_cols(DVec3::X * 1640.0, DVec3::new(3.0, 1620.0, 0.0), DVec3::new(190.0, 118.0, 1.0))
    }

    /// 56° from the normal, from azimuth 30°, rolled by 5°; the axis passes (0.03, −0.02) off the sample's middle.
    fn pose() -> Camera {
        let (theta, phi, roll) = (56_f64.to_radians(), 30_f64.to_radians(), 5_f64.to_radians());
        let back = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let level = DVec3::new(-phi.sin(), phi.cos(), 0.0);
        let right = level * roll.cos() + back.cross(level) * roll.sin();
        let down = -back.cross(right);
        let rotation = DMat3::from_cols(right, down, -back).transpose();
        let position = back * 6.0 + DVec3::new(0.03, -0.02, 0.0);
        Camera::new([384, 232], intrinsics(), rotation, -(rotation * position)).unwrap()
    }

    /// The pinhole by hand: the point of the world in the camera's axes, times the focal length, over the depth.
    #[test]
    fn the_homography_is_the_pinhole() {
        let camera = pose();
        let h = camera.plane_to_pixel();
        for p in CORNERS {
            let to = p.extend(0.0) - camera.position();
            let forward = camera.up().cross(camera.right()).normalize();
            let (x, y) = (to.dot(camera.right()) / to.dot(forward), -to.dot(camera.up()) / to.dot(forward));
            let by_hand = DVec2::new(1640.0 * x + 3.0 * y + 190.0, 1620.0 * y + 118.0);
            assert!((homography::project(&h, p).unwrap() - by_hand).length() < 1e-9);
        }
        let up_right = homography::project(&h, DVec2::ZERO).unwrap();
        assert!((up_right - DVec2::new(190.0, 118.0)).length() < 20.0);
    }

    #[test]
    fn four_corners_give_the_pose_back() {
        let camera = pose();
        let h = camera.plane_to_pixel();
        let pixels = CORNERS.map(|p| homography::project(&h, p).unwrap());
        let (found, rms) = Camera::from_plane_points([384, 232], intrinsics(), &CORNERS, &pixels).unwrap();
        assert!(rms < 1e-9 && (found.position() - camera.position()).length() < 1e-9, "{rms} {found:?}");
        assert!((found.right() - camera.right()).length() < 1e-11 && (found.up() - camera.up()).length() < 1e-11);
        // Corners read to 0.2 px: 2 mm of 600 along the line of sight, and a misfit that says so.
        let nudged: Vec<DVec2> = pixels
            .iter()
            .zip([(0.2, 0.0), (0.0, -0.2), (-0.2, 0.0), (0.0, 0.2)])
            .map(|(p, d)| *p + DVec2::from(d))
            .collect();
        let (near, rms) = Camera::from_plane_points([384, 232], intrinsics(), &CORNERS, &nudged).unwrap();
        assert!(rms > 1e-3 && rms < 0.2 && (near.position() - camera.position()).length() < 0.1, "{rms} {near:?}");
    }

    #[test]
    fn wrong_corners_are_told_apart() {
        let h = pose().plane_to_pixel();
        let [a, b, c, d] = CORNERS.map(|p| homography::project(&h, p).unwrap());
        let fault =
            |pixels: &[DVec2]| Camera::from_plane_points([384, 232], intrinsics(), &CORNERS, pixels).unwrap_err();
        assert_eq!(fault(&[a, c, b, d]), PoseFault::NotConvex);
        assert_eq!(fault(&[d, c, b, a]), PoseFault::Mirrored);
        assert_eq!(fault(&[a, b, c]), PoseFault::Degenerate);
        let turned = DMat3::from_rotation_z(0.3) * 1.1;
        let refused = |r: DMat3, t: DVec3| Camera::new([4, 4], intrinsics(), r, t).unwrap_err();
        assert!(matches!(refused(turned, DVec3::Z), PoseFault::Rotation { .. }));
        assert!(matches!(refused(DMat3::IDENTITY, DVec3::Z), PoseFault::Behind { .. }));
        assert_eq!(Camera::new([4, 4], DMat3::ZERO, turned, DVec3::Z), Err(PoseFault::Intrinsics));
    }
}
