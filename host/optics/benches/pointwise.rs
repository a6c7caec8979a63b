//! The pointwise functions of Fresnel and GGX, one thread: `cargo bench -p host-optics`.
//!
//! One row per function: ns per call, best of many passes over the same incidences, even in angle and in no order, so that no
//! branch on the angle is foreseen. The roofline is the processor's divider: a dielectric takes one root and three divisions.
#![allow(clippy::unwrap_used, reason = "a bench chooses numbers that fit")]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use host_optics::integral::{FixedPoints, View};
use host_optics::prefilter::{Fineness, Pyramid, Reflector};
use host_optics::sky::{MoonSpencer, Polarized, Rayleigh};
use host_optics::{Conductor, Dielectric, Ggx, Incidence, Ior, Masking, Microfacet};
use protocol_polar::{Radians, Reflectance};

const COUNT: u32 = 2048;
const PASSES: u32 = 400;

fn main() {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let angle = |k: u32| FRAC_PI_2 * (f64::from(k) * golden).fract();
    let points: Vec<Incidence> = (0..COUNT).map(|k| Incidence::from_angle(Radians(angle(k)))).collect();
    let lanes: Vec<Incidence<f32>> = points.iter().map(|at| at.single()).collect();
    let glass = black_box(Dielectric::new(1.5).unwrap());
    let silver = black_box(Conductor::new(0.2, 3.4).unwrap());
    let sum = |r: Reflectance| r.perpendicular + r.parallel * 2.0 + r.rr_cos_delta * 3.0 + r.rr_sin_delta * 5.0;
    row("dielectric reflectance", &points, |at| sum(glass.reflectance(at)));
    row("dielectric difference", &points, |at| glass.difference(at));
    row("dielectric transmittance", &points, |at| glass.transmittance(at).iter().sum());
    row("dielectric gradient", &points, |at| {
        let g = glass.gradient(at);
        g.perpendicular_by_eta + g.t_by_eta * 2.0 + g.perpendicular_by_cosine * 3.0 + g.t_by_cosine * 5.0
    });
    row("conductor reflectance", &points, |at| sum(silver.reflectance(at)));
    row("conductor difference", &points, |at| silver.difference(at));
    let (glass, silver) = (glass.single(), silver.single());
    row("dielectric terms, f32", &lanes, |at| f64::from(glass.terms(at).iter().sum::<f32>()));
    row("conductor terms, f32", &lanes, |at| f64::from(silver.terms(at).iter().sum::<f32>()));

    let ggx = black_box(Ggx::new(0.1, Masking::HeightCorrelated).unwrap());
    row("GGX D", &points, |at| ggx.d(at));
    row("GGX visibility", &points, |at| ggx.visibility(at, points[7]));
    sums(ggx);
}

/// What the functions are for: per point of the fixed rule, and per pixel of a sum over prefiltered light.
fn sums(ggx: Ggx) {
    let light = Polarized {
        light: MoonSpencer { zenith: 1.0 },
        pattern: Rayleigh::new(DVec3::new(1.0, 0.0, 0.5), 0.7).unwrap(),
    };
    let view = View::new(DVec3::new(0.0, -0.83, 0.56), DVec3::X).unwrap();
    let pyramid = Pyramid::sample(Pyramid::FORMULA_SIZE, &[light; 3]).unwrap();
    for (name, ior) in [("dielectric", Ior::new(1.5, 0.0).unwrap()), ("conductor", Ior::new(0.2, 3.4).unwrap())] {
        let surface = Microfacet { ior, ggx };
        let rule = FixedPoints::new(16);
        let time = best(20, || rule.specular(&light, &surface, DVec3::Z, black_box(&view))[0]);
        print(&format!("fixed points, {name}, per point"), time / 512.0);
        let reflector = Reflector::new([ior; 3], ggx);
        let time = best(20, || reflector.specular(&pyramid, Fineness(0.1), DVec3::Z, black_box(&view))[0][0]);
        print(&format!("prefiltered, {name}, per pixel"), time);
    }
}

fn row<T: Copy>(name: &str, points: &[T], f: impl Fn(T) -> f64) {
    let time = best(PASSES, || points.iter().map(|at| f(*at)).sum());
    print(name, time / f64::from(COUNT));
}

/// ns of the fastest pass.
fn best(passes: u32, pass: impl Fn() -> f64) -> f64 {
    let one = |_| {
        let start = Instant::now();
        black_box(pass());
        start.elapsed().as_secs_f64() * 1e9
    };
    (0..passes).map(one).fold(f64::INFINITY, f64::min)
}

fn print(name: &str, ns: f64) {
    println!("{name:<36} {ns:9.1} ns");
}
