//! The physics that simulator and fit share: Fresnel, GGX, the sky, and paper eq. 6 evaluated. f64 throughout;
//! the pointwise functions of [`fresnel`] and [`ggx`] in f32 too, for lanes (`single()` of a validated f64 value).
//!
//! Conventions (docs/CONVENTIONS.md):
//! - Directions are unit [`glam::DVec3`] in the world (sample in z = 0, mean normal +z) and point away from the surface:
//!   ω_i to the light, ω_o to the camera.
//! - Light of one color band is linear Stokes `[L, Q, U]` in a stated [`Frame`]; of the sky in [`Frame::sky`]. Never an
//!   angle of polarization: it is undefined at neutral points.
//! - Angles of incidence are pairs (cos θ, sin² θ), rotations pairs (cos 2α, sin 2α): [`Incidence`], [`Turn`].
//! - "paper" is Riviere, Reshetouski, Filipi, Ghosh 2017, "Polarization imaging reflectometry in the wild",
//!   supplemental material.
//!
//! ```
//! use glam::DVec3;
//! use host_optics::integral::{FixedPoints, View};
//! use host_optics::sky::{MoonSpencer, Polarized, Rayleigh};
//! use host_optics::{Ggx, Ior, Masking, Microfacet};
//!
//! // Acrylic near its Brewster angle under a polarized sky, seen from the south (−y) with the horizon level.
//! let surface = Microfacet { ior: Ior::new(1.49, 0.0)?, ggx: Ggx::new(0.1, Masking::HeightCorrelated)? };
//! let sky = Polarized { light: MoonSpencer { zenith: 1.0 }, pattern: Rayleigh::new(DVec3::new(1.0, 0.0, 0.5), 0.7)? };
//! let view = View::new(DVec3::new(0.0, -0.83, 0.56), DVec3::X)?;
//! let [s0, s1, _] = FixedPoints::new(8).specular(&sky, &surface, DVec3::Z, &view);
//! assert!(s1 > 0.5 * s0, "light is polarized horizontally, along the s axis");
//! # Ok::<(), host_optics::OpticsError>(())
//! ```

pub mod brdf;
pub mod diffuse;
mod error;
pub mod frames;
pub mod fresnel;
pub mod ggx;
pub mod integral;
pub mod ior;
pub mod materials;
pub mod prefilter;
mod real;
pub mod sky;
pub mod trs;

pub use brdf::{LinearMueller, Microfacet, Reflection};
pub use diffuse::PolarizedDiffuse;
pub use error::OpticsError;
pub use frames::{Frame, Incidence, Turn};
pub use ggx::{Ggx, Masking};
pub use ior::{Conductor, Dielectric, Ior};
pub use real::Real;
pub use sky::Light;
