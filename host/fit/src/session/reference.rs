//! What the Stokes vectors of a picture refer to, ray by ray, and the way from there into [`Frame::camera`].

use glam::{DMat3, DVec3};
use host_optics::Frame;
use protocol_polar::{Analyzer, LeastSquares};

use super::camera::Camera;

/// What s1 of a view's Stokes vectors refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceAxis {
    /// The camera's x axis made orthogonal to the ray: nothing to turn.
    Camera,
    /// normalize(d × up), d the ray from the camera.
    RayCrossUp,
    /// A real sheet polarizer before the lens: the ray k is passed along normalize(k × absorbing axis), which turns
    /// each frame by an angle of its own off the optical axis.
    Sheet,
}

/// A [`ReferenceAxis`] for one camera and wheel.
pub struct ReferenceCorrection {
    axis: ReferenceAxis,
    right: DVec3,
    up: DVec3,
    analyzers: Vec<Analyzer>,
    on_axis: Option<LeastSquares>,
}

impl ReferenceCorrection {
    /// `analyzers` are those the Stokes vectors were estimated with; only [`ReferenceAxis::Sheet`] asks for them.
    #[must_use]
    pub fn new(axis: ReferenceAxis, camera: &Camera, analyzers: &[Analyzer]) -> Self {
        let on_axis = LeastSquares::new(analyzers).ok();
        Self { axis, right: camera.right(), up: camera.up(), analyzers: analyzers.to_vec(), on_axis }
    }

    /// The matrix that takes (s0, s1, s2), a column, as estimated on the ray along unit `direction` (to the camera)
    /// into [`Frame::camera`]. `None` for a ray without a frame (90° off the axis), and for a sheet of unknown angles.
    #[must_use]
    pub fn at(&self, direction: DVec3) -> Option<DMat3> {
        let frame = Frame::camera(direction, self.right).ok()?;
        match self.axis {
            ReferenceAxis::Camera => Some(DMat3::IDENTITY),
            ReferenceAxis::RayCrossUp => {
                let turn = frame.turn_to((-direction).cross(self.up));
                Some(DMat3::from_cols(
                    DVec3::X,
                    DVec3::new(0.0, turn.cos, turn.sin),
                    DVec3::new(0.0, -turn.sin, turn.cos),
                ))
            }
            ReferenceAxis::Sheet => {
                // The estimate is W A′ s: W of the angles on the axis, A′ of those of this ray.
                let weights = self.on_axis.as_ref()?.weights();
                let mut seen = DMat3::ZERO;
                for (k, analyzer) in self.analyzers.iter().enumerate() {
                    let (sin, cos) = analyzer.angle.0.sin_cos();
                    let absorbing = self.up * cos - self.right * sin;
                    let turn = frame.turn_to(direction.cross(absorbing));
                    let (half, polarized) =
                        (0.5 * analyzer.throughput, 0.5 * analyzer.throughput * analyzer.efficiency);
                    let w = DVec3::new(weights[0][k], weights[1][k], weights[2][k]);
                    seen += DMat3::from_cols(w * half, w * (polarized * turn.cos), w * (polarized * turn.sin));
                }
                let inverse = seen.inverse();
                inverse.is_finite().then_some(inverse)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_polar::{Degrees, Radians};

    fn wide_camera() -> Camera {
        let k = DMat3::from_cols(DVec3::X * 200.0, DVec3::Y * 200.0, DVec3::new(200.0, 150.0, 1.0));
        let down = DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z);
        Camera::new([400, 300], k, DMat3::from_rotation_x(0.4) * down, DVec3::new(0.0, 0.0, 2.0)).unwrap()
    }

    /// A sheet at φ in front of rays to the side, drawn by vectors: its frames, solved as if they were on the axis,
    /// come back.
    #[test]
    fn what_a_sheet_does_to_oblique_rays_is_undone() {
        let camera = wide_camera();
        let analyzers: Vec<Analyzer> =
            [0.0, 31.0, 60.0, 88.0, 121.0].map(|d| Analyzer::ideal(Degrees(d).to_radians())).to_vec();
        let solver = LeastSquares::new(&analyzers).unwrap();
        let correction = ReferenceCorrection::new(ReferenceAxis::Sheet, &camera, &analyzers);
        let truth = DVec3::new(1.0, 0.3, -0.5);
        let mut largest = 0.0_f64;
        for (x, y) in [(0.0, 0.0), (0.5, 0.4), (-0.6, 0.5), (0.7, -0.3)] {
            let back = camera.up().cross(camera.right()) * -1.0;
            let k = (back - camera.right() * x - camera.up() * y).normalize();
            let frame = Frame::camera(k, camera.right()).unwrap();
            let signal = |a: &Analyzer| {
                let absorbing = camera.up() * a.angle.0.cos() - camera.right() * a.angle.0.sin();
                let axis = k.cross(absorbing).normalize();
                let angle = Radians(axis.dot(frame.y).atan2(axis.dot(frame.x)));
                DVec3::from_array(Analyzer::ideal(angle).row()).dot(truth)
            };
            let raw = DVec3::from_array(solver.solve(&analyzers.iter().map(signal).collect::<Vec<_>>()));
            largest = largest.max((raw - truth).length());
            // The residual of frames that are no sheet's on the axis falls out of W; what is left is exact.
            assert!((correction.at(k).unwrap() * raw - truth).length() < 1e-12, "{x} {y}");
        }
        assert!(largest > 0.05, "{largest}");
    }

    /// On the axis all three are one.
    #[test]
    fn on_the_axis_nothing_turns() {
        let camera = wide_camera();
        let analyzers = [0.0, 60.0, 120.0].map(|d| Analyzer::ideal(Degrees(d).to_radians()));
        let back = camera.right().cross(camera.up());
        for axis in [ReferenceAxis::Camera, ReferenceAxis::RayCrossUp, ReferenceAxis::Sheet] {
            let found = ReferenceCorrection::new(axis, &camera, &analyzers).at(back).unwrap();
            assert!((found - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-12), "{axis:?}: {found}");
        }
    }
}
