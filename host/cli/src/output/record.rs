//! `brewster.json`: what is in a folder, who made it, and that it is on the disk.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use serde::Deserialize;

/// The record in every folder.
pub(super) const RECORD: &str = "brewster.json";

#[derive(Deserialize)]
struct Record {
    files: Vec<String>,
}

/// All that is in a folder at any depth, sorted, relative to it, with `/` between the names: files, links (which are not
/// followed), and folders without anything in them (those end in `/`).
pub(super) fn contents(folder: &Path) -> io::Result<Vec<String>> {
    fn walk(folder: &Path, prefix: &str, found: &mut Vec<String>) -> io::Result<()> {
        let before = found.len();
        for entry in std::fs::read_dir(folder)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                walk(&entry.path(), &format!("{name}/"), found)?;
            } else {
                found.push(name);
            }
        }
        if found.len() == before && !prefix.is_empty() {
            found.push(prefix.to_owned());
        }
        Ok(())
    }
    let mut found = Vec::new();
    walk(folder, "", &mut found)?;
    found.sort();
    Ok(found)
}

/// The first of the folder's `contents` that its record does not list.
pub(super) fn foreign<'a>(folder: &Path, contents: &'a [String]) -> Option<&'a str> {
    let record = std::fs::read(folder.join(RECORD)).ok().and_then(|text| serde_json::from_slice::<Record>(&text).ok());
    let ours = record.map(|r| r.files).unwrap_or_default();
    // A folder of ours whose files were taken out is still ours.
    let is_ours =
        |name: &String| ours.contains(name) || name.ends_with('/') && ours.iter().any(|o| o.starts_with(name));
    contents.iter().find(|name| !is_ours(name)).map(String::as_str)
}

/// Writes a file and waits until it is on the disk.
pub(crate) fn write_durably(path: &Path, contents: &str) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(contents.as_bytes())?;
    file.sync_all()
}

/// Waits until the names in a folder, and in all folders in it, are on the disk. The files themselves are synced by those
/// who write them.
pub(super) fn sync_tree(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_tree(&entry.path())?;
        }
    }
    sync_folder(folder)
}

/// A rename is on the disk once its folder is. File systems that cannot say so (some on networks) are believed.
#[cfg(unix)]
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder)?.sync_all() {
        Err(e) if !matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Err(e),
        _ => Ok(()),
    }
}

#[cfg(not(unix))]
pub(super) fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}
