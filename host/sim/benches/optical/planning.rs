//! What planning saves, against the same picture with all effects on, evaluated to the same accuracy.
//!
//! - loop: the pixel loop alone.
//! - warm: survey, planning (not for the full picture), light, tables and pixel loop, into the memory of an earlier picture.
//! - cold: the same into fresh memory.

use super::least;
use super::scene::{Scene, dielectric, overcast, photographed, surface};
use host_sim::EffectSet;
use host_sim::optical::{OpticalFacts, Renderer};
use host_sim::planner::{Plan, difference};
use std::time::Instant;

const SIDE: usize = 1024;
const TOLERANCE: f64 = 1e-2;
const RUNS: usize = 5;

type Picture = Vec<[[f32; 3]; 3]>;

/// ns per pixel of loop, survey and planning, and all; with the picture.
fn run_once(scene: &Scene, planned: bool, memory: Picture) -> ([f64; 3], Picture) {
    let ns = |start: Instant| start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64;
    let view = scene.view();
    let start = Instant::now();
    let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[view]);
    let plan = Plan::new(&facts, TOLERANCE);
    let planning = ns(start);
    // The full picture needs the survey, but neither bounds nor a plan.
    let start = if planned { start } else { Instant::now() };
    let own = (!planned).then(|| host_sim::optical::Survey::new(&view, scene.surfaces.len()));
    let survey = own.as_ref().unwrap_or(&facts.surveys()[0]);
    let effects = if planned { plan.effects } else { EffectSet::ALL };
    let renderer = Renderer::new(&scene.light, &scene.surfaces, effects, plan.evaluation).unwrap();
    let rendering = renderer.render_into(&view, survey, memory);
    let all = ns(start);
    let pixels = rendering.timing.pixels.as_nanos() as f64 / scene.pixels.len() as f64;
    ([pixels, planning, all], rendering.stokes)
}

pub(crate) fn run() {
    let dark = |light, alpha, bumps, albedo| Scene::new(light, surface(dielectric(), alpha), SIDE, bumps, albedo);
    let mut cases = vec![("overcast_smooth_brewster", dark(overcast(), 0.001, 0.0, 0.0))];
    if let Some(light) = photographed() {
        cases.push(("photographed_sky_rough_bumpy_diffuse", dark(light, 0.25, 0.1, 0.3)));
    }
    println!("# planning: tolerance {TOLERANCE}, 1024 x 1024 pixels, least of {RUNS} alternating runs");
    println!("# scene\tkind\tplanned_ns\tfull_ns\tratio");
    for (name, scene) in &cases {
        let (mut planned, mut full, mut cold) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
        let [mut a, mut b] = [Picture::new(), Picture::new()];
        for _ in 0..RUNS {
            for (k, on) in [true, false].into_iter().enumerate() {
                cold[k].push(run_once(scene, on, Vec::new()).0[2]);
            }
            let (times, picture) = run_once(scene, true, a);
            planned.push(times);
            a = picture;
            let (times, picture) = run_once(scene, false, b);
            full.push(times);
            b = picture;
        }
        let of = |times: &[[f64; 3]], k: usize| least(times.iter().map(|t| t[k]));
        let [cold_planned, cold_full] = cold.map(least);
        for (kind, p, f) in [
            ("loop", of(&planned, 0), of(&full, 0)),
            ("warm", of(&planned, 2), of(&full, 2)),
            ("cold", cold_planned, cold_full),
        ] {
            println!("{name}\t{kind}\t{p:.1}\t{f:.1}\t{:.2}", f / p);
        }
        println!("{name}\tsurvey_and_planning\t{:.1}\t0\t0", of(&planned, 1));
        let (worst, _) = difference(&a, &b);
        println!("# {name}: true difference {worst:.1e}");
        let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[scene.view()]);
        for row in &Plan::new(&facts, TOLERANCE).rows {
            println!("#   {:22} {:9.1e} {:?}", row.effect.name(), row.assessment.bound, row.why);
        }
    }
}
