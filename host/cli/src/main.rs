//! `brewster`: Stokes images from photographs and from the camera. Prose, progress bars and pages; no physics.

mod camera;
mod commands;
mod exit;
mod failure;
mod output;
mod photographs;
mod pictures;
mod report;
mod scenes;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use crate::commands::Command;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::signals;
use crate::terminal::{Terminal, heard};

/// Stokes images: intensity, degree and angle of linear polarization of every pixel.
#[derive(Parser)]
#[command(name = "brewster", version, after_help = Exit::help(), max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// No progress and no summary; only the name of what was made
    #[arg(long, short, global = true, help_heading = "Output")]
    quiet: bool,
    /// The result as JSON on stdout, and nothing else there; errors as JSON on stderr
    #[arg(long, global = true, help_heading = "Output")]
    json: bool,
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    let terminal = Terminal::new(cli.quiet, cli.json);
    signals::watch(cli.json);
    let result = cli.command.run(&terminal);
    signals::stand_back();
    let exit = match result.and_then(|outcome| terminal.finish(&outcome)) {
        Ok(()) => Exit::Ok,
        Err(failure) => {
            terminal.fail(&failure);
            failure.exit
        }
    };
    ExitCode::from(exit.code())
}

/// A command line that was not understood, or a question about it (`--help`, `--version`).
fn refuse(error: &clap::Error) -> ExitCode {
    // The flag was not parsed, as nothing was; programs still want their JSON.
    let json = std::env::args_os().any(|a| a == "--json");
    if error.use_stderr() && json {
        let text = error.render().to_string();
        let what = text.trim().strip_prefix("error: ").unwrap_or(text.trim());
        Terminal::new(false, true).fail(&Failure::new(Exit::Usage, what, "See brewster --help."));
        return ExitCode::from(Exit::Usage.code());
    }
    let exit = match heard(error.print()) {
        _ if error.use_stderr() => Exit::Usage,
        Ok(()) => Exit::Ok,
        Err(e) => {
            let failure = Failure::new(Exit::Output, format!("cannot print this: {e}"), "Check where the output goes.");
            Terminal::new(false, json).fail(&failure);
            failure.exit
        }
    };
    ExitCode::from(exit.code())
}
