//! Output folders: whole or not at all, and nobody's files are ever replaced by accident.
//!
//! Results are made in a temporary folder beside the final one and renamed at the end. Every finished folder holds
//! `brewster.json`, the result with the list of its files; `--force` replaces a folder only if it holds nothing else.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::exit::Exit;
use crate::failure::Failure;

/// The record in every folder.
const RECORD: &str = "brewster.json";

/// Where results go.
#[derive(clap::Args)]
pub(crate) struct OutputArgs {
    /// Folder for the results; without it, a new folder in out/
    #[arg(long, short, value_name = "DIR", help_heading = "Output")]
    output: Option<PathBuf>,
    /// Replace the output folder if brewster made everything in it
    #[arg(long, help_heading = "Output")]
    force: bool,
}

/// A folder that is being filled.
pub(crate) struct OutputFolder {
    destination: PathBuf,
    temporary: TempDir,
    replace: bool,
    /// The topmost parent folder that had to be made.
    made: Option<PathBuf>,
}

#[derive(Deserialize)]
struct Record {
    files: Vec<String>,
}

impl OutputFolder {
    /// Checks that the folder can be made, and starts it. `name` is the default's: `out/name`, or the first of `out/name-2`,
    /// `out/name-3`, ... that does not exist.
    pub(crate) fn prepare(args: &OutputArgs, name: &str) -> Result<Self, Failure> {
        let destination = args.output.clone().unwrap_or_else(|| fresh(Path::new("out"), name));
        let entries = entries(&destination)?;
        let replace = !entries.is_empty();
        if replace && !args.force {
            return Err(Failure::new(
                Exit::Output,
                format!("{} exists and is not empty", destination.display()),
                "Choose another folder with -o, or replace what brewster made there with --force.",
            ));
        }
        if replace {
            refuse_foreign(&destination, &entries)?;
        }
        let failed = |what: &Path, e: &std::io::Error| {
            Failure::new(
                Exit::Output,
                format!("cannot make a folder in {}: {e}", what.display()),
                "Check the free space and the permissions, or choose another folder with -o.",
            )
        };
        let parent = match destination.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let made = parent.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists()).last().map(Into::into);
        std::fs::create_dir_all(parent).map_err(|e| failed(parent, &e))?;
        let temporary = temporary_folder().tempdir_in(parent).map_err(|e| failed(parent, &e))?;
        Ok(Self { destination, temporary, replace, made })
    }

    /// Where to write, for now.
    pub(crate) fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Its final name.
    pub(crate) fn destination(&self) -> &Path {
        &self.destination
    }

    /// Adds `output` and `files` to the result, records it in the folder and gives the folder its name.
    pub(crate) fn commit(mut self, mut result: Value) -> Result<Value, Failure> {
        let destination = self.destination.clone();
        let failed = |e: std::io::Error| {
            Failure::new(
                Exit::Output,
                format!("cannot write {}: {e}", destination.display()),
                "Check the free space and the permissions, or choose another folder with -o.",
            )
        };
        let mut files: Vec<String> =
            entries(self.path())?.iter().map(|name| name.to_string_lossy().into_owned()).collect();
        files.push(RECORD.to_owned());
        files.sort();
        if let Some(object) = result.as_object_mut() {
            object.insert("output".into(), json!(destination));
            object.insert("files".into(), json!(files));
        }
        std::fs::write(self.path().join(RECORD), format!("{result:#}\n")).map_err(failed)?;
        if self.replace {
            // The old folder is moved aside first, and comes back if the new one cannot take its place.
            let aside = self.path().with_extension("old");
            std::fs::rename(&destination, &aside).map_err(failed)?;
            if let Err(e) = std::fs::rename(self.path(), &destination) {
                std::fs::rename(&aside, &destination).map_err(failed)?;
                return Err(failed(e));
            }
            std::fs::remove_dir_all(&aside).map_err(failed)?;
        } else {
            if destination.is_dir() {
                // Empty: some systems do not rename onto it.
                std::fs::remove_dir(&destination).map_err(failed)?;
            }
            std::fs::rename(self.path(), &destination).map_err(failed)?;
        }
        self.made = None;
        self.temporary.disable_cleanup(true);
        Ok(result)
    }

    /// `text` with the temporary folder's name replaced by the final one: for messages.
    pub(crate) fn in_words(&self, text: &str) -> String {
        text.replace(&*self.path().to_string_lossy(), &self.destination.to_string_lossy())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if let Some(made) = &self.made {
            // The temporary folder, then the parents that were made for it; those that are not empty stay.
            let _ = std::fs::remove_dir_all(self.temporary.path());
            let parents = self.destination.ancestors().skip(1).take_while(|p| p.starts_with(made));
            parents.for_each(|p| {
                let _ = std::fs::remove_dir(p);
            });
        }
    }
}

/// `folder/name`, or the first of `folder/name-2`, ... that is not there.
fn fresh(folder: &Path, name: &str) -> PathBuf {
    let mut path = folder.join(name);
    let mut number = 2;
    while path.symlink_metadata().is_ok() {
        path = folder.join(format!("{name}-{number}"));
        number += 1;
    }
    path
}

/// Names in a folder; none if it does not exist.
fn entries(folder: &Path) -> Result<Vec<OsString>, Failure> {
    let failed = |e: std::io::Error| {
        Failure::new(
            Exit::Output,
            format!("cannot use {} as an output folder: {e}", folder.display()),
            "Choose another folder with -o.",
        )
    };
    match std::fs::read_dir(folder) {
        Ok(entries) => entries.map(|e| e.map(|e| e.file_name())).collect::<Result<_, _>>().map_err(failed),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(e) => Err(failed(e)),
    }
}

/// Refuses a folder with anything in it that its record does not list.
fn refuse_foreign(folder: &Path, entries: &[OsString]) -> Result<(), Failure> {
    let record = std::fs::read(folder.join(RECORD)).ok().and_then(|text| serde_json::from_slice::<Record>(&text).ok());
    let ours = record.map(|r| r.files).unwrap_or_default();
    match entries.iter().find(|name| !ours.iter().any(|f| **name == **f)) {
        None => Ok(()),
        Some(foreign) => Err(Failure::new(
            Exit::Output,
            format!("{} holds {}, which brewster did not make", folder.display(), foreign.display()),
            "--force replaces only folders with nothing but brewster's own results: choose another folder with -o.",
        )),
    }
}

/// Temporary folders are private by default; this one becomes the user's own, with the usual mode less umask.
#[cfg(unix)]
fn temporary_folder() -> tempfile::Builder<'static, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".brewster-").permissions(std::fs::Permissions::from_mode(0o777));
    builder
}

#[cfg(not(unix))]
fn temporary_folder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".brewster-");
    builder
}
