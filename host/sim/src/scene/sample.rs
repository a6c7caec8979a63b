//! The planar sample: a square in z = 0 about the origin, x right and y up as one looks down on it, and which surface is
//! where.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::DVec2;
use host_image::Samples;
use serde::Deserialize;

use super::locate::At;
use super::surface::{RawSurface, Surface, SurfacePoint};
use super::texture::{nearest, read_picture, real};
use crate::SimError;

/// A square planar sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Length of a side.
    pub side_m: f64,
    /// Everything it is made of, sorted by name.
    pub surfaces: Vec<Surface>,
    /// What is where.
    pub layout: Layout,
}

/// Which surface (an index of [`Sample::surfaces`]) is where. Cells count from the upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// One everywhere.
    Uniform(usize),
    /// Cells whose surface is number (row + column) of the list, over and over.
    Checker {
        /// (columns, rows).
        cells: [usize; 2],
        /// In the order of the diagonal.
        surfaces: Vec<usize>,
    },
    /// Cells in reading order, over and over, with joints between and around them.
    Grid {
        /// (columns, rows).
        cells: [usize; 2],
        /// In reading order.
        surfaces: Vec<usize>,
        /// Width of a joint; half of it runs along the sample's edge.
        joint_m: f64,
        /// What the joints are of.
        joint: usize,
    },
    /// Rectangles on a background; later ones lie on top.
    Patches {
        /// Where there is no rectangle.
        background: usize,
        /// In the order of the file.
        patches: Vec<Patch>,
    },
    /// By a picture whose grey value is the place in a list; nearest pixel.
    IndexMap {
        /// (columns, rows).
        size: [usize; 2],
        /// Surface of every pixel, row-major, rows × columns.
        surfaces: Vec<usize>,
    },
}

/// A rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Lower left corner.
    pub low_m: DVec2,
    /// Upper right corner.
    pub high_m: DVec2,
    /// Index of its surface.
    pub surface: usize,
}

/// `[sample]` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSample {
    side_m: Option<f64>,
    side_mm: Option<f64>,
    surface: Option<String>,
    checker: Option<RawChecker>,
    grid: Option<RawGrid>,
    patches: Option<RawPatches>,
    index_map: Option<RawIndexMap>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawChecker {
    columns: u16,
    rows: u16,
    surfaces: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawGrid {
    columns: u16,
    rows: u16,
    surfaces: Vec<String>,
    joint_mm: f64,
    joint: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPatches {
    background: String,
    patch: Vec<RawPatch>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPatch {
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    surface: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawIndexMap {
    file: PathBuf,
    surfaces: Vec<String>,
}

impl Sample {
    /// What is at (x, y) in m; `None` beyond the sample.
    #[must_use]
    pub fn at(&self, point: DVec2) -> Option<SurfacePoint> {
        let (u, v) = (point.x / self.side_m + 0.5, 0.5 - point.y / self.side_m);
        if !((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)) {
            return None;
        }
        let index = self.layout.surface([u, v], point, self.side_m);
        self.surfaces.get(index).map(|surface| surface.at(index, point, [u, v]))
    }
}

impl Layout {
    /// The surface at map coordinates (u right, v down) in [0, 1]².
    fn surface(&self, [u, v]: [f64; 2], point: DVec2, side_m: f64) -> usize {
        let cell = |[columns, rows]: [usize; 2]| {
            let (x, y) = (u * real(columns), v * real(rows));
            ([nearest(x, columns), nearest(y, rows)], [x, y])
        };
        match self {
            Self::Uniform(surface) => *surface,
            Self::Checker { cells, surfaces } => {
                let ([column, row], _) = cell(*cells);
                surfaces[(row + column) % surfaces.len()]
            }
            Self::Grid { cells, surfaces, joint_m, joint } => {
                let ([column, row], [x, y]) = cell(*cells);
                let to_line = |t: f64, count: usize| (t - t.round()).abs() * side_m / real(count);
                if to_line(x, cells[0]).min(to_line(y, cells[1])) < 0.5 * joint_m {
                    return *joint;
                }
                surfaces[(row * cells[0] + column) % surfaces.len()]
            }
            Self::Patches { background, patches } => {
                let holds = |p: &&Patch| point.cmpge(p.low_m).all() && point.cmplt(p.high_m).all();
                patches.iter().rev().find(holds).map_or(*background, |p| p.surface)
            }
            Self::IndexMap { size, surfaces } => {
                let ([column, row], _) = cell(*size);
                surfaces[row * size[0] + column]
            }
        }
    }
}

impl RawSample {
    /// `surfaces` are the tables `[surface.NAME]`, `top` is the root of the scene.
    pub(super) fn check(
        self,
        surfaces: BTreeMap<String, RawSurface>,
        top: &At<'_>,
        seed: u64,
    ) -> Result<Sample, SimError> {
        let at = top.table("sample");
        let side_m = match (self.side_m, self.side_mm) {
            (Some(m), None) => {
                at.within("side_m", m, 1e-3..=100.0)?;
                m
            }
            (None, Some(mm)) => {
                at.within("side_mm", mm, 1.0..=1e5)?;
                1e-3 * mm
            }
            _ => return Err(at.malformed("", "exactly one of `side_m` and `side_mm` is needed")),
        };
        let names: Vec<String> = surfaces.keys().cloned().collect();
        let layout = self.layout(&Names { names: &names }, &at)?;
        let surfaces = surfaces
            .into_iter()
            .zip(0..)
            .map(|((name, raw), which)| raw.check(&name, &top.table("surface").table(&name), seed, which));
        Ok(Sample { side_m, surfaces: surfaces.collect::<Result<_, _>>()?, layout })
    }

    fn layout(self, names: &Names<'_>, at: &At<'_>) -> Result<Layout, SimError> {
        match (self.surface, self.checker, self.grid, self.patches, self.index_map) {
            (Some(name), None, None, None, None) => names.find(at, "surface", &name).map(Layout::Uniform),
            (None, Some(raw), None, None, None) => {
                let at = at.table("checker");
                let cells = counted(&at, raw.columns, raw.rows)?;
                Ok(Layout::Checker { cells, surfaces: names.list(&at, &raw.surfaces)? })
            }
            (None, None, Some(raw), None, None) => {
                let at = at.table("grid");
                let cells = counted(&at, raw.columns, raw.rows)?;
                at.within("joint_mm", raw.joint_mm, 0.0..=1e4)?;
                let (surfaces, joint) = (names.list(&at, &raw.surfaces)?, names.find(&at, "joint", &raw.joint)?);
                Ok(Layout::Grid { cells, surfaces, joint_m: 1e-3 * raw.joint_mm, joint })
            }
            (None, None, None, Some(raw), None) => raw.check(names, &at.table("patches")),
            (None, None, None, None, Some(raw)) => raw.check(names, &at.table("index_map")),
            _ => Err(at.malformed(
                "",
                "exactly one of `surface`, `checker`, `grid`, `patches` and `index_map` is needed: what is where",
            )),
        }
    }
}

impl RawPatches {
    fn check(self, names: &Names<'_>, at: &At<'_>) -> Result<Layout, SimError> {
        let background = names.find(at, "background", &self.background)?;
        let patches = self.patch.iter().enumerate().map(|(index, raw)| {
            let at = at.table("patch").table(index);
            let ends = [raw.x_mm, raw.y_mm];
            for (key, [low, high]) in ["x_mm", "y_mm"].into_iter().zip(ends) {
                let sound = low < high && high - low <= 1e5;
                at.check(sound, key, format!("[{low}, {high}]"), || "[low, high] with low < high".to_owned())?;
            }
            let [x, y] = ends;
            Ok(Patch {
                low_m: 1e-3 * DVec2::new(x[0], y[0]),
                high_m: 1e-3 * DVec2::new(x[1], y[1]),
                surface: names.find(&at, "surface", &raw.surface)?,
            })
        });
        Ok(Layout::Patches { background, patches: patches.collect::<Result<_, SimError>>()? })
    }
}

impl RawIndexMap {
    fn check(self, names: &Names<'_>, at: &At<'_>) -> Result<Layout, SimError> {
        let listed = names.list(at, &self.surfaces)?;
        let picture = read_picture(at, "file", &self.file)?;
        let size = [picture.width, picture.height];
        let Samples::U8(pixels) = (match picture.channels {
            1 => picture.samples,
            _ => Samples::F32(Vec::new()),
        }) else {
            let found = format!("{} with {} channels", self.file.display(), picture.channels);
            return Err(SimError::OutOfRange {
                place: at.place("file"),
                value: found,
                allowed: "an 8-bit grey picture whose values are places in `surfaces`, counted from 0".to_owned(),
            });
        };
        let surfaces = pixels.iter().map(|value| {
            let found = listed.get(usize::from(*value)).copied();
            found.ok_or_else(|| SimError::OutOfRange {
                place: at.place("file"),
                value: format!("the grey value {value}"),
                allowed: format!("0 to {}: `surfaces` lists {}", listed.len() - 1, listed.len()),
            })
        });
        Ok(Layout::IndexMap { size, surfaces: surfaces.collect::<Result<_, _>>()? })
    }
}

/// The surfaces of the scene by name.
struct Names<'a> {
    names: &'a [String],
}

impl Names<'_> {
    fn find(&self, at: &At<'_>, key: &str, name: &str) -> Result<usize, SimError> {
        let known: Vec<&str> = self.names.iter().map(String::as_str).collect();
        self.names.iter().position(|n| n == name).ok_or_else(|| at.unknown(key, name, &known))
    }

    fn list(&self, at: &At<'_>, names: &[String]) -> Result<Vec<usize>, SimError> {
        at.check(!names.is_empty(), "surfaces", "[]", || "at least one name".to_owned())?;
        names.iter().map(|name| self.find(at, "surfaces", name)).collect()
    }
}

fn counted(at: &At<'_>, columns: u16, rows: u16) -> Result<[usize; 2], SimError> {
    at.within("columns", columns, 1.0..=1000.0)?;
    at.within("rows", rows, 1.0..=1000.0)?;
    Ok([usize::from(columns), usize::from(rows)])
}
