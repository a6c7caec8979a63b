//! The fast forward model: eq. 6 under one known light, tabulated, with derivatives.
//!
//! The specular part of a view depends on six numbers. Each is treated as what it is:
//! - the mirror direction r of ω_o at the normal, in which it changes as fast as the light and the lobe let it: quadratic
//!   splines on a grid for each α, as fine as measured third differences ask for ([`spline`]);
//! - ln α: quadratic splines again. Their coefficients are themselves integrals, of a mixture of three lobes ([`lobe`]);
//! - η: a few indices whose Fresnel terms span all others ([`index`]);
//! - ω_o at fixed r, on which only frames, Fresnel terms and the shape of the lobe depend: a parabola over a patch of the view
//!   ([`solve`]).
//!
//! Values are Stokes in the camera frame of their own ω_o, which is smooth in all of them. The model is C¹ and its derivatives
//! are its own. A response is some 1500 vector multiply-adds over tables of f32.
//!
//! What errs most is the grid near bright light, the parabola at grazing views (n·ω_o < 0.25) and, where α is below some 1.5
//! times its step, the map of the light itself.
//!
//! Beyond a range asked for, a parameter x at the bound b goes on as b + d/(1 + d/w), d = x − b: the model stays finite,
//! continuous with its slope, and monotone in what it was monotone in, with a derivative that gets small but not zero, so that
//! an optimizer that stepped out finds back. A normal that faces away from the camera is [`Response::BLACK`].

mod body;
mod build;
mod cells;
mod chart;
mod index;
mod lobe;
mod numbers;
mod respond;
mod solve;
mod spacing;
mod spline;
mod view;
mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::light::KnownLight;
use crate::material::{Facets, Forward, Response};
use glam::DVec3;
use host_optics::{Ior, Masking, OpticsError};
use std::time::{Duration, Instant};
use view::ViewTable;

/// Where light that enters the body comes out again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// Paper eq. 6: ρ_d/π, unpolarized.
    #[default]
    Lambert,
    /// Through the interface both ways ([`host_optics::diffuse`]), partly polarized. None under a metal.
    Interface,
}

/// What of the material is known of its index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IndexRange {
    /// A dielectric with η in [low, high], low >= 1.
    Free([f64; 2]),
    /// Known at R, G and B: a metal, a known coating. Not a parameter.
    Fixed([Ior; 3]),
}

/// What tables cover and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableOptions {
    /// η.
    pub index: IndexRange,
    /// GGX α, 0 < low < high <= 1.
    pub alpha: [f64; 2],
    /// |n_x/n_z|, |n_y/n_z| up to this.
    pub slope: f64,
    /// Diffuse part.
    pub body: Body,
    /// Masking of facets.
    pub masking: Masking,
    /// Error of s0 aimed at, in the median, where memory allows; one in twenty errs by two to six times as much, near a sun
    /// or at grazing views more. [`ViewReport`] tells what was reached.
    pub tolerance: f64,
    /// Most bytes of one view's table: grids of the smallest α are coarsened until they fit.
    pub memory_bytes: usize,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            index: IndexRange::Free([1.2, 2.2]),
            alpha: [0.01, 0.7],
            slope: 0.7,
            body: Body::Lambert,
            masking: Masking::HeightCorrelated,
            tolerance: 1e-3,
            memory_bytes: 64 << 20,
        }
    }
}

/// The rays of one view of the sample.
#[derive(Clone, Debug)]
pub struct ViewRays {
    /// x axis of the camera's picture, world.
    pub camera_x: DVec3,
    /// Directions ω_o (any length) whose span covers the sample: its corners and center at least.
    pub rays: Vec<DVec3>,
}

/// What one view's table became.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewReport {
    /// Bytes of the table.
    pub bytes: usize,
    /// Wall time of its making.
    pub time: Duration,
    /// Error of any of the specular (s0, s1, s2) against sums over the light, relative to s0 (of at least a hundredth of the
    /// brightest), at materials spread over the ranges that are seen at 75° or less: median, 95th percentile, worst.
    pub error: [f64; 3],
    /// How many were tried.
    pub tests: usize,
}

/// [`Forward`] for the views of a capture, from tables.
#[derive(Debug)]
pub struct Tables {
    views: Vec<ViewTable>,
    reports: Vec<ViewReport>,
    index_is_free: bool,
}

impl Tables {
    /// Tables for every view, in parallel.
    ///
    /// # Errors
    /// [`OpticsError::Range`] for a range that is empty or outside the model, [`OpticsError::Index`] for an index below 1,
    /// [`OpticsError::Direction`] and [`OpticsError::AxisAlongRay`] for a ray without a direction or a frame.
    pub fn new(light: &KnownLight, views: &[ViewRays], options: &TableOptions) -> Result<Self, OpticsError> {
        options.check()?;
        let mut out = Self {
            views: Vec::new(),
            reports: Vec::new(),
            index_is_free: matches!(options.index, IndexRange::Free(_)),
        };
        for rays in views {
            let start = Instant::now();
            let table = build::view(light, rays, options)?;
            let time = start.elapsed();
            let (error, tests) = build::measure(&table, light, options);
            out.reports.push(ViewReport { bytes: table.bytes(), time, error, tests });
            out.views.push(table);
        }
        Ok(out)
    }

    /// One per view.
    #[must_use]
    pub fn reports(&self) -> &[ViewReport] {
        &self.reports
    }
}

impl Forward for Tables {
    fn index_is_free(&self) -> bool {
        self.index_is_free
    }

    fn response(&self, view: usize, direction: DVec3, facets: &Facets) -> Response {
        self.views.get(view).map_or(Response::BLACK, |table| table.response(direction, facets))
    }
}

impl TableOptions {
    fn check(&self) -> Result<(), OpticsError> {
        let range = |name, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(OpticsError::Range { name, value, low, high }) }
        };
        range("smallest alpha of a table", self.alpha[0], 1e-3, 1.0)?;
        range("largest alpha of a table", self.alpha[1], self.alpha[0], 1.0)?;
        range("largest slope of a table", self.slope, 0.0, 5.0)?;
        range("tolerance of a table", self.tolerance, 1e-6, 1.0)?;
        if let IndexRange::Free([low, high]) = self.index {
            range("smallest index of a table", low, 1.0, 10.0)?;
            range("largest index of a table", high, low, 10.0)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
