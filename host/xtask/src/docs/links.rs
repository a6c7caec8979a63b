//! Relative links in Markdown files: each must lead to a file or folder of the tree.

use super::TextFile;
use std::path::Path;

/// Adds links that lead nowhere; returns how many there are.
pub(super) fn check(files: &[TextFile], root: &Path, wrong: &mut Vec<String>) -> usize {
    let mut count = 0;
    for file in files.iter().filter(|file| file.is("md")) {
        let folder = root.join(&file.path);
        let folder = folder.parent().unwrap_or(root);
        for target in relative_links(&file.text) {
            count += 1;
            if !folder.join(target).exists() {
                wrong.push(format!("{}: a link to {target}, which does not exist", file.path));
            }
        }
    }
    count
}

/// Targets of `[text](target)` without their anchors, those of other sites and of the same page left out.
fn relative_links(text: &str) -> impl Iterator<Item = &str> {
    let prose = text.split("```").step_by(2);
    prose.flat_map(|part| part.split("](").skip(1)).filter_map(|rest| {
        let target = rest.split([')', ' ']).next()?;
        let path = target.split('#').next()?;
        (!path.is_empty() && !path.contains("://") && !path.starts_with("mailto:")).then_some(path)
    })
}

#[cfg(test)]
mod tests {
    use super::relative_links;

    #[test]
    fn only_links_within_the_tree_count() {
        let text =
            "[a](docs/A.md#part) [b](https://example.org/x) [c](#here) ![d](e.png \"title\")\n```\nx[0](y)\n```\n";
        assert_eq!(relative_links(text).collect::<Vec<_>>(), ["docs/A.md", "e.png"]);
    }
}
