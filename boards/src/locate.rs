//! From a key to its line in the text, and from a position in the text to its key.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Place;

/// Where the dotted `key` stands; where it is absent, the nearest table above it that is present.
pub(crate) fn place_of_key(file: &Path, text: &str, key: &str) -> Place {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut table = root.get_ref();
    let mut offset = 0;
    for part in key.split('.') {
        let Some((name, value)) = table.get_key_value(part) else { break };
        offset = name.span().start;
        let DeValue::Table(inner) = value.get_ref() else { break };
        table = inner;
    }
    Place { file: file.to_path_buf(), line: line_of(text, offset), key: key.to_owned() }
}

/// The line of byte `offset`, and the innermost key whose own text or value covers it.
pub(crate) fn place_at(file: &Path, text: &str, offset: usize) -> Place {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut innermost = Innermost { offset, length: usize::MAX, key: String::new() };
    innermost.search(root.get_ref(), "");
    Place { file: file.to_path_buf(), line: line_of(text, offset), key: innermost.key }
}

struct Innermost {
    offset: usize,
    length: usize,
    key: String,
}

impl Innermost {
    fn search(&mut self, table: &DeTable<'_>, prefix: &str) {
        for (name, value) in table.iter() {
            let key =
                if prefix.is_empty() { name.get_ref().to_string() } else { format!("{prefix}.{}", name.get_ref()) };
            for span in [name.span(), Spanned::span(value)] {
                if span.contains(&self.offset) && span.len() < self.length {
                    self.length = span.len();
                    self.key.clone_from(&key);
                }
            }
            if let DeValue::Table(inner) = value.get_ref() {
                self.search(inner, &key);
            }
        }
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
}
