//! What the optical renderer costs, how far off it is, and what planning saves: `cargo bench -p host-sim --bench optical`, or with
//! `-- planning accuracy costs bounds scenes` some of its parts (by default all but `bounds` and `scenes`, which take minutes).
//!
//! Every table is tab-separated under a line that starts with `#` and names its columns; other lines that start with `#` are remarks.
//! Times are wall nanoseconds per pixel of three bands on one thread, unless a column says otherwise.
//!
//! - planning: scene, kind (loop, warm, cold, survey_and_planning), planned_ns, full_ns, ratio
//! - accuracy: light, alpha, tolerance, ns_per_pixel, nodes, error_rms, error_worst, reference
//! - costs: effect, full_ns, saved_ns
//! - bounds: scenes, effect, bounded, unbounded, least_ratio, median_ratio; then scene, view, tolerance, bound,
//!   left_out_though_present
//! - scenes: scene, view, tolerance, seconds, planning_s, picture_s, surfaces, direct_pixels, nodes, effects

#![expect(clippy::unwrap_used, reason = "a panic is a failed run")]

mod accuracy;
mod bounds;
mod costs;
mod planning;
#[path = "../../tests/planner/random.rs"]
mod random;
mod scene;
mod scenes;

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted =
        |part: &str| chosen.iter().any(|c| c == part) || (chosen.is_empty() && !matches!(part, "bounds" | "scenes"));
    // CPU time is what is compared.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for (part, run) in [
            ("planning", planning::run as fn()),
            ("accuracy", accuracy::run),
            ("costs", costs::run),
            ("bounds", bounds::run),
            ("scenes", scenes::run),
        ] {
            if wanted(part) {
                run();
            }
        }
    });
}

/// The least of several timings: what else a machine does only adds.
fn least(times: impl IntoIterator<Item = f64>) -> f64 {
    times.into_iter().fold(f64::INFINITY, f64::min)
}
