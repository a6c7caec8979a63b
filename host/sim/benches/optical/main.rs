//! What the optical renderer costs, how far off it is, and what planning saves: `cargo bench -p host-sim --bench optical`, or with
//! `-- planning accuracy costs bounds` some of its parts (all but `bounds`, which takes minutes, by default).
//!
//! Every table is tab-separated under a line that starts with `#` and names its columns. Times are wall nanoseconds per pixel of
//! three bands on one thread.

#![expect(clippy::unwrap_used, reason = "a panic is a failed run")]

mod accuracy;
mod bounds;
mod costs;
mod planning;
#[path = "../../tests/planner/random.rs"]
mod random;
mod scene;

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |part: &str| chosen.iter().any(|c| c == part) || (chosen.is_empty() && part != "bounds");
    // CPU time is what is compared.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for (part, run) in [
            ("planning", planning::run as fn()),
            ("accuracy", accuracy::run),
            ("costs", costs::run),
            ("bounds", bounds::run),
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
