//! What can be wrong with a scene, and where.

use std::path::PathBuf;

use boards::Place;
use host_image::ImageError;
use host_optics::OpticsError;

/// Why a scene was refused or could not be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene file could not be read.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file as the caller named it.
        file: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Malformed: not TOML, a value of the wrong type, or a key missing.
    #[error("{place}: {expected}")]
    Parse {
        /// Where.
        place: Place,
        /// What stands there and what was expected.
        expected: String,
    },
    /// Unsupported: the file follows another schema than this program knows.
    #[error("{place}: schema {found} is not supported, expected {supported}")]
    UnknownSchema {
        /// Where.
        place: Place,
        /// The number in the file.
        found: i64,
        /// The number this crate reads.
        supported: i64,
    },
    /// A key the schema does not have.
    #[error("{place}: {expected}")]
    UnknownKey {
        /// Where; its `key` is the one that is not known.
        place: Place,
        /// The key and those that may stand there, in the parser's words.
        expected: String,
    },
    /// A word the schema does not have for this key, or a name that nothing in the scene has.
    #[error("{place}: {expected}")]
    UnknownValue {
        /// Where.
        place: Place,
        /// The word and those that may stand there.
        expected: String,
    },
    /// A value of the right type that cannot be, or that contradicts another.
    #[error("{place}: {value} is out of range, allowed: {allowed}")]
    OutOfRange {
        /// Where.
        place: Place,
        /// The value in the file.
        value: String,
        /// What would have been accepted.
        allowed: String,
    },
    /// A map the scene names could not be read: missing, malformed, or of a kind or with layers that are not read.
    #[error("{place}: {source}")]
    Map {
        /// Where the scene names it.
        place: Place,
        /// Why.
        source: Box<ImageError>,
    },
    /// The physics refused a value.
    #[error("{place}: {source}")]
    Optics {
        /// Where.
        place: Place,
        /// Why.
        source: OpticsError,
    },
    /// Unsupported: the scene is sound, but holds what is not simulated.
    #[error("{place}: not simulated: {why}")]
    NotSimulated {
        /// Where.
        place: Place,
        /// What cannot be done.
        why: String,
    },
    /// The physics refused light or surfaces that the scene's own checks let through.
    #[error(transparent)]
    Physics(#[from] OpticsError),
    /// A tolerance that is none.
    #[error("a tolerance of {0}: expected more than 0 and at most 1, relative to s0")]
    Tolerance(f64),
    /// There is no view of this number.
    #[error("the scene has {views} views, so there is no view {view} (views count from 0)")]
    NoView {
        /// The one asked for.
        view: usize,
        /// How many there are.
        views: usize,
    },
    /// A Stokes image that does not fit the scene's camera.
    #[error("the camera has {expected_width} x {expected_height} pixels, the Stokes image {width} x {height}")]
    ImageSize {
        /// Columns of the image.
        width: usize,
        /// Rows of the image.
        height: usize,
        /// Columns of the camera.
        expected_width: usize,
        /// Rows of the camera.
        expected_height: usize,
    },
    /// A Stokes image that contradicts itself.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A Stokes image without light: no exposure makes a picture of it.
    #[error("no pixel of the Stokes image is brighter than 0, so no exposure reaches the level asked for")]
    NoLight,
    /// Polarizer angles that do not determine a Stokes vector.
    #[error("the polarizer angles of the plan do not determine a Stokes vector: {0:?}")]
    Angles(protocol_polar::SolveError),
}
