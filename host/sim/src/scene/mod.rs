//! Scene files: TOML, `schema = 1`, units in keys, unknown keys are errors.
//!
//! World: right-handed, the sample in z = 0 about the origin, x right and y up as one looks down on it, +z its mean normal.
//! Angles are degrees in the file and radians (or vectors) here. [`Scene::parse`] returns a scene only if every value lies
//! in its range and every map was read, so whoever simulates it need not check again.

mod bumps;
mod device;
mod light;
mod locate;
mod radiance;
mod sample;
mod surface;
mod texture;
mod value;
mod view;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

pub use bumps::Bumps;
pub use device::{Approach, Camera, Exposure, Plan, Polarizer, Wheel};
pub use light::{Light, MapSource, SkyBand, SkyPattern, SkyRadiance, TurnedMap};
pub use sample::{Layout, Patch, Sample};
pub use surface::{Field, Index, Normals, Surface, SurfacePoint};
pub use texture::Texture;

use crate::SimError;
use crate::camera::Pinhole;
use locate::At;

/// The schema number this crate reads.
pub const SCHEMA: i64 = 1;

/// Everything a simulation needs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What it shows, for people.
    pub name: String,
    /// Seed of every random draw.
    pub seed: u64,
    /// What is looked at.
    pub sample: Sample,
    /// Where from; at least one.
    pub views: Vec<Pinhole>,
    /// What it is lit by.
    pub light: Light,
    /// Sensor and lens.
    pub camera: Camera,
    /// The filter.
    pub polarizer: Polarizer,
    /// What turns the filter.
    pub wheel: Wheel,
    /// The frames of a capture of one view.
    pub plan: Plan,
}

/// All a first look at a file needs: which schema the rest follows. Other keys are not judged yet.
#[derive(Deserialize)]
struct SchemaOnly {
    schema: i64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScene {
    #[serde(rename = "schema")]
    _schema: i64,
    name: String,
    seed: u64,
    sample: sample::RawSample,
    surface: BTreeMap<String, surface::RawSurface>,
    view: Vec<view::RawView>,
    light: light::RawLight,
    camera: Camera,
    polarizer: Polarizer,
    wheel: Wheel,
    plan: device::RawPlan,
}

impl Scene {
    /// Reads and checks one scene file and its maps, whose paths are relative to the file's folder.
    ///
    /// # Errors
    /// [`SimError::Io`] where the file cannot be read as UTF-8 text; else as [`Scene::parse`].
    pub fn read(file: &Path) -> Result<Self, SimError> {
        let text = std::fs::read_to_string(file).map_err(|source| SimError::Io { file: file.to_path_buf(), source })?;
        Self::parse(&text, file)
    }

    /// Parses and checks the text of a scene file; `file` names it in errors and its folder is where maps are looked for.
    ///
    /// # Errors
    /// Each with the key and its line. [`SimError::UnknownSchema`] before anything else is judged, then
    /// [`SimError::Parse`], [`SimError::UnknownKey`] or [`SimError::UnknownValue`] for what does not fit the schema, then
    /// the first of [`SimError::OutOfRange`], [`SimError::Optics`], [`SimError::Map`] and `UnknownValue` for a surface or
    /// material that does not exist.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SimError> {
        let at = At::root(text, file);
        let SchemaOnly { schema } = toml::from_str(text).map_err(|e| at.parser(&e))?;
        if schema != SCHEMA {
            return Err(SimError::UnknownSchema { place: at.place("schema"), found: schema, supported: SCHEMA });
        }
        let raw: RawScene = toml::from_str(text).map_err(|e| at.parser(&e))?;
        raw.camera.check(&at.table("camera"))?;
        raw.polarizer.check(&at.table("polarizer"))?;
        raw.wheel.check(&at.table("wheel"))?;
        at.check(!raw.view.is_empty(), "view", "[]", || "at least one table `[[view]]`".to_owned())?;
        let views = raw.view.iter().enumerate().map(|(k, view)| view.check(&at.table("view").table(k), &raw.camera));
        Ok(Self {
            name: raw.name,
            seed: raw.seed,
            views: views.collect::<Result<_, _>>()?,
            sample: raw.sample.check(raw.surface, &at, raw.seed)?,
            light: raw.light.check(&at.table("light"))?,
            plan: raw.plan.check(&at.table("plan"))?,
            camera: raw.camera,
            polarizer: raw.polarizer,
            wheel: raw.wheel,
        })
    }

    /// The same scene on another number of photosites. Lens and width of the sensor stay, so the field of view is the same
    /// across; pitch and blur in pixels follow. What a photosite holds, and its noise, stay.
    #[must_use]
    pub fn resized(mut self, width_px: u16, height_px: u16) -> Self {
        let (width_px, height_px) = (width_px.max(1), height_px.max(1));
        let factor = f64::from(width_px) / f64::from(self.camera.width_px);
        self.camera.pixel_pitch_um /= factor;
        self.camera.psf_sigma_px *= factor;
        (self.camera.width_px, self.camera.height_px) = (width_px, height_px);
        for view in &mut self.views {
            view.focal_px *= factor;
            (view.width, view.height) = (usize::from(width_px), usize::from(height_px));
        }
        self
    }
}
