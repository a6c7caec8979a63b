//! The joint fit of two views in RGB under a polarized clear sky: `cargo bench -p host-fit --bench joint`.
//!
//! One row per way of starting: MP/s on all threads, evaluations of the model (each in both views) and µs of one thread per
//! pixel, and the median error of the normal, η and α at 0.3 % of noise. `surface`: materials that change as slowly as those of
//! a picture, each pixel starting from the one before it; `at random`: every pixel another material. `closed` is the closed form
//! of the same pixels, which knows neither roughness nor the polarized body.
//!
//! `-- --dump FILE [PIXELS]` writes pixels of paper eq. 6 with Lambert's body as JSON instead: the observations, where every
//! program starts, and the answers and times of `Direct` and of tables on one thread. `host/xtask/perf/fit_peer.py` reads it.
#![allow(clippy::unwrap_used, clippy::cast_precision_loss, reason = "a bench chooses numbers that fit")]

#[path = "../tests/coverage/pixels.rs"]
mod pixels;

use glam::DVec3;
use host_fit::closed::{self, SkyTable};
use host_fit::direct::Direct;
use host_fit::forward::{Body, IndexRange, TableOptions};
use host_fit::joint::{Fit, Settings, Starts, fit};
use host_fit::material::{Facets, Forward, Observation};
use host_optics::Light;
use host_optics::integral::FixedPoints;
use host_optics::sky::{ClearSky, Polarized, Rayleigh};
use pixels::{Camera, Material, Random, tables};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::Instant;

const COLUMNS: usize = 256;
const ROWS: usize = 96;
const NOISE: f64 = 0.003;

/// Order of the quadrature that the peer repeats.
const ORDER: u32 = 16;

/// Where all programs start.
const GUESS: Facets = Facets { eta: 1.5, alpha: 0.2, slope: [0.0; 2] };
const GUESSED_ALBEDO: f64 = 0.3;

type Sky = Polarized<ClearSky, Rayleigh>;

fn sun() -> DVec3 {
    DVec3::new(0.5, 0.4, 0.5).normalize()
}

fn skies() -> [Sky; 3] {
    let pattern = Rayleigh::new(sun(), 0.8).unwrap();
    [(0.45, 2.2), (0.6, 2.0), (0.8, 1.7)].map(|(base, aureole)| Polarized {
        light: ClearSky { base, horizon: 0.5, aureole, width: 0.3, sun: sun() },
        pattern,
    })
}

fn cameras() -> [Camera; 2] {
    [Camera::at(56.0, 170.0), Camera::at(56.0, 260.0)]
}

fn options(body: Body) -> TableOptions {
    TableOptions {
        index: IndexRange::Free([1.2, 2.0]),
        alpha: [0.03, 0.5],
        slope: 0.3,
        body,
        ..TableOptions::default()
    }
}

/// Material number `k` of a row of random ones.
fn at_random(random: &mut Random) -> Material {
    Material {
        albedo: [0; 3].map(|_| random.between(0.05, 0.6)),
        facets: Facets {
            eta: random.between(1.35, 1.7),
            alpha: random.between(0.08, 0.4),
            slope: [random.between(-0.15, 0.15), random.between(-0.15, 0.15)],
        },
    }
}

/// A surface that sways by some degrees over tens of pixels.
fn surface(column: usize, row: usize) -> Material {
    let (x, y) = (column as f64 * 0.11, row as f64 * 0.13);
    Material {
        albedo: [0.3 + 0.1 * (x + y).sin(), 0.25 + 0.1 * x.cos(), 0.2 + 0.1 * y.sin()],
        facets: Facets {
            eta: 1.5 + 0.05 * (0.3 * x).sin(),
            alpha: 0.2 + 0.05 * (0.4 * y).cos(),
            slope: [0.08 * x.sin(), 0.08 * y.cos()],
        },
    }
}

struct Sheet {
    truths: Vec<Material>,
    pixels: Vec<Vec<Observation>>,
}

fn sheet(rule: &FixedPoints, material: impl Fn(usize, usize, &mut Random) -> Material + Sync) -> Sheet {
    let (lights, cameras) = (skies(), cameras());
    let one = |k: usize| {
        let mut random = Random::new(k as u64);
        let (column, row) = (k % COLUMNS, k / COLUMNS);
        let truth = material(column, row, &mut random);
        let place = [column as f64 / COLUMNS as f64 - 0.5, row as f64 / ROWS as f64 - 0.5];
        (truth, truth.pixel(&lights, rule, (&cameras, place), NOISE, || random.normal()))
    };
    let (truths, pixels) = (0..COLUMNS * ROWS).into_par_iter().map(one).unzip();
    Sheet { truths, pixels }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median errors of the normal in degrees, η and α.
fn errors(truths: &[Material], found: impl Fn(usize) -> Facets) -> [f64; 3] {
    let of = |error: &dyn Fn(&Facets, &Facets) -> f64| {
        median(truths.iter().enumerate().map(|(k, truth)| error(&truth.facets, &found(k))).collect())
    };
    [
        of(&|a, b| a.normal().cross(b.normal()).length().asin().to_degrees()),
        of(&|a, b| (a.eta - b.eta).abs()),
        of(&|a, b| (a.alpha - b.alpha).abs()),
    ]
}

fn report(name: &str, seconds: f64, evaluations: f64, [normal, eta, alpha]: [f64; 3]) {
    let pixels = (COLUMNS * ROWS) as f64;
    println!(
        "{name:<38} {:8.3} MP/s {evaluations:6.1} evaluations {:8.2} us  normal {normal:.2} deg, eta {eta:.4}, alpha {alpha:.4}",
        1e-6 * pixels / seconds,
        1e6 * seconds / pixels * rayon::current_num_threads() as f64,
    );
}

/// Rows in parallel; a pixel starts from `start`, or from the answer before it.
fn joint<F: Forward>(
    forward: &F,
    pixels: &[Vec<Observation>],
    settings: &Settings,
    start: impl Fn(usize, Option<&Fit>) -> Vec<Facets> + Sync,
) -> Vec<Fit> {
    let row = |(row, pixels): (usize, &[Vec<Observation>])| {
        let (mut fits, mut last) = (Vec::with_capacity(COLUMNS), None::<Fit>);
        for (column, pixel) in pixels.iter().enumerate() {
            let found = fit(forward, pixel, &start(row * COLUMNS + column, last.as_ref()), settings);
            last = Some(found);
            fits.push(found);
        }
        fits
    };
    pixels.par_chunks(COLUMNS).enumerate().flat_map_iter(row).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|a| a == "--dump") {
        let count = arguments.get(at + 2).and_then(|n| n.parse().ok()).unwrap_or(200);
        std::fs::write(&arguments[at + 1], dump(count).to_string()).unwrap();
        return;
    }
    let rule = FixedPoints::new(12);
    let (smooth, random) = (sheet(&rule, |x, y, _| surface(x, y)), sheet(&rule, |_, _, random| at_random(random)));
    let start = Instant::now();
    let forward = tables(&skies(), &cameras(), &options(Body::Interface));
    let (seconds, bytes) = (start.elapsed().as_secs_f64(), forward.reports().iter().map(|r| r.bytes).sum::<usize>());
    println!(
        "tables of 2 views: {seconds:.1} s, {:.0} MB; {} threads",
        bytes as f64 / 1e6,
        rayon::current_num_threads()
    );
    let given = Settings { starts: Starts::Given, profile: false, ..Settings::default() };
    let auto = Settings::default();
    let axes = cameras().map(|camera| camera.x_axis);
    let sky = sky_table(&skies());
    let run = |name: &str, sheet: &Sheet, work: &dyn Fn() -> Vec<Fit>| {
        let mut seconds = Vec::new();
        let mut fits = Vec::new();
        for _ in 0..3 {
            let start = Instant::now();
            fits = black_box(work());
            seconds.push(start.elapsed().as_secs_f64());
        }
        let evaluations = fits.iter().map(|f| f64::from(f.evaluations)).sum::<f64>() / fits.len() as f64;
        report(name, median(seconds), evaluations, errors(&sheet.truths, |k| fits[k].facets));
    };
    let neighbor = |_: usize, last: Option<&Fit>| last.map_or(vec![], |fit| vec![fit.facets]);
    run("surface, from the neighbor", &smooth, &|| joint(&forward, &smooth.pixels, &given, neighbor));
    run("surface, neighbor, doubts looked into", &smooth, &|| joint(&forward, &smooth.pixels, &auto, neighbor));
    let closed_start = |k: usize, _: Option<&Fit>| vec![closed::pixel(&random.pixels[k], &axes, &sky).facets];
    run("at random, from the closed form", &random, &|| joint(&forward, &random.pixels, &given, closed_start));
    run("at random, from a grid", &random, &|| joint(&forward, &random.pixels, &auto, |_, _| vec![]));
    for (name, sheet) in [("surface, closed", &smooth), ("at random, closed", &random)] {
        let start = Instant::now();
        let found: Vec<Facets> = sheet.pixels.par_iter().map(|p| closed::pixel(p, &axes, &sky).facets).collect();
        report(name, start.elapsed().as_secs_f64(), 0.0, errors(&sheet.truths, |k| found[k]));
    }
}

fn sky_table(lights: &[Sky; 3]) -> SkyTable {
    let rule = FixedPoints::new(16);
    let stokes = |w: DVec3| lights.each_ref().map(|light| light.stokes(w));
    SkyTable::sample(stokes, |n| lights.each_ref().map(|light| rule.irradiance(light, n)), 256)
}

/// The problem of the peer, and how it is answered here.
fn dump(count: usize) -> Value {
    let (lights, cameras) = (skies(), cameras());
    let direct = Direct::new(lights, cameras.map(|c| c.x_axis).to_vec(), ORDER);
    let tables = tables(&lights, &cameras, &options(Body::Lambert));
    let mut pixels = Vec::new();
    for k in 0..count {
        let mut random = Random::new(k as u64);
        let truth = at_random(&mut random);
        let place = [random.between(-0.5, 0.5), random.between(-0.5, 0.5)];
        let pixel: Vec<Observation> = cameras
            .iter()
            .enumerate()
            .map(|(view, camera)| observed(&direct, view, camera.direction(place), &truth, &mut random))
            .collect();
        pixels.push((truth, pixel));
    }
    let settings = Settings { starts: Starts::Given, profile: false, tolerance: 1e-4, ..Settings::default() };
    let (of_direct, of_tables) = (answers(&direct, &pixels, &settings), answers(&tables, &pixels, &settings));
    let light = |light: &Sky| json!({ "base": light.light.base, "aureole": light.light.aureole });
    let observation = |o: &Observation| {
        let sigma = o.covariance.map(|c| f64::from(c[0]).sqrt());
        json!({ "direction": o.direction.to_array(), "stokes": o.stokes, "sigma": sigma })
    };
    json!({
        "sky": { "sun": sun().to_array(), "horizon": 0.5, "width": 0.3, "max_dolp": 0.8, "bands": lights.each_ref().map(light) },
        "order": ORDER,
        "x_axes": cameras.map(|c| c.x_axis.to_array()),
        "start": [GUESSED_ALBEDO, GUESSED_ALBEDO, GUESSED_ALBEDO, GUESS.eta, GUESS.alpha, GUESS.slope[0], GUESS.slope[1]],
        "response": response(&direct, pixels[0].1[1].direction),
        "pixels": pixels.iter().map(|(truth, pixel)| json!({
            "truth": truth.parameters(),
            "views": pixel.iter().map(observation).collect::<Vec<Value>>(),
        })).collect::<Vec<Value>>(),
        "direct": of_direct,
        "tables": of_tables,
    })
}

/// What `direct` says of a view, with noise.
fn observed(direct: &Direct<Sky>, view: usize, direction: DVec3, truth: &Material, random: &mut Random) -> Observation {
    let r = direct.response(view, direction, &truth.facets);
    let mut out = Observation { view, direction, stokes: [[0.0; 3]; 3], covariance: [[0.0; 6]; 3] };
    for band in 0..3 {
        let s = [0, 1, 2].map(|k| r.specular[3 * band + k] + truth.albedo[band] * r.diffuse[3 * band + k]);
        let sigma = NOISE * s[0];
        out.stokes[band] = s.map(|s| pixels::single(s + sigma * random.normal()));
        let variance = pixels::single(sigma * sigma);
        out.covariance[band] = [variance, 0.0, 0.0, variance, 0.0, variance];
    }
    out
}

/// One response, so that the peer can show that its model is this one.
fn response(direct: &Direct<Sky>, direction: DVec3) -> Value {
    let facets = Facets { eta: 1.55, alpha: 0.17, slope: [0.05, -0.08] };
    let r = direct.response(1, direction, &facets);
    json!({
        "direction": direction.to_array(),
        "facets": [facets.eta, facets.alpha, facets.slope[0], facets.slope[1]],
        "specular": r.specular,
        "diffuse": r.diffuse,
    })
}

/// Answers and µs per pixel on one thread.
fn answers<F: Forward>(forward: &F, pixels: &[(Material, Vec<Observation>)], settings: &Settings) -> Value {
    let all = || pixels.iter().map(|(_, pixel)| fit(forward, pixel, &[GUESS], settings)).collect::<Vec<Fit>>();
    let mut seconds = Vec::new();
    let mut fits = Vec::new();
    for _ in 0..5 {
        let start = Instant::now();
        fits = black_box(all());
        seconds.push(start.elapsed().as_secs_f64());
    }
    let answer = |fit: &Fit| {
        let ([r, g, b], n) = (fit.albedo, fit.facets.normal());
        json!({ "parameters": [r, g, b, fit.facets.eta, fit.facets.alpha, n.x, n.y], "sigma": fit.sigma(), "chi2": fit.chi2, "evaluations": fit.evaluations })
    };
    json!({
        "us_per_pixel": 1e6 * median(seconds) / pixels.len() as f64,
        "answers": fits.iter().map(answer).collect::<Vec<Value>>(),
    })
}
