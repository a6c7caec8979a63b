//! Ctrl-C and `kill`: the folder that is being filled goes, what is finished stays.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What there is to remove if the work ends early.
#[derive(Clone)]
pub(crate) struct Filling {
    pub(super) folder: PathBuf,
    /// The parents that were made for it, the innermost first.
    pub(super) made: Vec<PathBuf>,
}

static FILLING: Mutex<Option<Filling>> = Mutex::new(None);

/// What stays for the next run, in words.
static KEPT: Mutex<Option<String>> = Mutex::new(None);

impl Filling {
    /// Removes the folder, then the parents that were made for it; those that are not empty stay.
    pub(super) fn remove(&self) {
        // A thread that still writes may add a file while the folder is emptied.
        for _ in 0..100 {
            match std::fs::remove_dir_all(&self.folder) {
                Err(e) if e.kind() == std::io::ErrorKind::DirectoryNotEmpty => {}
                _ => break,
            }
        }
        self.made.iter().for_each(|p| {
            let _ = std::fs::remove_dir(p);
        });
    }
}

/// From now on a signal ends the program with this advice; with none, unfinished results are gone.
pub(crate) fn keeping(advice: Option<String>) {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = advice;
}

/// Keeps a signal waiting for as long as the guard lives; it holds what is to be removed.
pub(super) fn hold() -> MutexGuard<'static, Option<Filling>> {
    FILLING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
pub(crate) use unix::{stand_back, watch};

#[cfg(not(unix))]
pub(crate) fn watch(_json: bool) {}

#[cfg(not(unix))]
pub(crate) fn stand_back() {}

#[cfg(unix)]
mod unix {
    use std::sync::PoisonError;
    use std::sync::atomic::{AtomicBool, Ordering};

    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    use super::{KEPT, hold};
    use crate::exit::Exit;
    use crate::failure::Failure;
    use crate::terminal::Terminal;

    static STOPPING: AtomicBool = AtomicBool::new(false);

    /// From now on SIGINT and SIGTERM remove the folder that is being filled, say so, and end the program with their exit
    /// codes. Where they cannot be watched, they end the program as they always do.
    pub(crate) fn watch(json: bool) {
        let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
        std::thread::spawn(move || {
            let Some(signal) = signals.forever().next() else { return };
            let exit = if signal == SIGINT { Exit::Interrupted } else { Exit::Terminated };
            let filling = hold();
            STOPPING.store(true, Ordering::SeqCst);
            if let Some(filling) = &*filling {
                filling.remove();
            }
            let what = format!("stopped by {}", if signal == SIGINT { "SIGINT" } else { "SIGTERM" });
            let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let advice = kept.unwrap_or_else(|| "Unfinished results were removed.".to_owned());
            Terminal::new(false, json).fail(&Failure::new(exit, what, advice));
            std::process::exit(exit.code().into());
        });
    }

    /// Does not come back once a signal is ending the program: whatever failed because its folder was removed is not what
    /// users should read about.
    pub(crate) fn stand_back() {
        while STOPPING.load(Ordering::SeqCst) {
            std::thread::park();
        }
    }
}
