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
    assert_eq!(w.names("a"), ["brewster.json", "view-0", "view-1"]);
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
    assert_eq!(a.len(), 2 * (5 + 4 + 9));
    assert!(a == b, "two runs differ");
    for view in ["view-0", "view-1"] {
        assert_eq!(w.stokes(&format!("a/{view}")), w.stokes(&format!("b/{view}")));
    }
    // What brewster made it may replace.
    let file = file.to_str().unwrap();
    w.refused(&["simulate", file, "--size", "8x6", "-o", "a"], 4, &["not empty"]);
    w.ok(&["simulate", file, "--size", "8x6", "--view", "1", "-o", "a", "--force"]);
    assert_eq!(w.names("a"), ["brewster.json", "view-1"]);
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
        ["diffuse polarization", "not in this scene", "above the tolerance", "wheel-error", "true difference", "ns/px"]
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
    std::fs::write(
        w.path("smooth.toml"),
        text.replace("alpha = 0.25", "alpha = 0.001")
            .replace("[light.rayleigh]", "[light.sun_disk]\nradiance = 1e5\n\n[light.rayleigh]"),
    )
    .unwrap();
    w.refused(&["simulate", "smooth.toml"], 3, &["smooth.toml", "surface.iron.alpha", "Change the scene"]);
}
