//! From views to the sample plane: Stokes vectors of every view at every node of a grid, with their covariance.
//!
//! Stokes vectors are estimated at the picture's own pixels (clipped samples dropped, covariance from the noise model
//! with its shot noise), then resampled: value Σ w s, covariance Σ w² C, as pixels are independent. Neighboring nodes
//! share pixels, so their errors are correlated over about a pixel's size in the plane; that is not carried. Then every
//! vector is taken into the camera frame of its own ray, and its covariance with it.
//!
//! Memory: a [`Tile`] holds its nodes and the part of each picture they need; the pictures stay as they were read.

pub(crate) mod dense;
mod grid;
mod kernel;
mod refine;
mod tile;
mod window;

use glam::{DMat2, DMat3, DVec2};

pub use kernel::Interpolation;
pub use refine::{Refinement, Refused};
pub use tile::{NodeFlags, Tile};

use crate::FitError;
use crate::maps::Grid;
use crate::session::{ReferenceCorrection, Session, ViewCapture, ViewData, homography};
use kernel::Lattice;
use window::Windows;

/// All views of a session on one grid.
pub struct Registration<'a> {
    grid: Grid,
    interpolation: Interpolation,
    views: Vec<RegisteredView<'a>>,
}

/// One view on the grid.
struct RegisteredView<'a> {
    capture: &'a ViewCapture,
    /// Plane to pixel: that of the pose, or as refined.
    homography: DMat3,
    correction: ReferenceCorrection,
    /// Radiance per unit of the pictures, R, G, B.
    scale: [f64; 3],
    windows: Windows<'a>,
    /// Where each band's sites are.
    lattices: [Vec<Lattice>; 3],
}

impl<'a> Registration<'a> {
    /// Places the views on the grid by their poses.
    ///
    /// # Errors
    /// [`FitError`] of frames that give no Stokes vector.
    pub fn new(session: &'a Session, grid: Grid, interpolation: Interpolation) -> Result<Self, FitError> {
        let views = session.views.iter().map(RegisteredView::new).collect::<Result<_, _>>()?;
        Ok(Self { grid, interpolation, views })
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Number of views.
    #[must_use]
    pub fn view_count(&self) -> usize {
        self.views.len()
    }

    /// Plane to pixel of a view, as it is used.
    #[must_use]
    pub fn homography(&self, view: usize) -> DMat3 {
        self.views[view].homography
    }

    /// Puts another homography in place of the pose's, e.g. one that was measured; directions stay those of the pose.
    pub fn set_homography(&mut self, view: usize, plane_to_pixel: DMat3) {
        self.views[view].homography = plane_to_pixel;
    }
}

impl<'a> RegisteredView<'a> {
    fn new(capture: &'a ViewCapture) -> Result<Self, FitError> {
        let analyzers = capture.data.analyzers();
        let bayer = match &capture.data {
            ViewData::Frames(frames) => frames.bayer,
            ViewData::Stokes(source) if source.is_single() => source.image.metadata.bayer,
            ViewData::Stokes(_) => None,
        };
        Ok(Self {
            capture,
            homography: capture.camera.plane_to_pixel(),
            correction: ReferenceCorrection::new(capture.reference, &capture.camera, &analyzers),
            scale: match &capture.data {
                ViewData::Frames(frames) => frames.radiance_per_dn,
                ViewData::Stokes(source) => source.radiance_per_unit,
            },
            windows: Windows::new(&capture.data)?,
            lattices: Lattice::of_bands(bayer),
        })
    }

    /// Where a node is in the picture and what sides its cell has there, if it is in front of the camera.
    fn place(&self, grid: &Grid, node: DVec2) -> Option<(DVec2, DMat2)> {
        let pixel = homography::project(&self.homography, node)?;
        let j = homography::jacobian(&self.homography, node);
        Some((pixel, DMat2::from_cols(j.x_axis * grid.step().x, j.y_axis * grid.step().y)))
    }

    fn contains(&self, pixel: DVec2) -> bool {
        let [width, height] = self.capture.camera.size();
        pixel.cmpge(DVec2::ZERO).all() && pixel.x <= width as f64 && pixel.y <= height as f64
    }
}
