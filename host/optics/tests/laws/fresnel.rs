//! Fresnel: energy, Brewster, the inverse, derivatives against differences, robustness.

use crate::index;
use core::f64::consts::FRAC_PI_2;
use host_optics::materials::{ALL, named};
use host_optics::{Conductor, Dielectric, Incidence, Ior, OpticsError};
use proptest::prelude::*;
use protocol_polar::Radians;

/// Central difference of fourth order (Richardson), error about h⁴ f⁽⁵⁾/30 + 1e-16/h.
fn slope(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    let d = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
    (4.0 * d(h) - d(2.0 * h)) / 3.0
}

#[test]
fn nothing_is_reflected_in_the_plane_of_incidence_at_brewster() {
    for eta in [1.000_000_1, 1.33, 1.5, 2.4] {
        let d = Dielectric::new(eta).unwrap();
        let exact = d.reflectance(d.brewster());
        assert!(exact.parallel < 1e-30 * exact.perpendicular, "eta {eta}: {exact:?}");
        assert!((d.specular_dolp(d.brewster()) - 1.0).abs() < 1e-14);
        // One ulp to either side δ jumps from 180° to 0°; √(R⊥R∥) cos δ does not.
        let theta = eta.atan();
        for at in [theta.next_down(), theta, theta.next_up()].map(|t| Incidence::from_angle(Radians(t))) {
            let r = d.reflectance(at);
            assert!(r.rr_cos_delta.abs() < 1e-14 * r.perpendicular && r.parallel.is_finite());
        }
        assert!(d.t(Incidence::from_angle(Radians(theta - 1e-3))) > 0.0);
        assert!(d.t(Incidence::from_angle(Radians(theta + 1e-3))) < 0.0);
    }
}

#[test]
fn a_plane_of_glass_reflects_four_percent() {
    let normal = Incidence { cosine: 1.0, sine_squared: 0.0 };
    let r = Dielectric::new(1.5).unwrap().reflectance(normal);
    assert!((r.perpendicular - 0.04).abs() < 1e-16 && (r.rr_cos_delta + 0.04).abs() < 1e-16);
    // ((n − 1)² + k²)/((n + 1)² + k²) for a metal.
    let r = Conductor::new(0.2, 3.4).unwrap().reflectance(normal);
    assert!((r.perpendicular - (0.64 + 11.56) / (1.44 + 11.56)).abs() < 1e-15, "{r:?}");
    assert!((r.perpendicular - r.parallel).abs() < 1e-16);
}

#[test]
fn indices_without_physics_are_refused() {
    for (n, k) in [(0.99, 0.0), (f64::NAN, 0.0), (1.5, -0.1), (0.0, 1.0), (1.5, f64::INFINITY), (1e4, 0.0)] {
        let refused = Ior::new(n, k).unwrap_err();
        assert!(matches!(refused, OpticsError::Index { .. }), "{n} {k}: {refused}");
    }
    let grazing = Incidence { cosine: 0.0, sine_squared: 1.0 };
    for (r, at) in
        [(1.0, Incidence::from_angle(Radians(0.3))), (-0.1, Incidence::from_angle(Radians(0.3))), (0.5, grazing)]
    {
        assert!(matches!(Dielectric::from_perpendicular(r, at), Err(OpticsError::NotADielectric { .. })));
    }
}

#[test]
fn every_named_material_has_an_index() {
    for material in ALL {
        assert!(material.iors().is_ok(), "{}", material.name);
    }
    let [red, green, blue] = named("Acrylic").unwrap().iors().unwrap();
    let eta = |ior| if let Ior::Dielectric(d) = ior { d.eta() } else { 0.0 };
    // Normal dispersion: blue is bent most.
    assert!(eta(red) < eta(green) && eta(green) < eta(blue));
    assert!(matches!(named("gold").unwrap().iors().unwrap(), [Ior::Conductor(_), ..]));
    assert!(named("unobtainium").is_none());
}

proptest! {
    #[test]
    fn energy_and_sanity_at_every_angle(ior in index(), theta in prop_oneof![
        6 => 0.0..FRAC_PI_2,
        1 => Just(0.0),
        1 => Just(FRAC_PI_2),
        1 => Just(FRAC_PI_2 - 1e-6),
        1 => (-300.0..-1.0_f64).prop_map(|e| 10_f64.powf(e)),
    ]) {
        let at = Incidence::from_angle(Radians(theta));
        let r = ior.reflectance(at);
        for x in [r.perpendicular, r.parallel] {
            prop_assert!((0.0..=1.0 + 1e-14).contains(&x), "{r:?}");
        }
        // |√(R⊥R∥) e^(iδ)|² = R⊥R∥, and s is always the stronger.
        let product = r.perpendicular * r.parallel;
        prop_assert!((r.rr_cos_delta.hypot(r.rr_sin_delta) - product.sqrt()).abs() <= 1e-14 * r.perpendicular);
        let difference = ior.difference(at);
        prop_assert!(difference >= 0.0 && (difference - (r.perpendicular - r.parallel)).abs() <= 1e-14);
        let dolp = ior.specular_dolp(at);
        prop_assert!((0.0..=1.0 + 1e-14).contains(&dolp));
        if let Ior::Dielectric(d) = ior {
            let [s, p] = d.transmittance(at);
            prop_assert!((s + r.perpendicular - 1.0).abs() < 1e-14 && (p + r.parallel - 1.0).abs() < 1e-14);
            let g = d.gradient(at);
            for x in [g.perpendicular_by_eta, g.t_by_eta, g.perpendicular_by_cosine, g.t_by_cosine] {
                prop_assert!(x.is_finite(), "{g:?}");
            }
        }
    }

    #[test]
    fn the_inverse_undoes_the_reflectance(eta in 1.0..3.0_f64, theta in 0.0..1.5_f64) {
        let at = Incidence::from_angle(Radians(theta));
        let r = Dielectric::new(eta).unwrap().reflectance(at).perpendicular;
        let back = Dielectric::from_perpendicular(r, at).unwrap().eta();
        // (1 + ρ)/(1 − ρ) at 86° loses two digits.
        prop_assert!((back - eta).abs() < 1e-12 * eta, "{back} for {eta}");
    }

    #[test]
    fn gradients_are_the_slopes(eta in 1.05..3.0_f64, theta in 0.05..1.5_f64) {
        let at = Incidence::from_angle(Radians(theta));
        let g = Dielectric::new(eta).unwrap().gradient(at);
        let by_eta = |f: fn(Dielectric, Incidence) -> f64| slope(|x| f(Dielectric::new(x).unwrap(), at), eta, 1e-3);
        let by_theta = |f: fn(Dielectric, Incidence) -> f64| {
            slope(|x| f(Dielectric::new(eta).unwrap(), Incidence::from_angle(Radians(x))), theta, 2e-4)
        };
        let perpendicular = |d: Dielectric, at: Incidence| d.reflectance(at).perpendicular;
        let s = theta.sin();
        for (found, expected) in [
            (g.perpendicular_by_eta, by_eta(perpendicular)),
            (g.t_by_eta, by_eta(Dielectric::t)),
            (-s * g.perpendicular_by_cosine, by_theta(perpendicular)),
            (-s * g.t_by_cosine, by_theta(Dielectric::t)),
        ] {
            prop_assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{found} against {expected}");
        }
    }

    #[test]
    fn a_little_absorption_changes_little(n in 1.1..2.5_f64, theta in 0.0..1.5_f64) {
        let at = Incidence::from_angle(Radians(theta));
        let clear = Ior::new(n, 0.0).unwrap().reflectance(at);
        let dim = Ior::new(n, 1e-9).unwrap().reflectance(at);
        for (a, b) in [
            (clear.perpendicular, dim.perpendicular),
            (clear.parallel, dim.parallel),
            (clear.rr_cos_delta, dim.rr_cos_delta),
            (clear.rr_sin_delta, dim.rr_sin_delta),
        ] {
            prop_assert!((a - b).abs() < 1e-7, "{a} {b}");
        }
    }
}
