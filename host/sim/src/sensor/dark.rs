//! Charge without light: Poisson distributed with the dark current times the exposure as its mean.
//!
//! Bound: its mean is taken for light, constant over the frames. A constant y is what unpolarized light of s0 = 2 y/t gives, and
//! nothing else: 2 (dark current)/(t s0). Beside it, its noise ([`Facts::random`], steps of one electron).

use rand::Rng;
use rand_distr::Poisson;

use crate::frames::{Row, RowStage};
use crate::rng::Draw;
use crate::scene::Scene;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 21.0;

/// The stage.
pub(crate) struct Dark {
    current_e_per_s: f64,
}

impl Dark {
    /// `None` for a sensor without dark current.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let current_e_per_s = scene.camera.dark_current_e_per_s;
        (current_e_per_s > 0.0).then_some(Self { current_e_per_s })
    }
}

impl RowStage for Dark {
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]) {
        let mean = 1e-3 * self.current_e_per_s * at.frame.exposure_ms();
        // No distribution for a mean that is 0 but for rounding.
        if let Ok(charge) = Poisson::new(mean) {
            at.draws(Draw::Dark, electrons, |e, random| *e += single(random.sample(charge)));
        }
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let per_ms = 1e-3 * facts.scene.camera.dark_current_e_per_s;
    if per_ms <= 0.0 {
        return Assessment::new(0.0, COST_NS, "no dark current".to_owned());
    }
    let mean = 2.0 * per_ms / (facts.throughput() * facts.dark);
    let noise = facts.random(|frame| per_ms * frame.exposure_ms(), 1.0);
    let longest = facts.frames.iter().map(|f| per_ms * f.exposure_ms()).fold(0.0, f64::max);
    Assessment::new(mean + noise, COST_NS, format!("{longest:.3} e in the longest frame"))
}

#[cfg(test)]
mod tests {
    use crate::frames::Exposer;
    use crate::frames::testing::{check_bound, flat, moments, studio};
    use crate::{Effect, EffectSet};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(log_current in -2.0..5.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.dark_current_e_per_s = 10_f64.powf(log_current);
            check_bound(&scene, Effect::Dark)?;
        }
    }

    #[test]
    fn mean_and_variance_are_current_times_exposure() {
        let mut scene = studio(4);
        (scene.camera.width_px, scene.camera.height_px, scene.camera.dark_current_e_per_s) = (200, 150, 3000.0);
        let mut image = flat(&scene, [1.0, 0.0, 0.0]);
        image.colors.iter_mut().for_each(|c| c.s0.fill(0.0));
        let exposer = Exposer::new(&scene, 0, &image, EffectSet::NONE.with(Effect::Dark)).unwrap();
        let expected = 3000.0 * 1e-3 * exposer.frames()[0].exposure_ms();
        let (mean, variance) = moments(&exposer.electrons(0));
        assert!((mean / expected - 1.0).abs() < 0.02 && (variance / expected - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
