//! Just enough reading of rustfmt-formatted Rust: which functions a file has, of which type, and with which docs.

use std::collections::BTreeSet;

/// A function as found in a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Function {
    /// Name, after the type of its `impl` block where it has one: `Mueller::rotation`.
    pub name: String,
    /// `pub`, without a restriction.
    pub public: bool,
    /// Its doc comment.
    pub doc: String,
}

/// A file's functions in order, and its `//!` header.
pub(super) struct Source {
    pub header: String,
    pub functions: Vec<Function>,
}

/// Reads `text`. Functions within modules or macros count like any other.
pub(super) fn read(text: &str) -> Source {
    let mut header = String::new();
    let mut functions = Vec::new();
    let mut owner: Option<String> = None;
    let mut doc = String::new();
    for line in text.lines() {
        let code = line.trim_start();
        if let Some(comment) = code.strip_prefix("//!") {
            header.push_str(comment);
        } else if let Some(comment) = code.strip_prefix("///") {
            doc.push_str(comment);
        } else if line.starts_with("impl") {
            owner = owner_of(line);
            doc.clear();
        } else if line == "}" {
            owner = None;
        } else if let Some((name, public)) = function(code) {
            let name = match &owner {
                // At the first level of the block: a function within a function is not the type's.
                Some(owner) if line.starts_with("    ") && !line.starts_with("     ") => format!("{owner}::{name}"),
                _ => name.to_owned(),
            };
            functions.push(Function { name, public, doc: std::mem::take(&mut doc) });
        } else if !code.starts_with('#') && !code.is_empty() && !code.ends_with(")]") {
            doc.clear();
        }
    }
    Source { header, functions }
}

/// `Mueller` of `impl<T> Trait for Mueller<T> {`.
fn owner_of(line: &str) -> Option<String> {
    let rest = line.strip_prefix("impl")?;
    // Generic parameters hold no `>` but their own: skip to the one that closes them.
    let mut depth = 0_u32;
    let start = rest.char_indices().find_map(|(at, c)| {
        match c {
            '<' => depth += 1,
            '>' => depth = depth.saturating_sub(1),
            _ if depth == 0 && !c.is_whitespace() => return Some(at),
            _ => {}
        }
        None
    })?;
    let target = rest.get(start..)?;
    let target = target.split_once(" for ").map_or(target, |(_, implementor)| implementor);
    let name: String = target.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    (!name.is_empty()).then_some(name)
}

/// Name and visibility where `code` begins a function.
fn function(code: &str) -> Option<(&str, bool)> {
    let (head, tail) = match code.strip_prefix("fn ") {
        Some(tail) => ("", tail),
        None => code.split_once(" fn ")?,
    };
    let qualifiers = ["pub", "const", "unsafe", "async", "extern"];
    let qualifies = |word: &str| qualifiers.contains(&word) || word.starts_with("pub(");
    if !head.split_whitespace().all(qualifies) {
        return None;
    }
    let end = tail.find(|c: char| !c.is_alphanumeric() && c != '_')?;
    Some((tail.get(..end)?, head.split_whitespace().any(|word| word == "pub")))
}

/// Numbers of the paper's equations (1 to 10) that `doc` cites: `eq. 5`, `eq. 1-4 and 8`, `eq. 1, 8`. Equations of other
/// sources have larger numbers or stand in parentheses, `eq. (7)`.
pub(super) fn citations(doc: &str) -> BTreeSet<u8> {
    let mut numbers = BTreeSet::new();
    for (at, found) in doc.match_indices("eq. ") {
        let mut rest = doc.get(at + found.len()..).unwrap_or_default();
        let mut range_from = None;
        loop {
            let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
            let Ok(number) = digits.parse::<u8>() else { break };
            rest = rest.get(digits.len()..).unwrap_or_default();
            if rest.starts_with(" ×") {
                break; // "eq. 6, 4 × 4": the shape of a matrix
            }
            if (1..=10).contains(&number) {
                numbers.extend(range_from.unwrap_or(number)..=number);
            }
            range_from = rest.starts_with('-').then_some(number);
            let separators = ["-", ", ", " and ", "/"];
            let Some(next) = separators.iter().find_map(|separator| rest.strip_prefix(separator)) else { break };
            rest = next;
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "\
//! Header, eq. 2.

/// Does (paper eq. 3)
/// something.
#[must_use]
pub fn free() {}

impl<const N: usize> From<Thing<N>> for Other<N> {
    /// Cites nothing.
    pub const fn method(self) -> fn(u8) {}

    pub(crate) fn inner() {
        fn nested() {}
    }
}

proptest! {
    #[test]
    fn a_law(x in 0..3) {
    }
}
";

    #[test]
    fn functions_are_found_with_their_types_and_docs() {
        let source = read(SOURCE);
        let names: Vec<(&str, bool)> = source.functions.iter().map(|f| (f.name.as_str(), f.public)).collect();
        let want =
            [("free", true), ("Other::method", true), ("Other::inner", false), ("nested", false), ("a_law", false)];
        assert_eq!(names, want);
        assert_eq!(citations(&source.header), [2].into());
        assert_eq!(citations(&source.functions[0].doc), [3].into());
        assert!(citations(&source.functions[1].doc).is_empty());
    }

    #[test]
    fn citations_are_read_as_people_write_them() {
        assert_eq!(citations("(paper eq. 2-4)"), [2, 3, 4].into());
        assert_eq!(citations("product of eq. 1-4 and 8 gives"), [1, 2, 3, 4, 8].into());
        assert_eq!(citations("eq. 1, 8; Heitz 2014, eq. 99; Walter 2007, eq. (7)"), [1, 8].into());
        assert_eq!(citations("f_r M of eq. 6, 4 × 4, per steradian"), [6].into());
        assert!(citations("eq. zero, no equation 5").is_empty());
    }
}
