//! The document and its sections: each between marks, replaced as a whole.

use crate::perf::{machine, replaced};
use crate::process;
use anyhow::{Context, Result};

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
    std::fs::write(&path, replaced(FILE, &document, section.name(), &format!("{}\n", body.trim_end()))?)
        .with_context(|| FILE.to_owned())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_replaced_and_the_rest_stays() {
        let document = empty();
        let once = replaced(FILE, &document, "inks", "a\n").unwrap();
        assert!(once.contains("<!-- inks -->\na\n<!-- end inks -->\n\n## Intervals"));
        assert_eq!(replaced(FILE, &once, "inks", "a\n").unwrap(), once);
        assert!(replaced(FILE, &document, "nothing", "").is_err());
    }

    #[test]
    fn tables_stand_apart() {
        assert_eq!(spaced(&["## A", "| b |", "| c |", "- d", "## E"]), "### A\n\n| b |\n| c |\n\n- d\n\n### E\n");
    }
}
