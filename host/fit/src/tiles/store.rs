//! A folder of finished tiles: `tile-000000.brewster`, `tile-000001.brewster`, ...
//!
//! A file appears under its name once it is complete and on the disk. What a killed process leaves beside it starts with
//! `.brewster-`, is never read, and may be deleted when nothing runs.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use host_image::{ImageError, write_atomically};

use super::Job;
use super::format::{Decoded, decode, encode};
use crate::maps::{MapsError, MaterialMaps};

const PREFIX: &str = "tile-";
const SUFFIX: &str = ".brewster";

/// A folder in which one job's tiles are collected.
#[derive(Clone, Debug)]
pub struct TileStore {
    folder: PathBuf,
    job: Job,
}

impl TileStore {
    /// Opens `folder`, made if it is not there, for the tiles of `job`. Nothing in it is read yet.
    ///
    /// # Errors
    /// [`MapsError::Image`] if it cannot be made.
    pub fn open(folder: &Path, job: Job) -> Result<Self, MapsError> {
        std::fs::create_dir_all(folder).map_err(|e| io(folder, e))?;
        Ok(Self { folder: folder.into(), job })
    }

    /// What is computed.
    #[must_use]
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// The file of a tile.
    #[must_use]
    pub fn path(&self, index: usize) -> PathBuf {
        self.folder.join(format!("{PREFIX}{index:06}{SUFFIX}"))
    }

    /// Whether a tile is there and sound.
    ///
    /// # Errors
    /// [`MapsError::DamagedTile`], [`MapsError::UnsupportedTile`], [`MapsError::ForeignTile`], [`MapsError::Image`].
    pub fn is_finished(&self, index: usize) -> Result<bool, MapsError> {
        let path = self.path(index);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
            Err(e) => return Err(io(&path, e)),
        };
        let found = decode_named(&path, index, &bytes)?;
        match self.job.difference(&found.job) {
            Some(what) => Err(MapsError::ForeignTile { path, what }),
            None => Ok(true),
        }
    }

    /// Writes a finished tile: a temporary file, synced to the disk and renamed.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`] for maps of another size than the tile's; [`MapsError::Image`].
    pub fn write(&self, index: usize, maps: &MaterialMaps) -> Result<(), MapsError> {
        let tile = self.job.tile(index);
        maps.check()?;
        let found = (maps.grid.columns, maps.grid.rows, !maps.covariance.is_empty());
        let expected = (tile.grid.columns, tile.grid.rows, self.job.covariance());
        if index >= self.job.tiles() || found != expected || maps.reason_names != self.job.reason_names() {
            let what = format!("tile {index}: (columns, rows, covariance) {found:?} instead of {expected:?}");
            return Err(MapsError::Inconsistent { what });
        }
        let (path, bytes) = (self.path(index), encode(&self.job, index, maps));
        write_atomically(&path, |out| {
            out.write_all(&bytes).map_err(|source| ImageError::Io { path: path.clone(), source })
        })?;
        Ok(())
    }
}

/// The tile files of a folder, by number.
pub(super) fn tiles_in(folder: &Path) -> Result<Vec<(usize, PathBuf)>, MapsError> {
    let mut tiles = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| io(folder, e))? {
        let entry = entry.map_err(|e| io(folder, e))?;
        let name = entry.file_name();
        let number = name.to_str().and_then(|n| n.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?.parse().ok());
        tiles.extend(number.map(|index| (index, entry.path())));
    }
    tiles.sort();
    Ok(tiles)
}

/// The tile at `path`, whose name says that it is tile `index`.
pub(super) fn read_tile(path: &Path, index: usize) -> Result<Decoded, MapsError> {
    decode_named(path, index, &std::fs::read(path).map_err(|e| io(path, e))?)
}

fn decode_named(path: &Path, index: usize, bytes: &[u8]) -> Result<Decoded, MapsError> {
    let found = decode(path, bytes)?;
    if found.index == index {
        return Ok(found);
    }
    Err(MapsError::DamagedTile { path: path.into(), what: format!("it is tile {}, not {index}", found.index) })
}

fn io(path: &Path, source: std::io::Error) -> MapsError {
    ImageError::Io { path: path.into(), source }.into()
}
