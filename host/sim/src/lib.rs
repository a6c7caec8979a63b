//! Forward model: a scene file to Stokes images and camera frames, with only the effects it calls for.
//!
//! Conventions (docs/CONVENTIONS.md): the sample lies in z = 0; Stokes images are in the picture's frame (x right, y up,
//! angles counter-clockwise), planes are row-major height × width with rows running down. Radiance has the scene's unit, raw
//! samples are DN, charges are photoelectrons. Everything random follows the scene's seed and nothing else: results are the
//! same for any number of threads.
//!
//! What comes between a perfect polarization image and a camera's frames is an [`Effect`]. Each says when it applies, an
//! upper bound of what leaving it out would change, and what it costs ([`Assessment`]); [`frames::Exposer`] simulates
//! exactly those it is asked for.

pub mod camera;
mod capture;
mod effect;
mod error;
mod facts;
pub mod frames;
pub mod optical;
pub mod planner;
mod rng;
pub mod scene;
mod sensor;
mod signal;
pub mod simulate;

/// Where in which scene file.
pub use boards::Place;
pub use effect::{Assessment, Effect, EffectSet};
pub use error::SimError;
pub use facts::Facts;
pub use scene::Scene;
pub use simulate::simulate;
