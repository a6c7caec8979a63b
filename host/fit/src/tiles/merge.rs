//! Tiles put together.

use std::path::PathBuf;

use super::store::{read_tile, tiles_in};
use super::{Job, Tile};
use crate::maps::{MapsError, MaterialMaps};

/// The whole map from the tiles of one job, wherever they were computed. A tile may be in several folders if it is the
/// same in all.
///
/// # Errors
/// [`MapsError::NoTiles`]; [`MapsError::MissingTiles`]; [`MapsError::DamagedTile`]; [`MapsError::UnsupportedTile`];
/// [`MapsError::ForeignTile`] if folders hold tiles of different jobs; [`MapsError::ConflictingTiles`];
/// [`MapsError::Image`].
pub fn merge(folders: &[PathBuf]) -> Result<MaterialMaps, MapsError> {
    let mut whole: Option<Whole> = None;
    for folder in folders {
        for (index, path) in tiles_in(folder)? {
            let found = read_tile(&path, index)?;
            let whole = whole.get_or_insert_with(|| Whole::new(found.job.clone()));
            if let Some(what) = whole.job.difference(&found.job) {
                return Err(MapsError::ForeignTile { path, what });
            }
            let tile = whole.job.tile(index);
            match &whole.from[index] {
                None => {
                    whole.place(&tile, &found.maps);
                    whole.from[index] = Some(path);
                }
                Some(first) if read_tile(first, index)?.maps.same_bits(&found.maps) => {}
                Some(first) => return Err(MapsError::ConflictingTiles { first: first.clone(), second: path }),
            }
        }
    }
    let Some(whole) = whole else { return Err(MapsError::NoTiles { folders: folders.to_vec() }) };
    let missing = || whole.from.iter().enumerate().filter(|(_, from)| from.is_none()).map(|(index, _)| index);
    match missing().next() {
        Some(first) => Err(MapsError::MissingTiles { count: missing().count(), first, total: whole.from.len() }),
        None => Ok(whole.maps),
    }
}

/// A map that fills.
struct Whole {
    job: Job,
    maps: MaterialMaps,
    /// The file of each tile that is in.
    from: Vec<Option<PathBuf>>,
}

impl Whole {
    fn new(job: Job) -> Self {
        let mut maps = MaterialMaps::new(job.grid(), job.covariance());
        maps.reason_names = job.reason_names().to_vec();
        let from = vec![None; job.tiles()];
        Self { job, maps, from }
    }

    fn place(&mut self, tile: &Tile, part: &MaterialMaps) {
        let columns = self.job.grid().columns;
        for (to, from) in self.maps.float_planes_mut().zip(part.float_planes()) {
            copy(to, from, columns, tile);
        }
        for (to, from) in self.maps.integer_planes_mut().into_iter().zip(part.integer_planes()) {
            copy(to, from, columns, tile);
        }
    }
}

/// Copies a tile's plane, row by row, into a plane of `columns` columns.
fn copy<T: Copy>(to: &mut [T], from: &[T], columns: usize, tile: &Tile) {
    for (row, samples) in from.chunks_exact(tile.grid.columns).enumerate() {
        let start = (tile.row + row) * columns + tile.column;
        to[start..start + samples.len()].copy_from_slice(samples);
    }
}
