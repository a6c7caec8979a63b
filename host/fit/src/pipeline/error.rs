//! Why a session was not fitted.

use host_image::ImageError;
use host_optics::OpticsError;

use crate::FitError;
use crate::maps::MapsError;

/// What can go wrong between a session and its maps.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// Frames that give no Stokes vector, or an option out of range.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Light, index or roughness outside the models.
    #[error(transparent)]
    Optics(#[from] OpticsError),
    /// Tiles and maps.
    #[error(transparent)]
    Maps(#[from] MapsError),
    /// A picture.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An option that makes no sense.
    #[error("{option} is {found}; {expected}")]
    Option {
        /// Which.
        option: &'static str,
        /// What was given.
        found: String,
        /// What would do.
        expected: &'static str,
    },
    /// One view holds no normal: η, α and two slopes are more than it measures.
    #[error("{views} view; the mode needs at least {needed} from different sides")]
    TooFewViews {
        /// How many there are.
        views: usize,
        /// How many there should be.
        needed: usize,
    },
}
