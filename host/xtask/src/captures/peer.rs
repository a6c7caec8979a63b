//! The same pixels fitted by scipy: the problem is written by our benchmark, which also answers it.

use super::document::{self, Section};
use crate::metadata::Metadata;
use crate::perf::python;
use crate::process;
use anyhow::{Context, Result, bail};
use serde::Deserialize;

const SCRIPT: &str = "host/xtask/perf/fit_peer.py";
const BENCH: &str = "cargo bench -p host-fit --bench joint";
const PACKAGES: [&str; 2] = ["numpy", "scipy"];

/// Fewest times that scipy must take longer than our tables.
const LEAST_RATIO: f64 = 200.0;
/// Largest differences of the answers with the same model, in σ: the median, and the worst, which is where a step that failed and
/// promised less than this was taken for the end.
const AGREEMENT_SIGMA: [f64; 2] = [1e-3, 0.03];

/// What the benchmark answers with one model.
#[derive(Deserialize)]
struct Ours {
    us_per_pixel: f64,
    answers: Vec<Answer>,
}

#[derive(Deserialize)]
struct Answer {
    evaluations: u32,
}

/// The part of the problem that is shown.
#[derive(Deserialize)]
struct Problem {
    direct: Ours,
    tables: Ours,
}

#[derive(Deserialize)]
struct Times {
    us_per_pixel: f64,
    evaluations: f64,
    pixels: usize,
}

#[derive(Deserialize)]
struct Agreement {
    same_minimum: usize,
    median_sigma: f64,
    worst_sigma: f64,
}

/// What the script prints.
#[derive(Deserialize)]
struct Peer {
    numpy: String,
    scipy: String,
    points: usize,
    model_difference: f64,
    vectorized: Times,
    two_point: Times,
    direct: Agreement,
    tables: Agreement,
}

/// Runs the benchmark and the script, one after the other, and writes the section.
pub(crate) fn run() -> Result<String> {
    let folder = Metadata::load()?.target_directory.join("accuracy");
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("pixels.json");
    println!("  {BENCH}");
    let bench = ["bench", "-q", "-p", "host-fit", "--bench", "joint", "--"];
    let rows = process::output(process::command(&process::cargo_program()).args(bench), BENCH)?;
    print!("{rows}");
    process::run(process::command(&process::cargo_program()).args(bench).arg("--dump").arg(&file), BENCH)?;
    let problem: Problem = serde_json::from_str(&std::fs::read_to_string(&file)?)?;
    println!("  {SCRIPT}");
    let mut script = process::command(&python(&PACKAGES)?.to_string_lossy());
    let text = process::output(script.arg(SCRIPT).arg(&file), SCRIPT)?;
    let peer: Peer = serde_json::from_str(&text).with_context(|| format!("{SCRIPT} printed something else"))?;
    document::write(Section::Peer, &section(&rows, &problem, &peer))?;
    let fastest = peer.vectorized.us_per_pixel.min(peer.two_point.us_per_pixel);
    let ratio = fastest / problem.tables.us_per_pixel;
    if ratio < LEAST_RATIO || !agrees(&peer.direct) {
        bail!("{ratio:.0} times slower than tables, answers within {:.1e} sigma", peer.direct.worst_sigma);
    }
    Ok(format!("scipy takes {ratio:.0} times as long; {} written", document::FILE))
}

fn agrees(direct: &Agreement) -> bool {
    direct.median_sigma <= AGREEMENT_SIGMA[0] && direct.worst_sigma <= AGREEMENT_SIGMA[1]
}

fn section(rows: &str, problem: &Problem, peer: &Peer) -> String {
    let evaluations = |ours: &Ours| {
        ours.answers.iter().map(|a| f64::from(a.evaluations)).sum::<f64>() / ours.answers.len().max(1) as f64
    };
    let tables = problem.tables.us_per_pixel;
    let row = |name: &str, us: f64, evaluations: f64, agreement: &str| {
        format!("| {name} | {us:.1} | {evaluations:.1} | {:.0} | {agreement} |\n", us / tables)
    };
    let within = |a: &Agreement| {
        format!("{} pixels within {:.1e}, median {:.1e}", a.same_minimum, a.worst_sigma, a.median_sigma)
    };
    let mut text = format!(
        "`{BENCH}`, all threads:\n\n```text\n{rows}```\n\n\
         `{SCRIPT}`: {} pixels of two views in RGB, paper eq. 6 with Lambert's body, 0.3 % of noise, all programs from the same \
         start to a step of 1e-4 σ, one thread. numpy {} repeats `Direct` point by point ({} points for the lobe, as many \
         for the irradiance; values agree to {:.0e}), vectorized over points, views and parameter sets; scipy {} runs MINPACK \
         over the seven parameters. `Direct` is the same quadrature in Rust with analytic derivatives; tables hold it \
         interpolated, which is what a fit uses, and differ from it by their error. An evaluation is both views of one \
         parameter set.\n\n| program | µs a pixel | evaluations | × tables | differences of the answers in σ \
         |\n|---|---|---|---|---|\n",
        peer.vectorized.pixels, peer.numpy, peer.points, peer.model_difference, peer.scipy,
    );
    text.push_str(&row(
        "brewster, tables",
        tables,
        evaluations(&problem.tables),
        &format!("to scipy: {}", within(&peer.tables)),
    ));
    text.push_str(&row(
        "brewster, Direct",
        problem.direct.us_per_pixel,
        evaluations(&problem.direct),
        &format!("to scipy: {}", within(&peer.direct)),
    ));
    text.push_str(&row("scipy, vectorized Jacobian", peer.vectorized.us_per_pixel, peer.vectorized.evaluations, "–"));
    text.push_str(&row(
        "scipy, its own 2-point Jacobian",
        peer.two_point.us_per_pixel,
        peer.two_point.evaluations,
        "–",
    ));
    text
}
