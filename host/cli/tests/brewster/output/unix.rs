//! What happens meanwhile: signals, other programs, full disks, links.

use std::fs::OpenOptions;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::OUTPUT;
use crate::world::World;

const FRAMES: [&str; 3] = ["a_000.png", "a_060.png", "a_120.png"];

/// A program that was stopped while it fills its folder.
struct Stopped {
    world: World,
    program: Child,
}

impl Stopped {
    /// Runs `brewster stokes` with further arguments after `before`; `parent` is where its temporary folder appears.
    fn new(before: impl Fn(&World), arguments: &[&str], parent: &str) -> Self {
        // A machine that is busy with other things may look too late.
        (0..10).find_map(|_| Self::attempt(&before, arguments, parent)).unwrap()
    }

    fn attempt(before: impl Fn(&World), arguments: &[&str], parent: &str) -> Option<Self> {
        let world = World::new();
        for (name, dn) in FRAMES.iter().zip([1500, 1000, 800]) {
            world.grey(name, 700, &[dn; 490_000]);
        }
        before(&world);
        let program = Command::new(env!("CARGO_BIN_EXE_brewster"))
            .arg("stokes")
            .args(FRAMES)
            .args(arguments)
            .current_dir(world.path("."))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stopped = Self { world, program };
        let start = Instant::now();
        while !stopped.is_filling(parent) && start.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(1));
        }
        stopped.signal("-STOP");
        std::thread::sleep(Duration::from_millis(5));
        if stopped.is_filling(parent) {
            return Some(stopped);
        }
        stopped.program.kill().unwrap();
        stopped.program.wait().unwrap();
        None
    }

    fn is_filling(&self, parent: &str) -> bool {
        let is_temporary = |name: &String| name.starts_with(".brewster-");
        self.world.path(parent).exists() && self.world.names(parent).iter().any(is_temporary)
    }

    fn signal(&self, name: &str) {
        assert!(Command::new("kill").args([name, &self.program.id().to_string()]).status().unwrap().success());
    }

    /// Lets it go on to its end.
    fn end(self) -> (World, Output) {
        self.signal("-CONT");
        (self.world, self.program.wait_with_output().unwrap())
    }
}

fn with_frames(others: &[&str]) -> Vec<String> {
    FRAMES.iter().chain(others).map(|name| (*name).to_owned()).collect()
}

#[test]
fn signals_remove_what_is_unfinished() {
    for (signal, code, kind) in [("-INT", 130, "interrupted"), ("-TERM", 143, "terminated")] {
        let stopped = Stopped::new(|_| (), &["-o", "deep/er/result", "--json"], "deep/er");
        stopped.signal(signal);
        let (w, run) = stopped.end();
        let said: serde_json::Value = serde_json::from_slice(&run.stderr).unwrap();
        assert_eq!((run.status.code(), &said["error"]["kind"]), (Some(code), &kind.into()), "{said}");
        assert_eq!(w.names("."), FRAMES);
    }
}

#[test]
fn a_name_taken_meanwhile_costs_no_work() {
    let stopped = Stopped::new(|_| (), &["-o", "mine"], ".");
    std::fs::create_dir(stopped.world.path("mine")).unwrap();
    std::fs::write(stopped.world.path("mine/thesis.tex"), "three years").unwrap();
    let (w, run) = stopped.end();
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(OUTPUT), "{said}");
    assert!(said.contains("another program has written there") && said.contains("mine-2"), "{said}");
    assert_eq!(w.names("mine"), ["thesis.tex"]);
    assert_eq!(w.names("."), with_frames(&["mine", "mine-2"]));
    let record: serde_json::Value =
        serde_json::from_slice(&std::fs::read(w.path("mine-2/brewster.json")).unwrap()).unwrap();
    assert_eq!(record["output"], "mine-2");
    assert!(w.path("mine-2/stokes.exr").exists());
}

#[test]
fn a_default_name_taken_meanwhile_is_counted_on() {
    let stopped = Stopped::new(|_| (), &["--json"], "out");
    std::fs::create_dir(stopped.world.path("out/a")).unwrap();
    std::fs::write(stopped.world.path("out/a/thesis.tex"), "three years").unwrap();
    let (w, run) = stopped.end();
    let json: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!((run.status.code(), &json["output"]), (Some(0), &"out/a-2".into()), "{json}");
    assert_eq!(w.names("out"), ["a", "a-2"]);
}

#[test]
fn force_looks_again_before_it_replaces() {
    let before = |w: &World| drop(w.ok(&["stokes", ".", "-o", "mine", "--npy"]));
    let stopped = Stopped::new(before, &["-o", "mine", "--force"], ".");
    std::fs::write(stopped.world.path("mine/npy/thesis.tex"), "three years").unwrap();
    let (w, run) = stopped.end();
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(OUTPUT), "{said}");
    assert!(said.contains("npy/thesis.tex") && said.contains("mine-2"), "{said}");
    assert_eq!(std::fs::read(w.path("mine/npy/thesis.tex")).unwrap(), b"three years");
    assert_eq!(w.names("."), with_frames(&["mine", "mine-2"]));
}

#[test]
fn links_are_followed_and_stay() {
    let w = World::new();
    w.three();
    std::fs::create_dir_all(w.path("disk/results")).unwrap();
    std::os::unix::fs::symlink("disk/results", w.path("link")).unwrap();
    for force in [&[][..], &["--force"]] {
        let arguments = [&["stokes", ".", "-o", "link", "--json"], force].concat();
        assert_eq!(w.ok(&arguments).json()["output"], "link");
        assert!(w.path("link").is_symlink() && w.path("disk/results/stokes.exr").exists());
        assert_eq!(w.names("disk"), ["results"]);
    }
    std::os::unix::fs::symlink("nowhere", w.path("broken")).unwrap();
    w.refused(&["stokes", ".", "-o", "broken"], OUTPUT, &["link that leads nowhere"]);
    std::os::unix::fs::symlink(".", w.path("here")).unwrap();
    w.refused(&["stokes", ".", "-o", "here", "--force"], OUTPUT, &["the folder you are in"]);
}

#[test]
fn a_name_that_json_cannot_hold_is_refused() {
    use std::os::unix::ffi::OsStrExt;
    let w = World::new();
    w.three();
    let run = Command::new(env!("CARGO_BIN_EXE_brewster"))
        .args(["--json", "stokes", ".", "-o"])
        .arg(std::ffi::OsStr::from_bytes(b"\xff"))
        .current_dir(w.path("."))
        .output()
        .unwrap();
    let said: serde_json::Value = serde_json::from_slice(&run.stderr).unwrap();
    assert_eq!((run.status.code(), &said["error"]["kind"]), (Some(OUTPUT), &"output".into()), "{said}");
}

/// Where every write fails for want of space; `None` on systems without.
fn full() -> Option<Stdio> {
    Path::new("/dev/full").exists().then(|| OpenOptions::new().write(true).open("/dev/full").unwrap().into())
}

#[test]
fn a_result_that_cannot_be_printed_is_no_success() {
    let w = World::new();
    w.three();
    let brewster = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_brewster"));
        command.args(arguments).current_dir(w.path("."));
        command
    };
    for arguments in [&["info", "a_000.png"][..], &["stokes", ".", "-o", "r"], &["completions", "bash"], &["--help"]] {
        let Some(full) = full() else { return };
        let run = brewster(arguments).stdout(full).output().unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(OUTPUT), "{arguments:?} {said}");
        assert!(said.contains("cannot print"), "{said}");
        assert!(arguments[0] != "stokes" || said.contains("complete, in r"), "{said}");
    }
    let Some(out) = full() else { return };
    let run = brewster(&["--json", "stokes", ".", "-o", "j"]).stdout(out).output().unwrap();
    let said: serde_json::Value = serde_json::from_slice(&run.stderr).unwrap();
    assert_eq!((run.status.code(), &said["error"]["kind"]), (Some(OUTPUT), &"output".into()));
    assert!(w.path("j/stokes.exr").exists());
    // A warning that nobody can read.
    let Some(err) = full() else { return };
    let run = brewster(&["stokes", ".", "-o", "k", "--black", "auto"]).stderr(err).output().unwrap();
    assert_eq!(run.status.code(), Some(OUTPUT));
    // A reader that has seen enough.
    let mut child = brewster(&["completions", "bash"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

/// The old folder is moved aside, replaced, and then cannot be removed.
#[test]
fn an_old_folder_that_stays_is_a_warning() {
    use std::os::unix::fs::PermissionsExt;
    let w = World::new();
    w.three();
    let command = ["stokes", ".", "-o", "mine", "--npy", "--force"];
    w.ok(&command);
    std::fs::set_permissions(w.path("mine/npy"), std::fs::Permissions::from_mode(0o555)).unwrap();
    let run = w.ok(&command);
    // Whoever may do everything (root) can remove it all the same.
    let old = w.names(".").into_iter().find(|name| name.starts_with(".brewster-"));
    assert_eq!(run.stderr.contains("still there"), old.is_some(), "{}", run.stderr);
    if let Some(old) = old {
        std::fs::set_permissions(w.path(&old).join("npy"), std::fs::Permissions::from_mode(0o755)).unwrap();
    }
}
