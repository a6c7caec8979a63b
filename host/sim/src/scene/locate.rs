//! Tables of a scene, and refusals that carry key and line.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;

use boards::locate::{Fault, FaultKind, place_of_key};

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
        let Fault { kind, place, expected } = Fault::new(self.file, self.text, error);
        match kind {
            FaultKind::Malformed => SimError::Parse { place, expected },
            FaultKind::UnknownKey => SimError::UnknownKey { place, expected },
            FaultKind::UnknownValue => SimError::UnknownValue { place, expected },
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
