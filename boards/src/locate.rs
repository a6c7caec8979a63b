//! From a key to its line in a TOML text, from a position in the text to its key, and what kind of mistake a parser found: for
//! every file that people write.

use std::fmt;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Where in which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file as the caller named it.
    pub file: PathBuf,
    /// Line, counted from 1. A key that is missing has the line of the table it belongs in.
    pub line: usize,
    /// Dotted key, such as `wheel.servo.pulse_min_us` or `view.1.theta_deg` (tables of a list count from 0); empty where the
    /// text is not yet a key.
    pub key: String,
}

/// A parser's refusal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What kind of mistake it is.
    pub kind: FaultKind,
    /// Where.
    pub place: Place,
    /// What stands there and what was expected, in the parser's words.
    pub expected: String,
}

/// Kinds of mistakes a parser tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// Not TOML, a value of the wrong type, or a key missing.
    Malformed,
    /// A key the schema does not have.
    UnknownKey,
    /// A word the schema does not have for this key.
    UnknownValue,
}

impl Fault {
    /// Of what the parser said of the text of `file`.
    #[must_use]
    pub fn new(file: &Path, text: &str, error: &toml::de::Error) -> Self {
        let place = place_at(file, text, error.span().map_or(0, |span| span.start));
        let expected = error.message().to_owned();
        // toml has no error kinds; these two openings are serde's own (`de::Error::unknown_field`, `unknown_variant`).
        let kind = if expected.starts_with("unknown field") {
            FaultKind::UnknownKey
        } else if expected.starts_with("unknown variant") {
            FaultKind::UnknownValue
        } else {
            FaultKind::Malformed
        };
        Self { kind, place, expected }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)?;
        if self.key.is_empty() { Ok(()) } else { write!(f, ": `{}`", self.key) }
    }
}

/// Where the dotted `key` stands; where it is absent, the nearest table above it that is present.
#[must_use]
pub fn place_of_key(file: &Path, text: &str, key: &str) -> Place {
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
