//! Documents against the tree: what docs/ says exists does, and what must be said there is.

mod equations;
mod links;
mod source;
mod words;

use crate::{numerics, process};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Folders that hold nothing of ours.
const SKIPPED: [&str; 4] = [".git", "target", "out", "node_modules"];

/// A text file of the tree.
pub(crate) struct TextFile {
    /// From the root, with slashes.
    pub path: String,
    pub text: String,
}

impl TextFile {
    fn is(&self, extension: &str) -> bool {
        Path::new(&self.path).extension().is_some_and(|e| e == extension)
    }
}

/// Runs every check and reports all that is wrong at once.
pub(crate) fn check() -> Result<String> {
    let root = process::root();
    let files = text_files(&root)?;
    let mut wrong = Vec::new();
    let functions = equations::check(&files, &mut wrong);
    let links = links::check(&files, &root, &mut wrong);
    words::check(&files, &mut wrong);
    if let Err(error) = numerics::run(false) {
        wrong.push(format!("{error:#}"));
    }
    if !wrong.is_empty() {
        bail!("{} found:\n  {}", wrong.len(), wrong.join("\n  "));
    }
    Ok(format!("{functions} functions of equations, {links} links, {} files", files.len()))
}

/// All UTF-8 files below `root`, sorted by path.
fn text_files(root: &Path) -> Result<Vec<TextFile>> {
    let mut files = Vec::new();
    let mut open: Vec<PathBuf> = vec![root.to_path_buf()];
    while let Some(folder) = open.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
        for entry in entries {
            let entry = entry?;
            let path = entry.path();
            let name = entry.file_name();
            let kind = entry.file_type()?;
            if kind.is_dir() && !SKIPPED.iter().any(|skipped| name == *skipped) {
                open.push(path);
            } else if kind.is_file()
                // Other people edit while this runs: a file that has gone is no finding, one that is not text neither.
                && let Ok(text) = std::fs::read_to_string(&path)
            {
                let relative = path.strip_prefix(root).unwrap_or(&path);
                let path = relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/");
                files.push(TextFile { path, text });
            }
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}
