//! The wheel rests beside where it was sent: a Gaussian error, one for each position it goes to (frames taken without a move
//! share it).
//!
//! Bound: |cos 2(φ + ε) − cos 2φ| <= 2 |sin ε|, so an error ε changes a frame by at most t P |sin ε| s0. The errors are
//! those the seed gives: the bound is of this capture, not of captures in general.

use protocol_polar::Radians;
use rand::Rng;
use rand_distr::StandardNormal;

use crate::frames::FrameSpec;
use crate::rng::{Draw, Stream};
use crate::scene::Scene;
use crate::{Assessment, Facts};

/// How far beyond the commanded angle the wheel rests in a frame.
pub(crate) fn error(scene: &Scene, view: usize, frame: &FrameSpec) -> Radians {
    let normal: f64 =
        Stream::new(scene.seed, Draw::Wheel, view as u64, frame.angle as u64).at(0).sample(StandardNormal);
    Radians(scene.wheel.angle_sigma.0 * normal)
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let bound = facts.deterministic(|frame| facts.max_dolp * error(facts.scene, facts.view, frame).0.sin());
    let sigma = facts.scene.wheel.angle_sigma.to_degrees().0;
    Assessment::new(bound, 0.0, format!("angle error {sigma:.3}° rms, DoLP up to {:.3}", facts.max_dolp))
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;
    use protocol_polar::Degrees;

    proptest! {
        #[test]
        fn the_bound_holds(sigma in 0.01..10.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.wheel.angle_sigma = Degrees(sigma).to_radians();
            check_bound(&scene, Effect::WheelError)?;
        }
    }
}
