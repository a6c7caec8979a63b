//! docs/EQUATIONS.md: a table of equation → function → test, checked both ways.
//!
//! A row is `| number | words | functions | tests |`; each function and test is `path::name` in backquotes, with the type
//! in front of a method's name. Every one must exist, the function's docs (or its file's header) must cite the equation,
//! and every public function whose docs cite one must stand in a row of it.

use super::TextFile;
use super::source::{self, Source};
use std::collections::{BTreeMap, BTreeSet};

const TABLE: &str = "docs/EQUATIONS.md";

/// Adds what is wrong; returns how many functions the table names.
pub(super) fn check(files: &[TextFile], wrong: &mut Vec<String>) -> usize {
    let Some(table) = files.iter().find(|file| file.path == TABLE) else {
        wrong.push(format!("{TABLE} is missing"));
        return 0;
    };
    let sources: BTreeMap<&str, Source> =
        files.iter().filter(|file| file.is("rs")).map(|file| (file.path.as_str(), source::read(&file.text))).collect();
    let mut named: BTreeSet<(u8, String)> = BTreeSet::new();
    let mut equations = BTreeSet::new();
    for (number, functions, tests) in table.text.lines().filter_map(row) {
        equations.insert(number);
        for reference in &functions {
            match find(&sources, reference) {
                None => wrong.push(format!("{TABLE}: eq. {number}: no function `{reference}`")),
                Some(docs) if !source::citations(&docs).contains(&number) => {
                    wrong.push(format!("{TABLE}: the docs of `{reference}` do not cite eq. {number}"));
                }
                Some(_) => {}
            }
            named.insert((number, reference.clone()));
        }
        for reference in &tests {
            if find(&sources, reference).is_none() {
                wrong.push(format!("{TABLE}: eq. {number}: no test `{reference}`"));
            }
        }
        if functions.is_empty() || tests.is_empty() {
            wrong.push(format!("{TABLE}: eq. {number}: a row without a function or without a test"));
        }
    }
    wrong.extend((1..=10).filter(|n| !equations.contains(n)).map(|n| format!("{TABLE}: eq. {n} has no row")));
    // The checker's own examples are no citations.
    for (path, source) in sources.iter().filter(|(path, _)| path.contains("/src/") && !path.contains("/xtask/")) {
        for function in source.functions.iter().filter(|function| function.public) {
            let reference = format!("{path}::{}", function.name);
            for number in source::citations(&function.doc) {
                if !named.contains(&(number, reference.clone())) {
                    wrong.push(format!("{TABLE}: `{reference}` cites eq. {number} and is not in its row"));
                }
            }
        }
    }
    named.len()
}

/// Number, functions and tests of a table row; `None` for any other line.
fn row(line: &str) -> Option<(u8, Vec<String>, Vec<String>)> {
    let cells: Vec<&str> = line.trim().strip_prefix('|')?.strip_suffix('|')?.split('|').collect();
    let [number, _, functions, tests] = cells[..] else { return None };
    Some((number.trim().parse().ok()?, backquoted(functions), backquoted(tests)))
}

fn backquoted(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Docs and file header of `path::name`.
fn find(sources: &BTreeMap<&str, Source>, reference: &str) -> Option<String> {
    let (path, name) = reference.split_once("::")?;
    let source = sources.get(path)?;
    let function = source.functions.iter().find(|function| function.name == name)?;
    Some(format!("{} {}", function.doc, source.header))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = "/// Paper eq. 3.\npub fn turn() {}\n\n/// Paper eq. 5.\npub fn solve() {}\n";

    fn findings(table: &str) -> Vec<String> {
        let file = |path: &str, text: &str| TextFile { path: path.into(), text: text.into() };
        let files = [
            file(TABLE, table),
            file("a/src/lib.rs", CODE),
            file("a/tests/laws.rs", "#[test]\nfn turns_compose() {}\n"),
        ];
        let mut wrong = Vec::new();
        check(&files, &mut wrong);
        wrong.retain(|line| !line.ends_with("has no row"));
        wrong
    }

    #[test]
    fn a_true_table_passes_and_every_lie_is_found() {
        let three = "| 3 | rotation | `a/src/lib.rs::turn` | `a/tests/laws.rs::turns_compose` |\n";
        let five = "| 5 | three angles | `a/src/lib.rs::solve` | `a/tests/laws.rs::turns_compose` |\n";
        assert_eq!(findings(&format!("{three}{five}")), Vec::<String>::new());
        assert!(findings(three)[0].contains("`a/src/lib.rs::solve` cites eq. 5"));
        let misspelt = three.replace("turns_compose", "turns_composed");
        assert!(findings(&format!("{misspelt}{five}"))[0].contains("no test"));
        let gone = three.replace("::turn`", "::turned`");
        assert!(findings(&format!("{gone}{three}{five}"))[0].contains("no function"));
        let other = five.replace("| 5 |", "| 4 |");
        assert!(findings(&format!("{three}{five}{other}"))[0].contains("do not cite eq. 4"));
    }
}
