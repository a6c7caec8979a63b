//! From a noise-free Stokes image to the raw frames of a capture, with the effects asked for and no trace of the others.
//!
//! A frame is built row by row, rows in parallel. What changes the analyzer (drift, angle errors, extinction) is folded into its
//! row ½ t [1, ε cos 2φ, ε sin 2φ] once per frame; everything per photosite is a list of stages that an effect left out is not on. A
//! random draw follows seed, view, frame and photosite only.

mod plan;
mod schedule;
#[cfg(test)]
pub(crate) mod testing;

use std::borrow::Cow;

use glam::DVec2;
use host_image::StokesImage;
use protocol_polar::{Analyzer, Radians};
use rayon::prelude::*;

use crate::camera::Pinhole;
use crate::capture::sheet_axis::SheetRow;
use crate::capture::vignetting::Vignetting;
use crate::capture::{backlash, beam_shift, extinction, light_drift, psf, wheel_error};
use crate::rng::{Draw, Generator, Stream};
use crate::scene::Scene;
use crate::sensor::dark::Dark;
use crate::sensor::prnu::Prnu;
use crate::sensor::quantization;
use crate::sensor::read::Read;
use crate::sensor::saturation::{Well, clip};
use crate::sensor::shot::Shot;
use crate::signal::{Band, Signal, checked, single};
use crate::{Effect, EffectSet, SimError};

pub use plan::{FramePlan, FrameRow, true_difference};
pub(crate) use schedule::schedule;

/// One frame of the plan, as commanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSpec {
    /// Index of its angle in [`crate::scene::Plan::angles`].
    pub angle: usize,
    /// Polarizer angle asked for.
    pub commanded: Radians,
    /// How long it is exposed, µs.
    pub exposure_us: f64,
    /// When the exposure starts, seconds after that of the first frame.
    pub start_s: f64,
}

/// Simulates the frames of one view.
pub struct Exposer<'a> {
    scene: Cow<'a, Scene>,
    view: usize,
    camera: Pinhole,
    effects: EffectSet,
    frames: Vec<FrameSpec>,
    source: Source,
    stages: Vec<Box<dyn RowStage>>,
    width: usize,
    height: usize,
}

/// Something that happens to a row of photosites.
pub(crate) trait RowStage: Send + Sync {
    /// Changes the charges (electrons) of one row, width values.
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]);
}

/// Which row of which frame.
pub(crate) struct Row<'a> {
    pub(crate) frame: &'a FrameSpec,
    pub(crate) row: usize,
    seed: u64,
    view: usize,
    index: usize,
}

/// A frame as it really is taken.
struct Taken<'a> {
    frame: &'a FrameSpec,
    analyzer: Analyzer,
    /// Number of its random draws.
    index: usize,
}

/// Where the light of a photosite comes from.
enum Source {
    /// Its own place: each photosite's (s0, s1, s2).
    Fixed(Band),
    /// Places that move with the polarizer.
    Shifted(Signal),
}

impl FrameSpec {
    /// How long it is exposed, ms.
    #[must_use]
    pub fn exposure_ms(&self) -> f64 {
        1e-3 * self.exposure_us
    }

    /// Middle of the exposure, seconds after the start of the capture.
    #[must_use]
    pub fn middle_s(&self) -> f64 {
        self.start_s + 0.5e-6 * self.exposure_us
    }
}

impl Row<'_> {
    /// Visits every photosite of the row with a generator of its own.
    pub(crate) fn draws(&self, draw: Draw, electrons: &mut [f32], change: impl Fn(&mut f32, &mut Generator)) {
        let stream = Stream::new(self.seed, draw, self.view as u64, self.index as u64);
        let first = (self.row * electrons.len()) as u64;
        for (photosite, value) in (first..).zip(electrons) {
            change(value, &mut stream.at(photosite));
        }
    }
}

impl<'a> Exposer<'a> {
    /// For the noise-free Stokes `image` (radiance, in the camera frame) of view number `view`, with `effects` and no others.
    ///
    /// # Errors
    /// [`SimError::NoView`], [`SimError::Image`], [`SimError::ImageSize`]; [`SimError::NoLight`] for a black image under a
    /// plan that chooses the exposure.
    pub fn new(scene: &'a Scene, view: usize, image: &StokesImage, effects: EffectSet) -> Result<Self, SimError> {
        checked(scene, view, image)?;
        let camera = *scene.views.get(view).ok_or(SimError::NoView { view, views: scene.views.len() })?;
        let frames = schedule(scene, image)?;
        let mut signal = Signal::new(&scene.camera, image, effects);
        let sigma = scene.camera.psf_sigma_px;
        if effects.contains(Effect::Psf) && sigma > 0.0 {
            psf::blur(&mut signal, sigma);
        }
        let (width, height) = (signal.width, signal.height);
        let shifts = effects.contains(Effect::BeamShift) && scene.polarizer.beam_deviation_arcmin > 0.0;
        let source = if shifts { Source::Shifted(signal) } else { Source::Fixed(signal.photosites()) };
        let stages = stages(scene, &camera, effects);
        Ok(Self { scene: Cow::Borrowed(scene), view, camera, effects, frames, source, stages, width, height })
    }

    /// The same with a scene of its own, for whoever outlives the one it was made from.
    #[must_use]
    pub fn into_owned(self) -> Exposer<'static> {
        let Self { scene, view, camera, effects, frames, source, stages, width, height } = self;
        let scene = Cow::Owned(scene.into_owned());
        Exposer { scene, view, camera, effects, frames, source, stages, width, height }
    }

    /// The frames of the plan, in order.
    #[must_use]
    pub fn frames(&self) -> &[FrameSpec] {
        &self.frames
    }

    /// The polarizer as frame number `frame` really sees it, drift of the light included in its throughput. Panics beyond the
    /// last frame.
    #[must_use]
    pub fn analyzer(&self, frame: usize) -> Analyzer {
        self.analyzer_of(&self.frames[frame])
    }

    fn analyzer_of(&self, spec: &FrameSpec) -> Analyzer {
        let scene = &*self.scene;
        let has = |effect| self.effects.contains(effect);
        let mut analyzer =
            Analyzer { angle: spec.commanded, throughput: scene.polarizer.throughput(), efficiency: 1.0 };
        if has(Effect::WheelError) {
            analyzer.angle.0 += wheel_error::error(scene, self.view, spec).0;
        }
        if has(Effect::Backlash) {
            analyzer.angle.0 += backlash::error(scene, spec).0;
        }
        if has(Effect::Extinction) {
            analyzer.efficiency = extinction::efficiency(scene);
        }
        if has(Effect::LightDrift) {
            analyzer.throughput *= 1.0 + light_drift::change(scene, spec);
        }
        analyzer
    }

    /// Raw samples of frame number `frame`, DN, row-major, height × width. A u16 holds no fractions and nothing beyond the
    /// converter, so they are rounded and cut whatever the effects. Panics beyond the last frame.
    #[must_use]
    pub fn raw(&self, frame: usize) -> Vec<u16> {
        self.raw_of(&self.frames[frame], frame)
    }

    /// As [`Self::raw`], of a frame that is not in the plan, such as one that a wheel and a clock of somebody else's decide: its
    /// random draws are those of frame number `index`. Where [`Effect::WheelError`] and [`Effect::Backlash`] are left out, its
    /// `commanded` is where the polarizer really is.
    #[must_use]
    pub fn raw_of(&self, frame: &FrameSpec, index: usize) -> Vec<u16> {
        let analyzer = self.analyzer_of(frame);
        let taken = Taken { frame, analyzer, index };
        let white = single(self.scene.camera.white_level_dn());
        let mut out = vec![0; self.width * self.height];
        let row = |buffer: &mut Vec<f32>, (row, out): (usize, &mut [u16])| {
            buffer.resize(self.width, 0.0);
            self.fill_dn(&taken, row, buffer);
            out.iter_mut().zip(buffer.iter()).for_each(|(to, dn)| *to = sample(dn.clamp(0.0, white)));
        };
        out.par_chunks_exact_mut(self.width).enumerate().for_each_init(Vec::new, row);
        out
    }

    /// Samples of frame number `frame` before they become integers, DN, row-major, height × width: rounded only with
    /// [`Effect::Quantization`], cut only with [`Effect::Saturation`]. Panics beyond the last frame.
    #[must_use]
    pub fn dn(&self, frame: usize) -> Vec<f32> {
        let taken = self.taken(frame);
        self.float(|row, out| self.fill_dn(&taken, row, out))
    }

    /// Charges of frame number `frame` as the amplifier sees them, photoelectrons, row-major, height × width. Panics beyond the
    /// last frame.
    #[must_use]
    pub fn electrons(&self, frame: usize) -> Vec<f32> {
        let taken = self.taken(frame);
        self.float(|row, out| self.fill_electrons(&taken, row, out))
    }

    fn float(&self, fill: impl Fn(usize, &mut [f32]) + Sync) -> Vec<f32> {
        let mut out = vec![0.0; self.width * self.height];
        out.par_chunks_exact_mut(self.width).enumerate().for_each(|(row, out)| fill(row, out));
        out
    }

    fn taken(&self, index: usize) -> Taken<'_> {
        Taken { frame: &self.frames[index], analyzer: self.analyzer(index), index }
    }

    fn fill_electrons(&self, taken: &Taken<'_>, row: usize, out: &mut [f32]) {
        let Taken { frame, analyzer, index } = taken;
        if self.effects.contains(Effect::SheetAxis) {
            let sheet = SheetRow::new(&self.camera, row, analyzer, frame.exposure_ms());
            self.fill_light(analyzer.angle, |column| sheet.weights(column), row, out);
        } else {
            let weights = analyzer.row().map(|w| single(w * frame.exposure_ms()));
            self.fill_light(analyzer.angle, |_| weights, row, out);
        }
        let at = Row { frame, row, seed: self.scene.seed, view: self.view, index: *index };
        self.stages.iter().for_each(|stage| stage.apply(&at, out));
    }

    /// Photoelectrons of a row, each column behind the analyzer row that `weights` gives; the polarizer stands at `angle`.
    fn fill_light(&self, angle: Radians, weights: impl Fn(usize) -> [f32; 3], row: usize, out: &mut [f32]) {
        match &self.source {
            Source::Fixed(photosites) => {
                let [s0, s1, s2] = photosites.each_ref().map(|plane| &plane[row * self.width..][..self.width]);
                for (column, (e, ((s0, s1), s2))) in out.iter_mut().zip(s0.iter().zip(s1).zip(s2)).enumerate() {
                    let [w0, w1, w2] = weights(column);
                    *e = w0 * s0 + w1 * s1 + w2 * s2;
                }
            }
            Source::Shifted(signal) => {
                let shift: DVec2 = beam_shift::shift(&self.scene, self.view, angle);
                beam_shift::fill_row(signal, shift, weights, row, out);
            }
        }
    }

    fn fill_dn(&self, taken: &Taken<'_>, row: usize, out: &mut [f32]) {
        self.fill_electrons(taken, row, out);
        let camera = &self.scene.camera;
        let (scale, black) = (single(1.0 / camera.gain_e_per_dn), f32::from(camera.black_level_dn));
        out.iter_mut().for_each(|v| *v = *v * scale + black);
        if self.effects.contains(Effect::Saturation) {
            clip(out, single(camera.white_level_dn()));
        }
        if self.effects.contains(Effect::Quantization) {
            quantization::round(out);
        }
    }
}

/// What happens to charges, in the order in which it does.
fn stages(scene: &Scene, camera: &Pinhole, effects: EffectSet) -> Vec<Box<dyn RowStage>> {
    let mut stages: Vec<Box<dyn RowStage>> = Vec::new();
    let has = |effect| effects.contains(effect);
    if let Some(stage) = Some(scene).filter(|_| has(Effect::Vignetting)).and_then(|s| Vignetting::of(s, camera)) {
        stages.push(Box::new(stage));
    }
    if let Some(stage) = Some(scene).filter(|_| has(Effect::Prnu)).and_then(Prnu::of) {
        stages.push(Box::new(stage));
    }
    if has(Effect::Shot) {
        stages.push(Box::new(Shot));
    }
    if let Some(stage) = Some(scene).filter(|_| has(Effect::Dark)).and_then(Dark::of) {
        stages.push(Box::new(stage));
    }
    if has(Effect::Saturation) {
        stages.push(Box::new(Well::of(scene)));
    }
    if let Some(stage) = Some(scene).filter(|_| has(Effect::Read)).and_then(Read::of) {
        stages.push(Box::new(stage));
    }
    stages
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the value is within the converter's range, which a u16 holds; rounding to nearest is meant"
)]
fn sample(dn: f32) -> u16 {
    dn.round() as u16
}

#[cfg(test)]
mod tests;
