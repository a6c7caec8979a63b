//! Errors in words: what happened, what was expected, what to do.

use host_fit::FitError;
use host_image::ImageError;
use serde_json::json;

use crate::exit::Exit;

/// Why a command ended early.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) exit: Exit,
    /// What happened, and what was expected instead.
    what: String,
    /// What to do; empty if there is nothing to add.
    advice: String,
}

impl Failure {
    pub(crate) fn new(exit: Exit, what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { exit, what: what.into(), advice: advice.into() }
    }

    /// A picture that could not be read.
    pub(crate) fn reading(error: &ImageError) -> Self {
        let advice = match error {
            ImageError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                "Check the name and the folder you are in."
            }
            ImageError::Io { .. } => "Check that the file can be read.",
            ImageError::Malformed { .. } => {
                "The file is damaged or was not copied completely: copy or export it again."
            }
            ImageError::Unsupported { .. } => {
                "Export the frames as linear 16-bit PNG or TIFF, OpenEXR or npy, grey or RGB."
            }
            ImageError::NotFinite { .. } => {
                "Replace such values before, or mask the pixel: no Stokes vector follows from them."
            }
            ImageError::TooLarge { .. } => "Crop the picture, or average pixels.",
            _ => "",
        };
        Self::new(Exit::BadInput, error.to_string(), advice)
    }

    /// A result that could not be written.
    pub(crate) fn writing(error: &ImageError) -> Self {
        let advice = match error {
            ImageError::Io { .. } => "Check the free space and the permissions, or choose another folder with -o.",
            _ => "",
        };
        Self::new(Exit::Output, format!("cannot write {error}"), advice)
    }

    /// The same with another wording of what happened.
    pub(crate) fn map_text(self, change: impl Fn(&str) -> String) -> Self {
        Self { what: change(&self.what), ..self }
    }

    /// A fit that was refused.
    pub(crate) fn fitting(error: &FitError) -> Self {
        match error {
            FitError::NotIdentifiable { axes, condition } if condition.is_finite() => Self::new(
                Exit::NotIdentifiable,
                format!(
                    "not identifiable: the {axes} polarizer angles are so close together that noise would be multiplied \
                     by {condition:.0}"
                ),
                "Spread the angles over 180 degrees: 0, 60, 120 is the best set of three.",
            ),
            FitError::NotIdentifiable { axes, .. } => Self::new(
                Exit::NotIdentifiable,
                format!(
                    "not identifiable: {axes} different polarizer angle{} where three are needed (angles 180 degrees \
                     apart are the same)",
                    if *axes == 1 { "" } else { "s" }
                ),
                "Take frames at three angles or more, such as 0, 60 and 120 degrees.",
            ),
            FitError::TooManyFrames { .. } => {
                Self::new(Exit::BadInput, error.to_string(), "Leave some out, or average frames of the same angle.")
            }
            _ => Self::new(Exit::BadInput, error.to_string(), ""),
        }
    }

    /// For people.
    pub(crate) fn text(&self) -> String {
        let advice = if self.advice.is_empty() { String::new() } else { format!("\n  {}", self.advice) };
        format!("error: {}{advice}", self.what)
    }

    /// For programs.
    pub(crate) fn json(&self) -> serde_json::Value {
        json!({ "error": {
            "kind": self.exit.kind(), "exit_code": self.exit.code(), "message": self.what, "advice": self.advice,
        }})
    }
}
