//! The sun's disk in surfaces smoother than the disk is wide.

use glam::DVec3;
use host_optics::frames::tangents;
use host_optics::integral::{View, discrete};
use host_optics::sky::{SunDisk, Uniform};
use host_optics::{Frame, Ggx, Incidence, Ior, Masking, Microfacet};
use host_sim::EffectSet;
use host_sim::optical::{Body, Evaluation, Pixel, PixelMap, Radiance, Renderer, SceneLight, Sun, Surface};

const RADIUS: f64 = SunDisk::SOLAR_RADIUS_RAD;
const RADIANCE: f64 = 1e4;

fn sun() -> DVec3 {
    DVec3::new(-0.64, 0.1, 0.76).normalize()
}

/// A horizontal surface and views whose mirrored rays pass the sun at these distances (radians) along a tangent.
fn picture(alpha: f64, distances: &[f64]) -> (Vec<DVec3>, Vec<[f32; 3]>) {
    let (_, across) = tangents(sun());
    let views: Vec<DVec3> = distances
        .iter()
        .map(|d| {
            let mirrored = sun() * d.cos() + across * d.sin();
            DVec3::new(-mirrored.x, -mirrored.y, mirrored.z)
        })
        .collect();
    let pixel = |wo: &DVec3| Pixel {
        normal: [0.0, 0.0, 1.0],
        to_camera: wo.as_vec3().to_array(),
        albedo: [0.0; 3],
        surface: 0,
    };
    let pixels: Vec<Pixel> = views.iter().map(pixel).collect();
    let sky = Radiance::Uniform(Uniform { radiance: 1.0 });
    let disk = Sun { direction: sun(), angular_radius_rad: RADIUS, radiance: [RADIANCE; 3] };
    let light = SceneLight { radiance: [sky.clone(), sky.clone(), sky], pattern: None, sun: Some(disk) };
    let ggx = Ggx::new(alpha, Masking::HeightCorrelated).unwrap();
    let surfaces = [Surface { ior: [Ior::new(1.5, 0.0).unwrap(); 3], ggx, body: Body::Lambert }];
    let evaluation = Evaluation::Prefiltered { tolerance: 1e-4 };
    let renderer = Renderer::new(&light, &surfaces, EffectSet::ALL, evaluation).unwrap();
    let map = PixelMap { width: pixels.len(), camera_x: DVec3::Y, pixels: &pixels };
    (views, renderer.render(&map).stokes.into_iter().map(|[r, ..]| r).collect())
}

/// Inside the disk a mirror shows its radiance, outside the sky's, each times the reflectance.
#[test]
fn a_mirror_shows_the_sun_as_a_disk() {
    let distances = [0.0, 0.5, 0.99, 1.01, 2.0, 30.0].map(|share| share * RADIUS);
    let (views, found) = picture(1e-6, &distances);
    for ((distance, wo), [s0, s1, s2]) in distances.iter().zip(views).zip(found) {
        let ior = Ior::new(1.5, 0.0).unwrap();
        let r = ior.reflectance(Incidence::between(DVec3::Z, wo));
        let light = if *distance < RADIUS { 1.0 + RADIANCE } else { 1.0 };
        let (mean, half) = (0.5 * (r.perpendicular + r.parallel), 0.5 * (r.perpendicular - r.parallel));
        assert!((f64::from(s0) / (mean * light) - 1.0).abs() < 1e-4, "{distance}: {s0}");
        assert!((f64::from(s1.hypot(s2)) / (half * light) - 1.0).abs() < 1e-4, "{distance}: {s1} {s2}");
    }
}

/// Against a sum over so many points of the disk that the lobe is wider than their distance.
#[test]
fn a_lobe_narrower_than_the_disk_is_integrated() {
    let distances = [0.0, 0.6, 0.95, 1.2, 4.0].map(|share| share * RADIUS);
    let (t, b) = tangents(sun());
    for alpha in [3e-4, 1.5e-3, 4.5e-3, 9e-3] {
        let rings = 500_u32;
        let disk: Vec<(DVec3, f64)> = (0..rings * rings)
            .map(|k| {
                let at = |j: u32| (f64::from(j) + 0.5) / f64::from(rings);
                let (r, (s, c)) = (RADIUS * at(k / rings), (core::f64::consts::TAU * at(k % rings)).sin_cos());
                let area = r.sin() * RADIUS / f64::from(rings) * core::f64::consts::TAU / f64::from(rings);
                (sun() * r.cos() + (t * c + b * s) * r.sin(), area)
            })
            .collect();
        let (views, found) = picture(alpha, &distances);
        let ggx = Ggx::new(alpha, Masking::HeightCorrelated).unwrap();
        let surface = Microfacet { ior: Ior::new(1.5, 0.0).unwrap(), ggx };
        for ((distance, wo), found) in distances.iter().zip(views).zip(found) {
            let view = View { direction: wo, frame: Frame::camera(wo, DVec3::Y).unwrap() };
            let expected = discrete(&Uniform { radiance: RADIANCE }, &disk, &surface, DVec3::Z, &view);
            // The sky adds one ten thousandth of the disk times its own reflectance.
            let sky = 0.2;
            for (a, e) in found.iter().zip(expected) {
                let error = (f64::from(*a) - e).abs();
                assert!(error < 5e-3 * expected[0] + sky, "alpha {alpha}, {distance}: {found:?} against {expected:?}");
            }
        }
    }
}
