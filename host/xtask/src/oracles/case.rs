//! Reading a case of a table: JSON numbers, or decimal strings with more digits than an f64 holds.

use anyhow::{Context, Result};
use glam::DVec3;
use serde_json::Value;

/// One case, with the name of the list it stands in.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    pub(super) group: &'a str,
    position: usize,
    value: &'a Value,
}

impl<'a> Case<'a> {
    /// Every entry of every list of objects at the top of a file; lists of numbers or names there describe the file.
    pub(super) fn of_file(file: &'a Value) -> Vec<Self> {
        let lists = file.as_object().into_iter().flatten().filter_map(|(group, list)| Some((group, list.as_array()?)));
        lists.flat_map(|(group, list)| entries(group, list)).filter(|case| case.value.is_object()).collect()
    }

    /// What to call it in a report.
    pub(super) fn name(&self) -> String {
        let index = self.value.get("index").and_then(Value::as_u64);
        let number = index.map_or_else(|| format!("{} {}", self.group, self.position), |i| format!("case {i}"));
        let tag = |key| self.value.get(key).and_then(Value::as_str).filter(|tag| !tag.is_empty());
        let tag = ["tag", "kind", "role", "name", "bsdf"].into_iter().find_map(tag);
        tag.map_or_else(|| number.clone(), |tag| format!("{number}, {tag}"))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.value.get(key).is_some()
    }

    pub(super) fn number(&self, key: &str) -> Result<f64> {
        number(self.field(key)?).with_context(|| format!("{key} is not a number"))
    }

    pub(super) fn numbers(&self, key: &str) -> Result<Vec<f64>> {
        numbers(self.field(key)?).with_context(|| format!("{key} is not a list of numbers"))
    }

    /// The first three of a list of numbers.
    pub(super) fn triple(&self, key: &str) -> Result<[f64; 3]> {
        self.numbers(key)?.first_chunk().copied().with_context(|| format!("{key} has fewer than three numbers"))
    }

    /// A list of lists.
    pub(super) fn rows(&self, key: &str) -> Result<Vec<Vec<f64>>> {
        let rows = self.field(key)?.as_array().and_then(|rows| rows.iter().map(numbers).collect());
        rows.with_context(|| format!("{key} is not a matrix"))
    }

    /// A 4 × 4 matrix, in rows or as 16 numbers.
    pub(super) fn matrix(&self, key: &str) -> Result<[[f64; 4]; 4]> {
        let flat = self.numbers(key).or_else(|_| self.rows(key).map(|rows| rows.concat()))?;
        let (rows, rest) = flat.as_chunks::<4>();
        let rows = rows.try_into().ok().filter(|_| rest.is_empty());
        rows.with_context(|| format!("{key} is not a 4 x 4 matrix"))
    }

    pub(super) fn vector(&self, key: &str) -> Result<DVec3> {
        Ok(DVec3::from_array(self.triple(key)?))
    }

    /// A direction, normalized in f64.
    pub(super) fn unit(&self, key: &str) -> Result<DVec3> {
        self.vector(key)?.try_normalize().with_context(|| format!("{key} is not a direction"))
    }

    pub(super) fn text(&self, key: &str) -> Result<&'a str> {
        self.field(key)?.as_str().with_context(|| format!("{key} is not text"))
    }

    pub(super) fn flag(&self, key: &str) -> Result<bool> {
        self.field(key)?.as_bool().with_context(|| format!("{key} is neither true nor false"))
    }

    /// A list of words.
    pub(super) fn texts(&self, key: &str) -> Result<Vec<&'a str>> {
        let texts = self.field(key)?.as_array().and_then(|list| list.iter().map(Value::as_str).collect());
        texts.with_context(|| format!("{key} is not a list of text"))
    }

    /// A list of objects inside this one.
    pub(super) fn list(&self, key: &'a str) -> Result<Vec<Self>> {
        let list = self.field(key)?.as_array().with_context(|| format!("{key} is not a list"))?;
        Ok(entries(key, list).collect())
    }

    /// An object inside this one.
    pub(super) fn object(&self, key: &'a str) -> Result<Self> {
        Ok(Self { group: key, position: 0, value: self.field(key)? })
    }

    fn field(&self, key: &str) -> Result<&'a Value> {
        self.value.get(key).with_context(|| format!("no field {key}"))
    }
}

fn entries<'a>(group: &'a str, list: &'a [Value]) -> impl Iterator<Item = Case<'a>> {
    list.iter().enumerate().map(move |(position, value)| Case { group, position, value })
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.parse().ok())
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(number).collect()
}
