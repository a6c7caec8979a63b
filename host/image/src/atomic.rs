//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::ImageError;
use crate::error::io_error;

/// Writes `path` atomically: a temporary file in the same folder is filled by `write`, flushed, synced to the disk and
/// renamed. After any error (the disk is full, no permission, `write` itself) nothing has the final name that did not
/// have it before, and the temporary file is gone. A file that exists is replaced: whether it may be is the caller's
/// decision.
///
/// # Errors
/// [`ImageError::Io`] with `path`, or what `write` returned.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let io = |source| io_error(path, source);
    let folder = parent(path);
    let temporary = temporary_options().tempfile_in(folder).map_err(io)?;
    let mut buffered = BufWriter::with_capacity(1 << 20, temporary.as_file());
    write(&mut buffered)?;
    buffered.flush().map_err(io)?;
    drop(buffered);
    temporary.as_file().sync_all().map_err(io)?;
    temporary.persist(path).map_err(|e| io(e.error))?;
    sync_folder(folder).map_err(io)
}

/// Makes the folder `path` atomically: `fill` writes into a temporary folder beside it, which is then renamed. A
/// folder that has files in it is never replaced or mixed with (an I/O error says so).
///
/// # Errors
/// [`ImageError::Io`] with `path`, or what `fill` returned; a file in the temporary folder goes by its name in `path`.
pub(crate) fn make_folder_atomically(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let io = |source| io_error(path, source);
    let folder = parent(path);
    let temporary = temporary_folder_options().tempdir_in(folder).map_err(io)?;
    fill(temporary.path()).map_err(|error| match error {
        ImageError::Io { path: at, source } => ImageError::Io {
            path: at.strip_prefix(temporary.path()).map_or(at.clone(), |name| path.join(name)),
            source,
        },
        other => other,
    })?;
    std::fs::rename(temporary.path(), path).map_err(io)?;
    // The folder has moved: nothing of it is left to delete under the old name.
    let _ = temporary.keep();
    sync_folder(folder).map_err(io)
}

/// The folder of `path`; the current one for a bare name.
fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Temporary files are private by default; these become the user's own pictures, so they get the usual mode less umask.
#[cfg(unix)]
fn with_mode(mode: u32) -> tempfile::Builder<'static, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".brewster-").permissions(std::fs::Permissions::from_mode(mode));
    builder
}

#[cfg(unix)]
fn temporary_options() -> tempfile::Builder<'static, 'static> {
    with_mode(0o666)
}

#[cfg(unix)]
fn temporary_folder_options() -> tempfile::Builder<'static, 'static> {
    with_mode(0o777)
}

#[cfg(not(unix))]
fn temporary_options() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".brewster-");
    builder
}

#[cfg(not(unix))]
fn temporary_folder_options() -> tempfile::Builder<'static, 'static> {
    temporary_options()
}

/// A rename is on the disk once its folder is.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_atomically(&path, |w| w.write_all(b"old").map_err(|e| io_error(&path, e))).unwrap();
        let failed = write_atomically(&path, |w| {
            w.write_all(b"half of the new").map_err(|e| io_error(&path, e))?;
            Err(io_error(&path, std::io::Error::from(std::io::ErrorKind::StorageFull)))
        });
        assert!(matches!(failed, Err(ImageError::Io { .. })));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.bin"]);
        write_atomically(&path, |w| w.write_all(b"new").map_err(|e| io_error(&path, e))).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nowhere").join("a.bin");
        let error = write_atomically(&path, |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("nowhere"), "{error}");
    }

    #[test]
    fn a_folder_appears_whole_and_is_never_mixed_with_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("planes");
        let fill = |name: &'static str| {
            move |d: &Path| std::fs::write(d.join(name), b"x").map_err(|e| io_error(Path::new(name), e))
        };
        make_folder_atomically(&path, fill("one")).unwrap();
        assert_eq!(names(&path), ["one"]);
        assert!(matches!(make_folder_atomically(&path, fill("two")), Err(ImageError::Io { .. })));
        assert_eq!(names(&path), ["one"]);
        let full = |d: &Path| Err(io_error(&d.join("S0.Y.npy"), std::io::ErrorKind::StorageFull.into()));
        let failed = make_folder_atomically(&folder.path().join("other"), full);
        assert!(matches!(failed, Err(ImageError::Io { path, .. }) if path.ends_with("other/S0.Y.npy")));
        assert_eq!(names(folder.path()), ["planes"]);
    }
}
