//! How far the effects' bounds lie above the truth, over the random scenes of the planner's tests and over the example scenes, and
//! what the plans leave out of the latter.

use super::random::scene;
use host_sim::optical::{Evaluation, OpticalFacts, Renderer};
use host_sim::planner::{Why, difference};
use host_sim::simulate::simulate;
use host_sim::{Effect, EffectSet, Scene};
use std::path::Path;

/// Differences below this are those of evaluation.
const LEAST: f64 = 3e-5;

pub(crate) fn run() {
    random_scenes();
    example_scenes();
}

/// Ratios of bound to truth where there is either: `unbounded` counts bounds of 1 and more.
fn report(kind: &str, effect: Effect, found: &[(f64, f64)]) {
    let mut ratios: Vec<f64> = found.iter().filter(|(b, _)| *b < 1.0).map(|(bound, truth)| bound / truth).collect();
    ratios.sort_by(f64::total_cmp);
    let unbounded = found.len() - ratios.len();
    let (least, middle) =
        (ratios.first().copied().unwrap_or(0.0), ratios.get(ratios.len() / 2).copied().unwrap_or(0.0));
    println!("{kind}\t{}\t{}\t{unbounded}\t{least:.2}\t{middle:.1}", effect.name(), ratios.len());
}

fn random_scenes() {
    println!("# bounds");
    println!("# scenes\teffect\tbounded\tunbounded\tleast_ratio\tmedian_ratio");
    let mut found = vec![Vec::new(); Effect::OPTICAL.len()];
    for seed in 0..520 {
        let scene = scene(seed);
        let view = scene.view();
        let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[view]);
        let evaluation = Evaluation::Prefiltered { tolerance: 1e-5 };
        let render = |set| Renderer::new(&scene.light, &scene.surfaces, set, evaluation).unwrap().render(&view).stokes;
        let full = render(EffectSet::ALL);
        for (effect, found) in Effect::OPTICAL.into_iter().zip(&mut found) {
            let bound = facts.assess(effect, EffectSet::ALL).unwrap().bound;
            if bound > 0.0 {
                let (worst, _) = difference(&render(EffectSet::ALL.without(effect)), &full);
                if worst > LEAST {
                    found.push((bound, worst));
                }
            }
        }
    }
    for (effect, found) in Effect::OPTICAL.into_iter().zip(&found) {
        report("random", effect, found);
    }
}

fn example_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let mut found = vec![Vec::new(); Effect::OPTICAL.len()];
    let mut plans = Vec::new();
    for file in files {
        let scene = Scene::read(&file).unwrap().resized(32, 24);
        for view in 0..scene.views.len() {
            let simulation = simulate(&scene, view, 1e-2, true).unwrap();
            for (effect, difference) in simulation.verification.unwrap().alone {
                let row = simulation.plan.rows.iter().position(|r| r.effect == effect).unwrap();
                let bound = simulation.plan.rows[row].assessment.bound;
                println!("# {} view {view} {}: {bound:.2e} over {:.2e}", scene.name, effect.name(), difference.worst);
                if difference.worst > LEAST {
                    found[row].push((bound, difference.worst));
                }
            }
            for tolerance in [0.05, 0.01, 0.005, 0.001] {
                let plan = simulate(&scene, view, tolerance, false).unwrap().plan;
                let gone = plan.rows.iter().filter(|r| r.why == Why::Negligible).map(|r| r.effect.name());
                let gone: Vec<&str> = gone.collect();
                plans.push(format!("{}\t{view}\t{tolerance}\t{:.1e}\t{}", scene.name, plan.bound, gone.join(" ")));
            }
        }
    }
    for (effect, found) in Effect::OPTICAL.into_iter().zip(&found) {
        report("example", effect, found);
    }
    println!("# plans\n# scene\tview\ttolerance\tbound\tleft_out_though_present");
    plans.iter().for_each(|line| println!("{line}"));
}
