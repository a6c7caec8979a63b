//! Output folders: whole or not at all, and nobody's files are replaced.

#[cfg(unix)]
mod unix;

use crate::world::World;

const OUTPUT: i32 = 4;

#[test]
fn a_folder_that_is_not_empty_is_left_alone() {
    let w = World::new();
    w.three();
    std::fs::create_dir(w.path("mine")).unwrap();
    w.ok(&["stokes", ".", "-o", "mine"]);
    w.refused(&["stokes", ".", "-o", "mine"], OUTPUT, &["mine", "not empty", "--force"]);
    let old = std::fs::read(w.path("mine/brewster.json")).unwrap();
    w.ok(&["stokes", ".", "-o", "mine", "--force", "--black", "10"]);
    assert_ne!(std::fs::read(w.path("mine/brewster.json")).unwrap(), old);

    // --force is for what brewster made, not for what it finds.
    std::fs::write(w.path("mine/thesis.tex"), "three years").unwrap();
    w.refused(&["stokes", ".", "-o", "mine", "--force"], OUTPUT, &["thesis.tex", "did not make"]);
    assert_eq!(std::fs::read(w.path("mine/thesis.tex")).unwrap(), b"three years");
    w.refused(&["stokes", ".", "-o", ".", "--force"], OUTPUT, &["the folder you are in"]);
    assert_eq!(w.names("."), ["a_000.png", "a_045.png", "a_090.png", "mine"]);
}

#[test]
fn a_place_that_cannot_be_written() {
    let w = World::new();
    w.three();
    std::fs::write(w.path("file"), "not a folder").unwrap();
    w.refused(&["stokes", ".", "-o", "file"], OUTPUT, &["file", "-o"]);
    w.refused(&["stokes", ".", "-o", "file/below/it"], OUTPUT, &["file", "-o"]);
    assert_eq!(std::fs::read(w.path("file")).unwrap(), b"not a folder");
}

#[test]
fn a_failure_on_the_way_leaves_no_folder_behind() {
    let w = World::new();
    let [_, _, c] = w.three();
    crate::world::cut(&w.path(c), 20);
    w.refused(&["stokes", ".", "-o", "deep/er/result"], 3, &[c]);
    w.refused(&["stokes", "."], 3, &[c]);
}

/// /dev/full and tiny file systems are not everywhere; a limit on the size of files is, and fails the same way.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_leaves_no_folder_behind() {
    let w = World::new();
    for (name, dn) in [("a_0.png", 900), ("a_60.png", 1000), ("a_120.png", 1100)] {
        let noise: Vec<u16> = (0..90_000_u32).map(|i| dn + (i.wrapping_mul(2_654_435_761) >> 24) as u16).collect();
        w.grey(name, 300, &noise);
    }
    let before = w.names(".");
    // 100 blocks of 512 or 1024 bytes; SIGXFSZ is ignored, so that write() fails with EFBIG instead.
    let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" stokes . -o result";
    let run = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_brewster")])
        .current_dir(w.path("."))
        .output()
        .unwrap();
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(OUTPUT), "{said}");
    assert!(said.contains("result/") && said.contains("free space"), "{said}");
    assert_eq!(w.names("."), before);
}
#[test]
fn force_looks_into_every_folder() {
    let w = World::new();
    w.three();
    let command = ["stokes", ".", "-o", "mine", "--npy", "--force"];
    let json = w.ok(&[&command[..], &["--json"]].concat()).json();
    let files: Vec<&str> = json["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    assert!(files.contains(&"npy/S0.Y.npy") && files.contains(&"brewster.json"), "{files:?}");
    w.ok(&command);

    for foreign in ["npy/thesis.tex", "npy/deep/thesis.tex", "chapter/1.tex"] {
        let path = w.path("mine").join(foreign);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, "three years").unwrap();
        w.refused(&command, OUTPUT, &[foreign, "did not make"]);
        assert_eq!(std::fs::read(&path).unwrap(), b"three years");
        std::fs::remove_file(&path).unwrap();
        if path.parent().unwrap() != w.path("mine/npy") {
            w.refused(&command, OUTPUT, &["did not make"]);
            std::fs::remove_dir(path.parent().unwrap()).unwrap();
        }
    }
    // What the user took out is not missed.
    w.names("mine/npy").iter().for_each(|name| std::fs::remove_file(w.path("mine/npy").join(name)).unwrap());
    w.ok(&command);
}

#[test]
fn folders_that_are_no_place_for_results() {
    let w = World::new();
    w.three();
    std::fs::create_dir(w.path("empty")).unwrap();
    for place in [".", "./", "empty/..", "..", "/"] {
        for force in [&[][..], &["--force"]] {
            let arguments = [&["stokes", ".", "-o", place], force].concat();
            w.refused(&arguments, OUTPUT, &["the folder you are in", "-o result"]);
        }
    }
    w.refused(&["stokes", ".", "-o", "nowhere/.."], OUTPUT, &["not the name"]);
    w.ok(&["stokes", ".", "-o", "empty"]);
}

#[test]
fn many_at_once_get_a_folder_each() {
    let w = World::new();
    w.three();
    let runs: Vec<_> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..6).map(|_| scope.spawn(|| w.ok(&["stokes", ".", "--json"]).json())).collect();
        started.into_iter().map(|run| run.join().unwrap()).collect()
    });
    let mut outputs: Vec<&str> = runs.iter().map(|json| json["output"].as_str().unwrap()).collect();
    for (json, output) in runs.iter().zip(&outputs) {
        let record = std::fs::read(w.path(output).join("brewster.json")).unwrap();
        assert_eq!(&serde_json::from_slice::<serde_json::Value>(&record).unwrap(), json);
    }
    outputs.sort_unstable();
    outputs.dedup();
    assert_eq!((outputs.len(), w.names("out").len()), (6, 6), "{outputs:?}");
}
