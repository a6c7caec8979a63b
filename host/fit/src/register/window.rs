//! Stokes vectors of a part of a picture, at its own pixels, as they are needed.

use std::ops::Range;

use protocol_polar::{Flags, LeastSquares};

use crate::session::{Frames, StokesNoise, StokesSource, ViewData};
use crate::stokes::UpperTriangle;
use crate::{Dark, EstimatorOptions, FitError, Frame, FrameSamples, StokesEstimator};

/// Makes windows of one view.
pub(super) struct Windows<'a> {
    data: &'a ViewData,
    /// For frames.
    estimator: Option<StokesEstimator>,
    /// For a Stokes image with known frames.
    solver: Option<LeastSquares>,
}

/// A rectangle of a picture.
pub(super) struct Window {
    columns: Range<usize>,
    rows: Range<usize>,
    /// One per channel of the picture (three, or one), row-major over the rectangle; unit of the source.
    channels: Vec<Vec<WindowPixel>>,
}

/// A pixel of one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WindowPixel {
    pub(super) stokes: [f32; 3],
    pub(super) covariance: UpperTriangle,
    pub(super) flags: Flags,
}

impl Window {
    /// Pixel of a channel; panics outside the rectangle.
    pub(super) fn pixel(&self, channel: usize, [x, y]: [usize; 2]) -> &WindowPixel {
        &self.channels[channel][(y - self.rows.start) * self.columns.len() + x - self.columns.start]
    }

    /// Of a band: bands of a picture of one channel all are that one.
    pub(super) fn channel_of(&self, band: usize) -> usize {
        band.min(self.channels.len() - 1)
    }
}

impl<'a> Windows<'a> {
    /// # Errors
    /// [`FitError`] of frames that give no Stokes vector.
    pub(super) fn new(data: &'a ViewData) -> Result<Self, FitError> {
        let (mut estimator, mut solver) = (None, None);
        match data {
            ViewData::Frames(frames) => {
                let weights: Vec<Frame> = frames.analyzers.iter().map(|a| Frame::new(*a)).collect();
                let options = EstimatorOptions {
                    white_dn: frames.white_dn,
                    noise: Some(frames.noise),
                    ..EstimatorOptions::default()
                };
                estimator = Some(StokesEstimator::new(&weights, options)?);
            }
            ViewData::Stokes(source) => {
                if let StokesNoise::Frames { analyzers, .. } = &source.noise {
                    solver = LeastSquares::new(analyzers).ok();
                }
            }
        }
        Ok(Self { data, estimator, solver })
    }

    /// Estimates a rectangle, within the picture and not empty.
    ///
    /// # Errors
    /// [`FitError::Size`] of frames that disagree.
    pub(super) fn window(&self, columns: Range<usize>, rows: Range<usize>) -> Result<Window, FitError> {
        let channels = match (self.data, &self.estimator) {
            (ViewData::Frames(frames), Some(estimator)) => (0..frames.channels())
                .map(|channel| estimated(frames, estimator, channel, &columns, &rows))
                .collect::<Result<_, _>>()?,
            (ViewData::Frames(_), None) => Vec::new(),
            (ViewData::Stokes(source), _) => {
                (0..source.image.colors.len()).map(|channel| self.read(source, channel, &columns, &rows)).collect()
            }
        };
        Ok(Window { columns, rows, channels })
    }

    fn read(
        &self,
        source: &StokesSource,
        channel: usize,
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) -> Vec<WindowPixel> {
        let planes = &source.image.colors[channel];
        let pixels = rows.clone().flat_map(|y| columns.clone().map(move |x| y * source.image.width + x));
        pixels
            .map(|i| {
                let stokes = [planes.s0[i], planes.s1[i], planes.s2[i]];
                let flags = planes.flags.as_ref().map_or(Flags::default(), |f| Flags(f[i]));
                let covariance = self.covariance(source, stokes);
                WindowPixel { stokes, covariance, flags }
            })
            .collect()
    }

    fn covariance(&self, source: &StokesSource, stokes: [f32; 3]) -> UpperTriangle {
        match (&source.noise, &self.solver) {
            (StokesNoise::Relative(share), _) => {
                let variance = (share * f64::from(stokes[0])).powi(2);
                [variance, 0.0, 0.0, 2.0 * variance, 0.0, 2.0 * variance].map(single)
            }
            (StokesNoise::Frames { analyzers, noise }, Some(solver)) => {
                // The frames these Stokes vectors came from, and W diag(variances) Wᵀ.
                let weights = solver.weights();
                let mut sums = [0.0; 6];
                for (k, analyzer) in analyzers.iter().enumerate() {
                    let signal: f64 = analyzer.row().iter().zip(stokes).map(|(a, s)| a * f64::from(s)).sum();
                    let shot =
                        if noise.electrons_per_dn > 0.0 { signal.max(0.0) / noise.electrons_per_dn } else { 0.0 };
                    let variance = noise.read_dn * noise.read_dn + shot + 1.0 / 12.0;
                    for (sum, (i, j)) in sums.iter_mut().zip(PAIRS) {
                        *sum += weights[i][k] * weights[j][k] * variance;
                    }
                }
                sums.map(single)
            }
            // Angles that determine nothing were refused when the view was made; an infinite 00 is no answer.
            (StokesNoise::Frames { .. }, None) => [f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0],
        }
    }
}

/// Elements of an [`UpperTriangle`].
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

fn estimated(
    frames: &Frames,
    estimator: &StokesEstimator,
    channel: usize,
    columns: &Range<usize>,
    rows: &Range<usize>,
) -> Result<Vec<WindowPixel>, FitError> {
    let (width, channels) = (frames.size()[0], frames.channels());
    let crop = |k: usize| -> Vec<f32> {
        let pixels = rows.clone().flat_map(|y| columns.clone().map(move |x| (y * width + x) * channels + channel));
        pixels.map(|i| frames.sample(k, i)).collect()
    };
    let crops: Vec<Vec<f32>> = (0..frames.pictures.len()).map(crop).collect();
    let dark = Dark::Level(frames.black_dn);
    let samples: Vec<FrameSamples<'_>> =
        crops.iter().map(|samples| FrameSamples { samples, dark, gain: None }).collect();
    let planes = estimator.image(&samples, columns.len())?;
    let covariance = planes.covariance.as_deref().unwrap_or_default();
    let pixel = |i: usize| WindowPixel {
        stokes: [planes.s0[i], planes.s1[i], planes.s2[i]],
        covariance: covariance.get(i).copied().unwrap_or_default(),
        flags: Flags(planes.flags[i]),
    };
    Ok((0..planes.s0.len()).map(pixel).collect())
}

#[expect(clippy::cast_possible_truncation, reason = "planes are f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}
