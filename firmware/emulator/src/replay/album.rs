//! Grey pictures of one size, each with the polarizer axis it was taken at.

use crate::EmulatorError;
use png::{BitDepth, ColorType};
use protocol_polar::Degrees;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Name of the table of angles beside the pictures.
const TABLE: &str = "angles.toml";
/// Largest picture taken: twice the largest sensor of a board file in any direction would not fit a strip.
const LARGEST_SIDE: u32 = 16_384;

/// One photograph.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub(super) axis: Degrees,
    /// Height × width, row-major, DN.
    pub(super) samples: Vec<u16>,
}

/// Photographs of one size, in the order of their axes.
#[derive(Clone, Debug)]
pub(super) struct Album {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) pictures: Vec<Picture>,
}

/// `angles.toml`: file name to polarizer axis in the camera frame, degrees.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    angles_deg: BTreeMap<String, f64>,
}

impl Album {
    /// The pictures of `folder` whose names begin with `prefix`. Their axes stand in `angles.toml`, else at the end of
    /// their names: `name_045.png`, `name_45deg.png`, `name_22.5.png`.
    pub(super) fn read_folder(folder: &Path, prefix: &str) -> Result<Self, EmulatorError> {
        let mut listed = match read_table(folder)? {
            Some(table) => table.angles_deg.into_iter().map(|(name, deg)| (folder.join(name), deg)).collect(),
            None => angles_from_names(folder)?,
        };
        listed.retain(|(path, _)| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix)));
        listed.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut album = Self { width: 0, height: 0, pictures: Vec::new() };
        for (path, angle_deg) in listed {
            let (width, height, samples) = read_grey(&path)?;
            let unsupported = |what| EmulatorError::Unsupported { path: path.clone(), what };
            if album.pictures.is_empty() {
                (album.width, album.height) = (width, height);
            }
            if (width, height) != (album.width, album.height) {
                let (w, h) = (album.width, album.height);
                return Err(unsupported(format!("{width}x{height}, where the others are {w}x{h}")));
            }
            let axis = Degrees(angle_deg);
            let taken = |other: &Picture| apart(axis, other.axis) < 0.05;
            if album.pictures.iter().any(taken) {
                return Err(unsupported(format!("a second picture at {angle_deg}°; choose by prefix=")));
            }
            album.pictures.push(Picture { axis, samples });
        }
        if album.pictures.is_empty() {
            let what = "no pictures here: expected grey PNGs with their angles in their names".to_owned();
            return Err(EmulatorError::Unsupported { path: folder.to_owned(), what });
        }
        Ok(album)
    }
}

/// How far two axes are apart, degrees, [0, 90].
pub(super) fn apart(a: Degrees, b: Degrees) -> f64 {
    a.to_radians().axis_difference(b.to_radians()).to_degrees().0.abs()
}

fn read_table(folder: &Path) -> Result<Option<Table>, EmulatorError> {
    let path = folder.join(TABLE);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(EmulatorError::Io { path, source }),
    };
    let table: Table =
        toml::from_str(&text).map_err(|error| EmulatorError::Table { path: path.clone(), what: error.to_string() })?;
    match table.angles_deg.iter().find(|(_, deg)| !deg.is_finite()) {
        Some((name, deg)) => Err(EmulatorError::Table { path, what: format!("`{name}`: {deg} is no angle") }),
        None => Ok(Some(table)),
    }
}

fn angles_from_names(folder: &Path) -> Result<Vec<(PathBuf, f64)>, EmulatorError> {
    let io = |source| EmulatorError::Io { path: folder.to_owned(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let is_png = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        if let (true, Some(stem)) = (is_png, stem)
            && let Some(angle_deg) = angle_in_name(&stem)
        {
            found.push((path, angle_deg));
        }
    }
    Ok(found)
}

/// The angle at the end of a file's stem, behind its last underscore.
fn angle_in_name(stem: &str) -> Option<f64> {
    let last = stem.rsplit('_').next()?;
    let number = last.strip_suffix("deg").unwrap_or(last);
    let digits = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    if number.chars().all(digits) { number.parse().ok() } else { None }
}

/// A grey PNG of 8 or 16 bits: width, height, samples.
pub(super) fn read_grey(path: &Path) -> Result<(u32, u32, Vec<u16>), EmulatorError> {
    let unsupported = |what: String| EmulatorError::Unsupported { path: path.to_owned(), what };
    let malformed = |source| EmulatorError::Png { path: path.to_owned(), source };
    let file = File::open(path).map_err(|source| EmulatorError::Io { path: path.to_owned(), source })?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    let header = decoder.read_header_info().map_err(malformed)?;
    let (width, height) = (header.width, header.height);
    let (color, depth) = (header.color_type, header.bit_depth);
    if color != ColorType::Grayscale || !matches!(depth, BitDepth::Eight | BitDepth::Sixteen) {
        return Err(unsupported(format!("{color:?} of {} bits; grey of 8 or 16 bits is replayed", depth as u8)));
    }
    if width.max(height) > LARGEST_SIDE {
        return Err(unsupported(format!("{width}x{height} is larger than {LARGEST_SIDE} photosites")));
    }
    let mut reader = decoder.read_info().map_err(malformed)?;
    let bytes = reader.output_buffer_size().ok_or_else(|| unsupported("an absurd size".to_owned()))?;
    let mut raw = vec![0_u8; bytes];
    reader.next_frame(&mut raw).map_err(malformed)?;
    let samples = if depth == BitDepth::Sixteen {
        // Network byte order (PNG specification, section 7.1).
        raw.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect()
    } else {
        raw.into_iter().map(u16::from).collect()
    };
    Ok((width, height, samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_read_from_the_end_of_names() {
        for (stem, angle) in [
            ("name_045", Some(45.0)),
            ("a_b_45deg", Some(45.0)),
            ("six_22.5", Some(22.5)),
            ("x_-30deg", Some(-30.0)),
            ("135", Some(135.0)),
            ("picture", None),
            ("name_inf", None),
            ("name_", None),
            ("name_45x", None),
        ] {
            assert_eq!(angle_in_name(stem).map(f64::to_bits), angle.map(f64::to_bits), "{stem}");
        }
    }
}
