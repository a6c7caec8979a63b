//! The whole fit, from a session to maps of material: wheel angles, registration, light, tables, tiles, regions.
//!
//! 1. [`calibrate_wheels`] corrects the polarizer angles of a session's views from their own frames.
//! 2. [`Prepared::new`] puts the views on one grid, takes up the light and makes the forward model's tables.
//! 3. [`Prepared::run`] fits tiles into a [`crate::tiles::TileStore`]; a tile depends on nothing but its own samples.
//! 4. [`Prepared::share`] refits the whole map with one η and one α for each region ([`Mode::JointShared`]).
//!
//! What a σ holds: the sensor's noise as the estimator carries it; the error of the tables and whatever else the model is
//! said to miss, relative to s0 and independent from band to band; the angles of the wheel, their common turn as a
//! nuisance of each view, the rest as noise of s1, s2 (and s0); the scale of the light. What many pixels have in common (a
//! turned wheel, a wrong scale) does not average out over a map: only σ of shared η and α say so.

mod error;
mod identity;
mod metals;
mod noise;
mod options;
mod prepare;
mod regions;
mod share;
mod solve;
mod wheels;
mod zero;

pub use error::PipelineError;
pub use options::{BodyChoice, FitOptions, Metal, Mode, Regions};
pub use prepare::{BodyTrial, Prepared, Report};
pub use share::{RegionSummary, Shared};
pub use wheels::calibrate_wheels;
