//! The strip kernel: its benchmark, and the same job in other programs on the same machine in the same hour.
//!
//! The benchmark runs before and after the others, so that a machine that changes its speed shows it.

use super::{Spread, bench, python};
use crate::process;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::fmt::Write;

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

/// The section.
pub(super) fn section() -> Result<String> {
    let before = bench("firmware-core", "kernel", &[])?;
    let peers = peers();
    let after = bench("firmware-core", "kernel", &[])?;
    let mut text = format!(
        "## The strip kernel\n\n`{BENCH}`, one thread: 5 MP, samples of 12 bits; `copy` is a `memcpy` of half the bytes the kernel \
         must read and write, in the same run, in turns (median, least to most).\n\n```text\n{before}```\n\n\
         ## The same job in other programs\n\n",
    );
    match &peers {
        Ok(peers) => peer_table(&mut text, &before, &after, peers)?,
        Err(error) => writeln!(text, "Not measured: {error:#}.")?,
    }
    Ok(text)
}

/// Runs the other programs.
fn peers() -> Result<Vec<Peer>> {
    let python = python(&PACKAGES)?;
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
}
