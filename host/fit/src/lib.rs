//! From frames to Stokes vectors with their uncertainty, on the host.
//!
//! Conventions: samples are row-major, height × width, rows run *down*; Stokes vectors and analyzer angles are in the
//! picture's frame (x right, y up, angles counter-clockwise). Signals are linear in light. Arithmetic is f64, planes are
//! stored in f32.

pub mod closed;
pub mod compare;
pub mod direct;
mod error;
pub mod forward;
pub mod joint;
mod levels;
pub mod light;
pub mod maps;
pub mod material;
mod mosaic;
pub mod pipeline;
mod polarization;
pub mod register;
pub mod relight;
pub mod session;
mod statistics;
mod stokes;
pub mod tiles;
pub mod wheel;

pub use error::FitError;
pub use levels::{ToneCurve, flat_field_gain, low_percentile};
pub use mosaic::PolarizerMosaic;
pub use polarization::{Uncertainty, isotropic_sigma, mas, uncertainty};
pub use protocol_polar::fixed::Noise;
pub use statistics::{NoiseStatistics, Statistics};
pub use stokes::{
    Dark, EstimatorOptions, Frame, FrameSamples, StokesEstimate, StokesEstimator, StokesPlanes, UpperTriangle,
};
