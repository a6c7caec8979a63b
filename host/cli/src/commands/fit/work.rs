//! The three ways to run: everything, a share of the tiles, tiles put together.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use host_fit::pipeline::{Mode, Prepared, Shared, calibrate_wheels};
use host_fit::session::Session;
use host_fit::tiles::{Progress, Share, TileStore, merge};
use host_fit::wheel::WheelEstimate;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use super::{Fit, failures, results, words};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputFolder, signals};
use crate::terminal::{Outcome, Terminal};

/// Nothing here gives up by itself: a signal ends the program, and finished tiles are on the disk by then.
static GO_ON: AtomicBool = AtomicBool::new(false);

/// What was done, and how long it took.
pub(super) struct Done<'a> {
    pub(super) session: &'a Session,
    pub(super) wheels: &'a [Option<WheelEstimate>],
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) shared: Option<Shared>,
    pub(super) metals: Vec<String>,
    /// Reading, wheels, preparation, tiles, regions.
    pub(super) times: [Duration; 5],
    /// Samples that were computed in this run, not taken over.
    pub(super) computed: usize,
}

/// The captures, read and calibrated.
struct Opened {
    session: Session,
    wheels: Vec<Option<WheelEstimate>>,
    times: [Duration; 2],
}

impl Opened {
    fn new(command: &Fit, terminal: &Terminal) -> Result<Self, Failure> {
        let progress = terminal.progress(2, "reading");
        let clock = Instant::now();
        let mut session = command.session()?;
        let read = clock.elapsed();
        progress.inc(1);
        let clock = Instant::now();
        let wheels = calibrate_wheels(&mut session, command.wheel_sigma).map_err(|e| failures::pipeline(&e))?;
        progress.finish_and_clear();
        words::warn(&session, &wheels, terminal);
        Ok(Self { session, wheels, times: [read, clock.elapsed()] })
    }

    fn prepare<'a>(&'a self, command: &Fit, terminal: &Terminal) -> Result<(Prepared<'a>, Duration), Failure> {
        let clock = Instant::now();
        let progress = terminal.progress(1, "preparing");
        let prepared =
            Prepared::new(&self.session, &self.wheels, command.options()?).map_err(|e| failures::pipeline(&e))?;
        progress.finish_and_clear();
        Ok((prepared, clock.elapsed()))
    }
}

/// `brewster fit CAPTURE...`, with or without tiles that exist.
pub(super) fn whole(command: &Fit, terminal: &Terminal) -> Result<Outcome, Failure> {
    let folder = OutputFolder::prepare(&command.output, &command.name())?;
    let opened = Opened::new(command, terminal)?;
    let (prepared, preparing) = opened.prepare(command, terminal)?;
    let kept = beside(folder.destination());
    let clock = Instant::now();
    let (mut maps, computed) = if command.merge.is_empty() {
        signals::keeping(Some(format!(
            "Finished tiles are kept in {}; the same command goes on from there.",
            kept.display()
        )));
        let progress = run(&prepared, &kept, Share::ALL, terminal)?;
        let maps = merge(std::slice::from_ref(&kept)).map_err(|e| failures::maps(&e))?;
        let share = (progress.total - progress.resumed) as f64 / progress.total.max(1) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a count")]
        let computed = (share * maps.grid.samples() as f64) as usize;
        (maps, computed)
    } else {
        (merge(&command.merge).map_err(|e| failures::maps(&e))?, 0)
    };
    let tiling = clock.elapsed();
    let clock = Instant::now();
    let shared = if command.options()?.mode == Mode::JointShared {
        let progress = terminal.progress(1, "regions");
        let shared = prepared.share(&mut maps, &GO_ON).map_err(|e| failures::pipeline(&e))?;
        progress.finish_and_clear();
        shared
    } else {
        None
    };
    let [read, wheels] = opened.times;
    let done = Done {
        session: &opened.session,
        wheels: &opened.wheels,
        prepared: &prepared,
        shared,
        metals: command.metal.iter().map(|m| m.name.clone()).collect(),
        times: [read, wheels, preparing, tiling, clock.elapsed()],
        computed,
    };
    let outcome = results::write(command, maps, Some(&done), folder, terminal)?;
    // The results are complete: what was kept for the case that they would not be is in the way now.
    signals::keeping(None);
    if command.merge.is_empty()
        && let Err(error) = std::fs::remove_dir_all(&kept)
    {
        terminal.warn(format!("{} is of no use any more, but cannot be deleted: {error}", kept.display()));
    }
    Ok(outcome)
}

/// `--tiles I/N`.
pub(super) fn tiles(command: &Fit, share: Share, terminal: &Terminal) -> Result<Outcome, Failure> {
    let folder = command.output.output().cloned().unwrap_or_default();
    refuse_foreign(&folder)?;
    let opened = Opened::new(command, terminal)?;
    let (prepared, _) = opened.prepare(command, terminal)?;
    signals::keeping(Some(format!("Finished tiles are in {}; the same command goes on.", folder.display())));
    let progress = run(&prepared, &folder, share, terminal)?;
    signals::keeping(None);
    let (finished, total) = (progress.finished, progress.total);
    let output = folder.display().to_string();
    let all = prepared.job().map_err(|e| failures::pipeline(&e))?.tiles();
    let text = format!(
        "{finished} of {total} tiles of this share are in {output} ({all} in all, {} taken over)\n  When all shares are done: \
         brewster fit --merge DIR... -o RESULT\n",
        progress.resumed
    );
    let json = json!({ "command": "fit", "output": output, "tiles": { "finished": finished, "share": total,
        "resumed": progress.resumed, "all": all }, "warnings": terminal.warnings() });
    Ok(Outcome { text, brief: format!("{output}\n"), json })
}

/// `--merge DIR...` without captures.
pub(super) fn merged(command: &Fit, terminal: &Terminal) -> Result<Outcome, Failure> {
    let folder = OutputFolder::prepare(&command.output, &command.name())?;
    let progress = terminal.progress(1, "merging");
    let maps = merge(&command.merge).map_err(|e| failures::maps(&e))?;
    progress.finish_and_clear();
    results::write(command, maps, None, folder, terminal)
}

/// Fits what is missing in `folder`.
fn run(prepared: &Prepared<'_>, folder: &Path, share: Share, terminal: &Terminal) -> Result<Progress, Failure> {
    let job = prepared.job().map_err(|e| failures::pipeline(&e))?;
    let samples = prepared.grid().samples() as f64 / job.tiles() as f64;
    let store = TileStore::open(folder, job).map_err(|e| failures::maps(&e))?;
    let bar = rated(terminal.progress(0, "fitting"));
    let clock = Instant::now();
    let report = |progress: Progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.finished as u64);
        let (new, seconds) = ((progress.finished - progress.resumed) as f64, clock.elapsed().as_secs_f64());
        if new > 0.0 {
            let left = (progress.total - progress.finished) as f64 * seconds / new;
            bar.set_prefix(format!("{:.3} MP/s, {left:.0} s left", 1e-6 * new * samples / seconds));
        }
    };
    let progress = prepared.run(&store, share, &GO_ON, report).map_err(|e| failures::pipeline(&e))?;
    bar.finish_and_clear();
    Ok(progress)
}

fn rated(bar: ProgressBar) -> ProgressBar {
    match ProgressStyle::with_template("{msg:>10} {bar:32} {pos}/{len} tiles  {prefix}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// `result.tiles` beside `result`.
fn beside(destination: &Path) -> PathBuf {
    let mut name = destination.file_name().unwrap_or_default().to_owned();
    name.push(".tiles");
    destination.with_file_name(name)
}

/// A folder for tiles is new, empty, or of tiles.
fn refuse_foreign(folder: &Path) -> Result<(), Failure> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let foreign = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).find(|name| {
        let ours = name.starts_with("tile-") && name.ends_with(".brewster") || name.starts_with(".brewster-");
        !ours
    });
    foreign.map_or(Ok(()), |name| {
        let what = format!("{} holds {name}, which is no tile", folder.display());
        Err(Failure::new(Exit::Output, what, "Tiles get a folder of their own: name another one with -o."))
    })
}
