//! Eq. 6: the mirror limit, the white furnace, symmetry, smoothness, darkness, and light with edges.

use crate::above;
use core::f64::consts::PI;
use glam::{DQuat, DVec3};
use host_optics::integral::{Adaptive, FixedPoints, View, discrete, lambert, mirror, polarized_diffuse};
use host_optics::sky::{ClearSky, Polarized, Rayleigh, SunDisk, Uniform};
use host_optics::{
    Conductor, Dielectric, Ggx, Incidence, Ior, Light, Masking, Microfacet, OpticsError, PolarizedDiffuse,
};
use proptest::prelude::*;

fn glass(alpha: f64) -> Microfacet {
    Microfacet { ior: Ior::new(1.5, 0.0).unwrap(), ggx: Ggx::new(alpha, Masking::default()).unwrap() }
}

fn sky(sun: DVec3) -> Polarized<ClearSky, Rayleigh> {
    let sun = sun.normalize();
    Polarized {
        light: ClearSky { base: 1.0, horizon: 0.5, aureole: 2.0, width: 0.25, sun },
        pattern: Rayleigh::new(sun, 0.8).unwrap(),
    }
}

fn view(theta: f64, roll: f64) -> View {
    let wo = DVec3::new(theta.sin(), 0.0, theta.cos());
    let x = DVec3::Y * roll.cos() + DVec3::new(-theta.cos(), 0.0, theta.sin()) * roll.sin();
    View::new(wo, x).unwrap()
}

#[test]
fn roughness_to_zero_is_the_mirror() {
    let light = sky(DVec3::new(0.3, 0.8, 0.4));
    for theta in [0.0, 0.5, 0.98, 1.3] {
        let view = view(theta, 0.3);
        let limit = mirror(&light, glass(1e-5).ior, DVec3::Z, &view);
        let mut last = f64::INFINITY;
        for alpha in [1e-3, 1e-4, 1e-5, 1e-6] {
            let rough = FixedPoints::new(16).specular(&light, &glass(alpha), DVec3::Z, &view);
            let miss = (0..3).map(|k| (rough[k] - limit[k]).abs() / limit[0]).fold(0.0, f64::max);
            // The tail of facets that face an oblique view is first order in α.
            assert!(miss < 2.0 * alpha && miss < last, "theta {theta}, alpha {alpha}: {miss}");
            last = miss;
        }
    }
}

#[test]
fn a_white_furnace_returns_no_more_than_it_gets() {
    // n = 0.05, k = 1000: R > 0.9999 at every angle.
    let silver = Ior::from(Conductor::new(0.05, 1000.0).unwrap());
    let furnace = Uniform { radiance: 1.0 };
    for masking in [Masking::HeightCorrelated, Masking::Separable] {
        for alpha in [1e-4, 0.02, 0.1, 0.3, 1.0] {
            for theta in [0.0, 0.5, 1.0, 1.4, 1.55] {
                let surface = Microfacet { ior: silver, ggx: Ggx::new(alpha, masking).unwrap() };
                let [s0, ..] = FixedPoints::new(32).specular(&furnace, &surface, DVec3::Z, &view(theta, 0.0));
                assert!(s0 < 1.0 && s0 > 0.2, "{masking:?} alpha {alpha} theta {theta}: {s0}");
                if alpha < 0.03 && theta < 1.1 {
                    assert!(s0 > 0.98, "smooth metal gives back what it gets: {s0}");
                }
            }
        }
    }
}

#[test]
fn a_uniform_sky_shows_the_fresnel_reflectance_and_its_polarization() {
    // Specular DoLP at Brewster .991 / .906 / .669 at α .02 / .1 / .3.
    let theta = 1.5_f64.atan();
    for (alpha, expected) in [(0.02, 0.991), (0.1, 0.906), (0.3, 0.669)] {
        let rule = Adaptive::new(1e-9);
        let [s0, s1, s2] = rule.specular(&Uniform { radiance: 1.0 }, &glass(alpha), DVec3::Z, &view(theta, 0.0)).value;
        assert!((s1.hypot(s2) / s0 - expected).abs() < 1.5e-3, "alpha {alpha}: {}", s1.hypot(s2) / s0);
        // x of the view is the s axis: light is polarized along it, by symmetry exactly.
        assert!(s1 > 0.0 && s2.abs() < 1e-9 * s0);
    }
}

#[test]
fn lambert_and_polarized_diffuse_are_lit_by_the_sky() {
    let furnace = Uniform { radiance: 1.0 };
    let rule = FixedPoints::new(16);
    let [s0, s1, s2] = lambert(0.5, rule.irradiance(&furnace, DVec3::Z));
    assert!((s0 - 0.5).abs() < 1e-12 && s1.abs() + s2.abs() <= 0.0);
    let ior = Dielectric::new(1.5).unwrap();
    let body = PolarizedDiffuse { ior, albedo: 0.5 };
    let inside = rule.transmitted_irradiance(&furnace, ior, DVec3::Z);
    // Hemispherical reflectance of n = 1.5 is 0.0918 (Duntley 1942, closed form).
    assert!((1.0 - inside / PI - 0.0918).abs() < 1e-4, "{}", 1.0 - inside / PI);
    let [s0, s1, s2] = polarized_diffuse(&body, DVec3::Z, &view(1.5_f64.atan(), 0.0), inside);
    // Opposite in sign to the specular part, DoLP .0799.
    assert!((s1 / s0 + 0.0799).abs() < 1e-4 && s2.abs() < 1e-15);
}

#[test]
fn what_faces_away_is_dark() {
    let light = sky(DVec3::X + DVec3::Z);
    let away = DVec3::new(-1.0, 0.0, 0.2).normalize();
    let view = view(1.2, 0.0);
    assert!(away.dot(view.direction) < 0.0);
    let zero = |s: [f64; 3]| s.iter().all(|x| x.abs() <= 0.0);
    assert!(zero(mirror(&light, glass(0.1).ior, away, &view)));
    assert!(zero(FixedPoints::new(4).specular(&light, &glass(0.1), away, &view)));
    assert!(zero(Adaptive::default().specular(&light, &glass(0.1), away, &view).value));
    let set = SunDisk::new(DVec3::new(0.9, 0.0, -0.1), 0.01, 1e4).unwrap();
    assert!(zero(discrete(&set, &set.points(), &glass(0.3), DVec3::Z, &view)), "the sun has set");
    // A facet tilted away so far that it mirrors the ground: dark as a mirror, lit by its lobe.
    let steep = DVec3::new(0.9, 0.0, -0.1).normalize();
    assert!(zero(mirror(&light, glass(0.1).ior, steep, &view)));
    assert!(FixedPoints::new(8).specular(&light, &glass(0.3), steep, &view)[0] > 0.0);
    assert!(matches!(View::new(DVec3::X, DVec3::X), Err(OpticsError::AxisAlongRay)));
    assert!(matches!(View::new(DVec3::ZERO, DVec3::X), Err(OpticsError::Direction { .. })));
}

#[test]
fn a_view_along_the_surface_is_the_grazing_limit() {
    // Everything reflects fully at grazing incidence, whatever the index; the far horizon is what is seen.
    for grazing in [1e-9, 1e-100, 1e-300] {
        let view = View::new(DVec3::new(1.0, 0.0, grazing), DVec3::Y).unwrap();
        let furnace = Uniform { radiance: 1.0 };
        let [by_points, by_bisection] = [
            FixedPoints::new(32).specular(&furnace, &glass(0.01), DVec3::Z, &view),
            Adaptive::new(1e-9).specular(&furnace, &glass(0.01), DVec3::Z, &view).value,
        ];
        assert!(
            (by_points[0] - by_bisection[0]).abs() < 1e-2 && by_bisection[0] > 0.5,
            "{by_points:?} {by_bisection:?}"
        );
        assert!(by_bisection[0] <= 1.0);
    }
}

/// The disk's own points against the lobe's, for a lobe that is wide or narrow against it.
#[test]
fn the_sun_disk_is_seen_through_the_lobe() {
    let view = view(0.9, 0.2);
    let wi = DVec3::new(-0.9_f64.sin(), 0.02, 0.9_f64.cos()).normalize();
    let surface = glass(0.1);
    let sun = SunDisk::new(wi, 0.02, 50.0).unwrap();
    let by_disk = discrete(&sun, &sun.points(), &surface, DVec3::Z, &view);
    // Bisection has to find the edge; it ends, and its error says how far it came.
    let found = Adaptive::new(1e-4).specular(&sun, &surface, DVec3::Z, &view);
    assert!((found.value[0] - by_disk[0]).abs() < 2e-3 * by_disk[0] + found.error, "{found:?} {by_disk:?}");
    let by_lobe = FixedPoints::new(256).specular(&sun, &surface, DVec3::Z, &view);
    for k in 0..3 {
        assert!((by_disk[k] - by_lobe[k]).abs() < 5e-3 * by_disk[0], "{by_disk:?} {by_lobe:?}");
    }
}

/// A third method: visible normals sampled through the stretched cap, no slope space, no ends of rays.
#[test]
fn sampling_visible_normals_gives_the_same_integral() {
    let light = sky(DVec3::new(0.3, 0.8, 0.4));
    for (alpha, theta) in [(0.05, 0.4), (0.3, 0.98), (0.8, 1.3)] {
        let (surface, view) = (glass(alpha), view(theta, 0.7));
        let exact = Adaptive::new(1e-10).specular(&light, &surface, DVec3::Z, &view);
        let o = Incidence::between(DVec3::Z, view.direction);
        let mut sum = [0.0; 3];
        let count = 200_000_u32;
        for k in 0..count {
            // A golden-ratio lattice.
            let u = [(f64::from(k) * 0.618_033_988_749_894_9).fract(), (f64::from(k) + 0.5) / f64::from(count)];
            let h = surface.ggx.sample_visible(view.direction, u);
            let wi = h * (2.0 * view.direction.dot(h)) - view.direction;
            if wi.z > 0.0 {
                let weight = surface.ggx.visible_weight(Incidence::between(DVec3::Z, wi), o);
                let reflection = host_optics::Reflection::at_facet(
                    surface.ior,
                    wi,
                    &host_optics::Frame::sky(wi),
                    view.direction,
                    &view.frame,
                );
                for (s, x) in sum.iter_mut().zip(reflection.apply(light.stokes(wi))) {
                    *s += weight * x / f64::from(count);
                }
            }
        }
        for k in 0..3 {
            assert!((sum[k] - exact.value[k]).abs() < 1e-4 * exact.value[0], "{alpha} {theta}: {sum:?} {exact:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn reflected_light_is_physical_and_finite(
        wo in above(), n in above(), sun in above(), alpha in crate::roughness(), ior in crate::index(),
    ) {
        let surface = Microfacet { ior, ggx: Ggx::new(alpha, Masking::default()).unwrap() };
        let light = sky(sun);
        let view = View::new(wo, wo.any_orthonormal_vector()).unwrap();
        for [l, q, u] in
            [FixedPoints::new(6).specular(&light, &surface, n, &view), mirror(&light, ior, n, &view)]
        {
            // The brightest this sky gets is 1 + .5 + 2.
            prop_assert!((0.0..4.5).contains(&l) && q.hypot(u) <= l * (1.0 + 1e-12) + 1e-300, "{l} {q} {u}");
        }
    }

    /// Turning everything about the zenith turns nothing in the picture.
    #[test]
    fn the_compass_does_not_matter(theta in 0.0..1.4_f64, angle in -3.0..3.0_f64, tilt in -0.3..0.3_f64, alpha in 0.05..0.5_f64) {
        let turn = DQuat::from_rotation_z(angle);
        let sun = DVec3::new(0.5, -0.4, 0.6);
        let n = DVec3::new(tilt, 0.1, 1.0).normalize();
        let there = view(theta, 0.5);
        let turned = View::new(turn * there.direction, turn * there.frame.x).unwrap();
        // The points do not turn along: what remains is the error of the rule.
        let rule = Adaptive::new(1e-9);
        let a = rule.specular(&sky(sun), &glass(alpha), n, &there).value;
        let b = rule.specular(&sky(turn * sun), &glass(alpha), turn * n, &turned).value;
        for k in 0..3 {
            prop_assert!((a[k] - b[k]).abs() <= 1e-9 * a[0], "{a:?} {b:?}");
        }
    }

    /// What a fit differentiates: no jumps in α, index, normal or view, with horizons inside the lobe. (Mirror directions below
    /// the world horizon are out of these ranges: there azimuths enter the sky with a square root.)
    #[test]
    fn the_result_is_smooth_in_every_parameter(theta in 0.3..1.2_f64, tilt in -0.15..0.5_f64, alpha in 0.1..0.6_f64) {
        let rule = FixedPoints::new(6);
        let light = sky(DVec3::new(0.5, -0.4, 0.6));
        let at = |x: f64| {
            let n = DVec3::new(tilt + x, 0.1 - x, 1.0).normalize();
            let surface = Microfacet {
                ior: Ior::new(1.5 + x, 0.0).unwrap(),
                ggx: Ggx::new(alpha + x, Masking::default()).unwrap(),
            };
            rule.specular(&light, &surface, n, &view(theta + x, 0.5))
        };
        let h = 1e-5;
        let (a, b, c) = (at(-h), at(0.0), at(h));
        for k in 0..3 {
            // One of 72 points crossing a horizon would show as 1e-3; an azimuth whose end changes horizon bends the
            // slope, which is of order h.
            prop_assert!((a[k] - 2.0 * b[k] + c[k]).abs() < 2e-5 * b[0].max(1e-3), "{a:?} {b:?} {c:?}");
        }
    }
}
