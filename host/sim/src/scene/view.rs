//! Views: where the camera stands.

use glam::DVec3;
use protocol_polar::Radians;
use serde::{Deserialize, Deserializer};

use super::device::Camera;
use super::locate::At;
use super::value::degrees;
use crate::SimError;
use crate::camera::{Pinhole, Pose};

/// `[[view]]` as written: θ, φ and distance from the sample's center, or a position and what it looks at.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawView {
    #[serde(default, rename = "theta_deg", deserialize_with = "given_degrees")]
    theta: Option<Radians>,
    #[serde(default, rename = "phi_deg", deserialize_with = "given_degrees")]
    phi: Option<Radians>,
    distance_m: Option<f64>,
    position_m: Option<[f64; 3]>,
    look_at_m: Option<[f64; 3]>,
    #[serde(default, rename = "roll_deg", deserialize_with = "degrees")]
    roll: Radians,
    focal_length_mm: f64,
}

impl RawView {
    pub(super) fn check(&self, at: &At<'_>, camera: &Camera) -> Result<Pinhole, SimError> {
        at.within("focal_length_mm", self.focal_length_mm, 0.1..=10_000.0)?;
        at.within("roll_deg", self.roll.to_degrees().0, -360.0..=360.0)?;
        let pose = match (self.theta, self.phi, self.distance_m, self.position_m, self.look_at_m) {
            (Some(theta), Some(phi), Some(distance), None, None) => {
                let theta_deg = theta.to_degrees().0;
                let from_above = (0.0..90.0).contains(&theta_deg);
                at.check(from_above, "theta_deg", theta_deg, || {
                    "0 to below 90: the sample is seen from above only".to_owned()
                })?;
                at.within("phi_deg", phi.to_degrees().0, -360.0..=360.0)?;
                at.within("distance_m", distance, 1e-3..=1e4)?;
                Pose::orbit(theta, phi, distance, self.roll)
            }
            (None, None, None, Some(position), Some(target)) => {
                let shown = || format!("{position:?}");
                let finite = position.iter().chain(&target).all(|x| x.abs() <= 1e4);
                at.check(finite, "position_m", shown(), || "numbers from -1e4 to 1e4".to_owned())?;
                let above = || "z > 0: the sample is seen from above only".to_owned();
                at.check(position[2] > 0.0, "position_m", shown(), above)?;
                let pose = Pose::look_at(DVec3::from_array(position), DVec3::from_array(target), self.roll);
                at.optics("look_at_m", pose)?
            }
            _ => {
                let expected =
                    "either `theta_deg`, `phi_deg` and `distance_m`, or `position_m` and `look_at_m`, are needed";
                return Err(at.malformed("", expected));
            }
        };
        Ok(Pinhole {
            pose,
            focal_px: 1e3 * self.focal_length_mm / camera.pixel_pitch_um,
            width: usize::from(camera.width_px),
            height: usize::from(camera.height_px),
        })
    }
}

fn given_degrees<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Radians>, D::Error> {
    degrees(deserializer).map(Some)
}
