//! Why maps, tiles or a comparison were refused.

use std::path::PathBuf;

use host_image::ImageError;

/// What can go wrong between the solver of one pixel and maps on the disk.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapsError {
    /// A picture, an OpenEXR file, or the machine.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A grid, tile or share that makes no sense.
    #[error("{what}")]
    Inconsistent {
        /// What, with the values seen.
        what: String,
    },
    /// A tile that breaks its format: cut short, bad checksum.
    #[error("{}: damaged tile: {what}; delete it, and it is computed again", path.display())]
    DamagedTile {
        /// The file.
        path: PathBuf,
        /// What was found.
        what: String,
    },
    /// A tile in another version of the format.
    #[error("{}: tile format {version}; {supported} is read; compute into a new folder", path.display())]
    UnsupportedTile {
        /// The file.
        path: PathBuf,
        /// What it states.
        version: u32,
        /// What this program reads.
        supported: u32,
    },
    /// A sound tile of other settings, another grid or another sample.
    #[error("{}: a tile of another job: {what}; use a folder of its own for each job", path.display())]
    ForeignTile {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// Two folders hold the same tile with different content.
    #[error("{} and {} are the same tile with different content; delete the wrong one", first.display(), second.display())]
    ConflictingTiles {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Tiles that no folder holds.
    #[error(
        "{count} of {total} tiles are missing, the first is {first}; run their share, or name the folder that has them"
    )]
    MissingTiles {
        /// How many.
        count: usize,
        /// Number of the first.
        first: usize,
        /// How many there should be.
        total: usize,
    },
    /// No folder holds any tile.
    #[error("no tiles in {}", folders.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(", "))]
    NoTiles {
        /// Where was looked.
        folders: Vec<PathBuf>,
    },
    /// Two grids whose samples do not lie on each other.
    #[error("the samples do not coincide: {found} against {reference}; allow resampling to compare them")]
    GridMismatch {
        /// The grid under test.
        found: String,
        /// The reference's.
        reference: String,
    },
}
