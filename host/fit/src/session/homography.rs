//! Homographies from the sample plane to the picture.
//!
//! pixel ~ H (x, y, 1): plane coordinates in units of the plane, pixel coordinates u to the right and v *down* from the
//! upper left corner of the picture (center of the first pixel at ½, ½). H carries the sign of a view: the third
//! component is positive for points in front of the camera.

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::register::dense::NormalEquations;

/// Where a point of the plane lies in the picture; `None` on and behind the camera's own plane.
#[must_use]
pub fn project(h: &DMat3, point: DVec2) -> Option<DVec2> {
    let p = *h * point.extend(1.0);
    (p.z > 0.0).then(|| p.truncate() / p.z)
}

/// ∂pixel/∂point, columns by x and y of the plane, at a point in front of the camera.
#[must_use]
pub fn jacobian(h: &DMat3, point: DVec2) -> DMat2 {
    let p = *h * point.extend(1.0);
    let pixel = p.truncate() / p.z;
    let column = |c: DVec3| (c.truncate() - pixel * c.z) / p.z;
    DMat2::from_cols(column(h.x_axis), column(h.y_axis))
}

/// The homography that takes `plane[i]` to `pixels[i]`: exact for four points, least squares of the algebraic error in
/// normalized coordinates (Hartley and Zisserman, "Multiple View Geometry", 2nd ed., alg. 4.2) for more. The centroid
/// of the points is in front of the camera. `None` if the points do not determine it (fewer than four, three on a
/// line).
#[must_use]
pub fn from_points(plane: &[DVec2], pixels: &[DVec2]) -> Option<DMat3> {
    if plane.len() != pixels.len() || plane.len() < 4 {
        return None;
    }
    let (to_plane, to_pixels) = (normalization(plane)?, normalization(pixels)?);
    let mut equations = NormalEquations::<8>::new();
    for (p, q) in plane.iter().zip(pixels) {
        let (p, q) = (to_plane.transform_point2(*p), to_pixels.transform_point2(*q));
        let (x, y) = (p.x, p.y);
        equations.add(&[x, y, 1.0, 0.0, 0.0, 0.0, -q.x * x, -q.x * y], q.x);
        equations.add(&[0.0, 0.0, 0.0, x, y, 1.0, -q.y * x, -q.y * y], q.y);
    }
    let [a, b, c, d, e, f, g, h] = equations.solve()?;
    let normalized = DMat3::from_cols(DVec3::new(a, d, g), DVec3::new(b, e, h), DVec3::new(c, f, 1.0));
    // The centroid has third component 1 in normalized coordinates, and both normalizations keep it. Three points on a
    // line in one of the two only leave a map onto that line.
    let found = to_pixels.inverse() * normalized * to_plane;
    (found.is_finite() && normalized.determinant().abs() > 1e-6).then_some(found)
}

/// Takes the centroid to 0 and the mean distance from it to √2.
fn normalization(points: &[DVec2]) -> Option<DMat3> {
    let count = points.len() as f64;
    let center = points.iter().sum::<DVec2>() / count;
    let spread = points.iter().map(|p| p.distance(center)).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / spread;
    scale.is_finite().then(|| DMat3::from_scale(DVec2::splat(scale)) * DMat3::from_translation(-center))
}

/// Twice the signed area of a closed polygon; positive where x → y turns are to the left.
#[must_use]
pub(crate) fn doubled_area(corners: &[DVec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum()
}

/// Whether a quadrilateral turns the same way at every corner.
#[must_use]
pub(crate) fn is_convex(corners: &[DVec2; 4]) -> bool {
    let turn = |i: usize| {
        let [a, b, c] = [i, i + 1, i + 2].map(|k| corners[k % 4]);
        (b - a).perp_dot(c - b)
    };
    let area = doubled_area(corners);
    (0..4).all(|i| turn(i) * area > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_homography() -> DMat3 {
        DMat3::from_cols(DVec3::new(210.0, 45.0, 0.08), DVec3::new(-30.0, -160.0, -0.05), DVec3::new(700.0, 500.0, 2.0))
    }

    #[test]
    fn points_give_their_homography_back() {
        let h = some_homography();
        let plane = [(-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (0.1, 0.2), (-0.3, 0.05)].map(DVec2::from);
        let pixels = plane.map(|p| project(&h, p).unwrap());
        for count in [4, 6] {
            let found = from_points(&plane[..count], &pixels[..count]).unwrap();
            for p in plane {
                assert!((project(&found, p).unwrap() - project(&h, p).unwrap()).length() < 1e-9);
            }
        }
        let line = [(0.0, 0.0), (0.1, 0.1), (0.2, 0.2), (0.5, -0.5)].map(DVec2::from);
        assert!(from_points(&line, &pixels[..4]).is_none() && from_points(&plane[..3], &pixels[..3]).is_none());
    }

    #[test]
    fn the_jacobian_is_the_difference_quotient() {
        let (h, p, step) = (some_homography(), DVec2::new(0.2, -0.3), 1e-6);
        let j = jacobian(&h, p);
        for (axis, column) in [(DVec2::X, j.x_axis), (DVec2::Y, j.y_axis)] {
            let quotient =
                (project(&h, p + step * axis).unwrap() - project(&h, p - step * axis).unwrap()) / (2.0 * step);
            assert!((quotient - column).length() < 1e-6);
        }
    }

    #[test]
    fn convexity_is_told() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(DVec2::from);
        let [a, b, c, d] = square;
        assert!(is_convex(&square) && is_convex(&[d, c, b, a]));
        assert!(!is_convex(&[a, c, b, d]) && !is_convex(&[a, b, DVec2::new(0.2, 0.3), d]) && !is_convex(&[a, b, b, a]));
    }
}
