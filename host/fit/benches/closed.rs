//! The closed forms on two views in RGB: `cargo bench -p host-fit --bench closed`.
//!
//! One row per case: ns of one core per pixel (CPU time of a thread, best of many small images, so that a busy machine hardly
//! shows), and MP/s of 5 MP images on all threads (best of a few). The floor is memory: 72 bytes of Stokes values in and 56
//! out per pixel (and 144 of covariance where each pixel has its own), at some 10 GB/s per channel. Arguments choose cases by
//! name.
//!
//! Where the time goes: the inverse of R⊥ − R∥, once per view and band, and the Fresnel terms with their derivatives beside
//! it; long chains of arithmetic and not memory. The light's table costs little, whether uniform or not.
#![allow(clippy::cast_precision_loss, clippy::unwrap_used, reason = "a bench chooses numbers that fit")]

use glam::DVec3;
use host_fit::UpperTriangle;
use host_fit::closed::{Covariance, Grid, SkyTable, SurfacePlanes, ViewPlanes, planes, sky_aware_planes};
use host_optics::integral::{self, FixedPoints, View};
use host_optics::sky::{ClearSky, Polarized, Rayleigh};
use host_optics::{Ior, Light};
use std::hint::black_box;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

const WIDTH: usize = 2448;
const HEIGHT: usize = 2048;
const NOISE: UpperTriangle = [1e-6, 0.0, 0.0, 2e-6, 0.0, 2e-6];

fn main() {
    let sun = DVec3::new(0.5, 0.6, 0.6);
    let light = Polarized {
        light: ClearSky { base: 1.0, horizon: 0.5, aureole: 0.5, width: 0.5, sun: sun.normalize() },
        pattern: Rayleigh::new(sun, 0.8).unwrap(),
    };
    let rule = FixedPoints::new(16);
    let clear = SkyTable::sample(|w| [light.stokes(w); 3], |n| [rule.irradiance(&light, n); 3], 256);
    let uniform = SkyTable::uniform([1.0; 3]);
    let cameras = [(56.0_f64, 0.0_f64), (56.0, 90.0), (15.0, 45.0)].map(|(theta, azimuth)| {
        let ((s, c), (sp, cp)) = (theta.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
        DVec3::new(s * cp, s * sp, c) * 5.0
    });
    let axes = cameras.map(|c| DVec3::new(-c.y, c.x, 0.0).normalize());
    let grid = Grid { origin: DVec3::new(-0.2, 0.2, 0.0), column: DVec3::X * 1.6e-4, row: DVec3::Y * -1.6e-4 };
    // One row of true pixels, repeated: normals that sway by 5°.
    let stokes: Vec<[Vec<f32>; 3]> = cameras.iter().zip(&axes).map(|(c, axis)| rendered(&light, *c, *axis)).collect();
    let given = vec![NOISE; WIDTH * HEIGHT];
    let views = |count: usize, covariance| -> Vec<ViewPlanes<'_>> {
        let each = stokes.iter().zip(&cameras).zip(&axes).take(count);
        each.map(|((stokes, camera), x_axis)| ViewPlanes {
            camera: *camera,
            x_axis: *x_axis,
            stokes: [stokes.each_ref().map(Vec::as_slice); 3],
            covariance,
        })
        .collect()
    };
    let same = Covariance::Same([NOISE; 3]);
    let own = Covariance::Planes([given.as_slice(); 3]);
    let closed = |count, covariance, sky| {
        let views = views(count, covariance);
        move |height: usize| planes(&cropped(&views, height), &grid, WIDTH, sky).unwrap()
    };
    let aware = |count, covariance, sky| {
        let views = views(count, covariance);
        move |height: usize| sky_aware_planes(&cropped(&views, height), &grid, WIDTH, sky).unwrap()
    };
    report("closed, 2 views, uniform", [64, HEIGHT], closed(2, same, &uniform));
    report("closed, 2 views, clear sky", [64, HEIGHT], closed(2, same, &clear));
    report("closed, own covariances, uniform", [64, HEIGHT], closed(2, own, &uniform));
    report("closed, own covariances, clear sky", [64, HEIGHT], closed(2, own, &clear));
    report("closed, 3 views, clear sky", [64, HEIGHT], closed(3, same, &clear));
    report("sky-aware, 2 views, uniform", [1, 64], aware(2, same, &uniform));
    report("sky-aware, 2 views, clear sky", [1, 64], aware(2, same, &clear));
}

/// The first rows of an image.
fn cropped<'a>(views: &[ViewPlanes<'a>], height: usize) -> Vec<ViewPlanes<'a>> {
    let count = WIDTH * height;
    let crop = |view: &ViewPlanes<'a>| {
        let covariance = match view.covariance {
            Covariance::Planes(bands) => Covariance::Planes(bands.map(|plane| &plane[..count])),
            same @ Covariance::Same(_) => same,
        };
        ViewPlanes { stokes: view.stokes.map(|band| band.map(|plane| &plane[..count])), covariance, ..*view }
    };
    views.iter().map(crop).collect()
}

fn rendered(light: &impl Light, camera: DVec3, axis: DVec3) -> [Vec<f32>; 3] {
    let view = View::new(camera, axis).unwrap();
    let mut planes = [(); 3].map(|()| Vec::with_capacity(WIDTH * HEIGHT));
    for x in 0..WIDTH {
        let t = x as f64 * 0.01;
        let normal = DVec3::new(0.08 * t.sin(), 0.08 * (1.3 * t).cos(), 1.0).normalize();
        let [l, q, u] = integral::mirror(light, Ior::new(1.5, 0.0).unwrap(), normal, &view);
        for (plane, s) in planes.iter_mut().zip([l + 0.3, q, u]) {
            #[expect(clippy::cast_possible_truncation, reason = "images are f32")]
            plane.push(s as f32);
        }
    }
    for _ in 1..HEIGHT {
        for plane in &mut planes {
            plane.extend_from_within(..WIDTH);
        }
    }
    planes
}

/// Times images of few rows on one thread, and of many on all.
fn report(name: &str, [few, many]: [usize; 2], work: impl Fn(usize) -> SurfacePlanes + Sync) {
    let mut chosen = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).peekable();
    if chosen.peek().is_some() && !chosen.any(|part| name.contains(&part)) {
        return;
    }
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one.install(|| best(80, cpu_seconds, || work(few))) / (WIDTH * few) as f64;
    let start = Instant::now();
    let together = best(7, || start.elapsed().as_secs_f64(), || work(many)) / (WIDTH * many) as f64;
    println!("{name:<36} {:8.1} ns of one core per pixel {:8.2} MP/s", 1e9 * alone, 1e-6 / together);
}

fn best(runs: usize, clock: impl Fn() -> f64, work: impl Fn() -> SurfacePlanes) -> f64 {
    let run = |_| {
        let start = clock();
        black_box(work());
        clock() - start
    };
    (0..runs).map(run).fold(f64::INFINITY, f64::min)
}

/// CPU time of this thread; wall time where the system does not tell.
fn cpu_seconds() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let told = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    told.map_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64(), |ns| 1e-9 * ns)
}
