//! `brewster fit` as its users meet it: a small capture, a share of the tiles, what is refused.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::world::World;

/// A capture of the reference data, or `None` (after saying so).
fn capture(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let folder = root.join("captures").join(name);
    if folder.exists() {
        return folder.canonicalize().ok();
    }
    println!("skipped: no ../shared ({name})");
    None
}

/// A views.json of one view and whatever else.
fn views(world: &World, change: impl Fn(&mut Value), capture: &Path) {
    let own = capture.join("v0");
    let mut view: Value = serde_json::from_str(&std::fs::read_to_string(own.join("capture.json")).unwrap()).unwrap();
    view.as_object_mut().unwrap().remove("light");
    for frame in view["sequences"].as_object_mut().unwrap().values_mut().flat_map(|s| s.as_array_mut().unwrap()) {
        frame["file"] = json!(own.join(frame["file"].as_str().unwrap()));
    }
    let light = json!({ "type": "constant", "radiance": [1, 1, 1] });
    let mut document = json!({ "version": 1, "views": [view], "light": light });
    change(&mut document);
    std::fs::write(world.path("views.json"), document.to_string()).unwrap();
}

#[test]
fn closed_maps_come_out_whole_and_from_shares() {
    let Some(capture) = capture("S3_const") else { return };
    let (world, capture) = (World::new(), capture.display().to_string());
    let fit = |more: &[&str]| {
        let mut all = vec!["fit", "--mode", "closed", "--resolution", "48", "--tile", "16", "--wheel-sigma", "0"];
        all.extend(more);
        world.ok(&all)
    };
    let run = fit(&[&capture, "-o", "whole", "--json"]);
    let result: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((&result["samples"], &result["output"]), (&json!(48 * 48), &json!("whole")));
    assert!(result["fitted"].as_u64().unwrap() > 2000 && result["megapixels_per_second"].as_f64().unwrap() > 0.0);
    for file in ["material.exr", "report.html", "eta.png", "reasons.png", "misfit-histogram.png", "brewster.json"] {
        assert!(world.path("whole").join(file).is_file(), "{file}");
    }
    // The tiles were of use until the end only.
    assert!(!world.path("whole.tiles").exists());
    for (share, folder) in [("0/2", "a"), ("1/2", "b")] {
        fit(&[&capture, "--tiles", share, "-o", folder]);
    }
    world.ok(&["fit", "--merge", "a", "b", "-o", "joined"]);
    let load = |folder: &str| host_fit::maps::MaterialMaps::load_exr(&world.path(folder).join("material.exr")).unwrap();
    let (mut whole, mut joined) = (load("whole"), load("joined"));
    whole.attributes.clear();
    joined.attributes.clear();
    assert!(whole.same_bits(&joined));
    world.refused(&["fit", "--merge", "a", "-o", "half"], 3, &["tiles are missing"]);
}

#[test]
fn captures_that_cannot_be_fitted_are_refused_in_words() {
    let Some(capture) = capture("S3_const") else { return };
    let world = World::new();
    world.refused(&["fit", "nowhere"], 3, &["nowhere"]);
    std::fs::create_dir(world.path("empty")).unwrap();
    world.refused(&["fit", "empty"], 3, &["views.json", "capture.json"]);
    views(&world, |_| {}, &capture);
    world.refused(&["fit", "views.json"], 7, &["1 view", "at least 2", "another side"]);
    views(&world, |d| drop(d.as_object_mut().unwrap().remove("light")), &capture);
    world.refused(&["fit", "views.json"], 3, &["light is missing", "--light"]);
    views(&world, |d| d["views"][0]["polarizer"]["angle_convention"] = json!("clockwise"), &capture);
    world.refused(&["fit", "views.json"], 3, &["angle_convention", "clockwise", "counter-clockwise"]);
    views(&world, |d| d["version"] = json!(9), &capture);
    world.refused(&["fit", "views.json"], 3, &["version", "9"]);
    let folder = capture.display().to_string();
    world.refused(&["fit", &folder, "--views", "7"], 2, &["--views 7", "there are 3"]);
    world.refused(&["fit", &folder, "--metal", "water"], 2, &["gold"]);
    world.refused(&["fit", &folder, "--tiles", "3/3", "-o", "x"], 2, &["3/3"]);
    world.refused(&["fit", &folder, "--light", "none.exr"], 3, &["none.exr"]);
    world.refused(&["fit", &folder, "--model-sigma", "3", "--mode", "closed"], 2, &["model's sigma is 3"]);
}
