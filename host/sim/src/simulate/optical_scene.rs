//! A scene as the renderer takes it: light in its three bands, homogeneous surfaces, one pixel per camera ray.
//!
//! - A dielectric's diffuse light goes through its interface ([`Body::Interface`]); a metal has no body, so what diffuse light a
//!   scene gives it (rust, dirt, paper between flakes) is paper eq. 6's Lambert term. Masking is height-correlated.
//! - An environment map that is turned about the vertical is not resampled: the world is turned instead, which changes no picture.
//! - A map of α becomes surfaces at α_j, equally spaced in ln α by at most h = [`ALPHA_STEP`]. Each pixel is rendered at the two
//!   around its own α and blended linearly in x = ln α. For any light that errs by at most h²/8 sup |f″|/f of the specular s0:
//!   |(ln D)′| ≤ 2 and |(ln D)″| ≤ 2, for the height-correlated G2 |(ln G2)′| ≤ 1 and |(ln G2)″| ≤ 2, hence
//!   f″/f ≤ 3² + 4 = 13 and the error is below 7e-4.

use glam::DVec3;
use host_optics::ggx::MIN_ALPHA;
use host_optics::{Ggx, Ior, Masking};

use crate::SimError;
use crate::camera::{Pinhole, Truth};
use crate::optical::{Body, Pixel, Radiance, SceneLight, SkyPattern, Sun, Surface};
use crate::scene::{self, Field, Index, Scene, SkyRadiance, TurnedMap};

/// Largest step of ln α between two surfaces that stand for a map.
const ALPHA_STEP: f64 = 0.02;

/// Light and surfaces of a scene, ready for [`crate::optical::Renderer`].
#[derive(Clone, Debug)]
pub(super) struct OpticalScene {
    pub(super) light: SceneLight,
    pub(super) surfaces: Vec<Surface>,
    levels: Vec<Levels>,
    /// Set where the light is a map: its azimuth is the renderer's.
    turned: Option<TurnedMap>,
}

/// The surfaces that stand for one surface of the scene.
#[derive(Clone, Copy, Debug)]
struct Levels {
    first: usize,
    /// ln α of the first, and the step to the next; one surface alone has none.
    step: Option<(f64, f64)>,
    last: usize,
}

/// The rays of a view.
#[derive(Clone, Debug)]
pub(super) struct Rays {
    pub(super) width: usize,
    pub(super) camera_x: DVec3,
    /// Each pixel on the surface at or just below its α.
    pub(super) lower: Vec<Pixel>,
    /// The same on the surface just above, and the share of it; `None` where no α varies.
    pub(super) upper: Option<(Vec<Pixel>, Vec<f32>)>,
}

impl OpticalScene {
    /// # Errors
    /// [`SimError::NotSimulated`] for a map of refractive indices, and for a surface smoother than the sun's disk is wide.
    pub(super) fn of(scene: &Scene) -> Result<Self, SimError> {
        let turned = match &scene.light.bands[0].radiance {
            SkyRadiance::Map(map) => Some(map.clone()),
            _ => None,
        };
        let light = light(&scene.light, turned.as_ref());
        let (mut surfaces, mut levels) = (Vec::new(), Vec::new());
        for surface in &scene.sample.surfaces {
            let (own, step) = split(surface, light.sun.as_ref())?;
            levels.push(Levels { first: surfaces.len(), step, last: surfaces.len() + own.len() - 1 });
            surfaces.extend(own);
        }
        if surfaces.len() >= usize::from(Pixel::NOTHING) {
            let why = format!("maps of alpha call for {} surfaces, 65534 are held", surfaces.len());
            return Err(SimError::NotSimulated { key: "surface".into(), why });
        }
        Ok(Self { light, surfaces, levels, turned })
    }

    /// What the rays of a view meet, from its truth maps.
    pub(super) fn rays(&self, camera: &Pinhole, truth: &Truth) -> Rays {
        let turn = |v: DVec3| self.turned.as_ref().map_or(v, |map| map.to_map(v));
        let nothing = Pixel { normal: [0.0; 3], to_camera: [0.0; 3], albedo: [0.0; 3], surface: Pixel::NOTHING };
        let varies = self.levels.iter().any(|l| l.step.is_some());
        let count = truth.mask.len();
        let mut rays = Rays {
            width: truth.width,
            camera_x: turn(camera.pose.right),
            lower: Vec::with_capacity(count),
            upper: varies.then(|| (Vec::with_capacity(count), Vec::with_capacity(count))),
        };
        for index in 0..count {
            let (pixel, above, share) = match self.levels.get(whole(truth.surface[index])) {
                Some(levels) if truth.mask[index] > 0.0 => {
                    let point = DVec3::from_array(truth.position_m[index].map(f64::from));
                    let normal = DVec3::from_array(truth.normal[index].map(f64::from));
                    let to_camera = (camera.pose.position - point).normalize_or(DVec3::Z);
                    let (low, high, share) = levels.around(f64::from(truth.alpha[index]));
                    let pixel = Pixel {
                        normal: turn(normal).as_vec3().to_array(),
                        to_camera: turn(to_camera).as_vec3().to_array(),
                        albedo: truth.albedo[index],
                        surface: low,
                    };
                    (pixel, high, share)
                }
                _ => (nothing, Pixel::NOTHING, 0.0),
            };
            rays.lower.push(pixel);
            if let Some((upper, shares)) = &mut rays.upper {
                upper.push(Pixel { surface: above, ..pixel });
                shares.push(share);
            }
        }
        rays
    }
}

impl Levels {
    /// The surfaces at and above an α, and the share of the latter.
    fn around(&self, alpha: f64) -> (u16, u16, f32) {
        let index = |k: usize| u16::try_from(k).unwrap_or(Pixel::NOTHING);
        let Some((start, step)) = self.step else { return (index(self.first), index(self.first), 0.0) };
        let x = ((alpha.max(MIN_ALPHA).ln() - start) / step).max(0.0);
        let low = (self.first + whole(crate::signal::single(x))).min(self.last - 1);
        let share = x - crate::optical::numbers::real(low - self.first);
        (index(low), index(low + 1), crate::signal::single(share.clamp(0.0, 1.0)))
    }
}

/// Homogeneous surfaces, and where they lie in ln α.
type Split = (Vec<Surface>, Option<(f64, f64)>);

/// One surface of the scene as homogeneous ones, with (ln α, step) of their α.
fn split(surface: &scene::Surface, sun: Option<&Sun>) -> Result<Split, SimError> {
    let key = |key: &str| format!("surface.{}.{key}", surface.name);
    let Index::Constant(ior) = &surface.ior else {
        let why = "a refractive index must be the same all over a surface; divide it by an index map".to_owned();
        return Err(SimError::NotSimulated { key: key("eta_map"), why });
    };
    let body = if ior.iter().all(|i| matches!(i, Ior::Dielectric(_))) { Body::Interface } else { Body::Lambert };
    let (low, high, name) = match &surface.alpha {
        Field::Constant(alpha) => (*alpha, *alpha, "alpha"),
        Field::Map(map) => (map.range().0, map.range().1, "alpha_map"),
    };
    // The sun is a sum of points over its disk, which a sharper lobe would see one by one.
    if let Some(sun) = sun.filter(|s| low < s.angular_radius_rad) {
        let radius = sun.angular_radius_rad;
        let why = format!("alpha {low} under a sun's disk of {radius:.5} rad, from which on a lobe is wide enough");
        return Err(SimError::NotSimulated { key: key(name), why });
    }
    let at = |alpha: f64| -> Result<Surface, SimError> {
        let ggx = Ggx::new(alpha.clamp(MIN_ALPHA, 1.0), Masking::HeightCorrelated)?;
        Ok(Surface { ior: *ior, ggx, body })
    };
    let (start, end) = (low.max(MIN_ALPHA).ln(), high.max(MIN_ALPHA).ln());
    if end - start <= 0.0 {
        return Ok((vec![at(low)?], None));
    }
    let cells = ((end - start) / ALPHA_STEP).ceil();
    let step = (end - start) / cells;
    let count = whole(crate::signal::single(cells));
    let surfaces = (0..=count).map(|k| at((start + step * crate::optical::numbers::real(k)).exp()));
    Ok((surfaces.collect::<Result<_, _>>()?, Some((start, step))))
}

/// The scene's light, in the azimuth of its map if it is one.
fn light(light: &scene::Light, turned: Option<&TurnedMap>) -> SceneLight {
    let turn = |v: DVec3| turned.map_or(v, |map| map.to_map(v));
    let radiance = light.bands.each_ref().map(|band| match &band.radiance {
        SkyRadiance::Uniform(sky) => Radiance::Uniform(*sky),
        SkyRadiance::Overcast(sky) => Radiance::Overcast(*sky),
        SkyRadiance::Clear(sky) => Radiance::Clear(*sky),
        SkyRadiance::Map(map) => Radiance::Map(map.map().clone()),
    });
    let pattern = light.pattern.map(|pattern| match pattern {
        SkyPattern::Rayleigh { sun, max_dolp } => SkyPattern::Rayleigh { sun: turn(sun), max_dolp },
        SkyPattern::Berry { sun, splitting_deg, max_dolp } => {
            SkyPattern::Berry { sun: turn(sun), splitting_deg, max_dolp }
        }
    });
    let sun = light.disk.map(|sun| Sun { direction: turn(sun.direction), ..sun });
    SceneLight { radiance, pattern, sun }
}

/// A count held in a float.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts far below 2^24; the cast saturates"
)]
fn whole(value: f32) -> usize {
    value as usize
}
