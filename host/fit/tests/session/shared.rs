//! Reference data that may not be there.

use std::path::PathBuf;

use host_image::Layers;

/// A file or folder of the reference data, or `None` (after saying so) where it is missing.
pub(crate) fn path(below: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let file = root.join(below);
    if file.exists() {
        Some(file)
    } else {
        println!("skipped: no ../shared ({below})");
        None
    }
}

/// Float planes of an OpenEXR file.
pub(crate) fn layers(below: &str) -> Option<Layers<'static>> {
    Some(Layers::load(&path(below)?).unwrap())
}

pub(crate) fn json(below: &str) -> Option<serde_json::Value> {
    Some(serde_json::from_str(&std::fs::read_to_string(path(below)?).unwrap()).unwrap())
}
