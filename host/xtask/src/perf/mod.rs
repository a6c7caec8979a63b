//! docs/PERFORMANCE.md: what things cost, measured here and now, section by section.
//!
//! Each section stands between two marks, so that one can be measured again without the others; each says its date and machine.

mod figure;
mod kernel;
mod mitsuba;
mod simulator;

use crate::metadata::Metadata;
use crate::process;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

const FILE: &str = "docs/PERFORMANCE.md";

/// A part of the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Section {
    /// The camera's strip kernel, beside OpenCV, numpy and polanalyser
    Kernel,
    /// What planning saves, and what a tolerance costs in the simulator
    Simulator,
    /// The simulator beside Mitsuba 3
    Mitsuba,
}

impl Section {
    const ALL: [Self; 3] = [Self::Kernel, Self::Simulator, Self::Mitsuba];

    const fn name(self) -> &'static str {
        match self {
            Self::Kernel => "kernel",
            Self::Simulator => "simulator",
            Self::Mitsuba => "mitsuba",
        }
    }

    fn mark(self) -> String {
        format!("perf {}", self.name())
    }

    fn measure(self) -> Result<String> {
        match self {
            Self::Kernel => kernel::section(),
            Self::Simulator => simulator::section(),
            Self::Mitsuba => mitsuba::section(),
        }
    }
}

/// Measures the sections (all, if none is named) and writes them into the document.
pub(crate) fn run(sections: &[Section]) -> Result<String> {
    let sections = if sections.is_empty() { &Section::ALL } else { sections };
    let path = process::root().join(FILE);
    for section in sections {
        let measured = section.measure().with_context(|| section.name())?;
        let date = process::output(process::command("date").args(["-u", "+%F"]), "date")?;
        let by = format!("`cargo xtask perf {}` on {}; {}.", section.name(), date.trim(), machine());
        let document = std::fs::read_to_string(&path).with_context(|| FILE.to_owned())?;
        let replaced = replaced(FILE, &document, &section.mark(), &format!("{}\n{by}\n", measured.trim_end()))?;
        std::fs::write(&path, replaced).with_context(|| FILE.to_owned())?;
    }
    let names: Vec<&str> = sections.iter().map(|section| section.name()).collect();
    Ok(format!("{FILE}: {}", names.join(", ")))
}

/// The `document` called `file` with what stands between the two marks of `mark` replaced.
pub(crate) fn replaced(file: &str, document: &str, mark: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {mark} -->\n"), format!("<!-- end {mark} -->"));
    let Some((before, rest)) = document.split_once(&begin) else { bail!("{file} has no {}", begin.trim()) };
    let Some((_, after)) = rest.split_once(&end) else { bail!("{file} has no {end}") };
    Ok(format!("{before}{begin}{text}{end}{after}"))
}

/// What a benchmark of ours prints.
fn bench(package: &str, name: &str, arguments: &[&str]) -> Result<String> {
    let line = format!("cargo bench -p {package} --bench {name} -- {}", arguments.join(" "));
    println!("  {}", line.trim_end_matches([' ', '-']));
    let mut command = process::command(&process::cargo_program());
    command.args(["bench", "-q", "-p", package, "--bench", name, "--"]).args(arguments);
    let text = process::output(&mut command, &line)?;
    print!("{text}");
    Ok(text)
}

/// Python with `packages`, in a virtual environment below the target directory; installed on first use.
pub(crate) fn python(packages: &[&str]) -> Result<PathBuf> {
    let environment = target()?.join(format!("venv-{}", packages.first().unwrap_or(&"")));
    let python = environment.join("bin/python");
    let installed = environment.join("installed");
    if !installed.exists() {
        println!("  installing {} into a virtual environment", packages.join(", "));
        process::run(process::command("python3").args(["-m", "venv"]).arg(&environment), "python3 -m venv")?;
        let mut pip = process::command(&python.to_string_lossy());
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
        process::run(&mut pip, "pip install")?;
        std::fs::write(&installed, packages.join("\n"))?;
    }
    Ok(python)
}

/// Where measuring may leave files.
fn target() -> Result<PathBuf> {
    Ok(Metadata::load()?.target_directory.join("perf"))
}

pub(crate) fn machine() -> String {
    let info = std::fs::read_to_string(Path::new("/proc/cpuinfo")).unwrap_or_default();
    let field = |name: &str| info.lines().find_map(|line| line.strip_prefix(name)?.split_once(": "));
    let model = field("model name").map_or("an unnamed processor", |(_, model)| model);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {} {}", std::env::consts::OS, std::env::consts::ARCH)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_has_the_ends_of_its_worst_pairings() {
        let (a, b) = (Spread::of(&[4.0, 2.0, 3.0]).unwrap(), Spread::of(&[1.0, 2.0]).unwrap());
        let ratio = a.over(b);
        assert!(ratio.least <= ratio.median && ratio.median <= ratio.most);
        assert_eq!((ratio.least, ratio.most), (1.0, 4.0));
    }

    /// The document has the marks of every section, and one is replaced without the others.
    #[test]
    fn every_section_has_its_place() {
        let document = std::fs::read_to_string(process::root().join(FILE)).unwrap();
        for section in Section::ALL {
            let new = replaced(FILE, &document, &section.mark(), "measured\n").unwrap();
            assert_eq!(new.matches("measured\n<!-- end").count(), 1, "{section:?}");
            assert_eq!(new.matches("<!-- perf").count(), Section::ALL.len());
        }
    }
}
