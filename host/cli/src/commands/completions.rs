//! `brewster completions`: what makes the Tab key work.

use clap::{Args, CommandFactory};
use clap_complete::Shell;
use serde_json::json;

use crate::Cli;
use crate::terminal::Outcome;

/// Print a completion script for a shell
///
/// For bash: brewster completions bash > ~/.local/share/bash-completion/completions/brewster
#[derive(Args)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    pub(crate) fn run(&self) -> Outcome {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "brewster", &mut script);
        let text = String::from_utf8_lossy(&script).into_owned();
        let json = json!({ "shell": self.shell.to_string(), "script": text });
        Outcome { brief: text.clone(), text, json }
    }
}
