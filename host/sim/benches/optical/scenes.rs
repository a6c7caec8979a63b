//! What the example scenes take, whole: truth maps, planning and picture of every view, at a loose tolerance and at a tenth of the
//! camera's noise.

use host_sim::optical::Method;
use host_sim::simulate::{noise_of, simulate};
use host_sim::{Effect, Scene};
use std::path::Path;
use std::time::Instant;

pub(crate) fn run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    println!("# scenes: whole views in their own size");
    println!("# scene\tview\ttolerance\tseconds\tplanning_s\tpicture_s\tsurfaces\tdirect_pixels\tnodes\teffects");
    for file in files {
        let scene = Scene::read(&file).unwrap();
        for tolerance in [1e-2, 1e-3, 0.1 * noise_of(&scene)] {
            for view in 0..scene.views.len() {
                let start = Instant::now();
                let done = simulate(&scene, view, tolerance, false).unwrap();
                let seconds = start.elapsed().as_secs_f64();
                let direct = done.surfaces.iter().filter(|s| s.method == Method::Direct);
                let pixels: usize = direct.map(|s| s.pixels).sum();
                let nodes = |s: &host_sim::optical::SurfaceReport| match s.method {
                    Method::Table { nodes, .. } => nodes,
                    _ => 0,
                };
                let nodes: usize = done.surfaces.iter().map(nodes).sum();
                let effects = Effect::OPTICAL.into_iter().filter(|e| done.plan.effects.contains(*e)).count();
                let [planning, picture] = [done.timing.planning, done.timing.rendering].map(|t| t.as_secs_f64());
                println!(
                    "{}\t{view}\t{tolerance:.1e}\t{seconds:.2}\t{planning:.3}\t{picture:.2}\t{}\t{pixels}\t{nodes}\t{effects}",
                    file.file_stem().unwrap().display(),
                    done.surfaces.len(),
                );
            }
        }
    }
}
