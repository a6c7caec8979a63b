//! Why a session was refused: what, where, and what to do about it.

use std::path::PathBuf;

use host_image::ImageError;
use host_optics::OpticsError;

use super::camera::PoseFault;
use crate::FitError;

/// Why there is no session to fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The machine refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file is not the JSON that is read here.
    #[error("{}: malformed: {source}", path.display())]
    Json {
        /// File.
        path: PathBuf,
        /// Where in the file, and what.
        source: serde_json::Error,
    },
    /// A picture, map or Stokes image that cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Something that must be there is not.
    #[error("{place}: {what} is missing; {remedy}")]
    Missing {
        /// File and view.
        place: String,
        /// What.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A value that makes no sense.
    #[error("{place}: {key} is {found}; {expected}")]
    Malformed {
        /// File and view.
        place: String,
        /// Key in the file.
        key: String,
        /// The value.
        found: String,
        /// What would do.
        expected: String,
    },
    /// A sound value of a kind that is not read here: another Stokes convention, layout, camera model.
    #[error("{place}: {key} is {found:?}, which is not known; {known}")]
    Unsupported {
        /// File and view.
        place: String,
        /// Key in the file.
        key: String,
        /// The value.
        found: String,
        /// What is.
        known: String,
    },
    /// A camera whose pose is none.
    #[error("{place}: {key}: {fault}")]
    Pose {
        /// File and view.
        place: String,
        /// Key in the file.
        key: &'static str,
        /// What is wrong with it.
        fault: PoseFault,
    },
    /// Two statements of one thing.
    #[error("{place}: {what}: {first} and {second} do not agree")]
    Disagree {
        /// File and view.
        place: String,
        /// Of what.
        what: String,
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// No part of the sample is seen by all views.
    #[error(
        "views {first} and {second} see no part of the sample together; check corners, poses and the order of views"
    )]
    NoOverlap {
        /// Name of a view.
        first: String,
        /// Name of another.
        second: String,
    },
    /// A light or mirror ball outside the models.
    #[error("{place}: {source}")]
    Optics {
        /// File and key.
        place: String,
        /// What was refused.
        source: OpticsError,
    },
    /// Frames that give no Stokes vector.
    #[error("{place}: {source}")]
    Frames {
        /// View.
        place: String,
        /// What was refused.
        source: FitError,
    },
}
