//! The files a command line means.

use std::path::{Path, PathBuf};

use super::angles::template;
use super::file_name;
use crate::exit::Exit;
use crate::failure::Failure;

/// What a folder is searched for.
const EXTENSIONS: [&str; 5] = ["png", "tif", "tiff", "exr", "npy"];

/// The files as given, in order; or the pictures in the one folder given, by name, without those in `apart` (the dark and
/// the flat picture). A folder with pictures of several series is refused, as their frames would be mixed.
pub(crate) fn find(given: &[PathBuf], apart: &[&Path]) -> Result<Vec<PathBuf>, Failure> {
    if let Some(missing) = given.iter().find(|p| !p.exists()) {
        return Err(Failure::new(
            Exit::BadInput,
            format!("{}: no such file or folder", missing.display()),
            "Check the name and the folder you are in.",
        ));
    }
    let [folder] = given else {
        return match given.iter().find(|p| p.is_dir()) {
            None => Ok(given.to_vec()),
            Some(folder) => Err(Failure::new(
                Exit::Usage,
                format!("{} is a folder among several arguments", folder.display()),
                "Give one folder, or the files of one scene.",
            )),
        };
    };
    if !folder.is_dir() {
        return Ok(given.to_vec());
    }
    let unreadable = |e: std::io::Error| {
        Failure::new(Exit::BadInput, format!("{}: {e}", folder.display()), "Check that the folder can be read.")
    };
    let is_apart = |path: &Path| apart.iter().any(|a| a.canonicalize().ok() == path.canonicalize().ok());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let known = path.extension().and_then(|e| e.to_str()).is_some_and(|e| {
            let e = e.to_ascii_lowercase();
            EXTENSIONS.contains(&e.as_str())
        });
        if known && path.is_file() && !file_name(&path).starts_with('.') && !is_apart(&path) {
            files.push(path);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Failure::new(
            Exit::BadInput,
            format!("{}: no pictures in this folder ({} are looked for)", folder.display(), EXTENSIONS.join(", ")),
            "Name the files, or the folder that holds them.",
        ));
    }
    let mut series: Vec<(String, usize)> = Vec::new();
    for name in files.iter().map(|f| template(&file_name(f))) {
        match series.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => series.push((name, 1)),
        }
    }
    if series.len() > 1 {
        let list: Vec<String> = series.iter().map(|(name, count)| format!("{name} ({count})")).collect();
        return Err(Failure::new(
            Exit::BadInput,
            format!("{}: pictures of several series: {}", folder.display(), list.join(", ")),
            "Name the files of one series, for example with a * in the place of the angle.",
        ));
    }
    Ok(files)
}
