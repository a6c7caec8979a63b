//! What may be chosen of a fit.

use host_image::Picture;
use host_optics::{Ior, Masking};

use super::PipelineError;
use crate::forward::{Body, TableOptions};
use crate::joint::{Loss, Settings, Starts};

/// How a pixel is fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// [`crate::closed::pixel`]: light taken as unpolarized, mirror facets, no α.
    Closed,
    /// [`crate::closed::sky_aware`]: the light's polarization is known, mirror facets, no α.
    SkyAware,
    /// [`crate::joint::fit`], every pixel by itself.
    #[default]
    Joint,
    /// [`Mode::Joint`], then η and α shared by each region.
    JointShared,
}

/// What lies below the facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BodyChoice {
    /// Paper eq. 6.
    Lambert,
    /// Through the interface both ways.
    Interface,
    /// What explains a sample of pixels better.
    #[default]
    Auto,
}

/// What shares η and α.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Regions {
    /// Pixels of one albedo's hue, η and α, as the first pass found them.
    #[default]
    Clusters,
    /// All pixels.
    One,
    /// Pixels of one value of a picture that covers the sample, 0 for those that stay by themselves; its first channel
    /// counts.
    Mask(Picture),
}

/// A candidate where no dielectric fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Metal {
    /// Its name.
    pub name: String,
    /// Index at R, G, B.
    pub index: [Ior; 3],
}

/// Settings of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// How a pixel is fitted.
    pub mode: Mode,
    /// What lies below the facets.
    pub body: BodyChoice,
    /// Masking of facets.
    pub masking: Masking,
    /// Candidates for pixels that refuse a dielectric.
    pub metals: Vec<Metal>,
    /// What shares η and α in [`Mode::JointShared`].
    pub regions: Regions,
    /// Range of η.
    pub eta: [f64; 2],
    /// Range of α.
    pub alpha: [f64; 2],
    /// Largest |n_x/n_z| and |n_y/n_z|.
    pub slope: f64,
    /// Error of s0 aimed at in the tables.
    pub tolerance: f64,
    /// What the model misses beside that, as a standard deviation relative to s0.
    pub model_sigma: f64,
    /// Relative σ of the light's scale; what the light says of itself if `None`.
    pub light_sigma: Option<f64>,
    /// σ of the polarizer's zero, degrees; what the wheel's calibration leaves if `None`.
    pub rotation_sigma_deg: Option<f64>,
    /// σ of each of the wheel's angles before the pictures are seen, degrees; 0: the angles are exact.
    pub wheel_sigma_deg: f64,
    /// How residuals count.
    pub loss: Loss,
    /// From where to descend.
    pub starts: Starts,
    /// Cells along the sample's longer side; as fine as the sharpest view if `None`.
    pub resolution: Option<usize>,
    /// Repair poses that are off by a pixel or more. What differs between views besides the pose (shading, lobes) moves good
    /// poses by 0.25 to 0.45 pixels: of a bumpy sample the intervals then cover 44 % where they should cover 68 %.
    pub refine: bool,
    /// Keep the covariance of each pixel.
    pub covariance: bool,
    /// Samples of a tile's side.
    pub tile: u32,
}

impl Default for FitOptions {
    fn default() -> Self {
        let tables = TableOptions::default();
        Self {
            mode: Mode::default(),
            body: BodyChoice::default(),
            masking: tables.masking,
            metals: Vec::new(),
            regions: Regions::default(),
            eta: [1.2, 2.2],
            alpha: [0.02, 0.7],
            slope: tables.slope,
            // Half of a pixel's usual noise; tables ten times finer take minutes under a sun.
            tolerance: 3e-3,
            model_sigma: 0.0,
            light_sigma: None,
            rotation_sigma_deg: None,
            wheel_sigma_deg: 1.0,
            loss: Loss::default(),
            starts: Starts::default(),
            resolution: None,
            refine: false,
            covariance: false,
            tile: 64,
        }
    }
}

impl Mode {
    /// Whether it asks for tables.
    #[must_use]
    pub const fn is_joint(self) -> bool {
        matches!(self, Self::Joint | Self::JointShared)
    }
}

impl FitOptions {
    /// Whether numbers are where they may be; the ranges of η, α, slope and tolerance are the tables' to judge.
    pub(super) fn check(&self) -> Result<(), PipelineError> {
        let fraction = |option, value: f64, most: f64, expected| {
            if (0.0..=most).contains(&value) {
                return Ok(());
            }
            Err(PipelineError::Option { option, found: value.to_string(), expected })
        };
        fraction("the model's sigma", self.model_sigma, 1.0, "it is 0 to 1, relative to s0")?;
        fraction("the light's sigma", self.light_sigma.unwrap_or(0.0), 1.0, "it is 0 to 1, relative")?;
        fraction("the rotation's sigma", self.rotation_sigma_deg.unwrap_or(0.0), 45.0, "it is 0 to 45 degrees")?;
        fraction("the sigma of the wheel's angles", self.wheel_sigma_deg, 20.0, "it is 0 to 20 degrees")?;
        if self.resolution.is_some_and(|n| !(2..=20_000).contains(&n)) {
            let found = self.resolution.unwrap_or_default().to_string();
            return Err(PipelineError::Option { option: "the resolution", found, expected: "it is 2 to 20000 cells" });
        }
        Ok(())
    }

    /// What the tables are asked for.
    pub(super) fn tables(&self, body: Body) -> TableOptions {
        TableOptions {
            index: crate::forward::IndexRange::Free(self.eta),
            alpha: self.alpha,
            slope: self.slope,
            body,
            masking: self.masking,
            tolerance: self.tolerance,
            ..TableOptions::default()
        }
    }

    /// What the fit of a pixel is asked for.
    pub(super) fn settings(&self, light_sigma: f64, rotation_sigma_deg: f64) -> Settings {
        Settings {
            loss: self.loss,
            starts: self.starts,
            eta: self.eta,
            alpha: self.alpha,
            slope: self.slope,
            light_sigma: self.light_sigma.unwrap_or(light_sigma),
            rotation_sigma_deg: self.rotation_sigma_deg.unwrap_or(rotation_sigma_deg),
            // An interval that maps do not hold, at the price of several descents.
            profile: false,
            ..Settings::default()
        }
    }
}
