//! Samples of all frames as linear planes, one per color and frame.

use std::path::{Path, PathBuf};

use host_fit::{PolarizerMosaic, ToneCurve, flat_field_gain};
use host_image::{Encoding, Picture, Samples};
use indicatif::ProgressBar;
use rayon::prelude::*;

use super::file_name;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::terminal::Terminal;

/// `[channel][frame]`, each height × width, row-major.
pub(crate) type Planes = Vec<Vec<Vec<f32>>>;

/// The type of the samples in the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleType {
    U8,
    U16,
    F32,
}

/// Frames of one scene: same size, channels and type.
pub(crate) struct Photographs {
    /// Columns of a plane.
    pub(crate) width: usize,
    /// Rows of a plane.
    pub(crate) height: usize,
    pub(crate) sample_type: SampleType,
    /// Linear, in the DN of the files.
    pub(crate) planes: Planes,
    /// Largest sample of all, as stored.
    pub(crate) largest: f32,
    /// Columns and rows of the files: twice those of the planes for a mosaic.
    file_size: (usize, usize),
    curve: Option<ToneCurve>,
    mosaic: Option<PolarizerMosaic>,
}

/// Dark levels and flat-field gains in the shape of the planes: `[channel][frame]`, or one for all frames of a channel.
pub(crate) struct Calibration {
    dark: Option<Planes>,
    gain: Option<Planes>,
}

impl SampleType {
    fn of(samples: &Samples) -> Self {
        match samples {
            Samples::U8(_) => Self::U8,
            Samples::U16(_) => Self::U16,
            Samples::F32(_) => Self::F32,
        }
    }

    /// The largest sample an integer file can hold.
    pub(crate) fn full_scale(self) -> Option<f32> {
        match self {
            Self::U8 => Some(255.0),
            Self::U16 => Some(65535.0),
            Self::F32 => None,
        }
    }

    /// Bits of an integer sample.
    pub(crate) fn bits(self) -> Option<u8> {
        match self {
            Self::U8 => Some(8),
            Self::U16 => Some(16),
            Self::F32 => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::U8 => "8-bit",
            Self::U16 => "16-bit",
            Self::F32 => "float",
        }
    }
}

impl Photographs {
    /// Reads the files, one frame each; or, with `mosaic`, the one file that holds four.
    pub(crate) fn load(
        files: &[PathBuf],
        mosaic: Option<PolarizerMosaic>,
        assume_srgb: bool,
        terminal: &Terminal,
        progress: &ProgressBar,
    ) -> Result<Self, Failure> {
        let read = |path: &PathBuf| {
            let picture = Picture::read(path).map_err(|e| Failure::reading(&e));
            progress.inc(1);
            picture
        };
        // In parallel, but the error shown is that of the first bad file.
        let pictures: Vec<Result<Picture, Failure>> = files.par_iter().map(read).collect();
        let pictures: Vec<Picture> = pictures.into_iter().collect::<Result<_, _>>()?;
        let (Some(first), Some(first_file)) = (pictures.first(), files.first()) else {
            return Err(Failure::new(Exit::Usage, "no files", "Name the frames of one scene."));
        };
        for (picture, file) in pictures.iter().zip(files) {
            same_shape((picture, file), (first, first_file))?;
            if picture.encoding != first.encoding {
                terminal.warn(format!(
                    "{} is {}, {} is {}: are they from the same camera and converter?",
                    file_name(file),
                    encoding_words(picture.encoding),
                    file_name(first_file),
                    encoding_words(first.encoding)
                ));
            }
        }
        let curve = tone_curve(first.encoding, assume_srgb, mosaic.is_some(), first_file, terminal)?;
        let mut loaded = Self {
            width: first.width,
            height: first.height,
            sample_type: SampleType::of(&first.samples),
            planes: vec![Vec::new(); first.channels],
            largest: f32::NEG_INFINITY,
            file_size: (first.width, first.height),
            curve,
            mosaic,
        };
        if mosaic.is_some() {
            (loaded.width, loaded.height) = (loaded.width / 2, loaded.height / 2);
        }
        for (picture, file) in pictures.into_iter().zip(files) {
            let planes = raw_planes(picture);
            loaded.largest = planes.iter().flatten().copied().fold(loaded.largest, f32::max);
            let shaped = loaded.shaped(planes, file)?;
            loaded.planes.iter_mut().zip(shaped).for_each(|(channel, frames)| channel.extend(frames));
        }
        Ok(loaded)
    }

    /// A level in the DN of the files, made linear as the samples were.
    pub(crate) fn linear_level(&self, level: f32) -> f32 {
        let Some(curve) = self.curve else { return level };
        linearized(level, curve, self.sample_type.full_scale().unwrap_or(1.0))
    }

    /// Whether the samples were made linear here.
    pub(crate) fn was_linearized(&self) -> bool {
        self.curve.is_some()
    }

    /// Reads the dark and the flat picture; `black` is the level where there is no dark picture.
    pub(crate) fn calibration(
        &self,
        dark: Option<&Path>,
        flat: Option<&Path>,
        black: f32,
    ) -> Result<Calibration, Failure> {
        let dark = dark.map(|path| self.companion(path)).transpose()?.map(|(planes, _)| planes);
        let Some(path) = flat else { return Ok(Calibration { dark, gain: None }) };
        let (flat, flat_type) = self.companion(path)?;
        let same_type = flat_type == self.sample_type;
        let gain = flat.iter().enumerate().map(|(c, frames)| {
            let gains = frames.iter().enumerate().map(|(k, plane)| {
                // A float flat for integer frames is a finished one: its black level is 0.
                let level = match &dark {
                    Some(dark) if same_type => dark[c][k].clone(),
                    _ => vec![if same_type { black } else { 0.0 }; plane.len()],
                };
                flat_field_gain(plane, &level).map_err(|e| {
                    Failure::new(
                        Exit::BadInput,
                        format!("{}: {e}", path.display()),
                        "The flat is a picture of an evenly lit, unpolarized white, brighter than black everywhere.",
                    )
                })
            });
            gains.collect()
        });
        Ok(Calibration { gain: Some(gain.collect::<Result<_, _>>()?), dark })
    }

    /// A dark or flat picture of the same shape, and its type.
    fn companion(&self, path: &Path) -> Result<(Planes, SampleType), Failure> {
        let picture = Picture::read(path).map_err(|e| Failure::reading(&e))?;
        let wanted = (self.file_size.0, self.file_size.1, self.planes.len());
        let found = (picture.width, picture.height, picture.channels);
        if wanted != found {
            return Err(unequal(path, found, "the frames are", wanted));
        }
        let sample_type = SampleType::of(&picture.samples);
        if sample_type != self.sample_type && sample_type != SampleType::F32 {
            return Err(Failure::new(
                Exit::BadInput,
                format!("{} is {}, the frames are {}", path.display(), sample_type.name(), self.sample_type.name()),
                "Take dark and flat pictures with the settings of the frames.",
            ));
        }
        Ok((self.shaped(raw_planes(picture), path)?, sample_type))
    }

    /// `[channel][frame]` of one picture's planes: linear, and split if it is a mosaic.
    fn shaped(&self, planes: Vec<Vec<f32>>, file: &Path) -> Result<Planes, Failure> {
        let full = self.sample_type.full_scale().unwrap_or(1.0);
        let linear = planes.into_iter().map(|mut plane| {
            if let Some(curve) = self.curve {
                plane.par_iter_mut().for_each(|v| *v = linearized(*v, curve, full));
            }
            plane
        });
        let Some(mosaic) = self.mosaic else { return Ok(linear.map(|plane| vec![plane]).collect()) };
        let wrong = |what: String| {
            let advice = "Give the raw mosaic as the camera delivers it: not cropped, not demosaiced, grey.";
            Failure::new(Exit::BadInput, format!("{}: {what}", file.display()), advice)
        };
        if self.planes.len() != 1 {
            return Err(wrong("a color picture, not a raw polarizer mosaic".into()));
        }
        let split =
            |plane: Vec<f32>| mosaic.split(&plane, self.file_size.0).map(Vec::from).map_err(|e| wrong(e.to_string()));
        linear.map(split).collect()
    }
}

impl Calibration {
    /// The dark map of a frame.
    pub(crate) fn dark(&self, channel: usize, frame: usize) -> Option<&[f32]> {
        per_frame(self.dark.as_ref()?, channel, frame)
    }

    /// The gain map of a frame.
    pub(crate) fn gain(&self, channel: usize, frame: usize) -> Option<&[f32]> {
        per_frame(self.gain.as_ref()?, channel, frame)
    }
}

fn per_frame(planes: &[Vec<Vec<f32>>], channel: usize, frame: usize) -> Option<&[f32]> {
    let frames = planes.get(channel)?;
    frames.get(frame).or(frames.first()).map(Vec::as_slice)
}

/// The channels of a picture, each row-major, as stored.
fn raw_planes(picture: Picture) -> Vec<Vec<f32>> {
    let channels = picture.channels;
    let deal = |values: Vec<f32>| match channels {
        1 => vec![values],
        _ => (0..channels).map(|c| values.iter().skip(c).step_by(channels).copied().collect()).collect(),
    };
    match picture.samples {
        Samples::U8(v) => deal(v.into_iter().map(f32::from).collect()),
        Samples::U16(v) => deal(v.into_iter().map(f32::from).collect()),
        Samples::F32(v) => deal(v),
    }
}

fn linearized(value: f32, curve: ToneCurve, full: f32) -> f32 {
    let full = f64::from(full);
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32, from a value of its own size")]
    let linear = (curve.to_linear(f64::from(value) / full) * full) as f32;
    linear
}

/// How to make the samples linear; warns where they are likely not, and nothing was asked for.
fn tone_curve(
    encoding: Encoding,
    assume_srgb: bool,
    raw_mosaic: bool,
    file: &Path,
    terminal: &Terminal,
) -> Result<Option<ToneCurve>, Failure> {
    if assume_srgb {
        return match encoding {
            Encoding::Linear => Err(Failure::new(
                Exit::Usage,
                format!("{} is {}, and --assume-srgb contradicts it", file.display(), encoding_words(encoding)),
                "Leave --assume-srgb out.",
            )),
            Encoding::Gamma { exponent } => Ok(Some(ToneCurve::Gamma { exponent: exponent.into() })),
            _ => Ok(Some(ToneCurve::Srgb)),
        };
    }
    // Machine vision cameras deliver their 8-bit mosaics linear.
    let suspect = match encoding {
        Encoding::Srgb | Encoding::Gamma { .. } | Encoding::Profile => true,
        Encoding::ProbablyGamma => !raw_mosaic,
        _ => false,
    };
    if suspect {
        terminal.warn(format!(
            "{} is {}: not linear in light, so DoLP will be wrong. --assume-srgb makes it linear; better are raw frames, \
             developed to linear 16-bit TIFF",
            file_name(file),
            encoding_words(encoding)
        ));
    }
    Ok(None)
}

/// An encoding in words.
pub(crate) fn encoding_words(encoding: Encoding) -> String {
    match encoding {
        Encoding::Linear => "linear".into(),
        Encoding::Srgb => "sRGB coded".into(),
        Encoding::Gamma { exponent } => format!("gamma coded (exponent {exponent})"),
        Encoding::Profile => "coded by a color profile".into(),
        Encoding::ProbablyGamma => "8-bit and does not say its encoding (nearly always gamma coded)".into(),
        _ => "of unstated encoding (taken as linear)".into(),
    }
}

/// Whether a frame can stand beside the first one.
fn same_shape((picture, file): (&Picture, &Path), (first, first_file): (&Picture, &Path)) -> Result<(), Failure> {
    let shape = |p: &Picture| (p.width, p.height, p.channels);
    if shape(picture) != shape(first) {
        return Err(unequal(file, shape(picture), &format!("{} is", file_name(first_file)), shape(first)));
    }
    let (found, wanted) = (SampleType::of(&picture.samples), SampleType::of(&first.samples));
    if found != wanted {
        return Err(Failure::new(
            Exit::BadInput,
            format!("{} is {}, {} is {}", file.display(), found.name(), file_name(first_file), wanted.name()),
            "Export all frames of a scene with the same settings.",
        ));
    }
    Ok(())
}

fn unequal(
    file: &Path,
    (width, height, channels): (usize, usize, usize),
    others: &str,
    (w, h, c): (usize, usize, usize),
) -> Failure {
    let kind = |channels| if channels == 1 { "grey" } else { "RGB" };
    Failure::new(
        Exit::BadInput,
        format!("{} is {width} x {height} {}, {others} {w} x {h} {}", file.display(), kind(channels), kind(c)),
        "All frames of a scene have the same size and channels: do not crop, resize or convert single ones.",
    )
}
