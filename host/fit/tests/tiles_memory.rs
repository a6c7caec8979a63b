//! The memory of a run does not grow with the grid. In a program of its own: the peak is that of the process.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking, as tests do")]

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use host_fit::maps::{Grid, MaterialMaps, PlaneRect};
use host_fit::tiles::{Job, SettingsHash, Share, TileStore, merge, run};

/// Peak resident memory of this process, bytes; `None` where the system does not say.
fn peak_bytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<usize>().ok()?)
}

fn story(columns: usize, rows: usize, limit: usize) {
    let folder = tempfile::tempdir().unwrap();
    let plane = PlaneRect { left: 0.0, right: 4.0, bottom: 0.0, top: 3.0 };
    let job = Job::new(Grid::new(columns, rows, plane).unwrap(), 64, SettingsHash::EMPTY, false).unwrap();
    let store = TileStore::open(folder.path(), job).unwrap();
    let Some(before) = peak_bytes() else { return println!("skipped: no /proc") };
    let start = Instant::now();
    let solve = |tile: &host_fit::tiles::Tile| Some(MaterialMaps::new(tile.grid, false));
    run(&store, Share::ALL, &AtomicBool::new(false), |_| {}, solve).unwrap();
    let running = peak_bytes().unwrap() - before;
    println!("{} samples: {} MB while running, {:.1?}", columns * rows, running >> 20, start.elapsed());
    assert!(running < limit, "{running} bytes");
    let start = Instant::now();
    let maps = merge(&[folder.path().into()]).unwrap();
    let path = folder.path().join("maps.exr");
    maps.save_exr(&path).unwrap();
    let merged = peak_bytes().unwrap() - before;
    println!("merged and saved: {} MB, {:.1?}", merged >> 20, start.elapsed());
    // 20 planes of 4 bytes; the writer lends them, and holds some blocks.
    assert!(merged < 80 * columns * rows + limit, "{merged} bytes");
}

#[test]
fn a_megapixel_takes_the_memory_of_a_few_tiles() {
    story(1200, 900, 40 << 20);
}

#[test]
#[ignore = "writes 2 GB; run by hand with --release -- --ignored --nocapture"]
fn twelve_megapixels_take_the_memory_of_a_few_tiles() {
    story(4000, 3000, 40 << 20);
}
