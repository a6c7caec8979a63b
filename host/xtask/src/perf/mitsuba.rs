//! The simulator beside Mitsuba 3: processor time at a known error, for the same picture.

use super::{bench, python, target};
use crate::process;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::fmt::Write;

const PEER: &str = "host/xtask/perf/mitsuba_peer.py";
const PACKAGES: [&str; 2] = ["mitsuba==3.9.1", "numpy"];
/// The environment map, below ../shared.
const MAP: &str = "data/env/kloofendal_48d_partly_cloudy_puresky_1k.hdr";
/// Where LLVM is looked for: Mitsuba compiles its kernels with it, and not with every version.
const LLVM: [&str; 2] = ["/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", "/usr/lib/aarch64-linux-gnu/libLLVM.so.19.1"];
/// Samples behind each value of the reference: 1024, 8 times over, on 8 × 8 pixels.
const REFERENCE_SAMPLES: f64 = 8192.0;

#[derive(Deserialize)]
struct Theirs {
    version: String,
    runs: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    alpha: f64,
    spp: f64,
    cpu_s: f64,
    noise: f64,
}

#[derive(Deserialize)]
struct Ours {
    alpha: f64,
    tolerance: f64,
    cpu_s: f64,
    error: f64,
}

/// The section.
pub(super) fn section() -> Result<String> {
    let folder = target()?.join("mitsuba");
    let python = python(&PACKAGES)?;
    let shared = std::env::var_os("BREWSTER_SHARED").map_or_else(|| process::root().join("../shared"), Into::into);
    println!("  {PEER}");
    let mut command = process::command(&python.to_string_lossy());
    command.arg(PEER).arg(shared.join(MAP)).arg(&folder);
    if let (None, Some(found)) =
        (std::env::var_os("DRJIT_LIBLLVM_PATH"), LLVM.iter().find(|path| std::path::Path::new(path).exists()))
    {
        command.env("DRJIT_LIBLLVM_PATH", found);
    }
    let line = format!("{PEER} (needs libllvm19)");
    let theirs: Theirs = serde_json::from_str(&process::output(&mut command, &line)?).context(PEER)?;
    let ours = bench("host-sim", "mitsuba", &[&folder.to_string_lossy()])?;
    let ours: Vec<Ours> = serde_json::from_str(&ours).context("bench mitsuba")?;
    table(&theirs, &ours)
}

fn table(theirs: &Theirs, ours: &[Ours]) -> Result<String> {
    let mut text = format!(
        "## The simulator beside Mitsuba {}\n\nThe same picture (`{PEER}`, `cargo bench -p host-sim --bench mitsuba`): a \
         rough dielectric plane at 56\u{b0}, index 1.5, under a photographed sky, 1024 \u{d7} 1024 pixels. Mitsuba renders one \
         band (`llvm_ad_mono_polarized`, its fastest here), brewster all three. Processor time of all threads for one picture; \
         brewster's has reading no file in it, but light, tables and everything from nothing. Mitsuba's error is the rms \
         difference of two pictures of different seeds over \u{221a}2, brewster's the rms difference to Mitsuba's own mean of \
         {REFERENCE_SAMPLES} samples over blocks of 8 \u{d7} 8 pixels, both worst component in units of the mean s0. That mean has \
         noise of its own, which is part of brewster's error as stated and, by its number of samples, given beside it. The last \
         column is what Mitsuba would take for brewster's error, by its 1/\u{221a}N.\n\n\
         | \u{3b1} | program | setting | CPU s | error | of it the reference's noise | Mitsuba's CPU s for that error / brewster's |\n\
         |---|---|---|---|---|---|---|\n",
        theirs.version
    );
    for run in &theirs.runs {
        let Run { alpha, spp, cpu_s, noise } = run;
        writeln!(text, "| {alpha} | Mitsuba | {spp} spp | {cpu_s:.2} | {noise:.1e} | | |")?;
    }
    for Ours { alpha, tolerance, cpu_s, error } in ours {
        let most =
            theirs.runs.iter().filter(|run| (run.alpha - alpha).abs() < 1e-9).max_by(|a, b| a.spp.total_cmp(&b.spp));
        let Some(most) = most else { continue };
        let reference = most.noise * (most.spp / REFERENCE_SAMPLES).sqrt();
        let equal = most.cpu_s * (most.noise / error).powi(2);
        writeln!(
            text,
            "| {alpha} | brewster | tolerance {tolerance} | {cpu_s:.2} | {error:.1e} | {reference:.1e} | {:.0} |",
            equal / cpu_s
        )?;
    }
    Ok(text)
}
