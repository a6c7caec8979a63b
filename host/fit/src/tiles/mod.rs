//! A large fit as many small files: what is finished is never lost and never computed again.
//!
//! The grid is split into square tiles, numbered row by row. Each finished tile is one file of a folder, written whole or
//! not at all, so that a run that was stopped goes on with the next tile; several processes (or machines) each take every
//! N-th tile, into one folder or several, and [`merge`] puts the map together. A tile depends on nothing but its samples,
//! so the map has the same bits however the work was shared.
//!
//! Memory of a run: one tile per thread, as planes and as a file (64 × 64 samples: 0.7 MB; with covariance 1.6 MB),
//! whatever the size of the grid, as long as the solver itself does not use the thread pool. Merging holds the whole map
//! and one tile.

mod format;
mod job;
mod merge;
mod store;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

pub use job::{Job, SettingsHash, Share, Tile};
pub use merge::merge;
pub use store::TileStore;

use crate::maps::{MapsError, MaterialMaps};

/// How far a run is, in tiles of its share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Finished, now or before.
    pub finished: usize,
    /// Of these, finished before this run.
    pub resumed: usize,
    /// All of the share.
    pub total: usize,
}

/// Computes the tiles of `share` that `store` does not have yet, over the current thread pool, and reports each.
///
/// `solve` gives the maps of one tile ([`Tile::grid`], covariance as the job says), or `None` if it gave up because of
/// `cancel`: nothing is written then. Once `cancel` is true no further tile is begun; what is finished stays, and the
/// same call later goes on. The answer says how far it came.
///
/// # Errors
/// Before anything is computed, [`MapsError::DamagedTile`], [`MapsError::ForeignTile`] and
/// [`MapsError::UnsupportedTile`] for what lies in the folder under the name of a tile of this share; then
/// [`MapsError::Inconsistent`] for a result of another size, and [`MapsError::Image`] if a tile cannot be written. Tiles
/// that other threads have finished are kept.
pub fn run(
    store: &TileStore,
    share: Share,
    cancel: &AtomicBool,
    report: impl Fn(Progress) + Sync,
    solve: impl Fn(&Tile) -> Option<MaterialMaps> + Sync,
) -> Result<Progress, MapsError> {
    let mine: Vec<usize> = (0..store.job().tiles()).filter(|index| share.takes(*index)).collect();
    let is_finished = |index: &usize| store.is_finished(*index);
    let finished: Vec<bool> = mine.par_iter().map(is_finished).collect::<Result<_, _>>()?;
    let pending: Vec<usize> = mine.iter().zip(&finished).filter(|(_, done)| !**done).map(|(index, _)| *index).collect();
    let resumed = mine.len() - pending.len();
    let progress = Mutex::new(Progress { finished: resumed, resumed, total: mine.len() });
    // A report that panicked has poisoned nothing but a counter.
    let locked = || progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    report(*locked());
    pending.into_par_iter().with_max_len(1).try_for_each(|index| {
        if cancel.load(Ordering::Relaxed) {
            return Ok(());
        }
        let Some(maps) = solve(&store.job().tile(index)) else { return Ok(()) };
        store.write(index, &maps)?;
        // Reported under the lock, so that reports come in order.
        let mut progress = locked();
        progress.finished += 1;
        report(*progress);
        Ok::<(), MapsError>(())
    })?;
    Ok(*locked())
}
