//! The built-in materials against the extract of the database they were typed from, which lives beside the checkout
//! (`BREWSTER_SHARED`, or ../shared). Formulas are held against independent values by `cargo xtask oracles`.

use host_optics::materials::ALL;
use serde_json::Value;
use std::path::PathBuf;

/// The built-in table against the extract it was typed from (refractiveindex.info, n and k at 630, 532 and 465 nm).
#[test]
fn named_materials_are_those_of_the_database() {
    let shared = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(shared.join("data/ior/ior_rgb.json")) else {
        println!("skipped: no ../shared (data/ior)");
        return;
    };
    let table: Value = serde_json::from_str(&text).unwrap();
    let pages: Vec<_> = table["materials"].as_object().unwrap().values().collect();
    for material in ALL {
        let page = pages
            .iter()
            .find(|p| {
                material.source.starts_with(&format!(
                    "{}, {}",
                    p["book"].as_str().unwrap(),
                    p["page"].as_str().unwrap()
                ))
            })
            .unwrap_or_else(|| panic!("no page for {}", material.source));
        for ((n, k), band) in material.rgb.into_iter().zip(["R", "G", "B"]) {
            let stated = page[band]["k"].as_f64().unwrap_or(0.0);
            assert!((n - page[band]["n"].as_f64().unwrap()).abs() < 1e-9, "{} {band}", material.name);
            assert!((k - stated).abs() < 2e-6, "{} {band}: k = {k}, stated {stated}", material.name);
        }
    }
    assert_eq!(pages.len(), ALL.len());
}
