//! A sheet polarizer stops light along its absorbing axis a, so a ray k passes it polarized along normalize(k × a): off the
//! optical axis that is neither the wheel's angle nor the transmission axis projected across the ray.
//!
//! With the ray from a pixel x to the right of and y above the middle, at focal length f (all px), n² = x² + y² + f²,
//! and the ray's own camera frame, the wheel's angle φ becomes φ' with
//! tan φ' = ((y² + f²) sin φ + x y cos φ) / (f n cos φ).
//!
//! Bound: with c the cosine of the ray's angle off the axis, the numerator of sin(φ' − φ) is at most ½ (1 − c) + ½ (1 − c²) and
//! its denominator at least c², so |sin(φ' − φ)| <= (1 − c)(1 + ½ c)/c², largest in a corner; as for an angle error it changes
//! a frame by at most t P |sin(φ' − φ)| s0.

use protocol_polar::{Analyzer, Radians};

use crate::camera::Pinhole;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 5.0;

/// The analyzer of one frame, ray by ray.
pub(crate) struct SheetRow<'a> {
    camera: &'a Pinhole,
    row: usize,
    angle: (f64, f64),
    /// ½ t and ½ t ε, times the exposure.
    weights: [f64; 2],
}

impl<'a> SheetRow<'a> {
    /// For the photosites of `row` behind `analyzer`, whose row is scaled by `exposure_ms`.
    pub(crate) fn new(camera: &'a Pinhole, row: usize, analyzer: &Analyzer, exposure_ms: f64) -> Self {
        let half = 0.5 * analyzer.throughput * exposure_ms;
        Self { camera, row, angle: analyzer.angle.0.sin_cos(), weights: [half, half * analyzer.efficiency] }
    }

    /// Row of the analyzer for the ray in the middle of `column`.
    pub(crate) fn weights(&self, column: usize) -> [f32; 3] {
        let (c, s) = axis(self.camera, self.row, column, self.angle);
        let [half, polarized] = self.weights;
        let scale = polarized / (c * c + s * s);
        [half, scale * (c - s) * (c + s), scale * 2.0 * c * s].map(single)
    }
}

/// A vector along the transmission axis in the frame of a pixel's ray, of the wheel's (sin φ, cos φ).
fn axis(camera: &Pinhole, row: usize, column: usize, (sin, cos): (f64, f64)) -> (f64, f64) {
    let f = camera.focal_px;
    let beside = camera.beside_axis(Pinhole::pixel(row, column));
    let (x, y) = (beside.x, -beside.y);
    let across = y * y + f * f;
    (f * (across + x * x).sqrt() * cos, across * sin + x * y * cos)
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let corner = facts.scene.views.get(facts.view).map_or(1.0, |camera| camera.off_axis_cosine(Pinhole::pixel(0, 0)));
    let off = ((1.0 - corner) * (1.0 + 0.5 * corner) / (corner * corner)).min(1.0);
    let bound = facts.deterministic(|_| facts.max_dolp * off);
    let reason = format!(
        "the axis turns by at most {:.2}° in the corners, {:.1}° off the axis; DoLP up to {:.3}",
        Radians(off.asin()).to_degrees().0,
        Radians(corner.acos()).to_degrees().0,
        facts.max_dolp
    );
    Assessment::new(bound, COST_NS, reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Effect;
    use crate::camera::Pose;
    use crate::frames::testing::{check_bound, studio};
    use glam::DVec3;
    use proptest::prelude::*;
    use protocol_polar::Degrees;

    /// A picture whose upper right corner pixel looks `off_axis` beside the axis, on the diagonal.
    fn looking_aside(off_axis: Degrees) -> Pinhole {
        let side = 2001_u16;
        let pose = Pose::orbit(Radians(0.7), Radians(-1.2), 1.0, Radians(0.3));
        let reach = 0.5 * f64::from(side - 1) * std::f64::consts::SQRT_2;
        Pinhole { pose, focal_px: reach / off_axis.to_radians().0.tan(), width: side.into(), height: side.into() }
    }

    /// The angle φ' at the middle of a pixel, for the wheel at `angle`.
    fn angle_at(camera: &Pinhole, row: usize, column: usize, angle: Radians) -> Radians {
        let (c, s) = axis(camera, row, column, angle.0.sin_cos());
        Radians(s.atan2(c))
    }

    /// normalize(k × a) and the projection of the transmission axis, as angles in the frame x̂ = normalize(x̂_cam − (x̂_cam·k)k),
    /// ŷ = k × x̂: vectors in the world, sharing nothing with the closed form.
    fn by_vectors(camera: &Pinhole, row: usize, column: usize, angle: Radians) -> [Radians; 2] {
        let Pose { right, up, .. } = camera.pose;
        let k = -camera.ray(Pinhole::pixel(row, column));
        let x = (right - k * right.dot(k)).normalize();
        let y = k.cross(x);
        let (s, c) = angle.0.sin_cos();
        let (transmission, absorbing): (DVec3, DVec3) = (right * c + up * s, up * c - right * s);
        [k.cross(absorbing), transmission].map(|v| Radians(v.dot(y).atan2(v.dot(x))))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(focal_px in 8.0..500.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.views[0].focal_px = focal_px;
            check_bound(&scene, Effect::SheetAxis)?;
        }

        #[test]
        fn the_axis_is_the_ray_across_the_absorbing_axis(
            row in 0_usize..2001, column in 0_usize..2001, angle in -4.0..4.0, off in 1.0..50.0,
        ) {
            let camera = looking_aside(Degrees(off));
            let [expected, _] = by_vectors(&camera, row, column, Radians(angle));
            let found = angle_at(&camera, row, column, Radians(angle));
            prop_assert!(found.axis_difference(expected).0.abs() < 1e-12, "{found:?} {expected:?}");
        }
    }

    /// How far the projected transmission axis is from the real one on the diagonal, at 10, 20 and 30 degrees off the axis.
    #[test]
    fn the_projected_axis_is_wrong_by_as_much_as_is_known() {
        for (off, expected) in [(10.0, 0.9), (20.0, 3.6), (30.0, 8.2)] {
            let camera = looking_aside(Degrees(off));
            let [real, projected] = by_vectors(&camera, 0, 2000, Radians(0.0));
            let found = real.axis_difference(projected).to_degrees().0.abs();
            assert!((found - expected).abs() < 0.05, "{off} degrees: {found}");
        }
    }

    #[test]
    fn on_the_axis_it_is_the_wheels_angle() {
        let camera = looking_aside(Degrees(30.0));
        for angle in [0.0, 0.4, 1.9, 3.0].map(Radians) {
            assert!(angle_at(&camera, 1000, 1000, angle).axis_difference(angle).0.abs() < 1e-15);
        }
    }
}
