//! A finished folder gets its name; and if somebody else has it by now, another one: work is never thrown away.

use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::record::{self, RECORD, write_durably};
use super::{CHECK, Name, OutputFolder, parent};
use crate::exit::Exit;
use crate::failure::Failure;

impl OutputFolder {
    /// Records, syncs and renames. The temporary folder is gone afterwards, unless nothing could be kept of it.
    pub(super) fn place(&mut self, result: &mut Value) -> Result<(), Failure> {
        let mut files = record::contents(self.path()).map_err(|e| self.failed(&e))?;
        files.push(RECORD.to_owned());
        files.sort();
        set(result, "files", json!(files));
        self.record(result)?;
        record::sync_tree(self.path()).map_err(|e| self.failed(&e))?;
        let aside = self.move_aside(result)?;
        while let Err(error) = self.rename() {
            if let Some(aside) = &aside {
                // If this fails, somebody has taken the name, and the old folder stays beside it.
                let _ = std::fs::rename(aside, &self.target);
            }
            match (&self.name, is_taken(&self.target)) {
                (_, false) => return Err(self.failed(&error)),
                (Name::Default(name), true) => self.destination = fresh(parent(&self.target), name),
                (Name::Given { .. }, true) => {
                    return Err(self.keep(result, "another program has written there meanwhile"));
                }
            }
            self.target = self.destination.clone();
            self.record(result)?;
        }
        // The parents that were made for it are new names in their own folders.
        let above = self.filling.made.iter().map(|made| parent(made));
        for folder in std::iter::once(parent(&self.target)).chain(above) {
            record::sync_folder(folder).map_err(|e| {
                let what = format!("{} is complete, but may not be on the disk yet: {e}", self.destination.display());
                Failure::new(Exit::Output, what, "Check the disk and the files before you rely on them.")
            })?;
        }
        if let Some(aside) = aside
            && let Err(error) = std::fs::remove_dir_all(&aside)
        {
            warn(result, format!("the replaced folder is still there, as {}: {error}", aside.display()));
        }
        Ok(())
    }

    /// Writes `brewster.json` with the name that the folder is about to get.
    fn record(&self, result: &mut Value) -> Result<(), Failure> {
        set(result, "output", json!(self.destination.to_string_lossy()));
        write_durably(&self.path().join(RECORD), &format!("{result:#}\n")).map_err(|e| self.failed(&e))
    }

    fn rename(&self) -> io::Result<()> {
        if cfg!(not(unix)) {
            // An empty folder is in the way on some systems; one that is not empty stays.
            let _ = std::fs::remove_dir(&self.target);
        }
        std::fs::rename(self.path(), &self.target)
    }

    /// With `--force`, moves what is to be replaced out of the way; it is looked through where nobody else looks for it, and
    /// comes back if anything in it is not brewster's.
    fn move_aside(&mut self, result: &mut Value) -> Result<Option<PathBuf>, Failure> {
        if !matches!(self.name, Name::Given { force: true }) || !is_taken(&self.target) {
            return Ok(None);
        }
        let aside = self.path().with_extension("old");
        std::fs::rename(&self.target, &aside).map_err(|e| self.failed(&e))?;
        let found = match record::contents(&aside) {
            Ok(contents) => record::foreign(&aside, &contents).map(str::to_owned),
            Err(error) => Some(error.to_string()),
        };
        let Some(foreign) = found else { return Ok(Some(aside)) };
        Err(match std::fs::rename(&aside, &self.target) {
            Ok(()) => self.keep(result, &format!("it holds {foreign} by now, which brewster did not make")),
            Err(e) => self.keep(result, &format!("it holds {foreign}, and is {} now: {e}", aside.display())),
        })
    }

    /// Leaves the finished folder under the next free name, and says so.
    fn keep(&mut self, result: &mut Value, why: &str) -> Failure {
        let wanted = self.destination.clone();
        let name = self.target.file_name().unwrap_or_default().to_string_lossy().into_owned();
        loop {
            let free = fresh(parent(&self.target), &name);
            self.target.set_file_name(free.file_name().unwrap_or_default());
            self.destination = self.target.clone();
            if let Err(failure) = self.record(result) {
                return failure;
            }
            match self.rename() {
                Ok(()) => break,
                Err(_) if is_taken(&self.target) => {}
                Err(error) => return self.failed(&error),
            }
        }
        Failure::new(
            Exit::Output,
            format!("cannot write {}: {why}; the results are in {}", wanted.display(), self.target.display()),
            "Nothing is lost: they are complete under that name.",
        )
    }

    fn failed(&self, error: &io::Error) -> Failure {
        Failure::new(Exit::Output, format!("cannot write {}: {error}", self.destination.display()), CHECK)
    }
}

/// `folder/name`, or the first of `folder/name-2`, ... that is not there.
pub(super) fn fresh(folder: &Path, name: &str) -> PathBuf {
    let mut path = folder.join(name);
    let mut number = 2;
    while path.symlink_metadata().is_ok() {
        path = folder.join(format!("{name}-{number}"));
        number += 1;
    }
    path
}

/// Whether anything but an empty folder has this name.
fn is_taken(path: &Path) -> bool {
    match std::fs::read_dir(path) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => path.symlink_metadata().is_ok(),
    }
}

fn set(result: &mut Value, key: &str, value: Value) {
    if let Some(object) = result.as_object_mut() {
        object.insert(key.into(), value);
    }
}

fn warn(result: &mut Value, text: String) {
    match result.get_mut("warnings").and_then(Value::as_array_mut) {
        Some(warnings) => warnings.push(text.into()),
        None => set(result, "warnings", json!([text])),
    }
}
