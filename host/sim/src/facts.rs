//! What the bounds of the effects are made of: the frames of a capture, how Stokes follows from them, and how dark, bright,
//! polarized and uneven the light is.
//!
//! Stokes is estimated from the mean of each angle's frames, in photoelectrons per ms, by least squares with the commanded
//! angles and an ideal polarizer of known transmission: S = W y/t, with W (3 × N) the pseudo-inverse for t = 1. A change of
//! every y_k by at most δ_k t s0 changes component j by at most Σ_k |W_jk| δ_k, in units of s0; a random one with variance
//! v_k by one with variance Σ_k W_jk² v_k. Most bounds are one of these two sums.

use host_image::StokesImage;
use protocol_polar::{Analyzer, LeastSquares};

use crate::capture::{backlash, beam_shift, extinction, light_drift, psf, sheet_axis, vignetting, wheel_error};
use crate::frames::{FrameSpec, schedule};
use crate::scene::Scene;
use crate::sensor::{bayer, dark, prnu, quantization, read, saturation, shot};
use crate::signal::{Band, Signal, checked, grey};
use crate::{Assessment, Effect, EffectSet, SimError};

/// Photosites below this share of their band's brightest do not count: relative to next to no light every change is large.
pub(crate) const DARKEST_SHARE: f32 = 1e-3;

/// ln(2/p) for a probability of p = 1e-6 to be outside on either side.
const TAIL: f64 = 14.508_657_738_524_22;

/// The facts of one view. Photosites below 1/1000 of their band's brightest do not count.
#[derive(Clone, Debug)]
pub struct Facts<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) view: usize,
    pub(crate) frames: Vec<FrameSpec>,
    signal: Signal,
    grey: Band,
    /// W for t = 1, by angle.
    weights: Vec<[f64; 3]>,
    /// Largest DoLP.
    pub(crate) max_dolp: f64,
    /// Smallest s0 that counts, e/ms.
    pub(crate) dark: f64,
    /// Largest s0, e/ms.
    pub(crate) bright: f64,
}

impl<'a> Facts<'a> {
    /// Of the noise-free Stokes `image` (radiance) of view number `view`.
    ///
    /// # Errors
    /// [`SimError::NoView`], [`SimError::Image`], [`SimError::ImageSize`]; [`SimError::NoLight`] for a black image;
    /// [`SimError::Angles`].
    pub fn new(scene: &'a Scene, view: usize, image: &StokesImage) -> Result<Self, SimError> {
        checked(scene, view, image)?;
        let signal = Signal::new(&scene.camera, image, EffectSet::ALL);
        let frames = schedule(scene, image)?;
        let ideal: Vec<Analyzer> = scene.plan.angles.iter().map(|a| Analyzer::ideal(*a)).collect();
        let solved = LeastSquares::new(&ideal).map_err(SimError::Angles)?;
        let [w0, w1, w2] = solved.weights();
        let weights = w0.iter().zip(w1).zip(w2).map(|((a, b), c)| [*a, *b, *c]).collect();
        let (mut dark, mut bright, mut max_dolp) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for [s0, s1, s2] in &signal.bands {
            let least = counted(s0);
            for ((s0, s1), s2) in s0.iter().zip(s1).zip(s2).filter(|((s0, _), _)| **s0 >= least) {
                let s0 = f64::from(*s0);
                dark = dark.min(s0);
                bright = bright.max(s0);
                max_dolp = max_dolp.max(f64::from(*s1).hypot(f64::from(*s2)) / s0);
            }
        }
        if bright <= 0.0 {
            return Err(SimError::NoLight);
        }
        let grey = grey(&scene.camera, image);
        Ok(Self { scene, view, frames, signal, grey, weights, max_dolp, dark, bright })
    }

    /// What leaving an effect of capture or sensor out would change; `None` of an optical one. The proof of each bound stands
    /// with the effect's own file.
    #[must_use]
    pub fn assess(&self, effect: Effect) -> Option<Assessment> {
        Some(match effect {
            Effect::LightDrift => light_drift::assess(self),
            Effect::WheelError => wheel_error::assess(self),
            Effect::Backlash => backlash::assess(self),
            Effect::Extinction => extinction::assess(self),
            Effect::SheetAxis => sheet_axis::assess(self),
            Effect::BeamShift => beam_shift::assess(self),
            Effect::Vignetting => vignetting::assess(self),
            Effect::Psf => psf::assess(self),
            Effect::Shot => shot::assess(self),
            Effect::Read => read::assess(self),
            Effect::Dark => dark::assess(self),
            Effect::Prnu => prnu::assess(self),
            Effect::Quantization => quantization::assess(self),
            Effect::Saturation => saturation::assess(self),
            Effect::Bayer => bayer::assess(self),
            _ => return None,
        })
    }

    /// Throughput t of the polarizer.
    pub(crate) fn throughput(&self) -> f64 {
        self.scene.polarizer.throughput()
    }

    /// max_j Σ_k |W_jk| δ_k for changes of at most δ t s0 in a frame; δ_k is the worst of an angle's frames.
    pub(crate) fn deterministic(&self, change: impl Fn(&FrameSpec) -> f64) -> f64 {
        let mut sums = [0.0; 3];
        for (angle, weights) in self.weights.iter().enumerate() {
            let delta = self.frames.iter().filter(|f| f.angle == angle).map(|f| change(f).abs()).fold(0.0, f64::max);
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum += weight.abs() * delta;
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Bound of independent noise with mean 0 at the darkest photosite, probability 1e-6 to be outside: Bernstein's
    /// inequality, x = L m/3 + √((L m/3)² + 2 L v), L = ln(2/p), for a sum of terms with total variance v, none of which is
    /// above its mean by more than m (or is Poisson with steps of m).
    ///
    /// `variance_e2` is that of one frame, in e², `step_e` its m, in e (0 for Gaussian noise, of which the same is true).
    /// Averaging an angle's repeated frames is counted, that of its different exposures is not.
    pub(crate) fn random(&self, variance_e2: impl Fn(&FrameSpec) -> f64, step_e: f64) -> f64 {
        let repeats = f64::from(self.scene.plan.repeats);
        let to_relative = |f: &FrameSpec| 1.0 / (f.exposure_ms() * self.throughput() * self.dark);
        let worst = |get: &dyn Fn(&FrameSpec) -> f64| self.frames.iter().map(get).fold(0.0, f64::max);
        let frame_variance = worst(&|f| variance_e2(f) * to_relative(f).powi(2) / repeats);
        let frame_step = worst(&|f| step_e * to_relative(f) / repeats);
        let mut squares = [0.0; 3];
        let mut largest = 0.0_f64;
        for weights in &self.weights {
            for (square, weight) in squares.iter_mut().zip(weights) {
                *square += weight * weight;
                largest = largest.max(weight.abs());
            }
        }
        let variance = frame_variance * squares.into_iter().fold(0.0, f64::max);
        let third = TAIL * largest * frame_step / 3.0;
        third + (third * third + 2.0 * TAIL * variance).sqrt()
    }

    /// Largest difference of a Stokes component between a photosite that counts and any other of its band at most `radius` rows
    /// and columns away, relative to s0.
    pub(crate) fn unevenness(&self, radius: usize) -> f64 {
        let (width, height) = (self.signal.width, self.signal.height);
        let mut worst = 0.0_f32;
        for band in &self.signal.bands {
            let least = counted(&band[0]);
            for component in band {
                let low = window(component, width, height, radius, lesser);
                let high = window(component, width, height, radius, greater);
                for (((s, low), high), s0) in component.iter().zip(&low).zip(&high).zip(&band[0]) {
                    if *s0 >= least {
                        worst = greater(greater(high - s, s - low) / s0, worst);
                    }
                }
            }
        }
        f64::from(worst)
    }

    /// Largest difference between what a filtered photosite sees and the mean of the three bands, relative to its s0; 0 for a
    /// grey sensor.
    pub(crate) fn chroma(&self) -> f64 {
        let mut worst = 0.0_f32;
        for band in self.signal.bands.iter().filter(|_| self.signal.pattern.is_some()) {
            let least = counted(&band[0]);
            for (component, grey) in band.iter().zip(&self.grey) {
                for ((s, grey), s0) in component.iter().zip(grey).zip(&band[0]).filter(|(_, s0)| **s0 >= least) {
                    worst = worst.max((s - grey).abs() / s0);
                }
            }
        }
        f64::from(worst)
    }
}

/// The smallest s0 of a band that counts; positive.
pub(crate) fn counted(s0: &[f32]) -> f32 {
    (DARKEST_SHARE * s0.iter().copied().fold(0.0, f32::max)).max(f32::MIN_POSITIVE)
}

/// `pick` (min or max) over the (2 `radius` + 1)² window of every pixel, cut at the edges: across, then down.
fn window(
    plane: &[f32],
    width: usize,
    height: usize,
    radius: usize,
    pick: impl Fn(f32, f32) -> f32 + Copy,
) -> Vec<f32> {
    let fold = |to: &mut [f32], from: &[f32]| to.iter_mut().zip(from).for_each(|(v, o)| *v = pick(*v, *o));
    let mut across = plane.to_vec();
    for (line, row) in across.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
        for step in 1..=radius.min(width - 1) {
            fold(&mut line[step..], row);
            fold(line, &row[step..]);
        }
    }
    let mut out = across.clone();
    for step in 1..=radius.min(height - 1) {
        fold(&mut out[step * width..], &across);
        fold(&mut out, &across[step * width..]);
    }
    out
}

// Unlike f32::min and f32::max these are single instructions; no plane has a NaN.
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the definition, on a plane of odd shape and for windows larger than it.
    #[test]
    fn windows_reach_as_far_as_they_say() {
        let (width, height) = (7_usize, 5_usize);
        let plane: Vec<f32> = (0..35_u8).map(|k| f32::from(k.wrapping_mul(37) % 61)).collect();
        for radius in [0, 1, 2, 9] {
            let found = window(&plane, width, height, radius, greater);
            for (index, value) in found.iter().enumerate() {
                let (row, column) = (index / width, index % width);
                let near = |(k, v): (usize, &f32)| {
                    let inside = row.abs_diff(k / width) <= radius && column.abs_diff(k % width) <= radius;
                    inside.then_some(*v)
                };
                let expected = plane.iter().enumerate().filter_map(near).fold(0.0, f32::max);
                assert_eq!(value.to_bits(), expected.to_bits(), "radius {radius} at {index}");
            }
        }
    }
}
