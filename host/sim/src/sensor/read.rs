//! Noise of the amplifier: Gaussian, the same for every sample.
//!
//! Bound: [`Facts::random`] of its variance at the darkest photosite. (For Gaussian noise the inequality is that of
//! Chernoff, x = σ √(2L) = 5.4σ.)

use rand::Rng;
use rand_distr::StandardNormal;

use crate::frames::{Row, RowStage};
use crate::rng::Draw;
use crate::scene::Scene;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 5.0;

/// The stage.
pub(crate) struct Read {
    sigma_e: f64,
}

impl Read {
    /// `None` for a perfect amplifier.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let sigma_e = scene.camera.read_noise_e;
        (sigma_e > 0.0).then_some(Self { sigma_e })
    }
}

impl RowStage for Read {
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]) {
        at.draws(Draw::Read, electrons, |e, random| {
            let normal: f64 = random.sample(StandardNormal);
            *e += single(self.sigma_e * normal);
        });
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let sigma = facts.scene.camera.read_noise_e;
    let bound = facts.random(|_| sigma * sigma, 0.0);
    Assessment::new(bound, COST_NS, format!("{sigma} e rms"))
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
        fn the_bound_holds(sigma in 0.0..200.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.read_noise_e = sigma;
            check_bound(&scene, Effect::Read)?;
        }
    }

    /// It adds its variance whatever the light: the other half of the photon transfer curve.
    #[test]
    fn the_variance_is_that_of_the_amplifier() {
        let mut scene = studio(4);
        (scene.camera.width_px, scene.camera.height_px, scene.camera.read_noise_e) = (200, 150, 7.0);
        let both = EffectSet::NONE.with(Effect::Read).with(Effect::Shot);
        let image = flat(&scene, [1.0, 0.0, 0.0]);
        let read = moments(&Exposer::new(&scene, 0, &image, EffectSet::NONE.with(Effect::Read)).unwrap().electrons(0));
        let all = moments(&Exposer::new(&scene, 0, &image, both).unwrap().electrons(0));
        assert!((read.1 / 49.0 - 1.0).abs() < 0.04, "{read:?}");
        assert!((all.1 / (49.0 + all.0) - 1.0).abs() < 0.04, "{all:?}");
    }
}
