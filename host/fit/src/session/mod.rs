//! A session: pictures of one planar sample from several sides, under one light that is known, read from disk.
//!
//! Sources: a folder of views with a `capture.json` each (`v0/capture.json`, ...); a `views.json`, written by `brewster
//! simulate` or by hand; a folder with one. Of a view's geometry either the full pose, or the sample's corners or
//! fiducials in the picture and K, are given.
//!
//! Conventions: the sample lies in z = 0 of a right-handed world, mean normal +z, in units of the plane. Cameras as in
//! [`Camera`]. Angles of the polarizer and Stokes vectors are in the picture's frame: x right, y up, counter-clockwise.

mod ball;
mod camera;
mod document;
mod error;
mod frames;
pub mod homography;
mod light;
mod pose;
mod quality;
mod reference;
mod view;

use std::path::{Path, PathBuf};

pub use ball::{BallLight, MirrorBall};
pub use camera::{Camera, PoseFault};
pub use error::SessionError;
pub use frames::{Frames, StokesNoise, StokesSource};
pub use light::{BandLight, LightSpec, Polarization, Radiance};
pub use pose::{Placement, PoseOrigin};
pub use quality::{SessionQuality, ViewPair};
pub use reference::{ReferenceAxis, ReferenceCorrection};
pub use view::{ViewCapture, ViewData};

use document::{LightDocument, SessionDocument, ViewDocument};

/// The part of the plane that is the sample, in units of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// (least, largest) x.
    pub x: [f64; 2],
    /// (least, largest) y.
    pub y: [f64; 2],
}

/// A strip of black plastic beside the sample, flat in its plane and of a known index: what tells the wheel's zero
/// ([`crate::wheel::zeros`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceStrip {
    /// Where it is.
    pub place: Sample,
    /// Its index η.
    pub eta: f64,
}

/// η of the chart casing, as the paper takes it (§5).
const CASING_ETA: f64 = 1.46;

/// Which pictures of a view to use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Pictures {
    /// The longest sequence of frames; the Stokes image if there are no frames.
    #[default]
    Best,
    /// The sequence of this name.
    Sequence(String),
    /// The Stokes image.
    Stokes,
}

/// Pictures of a sample and what is known of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// At least one, in the order of the file or of the folders' names.
    pub views: Vec<ViewCapture>,
    /// What lights the sample.
    pub light: LightSpec,
    /// Where it is.
    pub sample: Sample,
    /// What to read the wheel's zero from, if there is one.
    pub strip: Option<ReferenceStrip>,
}

impl Session {
    /// Reads a folder of captures, a folder with a `views.json`, or such a file, pictures included, and checks that the
    /// views see a part of the sample together.
    ///
    /// # Errors
    /// [`SessionError`] as its variants say; each names the file and the view.
    pub fn open(path: &Path, pictures: &Pictures) -> Result<Self, SessionError> {
        let listed = path.join("views.json");
        let session = if path.is_file() {
            Self::from_list(path, pictures)
        } else if listed.is_file() {
            Self::from_list(&listed, pictures)
        } else {
            Self::from_captures(path, pictures)
        }?;
        session.check_overlap()?;
        Ok(session)
    }

    fn from_list(path: &Path, pictures: &Pictures) -> Result<Self, SessionError> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let place = path.display().to_string();
        let text = read(path)?;
        let document: SessionDocument = parse(path, &text)?;
        version(document.version, &place)?;
        let mut lit: Option<(&str, &LightDocument)> = document.light.as_ref().map(|light| ("light", light));
        for view in &document.views {
            let name = view.view.as_deref().unwrap_or("a view");
            match (lit, &view.light) {
                (None, Some(light)) => lit = Some((name, light)),
                (Some((first, known)), Some(light)) if known != light => return Err(two_lights(place, first, name)),
                _ => {}
            }
        }
        let Some((_, light)) = lit else { return Err(no_light(place)) };
        let light = light::read(light, folder, &place)?;
        let numbered = document.views.iter().enumerate();
        let views = numbered.map(|(i, view)| view::read(view, folder, &place, i, view::Defaults::List, pictures));
        let views: Vec<ViewCapture> = views.collect::<Result<_, _>>()?;
        let stated = document.sample.map(|s| (s.x, s.y)).or_else(|| document.views.first().and_then(corners));
        let strip = document.views.iter().find_map(strip);
        Self { views, light, sample: sample(stated, &place)?, strip }.with_views(&place)
    }

    fn from_captures(folder: &Path, pictures: &Pictures) -> Result<Self, SessionError> {
        let io = |source| SessionError::Io { path: folder.into(), source };
        let mut files: Vec<PathBuf> = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(io)? {
            let file = entry.map_err(io)?.path().join("capture.json");
            if file.is_file() {
                files.push(file);
            }
        }
        files.sort();
        let mut views = Vec::new();
        let mut lit: Option<(PathBuf, LightDocument)> = None;
        let (mut stated, mut reference) = (None, None);
        for (i, path) in files.iter().enumerate() {
            let own = path.parent().unwrap_or(folder);
            let place = path.display().to_string();
            let document: ViewDocument = parse(path, &read(path)?)?;
            if let Some(found) = document.version {
                version(found, &place)?;
            }
            views.push(view::read(&document, own, &place, i, view::Defaults::Capture, pictures)?);
            stated = stated.or_else(|| corners(&document));
            reference = reference.or_else(|| strip(&document));
            let Some(light) = document.light else { return Err(no_light(place)) };
            match &lit {
                None => lit = Some((path.clone(), light)),
                Some((_, first)) if *first == light => {}
                Some((first, _)) => {
                    return Err(two_lights(folder.display().to_string(), &first.display().to_string(), &place));
                }
            }
        }
        let place = folder.display().to_string();
        let Some((path, document)) = lit else {
            return Err(SessionError::Missing {
                place,
                what: "views.json, or capture.json in folders".to_owned(),
                remedy: "name a folder of views or a views.json",
            });
        };
        let light = light::read(&document, path.parent().unwrap_or(folder), &path.display().to_string())?;
        Self { views, light, sample: sample(stated, &place)?, strip: reference }.with_views(&place)
    }

    fn with_views(self, place: &str) -> Result<Self, SessionError> {
        let most = crate::material::MAX_VIEWS;
        if (1..=most).contains(&self.views.len()) {
            return Ok(self);
        }
        Err(SessionError::Malformed {
            place: place.to_owned(),
            key: "views".to_owned(),
            found: format!("a list of {}", self.views.len()),
            expected: format!("1 to {most} views are read"),
        })
    }

    fn check_overlap(&self) -> Result<(), SessionError> {
        let quality = self.quality();
        match quality.pairs.iter().find(|p| p.overlap <= 0.0) {
            None => Ok(()),
            Some(pair) => {
                let [first, second] = pair.views.map(|v| self.views[v].name.clone());
                Err(SessionError::NoOverlap { first, second })
            }
        }
    }
}

fn read(path: &Path) -> Result<String, SessionError> {
    std::fs::read_to_string(path).map_err(|source| SessionError::Io { path: path.into(), source })
}

fn parse<'a, T: serde::Deserialize<'a>>(path: &Path, text: &'a str) -> Result<T, SessionError> {
    serde_json::from_str(text).map_err(|source| SessionError::Json { path: path.into(), source })
}

fn version(found: u32, place: &str) -> Result<(), SessionError> {
    if found == 1 {
        return Ok(());
    }
    let (place, key) = (place.to_owned(), "version".to_owned());
    Err(SessionError::Unsupported { place, key, found: found.to_string(), known: "version 1 is".to_owned() })
}

/// The extent of the sample's corners in the plane.
fn corners(view: &ViewDocument) -> Option<([f64; 2], [f64; 2])> {
    let corners = view.plane.as_ref()?.sample_corners_plane.as_ref()?;
    let extent = |k: usize| {
        let along = corners.iter().map(|c| c[k]);
        [along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max)]
    };
    Some((extent(0), extent(1)))
}

/// The reference strip, if its place and index make sense.
fn strip(view: &ViewDocument) -> Option<ReferenceStrip> {
    let stated = view.plane.as_ref()?.reference_strip?;
    let [x0, x1, y0, y1] = stated.rect_plane_x0x1y0y1;
    let eta = stated.eta.unwrap_or(CASING_ETA);
    (x0 < x1 && y0 < y1 && eta > 1.0).then_some(ReferenceStrip { place: Sample { x: [x0, x1], y: [y0, y1] }, eta })
}

fn two_lights(place: String, first: &str, second: &str) -> SessionError {
    let what = "the light of two views".to_owned();
    SessionError::Disagree { place, what, first: first.to_owned(), second: second.to_owned() }
}

fn no_light(place: String) -> SessionError {
    SessionError::Missing { place, what: "light".to_owned(), remedy: "the fit must know the light: add it" }
}

/// The stated part of the plane, or the unit square about its origin.
fn sample(stated: Option<([f64; 2], [f64; 2])>, place: &str) -> Result<Sample, SessionError> {
    let (x, y) = stated.unwrap_or(([-0.5, 0.5], [-0.5, 0.5]));
    if [x, y].iter().all(|[a, b]| a < b && a.is_finite() && b.is_finite()) {
        return Ok(Sample { x, y });
    }
    Err(SessionError::Malformed {
        place: place.to_owned(),
        key: "sample".to_owned(),
        found: format!("x {x:?}, y {y:?}"),
        expected: "each is [least, largest]".to_owned(),
    })
}
