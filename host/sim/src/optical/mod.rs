//! The optical half of the forward model: what light leaves each pixel's surface towards the camera, as Stokes vectors without
//! noise, with only the effects it is asked for.
//!
//! - A picture comes in as one [`Pixel`] per camera ray and leaves as s0, s1, s2 of three bands, in the camera frame of each
//!   ray ([`host_optics::Frame::camera`]); rows run down, row-major.
//! - [`crate::EffectSet`] says which effects must be in the picture. Leaving one out is a permission: a method for which an effect
//!   costs nothing keeps it.
//! - [`Evaluation`] says how paper eq. 6 is integrated. The pixel loop is compiled once per kind of reflection, so that an
//!   effect left out is neither computed nor asked for.
//! - Results do not depend on the number of threads.

mod bounds;
mod chart;
mod diffuse_field;
pub mod effects;
mod facts;
mod light;
mod lune;
pub(crate) mod numbers;
mod render;
mod specular;
mod sun_lobe;
mod survey;
mod table;

pub use facts::OpticalFacts;
pub use light::{LightBounds, Radiance, SceneLight, SkyPattern, Sun};
pub use render::{Renderer, Rendering, SurfaceReport, Timing};
pub use specular::{Evaluation, Method};
pub use survey::{PixelMap, SurfaceExtent, Survey};

use host_optics::ggx::MIN_ALPHA;
use host_optics::{Ggx, Ior};

/// What one camera ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Unit normal, world.
    pub normal: [f32; 3],
    /// Unit ω_o, world, from the surface to the camera.
    pub to_camera: [f32; 3],
    /// ρ_d, R, G, B.
    pub albedo: [f32; 3],
    /// Index of its surface; [`Pixel::NOTHING`] is a ray that meets none and stays black.
    pub surface: u16,
}

impl Pixel {
    /// Surface index of a ray that meets nothing.
    pub const NOTHING: u16 = u16::MAX;
}

/// Where light that enters the body comes out again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// Paper eq. 6: ρ_d/π, unpolarized.
    Lambert,
    /// Through the interface both ways ([`host_optics::diffuse`]); partly polarized. None in a conductor.
    Interface,
}

/// A homogeneous surface but for its albedo and normals, which belong to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Index at R, G, B.
    pub ior: [Ior; 3],
    /// Facets.
    pub ggx: Ggx,
    /// Diffuse part.
    pub body: Body,
}

impl Surface {
    /// Whether it has no roughness to speak of: every method takes it for a mirror.
    #[must_use]
    pub fn is_mirror(&self) -> bool {
        self.ggx.alpha() <= MIN_ALPHA
    }
}
