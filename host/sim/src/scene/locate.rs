//! From a key to its line in the text, from a position in the text to its key, and refusals that carry both.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use crate::{Place, SimError};

/// A table of the scene: what its values are checked against and how refusals find their line.
#[derive(Clone)]
pub(super) struct At<'a> {
    file: &'a Path,
    text: &'a str,
    table: String,
}

impl<'a> At<'a> {
    /// The top of `text`, which `file` names.
    pub(super) fn root(text: &'a str, file: &'a Path) -> Self {
        Self { file, text, table: String::new() }
    }

    /// The table (or the entry of a list) `name` inside this one.
    pub(super) fn table(&self, name: impl Display) -> Self {
        Self { table: self.dotted(&name.to_string()), ..*self }
    }

    /// Where `key` of this table stands; the table itself for an empty key.
    pub(super) fn place(&self, key: &str) -> Place {
        place_of_key(self.file, self.text, &self.dotted(key))
    }

    /// `path` as the scene means it: relative to the scene's own folder.
    pub(super) fn resolve(&self, path: &Path) -> std::path::PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(path)
    }

    /// Refuses a value outside `allowed`; NaN is in no range.
    pub(super) fn within(
        &self,
        key: &str,
        value: impl Into<f64>,
        allowed: RangeInclusive<f64>,
    ) -> Result<(), SimError> {
        let value = value.into();
        self.check(allowed.contains(&value), key, value, || format!("{} to {}", allowed.start(), allowed.end()))
    }

    /// Refuses `value` of `key` unless `holds`.
    pub(super) fn check(
        &self,
        holds: bool,
        key: &str,
        value: impl Display,
        allowed: impl FnOnce() -> String,
    ) -> Result<(), SimError> {
        if holds {
            return Ok(());
        }
        Err(SimError::OutOfRange { place: self.place(key), value: value.to_string(), allowed: allowed() })
    }

    /// A contradiction of keys, or one that is missing.
    pub(super) fn malformed(&self, key: &str, expected: impl Into<String>) -> SimError {
        SimError::Parse { place: self.place(key), expected: expected.into() }
    }

    /// A name nothing has.
    pub(super) fn unknown(&self, key: &str, name: &str, known: &[&str]) -> SimError {
        let expected = format!("unknown name `{name}`, expected one of {}", known.join(", "));
        SimError::UnknownValue { place: self.place(key), expected }
    }

    /// What the physics refused.
    pub(super) fn optics<T>(&self, key: &str, result: Result<T, host_optics::OpticsError>) -> Result<T, SimError> {
        result.map_err(|source| SimError::Optics { place: self.place(key), source })
    }

    /// A parser error with its file, line and key, and its kind.
    pub(super) fn parser(&self, error: &toml::de::Error) -> SimError {
        let place = place_at(self.file, self.text, error.span().map_or(0, |span| span.start));
        let expected = error.message().to_owned();
        // toml has no error kinds; these two openings are serde's own (`de::Error::unknown_field`, `unknown_variant`).
        if expected.starts_with("unknown field") {
            SimError::UnknownKey { place, expected }
        } else if expected.starts_with("unknown variant") {
            SimError::UnknownValue { place, expected }
        } else {
            SimError::Parse { place, expected }
        }
    }

    fn dotted(&self, key: &str) -> String {
        match (self.table.is_empty(), key.is_empty()) {
            (true, _) => key.to_owned(),
            (false, true) => self.table.clone(),
            (false, false) => format!("{}.{key}", self.table),
        }
    }
}

/// Where the dotted `key` stands; where it is absent, the nearest table above it that is present.
fn place_of_key(file: &Path, text: &str, key: &str) -> Place {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut table = Some(root.get_ref());
    let mut list: Option<&DeArray<'_>> = None;
    let mut offset = 0;
    for part in key.split('.') {
        let value = if let Some(inside) = table {
            let Some((name, value)) = inside.get_key_value(part) else { break };
            offset = name.span().start;
            value
        } else {
            let entry = list.and_then(|entries| entries.get(part.parse::<usize>().ok()?));
            let Some(value) = entry else { break };
            offset = Spanned::span(value).start;
            value
        };
        (table, list) = match value.get_ref() {
            DeValue::Table(inner) => (Some(inner), None),
            DeValue::Array(entries) => (None, Some(entries)),
            _ => (None, None),
        };
    }
    Place { file: file.to_path_buf(), line: line_of(text, offset), key: key.to_owned() }
}

/// The line of byte `offset`, and the innermost key whose own text or value covers it.
fn place_at(file: &Path, text: &str, offset: usize) -> Place {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut innermost = Innermost { offset, length: usize::MAX, key: String::new() };
    innermost.search_table(root.get_ref(), "");
    Place { file: file.to_path_buf(), line: line_of(text, offset), key: innermost.key }
}

struct Innermost {
    offset: usize,
    length: usize,
    key: String,
}

impl Innermost {
    fn search_table(&mut self, table: &DeTable<'_>, prefix: &str) {
        for (name, value) in table.iter() {
            let key =
                if prefix.is_empty() { name.get_ref().to_string() } else { format!("{prefix}.{}", name.get_ref()) };
            self.offer(name.span(), &key);
            self.search_value(value, &key);
        }
    }

    fn search_value(&mut self, value: &Spanned<DeValue<'_>>, key: &str) {
        self.offer(Spanned::span(value), key);
        match value.get_ref() {
            DeValue::Table(inner) => self.search_table(inner, key),
            DeValue::Array(entries) => {
                for (index, entry) in entries.iter().enumerate() {
                    self.search_value(entry, &format!("{key}.{index}"));
                }
            }
            _ => {}
        }
    }

    fn offer(&mut self, span: std::ops::Range<usize>, key: &str) {
        if span.contains(&self.offset) && span.len() < self.length {
            self.length = span.len();
            key.clone_into(&mut self.key);
        }
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
}
