//! The subcommands: one file (or folder) each.

mod calibrate;
mod capture;
mod compare;
mod completions;
mod demo;
mod devices;
mod fetch;
mod fit;
mod info;
mod render;
mod simulate;
mod stokes;

use crate::failure::Failure;
use crate::terminal::{Outcome, Terminal};

/// What to do.
#[derive(clap::Subcommand)]
pub(crate) enum Command {
    Demo(demo::Demo),
    Capture(capture::Capture),
    Fetch(fetch::Fetch),
    Calibrate(calibrate::Calibrate),
    Stokes(Box<stokes::Stokes>),
    Simulate(simulate::Simulate),
    Fit(Box<fit::Fit>),
    Render(Box<render::Render>),
    Compare(compare::Compare),
    Info(info::Info),
    Devices(devices::Devices),
    Completions(completions::Completions),
}

impl Command {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        match self {
            Self::Demo(command) => command.run(terminal),
            Self::Capture(command) => command.run(terminal),
            Self::Fetch(command) => command.run(terminal),
            Self::Calibrate(command) => command.run(terminal),
            Self::Devices(command) => command.run(terminal),
            Self::Stokes(command) => command.run(terminal),
            Self::Simulate(command) => command.run(terminal),
            Self::Fit(command) => command.run(terminal),
            Self::Render(command) => command.run(terminal),
            Self::Compare(command) => command.run(terminal),
            Self::Info(command) => command.run(),
            Self::Completions(command) => Ok(command.run()),
        }
    }
}
