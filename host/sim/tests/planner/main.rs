//! The planner keeps its promise: over random scenes the pruned picture never leaves the tolerance.
#![expect(clippy::unwrap_used, reason = "a scene that cannot be is a failed test")]

use glam::DVec3;
use host_optics::sky::{ClearSky, MoonSpencer, StokesMap, Uniform};
use host_optics::{Ggx, Ior, Masking};
use host_sim::optical::{
    Body, EffectSet, Evaluation, OpticalEffect, OpticalFacts, Pixel, PixelMap, Radiance, Renderer, SceneLight,
    SkyPattern, Sun, Surface,
};
use host_sim::planner::{Plan, Why, difference};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use rayon::prelude::*;

const SIDE: usize = 6;

struct Scene {
    light: SceneLight,
    surfaces: Vec<Surface>,
    pixels: Vec<Pixel>,
    camera_x: DVec3,
}

/// A direction within `spread` of the zenith, in chord.
fn near(center: DVec3, spread: f64, rng: &mut SmallRng) -> DVec3 {
    let mut any = || rng.random_range(-1.0..1.0);
    (center + DVec3::new(any(), any(), any()) * spread).normalize()
}

fn scene(seed: u64) -> Scene {
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
    fn view(&self) -> PixelMap<'_> {
        PixelMap { width: SIDE, camera_x: self.camera_x, pixels: &self.pixels }
    }
}

#[test]
fn the_tolerance_is_never_exceeded() {
    let results: Vec<(u64, f64, f64, f64, Plan)> = (0..520_u64)
        .into_par_iter()
        .map(|seed| {
            let scene = scene(seed);
            let view = scene.view();
            let tolerance = [1e-3, 3e-3, 1e-2, 5e-2][usize::try_from(seed % 4).unwrap()];
            let plan = Plan::new(&OpticalFacts::new(&scene.light, &scene.surfaces, &[view]), tolerance);
            let verified = plan.verify(&scene.light, &scene.surfaces, &view).unwrap();
            (seed, tolerance, plan.bound, verified.worst, plan)
        })
        .collect();
    let mut left_out = std::collections::BTreeMap::new();
    for (seed, tolerance, bound, worst, plan) in &results {
        assert!(worst <= tolerance, "scene {seed}: {worst:.2e} over {tolerance}: {plan:?}");
        assert!(bound <= tolerance, "scene {seed}");
        for row in plan.rows.iter().filter(|r| r.why == Why::Negligible) {
            *left_out.entry(row.effect.name()).or_insert(0) += 1;
        }
    }
    println!("left out though present: {left_out:?}");
    // The bounds are worth something: every effect was left out somewhere although the scene had it.
    for effect in OpticalEffect::ALL {
        assert!(left_out.contains_key(effect.name()), "{} was never negligible: {left_out:?}", effect.name());
    }
}

/// Each bound by itself, whatever it is worth to the planner; says how far above the truth it lies.
#[test]
fn every_bound_holds_alone() {
    let evaluation = Evaluation::Prefiltered { tolerance: 1e-5 };
    let found: Vec<(OpticalEffect, f64, f64)> = (1000..1160_u64)
        .into_par_iter()
        .flat_map_iter(|seed| {
            let scene = scene(seed);
            let view = scene.view();
            let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[view]);
            let render = |set| Renderer::new(&scene.light, &scene.surfaces, set, evaluation).unwrap().render(&view);
            let full = render(EffectSet::ALL);
            let mut out = Vec::new();
            for effect in OpticalEffect::ALL {
                let bound = facts.assess(effect, EffectSet::ALL).bound;
                if bound > 0.0 && bound < 1.0 {
                    let (worst, _) = difference(&render(EffectSet::ALL.without(effect)).stokes, &full.stokes);
                    // Fixed points err by some 1e-5 themselves, and pictures are f32.
                    assert!(worst <= bound + 2e-4, "scene {seed}: {} by {worst:.2e} over {bound:.2e}", effect.name());
                    out.push((effect, bound, worst));
                }
            }
            out
        })
        .collect();
    for effect in OpticalEffect::ALL {
        let own = found.iter().filter(|(e, _, worst)| *e == effect && *worst > 3e-5);
        let mut ratios: Vec<f64> = own.map(|(_, bound, worst)| bound / worst).collect();
        ratios.sort_by(f64::total_cmp);
        if let Some(median) = ratios.get(ratios.len() / 2) {
            println!(
                "{}: bound over truth, median {median:.1}, least {:.2}, {} scenes",
                effect.name(),
                ratios[0],
                ratios.len()
            );
        }
    }
}
