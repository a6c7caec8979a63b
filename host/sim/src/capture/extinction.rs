//! The polarizer passes some of what it should stop: its row is ½ t [1, ε cos 2φ, ε sin 2φ] with ε = (ER − 1)/(ER + 1).
//!
//! Bound: taking it as ideal changes a frame by at most ½ t (1 − ε) P s0.

use protocol_polar::efficiency_from_extinction_ratio;

use crate::scene::Scene;
use crate::{Assessment, Facts};

/// Efficiency ε.
pub(crate) fn efficiency(scene: &Scene) -> f64 {
    efficiency_from_extinction_ratio(scene.polarizer.extinction_ratio)
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let bound = facts.deterministic(|_| 0.5 * (1.0 - efficiency(facts.scene)) * facts.max_dolp);
    let ratio = facts.scene.polarizer.extinction_ratio;
    Assessment::new(bound, 0.0, format!("extinction ratio {ratio}, DoLP up to {:.3}", facts.max_dolp))
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_bound_holds(log_ratio in 0.2..5.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.polarizer.extinction_ratio = 10_f64.powf(log_ratio);
            check_bound(&scene, Effect::Extinction)?;
        }
    }
}
