//! `brewster simulate`: scenes in, folders out, and the frames read back by `brewster stokes`.

use std::path::{Path, PathBuf};

use crate::world::World;

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim/scenes").join(format!("{name}.toml"))
}

/// The drain cover with an ideal lens and even photosites, so that only noise is between frames and light.
fn even_drain_cover(w: &World) -> String {
    let mut text = std::fs::read_to_string(scene("drain-cover")).unwrap();
    for (from, to) in [
        ("vignetting_exponent = 4.0", "vignetting_exponent = 0.0"),
        ("psf_sigma_px = 0.4", "psf_sigma_px = 0.0"),
        ("prnu_percent = 0.8", "prnu_percent = 0.0"),
        ("beam_deviation_arcmin = 1.0", "beam_deviation_arcmin = 0.0"),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    std::fs::write(w.path("even.toml"), text).unwrap();
    "even.toml".to_owned()
}

/// Everything in a folder but the record, which holds times, and OpenEXR attributes, whose order is free.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("brewster.json") && !path.ends_with("stokes.exr") {
                let bytes = std::fs::read(&path).unwrap();
                found.push((path.strip_prefix(folder).unwrap().to_path_buf(), bytes));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn two_runs_are_the_same_to_the_last_bit() {
    let w = World::new();
    let file = scene("chart");
    for out in ["a", "b"] {
        let file = file.to_str().unwrap();
        w.ok(&["simulate", file, "--size", "24x18", "--tolerance", "0.01", "--frames", "-o", out]);
    }
    assert_eq!(w.names("a"), ["brewster.json", "view-0", "view-1", "views.json"]);
    assert_eq!(
        w.names("a/view-0"),
        ["aolp-dolp.png", "aolp.png", "dolp.png", "frames", "report.html", "s0.png", "stokes.exr", "truth"]
    );
    assert_eq!(
        w.names("a/view-0/frames"),
        ["frame_000deg.png", "frame_045deg.png", "frame_090deg.png", "frame_135deg.png"]
    );
    assert!(w.names("a/view-1/truth").contains(&"normal.exr".to_owned()));
    let (a, b) = (contents(&w.path("a")), contents(&w.path("b")));
    assert_eq!(a.len(), 2 * (5 + 4 + 9) + 1);
    assert!(a == b, "two runs differ");
    for view in ["view-0", "view-1"] {
        assert_eq!(w.stokes(&format!("a/{view}")), w.stokes(&format!("b/{view}")));
    }
    // What brewster made it may replace.
    let file = file.to_str().unwrap();
    w.refused(&["simulate", file, "--size", "8x6", "-o", "a"], 4, &["not empty"]);
    w.ok(&["simulate", file, "--size", "8x6", "--view", "1", "-o", "a", "--force"]);
    assert_eq!(w.names("a"), ["brewster.json", "view-1", "views.json"]);
}

#[test]
fn frames_give_the_stokes_image_back() {
    let w = World::new();
    let file = even_drain_cover(&w);
    let run = w.ok(&[
        "--json",
        "simulate",
        &file,
        "--size",
        "48x36",
        "--tolerance",
        "0.003",
        "--view",
        "1",
        "--frames",
        "-o",
        "sim",
    ]);
    let json = run.json();
    let ms = 1e-3 * json["views"][0]["frames"]["exposures_us"][0].as_f64().unwrap();
    let (black, white) = (json["black_dn"].to_string(), json["white_dn"].to_string());
    w.ok(&["stokes", "sim/view-1/frames", "--black", &black, "--white", &white, "-o", "back"]);
    let (truth, back) = (w.stokes("sim/view-1"), w.stokes("back"));
    assert_eq!(back.metadata.angles_deg, [0.0, 45.0, 90.0, 135.0]);
    // Electrons per ms and radiance of a grey sensor behind a filter of transmission 0.42; 33.3 e per DN.
    let response = [9000.0, 12000.0, 8000.0];
    let scale = 33.3 / (2.0 * 0.42 * ms);
    let (mut sum, mut square, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for index in 0..48 * 36 {
        let light = |k: usize| {
            let bands = truth.colors.iter().zip(response);
            bands.map(|(c, r)| f64::from([&c.s0, &c.s1, &c.s2][k][index]) * r / 3.0).sum::<f64>()
        };
        let s0 = light(0);
        if s0 <= 0.0 {
            continue;
        }
        let planes = &back.colors[0];
        for (k, plane) in [&planes.s0, &planes.s1, &planes.s2].into_iter().enumerate() {
            let error = (f64::from(plane[index]) * scale - light(k)) / s0;
            sum[k] += error;
            square[k] += error * error;
        }
        count += 1.0;
    }
    assert!(count > 500.0);
    // Four frames of 30000 electrons or more: shot noise of at most 0.6 % in s1 and s2; a wheel 0.1 degree off and drift of 0.1 %
    // for all pixels alike.
    for k in 0..3 {
        let (mean, rms) = (sum[k] / count, (square[k] / count).sqrt());
        assert!(mean.abs() < 3e-3 && rms < 1e-2, "s{k}: {mean} in the mean, {rms} rms");
    }
}

#[test]
fn the_table_and_its_true_differences() {
    let w = World::new();
    let file = scene("stone-pavement");
    let file = file.to_str().unwrap();
    let arguments = [
        "simulate",
        file,
        "--size",
        "16x12",
        "--view",
        "0",
        "--tolerance",
        "0.01",
        "--explain",
        "--verify",
        "--frames",
    ];
    let run = w.ok(&[&arguments[..], &["-o", "a"]].concat());
    for word in
        ["diffuse-polarization", "not in this scene", "above the tolerance", "wheel-error", "true difference", "ns/px"]
    {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
    let json = w.ok(&[&["--json"], &arguments[..], &["-o", "b"]].concat()).json();
    let view = &json["views"][0];
    assert!(view["true_difference"]["worst"].as_f64().unwrap() <= 0.01);
    assert!(view["frames"]["true_difference"].as_f64().unwrap() <= 0.01);
    for effect in view["effects"].as_array().unwrap() {
        if let (Some(bound), Some(difference)) = (effect["bound"].as_f64(), effect["true_difference"].as_f64()) {
            assert!(difference <= bound + 2e-3, "{effect}");
        }
    }
    for effect in view["frames"]["effects"].as_array().unwrap() {
        if let (Some(bound), Some(difference)) = (effect["bound"].as_f64(), effect["true_difference"].as_f64()) {
            assert!(difference <= bound * 1.000_01 + 1e-4, "{effect}");
        }
    }
}

#[test]
fn a_tolerance_may_be_a_part_of_the_noise() {
    let w = World::new();
    let file = scene("chart");
    let run = |tolerance: &str, out: &str| {
        let file = file.to_str().unwrap();
        let arguments =
            ["--json", "simulate", file, "--size", "8x6", "--view", "1", "--tolerance", tolerance, "-o", out];
        w.ok(&arguments).json()
    };
    let (whole, tenth) = (run("noise", "a"), run("noise/10", "b"));
    let noise = whole["camera_noise"].as_f64().unwrap();
    assert!((whole["tolerance"].as_f64().unwrap() - noise).abs() < 1e-15);
    assert!((tenth["tolerance"].as_f64().unwrap() - 0.1 * noise).abs() < 1e-15);
    // Four frames at a full well of 127839 electrons.
    assert!((noise - (1.0 / (4.0 * 127_839.0_f64)).sqrt()).abs() < 1e-5);
    let file = file.to_str().unwrap();
    w.refused(&["simulate", file, "--tolerance", "noise/0"], 2, &["noise/10"]);
    w.refused(&["simulate", file, "--tolerance", "2"], 2, &["at most 1"]);
}

#[test]
fn a_bad_scene_is_refused_with_key_line_and_advice() {
    let w = World::new();
    let text = std::fs::read_to_string(scene("drain-cover")).unwrap();
    std::fs::write(w.path("bad.toml"), text.replace("read_noise_e = 12.0", "read_noise = 12.0")).unwrap();
    let line = 1 + text[..text.find("read_noise_e").unwrap()].matches('\n').count();
    let place = format!("bad.toml:{line}: `camera.read_noise`");
    w.refused(&["simulate", "bad.toml"], 3, &[&place, "read_noise_e", "Correct the key"]);
    w.refused(&["simulate", "none.toml"], 3, &["none.toml", "Check the name"]);
    let file = scene("drain-cover");
    w.refused(&["simulate", file.to_str().unwrap(), "--view", "3"], 2, &["3 views", "--view"]);
    w.refused(&["simulate", file.to_str().unwrap(), "--size", "0x4"], 2, &["640x480"]);
}

/// Every kind of mistake ends with file, line and key, what would be right, and what to do.
#[test]
fn every_kind_of_bad_scene_is_refused_in_words() {
    let w = World::new();
    let text = std::fs::read_to_string(scene("drain-cover")).unwrap();
    let paint = "material = \"acrylic\"\nalbedo = [0.12, 0.11, 0.10]";
    let low_sun = "elevation_deg = -3.0\n[light.sun_disk]\nradiance = 1e5\n";
    let below = "position_m = [0.0, 0.0, -1.0]\nlook_at_m = [0.0, 0.0, 0.0]";
    let missing = "albedo_map = { file = \"none.png\", coding = \"srgb\" }";
    w.ok(&["simulate", scene("chart").to_str().unwrap(), "--size", "4x3", "--view", "0", "-o", "c"]);
    let layers = "albedo_map = { file = \"c/view-0/stokes.exr\", coding = \"linear\" }";
    let map = "[light.map]\nfile = \"none.hdr\"\ncenter_azimuth_deg = 0.0\nscale = 1.0\n";
    let clear = &text[text.find("[light.clear]").unwrap()..text.find("[light.rayleigh]").unwrap()];
    for (from, to, words) in [
        (paint, "eta = 0.9\nalbedo = 0.1", &["`surface.paint.eta`", "0.9", "1 <= n <= 1000", "Correct this line"][..]),
        ("alpha = 0.25", "alpha = -0.25", &["`surface.iron.alpha`", "-0.25", "0 to 1", "Correct this line"]),
        (
            "elevation_deg = 12.0",
            low_sun,
            &["`light.sun.elevation_deg`", "`: -3 is out", "above 0", "Correct this line"],
        ),
        (
            "albedo = [0.04, 0.035, 0.03]",
            missing,
            &["`surface.iron.albedo_map.file`", "none.png", "scene's own folder"],
        ),
        (clear, map, &["`light.map.file`", "none.hdr", "scene's own folder"]),
        ("albedo = [0.04, 0.035, 0.03]", layers, &["`surface.iron.albedo_map.file`", "S0.", "Export the map"]),
        (
            "theta_deg = 10.0\nphi_deg = -90.0\ndistance_m = 1.5",
            below,
            &["`view.2.position_m`", "above", "Correct this"],
        ),
        ("theta_deg = 10.0", "theta_deg = 95.0", &["`view.2.theta_deg`", "95", "below 90", "Correct this line"]),
        ("settle_ms = 80.0", "settling_ms = 80.0", &["`wheel.settling_ms`", "settle_ms", "Correct the key"]),
        ("settle_ms = 80.0", "settle_s = 0.08", &["`wheel.settle_s`", "settle_ms", "Correct the key"]),
        ("settle_ms = 80.0", "settle_ms = \"80 ms\"", &["`wheel.settle_ms`", "string", "Correct this line"]),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        let start = text.find(from).unwrap();
        let edited = text.replace(from, to);
        std::fs::write(w.path("bad.toml"), &edited).unwrap();
        // The line of the edit, or that of the key below it.
        let line = 1 + text[..start].matches('\n').count();
        let line = line + usize::from(from == clear);
        let place = format!("bad.toml:{line}: ");
        w.refused(&["simulate", "bad.toml"], 3, &[&[place.as_str()], words].concat());
    }
}

/// Where a pixel of the sample's corner is, by the numbers of `views.json` alone, and what a reader needs beside it.
#[test]
fn a_fit_finds_cameras_light_and_frames() {
    let w = World::new();
    let file = scene("chart");
    w.ok(&["simulate", file.to_str().unwrap(), "--size", "40x30", "--frames", "-o", "a"]);
    let text = std::fs::read_to_string(w.path("a/views.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let views = json["views"].as_array().unwrap();
    assert_eq!((json["version"].as_u64(), views.len()), (Some(1), 2));
    for (view, theta) in views.iter().zip([56.0, 10.0]) {
        assert!(w.path("a").join(view["stokes"]["file"].as_str().unwrap()).is_file());
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let camera = &view["camera"];
        let row = |matrix: &serde_json::Value, k: usize, x: [f64; 3]| -> f64 {
            (0..3).map(|j| number(&matrix[k][j]) * x[j]).sum()
        };
        // Upper left corner of a sample of 220 mm.
        let corner = [-0.11, 0.11, 0.0];
        let seen =
            [0, 1, 2].map(|k| row(&camera["R_world_to_camera"], k, corner) + number(&camera["t_world_to_camera"][k]));
        let [u, v, depth] = [0, 1, 2].map(|k| row(&camera["K"], k, seen));
        let listed = &view["plane"]["sample_corners_px"][0];
        assert!((u / depth - number(&listed[0])).abs() < 1e-9 && (v / depth - number(&listed[1])).abs() < 1e-9);
        assert!(depth > 0.0 && u / depth < 20.0 && v / depth < 15.0, "seen from the south, it is up left");
        assert!((number(&camera["theta_deg"]) - theta).abs() < 1e-9);
        assert!((number(&camera["azimuth_deg"]) + 90.0).abs() < 1e-9);
        let frames = view["sequences"]["plan"].as_array().unwrap();
        let angles: Vec<f64> = frames.iter().map(|f| number(&f["nominal_angle_deg"])).collect();
        assert_eq!(angles, [0.0, 45.0, 90.0, 135.0]);
        for frame in frames {
            assert!(w.path("a").join(frame["file"].as_str().unwrap()).is_file(), "{frame}");
            assert!((number(&frame["exposure_s"]) - number(&view["exposure_s"])).abs() < 1e-15);
        }
        // 12000 e per ms and radiance behind 0.42, 33.3 e per DN.
        let green = number(&view["sensor"]["responsivity_dn_per_radiance_s"][1]);
        assert!((green / (12e6 * 0.84 / 33.3) - 1.0).abs() < 1e-12, "{green}");
        let light = &view["light"];
        assert_eq!(light["type"], "clear");
        assert!((number(&light["sun_azimuth_deg"]) - 60.0).abs() < 1e-9);
        assert!((number(&light["sun_elevation_deg"]) - 40.0).abs() < 1e-9);
        assert_eq!(light["polarization"]["type"], "rayleigh");
        assert!((number(&light["sun_disk"]["radiance"][2]) - 2.8e5).abs() < 1e-6);
    }
}

/// The emulated camera before a scene, in place of the wheel chart: the same light as the simulation's.
#[test]
fn a_scene_can_be_captured() {
    let w = World::new();
    let text = std::fs::read_to_string(scene("ink-print")).unwrap();
    let small = text.replace("width_px = 320", "width_px = 64").replace("height_px = 240", "height_px = 48");
    let small = small.replace("pixel_pitch_um = 15.0", "pixel_pitch_um = 75.0");
    let small = small.replace("beam_deviation_arcmin = 1.0", "beam_deviation_arcmin = 0.0");
    std::fs::write(w.path("ink.toml"), small).unwrap();
    let capture = |device: &str, out: &str| {
        w.ok(&["--json", "capture", "--device", device, "--angles", "0,45,90,135", "--verify", "-o", out]).json()
    };
    let json = capture("emulated:ink.toml?view=1&seed=7&tolerance=0.01", "a");
    assert_eq!((json["width"].as_u64(), json["height"].as_u64()), (Some(64), Some(48)));
    assert_eq!(json["verified"]["differing"], 0);
    w.ok(&["simulate", "ink.toml", "--view", "1", "--tolerance", "0.01", "-o", "sim"]);
    let (seen, truth) = (w.stokes("a"), w.stokes("sim/view-1"));
    let ms = 1e-3 * json["exposure_us"][0].as_f64().unwrap();
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for index in 0..64 * 48 {
        let light = |k: usize| -> f64 {
            let bands = truth.colors.iter().zip([9000.0, 12000.0, 8000.0]);
            bands.map(|(c, r)| f64::from([&c.s0, &c.s1, &c.s2][k][index]) * r / 3.0).sum::<f64>() * 0.84 * ms / 33.3
        };
        if light(0) > 200.0 {
            let planes = &seen.colors[0];
            for (k, plane) in [&planes.s0, &planes.s1, &planes.s2].into_iter().enumerate() {
                sums[k] += (f64::from(plane[index]) - light(k)) / light(0);
            }
            count += 1.0;
        }
    }
    // In the mean: vignetting takes up to 11 % off the corners and about 3 % off all of it; noise averages out.
    let [s0, s1, s2] = sums.map(|sum| sum / count);
    assert!(count > 500.0 && (-0.06..0.0).contains(&s0) && s1.abs() < 0.03 && s2.abs() < 0.01, "{s0} {s1} {s2}");
    // Another seed is another noise of the same scene.
    capture("emulated:ink.toml?view=1&seed=8&tolerance=0.01", "b");
    assert!(w.stokes("b").colors[0].s0 != seen.colors[0].s0);
    w.refused(&["capture", "--device", "emulated:ink.toml?view=5"], 3, &["3 views"]);
    w.refused(&["capture", "--device", "emulated:none.toml"], 3, &["none.toml", "Check the name"]);
    w.refused(&["capture", "--device", "emulated:ink.toml?color=red"], 2, &["`view=N`"]);
    std::fs::write(w.path("bad.toml"), text.replace("schema = 1", "schema = 2")).unwrap();
    w.refused(&["capture", "--device", "emulated:bad.toml"], 3, &["bad.toml:", "schema"]);
}
