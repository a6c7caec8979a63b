//! Words that belong in no file: paths of somebody's machine.

use super::TextFile;

/// Put together here, so that this file does not contain them.
const MACHINE_PATHS: [&str; 3] = [concat!("/", "work/"), concat!("/", "root/"), concat!("/", "Users/")];

/// Adds every line that has one.
pub(super) fn check(files: &[TextFile], wrong: &mut Vec<String>) {
    for file in files {
        for (number, line) in (1..).zip(file.text.lines()) {
            for word in MACHINE_PATHS.iter().filter(|word| has_absolute(line, word)) {
                wrong.push(format!("{}:{number}: {word} is a path of one machine", file.path));
            }
        }
    }
}

/// Whether `path` stands in `line` as an absolute path, not as the middle of a longer one.
fn has_absolute(line: &str, path: &str) -> bool {
    line.match_indices(path).any(|(at, _)| {
        let before = line.get(..at).and_then(|text| text.chars().next_back());
        !before.is_some_and(|c| c.is_alphanumeric() || "._-/}~$".contains(c))
    })
}

#[cfg(test)]
mod tests {
    use super::{MACHINE_PATHS, has_absolute};

    #[test]
    fn absolute_paths_are_found_and_relative_ones_are_not() {
        for path in MACHINE_PATHS {
            assert!(has_absolute(&format!("see {path}x"), path) && has_absolute(&format!("\"{path}x\""), path));
            assert!(!has_absolute(&format!("src{path}x"), path) && !has_absolute(&format!("..{path}x"), path));
        }
    }
}
