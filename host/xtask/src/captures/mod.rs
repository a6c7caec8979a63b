//! docs/ACCURACY.md: what the fit is worth, measured. Each command writes its own sections.
//!
//! - [`run`]: every capture of a folder, and the inks of the paper's §5, through the whole pipeline and against the truth.
//! - [`coverage`]: 10⁵ simulated pixels and the biases of closed forms, from the tests of host-fit.
//! - [`peer`]: the same pixels fitted by scipy.

mod document;
mod inks;
mod limits;
mod peer;
mod score;
mod statistics;

use crate::process;
use anyhow::{Context, Result, bail};
use document::Section;
use std::path::{Path, PathBuf};

pub(crate) use peer::run as peer;

/// Fits every capture in `folder` and the simulated ink print; fails where a limit of [`limits`] is exceeded.
pub(crate) fn run(folder: Option<&Path>) -> Result<String> {
    let folder = folder.map_or_else(default_folder, PathBuf::from);
    let mut exceeded = Vec::new();
    let captures = captures_in(&folder)?;
    if captures.is_empty() {
        println!("  skipped: no captures in {}", folder.display());
    } else {
        let scores = captures.iter().map(|c| score::capture(c)).collect::<Result<Vec<_>>>()?;
        document::write(Section::Captures, &score::text(&scores))?;
        exceeded.extend(scores.iter().flat_map(limits::exceeded));
    }
    let inks = inks::fit()?;
    document::write(Section::Inks, &inks::text(&inks))?;
    exceeded.extend(limits::exceeded_by_inks(&inks));
    if !exceeded.is_empty() {
        bail!("limits exceeded:\n    {}", exceeded.join("\n    "));
    }
    Ok(format!("{} captures and {} inks within their limits, {} written", captures.len(), inks.len(), document::FILE))
}

/// Runs the large coverage test and those of the closed forms' biases, which print their tables.
pub(crate) fn coverage() -> Result<String> {
    let arguments =
        ["test", "-q", "--release", "-p", "host-fit", "--test", "coverage", "--", "--include-ignored", "--nocapture"];
    let line = format!("cargo {} --test-threads=1", arguments.join(" "));
    let mut command = process::command(&process::cargo_program());
    let output = process::output(command.args(arguments).arg("--test-threads=1"), &line)?;
    print!("{output}");
    let tables: Vec<&str> = output.lines().filter(|line| is_result(line)).collect();
    if tables.is_empty() {
        bail!("`{line}` printed no table");
    }
    document::write(Section::Coverage, &document::spaced(&tables))?;
    Ok(format!("{} lines written to {}", tables.len(), document::FILE))
}

/// What a test prints about pixels, beside what the harness prints about tests.
fn is_result(line: &str) -> bool {
    line.starts_with('|') || line.starts_with("## ") || line.starts_with("- ")
}

fn default_folder() -> PathBuf {
    let shared = std::env::var_os("BREWSTER_SHARED").map_or_else(|| process::root().join("../shared"), PathBuf::from);
    shared.join("captures")
}

/// Folders of `folder` that have truth beside their views, by name.
fn captures_in(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.join("truth/sample_plane.exr").is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
