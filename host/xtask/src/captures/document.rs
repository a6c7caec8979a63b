//! The document and its sections: each between marks, replaced as a whole.

use crate::process;
use anyhow::{Context, Result, bail};
use std::path::Path;

pub(super) const FILE: &str = "docs/ACCURACY.md";

/// What is written at once.
#[derive(Clone, Copy)]
pub(super) enum Section {
    Captures,
    Inks,
    Coverage,
    Peer,
}

impl Section {
    const ALL: [Self; 4] = [Self::Captures, Self::Inks, Self::Coverage, Self::Peer];

    fn name(self) -> &'static str {
        match self {
            Self::Captures => "captures",
            Self::Inks => "inks",
            Self::Coverage => "coverage",
            Self::Peer => "peer",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Captures => "Rendered captures",
            Self::Inks => "Inks, after the paper's §5",
            Self::Coverage => "Intervals, and the biases of closed forms",
            Self::Peer => "The same fit with scipy",
        }
    }

    fn command(self) -> &'static str {
        match self {
            Self::Captures | Self::Inks => "cargo xtask captures",
            Self::Coverage => "cargo xtask coverage",
            Self::Peer => "cargo xtask fit-peer",
        }
    }
}

/// Replaces a section; makes the document if it is not there.
pub(super) fn write(section: Section, text: &str) -> Result<()> {
    let path = process::root().join(FILE);
    let document =
        if path.is_file() { std::fs::read_to_string(&path).with_context(|| FILE.to_owned())? } else { empty() };
    let date = process::output(process::command("date").args(["-u", "+%F"]), "date")?;
    let body = format!("`{}` on {}; {}.\n\n{}", section.command(), date.trim(), machine(), text);
    std::fs::write(&path, replaced(&document, section.name(), &body)?).with_context(|| FILE.to_owned())
}

/// A document without results.
fn empty() -> String {
    let mut text = "# Accuracy\n\nWhat the fit is worth, measured; the commands below write their own sections. \
                    Errors are against the truth of renderings and simulations: nothing here was photographed.\n"
        .to_owned();
    for section in Section::ALL {
        let (name, command) = (section.name(), section.command());
        text.push_str(&format!(
            "\n## {}\n\n<!-- {name} -->\nNot measured yet: `{command}`.\n<!-- end {name} -->\n",
            section.title()
        ));
    }
    text
}

fn replaced(document: &str, name: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end {name} -->"));
    let Some((before, rest)) = document.split_once(&begin) else { bail!("{FILE} has no {}", begin.trim()) };
    let Some((_, after)) = rest.split_once(&end) else { bail!("{FILE} has no {end}") };
    Ok(format!("{before}{begin}{}\n{end}{after}", text.trim_end()))
}

/// Lines with an empty one where a table, a title or a list begins or ends.
pub(super) fn spaced(lines: &[&str]) -> String {
    let kind = |line: &str| line.chars().next().filter(|c| "|-".contains(*c));
    let mut text = String::new();
    let mut last = None;
    for line in lines {
        let now = kind(line);
        if !text.is_empty() && (now != last || now.is_none()) {
            text.push('\n');
        }
        // The document's own titles are of the second level.
        text.push_str(if line.starts_with("## ") { "#" } else { "" });
        text.push_str(line);
        text.push('\n');
        last = now;
    }
    text
}

fn machine() -> String {
    let info = std::fs::read_to_string(Path::new("/proc/cpuinfo")).unwrap_or_default();
    let field = |name: &str| info.lines().find_map(|line| line.strip_prefix(name)?.split_once(": "));
    let model = field("model name").map_or("an unnamed processor", |(_, model)| model);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_replaced_and_the_rest_stays() {
        let document = empty();
        let once = replaced(&document, "inks", "a\n\n").unwrap();
        assert!(once.contains("<!-- inks -->\na\n<!-- end inks -->\n\n## Intervals"));
        assert_eq!(replaced(&once, "inks", "a").unwrap(), once);
        assert!(replaced(&document, "nothing", "").is_err());
    }

    #[test]
    fn tables_stand_apart() {
        assert_eq!(spaced(&["## A", "| b |", "| c |", "- d", "## E"]), "### A\n\n| b |\n| c |\n\n- d\n\n### E\n");
    }
}
