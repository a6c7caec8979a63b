//! From pixels to a Stokes picture.

use super::diffuse_field::Diffuse;
use super::effects::{normal_variation, sun_disk};
use super::light::{BandLight, SceneLight, SunPoints, pyramid};
use super::numbers::single3;
use super::specular::{Evaluation, Method, Point, Rule, Specular};
use super::survey::{PixelMap, Survey};
use super::table::lanes;
use super::{Pixel, Radiance, Surface};
use crate::{Effect, EffectSet};
use core::f64::consts::TAU;
use glam::{DVec3, Vec3};
use host_optics::OpticsError;
use host_optics::prefilter::{Pyramid, Reflector};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// A scene's light and surfaces, made ready for a set of effects. One renderer serves every view.
#[derive(Debug)]
pub struct Renderer<'a> {
    surfaces: &'a [Surface],
    effects: EffectSet,
    evaluation: Evaluation,
    bands: [BandLight<'a>; 3],
    polarized: bool,
    gray_light: bool,
    texel: f64,
    sky: Option<Pyramid>,
    sun: SunPoints,
    prepared_in: Duration,
}

/// A picture without noise.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Columns.
    pub width: usize,
    /// [band R, G, B][s0, s1, s2] of each pixel in the camera frame of its ray, row-major; the unit of the light's radiance.
    pub stokes: Vec<[[f32; 3]; 3]>,
    /// One per surface.
    pub surfaces: Vec<SurfaceReport>,
    /// Where the time went.
    pub timing: Timing,
}

/// How a surface was done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceReport {
    /// Pixels that face the camera.
    pub pixels: usize,
    /// Specular part.
    pub method: Method,
}

/// Wall time of the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Light: once for all views.
    pub prepare: Duration,
    /// Survey of the view and its tables.
    pub tables: Duration,
    /// The pixel loop.
    pub pixels: Duration,
}

impl Timing {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.prepare + self.tables + self.pixels
    }
}

/// A surface as the effects leave it.
fn reflector(surface: &Surface, effects: EffectSet) -> Reflector {
    let whole = Reflector::new(surface.ior, surface.ggx);
    let masked = if effects.contains(Effect::Masking) { whole } else { whole.without_masking() };
    if effects.contains(Effect::Retardance) { masked } else { masked.without_retardance() }
}

struct Plan<'a> {
    specular: Specular,
    diffuse: Diffuse,
    point: Point<'a>,
    normal: Option<DVec3>,
}

impl<'a> Renderer<'a> {
    /// Prepares light for a set of effects.
    ///
    /// # Errors
    /// [`OpticsError`] for a sun or a sky pattern outside its domain.
    pub fn new(
        light: &'a SceneLight,
        surfaces: &'a [Surface],
        effects: EffectSet,
        evaluation: Evaluation,
    ) -> Result<Self, OpticsError> {
        let start = Instant::now();
        let bands = light.bands(effects)?;
        let sun = sun_disk::points(light.sun.as_ref(), effects)?;
        let smooth = light.smooth();
        let prefiltered = matches!(evaluation, Evaluation::Prefiltered { .. }) && !smooth;
        let rough = effects.contains(Effect::Roughness);
        let sky = (effects.contains(Effect::Diffuse) || (prefiltered && rough)).then(|| pyramid(&bands)).transpose()?;
        let [r, g, b] = &light.radiance;
        let sizes =
            light.radiance.iter().filter_map(|r| if let Radiance::Map(m) = r { Some(m.size().0) } else { None });
        let texel = sizes.max().map_or(0.0, |width| TAU / super::numbers::real(width));
        Ok(Self {
            surfaces,
            effects,
            evaluation,
            polarized: bands.iter().any(BandLight::polarized),
            gray_light: smooth && r == g && g == b,
            bands,
            texel,
            sky,
            sun,
            prepared_in: start.elapsed(),
        })
    }

    /// A view.
    #[must_use]
    pub fn render(&self, map: &PixelMap<'_>) -> Rendering {
        let start = Instant::now();
        let survey = Survey::new(map, self.surfaces.len());
        let surveyed = start.elapsed();
        let mut rendering = self.render_surveyed(map, &survey);
        rendering.timing.tables += surveyed;
        rendering
    }

    /// A view that was surveyed before, such as by a planner ([`super::OpticalFacts::surveys`]).
    #[must_use]
    pub fn render_surveyed(&self, map: &PixelMap<'_>, survey: &Survey) -> Rendering {
        self.render_into(map, survey, Vec::new())
    }

    /// As [`Self::render_surveyed`], into the memory of an earlier picture: fresh memory costs as much as a simple scene.
    #[must_use]
    pub fn render_into(&self, map: &PixelMap<'_>, survey: &Survey, memory: Vec<[[f32; 3]; 3]>) -> Rendering {
        let start = Instant::now();
        let planned: Vec<(Plan<'_>, SurfaceReport)> =
            self.surfaces.iter().enumerate().map(|(k, surface)| self.plan(map, survey, k, surface)).collect();
        let tables = start.elapsed();
        let start = Instant::now();
        let (plans, surfaces): (Vec<_>, Vec<_>) = planned.into_iter().unzip();
        let stokes = if self.effects.contains(Effect::DiffusePolarization) {
            pixels::<true>(map, &plans, memory)
        } else {
            pixels::<false>(map, &plans, memory)
        };
        let timing = Timing { prepare: self.prepared_in, tables, pixels: start.elapsed() };
        Rendering { width: map.width, stokes, surfaces, timing }
    }

    fn plan<'s>(
        &'s self,
        map: &PixelMap<'s>,
        survey: &'s Survey,
        index: usize,
        surface: &'s Surface,
    ) -> (Plan<'s>, SurfaceReport) {
        let smooth = self.texel == 0.0;
        let [r, g, b] = surface.ior;
        let point = Point {
            light: &self.bands,
            polarized: self.polarized,
            gray: self.gray_light && r == g && g == b,
            sky: self.sky.as_ref(),
            sun: &self.sun,
            surface,
            reflector: reflector(surface, self.effects),
            rule: Rule::choose(self.evaluation, self.effects, smooth, surface, self.texel),
            camera_x: map.camera_x,
        };
        let Some(own) = survey.pixels(map, index) else {
            let plan = Plan { specular: Specular::Absent, diffuse: Diffuse::None, point, normal: None };
            return (plan, SurfaceReport { pixels: 0, method: Method::Absent });
        };
        let (specular, method) = Specular::plan(&own, &point, self.evaluation, self.effects);
        let diffuse = Diffuse::plan(&own, surface, self.sky.as_ref(), &self.sun, self.effects);
        let flat = !self.effects.contains(Effect::NormalVariation);
        let normal = flat.then(|| normal_variation::mean(own.extent));
        (Plan { specular, diffuse, point, normal }, SurfaceReport { pixels: own.extent.pixels, method })
    }
}

/// The loop over pixels.
fn pixels<const DIFFUSE_POLARIZED: bool>(
    map: &PixelMap<'_>,
    plans: &[Plan<'_>],
    memory: Vec<[[f32; 3]; 3]>,
) -> Vec<[[f32; 3]; 3]> {
    let width = map.width.max(1);
    let camera_x = single3(map.camera_x.normalize_or(DVec3::X));
    // Every pixel is written below, so old contents need no clearing.
    let mut out = if memory.len() == map.pixels.len() { memory } else { vec![[[0.0; 3]; 3]; map.pixels.len()] };
    out.par_chunks_mut(width).zip(map.pixels.par_chunks(width)).for_each(|(mut out, mut line)| {
        while let Some(p) = line.first() {
            let plan = plans.get(usize::from(p.surface));
            let mut done = plan.map_or(0, |plan| plan.run::<DIFFUSE_POLARIZED>(line, out, camera_x));
            if done == 0 {
                out[0] = [[0.0; 3]; 3];
                if let Some(plan) = plan {
                    plan.pixel::<DIFFUSE_POLARIZED>(p, camera_x, out[0].as_flattened_mut());
                }
                done = 1;
            }
            line = &line[done..];
            out = &mut out[done..];
        }
    });
    out
}

/// Pixels of a row that share three look-ups where one normal stands for all.
const RUN: usize = 32;

/// Where the pixels of a run lie between its ends, 0 to 1.
const PLACES: [f32; RUN] = {
    let mut places = [0.0; RUN];
    let (mut k, mut x) = (0, 0.0);
    while k < RUN {
        places[k] = x / 31.0;
        (k, x) = (k + 1, x + 1.0);
    }
    places
};

impl Plan<'_> {
    /// A run of pixels of one surface with one normal: its Stokes parameters by a parabola through both ends and the middle,
    /// where the run is short against the steps of the table and its rays are evenly spaced. Returns how many were done.
    #[inline]
    fn run<const DIFFUSE_POLARIZED: bool>(&self, line: &[Pixel], out: &mut [[[f32; 3]; 3]], camera_x: Vec3) -> usize {
        let (Specular::Flat(field), Some(normal)) = (&self.specular, self.normal.map(single3)) else { return 0 };
        let (Some(run), Some(out)) = (line.first_chunk::<RUN>(), out.first_chunk_mut::<RUN>()) else { return 0 };
        if run.iter().fold(0, |any, p| any | (p.surface ^ run[0].surface)) != 0 {
            return 0;
        }
        let [a, b, c] = [&run[0], &run[RUN / 2], &run[RUN - 1]].map(|p| Vec3::from(p.to_camera));
        let length = a.distance(c);
        let middle = PLACES[RUN / 2];
        let straight = (a + (c - a) * middle).distance(b) <= 0.02 * length + 1e-6;
        if length > 0.3 * field.step() || !straight || [a, b, c].iter().any(|wo| normal.dot(*wo) <= 0.0) {
            return 0;
        }
        let [fa, fb, fc] = [a, b, c].map(|wo| field.at(wo));
        let mut first = [0.0_f32; 9];
        let mut second = [0.0_f32; 9];
        for k in 0..9 {
            // f(x) = fa + first x + second x² over x in [0, 1] with f(middle) = fb, f(1) = fc.
            let (chord, rise) = (fc[k] - fa[k], fb[k] - fa[k]);
            second[k] = (rise - chord * middle) / (middle * (middle - 1.0));
            first[k] = chord - second[k];
        }
        for (x, s) in PLACES.iter().zip(out.iter_mut()) {
            let s = s.as_flattened_mut();
            for k in 0..9 {
                s[k] = fa[k] + x * (first[k] + x * second[k]);
            }
        }
        if !matches!(self.diffuse, Diffuse::None) {
            for (s, p) in out.iter_mut().zip(run) {
                let (s, wo) = (s.as_flattened_mut(), Vec3::from(p.to_camera));
                self.diffuse.add::<DIFFUSE_POLARIZED>(s, normal, wo, camera_x, p.albedo);
            }
        }
        RUN
    }

    #[inline]
    fn pixel<const DIFFUSE_POLARIZED: bool>(&self, p: &Pixel, camera_x: Vec3, out: &mut [f32]) {
        let wo = Vec3::from(p.to_camera);
        let normal = self.normal.map_or(Vec3::from(p.normal), single3);
        if normal.dot(wo) <= 0.0 {
            return;
        }
        let specular = match &self.specular {
            Specular::Absent => return,
            Specular::Flat(field) => field.at(wo),
            Specular::Table(table) => table.at(normal, wo),
            Specular::Direct => {
                let normal = self.normal.unwrap_or_else(|| Vec3::from(p.normal).as_dvec3().normalize());
                lanes(&self.point.at(normal, wo.as_dvec3().normalize()))
            }
        };
        for (o, s) in out.iter_mut().zip(specular) {
            *o = s;
        }
        self.diffuse.add::<DIFFUSE_POLARIZED>(out, normal, wo, camera_x, p.albedo);
    }
}
