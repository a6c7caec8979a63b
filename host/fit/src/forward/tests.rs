//! The model against the integrals it stands for, and its derivatives against differences of both.

#![expect(clippy::float_cmp, reason = "what is absent is exactly 0")]

use super::*;
use crate::material::{Lanes, by};
use host_optics::integral::{Adaptive, View, lambert, polarized_diffuse};
use host_optics::sky::{ClearSky, Polarized, Rayleigh, SunDisk};
use host_optics::{Conductor, Dielectric, Ggx, Microfacet, PolarizedDiffuse};
use std::sync::OnceLock;

type Sky = Polarized<ClearSky, Rayleigh>;

fn sky(strength: f64) -> Sky {
    let sun = DVec3::new(-0.6, 0.5, 0.6).normalize();
    Polarized {
        light: ClearSky { base: 0.6, horizon: 0.5, aureole: strength, width: 0.25, sun },
        pattern: Rayleigh::new(sun, 0.8).unwrap(),
    }
}

fn skies() -> [Sky; 3] {
    [sky(2.0), sky(1.0), sky(0.5)]
}

fn rays() -> ViewRays {
    let camera = DVec3::new(5.0, 0.5, 3.4);
    let corner = |x: f64, y: f64| camera - DVec3::new(x, y, 0.0);
    let rays = vec![camera, corner(0.5, 0.5), corner(-0.5, 0.5), corner(0.5, -0.5), corner(-0.5, -0.5)];
    ViewRays { camera_x: DVec3::new(-0.1, 1.0, 0.05), rays }
}

fn options() -> TableOptions {
    TableOptions {
        index: IndexRange::Free([1.3, 1.8]),
        alpha: [0.08, 0.4],
        slope: 0.2,
        body: Body::Interface,
        ..TableOptions::default()
    }
}

/// One table for all tests of its kind.
fn tables() -> &'static Tables {
    static TABLES: OnceLock<Tables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let light = KnownLight::sampled([512, 256], skies()).unwrap();
        Tables::new(&light, &[rays()], &options()).unwrap()
    })
}

/// A ray and a material within the ranges.
fn case(k: u32) -> (DVec3, Facets) {
    let share = |base: f64| (f64::from(k + 1) * base).fract();
    let wo = DVec3::new(5.0, 0.5, 3.4) - DVec3::new(share(0.31) - 0.5, share(0.77) - 0.5, 0.0);
    let alpha = 0.08 * 5.0_f64.powf(share(0.618));
    let slope = [0.4 * share(0.755) - 0.2, 0.4 * share(0.57) - 0.2];
    (wo.normalize(), Facets { eta: 1.3 + 0.5 * share(0.414), alpha, slope })
}

/// Specular and diffuse by the adaptive integral of the formula itself.
fn exact(wo: DVec3, facets: &Facets) -> [Lanes; 2] {
    let view = View::new(wo, rays().camera_x).unwrap();
    let ior = Dielectric::new(facets.eta).unwrap();
    let surface = Microfacet { ior: ior.into(), ggx: Ggx::new(facets.alpha, Masking::HeightCorrelated).unwrap() };
    let mut out = [[0.0; 9]; 2];
    for (band, light) in skies().iter().enumerate() {
        let rule = Adaptive::new(1e-7);
        let specular = rule.specular(light, &surface, facets.normal(), &view).value;
        let [e] = rule.transmitted_irradiance(light, ior, facets.normal()).value;
        let body = PolarizedDiffuse { ior, albedo: 1.0 };
        let diffuse = polarized_diffuse(&body, facets.normal(), &view, e);
        out[0][3 * band..3 * band + 3].copy_from_slice(&specular);
        out[1][3 * band..3 * band + 3].copy_from_slice(&diffuse);
    }
    out
}

/// Largest difference in units of each band's own s0.
fn miss(found: &Lanes, exact: &Lanes, scale: &Lanes) -> f64 {
    (0..9).map(|k| (found[k] - exact[k]).abs() / scale[k - k % 3]).fold(0.0, f64::max)
}

/// One step along a parameter.
fn moved(facets: &Facets, parameter: usize, h: f64) -> Facets {
    let mut out = *facets;
    match parameter {
        by::ETA => out.eta += h,
        by::ALPHA => out.alpha += h,
        by::SLOPE_X => out.slope[0] += h,
        _ => out.slope[1] += h,
    }
    out
}

#[test]
fn responses_meet_the_adaptive_integral() {
    let (mut specular, mut diffuse) = (Vec::new(), Vec::new());
    for k in 0..24 {
        let (wo, facets) = case(k);
        let found = tables().response(0, wo, &facets);
        let [s, d] = exact(wo, &facets);
        specular.push(miss(&found.specular, &s, &s));
        diffuse.push(miss(&found.diffuse, &d, &d));
    }
    for e in [&mut specular, &mut diffuse] {
        e.sort_by(f64::total_cmp);
    }
    println!(
        "median and worst: specular {:.1e} {:.1e}, diffuse {:.1e} {:.1e}",
        specular[12], specular[23], diffuse[12], diffuse[23]
    );
    assert!(specular[12] < 1.5e-3 && specular[23] < 5e-3, "{specular:?}");
    assert!(diffuse[23] < 5e-4, "{diffuse:?}");
    let report = tables().reports()[0];
    // What the tables say of themselves is what they are worth.
    assert!(report.error[0] < 1.5e-3 && report.error[1] < 4e-3 && report.tests > 200, "{report:?}");
    assert!(report.bytes < options().memory_bytes);
}

#[test]
fn derivatives_are_those_of_the_model_itself() {
    for k in 0..40 {
        let (wo, facets) = case(k);
        let at = tables().response(0, wo, &facets);
        for parameter in 0..4 {
            let h = 1e-4;
            let [high, low] = [h, -h].map(|h| tables().response(0, wo, &moved(&facets, parameter, h)));
            for lane in 0..9 {
                let pairs = [
                    (high.specular[lane] - low.specular[lane], at.specular_by[parameter][lane]),
                    (high.diffuse[lane] - low.diffuse[lane], at.diffuse_by[parameter][lane]),
                ];
                for (difference, slope) in pairs {
                    // f32 tables leave 1e-7/h of noise, and a spline's slope bends at its knots.
                    let scale = at.specular[lane - lane % 3] + at.diffuse[lane - lane % 3];
                    let error = (difference / (2.0 * h) - slope).abs() / scale;
                    assert!(error < 2e-2, "{facets:?} {parameter} {lane}: {} {slope}", difference / (2.0 * h));
                }
            }
        }
    }
}

#[test]
fn derivatives_meet_those_of_the_adaptive_integral() {
    let mut worst = [0.0_f64; 4];
    for k in 0..6 {
        let (wo, facets) = case(k);
        let at = tables().response(0, wo, &facets);
        let [s, d] = exact(wo, &facets);
        for (parameter, worst) in worst.iter_mut().enumerate() {
            let h = 1e-3;
            let [high, low] = [h, -h].map(|h| exact(wo, &moved(&facets, parameter, h)));
            let slope: [Lanes; 2] =
                core::array::from_fn(|p| core::array::from_fn(|l| (high[p][l] - low[p][l]) / (2.0 * h)));
            let error =
                miss(&at.specular_by[parameter], &slope[0], &s).max(miss(&at.diffuse_by[parameter], &slope[1], &d));
            *worst = worst.max(error);
        }
    }
    println!("worst error of derivatives by eta, alpha, slopes, in units of s0: {worst:.3?}");
    // Relative changes of s0 are of order 5 per unit of each.
    assert!(worst.iter().all(|w| *w < 0.15), "{worst:?}");
}

#[test]
fn a_surface_that_faces_away_is_black_and_a_view_that_is_not_there_too() {
    let (wo, facets) = case(3);
    let away = Facets { slope: [-40.0, 0.0], ..facets };
    let low = DVec3::new(0.99, 0.0, 0.05).normalize();
    assert_eq!(tables().response(0, low, &away), Response::BLACK);
    assert_eq!(tables().response(7, wo, &facets), Response::BLACK);
}

#[test]
fn beyond_the_ranges_the_model_goes_on_smoothly_and_ever_more_slowly() {
    let (wo, facets) = case(5);
    let edge = [1.8, 0.4, 0.2, 0.2];
    for (parameter, e) in edge.into_iter().enumerate() {
        let at = |x: f64| {
            let mut out = facets;
            match parameter {
                by::ETA => out.eta = x,
                by::ALPHA => out.alpha = x,
                by::SLOPE_X => out.slope[0] = x,
                _ => out.slope[1] = x,
            }
            tables().response(0, wo, &out)
        };
        let (inside, outside) = (at(e - 1e-6), at(e + 1e-6));
        for lane in 0..9 {
            let (a, b) = (inside.specular_by[parameter][lane], outside.specular_by[parameter][lane]);
            assert!((a - b).abs() < 1e-3 * inside.specular[0], "{parameter} {lane}: {a} {b}");
        }
        let sign = outside.specular_by[parameter][0].signum();
        let mut last = outside.specular[0];
        for step in [0.05, 0.1, 0.3, 1.0, 10.0, 1e6] {
            let r = at(e + step);
            let all = r
                .specular
                .iter()
                .chain(r.specular_by.as_flattened())
                .chain(&r.diffuse)
                .chain(r.diffuse_by.as_flattened());
            assert!(all.clone().all(|x| x.is_finite()), "{parameter} {step}");
            if parameter == by::ETA {
                // More index is more reflection, everywhere.
                assert!(sign > 0.0 && r.specular[0] >= last && r.specular_by[parameter][0] >= 0.0, "{step}");
                last = r.specular[0];
            }
        }
    }
}

#[test]
fn a_metal_has_no_index_to_fit_and_no_interface_below_it() {
    let gold = [(0.18, 3.4), (0.42, 2.4), (1.5, 1.9)].map(|(n, k)| Conductor::new(n, k).unwrap().into());
    let light = KnownLight::sampled([256, 128], skies()).unwrap();
    let options =
        TableOptions { index: IndexRange::Fixed(gold), alpha: [0.2, 0.3], slope: 0.05, tolerance: 3e-3, ..options() };
    let tables = Tables::new(&light, &[rays()], &options).unwrap();
    assert!(!tables.index_is_free());
    let (wo, facets) = case(2);
    let facets = Facets { alpha: 0.25, slope: [0.02, -0.03], ..facets };
    let found = tables.response(0, wo, &facets);
    let view = View::new(wo, rays().camera_x).unwrap();
    for (band, (ior, sky)) in gold.into_iter().zip(skies()).enumerate() {
        let surface = Microfacet { ior, ggx: Ggx::new(0.25, Masking::HeightCorrelated).unwrap() };
        let exact = Adaptive::new(1e-6).specular(&sky, &surface, facets.normal(), &view).value;
        for c in 0..3 {
            assert!((found.specular[3 * band + c] - exact[c]).abs() < 6e-3 * exact[0], "{found:?} {exact:?}");
        }
    }
    assert!(found.specular_by[by::ETA] == [0.0; 9] && found.diffuse == [0.0; 9]);
}

#[test]
fn lambert_is_the_irradiance_and_a_sun_beside_the_sky_counts() {
    let disk = SunDisk::new(DVec3::new(-0.5, 0.2, 0.8), SunDisk::SOLAR_RADIUS_RAD, 1.0).unwrap();
    let light = KnownLight::sampled([256, 128], skies()).unwrap().with_sun(disk, [4e4, 3e4, 2e4]);
    let options = TableOptions { body: Body::Lambert, alpha: [0.2, 0.3], slope: 0.1, tolerance: 3e-3, ..options() };
    let tables = Tables::new(&light, &[rays()], &options).unwrap();
    let (wo, facets) = case(4);
    let facets = Facets { alpha: 0.25, slope: [0.05, -0.03], ..facets };
    let found = tables.response(0, wo, &facets);
    for band in 0..3 {
        let e = light.irradiance(facets.normal())[band];
        let exact = lambert(1.0, e);
        assert!((found.diffuse[3 * band] / exact[0] - 1.0).abs() < 1e-3 && found.diffuse[3 * band + 1].abs() < 1e-12);
    }
    let [median, _, worst] = tables.reports()[0].error;
    assert!(median < 4e-3 && worst < 2e-2, "{:?}", tables.reports());
}

#[test]
fn ranges_that_make_no_sense_are_refused() {
    let light = KnownLight::sampled([64, 32], skies()).unwrap();
    for bad in [
        TableOptions { alpha: [0.3, 0.1], ..options() },
        TableOptions { index: IndexRange::Free([0.9, 1.5]), ..options() },
        TableOptions { tolerance: 0.0, ..options() },
    ] {
        assert!(matches!(Tables::new(&light, &[rays()], &bad), Err(OpticsError::Range { .. })), "{bad:?}");
    }
    let none = ViewRays { camera_x: DVec3::X, rays: vec![DVec3::X] };
    assert_eq!(Tables::new(&light, &[none], &options()).unwrap_err(), OpticsError::AxisAlongRay);
}
