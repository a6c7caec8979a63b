//! `brewster render` and `brewster compare`: maps in, pictures and numbers out, and what is refused.

use std::path::Path;

use host_fit::maps::{Grid, MaterialMaps, Plane, PlaneRect};
use host_image::{Encoding, Layers, Picture, Samples};

use crate::world::{World, picture};

const USAGE: i32 = 2;
const BAD_INPUT: i32 = 3;

/// 24 × 24 samples of a grey stone, the uppermost row without an answer.
fn maps() -> MaterialMaps {
    let plane = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };
    let mut maps = MaterialMaps::new(Grid::new(24, 24, plane).unwrap(), false);
    for (plane, value) in Plane::ALL.into_iter().zip([0.3, 0.3, 0.3, 1.5, 0.3, 0.0, 0.0, 1.0]) {
        maps.plane_mut(plane).fill(value);
        maps.plane_mut(plane)[..24].fill(f32::NAN);
    }
    for plane in Plane::ALL.into_iter().filter(|p| p.name().starts_with("sigma")) {
        maps.plane_mut(plane).fill(0.01);
    }
    maps
}

fn world() -> World {
    let w = World::new();
    maps().save_exr(&w.path("m.exr")).unwrap();
    w
}

/// An environment of one radiance above and one below the horizon.
fn environment(path: &Path, above: f32, below: f32) {
    let half = |l: f32| std::iter::repeat_n(l, 3 * 16 * 4);
    let samples = Samples::F32(half(above).chain(half(below)).collect());
    picture(16, 3, samples, Encoding::Linear).write_exr(path).unwrap();
}

#[test]
fn maps_are_rendered_and_what_has_no_answer_is_counted() {
    let w = world();
    let arguments =
        ["--json", "render", "m.exr", "--sky", "uniform:2", "--view", "frontal", "--width", "96", "-o", "r"];
    let result = w.ok(&arguments).json();
    let count = |what: &str| result["pixels"][what].as_f64().unwrap();
    // One row of 24, and half of it: a cell is shown by its own sample.
    let share = count("unanswered") / (count("unanswered") + count("material"));
    assert!((share - 1.0 / 24.0).abs() < 0.01, "{result}");
    assert_eq!(
        w.names("r"),
        [
            "aolp-dolp.png",
            "aolp.png",
            "brewster.json",
            "dolp.png",
            "flags.png",
            "render.png",
            "report.html",
            "s0.png",
            "stokes.exr"
        ]
    );
    // Straight down on a level stone: albedo times the sky, and 4 % or so mirrored.
    let image = w.stokes("r");
    let middle = image.colors[1].s0[image.width * image.height / 2 + image.width / 2];
    assert!((middle - 2.0 * 0.34).abs() < 0.02, "{middle}");
}

#[test]
fn an_even_map_is_an_even_sky() {
    let w = world();
    environment(&w.path("sky.exr"), 1.0, 5.0);
    let view = ["--view", "30,20", "--width", "64"];
    w.ok(&[&["render", "m.exr", "--env", "sky.exr", "-o", "a"], &view[..]].concat());
    w.ok(&[&["render", "m.exr", "--sky", "uniform", "-o", "b"], &view[..]].concat());
    let same = w.ok(&["--json", "compare", "a/stokes.exr", "b/stokes.exr", "-o", "c"]).json();
    assert!(same["ssim"].as_f64().unwrap() > 0.999, "{same}");
    assert!(same["bands"][0]["mean_squared_error"].as_f64().unwrap() < 1e-8, "{same}");
    let scaled = w.ok(&["--json", "compare", "a/render.png", "a/render.png", "--align-scale", "-o", "e"]).json();
    assert!((scaled["scale"].as_f64().unwrap() - 1.0).abs() < 1e-9 && scaled["peak"] == 255.0, "{scaled}");
    assert_eq!(w.names("e"), ["brewster.json", "difference.png", "report.html"]);
}

#[test]
fn errors_against_a_truth_are_what_was_put_in() {
    let w = world();
    // A truth whose samples are those of the maps, with another index and another normal.
    let tilt = 2_f32.to_radians();
    let values = [0.3, 0.3, 0.3, 1.52, 0.3, tilt.sin(), 0.0, tilt.cos(), 10.0];
    let names = ["albedo.R", "albedo.G", "albedo.B", "eta", "alpha", "normal.X", "normal.Y", "normal.Z", "mask"];
    let planes = values.map(|v| vec![v; 24 * 24]);
    let mut layers = Layers::new(24, 24);
    names.iter().zip(&planes).for_each(|(name, plane)| layers.lend_f32(name, plane));
    layers.save(&w.path("truth.exr")).unwrap();
    let edge = format!("{}", 0.5 - 0.5 / 24.0);
    let plane = format!("-{edge},{edge},-{edge},{edge}");
    let result = w.ok(&["--json", "compare", "m.exr", "truth.exr", "--truth-plane", &plane, "-o", "c"]).json();
    let median = |what: &str| result["all"]["quantities"][what]["median"].as_f64().unwrap();
    assert!((median("normal") - 2.0).abs() < 1e-4 && (median("eta") - 0.02).abs() < 1e-6, "{result}");
    assert!(median("alpha") < 1e-7);
    // An error of 0.02 with a sigma of 0.01: outside of 1.96 sigma.
    assert_eq!(result["all"]["quantities"]["eta"]["error_over_sigma"]["within_95"], 0.0);
    assert_eq!(result["all"]["not_fitted"], 24);
    let text = w.ok(&["compare", "m.exr", "m.exr", "-o", "d"]).stdout;
    assert!(text.contains("index eta") && text.contains("100.0 %"), "{text}");
    assert!(w.names("d").contains(&"error-normal.png".to_owned()));
}

#[test]
fn what_cannot_be_rendered_or_compared_says_why() {
    let w = world();
    let sky = ["--sky", "overcast"];
    let render = |file: &'static str, rest: &[&'static str]| [&["render", file], rest].concat();
    w.refused(&render("none.exr", &sky), BAD_INPUT, &["none.exr", "Check the name"]);
    w.refused(&render("m.exr", &[]), USAGE, &["needs a light", "--sky"]);
    w.refused(&render("m.exr", &["--sky", "clear"]), USAGE, &["clear sky", "--sun"]);
    w.refused(&render("m.exr", &["--sky", "starry"]), USAGE, &["overcast"]);
    w.refused(&render("m.exr", &["--sun", "10,-4"]), USAGE, &["-4", "above 0"]);
    w.refused(&render("m.exr", &["--sky", "uniform", "--view", "120,0"]), USAGE, &["120", "from below"]);
    w.refused(&render("m.exr", &["--sky", "uniform", "--view", "10,0,0.1"]), USAGE, &["0.1", "too close"]);
    environment(&w.path("night.exr"), 0.0, 3.0);
    w.refused(&render("m.exr", &["--env", "night.exr"]), BAD_INPUT, &["above the horizon", "zenith up"]);
    environment(&w.path("odd.exr"), -1.0, 3.0);
    w.refused(&render("m.exr", &["--env", "odd.exr"]), BAD_INPUT, &["-1", "at least 0"]);
    w.refused(&render("night.exr", &sky), BAD_INPUT, &["not a map of material", "brewster fit"]);
    w.refused(&render("m.exr", &["--sky", "uniform", "--camera", "nowhere"]), BAD_INPUT, &["nowhere"]);
    w.refused(&["compare", "m.exr", "night.exr"], BAD_INPUT, &["m.exr", "night.exr", "pictures with pictures"]);
    w.refused(&["compare", "night.exr", "gone.exr"], BAD_INPUT, &["gone.exr"]);
    let bright: Picture = picture(16, 3, Samples::U8(vec![100; 3 * 16 * 16]), Encoding::Srgb);
    bright.write_png(&w.path("p.png")).unwrap();
    environment(&w.path("sky.exr"), 1.0, 1.0);
    w.refused(&["compare", "p.png", "sky.exr"], BAD_INPUT, &["coded differently"]);
}
