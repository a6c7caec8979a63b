//! The tables of the fast forward model: `cargo bench -p host-fit --bench forward`.
//!
//! One row per light, range of materials and tolerance: wall time of one view's table on all threads, its bytes, the error it
//! measured of itself (median / 95th percentile / worst, of s0), and ns per response (value and four derivatives of nine
//! numbers) on one thread, at scattered materials and at the same one again. A joint fit at 0.3 MP/s of two views on two
//! threads affords some 400 ns.
#![allow(clippy::unwrap_used, reason = "a bench chooses numbers that fit")]

use glam::DVec3;
use host_fit::forward::{Body, IndexRange, TableOptions, Tables, ViewRays};
use host_fit::light::KnownLight;
use host_fit::material::{Facets, Forward};
use host_image::{Picture, Samples};
use host_optics::sky::{ClearSky, Polarized, Rayleigh, StokesMap};
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

/// A camera six sample sides away at 56°.
fn view() -> ViewRays {
    let camera = DVec3::new(4.974, 0.0, 3.355);
    let rays = (0..9).map(|k| camera - DVec3::new(f64::from(k % 3 - 1) * 0.5, f64::from(k / 3 - 1) * 0.5, 0.0));
    ViewRays { camera_x: DVec3::Y, rays: rays.collect() }
}

fn sky() -> KnownLight {
    let sun = DVec3::new(-0.6, 0.5, 0.6).normalize();
    let sky = Polarized {
        light: ClearSky { base: 0.6, horizon: 0.5, aureole: 2.0, width: 0.25, sun },
        pattern: Rayleigh::new(sun, 0.8).unwrap(),
    };
    KnownLight::sampled(KnownLight::FORMULA_SIZE, [sky; 3]).unwrap()
}

/// The light of a capture, which has its sun in it.
fn map(capture: &str) -> Option<KnownLight> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let picture = Picture::read(&root.join(format!("captures/{capture}/light/probe.exr"))).ok()?;
    let Samples::F32(rgb) = &picture.samples else { return None };
    KnownLight::of_maps(StokesMap::from_rgb(picture.width, picture.height, rgb).ok()?).ok()
}

fn nanoseconds(tables: &Tables, options: &TableOptions, scatter: bool) -> f64 {
    let rays = view().rays;
    let [low, high] = if let IndexRange::Free(range) = options.index { range } else { [1.5; 2] };
    let count = 200_000_u32;
    let start = Instant::now();
    let mut sum = 0.0;
    for k in 0..count {
        let share = |base: f64| if scatter { (f64::from(k) * base).fract() } else { base };
        let facets = Facets {
            eta: low + (high - low) * share(0.618),
            alpha: options.alpha[0] * (options.alpha[1] / options.alpha[0]).powf(share(0.755)),
            slope: [options.slope * (share(0.57) - 0.5), options.slope * (share(0.414) - 0.5)],
        };
        let wo = rays[k as usize % rays.len()].normalize();
        sum += black_box(tables.response(0, wo, black_box(&facets))).specular[0];
    }
    black_box(sum);
    start.elapsed().as_secs_f64() * 1e9 / f64::from(count)
}

fn main() {
    let common = TableOptions {
        index: IndexRange::Free([1.3, 1.8]),
        alpha: [0.03, 0.5],
        slope: 0.3,
        body: Body::Interface,
        ..TableOptions::default()
    };
    let everything = TableOptions { body: Body::Interface, ..TableOptions::default() };
    let lights = [("polarized clear sky", Some(sky())), ("clouds, S1", map("S1")), ("low sun, S3_hdr", map("S3_hdr"))];
    println!("light, ranges, tolerance: table; error; response scattered, same");
    for (name, light) in &lights {
        let Some(light) = light else {
            println!("{name}: skipped: no ../shared");
            continue;
        };
        for (ranges, options) in [("common", common), ("everything", everything)] {
            for tolerance in [1e-2, 3e-3, 1e-3] {
                let options = TableOptions { tolerance, ..options };
                let tables = Tables::new(light, &[view()], &options).unwrap();
                let report = tables.reports()[0];
                let [median, most, worst] = report.error;
                println!(
                    "{name}, {ranges}, {tolerance:.0e}: {:.2} s, {:.1} MB; {median:.1e} / {most:.1e} / {worst:.1e}; \
                     {:.0} ns, {:.0} ns",
                    report.time.as_secs_f64(),
                    report.bytes as f64 / 1e6,
                    nanoseconds(&tables, &options, true),
                    nanoseconds(&tables, &options, false),
                );
            }
        }
    }
}
