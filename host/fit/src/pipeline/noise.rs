//! What a measurement may be off by beside its sensor's noise.

use super::wheels::WheelNoise;
use crate::material::Observation;

/// Places of the diagonal in 00, 01, 02, 11, 12, 22.
const DIAGONAL: [usize; 3] = [0, 3, 5];

/// Errors of model and wheel, by view.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ModelNoise {
    /// σ of s0, s1, s2 relative to s0: the error of the view's table, and what the model is said to miss.
    pub(super) relative: Vec<f64>,
    /// The wheels'. Their frame is the picture's on the axis, which the camera frame of a ray leaves by a degree at most.
    pub(super) wheels: Vec<WheelNoise>,
}

impl ModelNoise {
    /// Adds it to the covariances. Bands without an answer stay as they are.
    #[expect(clippy::cast_possible_truncation, reason = "observations are f32")]
    pub(super) fn add(&self, observation: &mut Observation) {
        let relative = self.relative.get(observation.view).copied().unwrap_or(0.0);
        let wheel = self.wheels.get(observation.view).unwrap_or(&WheelNoise::NONE);
        for (stokes, covariance) in observation.stokes.iter().zip(&mut observation.covariance) {
            if !covariance[0].is_finite() {
                continue;
            }
            let [s0, s1, s2] = stokes.map(f64::from);
            let more = wheel.covariance(s1, s2);
            covariance.iter_mut().zip(more).for_each(|(c, more)| *c += more as f32);
            let variance = (relative * s0).powi(2) as f32;
            DIAGONAL.into_iter().for_each(|k| covariance[k] += variance);
        }
    }
}
