//! A plane at 56° that fills a square picture, and the lights it is seen in.

use glam::DVec3;
use host_optics::sky::{MoonSpencer, StokesMap, Uniform};
use host_optics::{Ggx, Ior, Masking};
use host_sim::optical::{Body, Pixel, PixelMap, Radiance, SceneLight, Surface};
use host_sim::scene::SkyRadiance;
use std::path::Path;

pub(crate) struct Scene {
    pub(crate) light: SceneLight,
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) side: usize,
}

impl Scene {
    /// `bumps` is the amplitude of slopes.
    pub(crate) fn new(light: SceneLight, surface: Surface, side: usize, bumps: f64, albedo: f32) -> Self {
        Self { light, surfaces: vec![surface], pixels: pixels(side, bumps, albedo), side }
    }

    pub(crate) fn view(&self) -> PixelMap<'_> {
        PixelMap { width: self.side, camera_x: DVec3::Y, pixels: &self.pixels }
    }
}

/// Pixel (i, j) of a picture k times smaller is (k i, k j) of the larger.
fn pixels(side: usize, bumps: f64, albedo: f32) -> Vec<Pixel> {
    let (s, c) = 56.0_f64.to_radians().sin_cos();
    (0..side * side)
        .map(|k| {
            let (x, y) = ((k % side) as f64 / side as f64 - 0.5, 0.5 - (k / side) as f64 / side as f64);
            let wave = |f: f64, g: f64| (f * x + g * y).sin();
            let slopes =
                [wave(91.0, 33.0) + wave(-40.0, 71.0), wave(53.0, -87.0) + wave(17.0, 95.0)].map(|w| 0.5 * bumps * w);
            Pixel {
                normal: DVec3::new(-slopes[0], -slopes[1], 1.0).normalize().as_vec3().into(),
                to_camera: (DVec3::new(s, 0.0, c) * 6.0 - DVec3::new(-y, x, 0.0)).normalize().as_vec3().into(),
                albedo: [albedo; 3],
                surface: 0,
            }
        })
        .collect()
}

pub(crate) fn surface(ior: Ior, alpha: f64) -> Surface {
    Surface { ior: [ior; 3], ggx: Ggx::new(alpha, Masking::HeightCorrelated).unwrap(), body: Body::Interface }
}

pub(crate) fn dielectric() -> Ior {
    Ior::new(1.5, 0.0).unwrap()
}

pub(crate) fn uniform() -> SceneLight {
    SceneLight::unpolarized([1.0, 0.9, 0.8].map(|radiance| Radiance::Uniform(Uniform { radiance })))
}

pub(crate) fn overcast() -> SceneLight {
    SceneLight::unpolarized([1.0, 0.9, 0.8].map(|zenith| Radiance::Overcast(MoonSpencer { zenith })))
}

/// A photographed sky with its sun, 1024 × 512; `None`, after saying so, where the reference data is missing.
pub(crate) fn photographed() -> Option<SceneLight> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), Into::into);
    let file = root.join("data/env/kloofendal_48d_partly_cloudy_puresky_1k.hdr");
    if !file.exists() {
        println!("# skipped: no ../shared");
        return None;
    }
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/stone-pavement.toml");
    let text = std::fs::read_to_string(&example).unwrap();
    let map = format!("[light.map]\nfile = \"{}\"\ncenter_azimuth_deg = 0.0\nscale = 1.0", file.display());
    let text = text.replace("[light.overcast]\nzenith_radiance = 1.0", &map);
    let scene = host_sim::Scene::parse(&text, &example).unwrap();
    let band = |k: usize| match &scene.light.bands[k].radiance {
        SkyRadiance::Map(turned) => Radiance::Map(StokesMap::sample(1024, 512, turned).unwrap()),
        _ => Radiance::Uniform(Uniform { radiance: 0.0 }),
    };
    Some(SceneLight::unpolarized([band(0), band(1), band(2)]))
}
