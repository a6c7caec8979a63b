//! The development loop. `cargo xtask` alone means "safe to push".
//!
//! Every step prints what it does and how long it took; all steps run, and the failed ones are named again at the end.

mod arrows;
mod captures;
mod docs;
mod licenses;
mod metadata;
mod no_std;
mod numerics;
mod oracles;
mod perf;
mod process;
mod ulp;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// The development loop; without a subcommand: safe to push?
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    step: Option<Step>,
}

#[derive(Clone, Subcommand)]
enum Step {
    /// Formatting, as rustfmt.toml says
    Fmt {
        /// Reformat instead of checking
        #[arg(long)]
        write: bool,
    },
    /// Clippy on everything, warnings are errors
    Lint,
    /// Every test
    Test,
    /// Equation table, error-bound table, links, and words that do not belong in any file
    Docs,
    /// The error-bound tables of docs/NUMERICS.md against the code
    Numerics {
        /// Write the tables instead of checking them
        #[arg(long)]
        write: bool,
    },
    /// Independent reference values in a folder against the code
    Oracles {
        /// Folder with JSON tables [default: oracles in $BREWSTER_SHARED, or in ../shared beside the workspace]
        folder: Option<PathBuf>,
        /// Also fail on tables of an unknown family
        #[arg(long)]
        strict: bool,
    },
    /// Worst errors of the optics' functions in units in the last place, against arbitrary precision
    Ulp {
        /// Write the table into docs/NUMERICS.md
        #[arg(long)]
        write: bool,
    },
    /// Every rendered capture and the simulated ink print through the whole fit, against the truth; writes docs/ACCURACY.md
    Captures {
        /// Folder of captures [default: captures in $BREWSTER_SHARED, or in ../shared beside the workspace]
        folder: Option<PathBuf>,
    },
    /// Whether intervals hold the truth as often as they say, over 10⁵ simulated pixels; writes docs/ACCURACY.md
    Coverage,
    /// The fit's speed, and the same pixels fitted by scipy; writes docs/ACCURACY.md
    FitPeer,
    /// Dependency arrows between the crates of this workspace
    Arrows,
    /// Licenses of all dependencies, stricter on the device's side
    Licenses,
    /// The device's crates built for a microcontroller with core and alloc only
    NoStd,
    /// Measures what things cost, beside other programs; writes docs/PERFORMANCE.md
    Perf {
        /// Only these parts of it
        sections: Vec<perf::Section>,
    },
}

impl Step {
    /// What "safe to push" means, quick steps first.
    const SAFE_TO_PUSH: [Self; 7] =
        [Self::Fmt { write: false }, Self::Arrows, Self::Licenses, Self::Docs, Self::Lint, Self::NoStd, Self::Test];

    fn name(&self) -> &'static str {
        match self {
            Self::Fmt { .. } => "fmt",
            Self::Lint => "lint",
            Self::Test => "test",
            Self::Docs => "docs",
            Self::Numerics { .. } => "numerics",
            Self::Oracles { .. } => "oracles",
            Self::Ulp { .. } => "ulp",
            Self::Captures { .. } => "captures",
            Self::Coverage => "coverage",
            Self::FitPeer => "fit-peer",
            Self::Arrows => "arrows",
            Self::Licenses => "licenses",
            Self::NoStd => "no-std",
            Self::Perf { .. } => "perf",
        }
    }

    fn run(&self) -> anyhow::Result<String> {
        match self {
            Self::Fmt { write: false } => process::cargo(&["fmt", "--all", "--check"]),
            Self::Fmt { write: true } => process::cargo(&["fmt", "--all"]),
            Self::Lint => process::cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
            Self::Test => process::cargo(&["test", "--workspace"]),
            Self::Docs => docs::check(),
            Self::Numerics { write } => numerics::run(*write),
            Self::Oracles { folder, strict } => oracles::run(folder.as_deref(), *strict),
            Self::Ulp { write } => ulp::run(*write),
            Self::Captures { folder } => captures::run(folder.as_deref()),
            Self::Coverage => captures::coverage(),
            Self::FitPeer => captures::peer(),
            Self::Arrows => arrows::check(),
            Self::Licenses => licenses::check(),
            Self::NoStd => no_std::check(),
            Self::Perf { sections } => perf::run(sections),
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let steps = arguments.step.map_or_else(|| Step::SAFE_TO_PUSH.to_vec(), |step| vec![step]);
    let mut failed = Vec::new();
    for step in &steps {
        println!("xtask {}", step.name());
        let start = Instant::now();
        let result = step.run();
        let seconds = start.elapsed().as_secs_f64();
        match result {
            Ok(summary) => println!("xtask {}: ok, {summary} ({seconds:.1} s)", step.name()),
            Err(error) => {
                println!("xtask {}: FAILED after {seconds:.1} s: {error:#}", step.name());
                failed.push(step.name());
            }
        }
    }
    if failed.is_empty() {
        if steps.len() > 1 {
            println!("safe to push");
        }
        ExitCode::SUCCESS
    } else {
        println!("failed: {}", failed.join(", "));
        ExitCode::FAILURE
    }
}
