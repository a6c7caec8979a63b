//! What a view holds: raw frames behind a polarizer, or a Stokes image that somebody made of them.

use std::path::Path;

use host_image::{BayerPattern, Color, Encoding, Picture, Samples, StokesImage};
use protocol_polar::{Analyzer, Degrees, Radians};

use super::SessionError;
use crate::wheel::{WheelEstimate, WheelOptions, calibrate_wheel};
use crate::{FitError, Noise};

/// Frames of one view through one wheel, gain and black level locked.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// Name of the sequence.
    pub sequence: String,
    /// One per frame: angle (nominal, until [`Frames::correct`]), exposure against the view's, efficiency.
    pub analyzers: Vec<Analyzer>,
    /// One per frame; linear, all of one size and sample type.
    pub pictures: Vec<Picture>,
    /// Signal without light, DN.
    pub black_dn: f32,
    /// A sample at or above this is saturated, DN.
    pub white_dn: Option<f32>,
    /// Noise of a sample.
    pub noise: Noise,
    /// Radiance of one DN above black in R, G, B, at the exposure of throughput 1.
    pub radiance_per_dn: [f64; 3],
    /// Color filters of a raw mosaic.
    pub bayer: Option<BayerPattern>,
}

/// A Stokes image as the source of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct StokesSource {
    /// Planes in [`StokesSource::radiance_per_unit`].
    pub image: StokesImage,
    /// Radiance of one unit of the planes, R, G, B.
    pub radiance_per_unit: [f64; 3],
    /// How well they are known.
    pub noise: StokesNoise,
}

/// Noise of a Stokes image.
#[derive(Clone, Debug, PartialEq)]
pub enum StokesNoise {
    /// Standard deviation of s0 relative to s0; of s1 and s2 √2 of that, as N equispaced frames have it.
    Relative(f64),
    /// Made from frames like these, noise in DN.
    Frames {
        /// Of each frame.
        analyzers: Vec<Analyzer>,
        /// Of a sample.
        noise: Noise,
    },
}

impl Frames {
    /// Columns and rows of the pictures.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.pictures.first().map_or([0, 0], |p| [p.width, p.height])
    }

    /// Samples of a pixel: 3, or 1 of grey pictures and mosaics.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.pictures.first().map_or(0, |p| p.channels)
    }

    /// Sample number `index` (row-major, interleaved) of frame `k`, as stored.
    #[must_use]
    pub fn sample(&self, k: usize, index: usize) -> f32 {
        match &self.pictures[k].samples {
            Samples::U8(v) => f32::from(v[index]),
            Samples::U16(v) => f32::from(v[index]),
            Samples::F32(v) => v[index],
        }
    }

    /// The errors of the wheel's angles, from all samples that no frame clips.
    ///
    /// # Errors
    /// [`FitError`] for frames that give no Stokes vector.
    pub fn calibrate(&self, prior: Radians) -> Result<WheelEstimate, FitError> {
        let [width, height] = self.size();
        let white = self.white_dn.unwrap_or(f32::INFINITY);
        let options = WheelOptions { prior, noise: self.noise };
        calibrate_wheel(&self.analyzers, options, width * height * self.channels(), |i, signals| {
            signals.iter_mut().enumerate().all(|(k, signal)| {
                let sample = self.sample(k, i);
                *signal = f64::from(sample) - f64::from(self.black_dn);
                sample < white
            })
        })
    }

    /// Adds what was found to the angles.
    pub fn correct(&mut self, estimate: &WheelEstimate) {
        for (analyzer, correction) in self.analyzers.iter_mut().zip(&estimate.corrections) {
            analyzer.angle = Radians(analyzer.angle.0 + correction.0);
        }
    }
}

impl StokesSource {
    /// Analyzers the image was made with; empty if that is not known.
    #[must_use]
    pub fn analyzers(&self) -> Vec<Analyzer> {
        let ideal = |d: &f64| Analyzer::ideal(Degrees(*d).to_radians());
        match &self.noise {
            StokesNoise::Frames { analyzers, .. } => analyzers.clone(),
            StokesNoise::Relative(_) => self.image.metadata.angles_deg.iter().map(ideal).collect(),
        }
    }

    /// Whether the planes are the photosites of a mosaic or grey, not R, G, B.
    #[must_use]
    pub fn is_single(&self) -> bool {
        matches!(self.image.colors.first().map(|c| c.color), Some(Color::Y))
    }
}

/// Refuses a picture whose numbers do not follow the light.
pub(super) fn require_linear(picture: &Picture, path: &Path) -> Result<(), SessionError> {
    match picture.encoding {
        Encoding::Linear | Encoding::Unstated => Ok(()),
        other => Err(SessionError::Unsupported {
            place: path.display().to_string(),
            key: "the samples' coding".to_owned(),
            found: format!("{other:?}"),
            known: "linear samples are: develop raw files without a tone curve, to 16 bits or OpenEXR".to_owned(),
        }),
    }
}
