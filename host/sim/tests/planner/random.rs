//! Random scenes: every kind of light, roughness, index, albedo and bumps, each from nothing to plenty.

use glam::DVec3;
use host_optics::sky::{ClearSky, MoonSpencer, StokesMap, Uniform};
use host_optics::{Ggx, Ior, Masking};
use host_sim::optical::{Body, Pixel, PixelMap, Radiance, SceneLight, SkyPattern, Sun, Surface};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

const SIDE: usize = 6;

/// A scene of one surface and 36 pixels.
pub(crate) struct Scene {
    pub(crate) light: SceneLight,
    pub(crate) surfaces: Vec<Surface>,
    pixels: Vec<Pixel>,
    camera_x: DVec3,
}

/// A direction within `spread` of the zenith, in chord.
fn near(center: DVec3, spread: f64, rng: &mut SmallRng) -> DVec3 {
    let mut any = || rng.random_range(-1.0..1.0);
    (center + DVec3::new(any(), any(), any()) * spread).normalize()
}

/// Number `seed` of them.
pub(crate) fn scene(seed: u64) -> Scene {
    let rng = &mut SmallRng::seed_from_u64(seed);
    let sun = {
        let (elevation, azimuth) = (rng.random_range(0.1..1.4_f64), rng.random_range(0.0..core::f64::consts::TAU));
        DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin())
    };
    let tint = [1.0, rng.random_range(0.5..1.0), rng.random_range(0.5..1.0)];
    let kind = rng.random_range(0..5);
    let radiance = tint.map(|t| match kind {
        0 => Radiance::Uniform(Uniform { radiance: t }),
        1 | 2 => Radiance::Overcast(MoonSpencer { zenith: t }),
        3 => Radiance::Clear(ClearSky { base: 0.6 * t, horizon: 0.5, aureole: t, width: 0.4, sun }),
        _ => {
            let texels = (0..64 * 32).map(|k| [0.2 + 0.8 * ((k * 7919) % 97) as f32 / 97.0, 0.0, 0.0]).collect();
            Radiance::Map(StokesMap::new(64, 32, texels).unwrap())
        }
    });
    let max_dolp = 10.0_f64.powf(rng.random_range(-5.0..0.0));
    let pattern = match rng.random_range(0..5) {
        0 => Some(SkyPattern::Rayleigh { sun, max_dolp }),
        1 => Some(SkyPattern::Berry { sun, splitting_deg: 10.0_f64.powf(rng.random_range(-1.0..1.6)), max_dolp }),
        _ => None,
    };
    let disk = (rng.random_range(0..6) == 0).then(|| Sun {
        direction: sun,
        angular_radius_rad: 10.0_f64.powf(rng.random_range(-5.0..-2.3)),
        radiance: [1000.0; 3],
    });
    let metal = rng.random_range(0..8) == 0;
    let ior = if metal { Ior::new(0.5, 2.5).unwrap() } else { Ior::new(rng.random_range(1.3..1.9), 0.0).unwrap() };
    let masking = if rng.random() { Masking::HeightCorrelated } else { Masking::Separable };
    let ggx = Ggx::new(10.0_f64.powf(rng.random_range(-5.0..-0.4)), masking).unwrap();
    let body = if rng.random() { Body::Lambert } else { Body::Interface };
    let albedo = if rng.random() { 0.0 } else { 10.0_f32.powf(rng.random_range(-7.0..-0.2)) };
    let bumps = if rng.random() { 0.0 } else { 10.0_f64.powf(rng.random_range(-6.0..-1.0)) };
    let theta = rng.random_range(0.05..1.2_f64);
    let view = DVec3::new(theta.sin(), 0.0, theta.cos());
    let mean = near(DVec3::Z, 0.05, rng);
    let pixels = (0..SIDE * SIDE)
        .map(|k| {
            let (u, v) = ((k % SIDE) as f64 / SIDE as f64 - 0.5, (k / SIDE) as f64 / SIDE as f64 - 0.5);
            let wo = (view + DVec3::new(-0.1 * v, 0.1 * u, 0.0)).normalize();
            Pixel {
                normal: near(mean, bumps, rng).as_vec3().into(),
                to_camera: wo.as_vec3().into(),
                albedo: [albedo; 3],
                surface: if k == 3 { Pixel::NOTHING } else { 0 },
            }
        })
        .collect();
    Scene {
        light: SceneLight { radiance, pattern, sun: disk },
        surfaces: vec![Surface { ior: [ior; 3], ggx, body }],
        pixels,
        camera_x: DVec3::Y,
    }
}

impl Scene {
    pub(crate) fn view(&self) -> PixelMap<'_> {
        PixelMap { width: SIDE, camera_x: self.camera_x, pixels: &self.pixels }
    }
}
