//! From a scene to its noise-free Stokes images, with the effects a tolerance calls for.
//!
//! A picture is one ray through the middle of each pixel; texture finer than a pixel is not averaged. Stokes vectors are in
//! the camera frame of each pixel's own ray, radiance in the scene's unit. Nothing here is random but what the scene's seed
//! decides, and results do not depend on the number of threads.

mod optical_scene;

use crate::{Effect, EffectSet};
use std::time::{Duration, Instant};

use host_image::{Color, ColorPlanes, StokesImage, StokesMetadata};

use crate::SimError;
use crate::camera::Truth;
use crate::optical::{Evaluation, Method, OpticalFacts, PixelMap, Renderer, SurfaceReport, Survey};
use crate::planner::{Plan, camera_noise, difference};
use crate::scene::Scene;
use optical_scene::{OpticalScene, Rays};

/// Share of the tolerance that surfaces of constant α and η may lose where they stand for maps.
const MAP_SHARE: f64 = 0.2;

/// What one view of a scene sends into the camera.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Noise-free, R, G, B, radiance; pixels beyond the sample are black.
    pub image: StokesImage,
    /// What each pixel sees.
    pub truth: Truth,
    /// Which effects are in the image, and why.
    pub plan: Plan,
    /// At most this is lost where surfaces of constant α and η stand for maps, relative to s0; 0 without such maps.
    pub map_bound: f64,
    /// How each surface was evaluated; a map of α or η is several.
    pub surfaces: Vec<SurfaceReport>,
    /// Wall time.
    pub timing: Timing,
    /// The true differences, if asked for.
    pub verification: Option<Verification>,
}

/// Wall time of the steps of one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Truth maps.
    pub truth: Duration,
    /// Bounds and the choice of effects.
    pub planning: Duration,
    /// The image.
    pub rendering: Duration,
}

/// How far images are from the full simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Verification {
    /// The image against the full one.
    pub planned: Difference,
    /// The full image without one effect, against the full one; those the scene has.
    pub alone: Vec<(Effect, Difference)>,
    /// Wall time of the full image.
    pub full: Duration,
}

/// Of an image to the full one, over pixels brighter than a hundredth of their band's mean, bands and components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Largest |Δs_k|/s0.
    pub worst: f64,
    /// Root mean square of the same.
    pub rms: f64,
    /// Wall time of the image.
    pub time: Duration,
}

/// The noise of s0 where it is least, relative to s0: [`camera_noise`] at saturation, all frames of the plan together.
#[must_use]
pub fn noise_of(scene: &Scene) -> f64 {
    let angles = u32::try_from(scene.plan.angles.len()).unwrap_or(u32::MAX);
    let frames = angles.saturating_mul(u32::from(scene.plan.repeats));
    camera_noise(scene.camera.saturation_e(), scene.camera.read_noise_e, frames)
}

/// Simulates view number `view` (from 0) with as few optical effects as keep every Stokes component within `tolerance` of
/// the full simulation, relative to s0. With `verify` the full image is made too, and one without each of the scene's effects:
/// some ten times the work.
///
/// # Errors
/// [`SimError::NoView`]; [`SimError::Tolerance`] outside (0, 1]; [`SimError::NotSimulated`] with the place in the scene for maps
/// that call for too many levels; [`SimError::Physics`].
pub fn simulate(scene: &Scene, view: usize, tolerance: f64, verify: bool) -> Result<Simulation, SimError> {
    let camera = scene.views.get(view).ok_or(SimError::NoView { view, views: scene.views.len() })?;
    if !(tolerance > 0.0 && tolerance <= 1.0) {
        return Err(SimError::Tolerance(tolerance));
    }
    let start = Instant::now();
    let optical = OpticalScene::of(scene, MAP_SHARE * tolerance)?;
    let truth = Truth::of(&scene.sample, camera);
    let rays = optical.rays(camera, &truth);
    let in_truth = start.elapsed();

    let start = Instant::now();
    let maps = rays.maps();
    let facts = OpticalFacts::new(&optical.light, &optical.surfaces, &maps);
    let mut plan = Plan::new(&facts, tolerance - optical.bound());
    plan.tolerance = tolerance;
    let planning = start.elapsed();

    let picture = Picture { optical: &optical, rays: &rays, surveys: facts.surveys(), evaluation: plan.evaluation };
    let (stokes, surfaces, rendering) = picture.render(plan.effects)?;
    let verification = if verify { Some(picture.verify(&plan, &stokes, rendering)?) } else { None };
    let image = StokesImage {
        width: truth.width,
        height: truth.height,
        colors: planes(&stokes),
        metadata: metadata(scene, view),
    };
    let timing = Timing { truth: in_truth, planning, rendering };
    Ok(Simulation { image, truth, plan, map_bound: optical.bound(), surfaces, timing, verification })
}

/// (R, G, B)(s0, s1, s2) of every pixel.
type Pixels = Vec<[[f32; 3]; 3]>;

/// All but the effects.
struct Picture<'a> {
    optical: &'a OpticalScene,
    rays: &'a Rays,
    surveys: &'a [Survey],
    evaluation: Evaluation,
}

impl Rays {
    /// The pictures that are rendered.
    fn maps(&self) -> Vec<PixelMap<'_>> {
        let map = |pixels| PixelMap { width: self.width, camera_x: self.camera_x, pixels };
        self.layers.iter().map(|layer| map(layer.pixels.as_slice())).collect()
    }
}

impl Picture<'_> {
    fn render(&self, effects: EffectSet) -> Result<(Pixels, Vec<SurfaceReport>, Duration), SimError> {
        let start = Instant::now();
        let renderer = Renderer::new(&self.optical.light, &self.optical.surfaces, effects, self.evaluation)?;
        let maps = self.rays.maps();
        let mut renderings = maps.iter().zip(self.surveys).map(|(map, survey)| renderer.render_surveyed(map, survey));
        let (mut stokes, mut surfaces) = renderings.next().map(|r| (r.stokes, r.surfaces)).unwrap_or_default();
        if let [first, others @ ..] = self.rays.layers.as_slice()
            && !others.is_empty()
        {
            scale(&mut stokes, &first.shares);
            for (rendering, layer) in renderings.zip(others) {
                add(&mut stokes, &rendering.stokes, &layer.shares);
                surfaces.extend(rendering.surfaces);
            }
        }
        surfaces.retain(|s| s.method != Method::Absent);
        Ok((stokes, surfaces, start.elapsed()))
    }

    fn verify(&self, plan: &Plan, planned: &Pixels, time: Duration) -> Result<Verification, SimError> {
        let (full, _, full_time) = self.render(EffectSet::ALL)?;
        let against = |found: &Pixels, time| {
            let (worst, rms) = difference(found, &full);
            Difference { worst, rms, time }
        };
        let mut alone = Vec::new();
        for row in plan.rows.iter().filter(|r| r.assessment.applies) {
            let (without, _, time) = self.render(EffectSet::ALL.without(row.effect))?;
            alone.push((row.effect, against(&without, time)));
        }
        Ok(Verification { planned: against(planned, time), alone, full: full_time })
    }
}

/// Each pixel by its share.
fn scale(pixels: &mut Pixels, shares: &[[f32; 3]]) {
    for (pixel, share) in pixels.iter_mut().zip(shares) {
        pixel.iter_mut().zip(share).for_each(|(band, share)| band.iter_mut().for_each(|s| *s *= share));
    }
}

/// Adds another picture, each pixel by its share.
fn add(pixels: &mut Pixels, more: &Pixels, shares: &[[f32; 3]]) {
    for ((pixel, more), share) in pixels.iter_mut().zip(more).zip(shares) {
        for ((band, more), share) in pixel.iter_mut().zip(more).zip(share) {
            band.iter_mut().zip(more).for_each(|(s, m)| *s += share * m);
        }
    }
}

fn planes(stokes: &Pixels) -> Vec<ColorPlanes> {
    [Color::R, Color::G, Color::B]
        .into_iter()
        .enumerate()
        .map(|(band, color)| {
            let plane = |k: usize| stokes.iter().map(|pixel| pixel[band][k]).collect();
            ColorPlanes { color, s0: plane(0), s1: plane(1), s2: plane(2), flags: None, residual: None }
        })
        .collect()
}

fn metadata(scene: &Scene, view: usize) -> StokesMetadata {
    StokesMetadata {
        unit: "radiance".into(),
        angles_deg: Vec::new(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: format!("{}, view {view}", scene.name),
        camera_serial: None,
        capture_id: None,
        software_version: concat!("brewster ", env!("CARGO_PKG_VERSION")).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optical::Pixel;
    use std::path::Path;

    /// Twenty pixels of views whose angle of polarization is far from a mirror's: the pictures are what adaptive quadrature of the
    /// lobe gives, so the difference is the rough lobe's under a polarized sky (metal of α 0.25) or beside the sun.
    #[test]
    fn pictures_are_the_integral_over_the_lobe() {
        for (name, surface) in [("drain-cover", 0), ("chart", 1)] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
            let scene = Scene::read(&path).unwrap().resized(80, 60);
            let tolerance = 1e-3;
            let found = simulate(&scene, 0, tolerance, false).unwrap();
            let optical = OpticalScene::of(&scene, MAP_SHARE * tolerance).unwrap();
            let rays = optical.rays(&scene.views[0], &found.truth);
            let own = |(_, p): &(usize, &Pixel)| p.surface == surface;
            let all: Vec<(usize, &Pixel)> = rays.layers[0].pixels.iter().enumerate().filter(own).collect();
            let some: Vec<_> = all.iter().step_by(all.len() / 20).take(20).collect();
            assert_eq!(some.len(), 20, "{name}");
            let pixels: Vec<Pixel> = some.iter().map(|(_, p)| **p).collect();
            let map = PixelMap { width: 20, camera_x: rays.camera_x, pixels: &pixels };
            let evaluation = Evaluation::Adaptive { tolerance: 1e-5 };
            let renderer = Renderer::new(&optical.light, &optical.surfaces, EffectSet::ALL, evaluation).unwrap();
            let exact = renderer.render(&map).stokes;
            let picture: Vec<_> = some
                .iter()
                .map(|(at, _)| {
                    [0, 1, 2].map(|k| {
                        let planes = &found.image.colors[k];
                        [planes.s0[*at], planes.s1[*at], planes.s2[*at]]
                    })
                })
                .collect();
            let (worst, _) = difference(&picture, &exact);
            println!("{name}: {worst:.1e}");
            assert!(worst < tolerance, "{name}: {worst}");
        }
    }
}
