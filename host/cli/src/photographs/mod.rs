//! Photographs from any camera: which files, at which polarizer angles, and their samples as linear planes.

mod angles;
mod find;
mod load;

pub(crate) use angles::{RULES, from_names};
pub(crate) use find::find;
pub(crate) use load::{Calibration, Photographs, SampleType, encoding_words};

use std::path::Path;

/// The name of a file without its folders, as people write it.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
