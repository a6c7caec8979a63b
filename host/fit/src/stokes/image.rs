//! All pixels of one color: rows in parallel.

use protocol_polar::{Flags, MAX_FRAMES};
use rayon::prelude::*;

use super::StokesEstimator;
use crate::FitError;

/// Sensor output without light, DN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dark<'a> {
    /// The same for every pixel.
    Level(f32),
    /// Per pixel, height × width, row-major.
    Map(&'a [f32]),
}

/// One frame's samples and how to turn them into signals: signal = (sample − dark) · gain.
#[derive(Clone, Copy, Debug)]
pub struct FrameSamples<'a> {
    /// Raw, linear, finite, DN; height × width, row-major.
    pub samples: &'a [f32],
    /// What to subtract.
    pub dark: Dark<'a>,
    /// Flat-field gain per pixel, finite; `None` is 1.
    pub gain: Option<&'a [f32]>,
}

/// Upper triangle of a symmetric 3 × 3 matrix: 00, 01, 02, 11, 12, 22.
pub type UpperTriangle = [f32; 6];

/// Stokes planes of one color; each height × width, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StokesPlanes {
    /// Full power, in DN of the signals.
    pub s0: Vec<f32>,
    /// Horizontal minus vertical.
    pub s1: Vec<f32>,
    /// +45° minus −45°.
    pub s2: Vec<f32>,
    /// Bits of [`Flags`].
    pub flags: Vec<u8>,
    /// rms residual per degree of freedom, if there are more than three frames.
    pub residual: Option<Vec<f32>>,
    /// Covariance of (s0, s1, s2), DN², if a noise model was given. It knows noise only, not wheel errors.
    pub covariance: Option<Vec<UpperTriangle>>,
}

/// One row of every plane, while it is filled.
struct Row<'a> {
    stokes: [&'a mut [f32]; 3],
    flags: &'a mut [u8],
    residual: Option<&'a mut [f32]>,
    covariance: Option<&'a mut [UpperTriangle]>,
}

impl StokesEstimator {
    /// Estimates every pixel of `width`-wide frames. A sample below its dark level is used with its sign, and flagged; a
    /// result too large for f32 is clamped and flagged `OUT_OF_RANGE`.
    ///
    /// # Errors
    /// [`FitError::Size`] where frames, dark or gain maps disagree in number or size.
    pub fn image(&self, frames: &[FrameSamples<'_>], width: usize) -> Result<StokesPlanes, FitError> {
        let pixels = frames.first().map_or(0, |f| f.samples.len());
        let same = |what, found, expected| {
            if found == expected { Ok(()) } else { Err(FitError::Size { what, found, expected }) }
        };
        same("frames", frames.len(), self.frame_count())?;
        same("columns that divide the samples", pixels.checked_rem(width).unwrap_or(1), 0)?;
        for frame in frames {
            same("samples of a frame", frame.samples.len(), pixels)?;
            if let Dark::Map(map) = frame.dark {
                same("samples of a dark map", map.len(), pixels)?;
            }
            same("samples of a gain map", frame.gain.map_or(pixels, <[f32]>::len), pixels)?;
        }
        let mut planes = StokesPlanes {
            s0: vec![0.0; pixels],
            s1: vec![0.0; pixels],
            s2: vec![0.0; pixels],
            flags: vec![0; pixels],
            residual: (self.frame_count() > 3).then(|| vec![0.0; pixels]),
            covariance: self.options.noise.map(|_| vec![[0.0; 6]; pixels]),
        };
        planes.rows(width).into_par_iter().enumerate().for_each(|(y, mut row)| {
            for x in 0..width {
                self.pixel(frames, y * width + x, &mut row, x);
            }
        });
        Ok(planes)
    }

    fn pixel(&self, frames: &[FrameSamples<'_>], index: usize, row: &mut Row<'_>, x: usize) {
        let (mut signals, mut variances) = ([0.0; MAX_FRAMES], [0.0; MAX_FRAMES]);
        let (mut dropped, mut below) = (0_u16, false);
        let white = self.options.white_dn.unwrap_or(f32::INFINITY);
        for (k, frame) in frames.iter().enumerate() {
            let sample = frame.samples[index];
            if sample >= white {
                dropped |= 1 << k;
                continue;
            }
            let dark = match frame.dark {
                Dark::Level(level) => level,
                Dark::Map(map) => map[index],
            };
            below |= sample < dark;
            let gain = frame.gain.map_or(1.0, |g| f64::from(g[index]));
            let signal = f64::from(sample) - f64::from(dark);
            signals[k] = signal * gain;
            if let Some(noise) = self.options.noise {
                let shot = if noise.electrons_per_dn > 0.0 { signal.max(0.0) / noise.electrons_per_dn } else { 0.0 };
                // 1/12 DN² is the rounding of the samples themselves.
                variances[k] = gain * gain * (noise.read_dn * noise.read_dn + shot + 1.0 / 12.0);
            }
        }
        let n = frames.len();
        let variances = self.options.noise.map(|_| &variances[..n]);
        let found = self.estimate(&signals[..n], variances, dropped);
        let mut flags = if below { found.flags.with(Flags::BELOW_BLACK) } else { found.flags };
        let mut store = |value: f64| {
            let (narrow, clamped) = narrowed(value);
            if clamped {
                flags = flags.with(Flags::OUT_OF_RANGE);
            }
            narrow
        };
        for (plane, value) in row.stokes.iter_mut().zip(found.stokes) {
            plane[x] = store(value);
        }
        if let Some(residual) = &mut row.residual {
            residual[x] = store(found.residual);
        }
        if let (Some(plane), Some(c)) = (&mut row.covariance, found.covariance) {
            plane[x] = [c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2]].map(store);
        }
        row.flags[x] = flags.0;
    }
}

impl StokesPlanes {
    /// Every row of every plane, to be filled in parallel.
    fn rows(&mut self, width: usize) -> Vec<Row<'_>> {
        let width = width.max(1);
        let mut residual = self.residual.as_mut().map(|r| r.chunks_exact_mut(width));
        let mut covariance = self.covariance.as_mut().map(|c| c.chunks_exact_mut(width));
        let stokes =
            self.s0.chunks_exact_mut(width).zip(self.s1.chunks_exact_mut(width)).zip(self.s2.chunks_exact_mut(width));
        stokes
            .zip(self.flags.chunks_exact_mut(width))
            .map(|(((s0, s1), s2), flags)| Row {
                stokes: [s0, s1, s2],
                flags,
                residual: residual.as_mut().and_then(Iterator::next),
                covariance: covariance.as_mut().and_then(Iterator::next),
            })
            .collect()
    }
}

/// Rounds to f32; a value beyond its range becomes the largest one, and the second answer says so.
fn narrowed(value: f64) -> (f32, bool) {
    let limit = f64::from(f32::MAX);
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 within its range is what is asked for")]
    let narrow = value.clamp(-limit, limit) as f32;
    (narrow, value.abs() > limit)
}
