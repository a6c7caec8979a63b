//! What is said, and where: results on stdout, everything else on stderr.

use std::cell::RefCell;
use std::io::Write;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::failure::Failure;

/// The user's wishes about output, and the warnings so far.
pub(crate) struct Terminal {
    quiet: bool,
    json: bool,
    warnings: RefCell<Vec<String>>,
}

/// What a command has to say at its end.
pub(crate) struct Outcome {
    /// For people.
    pub(crate) text: String,
    /// What is left of it with `--quiet`.
    pub(crate) brief: String,
    /// For programs.
    pub(crate) json: serde_json::Value,
}

impl Terminal {
    pub(crate) fn new(quiet: bool, json: bool) -> Self {
        Self { quiet, json, warnings: RefCell::default() }
    }

    /// Says that something may be wrong. With `--json` it is part of the result instead.
    pub(crate) fn warn(&self, text: impl Into<String>) {
        let text = text.into();
        if !self.json {
            say(std::io::stderr(), &format!("warning: {text}\n"));
        }
        self.warnings.borrow_mut().push(text);
    }

    /// All warnings so far.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.warnings.borrow().clone()
    }

    /// A progress bar on stderr; none with `--quiet`, `--json` or where stderr is not a terminal.
    pub(crate) fn progress(&self, steps: usize, label: &'static str) -> ProgressBar {
        let target = if self.quiet || self.json { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(steps as u64), target).with_message(label);
        match ProgressStyle::with_template("{msg:>10} {bar:32} {pos}/{len}") {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        }
    }

    /// The result, on stdout.
    pub(crate) fn finish(&self, outcome: &Outcome) {
        let text = if self.json {
            format!("{:#}\n", outcome.json)
        } else if self.quiet {
            outcome.brief.clone()
        } else {
            outcome.text.clone()
        };
        say(std::io::stdout(), &text);
    }

    /// The error, on stderr.
    pub(crate) fn fail(&self, failure: &Failure) {
        let text = if self.json { format!("{:#}\n", failure.json()) } else { format!("{}\n", failure.text()) };
        say(std::io::stderr(), &text);
    }
}

/// Writes, and does not mind a reader that has gone away (`brewster info x | head -1`).
fn say(mut to: impl Write, text: &str) {
    let _ = to.write_all(text.as_bytes()).and_then(|()| to.flush());
}
