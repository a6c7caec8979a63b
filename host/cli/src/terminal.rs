//! What is said, and where: results on stdout, everything else on stderr.

use std::cell::RefCell;
use std::io::Write;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::exit::Exit;
use crate::failure::Failure;

/// The user's wishes about output, and the warnings so far.
pub(crate) struct Terminal {
    quiet: bool,
    json: bool,
    warnings: RefCell<Vec<String>>,
    /// Why a warning could not be said, if that happened.
    unsaid: RefCell<Option<std::io::Error>>,
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
        Self { quiet, json, warnings: RefCell::default(), unsaid: RefCell::default() }
    }

    /// Says that something may be wrong. With `--json` it is part of the result instead.
    pub(crate) fn warn(&self, text: impl Into<String>) {
        let text = text.into();
        if !self.json {
            let said = say(std::io::stderr(), &format!("warning: {text}\n"));
            let mut unsaid = self.unsaid.borrow_mut();
            *unsaid = unsaid.take().or(said.err());
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

    /// The result, on stdout, after the warnings in it that were not said yet. What cannot be said is a failure: nobody
    /// should take half a result for a whole one.
    pub(crate) fn finish(&self, outcome: &Outcome) -> Result<(), Failure> {
        let warnings = outcome.json.get("warnings").and_then(|w| w.as_array()).into_iter().flatten();
        for warning in warnings.filter_map(|w| w.as_str()) {
            if !self.warnings.borrow().iter().any(|said| said == warning) {
                self.warn(warning);
            }
        }
        let text = if self.json {
            format!("{:#}\n", outcome.json)
        } else if self.quiet {
            outcome.brief.clone()
        } else {
            outcome.text.clone()
        };
        let failed = |what: &str, e: std::io::Error| {
            let advice = match outcome.json.get("output").and_then(|o| o.as_str()) {
                Some(output) => format!("The files are complete, in {output}."),
                None => "Check where the output goes.".to_owned(),
            };
            Failure::new(Exit::Output, format!("cannot print the {what}: {e}"), advice)
        };
        say(std::io::stdout(), &text).map_err(|e| failed("result", e))?;
        self.unsaid.take().map_or(Ok(()), |e| Err(failed("warnings", e)))
    }

    /// The error, on stderr. If that cannot be written, the exit code still says it.
    pub(crate) fn fail(&self, failure: &Failure) {
        let text = if self.json { format!("{:#}\n", failure.json()) } else { format!("{}\n", failure.text()) };
        let _ = say(std::io::stderr(), &text);
    }
}

/// Writes, and does not mind a reader that has gone away (`brewster info x | head -1`).
fn say(mut to: impl Write, text: &str) -> std::io::Result<()> {
    heard(to.write_all(text.as_bytes()).and_then(|()| to.flush()))
}

/// A reader that has gone away wants no more, and that is all right.
pub(crate) fn heard(written: std::io::Result<()>) -> std::io::Result<()> {
    match written {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}
