//! One view: its camera, what its Stokes vectors refer to, and its pictures.

use std::path::Path;

use host_image::{BayerPattern, FRAME_CONVENTION, Picture, StokesImage};
use protocol_polar::{Analyzer, Degrees, efficiency_from_extinction_ratio};

use super::camera::Camera;
use super::document::{FrameDocument, PerBand, PolarizerDocument, SensorDocument, StokesDocument, ViewDocument};
use super::frames::{Frames, StokesNoise, StokesSource, require_linear};
use super::pose::{self, Placement};
use super::reference::ReferenceAxis;
use super::{Pictures, SessionError};
use crate::Noise;

/// One view of the sample.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewCapture {
    /// Its name.
    pub name: String,
    /// Where from.
    pub camera: Camera,
    /// How that is known.
    pub placement: Placement,
    /// What the Stokes vectors refer to.
    pub reference: ReferenceAxis,
    /// The pictures.
    pub data: ViewData,
}

/// The pictures of a view.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewData {
    /// Raw frames.
    Frames(Frames),
    /// What was made of them.
    Stokes(Box<StokesSource>),
}

/// Whose habits hold where a file says nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Defaults {
    /// `capture.json` of a renderer that takes normalize(d × up) for the axis of a ray.
    Capture,
    /// `views.json`: real polarizers, and Stokes images of ours.
    List,
}

/// A false alarm of the misfit flag in exp(−12.5) of the pixels.
const MISFIT_SIGMA: f64 = 5.0;

/// Noise of a Stokes image that says nothing of it.
const RELATIVE_NOISE: f64 = 1e-3;

pub(super) fn read(
    document: &ViewDocument,
    folder: &Path,
    file: &str,
    index: usize,
    defaults: Defaults,
    pictures: &Pictures,
) -> Result<ViewCapture, SessionError> {
    let name = document.view.clone().unwrap_or_else(|| format!("view {index}"));
    let reading = Reading { document, folder, place: format!("{file}, {name}"), defaults };
    reading.convention()?;
    let data = match (pictures, &document.stokes) {
        (Pictures::Stokes, None) => return Err(reading.missing("stokes", "name a Stokes image, or use the frames")),
        (Pictures::Stokes, Some(stokes)) => ViewData::Stokes(Box::new(reading.stokes(stokes)?)),
        (Pictures::Best, Some(stokes)) if reading.longest().is_none() => {
            ViewData::Stokes(Box::new(reading.stokes(stokes)?))
        }
        (Pictures::Best | Pictures::Sequence(_), _) => ViewData::Frames(reading.frames(pictures)?),
    };
    let size = match &data {
        ViewData::Frames(frames) => frames.size(),
        ViewData::Stokes(source) => [source.image.width, source.image.height],
    };
    if let Some(image) = &document.image
        && [image.width, image.height] != size
    {
        return Err(SessionError::Disagree {
            place: reading.place,
            what: "the size of the pictures".to_owned(),
            first: format!("image {} x {}", image.width, image.height),
            second: format!("the files' {} x {}", size[0], size[1]),
        });
    }
    let (camera, placement) = pose::camera(&document.camera, document.plane.as_ref(), size, &reading.place)?;
    let reference = reading.reference(&data)?;
    Ok(ViewCapture { name, camera, placement, reference, data })
}

struct Reading<'a> {
    document: &'a ViewDocument,
    folder: &'a Path,
    place: String,
    defaults: Defaults,
}

/// How `capture.json` words the convention.
const CAPTURE_CONVENTION: &str = "transmission axis, counter-clockwise from image right as seen in the picture; s1>0 \
                                  horizontal, s2>0 at +45 deg (right-up)";

impl ViewData {
    /// Analyzers of the frames, or of those a Stokes image was made from; empty if that is not known.
    #[must_use]
    pub fn analyzers(&self) -> Vec<Analyzer> {
        match self {
            Self::Frames(frames) => frames.analyzers.clone(),
            Self::Stokes(source) => source.analyzers(),
        }
    }
}

impl Reading<'_> {
    fn convention(&self) -> Result<(), SessionError> {
        let stated = self.document.polarizer.as_ref().and_then(|p| p.angle_convention.as_deref());
        match stated {
            None | Some(FRAME_CONVENTION | CAPTURE_CONVENTION) => {}
            Some(other) => {
                let known =
                    format!("{FRAME_CONVENTION:?} is: turn the angles into it, and say so or leave the key out");
                return Err(self.unsupported("polarizer.angle_convention", other, &known));
            }
        }
        match self.document.image.as_ref().and_then(|i| i.linear) {
            Some(false) => Err(self.unsupported("image.linear", "false", "frames linear in light are")),
            _ => Ok(()),
        }
    }

    fn reference(&self, data: &ViewData) -> Result<ReferenceAxis, SessionError> {
        let stated = self.document.polarizer.as_ref().and_then(|p| p.reference_axis.as_deref());
        let reference = match (stated, self.defaults, data) {
            (Some("camera"), ..) => ReferenceAxis::Camera,
            (Some("ray x up"), ..) | (None, Defaults::Capture, _) => ReferenceAxis::RayCrossUp,
            (Some("sheet"), ..) | (None, Defaults::List, ViewData::Frames(_)) => ReferenceAxis::Sheet,
            (None, Defaults::List, ViewData::Stokes(source)) if source.analyzers().is_empty() => ReferenceAxis::Camera,
            (None, Defaults::List, ViewData::Stokes(_)) => ReferenceAxis::Sheet,
            (Some(other), ..) => {
                return Err(self.unsupported("polarizer.reference_axis", other, "camera, ray x up and sheet are"));
            }
        };
        match data {
            ViewData::Stokes(source) if reference == ReferenceAxis::Sheet && source.analyzers().is_empty() => Err(self
                .missing(
                    "angles in the Stokes image, for the reference axis \"sheet\"",
                    "use the frames, or \"camera\"",
                )),
            _ => Ok(reference),
        }
    }

    /// The longest sequence whose frames are all there.
    fn longest(&self) -> Option<(&String, &Vec<FrameDocument>)> {
        let taken = |list: &[FrameDocument]| !list.is_empty() && list.iter().all(|f| f.file.is_some());
        self.document.sequences.iter().filter(|(_, list)| taken(list)).max_by_key(|(_, list)| list.len())
    }

    fn frames(&self, pictures: &Pictures) -> Result<Frames, SessionError> {
        let sequences = &self.document.sequences;
        let chosen = match pictures {
            Pictures::Sequence(name) => {
                let names: Vec<&str> = sequences.keys().map(String::as_str).collect();
                let known = || self.unsupported("the sequence", name, &format!("this view has {}", names.join(", ")));
                Some(sequences.get_key_value(name).ok_or_else(known)?)
            }
            Pictures::Best | Pictures::Stokes => self.longest(),
        };
        let remedy = "name the files of the frames, or a Stokes image";
        let (sequence, list) = chosen.ok_or_else(|| self.missing("sequences or stokes", remedy))?;
        let exposure_s = self.document.exposure_s.or_else(|| list.first().and_then(|f| f.exposure_s));
        let sensor = self.sensor()?;
        let exposure_s = self.exposure(exposure_s)?;
        let mut pictures: Vec<Picture> = Vec::with_capacity(list.len());
        for frame in list {
            let file = frame.file.as_ref().ok_or_else(|| self.missing("the file of a frame", remedy))?;
            let path = self.folder.join(file);
            let picture = Picture::read(&path)?;
            require_linear(&picture, &path)?;
            if let Some(first) = pictures.first() {
                self.same_shape(first, &picture, &path)?;
            }
            pictures.push(picture);
        }
        let efficiency = self.efficiency()?;
        let analyzer = |frame: &FrameDocument| Analyzer {
            angle: Degrees(frame.nominal_angle_deg).to_radians(),
            throughput: frame.exposure_s.unwrap_or(exposure_s) / exposure_s,
            efficiency,
        };
        let frames = Frames {
            sequence: sequence.clone(),
            analyzers: list.iter().map(analyzer).collect(),
            bayer: self.bayer(pictures.first().map_or(3, |p| p.channels))?,
            pictures,
            black_dn: single(sensor.black_level_dn),
            white_dn: sensor.white_level_dn.map(single),
            noise: noise(sensor),
            radiance_per_dn: [1.0; 3],
        };
        let radiance_per_dn = radiance_per_dn(sensor, exposure_s, frames.channels() == 1 && frames.bayer.is_none());
        let frames = Frames { radiance_per_dn, ..frames };
        let options = crate::EstimatorOptions::default();
        let weights: Vec<crate::Frame> = frames.analyzers.iter().map(|a| crate::Frame::new(*a)).collect();
        match crate::StokesEstimator::new(&weights, options) {
            Ok(_) => Ok(frames),
            Err(source) => Err(SessionError::Frames { place: format!("{}, sequence {sequence}", self.place), source }),
        }
    }

    fn same_shape(&self, first: &Picture, picture: &Picture, path: &Path) -> Result<(), SessionError> {
        let shape = |p: &Picture| (p.width, p.height, p.channels);
        if shape(first) == shape(picture) {
            return Ok(());
        }
        let words = |p: &Picture| format!("{} x {} x {}", p.width, p.height, p.channels);
        Err(SessionError::Disagree {
            place: self.place.clone(),
            what: format!("the shape of {} and of the first frame", path.display()),
            first: words(picture),
            second: words(first),
        })
    }

    fn stokes(&self, document: &StokesDocument) -> Result<StokesSource, SessionError> {
        let (file, relative) = match document {
            StokesDocument::Path(file) => (file, None),
            StokesDocument::Full { file, relative_noise } => (file, *relative_noise),
        };
        let image = StokesImage::load_exr(&self.folder.join(file))?;
        let metadata = &image.metadata;
        let (radiance_per_unit, noise) = match metadata.unit.as_str() {
            "radiance" => ([1.0; 3], StokesNoise::Relative(relative.unwrap_or(RELATIVE_NOISE))),
            "DN" => {
                let (sensor, exposure_s) = (self.sensor()?, self.exposure(self.document.exposure_s)?);
                let grey = image.colors.len() == 1 && metadata.bayer.is_none();
                let per_unit = radiance_per_dn(sensor, exposure_s, grey);
                let analyzer = |d: &f64| Analyzer::ideal(Degrees(*d).to_radians());
                let noise = match relative {
                    None if !metadata.angles_deg.is_empty() => StokesNoise::Frames {
                        analyzers: metadata.angles_deg.iter().map(analyzer).collect(),
                        noise: noise(sensor),
                    },
                    _ => StokesNoise::Relative(relative.unwrap_or(RELATIVE_NOISE)),
                };
                (per_unit, noise)
            }
            other => return Err(self.unsupported("the unit of the Stokes image", other, "radiance and DN are")),
        };
        if let StokesNoise::Relative(found) = noise
            && !(found > 0.0 && found < 1.0)
        {
            return Err(self.malformed("stokes.relative_noise", found, "it is above 0 and below 1"));
        }
        Ok(StokesSource { radiance_per_unit, noise, image })
    }

    fn exposure(&self, stated: Option<f64>) -> Result<f64, SessionError> {
        let exposure_s = stated.ok_or_else(|| self.missing("exposure_s", UNIT))?;
        if exposure_s > 0.0 && exposure_s.is_finite() {
            return Ok(exposure_s);
        }
        Err(self.malformed("exposure_s", exposure_s, "a positive number is needed"))
    }

    /// The sensor, sane.
    fn sensor(&self) -> Result<&SensorDocument, SessionError> {
        let sensor = self.document.sensor.as_ref().ok_or_else(|| self.missing("sensor", UNIT))?;
        let response = sensor.responsivity_dn_per_radiance_s.bands();
        let positive = response.map(|r| ("sensor.responsivity_dn_per_radiance_s", r));
        for (key, value) in positive.into_iter().chain([("sensor.gain_e_per_dn", sensor.gain_e_per_dn)]) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(self.malformed(key, value, "a positive number is needed"));
            }
        }
        if !(sensor.read_noise_e >= 0.0 && sensor.read_noise_e.is_finite()) {
            return Err(self.malformed("sensor.read_noise_e", sensor.read_noise_e, "it is not negative"));
        }
        let white = sensor.white_level_dn.unwrap_or(f64::INFINITY);
        if !(sensor.black_level_dn.is_finite() && white > sensor.black_level_dn) {
            return Err(self.malformed("sensor.white_level_dn", white, "it is above sensor.black_level_dn"));
        }
        Ok(sensor)
    }

    fn efficiency(&self) -> Result<f64, SessionError> {
        match self.document.polarizer.as_ref().and_then(|p: &PolarizerDocument| p.extinction_ratio) {
            None => Ok(1.0),
            Some(ratio) if ratio > 1.0 => Ok(efficiency_from_extinction_ratio(ratio)),
            Some(ratio) => Err(self.malformed("polarizer.extinction_ratio", ratio, "it is above 1")),
        }
    }

    fn bayer(&self, channels: usize) -> Result<Option<BayerPattern>, SessionError> {
        let stated = self.document.image.as_ref().and_then(|i| i.channels.as_deref()).unwrap_or("RGB");
        let pattern = BayerPattern::ALL.into_iter().find(|p| p.name() == stated);
        match (stated, pattern, channels) {
            ("RGB", _, 3) | ("mono" | "Y", _, 1) => Ok(None),
            (_, Some(pattern), 1) => Ok(Some(pattern)),
            _ => {
                let known = "RGB for color pictures, mono, RGGB, BGGR, GRBG and GBRG for those of one channel are";
                Err(self.unsupported("image.channels", &format!("{stated}, of {channels} channels"), known))
            }
        }
    }

    fn missing(&self, what: &str, remedy: &'static str) -> SessionError {
        SessionError::Missing { place: self.place.clone(), what: what.to_owned(), remedy }
    }

    fn malformed(&self, key: &str, found: f64, expected: &str) -> SessionError {
        let (place, key) = (self.place.clone(), key.to_owned());
        SessionError::Malformed { place, key, found: found.to_string(), expected: expected.to_owned() }
    }

    fn unsupported(&self, key: &str, found: &str, known: &str) -> SessionError {
        let (place, key) = (self.place.clone(), key.to_owned());
        SessionError::Unsupported { place, key, found: found.to_owned(), known: known.to_owned() }
    }
}

/// What an answer without a sensor would lack.
const UNIT: &str = "the light's unit cannot be had from DN without it";

/// Radiance per DN of R, G, B; a grey sensor sees the sum of the bands.
fn radiance_per_dn(sensor: &SensorDocument, exposure_s: f64, grey: bool) -> [f64; 3] {
    let response = match sensor.responsivity_dn_per_radiance_s {
        PerBand::Each(bands) if grey => [bands.iter().sum(); 3],
        other => other.bands(),
    };
    response.map(|r| 1.0 / (r * exposure_s))
}

fn noise(sensor: &SensorDocument) -> Noise {
    let gain = sensor.gain_e_per_dn;
    Noise { read_dn: sensor.read_noise_e / gain, electrons_per_dn: gain, misfit_sigma: MISFIT_SIGMA }
}

#[expect(clippy::cast_possible_truncation, reason = "levels of a few thousand DN")]
fn single(value: f64) -> f32 {
    value as f32
}
