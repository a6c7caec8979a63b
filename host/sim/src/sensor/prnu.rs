//! Photosites differ in sensitivity: a Gaussian factor of mean 1, cut at 5σ, fixed for the sensor (the seed).
//!
//! Bound: a photosite's factor g is the same in all frames and scales all components, and |s_j| <= s0: |g − 1| <= 5σ.

use rand::Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

use crate::frames::{Row, RowStage};
use crate::rng::{Draw, Stream};
use crate::scene::Scene;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 0.1;

/// Where the distribution is cut, in σ.
const CUT: f64 = 5.0;

/// The factor of every photosite, row-major, height × width.
pub(crate) struct Prnu {
    factors: Vec<f32>,
}

impl Prnu {
    /// `None` for a perfect sensor.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let sigma = 0.01 * scene.camera.prnu_percent;
        let photosites = u64::from(scene.camera.width_px) * u64::from(scene.camera.height_px);
        let stream = Stream::new(scene.seed, Draw::Prnu, 0, 0);
        let factor = |index: u64| {
            let normal: f64 = stream.at(index).sample(StandardNormal);
            single(1.0 + sigma * normal.clamp(-CUT, CUT))
        };
        (sigma > 0.0).then(|| Self { factors: (0..photosites).into_par_iter().map(factor).collect() })
    }
}

impl RowStage for Prnu {
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]) {
        let factors = &self.factors[at.row * electrons.len()..][..electrons.len()];
        electrons.iter_mut().zip(factors).for_each(|(e, f)| *e *= f);
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let percent = facts.scene.camera.prnu_percent;
    Assessment::new(0.01 * CUT * percent, COST_NS, format!("{percent} % rms, cut at {CUT}σ"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(percent in 0.0..10.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.prnu_percent = percent;
            check_bound(&scene, Effect::Prnu)?;
        }
    }

    #[test]
    fn factors_have_the_stated_mean_and_deviation() {
        let mut scene = studio(5);
        (scene.camera.width_px, scene.camera.height_px, scene.camera.prnu_percent) = (250, 200, 2.0);
        let factors = Prnu::of(&scene).unwrap().factors;
        let n = factors.len() as f64;
        let mean = factors.iter().map(|f| f64::from(*f)).sum::<f64>() / n;
        let sigma = (factors.iter().map(|f| (f64::from(*f) - mean).powi(2)).sum::<f64>() / n).sqrt();
        // Standard errors for 50 000 factors: 9e-5 of the mean, 6.3e-5 of σ.
        assert!((mean - 1.0).abs() < 5e-4 && (sigma - 0.02).abs() < 3e-4, "{mean} {sigma}");
    }
}
