//! From a tolerance to the set of optical effects a picture needs.
//!
//! The bounds of the effects are relative to the s0 a picture has *with* the effect, whatever else was left out before it. So
//! the picture without several differs from the full one by at most Π (1 + b) − 1 of the full s0: each step changes at most b of an
//! s0 that has itself grown by at most the factors before. The planner tries every subset and takes the one that saves the
//! most time within the budget.
//!
//! Interpolation errs too, which is measured and not proved: a fifth of the tolerance is kept for it, and it is asked to err by no
//! more than a third of what the effects left out have not used up. Two pictures are compared, so half would be all of it; the
//! rest is for pixels between those at which interpolation was measured.

use crate::optical::{Evaluation, OpticalFacts, PixelMap, Renderer, Rendering, SceneLight, Surface};
use crate::{Assessment, Effect, EffectSet};
use host_optics::OpticsError;
use std::time::Duration;

/// Share of the tolerance that is kept for evaluation.
const EVALUATION_SHARE: f64 = 0.2;

/// Part of what effects left out have not used up that the evaluation of one picture may err by.
const EVALUATION_PART: f64 = 1.0 / 3.0;

/// Differences are not asked of pixels darker than this share of the picture's mean s0: relative to nothing they mean nothing.
const DARK: f64 = 0.01;

/// What to simulate, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Largest change of any Stokes component allowed, relative to s0.
    pub tolerance: f64,
    /// What is simulated.
    pub effects: EffectSet,
    /// How.
    pub evaluation: Evaluation,
    /// At most this is lost by what was left out, relative to s0.
    pub bound: f64,
    /// One per optical effect, in [`Effect::OPTICAL`]'s order.
    pub rows: Vec<Row>,
}

/// One effect of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which.
    pub effect: Effect,
    /// What is known of it, given what else is simulated.
    pub assessment: Assessment,
    /// Whether it is simulated.
    pub on: bool,
    /// Why.
    pub why: Why,
}

/// Why an effect is on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Why {
    /// Off: the scene does not have it.
    Absent,
    /// Off: its bound fits the budget.
    Negligible,
    /// On: its bound alone is over the budget.
    Needed,
    /// On: it would fit alone, but others that save more are left out already.
    BudgetSpent,
}

/// The true difference between a plan's picture and the full one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verified {
    /// Largest |Δs_k|/s0 over pixels, bands and components.
    pub worst: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// Wall time of the plan's picture and of the full one.
    pub time: [Duration; 2],
}

impl Plan {
    /// The cheapest set of effects within `tolerance` of the full picture.
    #[must_use]
    pub fn new(facts: &OpticalFacts<'_>, tolerance: f64) -> Self {
        let budget = tolerance * (1.0 - EVALUATION_SHARE);
        let assess = |effect, on| facts.assess(effect, on).map(|assessment| (effect, assessment));
        let alone: Vec<(Effect, Assessment)> =
            Effect::OPTICAL.into_iter().filter_map(|effect| assess(effect, EffectSet::ALL)).collect();
        let absent: Vec<Effect> = alone.iter().filter(|(_, a)| !a.applies).map(|(e, _)| *e).collect();
        let base = absent.iter().fold(EffectSet::ALL, |set, e| set.without(*e));
        let present: Vec<&(Effect, Assessment)> = alone.iter().filter(|(_, a)| a.applies).collect();
        let mut dependent = Vec::new();
        let mut best = (base, 0.0_f64, 0.0_f64);
        for choice in 1..1_u32 << present.len() {
            let gone = present.iter().enumerate().filter(|(k, _)| choice >> k & 1 != 0).map(|(_, p)| *p);
            let set = gone.clone().fold(base, |set, (e, _)| set.without(*e));
            let saved: f64 = gone.clone().map(|(_, a)| a.cost_ns_per_pixel).sum();
            // Cheap refusals first: a bound that depends on the rest is only asked for where the others fit.
            let others = gone.clone().filter(|(e, _)| *e != Effect::NormalVariation);
            let mut growth: f64 = others.map(|(_, a)| 1.0 + a.bound).product();
            if growth - 1.0 > budget || saved < best.1 {
                continue;
            }
            if gone.clone().any(|(e, _)| *e == Effect::NormalVariation) {
                growth *= 1.0 + normal_variation(facts, set, &mut dependent);
            }
            if growth - 1.0 <= budget && (saved > best.1 || growth - 1.0 < best.2) {
                best = (set, saved, growth - 1.0);
            }
        }
        let (effects, _, bound) = best;
        let row = |(effect, alone): (Effect, Assessment)| {
            let chosen = || facts.assess(effect, effects);
            let assessment = if effect == Effect::NormalVariation { chosen().unwrap_or(alone) } else { alone };
            let on = effects.contains(effect);
            let why = match (on, absent.contains(&effect)) {
                (false, true) => Why::Absent,
                (false, false) => Why::Negligible,
                (true, _) if assessment.bound <= budget => Why::BudgetSpent,
                (true, _) => Why::Needed,
            };
            Row { effect, assessment, on, why }
        };
        let evaluation = Evaluation::Prefiltered { tolerance: EVALUATION_PART * (tolerance - bound) };
        let rows = alone.clone().into_iter().map(row).collect();
        Self { tolerance, effects, evaluation, bound, rows }
    }

    /// Renders a view as planned and in full, and compares.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn verify(
        &self,
        light: &SceneLight,
        surfaces: &[Surface],
        view: &PixelMap<'_>,
    ) -> Result<Verified, OpticsError> {
        let render = |effects| Ok(Renderer::new(light, surfaces, effects, self.evaluation)?.render(view));
        let (planned, full): (Rendering, Rendering) = (render(self.effects)?, render(EffectSet::ALL)?);
        let (worst, rms) = difference(&planned.stokes, &full.stokes);
        Ok(Verified { worst, rms, time: [planned.timing.total(), full.timing.total()] })
    }
}

/// The bound of normal variation without what `set` lacks, asked for once per set of what it depends on.
fn normal_variation(facts: &OpticalFacts<'_>, set: EffectSet, known: &mut Vec<(EffectSet, f64)>) -> f64 {
    let relevant = [Effect::Roughness, Effect::IncidentPolarization, Effect::Diffuse].into_iter();
    let key = relevant.filter(|e| set.contains(*e)).fold(EffectSet::NONE, EffectSet::with);
    if let Some((_, bound)) = known.iter().find(|(k, _)| *k == key) {
        return *bound;
    }
    let bound = facts.assess(Effect::NormalVariation, set).map_or(f64::INFINITY, |a| a.bound);
    known.push((key, bound));
    bound
}

/// Largest and root-mean-square |Δs_k|/s0 of `stokes` against `full`, pixels brighter than a hundredth of their band's mean.
#[must_use]
pub fn difference(stokes: &[[[f32; 3]; 3]], full: &[[[f32; 3]; 3]]) -> (f64, f64) {
    let mut mean = [0.0_f64; 3];
    let mut lit = 0.0_f64;
    for pixel in full {
        lit += if pixel.iter().any(|[s0, ..]| *s0 > 0.0) { 1.0 } else { 0.0 };
        for (m, [s0, ..]) in mean.iter_mut().zip(pixel) {
            *m += f64::from(*s0);
        }
    }
    let (mut worst, mut sum, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (found, full) in stokes.iter().zip(full) {
        for ((found, full), mean) in found.iter().zip(full).zip(mean) {
            let s0 = f64::from(full[0]);
            if s0 <= DARK * mean / lit.max(1.0) {
                continue;
            }
            for (a, b) in found.iter().zip(full) {
                let change = f64::from((a - b).abs()) / s0;
                worst = worst.max(change);
                sum += change * change;
                count += 1.0;
            }
        }
    }
    (worst, if count > 0.0 { (sum / count).sqrt() } else { 0.0 })
}

/// The relative noise of s0 where it is least: at a full well, from `frames` equispaced polarizer angles of unpolarized light,
/// √((w + r²)/N)/w with the well w and the read noise r in electrons. A tolerance of a tenth of it hides in the noise.
#[must_use]
pub fn camera_noise(full_well_e: f64, read_noise_e: f64, frames: u32) -> f64 {
    ((full_well_e + read_noise_e * read_noise_e) / f64::from(frames.max(1))).sqrt() / full_well_e
}
