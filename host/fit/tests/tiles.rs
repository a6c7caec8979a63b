//! Stories of long runs: shared, stopped, killed, damaged, mixed up. The map has the same bits in the end, or the fault a
//! name.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking, as tests do")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use host_fit::maps::{Grid, MapsError, MaterialMaps, Plane, PlaneRect};
use host_fit::tiles::{Job, Progress, SettingsHash, Share, Tile, TileStore, merge, run};

static GO: AtomicBool = AtomicBool::new(false);
const SIDE: u32 = 16;

fn job(settings: u64) -> Job {
    let plane = PlaneRect { left: -0.5, right: 0.5, bottom: -0.3, top: 0.3 };
    Job::new(Grid::new(100, 60, plane).unwrap(), SIDE, SettingsHash(settings), false).unwrap()
}

fn store(folder: &Path, settings: u64) -> TileStore {
    TileStore::open(folder, job(settings)).unwrap()
}

/// A number for every sample of the whole grid, NaN with a payload among them.
fn number(column: usize, row: usize, plane: usize) -> f32 {
    let n = u32::try_from((row * 100 + column) * 32 + plane).unwrap();
    f32::from_bits(n.wrapping_mul(0x9e37_79b9))
}

fn solve(tile: &Tile) -> Option<MaterialMaps> {
    Some(filled(tile.grid, tile.column, tile.row))
}

fn filled(grid: Grid, column: usize, row: usize) -> MaterialMaps {
    let mut maps = MaterialMaps::new(grid, false);
    for i in 0..grid.samples() {
        let (c, r) = (column + i % grid.columns, row + i / grid.columns);
        for plane in Plane::ALL {
            maps.plane_mut(plane)[i] = number(c, r, plane as usize);
        }
        let [freedom, views, reasons] = [29, 30, 31].map(|k| number(c, r, k).to_bits());
        (maps.freedom[i], maps.views[i], maps.reasons[i]) = (freedom, views, reasons);
    }
    maps
}

/// What every story must end with: computed without tiles.
fn whole() -> MaterialMaps {
    filled(job(1).grid(), 0, 0)
}

fn folders(paths: &[&Path]) -> Vec<PathBuf> {
    paths.iter().map(|p| p.to_path_buf()).collect()
}

fn run_all(store: &TileStore) -> Progress {
    run(store, Share::ALL, &GO, |_| {}, solve).unwrap()
}

#[test]
fn the_map_is_the_same_however_the_work_is_shared() {
    let folder = tempfile::tempdir().unwrap();
    for threads in [1, 2, 5] {
        let path = folder.path().join(format!("threads-{threads}"));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let done = pool.install(|| run_all(&store(&path, 1)));
        assert_eq!(done, Progress { finished: 28, resumed: 0, total: 28 });
        assert!(merge(&folders(&[&path])).unwrap().same_bits(&whole()), "{threads} threads");
    }
    // Three processes, two of them into one folder.
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    for (share, path) in [("0/3", &a), ("1/3", &b), ("2/3", &a)] {
        let done = run(&store(path, 1), share.parse().unwrap(), &GO, |_| {}, solve).unwrap();
        assert_eq!(done.finished, done.total);
    }
    assert!(merge(&folders(&[&a, &b])).unwrap().same_bits(&whole()));
    assert!(merge(&folders(&[&b, &a])).unwrap().same_bits(&whole()));
    // A tile in both is fine as long as it is the same.
    std::fs::copy(store(&a, 1).path(0), store(&b, 1).path(0)).unwrap();
    assert!(merge(&folders(&[&a, &b])).unwrap().same_bits(&whole()));
}

#[test]
fn a_stopped_run_goes_on_with_what_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(folder.path(), 1);
    let cancel = AtomicBool::new(false);
    let reports = Mutex::new(Vec::new());
    let computed = Mutex::new(BTreeSet::new());
    let once = |tile: &Tile| {
        assert!(computed.lock().unwrap().insert(tile.index), "tile {} computed twice", tile.index);
        solve(tile)
    };
    let stop_at_ten = |progress: Progress| {
        reports.lock().unwrap().push(progress.finished);
        cancel.store(progress.finished >= 10, Ordering::Relaxed);
    };
    let stopped = run(&store, Share::ALL, &cancel, stop_at_ten, once).unwrap();
    assert!((10..28).contains(&stopped.finished), "{stopped:?}");
    let reports = reports.into_inner().unwrap();
    assert!(reports.is_sorted() && reports.first() == Some(&0) && reports.last() == Some(&stopped.finished));
    let unfinished = merge(&folders(&[folder.path()]));
    let left = 28 - stopped.finished;
    assert!(matches!(unfinished, Err(MapsError::MissingTiles { count, total: 28, .. }) if count == left));

    let resumed = run(&store, Share::ALL, &GO, |_| {}, once).unwrap();
    assert_eq!(resumed, Progress { finished: 28, resumed: stopped.finished, total: 28 });
    assert!(merge(&folders(&[folder.path()])).unwrap().same_bits(&whole()));
    // All there: nothing is computed.
    assert_eq!(run(&store, Share::ALL, &GO, |_| {}, once).unwrap().resumed, 28);
}

#[test]
fn a_tile_given_up_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(folder.path(), 1);
    let done = run(&store, Share::ALL, &GO, |_| {}, |tile| if tile.index == 3 { None } else { solve(tile) }).unwrap();
    assert_eq!(done.finished, 27);
    let merged = merge(&folders(&[folder.path()]));
    assert!(matches!(merged, Err(MapsError::MissingTiles { count: 1, first: 3, .. })));
}

#[test]
fn what_a_killed_process_leaves_is_in_nobodys_way() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(folder.path(), 1);
    let crash = std::panic::catch_unwind(|| {
        run(&store, Share::ALL, &GO, |_| {}, |tile| if tile.index == 20 { panic!("killed") } else { solve(tile) })
    });
    assert!(crash.is_err());
    // Half a temporary file, as after a power cut.
    std::fs::write(folder.path().join(".brewster-x1y2z3"), b"BREWTILE\x01").unwrap();
    assert!(!store.path(20).exists());
    assert_eq!(run_all(&store).finished, 28);
    assert!(merge(&folders(&[folder.path()])).unwrap().same_bits(&whole()));
}

#[test]
fn a_damaged_tile_is_named_and_once_deleted_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(folder.path(), 1);
    run_all(&store);
    let path = store.path(5);
    let sound = std::fs::read(&path).unwrap();
    let is_named = |bytes: &[u8], what: &str| {
        std::fs::write(&path, bytes).unwrap();
        let (merged, again) = (merge(&folders(&[folder.path()])), run(&store, Share::ALL, &GO, |_| {}, solve));
        for error in [merged.unwrap_err(), again.unwrap_err()] {
            assert!(matches!(&error, MapsError::DamagedTile { path: p, .. } if *p == path), "{what}: {error}");
            assert!(error.to_string().contains("tile-000005.brewster"), "{error}");
        }
    };
    for cut in [0, 7, 12, 60, sound.len() / 2, sound.len() - 1] {
        is_named(&sound[..cut], "cut");
    }
    for at in [0, 13, 40, 70, sound.len() / 3, sound.len() - 1] {
        let mut flipped = sound.clone();
        flipped[at] ^= 0x10;
        is_named(&flipped, "flipped");
    }
    is_named(&std::fs::read(store.path(6)).unwrap(), "another tile under its name");
    std::fs::remove_file(&path).unwrap();
    assert_eq!(run_all(&store), Progress { finished: 28, resumed: 27, total: 28 });
    assert_eq!(std::fs::read(&path).unwrap(), sound);
}

#[test]
fn a_future_format_is_unsupported_and_not_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let store = store(folder.path(), 1);
    run_all(&store);
    let mut bytes = std::fs::read(store.path(0)).unwrap();
    bytes[8] = 2;
    std::fs::write(store.path(0), bytes).unwrap();
    let merged = merge(&folders(&[folder.path()]));
    assert!(matches!(merged, Err(MapsError::UnsupportedTile { version: 2, supported: 1, .. })));
}

#[test]
fn tiles_of_another_job_are_never_mixed_in() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    run(&store(&a, 1), "0/2".parse().unwrap(), &GO, |_| {}, solve).unwrap();
    run(&store(&b, 2), "1/2".parse().unwrap(), &GO, |_| {}, solve).unwrap();
    let merged = merge(&folders(&[&a, &b])).unwrap_err();
    assert!(matches!(&merged, MapsError::ForeignTile { path, .. } if path.starts_with(&b)), "{merged}");
    let resumed = run(&store(&a, 2), Share::ALL, &GO, |_| {}, |_| panic!("computed before the folder was checked"));
    assert!(matches!(resumed, Err(MapsError::ForeignTile { .. })));
    let grid = Grid::new(100, 60, PlaneRect { left: -0.5, right: 0.5, bottom: -0.3, top: 0.300_000_1 }).unwrap();
    let other = TileStore::open(&a, Job::new(grid, SIDE, SettingsHash(1), false).unwrap()).unwrap();
    assert!(matches!(other.is_finished(0), Err(MapsError::ForeignTile { .. })));
    // The same settings, but another answer: the solver was not a function of them.
    run(&store(&a, 1), Share::ALL, &GO, |_| {}, solve).unwrap();
    let c = folder.path().join("c");
    let mut wrong = solve(&job(1).tile(4)).unwrap();
    wrong.views[0] ^= 1;
    store(&c, 1).write(4, &wrong).unwrap();
    assert!(matches!(merge(&folders(&[&a, &c])), Err(MapsError::ConflictingTiles { .. })));
}

#[test]
fn no_tiles_and_wrong_results_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(merge(&folders(&[folder.path()])), Err(MapsError::NoTiles { folders }) if folders.len() == 1));
    assert!(matches!(merge(&[folder.path().join("nowhere")]), Err(MapsError::Image(_))));
    let store = store(folder.path(), 1);
    let wrong = run(&store, Share::ALL, &GO, |_| {}, |_| solve(&job(1).tile(27)));
    assert!(matches!(wrong, Err(MapsError::Inconsistent { .. })));
}
