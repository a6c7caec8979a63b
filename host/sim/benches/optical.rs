//! Time and error of each evaluation of eq. 6, and what planning saves. Run with `cargo bench -p host-sim --bench optical`.
//!
//! Times are wall nanoseconds per pixel of three bands on one thread, for 1024 × 1024 pixels (points: 16 × 16), light and tables
//! included. Errors are over 256 pixels, relative to s0, against the prefiltered method itself at its finest cells, every pixel
//! for itself: what they do not show is the error of those cells, for which see the comparison with Mitsuba in the tests.
//! Planned pictures are timed into the memory of an earlier one, without the survey of the view, which planning shares; the last
//! figure counts survey and planning.

#![expect(clippy::cast_possible_truncation, reason = "radiance maps are f32")]

use core::f64::consts::{FRAC_PI_2, PI, TAU};
use glam::DVec3;
use host_optics::sky::{MoonSpencer, StokesMap};
use host_optics::{Ggx, Ior, Masking};
use host_sim::optical::{
    Body, EffectSet, Evaluation, OpticalFacts, Pixel, PixelMap, Radiance, Renderer, SceneLight, Surface,
};
use host_sim::planner::{Plan, difference};
use std::time::Instant;

const SIDE: usize = 1024;

struct Scene {
    light: SceneLight,
    surfaces: Vec<Surface>,
    pixels: Vec<Pixel>,
}

/// A plane at 56° that fills the picture; `bumps` is the amplitude of its slopes.
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

fn surface(alpha: f64, body: Body) -> Surface {
    Surface {
        ior: [Ior::new(1.5, 0.0).expect("an index"); 3],
        ggx: Ggx::new(alpha, Masking::Separable).expect("a roughness"),
        body,
    }
}

/// A sky with clouds and a low sun of a few texels, 1024 × 512.
fn map() -> SceneLight {
    let (width, height) = (1024, 512);
    let texel = |k: usize| {
        let (row, column) = (k / width, k % width);
        let (theta, phi) = (row as f64 / height as f64 * PI, column as f64 / width as f64 * TAU);
        let sun = (theta - 1.35).hypot(phi - 3.9) < 0.01;
        let cloud = 0.5 + 0.4 * (9.0 * theta).sin() * (7.0 * phi).cos() + 0.1 * (31.0 * theta + 23.0 * phi).sin();
        if theta > FRAC_PI_2 {
            0.0
        } else if sun {
            3000.0
        } else {
            cloud as f32
        }
    };
    let band = |tint: f32| {
        let texels = (0..width * height).map(|k| [tint * texel(k), 0.0, 0.0]).collect();
        Radiance::Map(StokesMap::new(width, height, texels).expect("a map"))
    };
    SceneLight::unpolarized([band(1.0), band(0.9), band(0.7)])
}

fn time(scene: &Scene, side: usize, effects: EffectSet, evaluation: Evaluation) -> (f64, Vec<[[f32; 3]; 3]>, String) {
    let view = PixelMap { width: side, camera_x: DVec3::Y, pixels: &scene.pixels };
    let start = Instant::now();
    let renderer = Renderer::new(&scene.light, &scene.surfaces, effects, evaluation).expect("a sky");
    let rendering = renderer.render(&view);
    let ns = start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64;
    (ns, rendering.stokes, format!("{:?} {:?}", rendering.surfaces[0].method, rendering.timing))
}

fn methods() {
    for (name, alpha, bumps) in [
        ("flat, alpha 0.05", 0.05, 0.0),
        ("bumpy 6 degrees, alpha 0.25", 0.25, 0.1),
        ("bumpy 6 degrees, alpha 0.1", 0.1, 0.1),
    ] {
        println!("map with a low sun, plane at 56 degrees, {name}");
        let small =
            Scene { light: map(), surfaces: vec![surface(alpha, Body::Interface)], pixels: pixels(16, bumps, 0.2) };
        let all = EffectSet::ALL;
        let (_, truth, _) = time(&small, 16, all, Evaluation::Prefiltered { tolerance: 1e-5 });
        let scene = Scene { pixels: pixels(SIDE, bumps, 0.2), ..small };
        for tolerance in [1e-2, 3e-3, 1e-3] {
            let evaluation = Evaluation::Prefiltered { tolerance };
            let (ns, stokes, how) = time(&scene, SIDE, all, evaluation);
            // Pixel (i, j) of the small picture is (64 i, 64 j) of the large one.
            let same: Vec<_> = (0..256).map(|k| stokes[(k / 16) * 64 * SIDE + (k % 16) * 64]).collect();
            let (worst, rms) = difference(&same, &truth);
            println!("  prefiltered {tolerance:.0e}: {ns:7.0} ns/px, rms {rms:.1e} worst {worst:.1e}  {how}");
        }
        let small = Scene { pixels: pixels(16, bumps, 0.2), ..scene };
        for rings in [4, 8, 16] {
            let (ns, stokes, _) = time(&small, 16, all, Evaluation::Points { rings });
            let (worst, rms) = difference(&stokes, &truth);
            println!("  points {rings:2} rings: {ns:7.0} ns/px, rms {rms:.1e} worst {worst:.1e}");
        }
    }
}

fn planning() {
    let sky = [1.0, 0.9, 0.8].map(|zenith| Radiance::Overcast(MoonSpencer { zenith }));
    let cases = [
        ("overcast, smooth dielectric at Brewster", SceneLight::unpolarized(sky), 0.001, 0.0, 0.0),
        ("map, rough, bumpy, diffuse (worst)", map(), 0.25, 0.1, 0.3),
    ];
    for (name, light, alpha, bumps, albedo) in cases {
        let scene =
            Scene { light, surfaces: vec![surface(alpha, Body::Interface)], pixels: pixels(SIDE, bumps, albedo) };
        let view = PixelMap { width: SIDE, camera_x: DVec3::Y, pixels: &scene.pixels };
        let start = Instant::now();
        let facts = OpticalFacts::new(&scene.light, &scene.surfaces, &[view]);
        let surveyed = start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64;
        let plan = Plan::new(&facts, 1e-2);
        let planning = start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64;
        println!("{name}: planned in {planning:.1} ns/px (survey {surveyed:.1}), bound {:.1e}", plan.bound);
        for row in &plan.rows {
            println!("  {:24} {:9.1e} {} {:?}", row.effect.name(), row.assessment.bound, row.on, row.why);
        }
        let survey = &facts.surveys()[0];
        // A second picture finds the memory of the first.
        let again = |effects| {
            let renderer = Renderer::new(&scene.light, &scene.surfaces, effects, plan.evaluation).expect("a sky");
            let memory = renderer.render_surveyed(&view, survey).stokes;
            let start = Instant::now();
            let renderer = Renderer::new(&scene.light, &scene.surfaces, effects, plan.evaluation).expect("a sky");
            let rendering = renderer.render_into(&view, survey, memory);
            let ns = start.elapsed().as_nanos() as f64 / scene.pixels.len() as f64;
            println!("  {ns:.1} ns/px: {:?} {:?}", rendering.surfaces[0].method, rendering.timing);
            (ns, rendering.stokes)
        };
        let ((pruned, a), (full, b)) = (again(plan.effects), again(EffectSet::ALL));
        let (worst, _) = difference(&a, &b);
        let with_all = (full + surveyed) / (pruned + planning);
        println!("  {:.2}x, with survey and planning {with_all:.2}x; true difference {worst:.1e}", full / pruned);
    }
}

fn main() {
    // CPU time is what is compared.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        planning();
        methods();
    });
}
