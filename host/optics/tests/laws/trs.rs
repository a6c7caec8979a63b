//! The transmitted radiance sinusoid: eq. 8 and 9 against each other, the erratum, the special cases, the azimuth error.

use core::f64::consts::{FRAC_PI_2, PI};
use host_optics::trs::{MirrorFacet, Sinusoid, aligned, brewster, unpolarized};
use host_optics::{Dielectric, Incidence, Reflection, Turn};
use proptest::prelude::*;
use protocol_polar::{Degrees, Radians};

fn facet(eta: f64, theta: f64, dolp: f64, psi: f64, phi: f64) -> MirrorFacet {
    let reflectance = Dielectric::new(eta).unwrap().reflectance(Incidence::from_angle(Radians(theta)));
    MirrorFacet { reflectance, radiance: 1.7, dolp, psi: Radians(psi), phi: Radians(phi) }
}

/// What ignoring sky polarization costs below Brewster at P = 0.8, η = 1.5; and the flip.
#[test]
fn the_azimuth_error_of_a_polarized_sky() {
    let brewster = 1.5_f64.atan();
    let worst = |degrees: f64| {
        let theta = brewster - Degrees(degrees).to_radians().0;
        (0..36_000_u32)
            .map(|k| facet(1.5, theta, 0.8, PI * f64::from(k) / 36_000.0, 0.4).azimuth_error().to_degrees().0.abs())
            .fold(0.0, f64::max)
    };
    for (degrees, expected) in [(1.0, 2.09), (5.0, 10.8), (10.0, 25.3)] {
        assert!((worst(degrees) - expected).abs() < 0.06, "{degrees}: {}", worst(degrees));
    }
    assert!(worst(12.4) < 50.0 && worst(12.6) > 89.0, "the flip starts 12.47 degrees below Brewster");
}

#[test]
fn eq_9_as_printed_is_wrong() {
    let f = facet(1.5, 0.6, 0.8, 0.5, 0.9);
    let (_, sin_psi) = f.psi.cos_sin_double();
    let worst = (0..180_u32)
        .map(|k| {
            let po = Degrees(f64::from(k)).to_radians();
            let (_, s) = Radians(po.0 - f.phi.0).cos_sin_double();
            let last = 0.5 * f.radiance * f.dolp * f.reflectance.rr_cos_delta * sin_psi * s;
            // As printed, the last term is subtracted.
            let printed = f.radiance(po) - 2.0 * last;
            (printed - f.stokes().through_polarizer(po)).abs() / f.stokes().0[0]
        })
        .fold(0.0, f64::max);
    assert!(worst > 0.1, "as printed it must disagree with the Mueller product, or the erratum is ours: {worst}");
}

/// Light polarized across the s axis, around the Brewster angle, keeps the digits of the little that is reflected: s0 = L R∥ and
/// −s1 is the same to the bit. ½(R⊥ + R∥) − ½(R⊥ − R∥) would be off by 1e-17 R⊥ whatever R∥ is.
#[test]
fn light_across_the_s_axis_keeps_its_digits_at_brewster() {
    for (eta, away) in [1.1, 1.5, 2.4].into_iter().flat_map(|eta| [0.0, 1e-9, 1e-6, -1e-3].map(|away| (eta, away))) {
        let f = facet(eta, f64::atan(eta) + away, 1.0, FRAC_PI_2, 0.0);
        let [s0, s1, s2, _] = f.stokes().0;
        let expected = f.radiance * f.reflectance.parallel;
        // cos 2ψ_i = −1 is exact; sin 2ψ_i is off by 1e-16.
        assert!((s0 - expected).abs() <= 1e-15 * expected, "{eta} {away}: {s0} {expected}");
        assert!(
            (s1 + expected).abs() <= 1e-15 * expected
                && s2.abs() <= 1e-15 * f.reflectance.rr_cos_delta.abs() * f.radiance
        );

        let reflection = Reflection { into_plane: Turn::NONE, reflectance: f.reflectance, out_of_plane: Turn::NONE };
        let [l, q, u] = reflection.apply([f.radiance, -f.radiance, 0.0]);
        assert!((l - expected).abs() <= 1e-15 * expected && (q + expected).abs() <= 1e-15 * expected && u == 0.0);
    }
}

proptest! {
    /// As printed, eq. 9 is off by L P √(R⊥R∥) |cos δ sin 2ψ_i| at its worst polarizer angle: both times of its last term.
    #[test]
    fn eq_9_as_printed_is_off_by_twice_its_last_term(
        eta in 1.05..2.5_f64, theta in 0.1..1.5_f64, p in 0.1..=1.0_f64, psi in -3.0..3.0_f64, phi in -3.0..3.0_f64,
    ) {
        let f = facet(eta, theta, p, psi, phi);
        let printed = |po: f64| {
            let [s, q] = f.components();
            let (c2, s2) = ((2.0 * (po - phi)).cos(), (2.0 * (po - phi)).sin());
            let root = (f.reflectance.perpendicular * f.reflectance.parallel).sqrt();
            let delta = if theta < eta.atan() { -1.0 } else { 1.0 };
            0.5 * (s + q) + 0.5 * (s - q) * c2 - 0.5 * f.radiance * p * root * delta * (2.0 * psi).sin() * s2
        };
        let worst = phi + 0.25 * PI;
        let off = printed(worst) - f.stokes().through_polarizer(Radians(worst));
        let expected = -f.radiance * p * f.reflectance.rr_cos_delta * (2.0 * psi).sin();
        prop_assert!((off - expected).abs() < 1e-13, "{off} {expected}");
    }

    /// Malus: what a mirror at its Brewster angle leaves of any light is linear along φ and passes as cos².
    #[test]
    fn a_polarizer_passes_the_square_of_the_cosine(
        eta in 1.05..2.5_f64, p in 0.0..=1.0_f64, psi in -3.0..3.0_f64, phi in -3.0..3.0_f64, po in -3.0..3.0_f64,
    ) {
        let f = facet(eta, eta.atan(), p, psi, phi);
        let s0 = f.stokes().0[0];
        prop_assert!((f.radiance(Radians(po)) - s0 * (po - phi).cos().powi(2)).abs() < 1e-13, "at {po}");
    }

    #[test]
    fn eq_9_with_its_sign_corrected_is_the_mueller_product(
        eta in 1.0..2.5_f64, theta in 0.0..1.57_f64, p in 0.0..=1.0_f64, psi in -3.0..3.0_f64, phi in -3.0..3.0_f64,
        po in -3.0..3.0_f64,
    ) {
        let f = facet(eta, theta, p, psi, phi);
        let direct = f.stokes().through_polarizer(Radians(po));
        prop_assert!((f.radiance(Radians(po)) - direct).abs() < 1e-14);
        prop_assert!((Sinusoid::of(f.stokes()).at(Radians(po)) - direct).abs() < 1e-14);
        let [s, q] = f.components();
        prop_assert!((s + q - f.stokes().0[0]).abs() < 1e-14);
        // The phase is φ plus the stated error, wherever there is a phase.
        if f.stokes().dolp() > 1e-6 {
            let read = f.stokes().aolp();
            let told = Radians(f.phi.0 + f.azimuth_error().0);
            prop_assert!(read.axis_difference(told).0.abs() < 1e-8, "{read:?} {told:?}");
        }
    }

    #[test]
    fn the_special_cases_are_cases(
        eta in 1.05..2.5_f64, theta in 0.1..1.5_f64, p in 0.0..=1.0_f64, psi in -3.0..3.0_f64, phi in -3.0..3.0_f64,
    ) {
        let same = |a: Sinusoid, b: Sinusoid| (0..8_u32).all(|k| {
            let po = Radians(f64::from(k) * 0.4);
            (a.at(po) - b.at(po)).abs() < 1e-14
        });
        let f = facet(eta, theta, 0.0, psi, phi);
        prop_assert!(same(unpolarized(f.reflectance, f.radiance, f.phi), Sinusoid::of(f.stokes())));
        for (along, psi) in [(true, 0.0), (false, FRAC_PI_2)] {
            let f = facet(eta, theta, p, psi, phi);
            prop_assert!(same(aligned(f.reflectance, f.radiance, p, along, f.phi), Sinusoid::of(f.stokes())));
        }
        let f = facet(eta, eta.atan(), p, psi, phi);
        let special = brewster(f.reflectance.perpendicular, f.radiance, p, f.psi, f.phi);
        prop_assert!(same(special, Sinusoid::of(f.stokes())));
    }
}
