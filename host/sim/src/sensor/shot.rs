//! Light comes in quanta: the charge of a photosite is Poisson distributed with the expected charge as its mean.
//!
//! Bound: at the darkest photosite a frame has I <= ½ t (1 + P) s0 of the light, so a variance of at most that many electrons;
//! the weighted sum of Poisson variables stays within Bernstein's inequality ([`Facts::random`], steps of one electron). Brighter
//! photosites are relatively less noisy.

use rand::Rng;
use rand_distr::Poisson;

use crate::frames::{Row, RowStage};
use crate::rng::{Draw, Generator};
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 25.0;

/// The stage.
pub(crate) struct Shot;

impl RowStage for Shot {
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]) {
        // No light, and what rounding leaves below it, has no quanta.
        let quanta = |mean, random: &mut Generator| Poisson::new(mean).map_or(0.0, |p| single(random.sample(p)));
        at.draws(Draw::Shot, electrons, |e, random| *e = quanta(f64::from(*e), random));
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let share = 0.5 * (1.0 + facts.max_dolp) * facts.throughput() * facts.dark;
    let bound = facts.random(|frame| share * frame.exposure_ms(), 1.0);
    let least = facts.frames.iter().map(|f| share * f.exposure_ms()).fold(f64::INFINITY, f64::min);
    Assessment::new(bound, COST_NS, format!("{least:.0} e at most in the shortest frame of the darkest photosite"))
}

#[cfg(test)]
mod tests {
    use crate::frames::Exposer;
    use crate::frames::testing::{check_bound, flat, moments, studio};
    use crate::scene::Exposure;
    use crate::{Effect, EffectSet};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(log_us in 1.0..6.0, seed in 0_u64..1000, repeats in 1_u16..4) {
            let mut scene = studio(seed);
            scene.plan.exposure = Exposure::Fixed(vec![10_f64.powf(log_us)]);
            scene.plan.repeats = repeats;
            check_bound(&scene, Effect::Shot)?;
        }
    }

    /// Photon transfer: the variance of a flat field equals its mean, from a few electrons to a full well.
    #[test]
    fn the_variance_is_the_mean() {
        let mut scene = studio(11);
        (scene.camera.width_px, scene.camera.height_px) = (200, 150);
        for exposure_us in [10.0, 1e3, 1e5] {
            scene.plan.exposure = Exposure::Fixed(vec![exposure_us]);
            let image = flat(&scene, [1.0, 0.0, 0.0]);
            let frame = Exposer::new(&scene, 0, &image, EffectSet::NONE.with(Effect::Shot)).unwrap().electrons(0);
            let (mean, variance) = moments(&frame);
            let expected = 0.5 * scene.polarizer.throughput() * 1e-3 * exposure_us * scene.camera.response_e_per_ms[0];
            // 30 000 photosites: standard errors √(λ/n) of the mean and at most λ √((2 + 1/λ)/n) of the variance.
            let n = 30_000_f64;
            assert!((mean - expected).abs() < 5.0 * (expected / n).sqrt(), "{mean} for {expected}");
            let error = 5.0 * expected * ((2.0 + 1.0 / expected) / n).sqrt();
            assert!((variance - expected).abs() < error, "{variance} for {expected}");
        }
    }
}
