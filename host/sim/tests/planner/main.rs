//! The planner keeps its promise: over random scenes the pruned picture never leaves the tolerance.
#![expect(clippy::unwrap_used, reason = "a scene that cannot be is a failed test")]

mod random;
mod scenes;

use host_sim::optical::{Evaluation, OpticalFacts, Renderer};
use host_sim::planner::{Plan, Why, difference};
use host_sim::{Effect, EffectSet};
use random::scene;
use rayon::prelude::*;

#[test]
fn the_tolerance_is_never_exceeded() {
    let results: Vec<(u64, f64, f64, f64, Plan)> = (0..520_u64)
        .into_par_iter()
        .map(|seed| {
            let scene = scene(seed);
            let view = scene.view();
            let tolerance = [1e-3, 3e-3, 1e-2, 5e-2][usize::try_from(seed % 4).unwrap()];
            let plan = Plan::new(&OpticalFacts::new(&scene.light, &scene.surfaces, &[view]), tolerance);
            let verified = plan.verify(&scene.light, &scene.surfaces, &view).unwrap();
            (seed, tolerance, plan.bound, verified.worst, plan)
        })
        .collect();
    let mut left_out = std::collections::BTreeMap::new();
    for (seed, tolerance, bound, worst, plan) in &results {
        assert!(worst <= tolerance, "scene {seed}: {worst:.2e} over {tolerance}: {plan:?}");
        assert!(bound <= tolerance, "scene {seed}");
        for row in plan.rows.iter().filter(|r| r.why == Why::Negligible) {
            *left_out.entry(row.effect.name()).or_insert(0) += 1;
        }
    }
    println!("left out though present: {left_out:?}");
    // The bounds are worth something: every effect was left out somewhere although the scene had it.
    for effect in Effect::OPTICAL {
        assert!(left_out.contains_key(effect.name()), "{} was never negligible: {left_out:?}", effect.name());
    }
}

/// Each bound by itself, whatever it is worth to the planner; says how far above the truth it lies.
#[test]
fn every_bound_holds_alone() {
    let evaluation = Evaluation::Prefiltered { tolerance: 1e-5 };
    let found: Vec<(Effect, f64, f64)> = (1000..1160_u64)
        .into_par_iter()
        .flat_map_iter(|seed| {
            let scene = scene(seed);
            let view = scene.view();
            let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[view]);
            let render = |set| Renderer::new(&scene.light, &scene.surfaces, set, evaluation).unwrap().render(&view);
            let full = render(EffectSet::ALL);
            let mut out = Vec::new();
            for effect in Effect::OPTICAL {
                let bound = facts.assess(effect, EffectSet::ALL).unwrap().bound;
                if bound > 0.0 && bound < 1.0 {
                    let (worst, _) = difference(&render(EffectSet::ALL.without(effect)).stokes, &full.stokes);
                    // Fixed points err by some 1e-5 themselves, and pictures are f32.
                    assert!(worst <= bound + 2e-4, "scene {seed}: {} by {worst:.2e} over {bound:.2e}", effect.name());
                    out.push((effect, bound, worst));
                }
            }
            out
        })
        .collect();
    for effect in Effect::OPTICAL {
        let own = found.iter().filter(|(e, _, worst)| *e == effect && *worst > 3e-5);
        let mut ratios: Vec<f64> = own.map(|(_, bound, worst)| bound / worst).collect();
        ratios.sort_by(f64::total_cmp);
        if let Some(median) = ratios.get(ratios.len() / 2) {
            println!(
                "{}: bound over truth, median {median:.1}, least {:.2}, {} scenes",
                effect.name(),
                ratios[0],
                ratios.len()
            );
        }
    }
}
