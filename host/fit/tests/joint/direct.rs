//! `Direct` against the tables of eq. 6 and against differences of the adaptive rule.

use crate::shared::{number, sky, table, vector};
use glam::DVec3;
use host_fit::direct::{Body, Direct};
use host_fit::material::{Facets, Forward, Response, by};
use host_optics::integral::{Adaptive, View, lambert, polarized_diffuse};
use host_optics::sky::{ClearSky, Polarized, Rayleigh};
use host_optics::{Dielectric, Ggx, Ior, Masking, Microfacet, PolarizedDiffuse};

fn facets(eta: f64, alpha: f64, n: DVec3) -> Facets {
    Facets { eta, alpha, slope: [n.x / n.z, n.y / n.z] }
}

/// Every smooth case of the table; worst and median miss of s0 by the number of points.
#[test]
fn values_meet_the_tables() {
    let Some(cases) = table("eq6_integrals.json") else { return };
    for (order, median_bound, worst_bound) in [(8, 1e-3, 4e-2), (16, 1e-5, 1e-2), (32, 3e-7, 6e-5)] {
        let mut misses = Vec::new();
        for case in &cases {
            let n = vector(&case["n"]).normalize();
            let light = sky(vector(&case["sun"]), number(&case["pmax"]));
            let ior = Ior::new(number(&case["eta"][0]), number(&case["eta"][1])).unwrap();
            let body = if case.get("s_diffuse_polarized").is_some() { Body::Polarized } else { Body::Lambert };
            let mut direct = Direct::new([light; 3], vec![vector(&case["x_cam"])], order).with_body(body);
            if matches!(ior, Ior::Conductor(_)) {
                direct = direct.with_index(ior);
            }
            let eta = number(&case["eta"][0]);
            let at = facets(eta, number(&case["alpha"]), n);
            let r = direct.response(0, vector(&case["wo"]).normalize(), &at);
            let expected = vector(&case["s_o"]).to_array();
            let rho = number(&case["rho_d"]);
            let miss = (0..3).map(|k| (r.specular[k] + rho * r.diffuse[k] - expected[k]).abs() / expected[0]);
            let miss = miss.fold(0.0, f64::max);
            misses.push((miss, case["kind"].as_str().unwrap().to_owned(), at.alpha));
        }
        misses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (median, worst) = (misses[misses.len() / 2].0, misses.last().unwrap());
        println!("order {order}: median {median:.1e}, worst {worst:?}, 95 % {:?}", misses[misses.len() * 95 / 100]);
        assert!(median < median_bound && worst.0 < worst_bound, "order {order}");
    }
}

/// The specular part and the diffuse one of ρ_d = 1 by the adaptive rule.
fn reference(
    light: &Polarized<ClearSky, Rayleigh>,
    view: &View,
    at: &Facets,
    masking: Masking,
    body: Body,
) -> [[f64; 3]; 2] {
    let rule = Adaptive::new(1e-12);
    let n = at.normal();
    let surface = Microfacet { ior: Ior::new(at.eta, 0.0).unwrap(), ggx: Ggx::new(at.alpha, masking).unwrap() };
    let specular = rule.specular(light, &surface, n, view).value;
    let diffuse = match body {
        Body::Lambert => lambert(1.0, rule.irradiance(light, n).value[0]),
        Body::Polarized => {
            let ior = Dielectric::new(at.eta).unwrap();
            let inside = rule.transmitted_irradiance(light, ior, n).value[0];
            polarized_diffuse(&PolarizedDiffuse { ior, albedo: 1.0 }, n, view, inside)
        }
    };
    [specular, diffuse]
}

#[test]
fn derivatives_are_those_of_the_adaptive_rule() {
    let light = sky(DVec3::new(0.3, 0.8, 0.4), 0.8);
    let scenes = [
        (
            DVec3::new(0.8, 0.1, 0.6),
            facets(1.5, 0.2, DVec3::new(0.1, -0.05, 1.0)),
            Masking::HeightCorrelated,
            Body::Lambert,
        ),
        (
            DVec3::new(-0.3, -0.8, 0.5),
            facets(1.33, 0.05, DVec3::new(-0.2, 0.1, 1.0)),
            Masking::Separable,
            Body::Polarized,
        ),
        (
            DVec3::new(0.1, 0.05, 1.0),
            facets(1.8, 0.5, DVec3::new(0.0, 0.3, 1.0)),
            Masking::HeightCorrelated,
            Body::Polarized,
        ),
        (DVec3::new(0.9, 0.1, 0.3), facets(1.6, 0.4, DVec3::new(0.02, 0.03, 1.0)), Masking::Separable, Body::Lambert),
    ];
    for (wo, at, masking, body) in scenes {
        let x_camera = DVec3::new(0.3, -1.0, 0.2);
        let view = View::new(wo, x_camera).unwrap();
        let direct = Direct::new([light; 3], vec![x_camera], 32).with_masking(masking).with_body(body);
        let Response { specular, specular_by, diffuse, diffuse_by } = direct.response(0, view.direction, &at);
        let [expected, body_expected] = reference(&light, &view, &at, masking, body);
        let scale = expected[0] + body_expected[0];
        for k in 0..9 {
            assert!((specular[k] - expected[k % 3]).abs() < 2e-6 * scale, "{at:?}: {specular:?} {expected:?}");
            assert!((diffuse[k] - body_expected[k % 3]).abs() < 2e-6 * scale, "{diffuse:?} {body_expected:?}");
        }
        for parameter in [by::ETA, by::ALPHA, by::SLOPE_X, by::SLOPE_Y] {
            let h = if parameter == by::ALPHA { 1e-4 * at.alpha } else { 1e-4 };
            let moved = |by: f64| {
                let mut there = at;
                match parameter {
                    by::ETA => there.eta += by,
                    by::ALPHA => there.alpha += by,
                    by::SLOPE_X => there.slope[0] += by,
                    _ => there.slope[1] += by,
                }
                reference(&light, &view, &there, masking, body)
            };
            let (up, down) = (moved(h), moved(-h));
            for k in 0..3 {
                for (part, found) in [specular_by[parameter][k], diffuse_by[parameter][k]].into_iter().enumerate() {
                    let expected = (up[part][k] - down[part][k]) / (2.0 * h);
                    let miss = (found - expected).abs();
                    assert!(
                        miss < 2e-5 * (scale + expected.abs()),
                        "{at:?} {body:?}, part {part}, s{k} by {parameter}: {found} {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn what_has_no_light_is_black() {
    let direct = Direct::new([sky(DVec3::Z, 0.8); 3], vec![DVec3::X], 4);
    let view = DVec3::new(0.0, 0.6, 0.8);
    let good = facets(1.5, 0.1, DVec3::Z);
    assert!(direct.response(0, view, &good).specular[0] > 0.0);
    for (number, wo, at) in [
        (1, view, good),
        (0, DVec3::new(0.0, 0.6, -0.8), good),
        (0, DVec3::NAN, good),
        (0, view, facets(f64::NAN, 0.1, DVec3::Z)),
        (0, view, facets(0.5, 0.1, DVec3::Z)),
        (0, view, facets(1.5, 0.0, DVec3::Z)),
        (0, view, Facets { slope: [f64::NAN, 0.0], ..good }),
        (0, view, Facets { slope: [f64::INFINITY, 0.0], ..good }),
    ] {
        assert_eq!(direct.response(number, wo, &at), Response::BLACK, "{number} {wo} {at:?}");
    }
}
