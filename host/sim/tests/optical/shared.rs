//! Reading reference data that may not be there.

use exr::prelude::{ReadChannels, ReadLayers};
use serde_json::Value;
use std::collections::HashMap;
use std::path::PathBuf;

/// A file of the reference data, or `None` (after saying so) where it is missing.
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

pub(crate) fn json(below: &str) -> Option<Value> {
    Some(serde_json::from_str(&std::fs::read_to_string(path(below)?).unwrap()).unwrap())
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Channels of an EXR file by name, each row-major, with (width, height).
pub(crate) fn exr(below: &str) -> Option<(usize, usize, HashMap<String, Vec<f32>>)> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path(below)?)
        .unwrap();
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list;
    let by_name = channels.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect();
    Some((size.width(), size.height(), by_name))
}
