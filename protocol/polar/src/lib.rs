//! Polarization states and the conventions both ends of the cable share.
//!
//! Frames, angles, Stokes vectors, Mueller matrices, analyzer rows, and the fixed-point formats in which the camera
//! sends Stokes planes. Nothing here knows what a camera, a cable or a file is.
//!
//! Conventions (docs/CONVENTIONS.md has them in full):
//! - A frame is (x, y) with x × y along the direction of propagation; angles are counter-clockwise as the receiver,
//!   looking towards the source, sees them. In a picture: x right, y up. Image rows run *down*.
//! - `s0` is the full power of the beam: an ideal polarizer at φ passes ½ (s0 + s1 cos 2φ + s2 sin 2φ).
//! - In a plane-of-incidence frame x is the perpendicular (s) direction, so `s1 > 0` is s-polarized.
//! - "paper" is Riviere, Reshetouski, Filipi, Ghosh 2017, "Polarization imaging reflectometry in the wild",
//!   supplemental material.
#![no_std]
#![warn(clippy::indexing_slicing, clippy::expect_used, clippy::panic)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        reason = "tests choose numbers that fit"
    )
)]

mod analyzer;
mod angle;
pub mod fixed;
mod flags;
mod least_squares;
mod mueller;
mod stokes;

pub use analyzer::{Analyzer, MAX_FRAMES, efficiency_from_extinction_ratio, extinction_ratio_from_efficiency};
pub use angle::{Degrees, Radians, distinct_axes};
pub use flags::Flags;
pub use least_squares::{LeastSquares, SolveError};
pub use mueller::{Mueller, Reflectance};
pub use stokes::Stokes;
