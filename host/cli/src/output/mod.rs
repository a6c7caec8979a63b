//! Output folders: whole or not at all, and nobody's files are ever replaced by accident.
//!
//! Results are made in a temporary folder beside the final one and renamed at the end, on the disk before anyone is told
//! so. Every finished folder holds `brewster.json`, the result with the list of its files; `--force` replaces a folder
//! only if it holds nothing else, at any depth.

mod place;
mod record;
pub(crate) mod signals;

use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use crate::exit::Exit;
use crate::failure::Failure;
use place::fresh;
pub(crate) use record::write_durably;
use signals::Filling;

/// What to do where the machine says no.
const CHECK: &str = "Check the free space and the permissions, or choose another folder with -o.";

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

impl OutputArgs {
    /// The folder that was named.
    pub(crate) fn output(&self) -> Option<&PathBuf> {
        self.output.as_ref()
    }
}

/// A folder that is being filled.
pub(crate) struct OutputFolder {
    /// The final name as people know it.
    destination: PathBuf,
    /// The same place with links followed.
    target: PathBuf,
    name: Name,
    temporary: TempDir,
    filling: Filling,
}

/// Who chose the final name.
enum Name {
    /// The program: `out/` and this, or the next number that is free.
    Default(String),
    /// The user; `force` allows to replace what brewster made there.
    Given { force: bool },
}

impl OutputFolder {
    /// Checks that the folder can be made, and starts it. `name` is the default's: `out/name`, or the first of `out/name-2`,
    /// `out/name-3`, ... that does not exist.
    pub(crate) fn prepare(args: &OutputArgs, name: &str) -> Result<Self, Failure> {
        let (destination, target, name) = match &args.output {
            None => {
                let destination = fresh(Path::new("out"), name);
                (destination.clone(), destination, Name::Default(name.to_owned()))
            }
            Some(given) => (given.clone(), locate(given, args.force)?, Name::Given { force: args.force }),
        };
        let parent = parent(&target);
        let failed = |e: &std::io::Error| {
            Failure::new(Exit::Output, format!("cannot make a folder in {}: {e}", parent.display()), CHECK)
        };
        let missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let made: Vec<PathBuf> = parent.ancestors().take_while(missing).map(Into::into).collect();
        // A signal waits until the folder is on the list of what to remove.
        let mut held = signals::hold();
        std::fs::create_dir_all(parent).map_err(|e| failed(&e))?;
        let temporary = temporary_folder().tempdir_in(parent).map_err(|e| failed(&e))?;
        let filling = Filling { folder: temporary.path().to_owned(), made };
        *held = Some(filling.clone());
        drop(held);
        Ok(Self { destination, target, name, temporary, filling })
    }

    /// Where to write, for now.
    pub(crate) fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Its final name, unless another program takes that first.
    pub(crate) fn destination(&self) -> &Path {
        &self.destination
    }

    /// Adds `output` (the name it got) and `files` to the result, records it in the folder and gives the folder its name;
    /// all is on the disk after that. What went wrong without harm is added to the result's `warnings`.
    pub(crate) fn commit(mut self, mut result: Value) -> Result<Value, Failure> {
        // A signal waits: half way between two names is no place to stop.
        let mut held = signals::hold();
        let placed = self.place(&mut result);
        if !self.path().exists() {
            self.temporary.disable_cleanup(true);
            *held = None;
        }
        drop(held);
        placed.map(|()| result)
    }

    /// `text` with the temporary folder's name replaced by the final one: for messages.
    pub(crate) fn in_words(&self, text: &str) -> String {
        text.replace(&*self.path().to_string_lossy(), &self.destination.to_string_lossy())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // After a success neither is there, or the parents are not empty.
        self.filling.remove();
    }
}

/// Where a name that the user gave leads to, if results can go there.
fn locate(given: &Path, force: bool) -> Result<PathBuf, Failure> {
    let refused = |what: &str, advice: &str| Failure::new(Exit::Output, format!("{} {what}", given.display()), advice);
    let another = "Choose another folder with -o; it is made if it does not exist.";
    if given.to_str().is_none() {
        return Err(refused("is not a name in UTF-8, which the record of the results could not hold", another));
    }
    let real = match given.canonicalize() {
        Ok(real) => real,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            if given.symlink_metadata().is_ok() {
                return Err(refused("is a link that leads nowhere", another));
            }
            if given.file_name().is_none() {
                return Err(refused("is not the name of a folder that could be made", another));
            }
            return Ok(given.to_owned());
        }
        Err(e) => return Err(refused(&format!("cannot be an output folder: {e}"), another)),
    };
    if !real.is_dir() {
        return Err(refused("exists and is not a folder", another));
    }
    let here = std::env::current_dir().and_then(|d| d.canonicalize()).ok();
    if here.is_some_and(|here| here.starts_with(&real)) {
        let advice = "Results get a folder of their own: name one that does not exist, such as -o result.";
        return Err(refused("is the folder you are in, or holds it", advice));
    }
    let contents = record::contents(&real).map_err(|e| refused(&format!("cannot be read: {e}"), another))?;
    if !contents.is_empty() && !force {
        return Err(refused(
            "exists and is not empty",
            "Choose another folder with -o, or replace what brewster made there with --force.",
        ));
    }
    match record::foreign(&real, &contents) {
        None => Ok(real),
        Some(foreign) => Err(refused(
            &format!("holds {foreign}, which brewster did not make"),
            "--force replaces only folders with nothing but brewster's own results: choose another folder with -o.",
        )),
    }
}

/// The folder of `path`; the current one for a bare name.
fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
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
