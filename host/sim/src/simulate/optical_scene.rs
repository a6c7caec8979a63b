//! A scene as the renderer takes it: light in its three bands, homogeneous surfaces, one pixel per camera ray.
//!
//! - A dielectric's diffuse light goes through its interface ([`Body::Interface`]); a metal has no body, so what diffuse light a
//!   scene gives it (rust, dirt, paper between flakes) is paper eq. 6's Lambert term. Masking is height-correlated.
//! - An environment map that is turned about the vertical is not resampled: the world is turned instead, which changes no picture.
//! - A map of α or η becomes surfaces that stand for it ([`Levels`]); each pixel is the blend of those around its own values.

mod levels;

use glam::DVec3;
use host_optics::{Ggx, Ior, Masking};

use crate::SimError;
use crate::camera::{Pinhole, Truth};
use crate::optical::{Body, Pixel, Radiance, SceneLight, SkyPattern, Sun, Surface};
use crate::scene::{self, Index, Scene, SkyRadiance, TurnedMap};
use levels::Levels;

/// Light and surfaces of a scene, ready for [`crate::optical::Renderer`].
#[derive(Clone, Debug)]
pub(super) struct OpticalScene {
    pub(super) light: SceneLight,
    pub(super) surfaces: Vec<Surface>,
    levels: Vec<Levels>,
    /// Set where the light is a map: its azimuth is the renderer's.
    turned: Option<TurnedMap>,
}

/// The rays of a view.
#[derive(Clone, Debug)]
pub(super) struct Rays {
    pub(super) width: usize,
    pub(super) camera_x: DVec3,
    /// The pictures that are blended; one and no more where no map calls for levels.
    pub(super) layers: Vec<Layer>,
}

/// One of the pictures of a view.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    /// What each ray meets in it; nothing where its share is 0.
    pub(super) pixels: Vec<Pixel>,
    /// Its share of each pixel at R, G, B.
    pub(super) shares: Vec<[f32; 3]>,
}

impl OpticalScene {
    /// With levels that err by at most `tolerance` of s0 all together.
    ///
    /// # Errors
    /// [`SimError::NotSimulated`] for more levels than can be held; [`SimError::Physics`].
    pub(super) fn of(scene: &Scene, tolerance: f64) -> Result<Self, SimError> {
        let turned = match &scene.light.bands[0].radiance {
            SkyRadiance::Map(map) => Some(map.clone()),
            _ => None,
        };
        let light = light(&scene.light, turned.as_ref());
        let max_dolp = light.pattern.map_or(0.0, |pattern| match pattern {
            SkyPattern::Rayleigh { max_dolp, .. } | SkyPattern::Berry { max_dolp, .. } => max_dolp,
        });
        let (mut surfaces, mut levels) = (Vec::new(), Vec::new());
        for surface in &scene.sample.surfaces {
            let own = Levels::of(surface, surfaces.len(), tolerance, max_dolp);
            if surfaces.len() + own.count() >= usize::from(Pixel::NOTHING) {
                let why = format!(
                    "at a tolerance of {tolerance:.1e} for maps, {} levels and more than are held",
                    own.count()
                );
                return Err(SimError::NotSimulated { place: surface.map_place.clone(), why });
            }
            for (alpha, eta) in own.values() {
                let ior = match (&surface.ior, eta) {
                    (Index::Constant(ior), _) => *ior,
                    (Index::Map { .. }, eta) => [Ior::new(eta, 0.0)?; 3],
                };
                let dielectric = ior.iter().all(|i| matches!(i, Ior::Dielectric(_)));
                let body = if dielectric { Body::Interface } else { Body::Lambert };
                surfaces.push(Surface { ior, ggx: Ggx::new(alpha, Masking::HeightCorrelated)?, body });
            }
            levels.push(own);
        }
        Ok(Self { light, surfaces, levels, turned })
    }

    /// At most this is lost where levels stand for maps, as a share of s0; 0 without such maps.
    pub(super) fn bound(&self) -> f64 {
        self.levels.iter().map(|levels| levels.bound).fold(0.0, f64::max)
    }

    /// What the rays of a view meet, from its truth maps.
    pub(super) fn rays(&self, camera: &Pinhole, truth: &Truth) -> Rays {
        let turn = |v: DVec3| self.turned.as_ref().map_or(v, |map| map.to_map(v));
        let nothing = Pixel { normal: [0.0; 3], to_camera: [0.0; 3], albedo: [0.0; 3], surface: Pixel::NOTHING };
        let layers = self.levels.iter().map(|l| l.corners().len()).max().unwrap_or(1);
        let count = truth.mask.len();
        let mut layers = vec![Layer { pixels: vec![nothing; count], shares: vec![[0.0; 3]; count] }; layers];
        for index in (0..count).filter(|index| truth.mask[*index] > 0.0) {
            let Some(levels) = self.levels.get(whole(truth.surface[index])) else { continue };
            let point = DVec3::from_array(truth.position_m[index].map(f64::from));
            let normal = DVec3::from_array(truth.normal[index].map(f64::from));
            let to_camera = (camera.pose.position - point).normalize_or(DVec3::Z);
            let pixel = Pixel {
                normal: turn(normal).as_vec3().to_array(),
                to_camera: turn(to_camera).as_vec3().to_array(),
                albedo: truth.albedo[index],
                surface: Pixel::NOTHING,
            };
            for (layer, corner) in layers.iter_mut().zip(levels.corners()) {
                let (surface, share) = levels.at(*corner, truth.alpha[index], truth.eta[index]);
                if share.iter().any(|s| *s > 0.0) {
                    layer.pixels[index] = Pixel { surface, ..pixel };
                    layer.shares[index] = share;
                }
            }
        }
        Rays { width: truth.width, camera_x: turn(camera.pose.right), layers }
    }
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
