//! The geometry against itself run backwards, and against pictures one can draw by hand.

use glam::{DVec2, DVec3};
use host_optics::Frame;
use proptest::prelude::*;
use protocol_polar::{Degrees, Radians};

use super::{Pinhole, Pose};

fn deg(angle: f64) -> Radians {
    Degrees(angle).to_radians()
}

fn pinhole(theta: f64, phi: f64, roll: f64) -> Pinhole {
    Pinhole { pose: Pose::orbit(deg(theta), deg(phi), 1.5, deg(roll)), focal_px: 400.0, width: 320, height: 240 }
}

/// From the south (−y) one sees east (+x) to the right and north (+y) further up, also straight from above.
#[test]
fn the_picture_is_the_right_way_round() {
    for theta in [0.0, 30.0, 70.0] {
        let camera = pinhole(theta, -90.0, 0.0);
        let at = |x: f64, y: f64| camera.project(DVec3::new(x, y, 0.0)).unwrap();
        assert!((at(0.0, 0.0) - DVec2::new(160.0, 120.0)).length() < 1e-9);
        assert!(at(0.1, 0.0).x > 165.0 && at(0.0, 0.1).y < 119.0, "theta {theta}");
    }
    // Held turned by 90° counter-clockwise, the camera shows what is to the right at the bottom.
    let rolled = pinhole(0.0, -90.0, 90.0).project(DVec3::new(0.1, 0.0, 0.0)).unwrap();
    assert!((rolled.x - 160.0).abs() < 1e-9 && rolled.y > 125.0, "{rolled}");
}

#[test]
fn the_two_ways_to_place_a_camera_agree() {
    for (theta, phi) in [(50.0, -90.0), (20.0, 135.0), (0.0, -90.0)] {
        let orbit = Pose::orbit(deg(theta), deg(phi), 2.0, deg(10.0));
        let look = Pose::look_at(orbit.position, DVec3::ZERO, deg(10.0)).unwrap();
        assert!((orbit.right - look.right).length() + (orbit.up - look.up).length() < 1e-12, "{theta} {phi}");
    }
    assert!(Pose::look_at(DVec3::Z, DVec3::Z, deg(0.0)).is_err());
}

#[test]
fn rays_to_the_sky_miss_the_plane() {
    let camera = Pinhole { focal_px: 50.0, ..pinhole(80.0, 0.0, 0.0) };
    assert_eq!(camera.plane_point(DVec2::new(160.0, 0.5)), None);
    assert!(camera.plane_point(DVec2::new(160.0, 200.0)).is_some());
}

proptest! {
    /// Pixel → plane → pixel, by projection and by homography.
    #[test]
    fn projection_undoes_the_ray(
        theta in 0.0..80.0, phi in -180.0..180.0, roll in -180.0..180.0, x in 0.0..320.0, y in 0.0..240.0,
    ) {
        let camera = pinhole(theta, phi, roll);
        let pixel = DVec2::new(x, y);
        let Some(point) = camera.plane_point(pixel) else { return Ok(()) };
        prop_assume!(point.length() < 50.0);
        let back = camera.project(point.extend(0.0)).unwrap();
        prop_assert!((back - pixel).length() < 1e-8, "{} {}", back, pixel);
        let h = camera.plane_to_pixel() * point.extend(1.0);
        prop_assert!((h.truncate() / h.z - pixel).length() < 1e-8);
        let (rotation, translation) = camera.world_to_camera();
        let seen = camera.intrinsics() * (rotation * point.extend(0.0) + translation);
        prop_assert!(seen.z > 0.0 && (seen.truncate() / seen.z - pixel).length() < 1e-8);
        prop_assert!((rotation.determinant() - 1.0).abs() < 1e-12);
    }

    /// Every ray's frame is right-handed about its propagation, x̂ stays in the plane of `right` and the ray, and on the axis it
    /// is the picture's own.
    #[test]
    fn frames_follow_the_rays(theta in 0.0..70.0, phi in -180.0..180.0, x in 0.0..320.0, y in 0.0..240.0) {
        let camera = pinhole(theta, phi, 0.0);
        let point = camera.plane_point(DVec2::new(x, y)).unwrap_or_default();
        let view = camera.view_of(point).unwrap();
        let Frame { x: fx, y: fy } = view.frame;
        prop_assert!((fx.cross(fy) - view.direction).length() < 1e-12);
        prop_assert!(fx.dot(view.direction.cross(camera.pose.right)).abs() < 1e-12);
        let axis = camera.view_of(DVec2::ZERO).unwrap();
        prop_assert!((axis.frame.x - camera.pose.right).length() + (axis.frame.y - camera.pose.up).length() < 1e-12);
    }
}
