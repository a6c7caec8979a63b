//! The bytes of a tile file, little-endian.
//!
//! | bytes | |
//! |---|---|
//! | 8 | `BREWTILE` |
//! | u32 | version, 1 |
//! | u32 × 2 | columns and rows of the whole grid |
//! | f64 × 4 | left, right, bottom, top of the whole grid |
//! | u32 | side of a tile |
//! | u64 | settings hash |
//! | u8 | 1 with covariance, else 0 |
//! | u32, bytes | length and names of the reasons (UTF-8, commas between) |
//! | u64 | number of the tile |
//! | f32 planes | in the order of `Plane`, then 28 of covariance; row-major samples of the tile |
//! | u32 planes | freedom, views, reasons |
//! | u32 | CRC-32 (IEEE 802.3) of all before |

use std::path::Path;

use super::{Job, SettingsHash};
use crate::maps::{Grid, MapsError, MaterialMaps, PlaneRect};

const MAGIC: &[u8; 8] = b"BREWTILE";
const VERSION: u32 = 1;

/// A tile whose checksum is right.
pub(super) struct Decoded {
    pub(super) job: Job,
    pub(super) index: usize,
    pub(super) maps: MaterialMaps,
}

/// The file of tile `index`; `maps` are its samples.
pub(super) fn encode(job: &Job, index: usize, maps: &MaterialMaps) -> Vec<u8> {
    let numbers = maps.grid.samples() * (maps.float_planes().count() + 3);
    let names = job.reason_names().join(",");
    let mut out = Vec::with_capacity(4 * numbers + names.len() + 128);
    out.extend(MAGIC);
    out.extend(VERSION.to_le_bytes());
    // A grid has at most 400 million columns or rows.
    let narrow = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes();
    let PlaneRect { left, right, bottom, top } = job.grid().plane;
    out.extend([narrow(job.grid().columns), narrow(job.grid().rows)].concat());
    out.extend([left, right, bottom, top].map(f64::to_le_bytes).concat());
    out.extend(job.side().to_le_bytes());
    out.extend(job.settings().0.to_le_bytes());
    out.push(u8::from(job.covariance()));
    out.extend(narrow(names.len()));
    out.extend(names.as_bytes());
    out.extend((index as u64).to_le_bytes());
    for plane in maps.float_planes() {
        out.extend(plane.iter().flat_map(|v| v.to_le_bytes()));
    }
    for plane in maps.integer_planes() {
        out.extend(plane.iter().flat_map(|v| v.to_le_bytes()));
    }
    let sum = crc32fast::hash(&out);
    out.extend(sum.to_le_bytes());
    out
}

/// Reads a tile file back; `path` is for the errors only.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Decoded, MapsError> {
    let damaged = |what: String| MapsError::DamagedTile { path: path.into(), what };
    let cut = || damaged(format!("cut short, {} bytes", bytes.len()));
    let Some((body, sum)) = bytes.split_last_chunk::<4>() else { return Err(cut()) };
    if !body.starts_with(MAGIC) {
        return Err(damaged("it does not start as a tile".into()));
    }
    // Another version may have another checksum: it is asked first.
    let mut rest = Reader(&body[MAGIC.len()..]);
    let version = rest.u32().ok_or_else(cut)?;
    if version != VERSION {
        return Err(MapsError::UnsupportedTile { path: path.into(), version, supported: VERSION });
    }
    let (stated, found) = (u32::from_le_bytes(*sum), crc32fast::hash(body));
    if stated != found {
        return Err(damaged(format!("checksum {found:08x} instead of {stated:08x}, {} bytes", bytes.len())));
    }
    let job = read_job(&mut rest).ok_or_else(|| damaged("its header makes no sense".into()))?;
    let index = rest.u64().and_then(|i| usize::try_from(i).ok()).filter(|i| *i < job.tiles());
    let index = index.ok_or_else(|| damaged(format!("its number is not below {}", job.tiles())))?;
    let mut maps = MaterialMaps::new(job.tile(index).grid, job.covariance());
    maps.reason_names = job.reason_names().to_vec();
    let expected = 4 * maps.grid.samples() * (maps.float_planes().count() + 3);
    if rest.0.len() != expected {
        return Err(damaged(format!("{} bytes of samples instead of {expected}", rest.0.len())));
    }
    let mut numbers = rest.0.as_chunks::<4>().0.iter();
    for plane in maps.float_planes_mut() {
        plane.iter_mut().zip(&mut numbers).for_each(|(v, b)| *v = f32::from_le_bytes(*b));
    }
    for plane in maps.integer_planes_mut() {
        plane.iter_mut().zip(&mut numbers).for_each(|(v, b)| *v = u32::from_le_bytes(*b));
    }
    Ok(Decoded { job, index, maps })
}

fn read_job(rest: &mut Reader<'_>) -> Option<Job> {
    let columns = usize::try_from(rest.u32()?).ok()?;
    let rows = usize::try_from(rest.u32()?).ok()?;
    let [left, right, bottom, top] = [rest.f64()?, rest.f64()?, rest.f64()?, rest.f64()?];
    let grid = Grid::new(columns, rows, PlaneRect { left, right, bottom, top }).ok()?;
    let side = rest.u32()?;
    let settings = SettingsHash(rest.u64()?);
    let covariance = match rest.take::<1>()? {
        [0] => false,
        [1] => true,
        _ => return None,
    };
    let length = usize::try_from(rest.u32()?).ok()?;
    let (names, after) = rest.0.split_at_checked(length)?;
    rest.0 = after;
    let names = std::str::from_utf8(names).ok()?;
    let names = names.split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect();
    Job::with_names(grid, side, settings, covariance, names).ok()
}

/// What is left to read.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }
}
