//! Tolerance against time and measured error, all effects on.
//!
//! Columns: light; GGX alpha; tolerance asked of interpolation; ns per pixel, light and tables included, 512 × 512 pixels of a flat
//! plane; nodes computed (0: every pixel for itself, timed over 48 × 48); rms and worst |Δs_k|/s0 at 64 pixels against the reference. The reference is
//! adaptive quadrature to 1e-7 under formulas. Under the map it is the prefiltered method with its finest cells, every pixel for
//! itself: what that leaves out is the error of those cells, 1e-4 to 4e-4 ([`host_optics::prefilter::Fineness`]).

use super::scene::{Scene, dielectric, overcast, photographed, surface, uniform};
use host_sim::EffectSet;
use host_sim::optical::{Evaluation, Method, Renderer, SceneLight};
use host_sim::planner::difference;
use std::time::Instant;

const SIDE: usize = 512;
const SMALL: usize = 8;
/// Pixels of a side where every pixel is evaluated for itself.
const PROBE: usize = 48;

pub(crate) fn run() {
    println!("# accuracy");
    println!("# light\talpha\ttolerance\tns_per_pixel\tnodes\terror_rms\terror_worst\treference");
    let adaptive = Evaluation::Adaptive { tolerance: 1e-7 };
    let finest = Evaluation::Prefiltered { tolerance: 1e-6 };
    rows("uniform", &uniform(), adaptive);
    rows("overcast", &overcast(), adaptive);
    if let Some(light) = photographed() {
        rows("map", &light, finest);
    }
}

fn rows(name: &str, light: &SceneLight, reference: Evaluation) {
    let render = |scene: &Scene, evaluation| {
        let start = Instant::now();
        let renderer = Renderer::new(&scene.light, &scene.surfaces, EffectSet::ALL, evaluation).unwrap();
        let rendering = renderer.render(&scene.view());
        (rendering, start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64)
    };
    for alpha in [0.05, 0.1, 0.25] {
        let scene = |side| Scene::new(light.clone(), surface(dielectric(), alpha), side, 0.0, 0.0);
        let (truth, _) = render(&scene(SMALL), reference);
        let (large, probe) = (scene(SIDE), scene(PROBE));
        for tolerance in [3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4] {
            let evaluation = Evaluation::Prefiltered { tolerance };
            // Where no table serves, fewer pixels tell the time of one as well.
            let (mut found, mut ns) = render(&probe, evaluation);
            let mut side = PROBE;
            if !matches!(found.surfaces[0].method, Method::Direct) {
                (found, ns) = render(&large, evaluation);
                side = SIDE;
            }
            let step = side / SMALL;
            let at = |k: usize| found.stokes[(k / SMALL) * step * side + (k % SMALL) * step];
            let same: Vec<_> = (0..SMALL * SMALL).map(at).collect();
            let (worst, rms) = difference(&same, &truth.stokes);
            let nodes = if let Method::Table { nodes, .. } = found.surfaces[0].method { nodes } else { 0 };
            let by = if matches!(reference, Evaluation::Adaptive { .. }) { "adaptive" } else { "finest_cells" };
            println!("{name}\t{alpha}\t{tolerance:.0e}\t{ns:.1}\t{nodes}\t{rms:.2e}\t{worst:.2e}\t{by}");
        }
    }
}
