//! Against the adaptive integrals, on smooth light that a map resolves; and what a pyramid must keep of its map.

#![expect(clippy::float_cmp, reason = "what is copied is equal to the bit")]

use super::*;
use crate::integral::{Adaptive, FixedPoints, View};
use crate::sky::{ClearSky, Polarized, Rayleigh, StokesMap};
use crate::{Ggx, Ior, Light, Masking, Microfacet};

type Sky = Polarized<ClearSky, Rayleigh>;

/// A polarized sky, with an aureole that is wide, or narrow and as bright as a sun in a map.
fn sky(strength: f64, width: f64) -> Sky {
    let sun = DVec3::new(-0.8, 0.15, 0.6).normalize();
    Polarized {
        light: ClearSky { base: 0.6, horizon: 0.5, aureole: strength, width, sun },
        pattern: Rayleigh::new(sun, 0.8).unwrap(),
    }
}

fn view(k: u32) -> View {
    let [theta, azimuth] = [0.2 + 0.1 * f64::from(k % 10), 0.3 * f64::from(k % 7) - 0.9];
    let wo = DVec3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos());
    View::new(wo, DVec3::new(-0.3, 1.0, 0.1)).unwrap()
}

fn normal(k: u32) -> DVec3 {
    let a = 2.4 * f64::from(k);
    DVec3::new(0.2 * a.cos(), 0.2 * a.sin(), 1.0).normalize()
}

/// Errors of s0, s1, s2 relative to s0, sorted.
fn errors(light: &Sky, width: usize, fineness: f64, alpha: f64, count: u32) -> Vec<f64> {
    let pyramid = Pyramid::sample([width, width / 2], &[light; 3]).unwrap();
    let ior = Ior::new(1.5, 0.0).unwrap();
    let ggx = Ggx::new(alpha, Masking::HeightCorrelated).unwrap();
    let mut errors = Vec::new();
    for k in 0..count {
        let exact = Adaptive::new(1e-6).specular(light, &Microfacet { ior, ggx }, normal(k), &view(k)).value;
        let found = Reflector::new([ior; 3], ggx).specular(&pyramid, Fineness(fineness), normal(k), &view(k));
        assert_eq!(found[0], found[2], "bands do not mix");
        errors.push((0..3).map(|c| (found[1][c] - exact[c]).abs() / exact[0]).fold(0.0, f64::max));
    }
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
#[ignore = "prints the table of Fineness"]
fn table() {
    for (name, light) in [("wide", sky(2.0, 0.25)), ("sun", sky(2000.0, 0.02))] {
        for fineness in [0.03, 0.05, 0.1, 0.2, 0.3] {
            let line: Vec<String> = [0.02, 0.05, 0.15, 0.4]
                .map(|alpha| {
                    let e = errors(&light, 1024, fineness, alpha, 24);
                    format!("{:.0e}/{:.0e}", e[12], e[23])
                })
                .to_vec();
            println!("{name} {fineness} {}", line.join(" | "));
        }
        let pyramid = Pyramid::sample([1024, 512], &[&light; 3]).unwrap();
        for body in [None, Some(crate::Dielectric::new(1.5).unwrap())] {
            let e = (0..24).map(|k| {
                let exact = match body {
                    None => Adaptive::new(1e-7).irradiance(&light, normal(k)).value[0],
                    Some(b) => Adaptive::new(1e-7).transmitted_irradiance(&light, b, normal(k)).value[0],
                };
                (irradiance(&pyramid, &Sources::default(), body.map(|b| [b; 3]), normal(k))[0] / exact - 1.0).abs()
            });
            println!("{name} irradiance {} {:e}", body.is_some(), e.fold(0.0, f64::max));
        }
    }
}

#[test]
fn sums_meet_the_adaptive_integral() {
    for (light, bound) in [(sky(2.0, 0.25), 1.5e-3), (sky(2000.0, 0.02), 1.5e-3)] {
        for alpha in [0.05, 0.3] {
            let e = errors(&light, 1024, 0.05, alpha, 8);
            assert!(e[7] < bound, "alpha {alpha}: {e:?}");
        }
    }
}

#[test]
fn irradiance_and_what_passes_an_interface_meet_the_adaptive_integral() {
    let light = sky(2.0, 0.25);
    let glass = crate::Dielectric::new(1.5).unwrap();
    let pyramid = Pyramid::sample(Pyramid::FORMULA_SIZE, &[&light; 3]).unwrap();
    for k in 0..6 {
        let rule = Adaptive::new(1e-7);
        let [e] = rule.irradiance(&light, normal(k)).value;
        let [t] = rule.transmitted_irradiance(&light, glass, normal(k)).value;
        let none = Sources::default();
        let found = [None, Some([glass; 3])].map(|body| irradiance(&pyramid, &none, body, normal(k))[1]);
        assert!((found[0] / e - 1.0).abs() < 1e-3 && (found[1] / t - 1.0).abs() < 1e-3, "{k}: {found:?} {e} {t}");
    }
}

#[test]
fn sources_are_the_integral_over_their_disk() {
    let disk = crate::sky::SunDisk::new(DVec3::new(-0.5, 0.1, 0.8), 0.03, 100.0).unwrap();
    let sources = Sources { points: disk.points(), radiance: [100.0, 50.0, 0.0] };
    let surface = Microfacet { ior: Ior::new(1.5, 0.0).unwrap(), ggx: Ggx::new(0.2, Masking::Separable).unwrap() };
    let found = Reflector::new([surface.ior; 3], surface.ggx).sources(&sources, DVec3::Z, &view(4));
    let exact = FixedPoints::new(400).specular(&disk, &surface, DVec3::Z, &view(4));
    for c in 0..3 {
        assert!((found[0][c] - exact[c]).abs() < 3e-3 * exact[0], "{found:?} {exact:?}");
        assert!((found[1][c] - 0.5 * found[0][c]).abs() < 1e-12 && found[2][c] == 0.0);
    }
    let set = Sources { points: vec![(DVec3::new(0.6, 0.0, -0.8), 1.0)], radiance: [1.0; 3] };
    assert_eq!(Reflector::new([surface.ior; 3], surface.ggx).sources(&set, DVec3::Z, &view(0)), [[0.0; 3]; 3]);
}

#[test]
fn texels_of_a_map_come_back_exactly_and_nothing_gets_lost_on_the_way_up() {
    let light = sky(2000.0, 0.02);
    let bands = [StokesMap::sample(64, 32, &light).unwrap(), StokesMap::sample(64, 32, &light).unwrap()];
    let [r, g] = bands;
    let small = StokesMap::sample(16, 8, &light).unwrap();
    let pyramid = Pyramid::of_maps(&[r.clone(), g, small]).unwrap();
    assert!(pyramid.polarized());
    let (mut seen, mut sum) = (0, [0.0; 3]);
    pyramid.walk(|found| {
        if found.cell.radius > 0.0 {
            return false;
        }
        let w = found.cell.direction.as_dvec3();
        let [l, q, u] = r.stokes(w);
        let ratio = f64::from(found.cell.power[0]) / l;
        let [fq, fu] = found.polarization[0].map(f64::from);
        assert!((fq / ratio - q).hypot(fu / ratio - u) < 1e-5 * l, "{w}");
        seen += 1;
        sum[0] += f64::from(found.cell.power[0]);
        sum[1] += f64::from(found.cell.power[1]);
        false
    });
    assert_eq!(seen, 64 * 16);
    let mut top = 0.0;
    pyramid.walk(|found| {
        top += f64::from(found.cell.power[0]);
        true
    });
    assert!((top / sum[0] - 1.0).abs() < 1e-5 && sum[0] == sum[1], "{top} {sum:?}");
    assert!(!Pyramid::sample([8, 4], &[crate::sky::Uniform { radiance: 1.0 }; 3]).unwrap().polarized());
    assert!(Pyramid::sample([0, 4], &[&light; 3]).is_err());
}

#[test]
fn what_a_simulator_leaves_out_is_left_out() {
    let pyramid = Pyramid::sample([256, 128], &[sky(2.0, 0.25); 3]).unwrap();
    let silver = Ior::new(0.2, 3.4).unwrap();
    let surface = Reflector::gray(silver, 0.2, Masking::Separable).unwrap();
    let at = |r: &Reflector| r.specular(&pyramid, Fineness(0.1), normal(2), &view(9));
    let full = at(&surface);
    assert!(at(&surface.without_masking())[0][0] > 1.001 * full[0][0]);
    assert!((at(&surface.without_retardance())[0][2] - full[0][2]).abs() > 1e-3 * full[0][0]);
    // A mirror of the light itself is the limit of small roughness.
    let light = sky(2.0, 0.25);
    let mirror = surface.mirror::<true>(|w| [light.stokes(w); 3], normal(2), &view(9));
    let limit = crate::integral::mirror(&light, silver, normal(2), &view(9));
    assert!((0..3).all(|c| (mirror[1][c] - limit[c]).abs() < 1e-12 * limit[0]));
}
