//! From scene files to Stokes images: every scene of the repository, where highlights are, which way they are polarized, what
//! turns and maps do, and what is refused.

use std::path::Path;

use glam::DVec3;
use host_image::{Encoding, Picture, Samples};
use host_optics::frames::{Frame, axis_angle, s_axis};
use host_sim::camera::Pinhole;
use host_sim::{Scene, SimError, simulate};

/// A plane under a uniform sky of 1e-3 and a sun, seen from the south; `surface` and `light` add lines.
fn plane(surface: &str, light: &str) -> String {
    format!(
        r#"
schema = 1
name = "plane"
seed = 1
[sample]
side_m = 4.0
surface = "one"
[surface.one]
{surface}
[[view]]
theta_deg = 50.0
phi_deg = -90.0
distance_m = 1.0
focal_length_mm = 8.0
{light}
[camera]
width_px = 64
height_px = 48
pixel_pitch_um = 100.0
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
    )
}

fn parse(text: &str) -> Scene {
    Scene::parse(text, Path::new("plane.toml")).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_scene_is_simulated_physically_and_the_same_twice() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        let scene = Scene::read(&file).unwrap().resized(24, 18);
        for view in 0..scene.views.len() {
            let simulation = simulate(&scene, view, 1e-2, false).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            let again = simulate(&scene, view, 1e-2, false).unwrap();
            assert_eq!(simulation.image, again.image);
            simulation.image.check().unwrap();
            for planes in &simulation.image.colors {
                let pixels = planes.s0.iter().zip(&planes.s1).zip(&planes.s2).zip(&simulation.truth.mask);
                for (((s0, s1), s2), mask) in pixels {
                    assert_eq!(*s0 > 0.0, *mask > 0.0, "{}: light where the sample is", file.display());
                    assert!(s1.hypot(*s2) <= s0 * 1.000_01, "{}: DoLP above 1", file.display());
                }
            }
        }
    }
}

/// The brightest pixel is where the law of reflection sends the sun, and is polarized along the s direction there.
#[test]
fn a_highlight_is_the_sun_mirrored_and_s_polarized() {
    let surface = "eta = 1.5\nalbedo = 0.0\nalpha = 0.03";
    for (azimuth, elevation) in [(90.0, 40.0), (75.0, 45.0), (105.0, 36.0)] {
        let light = format!(
            "[light.uniform]\nradiance = 1e-6\n[light.sun]\nazimuth_deg = {azimuth}\nelevation_deg = {elevation}\n\
             [light.sun_disk]\nradiance = 1e4"
        );
        let scene = parse(&plane(surface, &light));
        let (camera, sun) = (&scene.views[0], scene.light.sun.unwrap());
        let planes = &simulate(&scene, 0, 1e-3, false).unwrap().image.colors[1];
        let mirror = |index: usize| {
            let ray = camera.ray(Pinhole::pixel(index / 64, index % 64));
            DVec3::new(ray.x, ray.y, -ray.z)
        };
        // The mirrored pixel, by geometry alone.
        let nearest = |a: &usize, b: &usize| mirror(*a).dot(sun).total_cmp(&mirror(*b).dot(sun));
        let expected = (0..64 * 48).max_by(nearest).unwrap();
        let brightest = (0..64 * 48).max_by(|a, b| planes.s0[*a].total_cmp(&planes.s0[*b])).unwrap();
        let apart = (brightest / 64).abs_diff(expected / 64).max((brightest % 64).abs_diff(expected % 64));
        // Off-specular shift: Fresnel and 1/(n·o) grow towards the horizon within a lobe of 2α.
        assert!(apart <= 2, "azimuth {azimuth}: at {brightest}, mirrored at {expected}");
        let point = camera.plane_point(Pinhole::pixel(expected / 64, expected % 64)).unwrap();
        let to_camera = (camera.pose.position - point.extend(0.0)).normalize();
        let frame = Frame::camera(to_camera, camera.pose.right).unwrap();
        let s = axis_angle(&frame, s_axis(sun, to_camera));
        let aolp = 0.5 * f64::from(planes.s2[expected]).atan2(f64::from(planes.s1[expected]));
        let error = (2.0 * (aolp - s.0)).sin().abs();
        assert!(error < 1e-3 && (2.0 * (aolp - s.0)).cos() > 0.0, "AoLP {aolp}, s direction {}", s.0);
    }
}

#[test]
fn a_turned_map_is_the_turned_scene() {
    let folder = tempfile::tempdir().unwrap();
    let samples = (0..32 * 16 * 3).map(|k: u16| 0.5 + 0.4 * (f32::from(k / 3 % 32) * 0.39).sin()).collect();
    let picture =
        Picture { width: 32, height: 16, channels: 3, samples: Samples::F32(samples), encoding: Encoding::Linear };
    picture.write_exr(&folder.path().join("sky.exr")).unwrap();
    let image = |turn: f64| {
        let azimuth = 30.0 + turn;
        let light = format!(
            "[light.map]\nfile = \"sky.exr\"\ncenter_azimuth_deg = {azimuth}\nscale = 1.0\n\
             [light.sun]\nazimuth_deg = {azimuth}\nelevation_deg = 20.0\n[light.rayleigh]\nmax_dolp = 0.6"
        );
        let surface = "eta = 1.5\nalbedo = 0.2\nalpha = 0.2";
        let text = plane(surface, &light).replace("phi_deg = -90.0", &format!("phi_deg = {}", turn - 90.0));
        let text = text.replace("width_px = 64\nheight_px = 48", "width_px = 16\nheight_px = 12");
        let scene = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
        simulate(&scene, 0, 1e-3, false).unwrap().image
    };
    let (straight, turned) = (image(0.0), image(17.3));
    for (a, b) in straight.colors.iter().zip(&turned.colors) {
        for (a, b) in [(&a.s0, &b.s0), (&a.s1, &b.s1), (&a.s2, &b.s2)] {
            let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "a scene turned as a whole looks the same: {worst}");
        }
    }
}

/// Between its levels a map of α is blended; against one constant α that lies between two of them.
#[test]
fn a_map_of_alpha_is_as_good_as_a_constant() {
    let folder = tempfile::tempdir().unwrap();
    // α 0.2 above, 0.21 below: three levels. The lines seen by the middle rows hold a mix.
    let samples = Samples::F32((0..64).map(|k| if k < 32 { 0.2 } else { 0.21 }).collect());
    let picture = Picture { width: 1, height: 64, channels: 1, samples, encoding: Encoding::Linear };
    picture.write_exr(&folder.path().join("alpha.exr")).unwrap();
    let light = "[light.sun]\nazimuth_deg = 90.0\nelevation_deg = 40.0\n[light.uniform]\nradiance = 0.1\n\
                 [light.sun_disk]\nradiance = 1e4";
    let scene = |alpha: &str| {
        let text = plane(&format!("eta = 1.5\nalbedo = 0.1\n{alpha}"), light);
        let text = text.replace("width_px = 64\nheight_px = 48", "width_px = 20\nheight_px = 16");
        Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
    };
    let mapped = simulate(&scene("alpha_map = { file = \"alpha.exr\", coding = \"linear\" }"), 0, 1e-3, false).unwrap();
    let low = simulate(&scene("alpha = 0.2"), 0, 1e-3, false).unwrap();
    let high = simulate(&scene("alpha = 0.21"), 0, 1e-3, false).unwrap();
    for (index, alpha) in mapped.truth.alpha.iter().enumerate().filter(|(k, _)| mapped.truth.mask[*k] > 0.0) {
        let found = mapped.image.colors[0].s0[index];
        let (a, b) = (low.image.colors[0].s0[index], high.image.colors[0].s0[index]);
        if (alpha - 0.2).abs() < 1e-7 {
            assert!((found - a).abs() <= 2e-3 * a, "{found} at alpha 0.2, {a}");
        } else if (alpha - 0.21).abs() < 1e-7 {
            assert!((found - b).abs() <= 2e-3 * b, "{found} at alpha 0.21, {b}");
        } else {
            assert!(found >= a.min(b) * 0.998 && found <= a.max(b) * 1.002);
        }
    }
}

/// Four fields of a map, one below the other, each held against the same scene with constants: α and η of a dielectric, an index
/// for each band, and metals with a map of α.
#[test]
fn maps_are_as_good_as_constants() {
    let folder = tempfile::tempdir().unwrap();
    let fields = |name: &str, values: [[f32; 3]; 4], channels: usize| {
        let samples = (0..64).flat_map(|row| values[row / 16][..channels].to_vec()).collect();
        let samples = Samples::F32(samples);
        let picture = Picture { width: 1, height: 64, channels, samples, encoding: Encoding::Linear };
        picture.write_exr(&folder.path().join(name)).unwrap();
    };
    let etas = [[1.33, 1.5, 1.7], [1.47, 1.52, 1.6], [1.6, 1.61, 1.62], [2.4, 1.9, 1.3]];
    let alphas = [[0.1; 3], [0.15; 3], [0.22; 3], [0.4; 3]];
    fields("eta.exr", etas, 1);
    fields("etas.exr", etas, 3);
    fields("alpha.exr", alphas, 1);
    let light = "[light.sun]\nazimuth_deg = 90.0\nelevation_deg = 40.0\n[light.uniform]\nradiance = 1.0\n\
                 [light.rayleigh]\nmax_dolp = 0.6";
    let scene = |lines: &str| {
        let text = plane(&format!("albedo = 0.1\n{lines}"), light).replace("side_m = 4.0", "side_m = 0.5");
        let text = text.replace("width_px = 64\nheight_px = 48", "width_px = 8\nheight_px = 32");
        Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
    };
    let tolerance = 4e-3;
    let map = |key: &str, file: &str| format!("{key}_map = {{ file = \"{file}\", coding = \"linear\" }}\n");
    let eta = |k: usize| format!("eta = {}\n", etas[k][0]);
    let bands = |k: usize| format!("eta = {:?}\n", etas[k]);
    let alpha = |k: usize| format!("alpha = {}\n", alphas[k][0]);
    type Constant<'a> = &'a dyn Fn(usize) -> String;
    let cases: [(String, Constant<'_>); 4] = [
        (map("eta", "eta.exr") + "alpha = 0.2", &|k| eta(k) + "alpha = 0.2"),
        (map("eta", "etas.exr") + "alpha = 0.2", &|k| bands(k) + "alpha = 0.2"),
        (map("eta", "eta.exr") + &map("alpha", "alpha.exr"), &|k| eta(k) + &alpha(k)),
        ("material = \"gold\"\n".to_owned() + &map("alpha", "alpha.exr"), &|k| {
            "material = \"gold\"\n".to_owned() + &alpha(k)
        }),
    ];
    for (mapped, constant) in cases {
        let mapped_scene = scene(&mapped);
        let found = simulate(&mapped_scene, 0, tolerance, false).unwrap();
        assert!(found.map_bound > 0.0 && found.map_bound + found.plan.bound <= tolerance, "{mapped}");
        for k in 0..4 {
            let expected = simulate(&scene(&constant(k)), 0, tolerance, false).unwrap();
            let mut compared = 0;
            for index in (0..found.truth.mask.len()).filter(|i| found.truth.mask[*i] > 0.0) {
                let same = |a: f32, b: f32| (a - b).abs() < 1e-6;
                let (a, b) = (&found.truth, &expected.truth);
                let at_index = a.eta[index].iter().zip(b.eta[index]).all(|(a, b)| same(*a, b));
                if !(same(a.alpha[index], b.alpha[index]) && at_index) {
                    continue;
                }
                compared += 1;
                for (a, b) in found.image.colors.iter().zip(&expected.image.colors) {
                    for (x, y) in [(&a.s0, &b.s0), (&a.s1, &b.s1), (&a.s2, &b.s2)] {
                        let error = f64::from((x[index] - y[index]).abs() / b.s0[index]);
                        assert!(error <= 2.0 * tolerance, "{mapped}, field {k}: {error}");
                    }
                }
            }
            assert!(compared >= 8, "{mapped}, field {k}: {compared} pixels");
        }
    }
}

/// A picture says which metal is where: the surfaces of an index map have materials of their own.
#[test]
fn metals_lie_where_an_index_map_says() {
    let folder = tempfile::tempdir().unwrap();
    let picture =
        Picture { width: 2, height: 1, channels: 1, samples: Samples::U8(vec![0, 1]), encoding: Encoding::Linear };
    picture.write_png(&folder.path().join("metals.png")).unwrap();
    let light = "[light.uniform]\nradiance = 1.0";
    let of = |material: &str| format!("material = \"{material}\"\nalbedo = 0.0\nalpha = 0.2");
    let small = |text: String| {
        let text = text.replace("width_px = 64\nheight_px = 48", "width_px = 16\nheight_px = 12");
        Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"))
    };
    let both = plane(&of("gold"), light)
        .replace("surface = \"one\"", "[sample.index_map]\nfile = \"metals.png\"\nsurfaces = [\"one\", \"two\"]")
        .replace("[[view]]", &format!("[surface.two]\n{}\n[[view]]", of("iron")));
    let found = simulate(&small(both), 0, 2e-3, false).unwrap();
    for (surface, material) in [(0.0, "gold"), (1.0, "iron")] {
        let expected = simulate(&small(plane(&of(material), light)), 0, 2e-3, false).unwrap();
        for index in (0..16 * 12).filter(|i| (found.truth.surface[*i] - surface).abs() < 0.5) {
            for (a, b) in found.image.colors.iter().zip(&expected.image.colors) {
                assert!((a.s0[index] - b.s0[index]).abs() <= 4e-3 * b.s0[index], "{material}");
                assert!((a.s1[index] - b.s1[index]).abs() <= 4e-3 * b.s0[index], "{material}");
            }
        }
    }
}

#[test]
fn what_cannot_be_simulated_is_refused_by_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let samples = Samples::F32(vec![1e-5, 1.0, 0.5, 0.5]);
    let picture = Picture { width: 2, height: 2, channels: 1, samples, encoding: Encoding::Linear };
    picture.write_exr(&folder.path().join("alpha.exr")).unwrap();
    let map = "alpha_map = { file = \"alpha.exr\", coding = \"linear\" }\neta = 1.5\nalbedo = 0.0";
    let text = plane(map, "[light.uniform]\nradiance = 1.0");
    let mapped = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
    // Levels of ln α would have to be 1.1e-4 apart.
    let error = simulate(&mapped, 0, 1e-7, false).unwrap_err();
    let line = 1 + text[..text.find("alpha_map").unwrap()].matches('\n').count();
    let SimError::NotSimulated { place, .. } = &error else { panic!("{error}") };
    assert_eq!((place.key.as_str(), place.line), ("surface.one.alpha_map", line), "{error}");

    assert!(matches!(simulate(&mapped, 1, 1e-3, false), Err(SimError::NoView { view: 1, views: 1 })));
    assert!(matches!(simulate(&mapped, 0, 0.0, false), Err(SimError::Tolerance(_))));
}
