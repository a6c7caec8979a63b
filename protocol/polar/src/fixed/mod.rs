//! The fixed-point Stokes: what the camera computes, defined down to the last bit.
//!
//! Everything up to [`Weights`] is done once per capture, in f64. From there on only integers: [`StokesPlan::photosite`]
//! *is* the definition, written for clarity; the camera's strip kernel and any host replay must agree with it bit for
//! bit. The error bound against exact arithmetic is derived in docs/NUMERICS.md and shipped with each capture.

mod format;
mod photosite;
mod plan;
mod weights;

pub use format::{GainQ15, PlaneFormat, Word};
pub use photosite::Photosite;
pub use plan::{FixedError, Noise, SensorRange, StokesPlan};
pub use weights::{MisfitThreshold, Row, Weights};
