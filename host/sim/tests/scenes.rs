//! Every scene file of the repository is read and checked; every kind of mistake is told apart, with its key and line.
#![expect(clippy::unwrap_used, reason = "a test that panics has failed, as it should")]

use std::path::{Path, PathBuf};

use glam::DVec2;
use host_image::{Color, ColorPlanes, Encoding, Picture, Samples, StokesImage, StokesMetadata};
use host_optics::{Ior, Light};
use host_sim::camera::{Pinhole, Truth};
use host_sim::scene::{Layout, SkyPattern};
use host_sim::{Scene, SimError};

const DRAIN: &str = include_str!("../scenes/drain-cover.toml");

fn scene_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// The drain cover with `from` (which must occur once) replaced by `to`, and the line of the replacement.
fn edited(from: &str, to: &str) -> (SimError, usize) {
    assert_eq!(DRAIN.matches(from).count(), 1, "{from} must name one place");
    let line = 1 + DRAIN[..DRAIN.find(from).unwrap()].matches('\n').count();
    (Scene::parse(&DRAIN.replace(from, to), Path::new("edited.toml")).unwrap_err(), line)
}

/// The scene is refused as out of range (or malformed, or unknown) at `key` in the line of the edit.
fn refused(from: &str, to: &str, key: &str) -> String {
    let (error, line) = edited(from, to);
    let message = error.to_string();
    let place = match error {
        SimError::OutOfRange { place, .. }
        | SimError::Optics { place, .. }
        | SimError::Map { place, .. }
        | SimError::Parse { place, .. }
        | SimError::UnknownKey { place, .. }
        | SimError::UnknownValue { place, .. } => place,
        other => panic!("{other}"),
    };
    assert_eq!((place.key.as_str(), place.line), (key, line), "{message}");
    assert_eq!(place.file, Path::new("edited.toml"));
    message
}

#[test]
fn every_scene_is_valid_and_fills_its_pictures() {
    let files = scene_files();
    assert_eq!(files.len(), 6);
    for file in files {
        let scene = Scene::read(&file).unwrap_or_else(|e| panic!("{e}"));
        assert!((2..=3).contains(&scene.views.len()), "{}", file.display());
        for view in &scene.views {
            let truth = Truth::of(&scene.sample, view);
            let seen = truth.mask.iter().sum::<f32>() / (truth.width * truth.height) as f32;
            assert!((0.2..=1.0).contains(&seen), "{}: {seen} of the picture is sample", file.display());
            // Every surface is seen, and the sample's center is in the middle of the picture.
            for surface in 0..scene.sample.surfaces.len() {
                let index = f32::from(u16::try_from(surface).unwrap());
                let name = &scene.sample.surfaces[surface].name;
                let of_it = |(s, m): (&f32, &f32)| (s - index).abs() < 0.5 && *m > 0.5;
                assert!(truth.surface.iter().zip(&truth.mask).any(of_it), "{} of {}", name, file.display());
            }
            let middle = view.project(glam::DVec3::ZERO).unwrap();
            assert!((middle - DVec2::new(160.0, 120.0)).length() < 1e-9);
        }
        for band in &scene.light.bands {
            let [l, q, u] = band.stokes(glam::DVec3::new(0.0, 0.6, 0.8));
            assert!(l > 0.0 && q.hypot(u) <= l);
        }
    }
}

#[test]
fn the_drain_cover_is_the_file() {
    let scene = Scene::parse(DRAIN, Path::new("drain-cover.toml")).unwrap();
    let at = |x: f64, y: f64| scene.sample.at(DVec2::new(x, y));
    let (plate, groove) = (at(0.0, 0.0).unwrap(), at(0.049, 0.0).unwrap());
    assert_eq!(scene.sample.surfaces[plate.surface].name, "iron");
    assert_eq!(scene.sample.surfaces[groove.surface].name, "paint");
    assert!(matches!(plate.ior[0], Ior::Conductor(c) if (c.n() - 2.892_381).abs() < 1e-9));
    assert!(matches!(groove.ior[1], Ior::Dielectric(d) if (d.eta() - 1.493_69).abs() < 1e-9));
    assert_eq!(at(0.3, 0.0), None);
    assert!(matches!(scene.sample.layout, Layout::Grid { cells: [5, 5], .. }));
    assert!(matches!(scene.light.bands[2].polarization, Some(SkyPattern::Rayleigh(_))));
    let sun = scene.light.sun.unwrap();
    assert!(sun.x < -0.97 && (sun.z - 12_f64.to_radians().sin()).abs() < 1e-12);
    assert!((scene.plan.angles[1].0 - 45_f64.to_radians()).abs() < 1e-15);
}

#[test]
fn an_unknown_key_is_named_with_its_line() {
    let message = refused("read_noise_e = 12.0", "read_noise = 12.0", "camera.read_noise");
    assert!(message.contains("read_noise_e"), "the keys that may stand there: {message}");
    refused("amplitude_deg = 6.0", "amplitude = 6.0", "surface.iron.bumps.amplitude");
}

#[test]
fn values_no_scene_can_have_are_refused() {
    let lower_eta = "eta = 0.9\nalbedo = [0.12, 0.11, 0.10]";
    let message = refused("material = \"acrylic\"\nalbedo = [0.12, 0.11, 0.10]", lower_eta, "surface.paint.eta");
    assert!(message.contains("0.9"), "{message}");
    refused("alpha = 0.25", "alpha = -0.25", "surface.iron.alpha");
    refused("alpha = 0.25", "alpha = nan", "surface.iron.alpha");
    refused("albedo = [0.04, 0.035, 0.03]", "albedo = [0.04, 1.035, 0.03]", "surface.iron.albedo");
    refused("max_dolp = 0.75", "max_dolp = 1.75", "light.rayleigh.max_dolp");
    refused("theta_deg = 10.0", "theta_deg = 100.0", "view.2.theta_deg");
    refused("angles_deg = [0.0, 45.0, 90.0, 135.0]", "angles_deg = [0.0, 90.0, 180.0, 270.0]", "plan.angles_deg");
    refused("joint_mm = 20.0", "joint_mm = -20.0", "sample.grid.joint_mm");
    refused("transmission = 0.42", "transmission = 0.62", "polarizer.transmission");
}

#[test]
fn a_view_from_below_is_refused() {
    let from = "theta_deg = 10.0\nphi_deg = -90.0\ndistance_m = 1.5";
    let (error, line) = edited(from, "position_m = [0.0, 0.0, -1.0]\nlook_at_m = [0.0, 0.0, 0.0]");
    let SimError::OutOfRange { place, allowed, .. } = error else { panic!("{error}") };
    assert_eq!((place.key.as_str(), place.line), ("view.2.position_m", line));
    assert!(allowed.contains("above"), "{allowed}");
}

#[test]
fn a_disk_of_a_sun_below_the_horizon_is_refused() {
    let low = "elevation_deg = -3.0\n\n[light.sun_disk]\nradiance = 1000";
    let message = refused("elevation_deg = 12.0", low, "light.sun.elevation_deg");
    assert!(message.contains("above 0"), "{message}");
    // Without a disk it is twilight.
    let twilight = DRAIN.replace("elevation_deg = 12.0", "elevation_deg = -3.0");
    assert!(Scene::parse(&twilight, Path::new("twilight.toml")).is_ok());
}

#[test]
fn names_nothing_has_are_refused_with_those_there_are() {
    let message = refused("surfaces = [\"iron\"]", "surfaces = [\"iorn\"]", "sample.grid.surfaces");
    assert!(message.contains("iorn") && message.contains("iron, paint"), "{message}");
    let message = refused("material = \"iron\"", "material = \"unobtainium\"", "surface.iron.material");
    assert!(message.contains("gold"), "{message}");
    let message = refused("bayer = \"mono\"", "bayer = \"xtrans\"", "camera.bayer");
    assert!(message.contains("rggb"), "{message}");
}

#[test]
fn contradictions_are_refused() {
    let (error, _) = edited("alpha = 0.25", "alpha = 0.25\nalpha_map = { file = \"a.png\", coding = \"root\" }");
    assert!(matches!(&error, SimError::Parse { place, .. } if place.key == "surface.iron"), "{error}");
    let (error, _) = edited("fill = 0.8", "fill = 0.8\nexposures_us = [1000.0]");
    assert!(matches!(&error, SimError::Parse { place, .. } if place.key == "plan"), "{error}");
    let (error, _) = edited("[light.rayleigh]", "[light.uniform]\nradiance = 1.0\n\n[light.rayleigh]");
    assert!(matches!(&error, SimError::Parse { place, .. } if place.key == "light"), "{error}");
    let (error, _) = edited("schema = 1", "schema = 2");
    assert!(matches!(&error, SimError::UnknownSchema { found: 2, supported: 1, .. }), "{error}");
}

#[test]
fn a_map_that_is_missing_or_wrong_is_named_with_its_line() {
    let message = refused(
        "albedo = [0.04, 0.035, 0.03]",
        "albedo_map = { file = \"missing.png\", coding = \"srgb\" }",
        "surface.iron.albedo_map.file",
    );
    assert!(message.contains("missing.png"), "{message}");
}

fn write(folder: &Path, name: &str, channels: usize, samples: Samples) {
    let width = samples.len() / channels / 2;
    let picture = Picture { width, height: 2, channels, samples, encoding: Encoding::Linear };
    let path = folder.join(name);
    if name.ends_with("png") { picture.write_png(&path).unwrap() } else { picture.write_exr(&path).unwrap() }
}

#[test]
fn maps_lie_on_the_sample_the_right_way_up() {
    let folder = tempfile::tempdir().unwrap();
    // Upper left, upper right / lower left, lower right.
    write(folder.path(), "albedo.png", 3, Samples::U8([[0; 3], [255; 3], [188; 3], [255, 0, 0]].concat()));
    write(folder.path(), "rough.png", 1, Samples::U16(vec![0, 65535, 32768, 32768]));
    write(folder.path(), "eta.exr", 1, Samples::F32(vec![1.3, 1.4, 1.5, 1.6]));
    write(
        folder.path(),
        "normal.png",
        3,
        Samples::U8([[128, 128, 255], [255, 128, 128], [128, 255, 128], [128, 128, 255]].concat()),
    );
    write(folder.path(), "regions.png", 1, Samples::U8(vec![0, 1, 1, 0]));
    let grid = &DRAIN[DRAIN.find("[sample.grid]").unwrap()..DRAIN.find("# Johnson").unwrap()];
    let text = DRAIN
        .replace(grid, "[sample.index_map]\nfile = \"regions.png\"\nsurfaces = [\"paint\", \"iron\"]\n\n")
        .replace(
            "material = \"acrylic\"\nalbedo = [0.12, 0.11, 0.10]\nalpha = 0.35\nbumps = { amplitude_deg = 10.0, wavelength_mm = 4.0 }",
            "eta_map = { file = \"eta.exr\", coding = \"linear\" }\n\
             albedo_map = { file = \"albedo.png\", coding = \"srgb\" }\n\
             alpha_map = { file = \"rough.png\", coding = \"root\" }\n\
             normal_map = { file = \"normal.png\", coding = \"linear\" }",
        );
    let scene = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap();
    let at = |x: f64, y: f64| scene.sample.at(DVec2::new(x, y)).unwrap();
    let name = |x: f64, y: f64| scene.sample.surfaces[at(x, y).surface].name.as_str();
    assert_eq!(
        [name(-0.2, 0.2), name(0.2, 0.2), name(-0.2, -0.2), name(0.2, -0.2)],
        ["paint", "iron", "iron", "paint"]
    );
    let (upper_left, lower_right) = (at(-0.2, 0.2), at(0.2, -0.2));
    let near = |a: f64, b: f64| (a - b).abs() < 5e-3;
    assert!(near(upper_left.albedo[0], 0.0) && near(lower_right.albedo[0], 1.0) && near(lower_right.albedo[1], 0.0));
    assert!(near(upper_left.alpha, 0.0) && near(lower_right.alpha, 0.25));
    let eta = |ior: Ior| if let Ior::Dielectric(d) = ior { d.eta() } else { f64::NAN };
    assert!(near(eta(upper_left.ior[1]), 1.3) && near(eta(lower_right.ior[1]), 1.6));
    assert!(upper_left.normal.z > 0.999);

    for (from, to, key) in [
        ("eta.exr", "albedo.png", "surface.paint.eta_map.file"),
        ("rough.png", "albedo.png", "surface.paint.alpha_map.file"),
        ("regions.png", "rough.png", "sample.index_map.file"),
        ("surfaces = [\"paint\", \"iron\"]", "surfaces = [\"paint\"]", "sample.index_map.file"),
    ] {
        let error = Scene::parse(&text.replace(from, to), &folder.path().join("scene.toml")).unwrap_err();
        assert!(matches!(&error, SimError::OutOfRange { place, .. } if place.key == key), "{error}");
    }
}

/// A Stokes image has layers S0, S1, S2 and no albedo.
#[test]
fn a_map_with_other_layers_is_refused_with_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let planes =
        ColorPlanes { color: Color::Y, s0: vec![1.0], s1: vec![0.0], s2: vec![0.0], flags: None, residual: None };
    let metadata = StokesMetadata {
        unit: "DN".into(),
        angles_deg: Vec::new(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: "test".into(),
        camera_serial: None,
        capture_id: None,
        software_version: "test".into(),
    };
    let image = StokesImage { width: 1, height: 1, colors: vec![planes], metadata };
    image.save_exr(&folder.path().join("stokes.exr")).unwrap();
    let map = "albedo_map = { file = \"stokes.exr\", coding = \"linear\" }";
    let text = DRAIN.replace("albedo = [0.04, 0.035, 0.03]", map);
    let error = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap_err();
    let SimError::Map { place, source } = error else { panic!("{error}") };
    assert_eq!(place.key, "surface.iron.albedo_map.file");
    assert!(source.to_string().contains("S0.Y"), "{source}");
}

/// A panorama as one sees it turning to the right: what is right of the middle lies clockwise of it.
#[test]
fn an_environment_map_is_not_mirrored() {
    let folder = tempfile::tempdir().unwrap();
    // Eight columns; a lamp in the first column right of the middle, in the upper half.
    let mut samples = vec![0.0_f32; 3 * 16];
    samples[3 * 4..3 * 5].fill(1.0);
    write(folder.path(), "sky.exr", 3, Samples::F32(samples));
    let light = &DRAIN[DRAIN.find("[light.clear]").unwrap()..DRAIN.find("[light.rayleigh]").unwrap()];
    let map = "[light.map]\nfile = \"sky.exr\"\ncenter_azimuth_deg = 90.0\nscale = 3.0\n\n";
    let text = DRAIN.replace(light, map);
    let scene = Scene::parse(&text, &folder.path().join("scene.toml")).unwrap();
    let looking = |azimuth_deg: f64| {
        let (s, c) = azimuth_deg.to_radians().sin_cos();
        let half = 0.5_f64.sqrt();
        scene.light.bands[0].stokes(glam::DVec3::new(half * c, half * s, half))
    };
    let [l, q, u] = looking(90.0 - 22.5);
    assert!((l - 3.0).abs() < 1e-6 && q.hypot(u) > 0.01 * l, "{l} {q} {u}");
    assert!(looking(90.0 + 22.5)[0].abs() < 1e-6);
    let wrong = text.replace("sky.exr", "gone.hdr");
    let error = Scene::parse(&wrong, &folder.path().join("scene.toml")).unwrap_err();
    assert!(matches!(&error, SimError::Map { place, .. } if place.key == "light.map.file"), "{error}");
}

#[test]
fn truth_is_what_the_ray_meets() {
    let scene = Scene::parse(DRAIN, Path::new("drain-cover.toml")).unwrap();
    let camera = scene.views[0];
    let truth = Truth::of(&scene.sample, &camera);
    let (row, column) = (100, 200);
    let index = row * truth.width + column;
    let point = camera.plane_point(Pinhole::pixel(row, column)).unwrap();
    let expected = scene.sample.at(point).unwrap();
    assert!((f64::from(truth.position_m[index][0]) - point.x).abs() < 1e-7);
    assert!((f64::from(truth.alpha[index]) - expected.alpha).abs() < 1e-7);
    let view = camera.view_of(point).unwrap();
    let incidence = view.direction.dot(expected.normal).acos();
    assert!((f64::from(truth.incidence_rad[index]) - incidence).abs() < 1e-6);
    assert_eq!(truth.mask[0].to_bits(), 0.0_f32.to_bits());
    assert_eq!(truth.pictures().len(), 9);
}
