//! Reading the tables, and the worst case of a family.

use glam::DVec3;
use serde_json::Value;
use std::path::PathBuf;

/// The parsed file, or `None` (after saying so) where the tables are not there.
pub(crate) fn table(path: &str) -> Option<Value> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(root.join("oracles").join(path)) else {
        println!("skipped: no ../shared (oracles/{path})");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

pub(crate) fn cases(table: &Value) -> &[Value] {
    table["cases"].as_array().unwrap()
}

/// A number, written as one or as a decimal string.
pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

pub(crate) fn vector(value: &Value) -> DVec3 {
    DVec3::from_slice(&numbers(value))
}

pub(crate) fn unit(value: &Value) -> DVec3 {
    vector(value).normalize()
}

/// The worst of many comparisons, kept with its name.
#[derive(Default)]
pub(crate) struct Worst {
    pub(crate) error: f64,
    pub(crate) at: String,
    pub(crate) count: usize,
}

impl Worst {
    pub(crate) fn see(&mut self, found: f64, expected: f64, scale: f64, at: &str) {
        let miss = (found - expected).abs();
        // 0 against 0 on a scale of 0 is right.
        let error = if miss > 0.0 { miss / scale.abs() } else { miss };
        self.count += 1;
        assert!(!error.is_nan(), "{at}: {found} against {expected} (scale {scale})");
        if error > self.error {
            self.error = error;
            self.at = format!("{at}: {found:e} against {expected:e}");
        }
    }

    pub(crate) fn below(&self, bound: f64, what: &str) {
        println!("{what}: worst {:.2e} of {} values ({})", self.error, self.count, self.at);
        assert!(self.error <= bound && self.count > 0, "{what}: {:.2e} > {bound:e} at {}", self.error, self.at);
    }
}
