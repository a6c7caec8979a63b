//! A folder of pictures, and the program run in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use host_image::{Encoding, Picture, Samples, StokesImage};
use serde_json::Value;
use tempfile::TempDir;

pub(crate) struct World {
    folder: TempDir,
}

/// What the program did.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl World {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs `brewster` in the folder.
    pub(crate) fn run(&self, arguments: &[&str]) -> Run {
        let program = env!("CARGO_BIN_EXE_brewster");
        let Output { status, stdout, stderr } =
            Command::new(program).args(arguments).current_dir(self.folder.path()).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Run { code: status.code().unwrap_or(-1), stdout: text(stdout), stderr: text(stderr) }
    }

    /// A run that must succeed.
    pub(crate) fn ok(&self, arguments: &[&str]) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, 0, "{arguments:?}: {}", run.stderr);
        run
    }

    /// A run that must end with `code`, say all of `words` on stderr and nothing on stdout, and leave no trace.
    pub(crate) fn refused(&self, arguments: &[&str], code: i32, words: &[&str]) {
        let before = self.names(".");
        let run = self.run(arguments);
        assert_eq!((run.code, run.stdout.as_str()), (code, ""), "{arguments:?}: {}", run.stderr);
        for word in words {
            assert!(run.stderr.contains(word), "{arguments:?}: no {word:?} in: {}", run.stderr);
        }
        assert_eq!(self.names("."), before, "{arguments:?} left something behind");
    }

    /// Names in a folder, hidden ones included, sorted.
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// A grey 16-bit linear PNG.
    pub(crate) fn grey(&self, name: &str, width: usize, samples: &[u16]) {
        let samples = Samples::U16(samples.to_vec());
        picture(width, 1, samples, Encoding::Unstated).write_png(&self.path(name)).unwrap();
    }

    /// Grey 16-bit frames of 4 × 2 pixels at 0, 45 and 90 degrees: light of s0 = 2000 DN, DoLP 0.5, AoLP 0.
    pub(crate) fn three(&self) -> [&'static str; 3] {
        let names = ["a_000.png", "a_045.png", "a_090.png"];
        for (name, dn) in names.iter().zip([1500, 1000, 500]) {
            self.grey(name, 4, &[dn; 8]);
        }
        names
    }

    /// The image a run wrote.
    pub(crate) fn stokes(&self, folder: &str) -> StokesImage {
        StokesImage::load_exr(&self.path(folder).join("stokes.exr")).unwrap()
    }
}

impl Run {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {}", self.stdout))
    }
}

pub(crate) fn picture(width: usize, channels: usize, samples: Samples, encoding: Encoding) -> Picture {
    let height = samples.len() / width / channels;
    Picture { width, height, channels, samples, encoding }
}

/// Cuts the last `bytes` off a file.
pub(crate) fn cut(path: &Path, bytes: usize) {
    let whole = std::fs::read(path).unwrap();
    std::fs::write(path, &whole[..whole.len() - bytes]).unwrap();
}

/// A minimal TIFF (little-endian, one strip, grey): TIFF 6.0, baseline.
pub(crate) fn tiff(width: u32, bits: u32, samples: &[u8]) -> Vec<u8> {
    let height = u32::try_from(samples.len()).unwrap() * 8 / bits / width;
    let entries: [(u16, u32); 9] = [
        (256, width),
        (257, height),
        (258, bits),
        (259, 1),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, height),
        (279, u32::try_from(samples.len()).unwrap()),
    ];
    let mut file = b"II*\0".to_vec();
    file.extend(u32::try_from(8 + samples.len()).unwrap().to_le_bytes());
    file.extend(samples);
    file.extend(u16::try_from(entries.len()).unwrap().to_le_bytes());
    for (tag, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(4_u16.to_le_bytes());
        file.extend(1_u32.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend(0_u32.to_le_bytes());
    file
}
