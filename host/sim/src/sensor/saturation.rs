//! Wells and converters have an end: charge beyond the full well is lost, samples end at the largest (and at the smallest) DN.
//!
//! Bound: with C the charge at which the first of the two ends, a frame of charge E t I loses at most E t I − C, and
//! I <= ½ (1 + P) s0. Relative to s0 that is most where s0 is largest. Of light alone: noise on top may saturate a little
//! earlier, and the effect is said to apply from 6σ of shot and read noise below C on.

use crate::frames::{Row, RowStage};
use crate::scene::Scene;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 0.2;

/// The end of the well.
pub(crate) struct Well {
    full_e: f32,
}

impl Well {
    pub(crate) fn of(scene: &Scene) -> Self {
        Self { full_e: single(scene.camera.full_well_e) }
    }
}

impl RowStage for Well {
    fn apply(&self, _: &Row<'_>, electrons: &mut [f32]) {
        electrons.iter_mut().for_each(|e| *e = e.min(self.full_e));
    }
}

/// Cuts DN at the ends of the converter.
pub(crate) fn clip(dn: &mut [f32], white_level_dn: f32) {
    dn.iter_mut().for_each(|v| *v = v.clamp(0.0, white_level_dn));
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let (camera, end) = (&facts.scene.camera, facts.scene.camera.saturation_e());
    let share = 0.5 * (1.0 + facts.max_dolp);
    let full = |exposure_ms: f64| exposure_ms * facts.throughput() * facts.bright;
    let bound = facts.deterministic(|frame| (share - end / full(frame.exposure_ms())).max(0.0));
    let longest = facts.frames.iter().map(|f| f.exposure_ms()).fold(0.0, f64::max);
    let charge = share * full(longest) + 1e-3 * camera.dark_current_e_per_s * longest;
    let noise = (charge + camera.read_noise_e * camera.read_noise_e).sqrt();
    let reason = format!("up to {charge:.0} e of {end:.0} e");
    Assessment { applies: charge + 6.0 * noise > end, bound, cost_ns_per_pixel: COST_NS, reason }
}

#[cfg(test)]
mod tests {
    use crate::frames::Exposer;
    use crate::frames::testing::{check_bound, picture, studio};
    use crate::scene::Exposure;
    use crate::{Effect, EffectSet};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(fill in 0.1..3.0, full_well in 5e3..5e4, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.plan.exposure = Exposure::Fill(fill);
            scene.camera.full_well_e = full_well;
            let (change, assessed) = check_bound(&scene, Effect::Saturation)?;
            prop_assert!(assessed.applies || change < 1e-6);
        }
    }

    #[test]
    fn a_full_well_and_a_full_converter_both_end_the_scale() {
        for (full_well_e, expected) in [(1e6, 4095.0), (5000.0, 5000.0 / 2.0 + 64.0)] {
            let mut scene = studio(2);
            scene.camera.full_well_e = full_well_e;
            (scene.camera.gain_e_per_dn, scene.camera.black_level_dn) = (2.0, 64);
            scene.plan.exposure = Exposure::Fixed(vec![1e8]);
            let frame =
                Exposer::new(&scene, 0, &picture(&scene), EffectSet::NONE.with(Effect::Saturation)).unwrap().dn(0);
            assert!(frame.iter().all(|dn| (dn - expected).abs() < 1e-3), "{}", frame[0]);
        }
    }
}
