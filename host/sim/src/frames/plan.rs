//! From a tolerance to the set of effects that frames need.

use host_image::StokesImage;
use protocol_polar::{Analyzer, LeastSquares};

use super::Exposer;
use crate::facts::counted;
use crate::planner::Why;
use crate::scene::Scene;
use crate::signal::Signal;
use crate::{Assessment, Effect, EffectSet, Facts, SimError};

/// Which effects are simulated in the frames of a view, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct FramePlan {
    /// Largest change of any Stokes component estimated from the frames, relative to s0.
    pub tolerance: f64,
    /// What is simulated.
    pub effects: EffectSet,
    /// At most this is lost by what was left out.
    pub bound: f64,
    /// One per effect, in [`Effect::CAPTURE`]'s order.
    pub rows: Vec<FrameRow>,
}

/// One effect of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameRow {
    /// Which.
    pub effect: Effect,
    /// What is known of it.
    pub assessment: Assessment,
    /// Whether it is simulated.
    pub on: bool,
    /// Why.
    pub why: Why,
}

impl FramePlan {
    /// The cheapest set within `tolerance`. Each effect left out changes Stokes by at most its bound b in units of an s0 that those
    /// before have changed; as in [`crate::planner`] the budget holds Π (1 + b) − 1.
    #[must_use]
    pub fn new(facts: &Facts<'_>, tolerance: f64) -> Self {
        let own = |effect| facts.assess(effect).map(|assessment| (effect, assessment));
        let assessed: Vec<(Effect, Assessment)> = Effect::CAPTURE.into_iter().filter_map(own).collect();
        let absent = assessed.iter().filter(|(_, a)| !a.applies).map(|(e, _)| *e);
        let base = absent.fold(EffectSet::ALL, EffectSet::without);
        let fits: Vec<&(Effect, Assessment)> =
            assessed.iter().filter(|(_, a)| a.applies && a.bound <= tolerance).collect();
        let (mut effects, mut saved, mut bound) = (base, 0.0, 0.0);
        for choice in 1..1_u32 << fits.len() {
            let gone = || fits.iter().enumerate().filter(|(k, _)| choice >> k & 1 != 0).map(|(_, p)| p);
            let lost = gone().map(|(_, a)| 1.0 + a.bound).product::<f64>() - 1.0;
            let cost: f64 = gone().map(|(_, a)| a.cost_ns_per_pixel).sum();
            if lost <= tolerance && (cost > saved || (cost >= saved && lost < bound)) {
                effects = gone().fold(base, |set, (e, _)| set.without(*e));
                (saved, bound) = (cost, lost);
            }
        }
        let row = |(effect, assessment): (Effect, Assessment)| {
            let on = effects.contains(effect);
            let why = match (on, assessment.applies) {
                (false, false) => Why::Absent,
                (false, true) => Why::Negligible,
                (true, _) if assessment.bound <= tolerance => Why::BudgetSpent,
                (true, _) => Why::Needed,
            };
            FrameRow { effect, assessment, on, why }
        };
        Self { tolerance, effects, bound, rows: assessed.into_iter().map(row).collect() }
    }
}

/// Largest difference of a Stokes component, relative to its photosite's s0, between the frames with `effects` and with
/// `reference`, estimated as [`Facts`] says and over the photosites that count there.
///
/// # Errors
/// As [`Facts::new`].
pub fn true_difference(
    scene: &Scene,
    view: usize,
    image: &StokesImage,
    effects: EffectSet,
    reference: EffectSet,
) -> Result<f64, SimError> {
    let (a, b) = (
        estimate(&Exposer::new(scene, view, image, effects)?, scene)?,
        estimate(&Exposer::new(scene, view, image, reference)?, scene)?,
    );
    let signal = Signal::new(&scene.camera, image, EffectSet::ALL);
    let least: Vec<f32> = signal.bands.iter().map(|band| counted(&band[0])).collect();
    let mut worst = 0.0_f64;
    for (index, s0) in signal.photosites()[0].iter().enumerate() {
        if *s0 >= least[signal.band(index / signal.width, index % signal.width)] {
            for (a, b) in a[index].iter().zip(b[index]) {
                worst = worst.max((a - b).abs() / f64::from(*s0));
            }
        }
    }
    Ok(worst)
}

/// Stokes of every photosite from all frames, e/ms.
fn estimate(exposer: &Exposer<'_>, scene: &Scene) -> Result<Vec<[f64; 3]>, SimError> {
    let ideal: Vec<Analyzer> = scene.plan.angles.iter().map(|a| Analyzer::ideal(*a)).collect();
    let solved = LeastSquares::new(&ideal).map_err(SimError::Angles)?;
    let camera = &scene.camera;
    let mut sum = vec![[0.0; 3]; usize::from(camera.width_px) * usize::from(camera.height_px)];
    for (k, spec) in exposer.frames().iter().enumerate() {
        let same: f64 = exposer.frames().iter().filter(|f| f.angle == spec.angle).map(|_| 1.0).sum();
        let scale = camera.gain_e_per_dn / (spec.exposure_ms() * scene.polarizer.throughput() * same);
        for (sum, dn) in sum.iter_mut().zip(exposer.dn(k)) {
            let y = (f64::from(dn) - f64::from(camera.black_level_dn)) * scale;
            sum.iter_mut().zip(solved.weights()).for_each(|(s, w)| *s += w[spec.angle] * y);
        }
    }
    Ok(sum)
}
