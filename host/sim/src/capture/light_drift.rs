//! The light changes while the wheel turns: frame k is 1 + d_k times as bright, d_k = rate × (middle of its exposure).
//!
//! Bound: I_k <= ½ t (1 + P) s0, so leaving the drift out changes it by at most ½ |d_k| (1 + P) t s0.

use crate::frames::FrameSpec;
use crate::scene::Scene;
use crate::{Assessment, Facts};

/// Relative change d_k of the light in a frame.
pub(crate) fn change(scene: &Scene, frame: &FrameSpec) -> f64 {
    0.01 * scene.plan.light_drift_percent_per_s * frame.middle_s()
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let bound = facts.deterministic(|frame| 0.5 * change(facts.scene, frame) * (1.0 + facts.max_dolp));
    let rate = facts.scene.plan.light_drift_percent_per_s;
    let last = facts.frames.last().map_or(0.0, FrameSpec::middle_s);
    Assessment::new(bound, 0.0, format!("{rate} %/s over {last:.2} s"))
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_bound_holds(rate in -20.0..20.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.plan.light_drift_percent_per_s = rate;
            check_bound(&scene, Effect::LightDrift)?;
        }
    }
}
