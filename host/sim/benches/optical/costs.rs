//! What each optical effect costs: the picture with all of them, less the picture without one. The effects' own `COST_NS` are these.
//!
//! Polarized map with a sun apart, bumpy, rough, half of it a dielectric and half a metal; 512 × 512 pixels.

use super::least;
use super::scene::{Scene, dielectric, photographed, surface};
use glam::DVec3;
use host_optics::Ior;
use host_sim::optical::{Evaluation, Renderer, SkyPattern, Sun};
use host_sim::{Effect, EffectSet};
use std::time::Instant;

pub(crate) fn run() {
    let Some(mut light) = photographed() else { return };
    let sun = DVec3::new(-0.5, 0.5, 0.6);
    light.pattern = Some(SkyPattern::Berry { sun, splitting_deg: 30.0, max_dolp: 0.6 });
    light.sun = Some(Sun { direction: sun, angular_radius_rad: 0.004_65, radiance: [3e4; 3] });
    let mut scene = Scene::new(light, surface(dielectric(), 0.25), 512, 0.1, 0.3);
    scene.surfaces.push(surface(Ior::new(0.2, 3.4).unwrap(), 0.25));
    let half = scene.pixels.len() / 2;
    scene.pixels[half..].iter_mut().for_each(|p| p.surface = 1);
    let time = |effects| {
        let start = Instant::now();
        let evaluation = Evaluation::Prefiltered { tolerance: 1e-3 };
        let renderer = Renderer::new(&scene.light, &scene.surfaces, effects, evaluation).unwrap();
        std::hint::black_box(renderer.render(&scene.view()));
        start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64
    };
    println!("# costs: ns per pixel less without an effect, least of 5");
    println!("# effect\tfull_ns\tsaved_ns");
    for effect in Effect::OPTICAL {
        let pairs = (0..5).map(|_| (time(EffectSet::ALL), time(EffectSet::ALL.without(effect))));
        let (full, without): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let (full, without) = (least(full), least(without));
        println!("{}\t{full:.0}\t{:.0}", effect.name(), full - without);
    }
}
