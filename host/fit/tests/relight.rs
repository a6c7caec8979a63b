//! Maps under another light against the simulator's picture of the same scene, and against geometry.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking, as tests do")]

use std::path::Path;

use glam::{DVec2, DVec3};
use host_fit::forward::Body;
use host_fit::maps::{Grid, MaterialMaps, Plane, PlaneRect};
use host_fit::relight::{Exposure, RelightError, RelightOptions, Relit, Sight, Sky, Sun, display, frame, relight};
use host_fit::session::{BandLight, Camera, LightSpec, Polarization, Radiance, homography};
use host_image::Samples;
use host_optics::sky::SunDisk;
use host_sim::scene::{SkyPattern, SkyRadiance};
use host_sim::{Scene, simulate};

/// Gently waving stone in four fields, 0.6 m, from the south.
fn scene(light: &str) -> Scene {
    let text = format!(
        r#"
schema = 1
name = "fields"
seed = 3
[sample]
side_m = 0.6
[sample.checker]
columns = 2
rows = 2
surfaces = ["rough", "smooth"]
[surface.rough]
eta = 1.6
albedo = [0.3, 0.25, 0.2]
alpha = 0.3
bumps = {{ amplitude_deg = 4.0, wavelength_mm = 250.0 }}
[surface.smooth]
eta = 1.45
albedo = [0.1, 0.2, 0.3]
alpha = 0.12
bumps = {{ amplitude_deg = 3.0, wavelength_mm = 300.0 }}
[[view]]
theta_deg = 50.0
phi_deg = -80.0
distance_m = 1.8
focal_length_mm = 12.0
{light}
[camera]
width_px = 64
height_px = 48
pixel_pitch_um = 75.0
bit_depth = 12
black_level_dn = 100
full_well_e = 10000.0
gain_e_per_dn = 2.5
response_e_per_ms = [1000.0, 1000.0, 1000.0]
[polarizer]
extinction_ratio = 1000.0
transmission = 0.4
[wheel]
approach = "one-sided"
slew_deg_per_s = 300.0
settle_ms = 80.0
[plan]
angles_deg = [0.0, 60.0, 120.0]
fill = 0.8
"#
    );
    Scene::parse(&text, Path::new("fields.toml")).unwrap_or_else(|e| panic!("{e}"))
}

const SKY: &str = r"
[light.clear]
base_radiance = [0.6, 0.8, 1.1]
horizon_radiance = [0.5, 0.5, 0.5]
aureole_radiance = [2.0, 1.8, 1.5]
aureole_width_deg = 20.0
[light.sun]
azimuth_deg = 120.0
elevation_deg = 40.0
[light.rayleigh]
max_dolp = 0.7
";

/// The true material on a grid over the sample.
fn truth(scene: &Scene, samples: usize) -> MaterialMaps {
    let half = 0.5 * scene.sample.side_m;
    let plane = PlaneRect { left: -half, right: half, bottom: -half, top: half };
    let mut maps = MaterialMaps::new(Grid::new(samples, samples, plane).unwrap(), false);
    for i in 0..samples * samples {
        let point = scene.sample.at(DVec2::from(maps.grid.position(i % samples, i / samples))).unwrap();
        let host_optics::Ior::Dielectric(ior) = point.ior[0] else { panic!("a dielectric") };
        let ([r, g, b], n) = (point.albedo, point.normal);
        let values = [r, g, b, ior.eta(), point.alpha, n.x, n.y, n.z];
        for (plane, value) in Plane::ALL.into_iter().zip(values) {
            maps.plane_mut(plane)[i] = single(value);
        }
    }
    maps
}

#[expect(clippy::cast_possible_truncation, reason = "maps are f32")]
fn single(value: f64) -> f32 {
    value as f32
}

/// The scene's light in the words of a session.
fn light(scene: &Scene) -> LightSpec {
    let bands = scene.light.bands.clone().map(|band| {
        let SkyRadiance::Clear(sky) = band.radiance else { panic!("a clear sky") };
        let Some(SkyPattern::Rayleigh(pattern)) = band.polarization else { panic!("a polarized sky") };
        BandLight { radiance: Radiance::Clear(sky), polarization: Some(Polarization::Rayleigh(pattern)) }
    });
    let disk = |d: &host_sim::optical::Sun| (SunDisk::new(d.direction, d.angular_radius_rad, 1.0).unwrap(), d.radiance);
    LightSpec { bands, sun: scene.light.disk.as_ref().map(disk), photograph_sigma: None }
}

/// The scene's first camera.
fn camera(scene: &Scene) -> Camera {
    let view = &scene.views[0];
    let (rotation, translation) = view.world_to_camera();
    Camera::new([view.width, view.height], view.intrinsics(), rotation, translation).unwrap()
}

/// Differences of s0, s1 and s2 relative to s0 where neither picture has an edge between fields or of the sample, sorted.
fn differences(relit: &Relit, image: &host_image::StokesImage, surfaces: &[f32], mask: &[f32]) -> Vec<f64> {
    let width = image.width;
    let inner = |i: &usize| {
        let (column, row) = (i % width, i / width);
        let edge = column == 0 || row == 0 || column + 1 == width || row + 1 == image.height;
        !edge && [i - 1, i + 1, i - width, i + width].iter().all(|k| mask[*k] > 0.0 && same(surfaces[*k], surfaces[*i]))
    };
    let mut out: Vec<f64> = (0..mask.len())
        .filter(inner)
        .flat_map(|i| {
            assert_eq!(relit.sight[i], Sight::Material);
            relit.image.colors.iter().zip(&image.colors).flat_map(move |(a, b)| {
                let off = |x: &[f32], y: &[f32]| f64::from((x[i] - y[i]).abs() / b.s0[i]);
                [off(&a.s0, &b.s0), off(&a.s1, &b.s1), off(&a.s2, &b.s2)]
            })
        })
        .collect();
    out.sort_by(f64::total_cmp);
    out
}

fn same(a: f32, b: f32) -> bool {
    (a - b).abs() < 0.5
}

/// Two programs of different construction see the same: the simulator integrates eq. 6 pixel by pixel, here maps are looked
/// up through a homography and a table.
#[test]
fn true_maps_look_like_the_simulated_scene() {
    let scene = scene(&format!("{SKY}[light.sun_disk]\nradiance = [30000.0, 28000.0, 25000.0]\n"));
    let simulated = simulate(&scene, 0, 5e-4, false).unwrap();
    let options = RelightOptions { body: Body::Interface, rays: 1, ..RelightOptions::default() };
    let relit = relight(&truth(&scene, 300), &camera(&scene), &light(&scene), &options).unwrap();
    let errors = differences(&relit, &simulated.image, &simulated.truth.surface, &simulated.truth.mask);
    let at = |share: usize| errors[(errors.len() - 1) * share / 100];
    println!("median {:.1e}, 95 % {:.1e}, worst {:.1e}; {:?}", at(50), at(95), at(100), relit.table);
    assert!(errors.len() > 5000, "{}", errors.len());
    assert!(at(50) < 5e-4 && at(95) < 1e-3 && at(100) < 3e-3, "{} {} {}", at(50), at(95), at(100));
}

/// A plane of one material.
fn uniform(alpha: f64) -> MaterialMaps {
    let plane = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };
    let mut maps = MaterialMaps::new(Grid::new(20, 20, plane).unwrap(), false);
    for (plane, value) in Plane::ALL.into_iter().zip([0.0, 0.0, 0.0, 1.5, alpha, 0.0, 0.0, 1.0]) {
        maps.plane_mut(plane).fill(single(value));
    }
    maps
}

fn brightest(relit: &Relit) -> [usize; 2] {
    let s0 = &relit.image.colors[1].s0;
    let at = (0..s0.len()).max_by(|a, b| s0[*a].total_cmp(&s0[*b])).unwrap();
    [at % relit.image.width, at / relit.image.width]
}

/// In a mirror the sun stands where the ray from the camera's mirror image to the sun meets the plane, and at Brewster's
/// angle it is polarized across the plane of incidence.
#[test]
fn the_sun_shines_where_the_mirror_says() {
    for (azimuth_deg, elevation_deg) in [(92.0, 34.0), (88.0, 33.0), (90.0, 90.0 - 1.5_f64.atan().to_degrees())] {
        let plane = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };
        let camera = frame(&plane, 56.0, -90.0, Some(5.0), 200).unwrap();
        let sun = Sun { azimuth_deg, elevation_deg, irradiance: None };
        let light = Sky::Black.light(Some(sun), None).unwrap();
        let relit = relight(&uniform(0.02), &camera, &light, &RelightOptions::default()).unwrap();
        let ((sa, ca), (se, ce)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
        let to_sun = DVec3::new(ce * ca, ce * sa, se);
        let mirrored = camera.position() * DVec3::new(1.0, 1.0, -1.0);
        let point = mirrored + to_sun * (-mirrored.z / to_sun.z);
        let expected = homography::project(&camera.plane_to_pixel(), point.truncate()).unwrap();
        let [x, y] = brightest(&relit).map(|n| n as f64 + 0.5);
        // Masking and Fresnel terms pull the peak of a lobe of 1° by less than this.
        assert!((DVec2::new(x, y) - expected).length() < 1.5, "({x}, {y}) against {expected}");
        let i = brightest(&relit)[1] * relit.image.width + brightest(&relit)[0];
        let green = &relit.image.colors[1];
        assert!(green.s1[i] > 0.97 * green.s0[i] && green.s2[i].abs() < 0.1 * green.s0[i], "s-polarized: horizontal");
    }
}

/// Lambert under a uniform sky is ρ_d L, straight from the definition; specular light is what is left of it.
#[test]
fn a_sun_on_a_matte_plane_is_its_irradiance_over_pi() {
    let mut maps = uniform(0.5);
    for (plane, albedo) in [(Plane::AlbedoR, 0.2), (Plane::AlbedoG, 0.4), (Plane::AlbedoB, 0.6)] {
        maps.plane_mut(plane).fill(albedo);
    }
    // The index of nothing: no specular light.
    maps.plane_mut(Plane::Eta).fill(1.0);
    let camera = frame(&maps.grid.plane, 20.0, 10.0, None, 40).unwrap();
    let sun = Sun { azimuth_deg: 30.0, elevation_deg: 50.0, irradiance: Some(2.0) };
    let light = Sky::Black.light(Some(sun), None).unwrap();
    let relit = relight(&maps, &camera, &light, &RelightOptions::default()).unwrap();
    let middle = relit.sight.len() / 2 + 20;
    let mean: f64 =
        relit.image.colors.iter().map(|c| f64::from(c.s0[middle])).zip([0.2, 0.4, 0.6]).map(|(s, a)| s / a).sum();
    let expected = 2.0 * 50_f64.to_radians().sin() / std::f64::consts::PI;
    assert!((mean / 3.0 / expected - 1.0).abs() < 1e-5, "{mean} {expected}");
}

#[test]
fn samples_without_an_answer_are_counted_and_shown_as_such() {
    let mut maps = uniform(0.3);
    maps.plane_mut(Plane::Eta)[..100].fill(f32::NAN);
    // A metal, whose index the maps do not hold.
    maps.plane_mut(Plane::Eta)[100..200].fill(-1.0);
    let light = Sky::Uniform(1.0).light(None, None).unwrap();
    let camera = frame(&maps.grid.plane, 0.0, -90.0, None, 100).unwrap();
    let relit = relight(&maps, &camera, &light, &RelightOptions::default()).unwrap();
    let [seen, unanswered, beyond] = [Sight::Material, Sight::Unanswered, Sight::Beyond].map(|s| relit.count(s));
    assert!(seen.abs_diff(unanswered) <= 200 && seen + unanswered + beyond == relit.sight.len(), "{seen} {unanswered}");
    assert!(beyond > 0);
    let (picture, white) = display(&relit, Exposure::Auto { stops: 0.0 }).unwrap();
    assert!(white > 0.0);
    let Samples::U8(rgb) = picture.samples else { panic!("8 bit") };
    let upper = 3 * (20 * relit.image.width + 50);
    let lower = 3 * (80 * relit.image.width + 50);
    assert!(rgb[upper] > rgb[upper + 1] && rgb[upper + 2] > rgb[upper + 1], "purple above");
    assert!(rgb[lower].abs_diff(rgb[lower + 1]) < 3, "grey below");
    assert!(display(&relit, Exposure::White(0.0)).is_err());
    // A reason refuses where it is asked to.
    maps.reasons.fill(4);
    let refused = RelightOptions { refuse: 4, ..RelightOptions::default() };
    assert!(matches!(relight(&maps, &camera, &light, &refused), Err(RelightError::NoMaterial { samples: 400 })));
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let maps = uniform(0.3);
    let camera = frame(&maps.grid.plane, 30.0, 0.0, None, 50).unwrap();
    let options = RelightOptions::default();
    let black = Sky::Black.light(None, None).unwrap();
    assert!(matches!(relight(&maps, &camera, &black, &options), Err(RelightError::NoLight)));
    let light = Sky::Overcast(1.0).light(None, None).unwrap();
    let rays = RelightOptions { rays: 9, ..options };
    assert!(matches!(relight(&maps, &camera, &light, &rays), Err(RelightError::Rays { rays: 9 })));
    let away = PlaneRect { left: 5.0, right: 6.0, bottom: 5.0, top: 6.0 };
    let elsewhere = frame(&away, 10.0, 0.0, None, 50).unwrap();
    assert!(matches!(relight(&maps, &elsewhere, &light, &options), Err(RelightError::NothingSeen)));
    let set = Sun { azimuth_deg: 0.0, elevation_deg: -3.0, irradiance: None };
    assert!(matches!(Sky::Clear(1.0).light(Some(set), None), Err(RelightError::SunBelowHorizon { .. })));
    assert!(matches!(Sky::Clear(1.0).light(None, None), Err(RelightError::NoSun { .. })));
    assert!(matches!(Sky::Uniform(-1.0).light(None, None), Err(RelightError::Number { .. })));
}
