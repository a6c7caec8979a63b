//! What is computed, by whom, and in which pieces.

use std::str::FromStr;

use crate::maps::{Grid, MapsError, reason_names};

/// Identity of everything a result depends on beside the grid: settings, pictures, calibration, program.
///
/// FNV-1a of 64 bits: tells jobs apart by mistake, not by malice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsHash(pub u64);

impl SettingsHash {
    /// Of nothing: the offset basis.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// With one more part; parts cannot run into each other, as their lengths count.
    #[must_use]
    pub fn with(self, part: &[u8]) -> Self {
        self.fold(&(part.len() as u64).to_le_bytes()).fold(part)
    }

    fn fold(self, bytes: &[u8]) -> Self {
        Self(bytes.iter().fold(self.0, |hash, b| (hash ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3)))
    }
}

/// Every N-th tile: tile index mod `of` == `index`. As text `I/N`, e.g. `0/3`, `1/3`, `2/3`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    index: usize,
    of: usize,
}

impl Share {
    /// All tiles.
    pub const ALL: Self = Self { index: 0, of: 1 };

    /// Part `index`, counted from 0, of `of`.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`] unless `index` < `of`.
    pub fn new(index: usize, of: usize) -> Result<Self, MapsError> {
        if index < of {
            return Ok(Self { index, of });
        }
        Err(MapsError::Inconsistent { what: format!("share {index}/{of}; of N shares I/N is one of 0/N to N-1/N") })
    }

    /// Whether a tile is in it.
    #[must_use]
    pub fn takes(self, tile: usize) -> bool {
        tile % self.of == self.index
    }
}

impl FromStr for Share {
    type Err = MapsError;

    fn from_str(text: &str) -> Result<Self, MapsError> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let wrong = || MapsError::Inconsistent { what: format!("share {text:?}; I/N is read, e.g. 0/3") };
        parts.ok_or_else(wrong).and_then(|(index, of)| Self::new(index, of))
    }
}

/// What all tiles of one map have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    grid: Grid,
    side: u32,
    settings: SettingsHash,
    covariance: bool,
    reason_names: Vec<String>,
}

/// A piece of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Its number.
    pub index: usize,
    /// First column of the whole grid.
    pub column: usize,
    /// First row of the whole grid.
    pub row: usize,
    /// Its own samples; smaller at the right and lower edge of the whole grid.
    pub grid: Grid,
}

impl Job {
    /// Tiles of `side` × `side` samples; `covariance` says whether results keep it.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`] for a side that is not 1 to 4096.
    pub fn new(grid: Grid, side: u32, settings: SettingsHash, covariance: bool) -> Result<Self, MapsError> {
        Self::with_names(grid, side, settings, covariance, reason_names())
    }

    pub(super) fn with_names(
        grid: Grid,
        side: u32,
        settings: SettingsHash,
        covariance: bool,
        reason_names: Vec<String>,
    ) -> Result<Self, MapsError> {
        if !(1..=4096).contains(&side) {
            return Err(MapsError::Inconsistent { what: format!("tiles of {side} x {side} samples; 1 to 4096") });
        }
        Ok(Self { grid, side, settings, covariance, reason_names })
    }

    /// Number of tiles.
    #[must_use]
    pub fn tiles(&self) -> usize {
        self.across() * self.grid.rows.div_ceil(self.side as usize)
    }

    /// A tile; those beyond [`Job::tiles`] make no sense.
    #[must_use]
    pub fn tile(&self, index: usize) -> Tile {
        let side = self.side as usize;
        let (column, row) = (index % self.across() * side, index / self.across() * side);
        let rest = |all: usize, from: usize| side.min(all.saturating_sub(from));
        let size = [rest(self.grid.columns, column), rest(self.grid.rows, row)];
        Tile { index, column, row, grid: self.grid.part([column, row], size) }
    }

    /// The whole grid.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Samples of a side.
    #[must_use]
    pub fn side(&self) -> u32 {
        self.side
    }

    /// What the results depend on.
    #[must_use]
    pub fn settings(&self) -> SettingsHash {
        self.settings
    }

    /// Whether results keep their covariance.
    #[must_use]
    pub fn covariance(&self) -> bool {
        self.covariance
    }

    pub(super) fn reason_names(&self) -> &[String] {
        &self.reason_names
    }

    /// The first thing in which `other` differs, in words; `None` for the same job.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        let differs =
            |what: &str, found: String, expected: String| Some(format!("{what} {found} instead of {expected}"));
        if self.settings != other.settings {
            let [found, expected] = [other, self].map(|j| format!("{:016x}", j.settings.0));
            return differs("settings", found, expected);
        }
        if self.grid != other.grid {
            return differs("grid", other.grid.to_string(), self.grid.to_string());
        }
        if self.side != other.side {
            return differs("tiles of side", other.side.to_string(), self.side.to_string());
        }
        if self.covariance != other.covariance {
            return differs("covariance kept:", other.covariance.to_string(), self.covariance.to_string());
        }
        let names = |j: &Self| j.reason_names.join(", ");
        (self != other).then(|| differs("reasons", names(other), names(self))).flatten()
    }

    fn across(&self) -> usize {
        self.grid.columns.div_ceil(self.side as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::PlaneRect;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Vectors of the FNV authors (Fowler, Noll, Vo; test_fnv.c).
        for (text, hash) in
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
        {
            assert_eq!(SettingsHash::EMPTY.fold(text.as_bytes()).0, hash, "{text}");
        }
        let of = |a: &str, b: &str| SettingsHash::EMPTY.with(a.as_bytes()).with(b.as_bytes());
        assert_ne!(of("ab", "c"), of("a", "bc"));
    }

    #[test]
    fn shares_take_every_tile_once() {
        for of in 1..6 {
            let shares: Vec<Share> = (0..of).map(|i| format!("{i}/{of}").parse().unwrap()).collect();
            assert!((0..50).all(|tile| shares.iter().filter(|s| s.takes(tile)).count() == 1));
        }
        for bad in ["3/3", "1", "1/0", "-1/2", "a/b", ""] {
            let refused = bad.parse::<Share>();
            assert!(matches!(&refused, Err(MapsError::Inconsistent { what }) if what.contains(bad)), "{bad}");
        }
    }

    #[test]
    fn tiles_cover_the_grid_once_at_its_positions() {
        let plane = PlaneRect { left: -1.0, right: 2.0, bottom: 0.0, top: 1.0 };
        let grid = Grid::new(13, 7, plane).unwrap();
        let job = Job::new(grid, 4, SettingsHash::EMPTY, false).unwrap();
        assert_eq!(job.tiles(), 8);
        let mut seen = vec![0; grid.samples()];
        for tile in (0..job.tiles()).map(|i| job.tile(i)) {
            for (r, c) in (0..tile.grid.rows).flat_map(|r| (0..tile.grid.columns).map(move |c| (r, c))) {
                seen[(tile.row + r) * 13 + tile.column + c] += 1;
                let (part, whole) = (tile.grid.position(c, r), grid.position(tile.column + c, tile.row + r));
                assert!((part[0] - whole[0]).abs() < 1e-12 && (part[1] - whole[1]).abs() < 1e-12);
            }
        }
        assert!(seen.iter().all(|n| *n == 1));
        assert!(Job::new(grid, 0, SettingsHash::EMPTY, false).is_err());
    }
}
