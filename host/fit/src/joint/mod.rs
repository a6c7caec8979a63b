//! The joint fit of one pixel: ρ_d (RGB), η, α and the normal from the Stokes vectors of a few views under known light, with
//! their covariance and with reasons where they are not to be trusted (paper eq. 6 inverted).
//!
//! Maximum likelihood, or its robust relatives, by Levenberg-Marquardt in (ln(η − 1), ln α, n_x/n_z, n_y/n_z); the albedos are
//! linear and are at their best at every evaluation. The likelihood can have two minima (a smoother facet with another tilt, a
//! normal turned by 90° under a strongly polarized sky): they are looked for by descents from other starts, and reported.
//! Nothing is allocated for a pixel, nothing panics, and every number that comes out is finite or infinite, never NaN.

mod descend;
#[expect(clippy::needless_range_loop, reason = "indices of matrices")]
mod linear;
#[expect(clippy::needless_range_loop, reason = "indices of matrices")]
mod outcome;
#[expect(clippy::needless_range_loop, reason = "indices of matrices")]
mod point;
#[expect(clippy::needless_range_loop, reason = "indices of matrices")]
mod problem;
mod profile;
mod reasons;
mod region;
mod search;
mod settings;

use crate::material::{Facets, Forward, Observation};

pub use outcome::{Alternative, Fit, PARAMETERS};
pub use reasons::Reasons;
pub use region::{Region, fit_region};
pub use settings::{Limits, Loss, Settings, Starts};

/// Fits one pixel.
///
/// `starts` are guesses, best first: a neighbor's answer, a closed form. Without any a grid takes their place. At most
/// [`crate::material::MAX_VIEWS`] observations are used.
#[must_use]
pub fn fit<F: Forward + ?Sized>(
    forward: &F,
    observations: &[Observation],
    starts: &[Facets],
    settings: &Settings,
) -> Fit {
    search::fit(forward, observations, starts, settings)
}
