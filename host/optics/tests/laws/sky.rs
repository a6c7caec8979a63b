//! Skies: frames at the pole, neutral points, symmetric patterns, maps and their poles, irradiance in closed form.

use crate::above;
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use host_optics::frames::{axis_angle, transport};
use host_optics::integral::FixedPoints;
use host_optics::sky::{Berry, MoonSpencer, Pattern, Polarized, Rayleigh, StokesMap, SunDisk, Uniform};
use host_optics::{Frame, Light, OpticsError};
use proptest::prelude::*;
use protocol_polar::Degrees;

fn elevated(degrees: f64, azimuth: f64) -> DVec3 {
    let (s, c) = Degrees(degrees).to_radians().0.sin_cos();
    DVec3::new(c * azimuth.cos(), c * azimuth.sin(), s)
}

fn dolp([q, u]: [f64; 2]) -> f64 {
    q.hypot(u)
}

#[test]
fn the_sky_frame_at_the_pole_is_its_limit_along_x() {
    let pole = Frame::sky(DVec3::Z);
    assert!(pole.x == DVec3::NEG_Y && Frame::sky(DVec3::NEG_Z).x == DVec3::NEG_Y);
    let near = Frame::sky(DVec3::new(1e-9, 0.0, 1.0).normalize());
    assert!((near.x - pole.x).length() < 1e-15 && (near.y - pole.y).length() < 1e-8);
}

#[test]
fn the_horizon_across_from_the_sun_is_polarized_horizontally_or_not_by_geometry() {
    // Sun at the zenith: every direction on the horizon is at 90°, polarized fully and horizontally (along x).
    let rayleigh = Rayleigh::new(DVec3::Z, 0.8).unwrap();
    for azimuth in [0.0, 1.0, 4.0] {
        let [q, u] = rayleigh.fraction(elevated(0.0, azimuth));
        assert!((q - 0.8).abs() < 1e-14 && u.abs() < 1e-14);
    }
    // Sun on the horizon: the zenith is polarized across it.
    let [q, u] = Rayleigh::new(DVec3::X, 0.8).unwrap().fraction(DVec3::Z);
    let frame = Frame::sky(DVec3::Z);
    let axis = 0.5 * u.atan2(q);
    let direction = frame.x * axis.cos() + frame.y * axis.sin();
    assert!(direction.dot(DVec3::X).abs() < 1e-15 && (dolp([q, u]) - 0.8).abs() < 1e-15);
    assert!(axis_angle(&frame, direction).axis_difference(protocol_polar::Radians(axis)).0.abs() < 1e-15);
}

#[test]
fn neutral_points_lie_half_the_splitting_from_sun_and_antisun() {
    for elevation in [5.0, 30.0, 60.0] {
        let berry = Berry::new(elevated(elevation, 0.7), 24.0, 1.0).unwrap();
        // Babinet and Brewster about the sun; Arago and the fourth about the antisun, where the angle is 180° away.
        for offset in [12.0, -12.0, 168.0, -168.0] {
            assert!(dolp(berry.fraction(elevated(elevation + offset, 0.7))) < 1e-15, "{elevation} {offset}");
        }
        assert!(dolp(berry.fraction(elevated(elevation, 0.7))) > 0.01, "the sun itself is no neutral point");
        // Across from the sun |W| = cos²(splitting/2).
        let w = 12.0_f64.to_radians().cos().powi(2);
        assert!((dolp(berry.fraction(elevated(elevation + 90.0, 0.7))) - w / (2.0 - w)).abs() < 1e-14);
    }
}

#[test]
fn parameters_outside_their_range_are_refused_with_their_value() {
    assert!(matches!(Rayleigh::new(DVec3::ZERO, 0.8), Err(OpticsError::Direction { .. })));
    assert!(matches!(Rayleigh::new(DVec3::Z, 1.2), Err(OpticsError::Range { value, .. }) if value > 1.1));
    assert!(matches!(Berry::new(DVec3::Z, 200.0, 1.0), Err(OpticsError::Range { .. })));
    assert!(matches!(SunDisk::new(DVec3::Z, 0.0, 1.0), Err(OpticsError::Range { .. })));
    let bad = StokesMap::new(4, 2, vec![[1.0, 0.0, 0.0]; 7]);
    assert!(matches!(bad, Err(OpticsError::MapSize { expected: 8, found: 7, .. })));
    assert!(StokesMap::new(3, 2, vec![[1.0, 0.0, 0.0]; 6]).is_err(), "an odd width has no pixel across the pole");
    assert!(StokesMap::from_rgb(0, 0, &[]).is_err());
}

#[test]
fn irradiance_has_its_closed_forms() {
    let rule = FixedPoints::new(16);
    assert!((rule.irradiance(&Uniform { radiance: 2.0 }, DVec3::Z) - 2.0 * PI).abs() < 1e-12);
    assert!((rule.irradiance(&MoonSpencer { zenith: 9.0 }, DVec3::Z) - 7.0 * PI).abs() < 1e-12);
    // A plane tilted by β sees the part π (1 + cos β)/2 of a uniform sky.
    for degrees in [10.0, 45.0, 80.0_f64] {
        let normal = elevated(90.0 - degrees, 0.4);
        let expected = PI * 0.5 * (1.0 + degrees.to_radians().cos());
        let found = FixedPoints::new(32).irradiance(&Uniform { radiance: 1.0 }, normal);
        assert!((found - expected).abs() < 1e-3, "{degrees}: {found} against {expected}");
    }
    let sun = SunDisk::new(elevated(40.0, 1.0), SunDisk::SOLAR_RADIUS_RAD, 3.0).unwrap();
    let (mut area, mut irradiance) = (0.0, 0.0);
    for (w, weight) in sun.points() {
        area += weight;
        irradiance += weight * sun.stokes(w)[0] * w.z;
    }
    assert!((area / sun.solid_angle() - 1.0).abs() < 1e-13);
    assert!((irradiance / sun.irradiance(DVec3::Z) - 1.0).abs() < 1e-13, "every point lies on the disk");
    assert!((sun.solid_angle() - 6.8e-5).abs() < 1e-6);
}

#[test]
fn a_map_keeps_its_layout() {
    // One lit pixel: row 1 (of 4) and column 2 (of 8).
    let mut rgb = vec![0.0_f32; 8 * 4 * 3];
    rgb[3 * (8 + 2) + 1] = 5.0;
    let [red, green, _] = StokesMap::from_rgb(8, 4, &rgb).unwrap();
    let (theta, azimuth) = (1.5 * PI / 4.0, 2.5 * 2.0 * PI / 8.0);
    let lit = DVec3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos());
    assert!((green.stokes(lit)[0] - 5.0).abs() < 1e-12 && red.stokes(lit)[0].abs() < 1e-300);
    assert!((green.center(1, 2) - lit).length() < 1e-15);
    assert!(green.stokes(-lit)[0].abs() < 1e-300);
    // It wraps: a lit last column is seen half from the seam at azimuth 0.
    let mut seam = vec![[0.0_f32; 3]; 8];
    seam[7] = [1.0, 0.0, 0.0];
    let seam = StokesMap::new(8, 1, seam).unwrap();
    assert!((seam.stokes(DVec3::X)[0] - 0.5).abs() < 1e-12);
}

#[test]
fn a_map_of_a_formula_is_the_formula_at_the_zenith_too() {
    let sun = elevated(30.0, 0.3);
    let sky = Polarized { light: Uniform { radiance: 1.0 }, pattern: Rayleigh::new(sun, 0.8).unwrap() };
    let map = StokesMap::sample(256, 128, &sky).unwrap();
    assert_eq!(map.size(), (256, 128));
    let step = PI / 128.0;
    let mut worst: f64 = 0.0;
    for k in 0..400_u32 {
        // Spiral over the zenith and down; inside the first row the naive mix would lose most of the polarization.
        let w = elevated(90.0 - 0.1 * f64::from(k), 2.4 * f64::from(k));
        for (a, b) in sky.stokes(w).iter().zip(map.stokes(w)) {
            worst = worst.max((a - b).abs());
        }
    }
    // Bilinear: at most step²/8 of each second derivative, which are below 8 for this pattern, in two directions.
    assert!(worst < 2.0 * step * step, "{worst} with a step of {step}");
    let rule = FixedPoints::new(32).irradiance(&sky, DVec3::Z);
    assert!((map.irradiance(DVec3::Z) - PI).abs() < 1e-4 && (rule - PI).abs() < 1e-12);
    let tilted = elevated(60.0, 1.0);
    let expected = PI * 0.5 * (1.0 + 30.0_f64.to_radians().cos());
    assert!((map.irradiance(tilted) - expected).abs() < 1e-3, "{}", map.irradiance(tilted));
}

proptest! {
    #[test]
    fn berry_without_splitting_is_rayleigh(sun in above(), w in above()) {
        let [a, b] = [Berry::new(sun, 1e-3, 0.7).unwrap().fraction(w), Rayleigh::new(sun, 0.7).unwrap().fraction(w)];
        // A = tan(split/4) = 4.4e-6: the difference is of order A near the sun.
        prop_assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-5, "{a:?} {b:?}");
    }

    #[test]
    fn patterns_stay_physical_everywhere(sun in above(), w in above(), down in any::<bool>(), split in 1.0..90.0_f64) {
        let w = if down { -w } else { w };
        for f in [Berry::new(sun, split, 1.0).unwrap().fraction(w), Rayleigh::new(sun, 1.0).unwrap().fraction(w)] {
            prop_assert!(dolp(f) <= 1.0 + 1e-14, "{f:?}");
        }
    }

    /// Turning sun and direction together about the zenith changes nothing: the sky frame turns along.
    #[test]
    fn the_sky_turns_with_its_sun(
        sun in (0.0..89.9_f64, 0.0..6.3_f64), w in (-89.9..89.9_f64, 0.0..6.3_f64), angle in -3.0..3.0_f64,
    ) {
        let [sun, w] = [sun, w].map(|(elevation, azimuth)| elevated(elevation, azimuth));
        let turn = DQuat::from_rotation_z(angle);
        let [a, b] = [sun, turn * sun].map(|s| Berry::new(s, 24.0, 0.8).unwrap());
        let ([q, u], [r, v]) = (a.fraction(w), b.fraction((turn * w).normalize()));
        prop_assert!((q - r).hypot(u - v) < 1e-11);
    }

    #[test]
    fn transport_keeps_lengths_and_tangency(a in above(), b in above(), angle in -3.0..3.0_f64) {
        let x = a.any_orthonormal_vector();
        let v = x * angle.cos() + a.cross(x) * angle.sin();
        let carried = transport(v, a, b);
        prop_assert!((carried.length() - 1.0).abs() < 1e-9 && carried.dot(b).abs() < 1e-9);
        let back = transport(carried, b, a);
        prop_assert!((back - v).length() < 1e-9);
    }

    #[test]
    fn a_look_up_is_physical(w in above(), seed in 0_u32..1000) {
        let pixels = (0..16 * 8_u32).map(|k| {
            let angle = f64::from(k * 7919 + seed);
            let (s, c) = angle.sin_cos();
            #[expect(clippy::cast_possible_truncation, reason = "test data")]
            { [1.0, 0.999 * c as f32, 0.999 * s as f32] }
        }).collect();
        let [l, q, u] = StokesMap::new(16, 8, pixels).unwrap().stokes(w);
        prop_assert!((l - 1.0).abs() < 1e-12 && q.hypot(u) <= l);
    }
}
