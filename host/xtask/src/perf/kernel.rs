//! docs/PERFORMANCE.md: the kernel's benchmark, and the same job in other programs on the same machine in the same hour.
//!
//! The benchmark runs before and after the others, so that a machine that changes its speed shows it.

use crate::metadata::Metadata;
use crate::process;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::fmt::Write;
use std::path::Path;

const FILE: &str = "docs/PERFORMANCE.md";
const PEERS: &str = "host/xtask/perf/peers.py";
const BENCH: &str = "cargo bench -p firmware-core --bench kernel";
/// matplotlib is what polanalyser imports without saying so.
const PACKAGES: [&str; 4] = ["numpy", "opencv-python-headless", "polanalyser", "matplotlib"];
/// The benchmark's rows of the job that the peers do.
const STOKES_ROW: &str = "4 frames, i16";
const POLAR_ROW: &str = "4 frames, i16, with DoLP and AoLP";
const PHOTOSITES: f64 = 2448.0 * 2048.0;

/// One program at one job.
#[derive(Deserialize)]
struct Peer {
    program: String,
    version: String,
    job: String,
    /// One value per round.
    ms: Vec<f64>,
}

/// Median and ends of some values.
#[derive(Clone, Copy)]
struct Spread {
    least: f64,
    median: f64,
    most: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = |at: usize| sorted.get(at).copied();
        let median = 0.5 * (middle((sorted.len().checked_sub(1)?) / 2)? + middle(sorted.len() / 2)?);
        Some(Self { least: *sorted.first()?, median, most: *sorted.last()? })
    }

    /// How many times `other` this is; the ends are the two least favourable pairings.
    fn over(self, other: Self) -> Self {
        Self { least: self.least / other.most, median: self.median / other.median, most: self.most / other.least }
    }
}

/// Measures and writes the document.
pub(crate) fn run() -> Result<String> {
    let before = bench()?;
    let peers = peers();
    let after = bench()?;
    let mut text = format!(
        "# Performance\n\nWritten by `cargo xtask perf` on {}. One thread; {}.\n\n## The strip kernel\n\n\
         `{BENCH}`: 5 MP, samples of 12 bits; `copy` is a `memcpy` of half the bytes the kernel must read and write, in the \
         same run, in turns (median, least to most).\n\n```text\n{}```\n",
        process::output(process::command("date").args(["-u", "+%F"]), "date")?.trim(),
        machine(),
        before
    );
    text.push_str("\n## The same job in other programs\n\n");
    match &peers {
        Ok(peers) => peer_table(&mut text, &before, &after, peers)?,
        Err(error) => writeln!(text, "Not measured: {error:#}.")?,
    }
    std::fs::write(process::root().join(FILE), text).with_context(|| FILE.to_owned())?;
    match peers {
        Ok(_) => Ok(format!("{FILE} written")),
        Err(error) => Ok(format!("{FILE} written without the other programs: {error:#}")),
    }
}

fn bench() -> Result<String> {
    println!("  {BENCH}");
    let arguments = ["bench", "-q", "-p", "firmware-core", "--bench", "kernel"];
    let text = process::output(process::command(&process::cargo_program()).args(arguments), BENCH)?;
    print!("{text}");
    Ok(text)
}

/// Runs the other programs in a virtual environment of their own, installed on first use.
fn peers() -> Result<Vec<Peer>> {
    let environment = Metadata::load()?.target_directory.join("perf/venv");
    let python = environment.join("bin/python");
    let installed = environment.join("installed");
    if !installed.exists() {
        println!("  installing {} into a virtual environment", PACKAGES.join(", "));
        process::run(process::command("python3").args(["-m", "venv"]).arg(&environment), "python3 -m venv")?;
        let mut pip = process::command(&python.to_string_lossy());
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(PACKAGES);
        process::run(&mut pip, "pip install")?;
        std::fs::write(&installed, PACKAGES.join("\n"))?;
    }
    println!("  {PEERS}");
    let text = process::output(process::command(&python.to_string_lossy()).arg(PEERS), PEERS)?;
    serde_json::from_str(&text).with_context(|| format!("{PEERS} printed something else than its results"))
}

fn peer_table(text: &mut String, before: &str, after: &str, peers: &[Peer]) -> Result<()> {
    let stokes = ours(&[before, after], STOKES_ROW)?;
    let both = ours(&[before, after], POLAR_ROW)?;
    let no_values = || format!("{PEERS} printed a row without values");
    let (stokes, both) = (Spread::of(&stokes).with_context(no_values)?, Spread::of(&both).with_context(no_values)?);
    writeln!(
        text,
        "`{PEERS}`: four frames of 2448 × 2048 u16 in memory to Stokes, then to DoLP and AoLP as well; one thread; the \
         programs take turns, median of {} rounds (least to most). brewster's kernel was measured before and after them, \
         the same in all of the first two jobs: it always subtracts a dark level and gives flags. It alone drops saturated \
         samples, gives a residual and knows a misfit. It gives 16-bit planes with a proved bound, OpenCV and numpy f32, \
         polanalyser f64. The ratio is to brewster at the same job; its ends pair the \
         fastest round of one with the slowest of the other. DoLP and AoLP are the integer CORDIC of every photosite; the camera \
         runs it on its preview only, one value for 4 to 256 photosites.\n",
        peers.first().map_or(0, |peer| peer.ms.len())
    )?;
    text.push_str("| program | job | ms | × brewster |\n|---|---|---|---|\n");
    for (job, spread) in [("Stokes", stokes), ("Stokes, flags", stokes), ("Stokes, DoLP, AoLP", both)] {
        let Spread { least, median, most } = spread;
        writeln!(text, "| brewster | {job} | {median:.1} ({least:.1} to {most:.1}) | 1 |")?;
        for peer in peers.iter().filter(|peer| peer.job == job) {
            let ms = Spread::of(&peer.ms).with_context(no_values)?;
            let ratio = ms.over(spread);
            writeln!(
                text,
                "| {} {} | {job} | {:.1} ({:.1} to {:.1}) | {:.2} ({:.2} to {:.2}) |",
                peer.program, peer.version, ms.median, ms.least, ms.most, ratio.median, ratio.least, ratio.most
            )?;
        }
    }
    Ok(())
}

/// Milliseconds of a row of the benchmark for the whole picture, once per run.
fn ours(runs: &[&str], row: &str) -> Result<Vec<f64>> {
    runs.iter()
        .map(|run| match ns_per_photosite(run, row) {
            Some(ns) => Ok(ns * PHOTOSITES * 1e-6),
            None => bail!("the benchmark has no row {row:?} any more: host/xtask/src/perf.rs names it"),
        })
        .collect()
}

/// `name   1.234 ns/photosite ...`
fn ns_per_photosite(run: &str, row: &str) -> Option<f64> {
    run.lines().find_map(|line| {
        let (left, _) = line.strip_prefix(row)?.split_once("ns/photosite")?;
        left.trim().parse().ok() // a longer name that begins alike is no number
    })
}

fn machine() -> String {
    let info = std::fs::read_to_string(Path::new("/proc/cpuinfo")).unwrap_or_default();
    let field = |name: &str| info.lines().find_map(|line| line.strip_prefix(name)?.split_once(": "));
    let model = field("model name").map_or("an unnamed processor", |(_, model)| model);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {} {}", std::env::consts::OS, std::env::consts::ARCH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_the_benchmark_are_told_apart() {
        let run =
            "4 frames, i16, dark and flat maps   2.500 ns/photosite   1x\n4 frames, i16    1.250 ns/photosite   1x\n";
        assert_eq!(ns_per_photosite(run, STOKES_ROW), Some(1.25));
        assert!(ours(&[run], POLAR_ROW).is_err());
    }

    #[test]
    fn a_ratio_has_the_ends_of_its_worst_pairings() {
        let (a, b) = (Spread::of(&[4.0, 2.0, 3.0]).unwrap(), Spread::of(&[1.0, 2.0]).unwrap());
        let ratio = a.over(b);
        assert!(ratio.least <= ratio.median && ratio.median <= ratio.most);
        assert_eq!((ratio.least, ratio.most), (1.0, 4.0));
    }
}
