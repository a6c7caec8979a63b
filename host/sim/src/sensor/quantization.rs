//! Samples are whole numbers: DN are rounded to nearest.
//!
//! Bound: half a DN per frame, at the darkest photosite.

use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 1.3;

/// Rounds DN to nearest.
pub(crate) fn round(dn: &mut [f32]) {
    dn.iter_mut().for_each(|v| *v = v.round());
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let gain = facts.scene.camera.gain_e_per_dn;
    let light = facts.throughput() * facts.dark;
    let bound = facts.deterministic(|frame| 0.5 * gain / (frame.exposure_ms() * light));
    Assessment::new(bound, COST_NS, format!("half a DN is {:.2} e", 0.5 * gain))
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(gain in 0.5..200.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.gain_e_per_dn = gain;
            check_bound(&scene, Effect::Quantization)?;
        }
    }
}
