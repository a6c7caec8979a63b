//! A camera that has the whole sample in its picture.

use glam::{DMat3, DVec2, DVec3};

use crate::maps::PlaneRect;
use crate::session::homography::project;
use crate::session::{Camera, PoseFault};

/// Share of the picture's width that the sample fills.
const FILL: f64 = 0.96;
/// Largest zenith angle: beyond it the picture of a plane is a line.
const GRAZING_DEG: f64 = 89.0;

/// Why there is no such camera.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewFault {
    /// At or below the sample's plane.
    #[error(
        "a camera {theta_deg} degrees from the normal sees the sample from its edge or from below; less than {GRAZING_DEG} is drawn"
    )]
    Below {
        /// Zenith angle as given.
        theta_deg: f64,
    },
    /// Inside of the sample's own extent.
    #[error("a camera at distance {distance} is too close to a sample of {extent} from corner to corner")]
    TooClose {
        /// As given.
        distance: f64,
        /// Diagonal of the sample.
        extent: f64,
    },
    /// A picture of this width.
    #[error("a picture {width} pixels wide; 16 to 16384 are drawn")]
    Width {
        /// As given.
        width: usize,
    },
    /// No camera.
    #[error(transparent)]
    Pose(#[from] PoseFault),
}

/// The camera at zenith angle θ and azimuth φ (degrees, from +x towards +y) of the middle of `plane`, its horizontal level,
/// `distance` away in units of the plane (three diagonals if `None`), with a lens that fills a picture of `width` pixels
/// with the sample. At θ = 0, φ = −90° shows x to the right and y up.
///
/// # Errors
/// [`ViewFault`] as its variants say.
pub fn frame(
    plane: &PlaneRect,
    theta_deg: f64,
    phi_deg: f64,
    distance: Option<f64>,
    width: usize,
) -> Result<Camera, ViewFault> {
    if !(0.0..GRAZING_DEG).contains(&theta_deg) || !phi_deg.is_finite() {
        return Err(ViewFault::Below { theta_deg });
    }
    if !(16..=16384).contains(&width) {
        return Err(ViewFault::Width { width });
    }
    let PlaneRect { left, right, bottom, top } = *plane;
    let extent = DVec2::new(right - left, top - bottom).length();
    let distance = distance.unwrap_or(3.0 * extent);
    // Half a diagonal away a corner may be level with the camera.
    if !(distance > 0.6 * extent && distance.is_finite()) {
        return Err(ViewFault::TooClose { distance, extent });
    }
    let ((st, ct), (sp, cp)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    let back = DVec3::new(st * cp, st * sp, ct);
    let across = DVec3::new(-sp, cp, 0.0);
    let rotation = DMat3::from_cols(across, -back.cross(across), -back).transpose();
    let middle = DVec2::new(0.5 * (left + right), 0.5 * (bottom + top));
    let translation = -(rotation * (middle.extend(0.0) + back * distance));
    // With focal length 1 the corners say how long it has to be, and where the picture's middle is.
    let unit = Camera::new([1, 1], DMat3::IDENTITY, rotation, translation)?;
    let h = unit.plane_to_pixel();
    let corners = [(left, top), (right, top), (right, bottom), (left, bottom)].map(|(x, y)| DVec2::new(x, y));
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for corner in corners {
        let Some(at) = project(&h, corner) else { return Err(ViewFault::TooClose { distance, extent }) };
        (low, high) = (low.min(at), high.max(at));
    }
    let focal = FILL * width as f64 / (high.x - low.x);
    let margin = (1.0 - FILL) * width as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a picture's height, positive")]
    let height = (((high.y - low.y) * focal + margin).ceil() as usize).clamp(16, 4 * width);
    let center = 0.5 * DVec2::new(width as f64, height as f64) - 0.5 * (low + high) * focal;
    let intrinsics = DMat3::from_cols(DVec3::X * focal, DVec3::Y * focal, center.extend(1.0));
    Ok(Camera::new([width, height], intrinsics, rotation, translation)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: PlaneRect = PlaneRect { left: -0.2, right: 0.4, bottom: 0.1, top: 0.3 };

    /// Whatever the view, all corners are in the picture, and the sample fills its width.
    #[test]
    fn the_sample_fills_the_picture() {
        for (theta, phi) in [(0.0, -90.0), (30.0, 10.0), (60.0, 200.0), (85.0, -45.0)] {
            let camera = frame(&PLANE, theta, phi, None, 300).unwrap();
            let h = camera.plane_to_pixel();
            let at = [(-0.2, 0.1), (0.4, 0.1), (0.4, 0.3), (-0.2, 0.3)].map(|p| project(&h, DVec2::from(p)).unwrap());
            let [width, height] = camera.size().map(|n| n as f64);
            assert!(at.iter().all(|p| p.x > 0.0 && p.x < width && p.y > 0.0 && p.y < height), "{theta} {phi}: {at:?}");
            let span = at.iter().map(|p| p.x).fold(0.0, f64::max) - at.iter().map(|p| p.x).fold(width, f64::min);
            assert!((span / width - FILL).abs() < 1e-9, "{span}");
            let to = camera.towards(DVec2::new(0.1, 0.2));
            assert!((to.z - theta.to_radians().cos()).abs() < 1e-9);
            assert!(camera.right().z.abs() < 1e-12, "level");
        }
    }

    #[test]
    fn from_straight_above_x_is_right_and_y_up() {
        let camera = frame(&PLANE, 0.0, -90.0, Some(5.0), 100).unwrap();
        assert!((camera.right() - DVec3::X).length() < 1e-12 && (camera.up() - DVec3::Y).length() < 1e-12);
        assert!((camera.position().z - 5.0).abs() < 1e-12);
    }

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let fault = |theta, distance| frame(&PLANE, theta, 0.0, distance, 100).unwrap_err();
        assert!(
            matches!(fault(89.5, None), ViewFault::Below { .. })
                && matches!(fault(120.0, None), ViewFault::Below { .. })
        );
        assert!(matches!(fault(f64::NAN, None), ViewFault::Below { .. }));
        assert!(matches!(fault(10.0, Some(0.1)), ViewFault::TooClose { .. }));
        assert!(matches!(frame(&PLANE, 0.0, 0.0, None, 0), Err(ViewFault::Width { .. })));
    }
}
