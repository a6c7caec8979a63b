//! The material of a pixel and what it does to light: the vocabulary of the fit.
//!
//! - World frame: the sample lies in z = 0, mean normal +z. ω_o points from the surface to the camera.
//! - Stokes values are [`Lanes`]: band-major (s0, s1, s2) of R, G, B, in the camera frame of the ray
//!   ([`host_optics::Frame::camera`] of ω_o and the view's x axis), in the unit of the light's radiance.
//! - The response to a material is linear in ρ_d and non-linear in [`Facets`]: s = specular + ρ_d · diffuse, band by band
//!   (paper eq. 6).

use glam::DVec3;

/// Color bands.
pub const BANDS: usize = 3;

/// Most views of one pixel.
pub const MAX_VIEWS: usize = 8;

/// s0, s1, s2 of R, then of G, then of B.
pub type Lanes = [f64; 3 * BANDS];

/// What the response depends on non-linearly: index of refraction, roughness and normal of a dielectric's facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets {
    /// η, > 1; of no meaning to a [`Forward`] of a fixed index.
    pub eta: f64,
    /// GGX α (the paper's σ), > 0.
    pub alpha: f64,
    /// (n_x/n_z, n_y/n_z): a chart of the upper hemisphere without a bound.
    pub slope: [f64; 2],
}

impl Facets {
    /// Unit normal, n_z > 0.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        DVec3::new(self.slope[0], self.slope[1], 1.0).normalize()
    }
}

/// Indices of [`Response::specular_by`] and [`Response::diffuse_by`].
pub mod by {
    /// ∂/∂η.
    pub const ETA: usize = 0;
    /// ∂/∂α.
    pub const ALPHA: usize = 1;
    /// ∂/∂(n_x/n_z).
    pub const SLOPE_X: usize = 2;
    /// ∂/∂(n_y/n_z).
    pub const SLOPE_Y: usize = 3;
}

/// The light that one view gets from a pixel, and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Microfacet term of eq. 6.
    pub specular: Lanes,
    /// Its derivatives, see [`by`].
    pub specular_by: [Lanes; 4],
    /// Diffuse term for ρ_d = 1.
    pub diffuse: Lanes,
    /// Its derivatives, see [`by`].
    pub diffuse_by: [Lanes; 4],
}

impl Response {
    /// No light.
    pub const BLACK: Self =
        Self { specular: [0.0; 9], specular_by: [[0.0; 9]; 4], diffuse: [0.0; 9], diffuse_by: [[0.0; 9]; 4] };
}

/// Eq. 6 under one known light, for every view of a capture: the forward model a fit inverts.
pub trait Forward: Sync {
    /// Whether η is a parameter. If not (a metal, a known coating) every derivative by it is 0.
    fn index_is_free(&self) -> bool;

    /// What view number `view` gets along unit ω_o = `direction`. [`Response::BLACK`] if the surface faces away.
    fn response(&self, view: usize, direction: DVec3, facets: &Facets) -> Response;
}

/// One view's measurement of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Number of the view, as [`Forward::response`] counts.
    pub view: usize,
    /// Unit ω_o.
    pub direction: DVec3,
    /// (s0, s1, s2) of R, G, B in the camera frame of the ray, unit of the light's radiance.
    pub stokes: [[f32; 3]; BANDS],
    /// Covariance of each band's (s0, s1, s2): 00, 01, 02, 11, 12, 22. A band without an answer has an infinite 00.
    pub covariance: [[f32; 6]; BANDS],
}
