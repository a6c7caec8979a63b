//! Why there are no maps, in words: what, where, and what to do.

use host_fit::maps::MapsError;
use host_fit::pipeline::PipelineError;
use host_fit::session::SessionError;

use crate::exit::Exit;
use crate::failure::Failure;

/// Captures that cannot be fitted.
pub(super) fn session(error: &SessionError) -> Failure {
    let advice = match error {
        SessionError::Image(image) => return Failure::reading(image),
        SessionError::Frames { source, place } => {
            return Failure::fitting(source).map_text(|text| format!("{place}: {text}"));
        }
        SessionError::Io { .. } => {
            "Name a folder of views (capture.json in each), a views.json, or several views' folders."
        }
        SessionError::Json { .. } => "Compare it with the keys in docs/CONVENTIONS.md.",
        SessionError::Missing { what, .. } if what == "light" => {
            "Name the light with --light FILE: an OpenEXR map, or JSON with the keys of a capture's light."
        }
        SessionError::NoOverlap { .. } => {
            "Views of different samples, or of different parts of one, cannot be fitted together."
        }
        _ => "",
    };
    Failure::new(Exit::BadInput, error.to_string(), advice)
}

/// A fit that was refused.
pub(super) fn pipeline(error: &PipelineError) -> Failure {
    match error {
        PipelineError::Fit(fit) => Failure::fitting(fit),
        PipelineError::Maps(error) => maps(error),
        PipelineError::Image(image) => Failure::reading(image),
        PipelineError::TooFewViews { .. } => Failure::new(
            Exit::NotIdentifiable,
            format!("not identifiable: {error}"),
            "Add a view from another side, 45 degrees or more around the normal; --mode closed makes do with one.",
        ),
        PipelineError::Option { .. } => Failure::new(Exit::Usage, error.to_string(), "See brewster fit --help."),
        PipelineError::Optics(_) => Failure::new(
            Exit::BadInput,
            error.to_string(),
            "Check the ranges (--eta, --alpha, --tolerance) and the light.",
        ),
        _ => Failure::new(Exit::BadInput, error.to_string(), ""),
    }
}

/// Tiles and maps: what cannot be written is the output's fault, all else the input's.
pub(super) fn maps(error: &MapsError) -> Failure {
    match error {
        MapsError::Image(image) => Failure::writing(image),
        MapsError::ForeignTile { .. } => Failure::new(
            Exit::Output,
            error.to_string(),
            "Delete the folder of tiles to begin anew, or give the settings and pictures that they were made with.",
        ),
        _ => Failure::new(Exit::BadInput, error.to_string(), ""),
    }
}
