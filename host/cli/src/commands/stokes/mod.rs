//! `brewster stokes`: a Stokes image from photographs taken through a turning polarizer, by any camera.

mod analyze;
mod results;
mod summary;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use host_fit::PolarizerMosaic;
use protocol_polar::efficiency_from_extinction_ratio;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::photographs::{self, RULES, file_name};
use crate::terminal::{Outcome, Terminal};

/// Make a Stokes image from photographs taken through a polarizer at three angles or more
///
/// Any camera will do, on a tripod, with locked exposure and white balance and linear files (16-bit PNG or TIFF, OpenEXR,
/// npy). Turn a linear polarizer in front of the lens from frame to frame; 0, 60 and 120 degrees are the best three
/// angles. Writes stokes.exr, previews, a page to look at (report.html) and the record brewster.json.
#[derive(Args)]
#[command(after_long_help = RULES)]
pub(crate) struct Stokes {
    /// The frames of one scene, or the folder that holds them
    #[arg(required = true, value_name = "FILES|DIR")]
    inputs: Vec<PathBuf>,
    /// Polarizer angles in the order of the files, degrees counter-clockwise from horizontal; default: from the names
    #[arg(long, value_name = "DEG,DEG,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = angle)]
    angles: Option<Vec<f64>>,
    /// One raw frame of a sensor with a polarizer on every photosite, instead of several frames
    #[arg(long, value_name = "SENSOR", conflicts_with = "angles")]
    mosaic: Option<Mosaic>,
    /// Undo the sRGB curve (or the gamma that the file states) before anything else
    #[arg(long)]
    assume_srgb: bool,
    /// Level of a sample without light; auto takes the darkest thousandth of the darkest frame [default: 0]
    #[arg(long, value_name = "DN|auto", value_parser = black, conflicts_with = "dark", allow_hyphen_values = true)]
    black: Option<Black>,
    /// Level from which a sample is saturated and left out [default: the largest integer of the type; none for floats]
    #[arg(long, value_name = "DN", value_parser = positive)]
    white: Option<f64>,
    /// Efficiency of the polarizer, (k1 - k2)/(k1 + k2) of its two transmittances
    #[arg(long, value_name = "0..1", value_parser = efficiency, default_value = "1")]
    efficiency: f64,
    /// The same as extinction ratio k1/k2
    #[arg(long, value_name = "RATIO", value_parser = ratio, conflicts_with = "efficiency")]
    extinction_ratio: Option<f64>,
    /// Picture without light, with the exposure of the frames: subtracted from each
    #[arg(long, value_name = "FILE")]
    dark: Option<PathBuf>,
    /// Picture of an evenly lit, unpolarized white: evens out lens and sensor
    #[arg(long, value_name = "FILE")]
    flat: Option<PathBuf>,
    /// Read noise of a sample; with it, uncertainties are computed and misfits flagged
    #[arg(long, value_name = "DN", value_parser = not_negative)]
    read_noise: Option<f64>,
    /// Electrons per DN, for the shot noise [default: no shot noise]
    #[arg(long, value_name = "E", value_parser = positive, requires = "read_noise")]
    electrons_per_dn: Option<f64>,
    /// Also write the planes (and the covariance, if noise is given) as npy
    #[arg(long, help_heading = "Output")]
    npy: bool,
    /// DoLP at the end of the color scale [default: .05, .1, .2, .5 or 1, what fits]
    #[arg(long, value_name = "0..1", value_parser = efficiency, help_heading = "Output")]
    dolp_max: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Levels and noise beyond this (or its reciprocal) are no sensor's; squares of it would leave the range of f32.
const LEVEL_LIMIT: f64 = 1e30;

/// Sensors whose photosites have polarizers.
#[derive(Clone, Copy, ValueEnum)]
enum Mosaic {
    /// Sony Polarsens, mono: row 0 is 90 45, row 1 is 135 0
    Imx250mzr,
}

/// Where the black level comes from.
#[derive(Clone, Copy)]
enum Black {
    Level(f32),
    Auto,
}

impl Stokes {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let apart: Vec<&Path> = self.dark.iter().chain(&self.flat).map(PathBuf::as_path).collect();
        let files = photographs::find(&self.inputs, &apart)?;
        refuse_doubles(&files)?;
        let angles_deg = self.angles_deg(&files)?;
        // What cannot work is said before gigabytes are read.
        analyze::check_angles(&angles_deg, self.efficiency(), self.extinction_ratio)?;
        let folder = OutputFolder::prepare(&self.output, &self.name(&files))?;
        let analysis = analyze::analyze(self, &files, &angles_deg, terminal)?;
        results::write(self, &analysis, folder, terminal)
    }

    fn efficiency(&self) -> f64 {
        self.extinction_ratio.map_or(self.efficiency, efficiency_from_extinction_ratio)
    }

    fn angles_deg(&self, files: &[PathBuf]) -> Result<Vec<f64>, Failure> {
        if let Some(mosaic) = self.mosaic {
            return match files {
                [_] => Ok(mosaic.pattern().angles().map(|d| d.0).to_vec()),
                _ => Err(Failure::new(
                    Exit::Usage,
                    format!("{} files with --mosaic; one raw frame holds all four angles", files.len()),
                    "Run brewster once for each raw frame.",
                )),
            };
        }
        match &self.angles {
            None => photographs::from_names(&files.iter().map(|f| file_name(f)).collect::<Vec<_>>()),
            Some(angles) if angles.len() == files.len() => Ok(angles.clone()),
            Some(angles) => Err(Failure::new(
                Exit::Usage,
                format!("{} angles for {} files", angles.len(), files.len()),
                "Give one angle for each file, in the same order; files of a folder are in the order of their names.",
            )),
        }
    }

    /// A name for the output folder: the input folder's, the one file's, or what the files' names begin with.
    fn name(&self, files: &[PathBuf]) -> String {
        let name = match (self.inputs.as_slice(), files) {
            ([folder], _) if folder.is_dir() => {
                folder.canonicalize().ok().and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()))
            }
            (_, [file]) => file.file_stem().map(|s| s.to_string_lossy().into_owned()),
            (_, files) => common_start(&files.iter().map(|f| file_name(f)).collect::<Vec<_>>()),
        };
        name.filter(|n| !n.is_empty() && !n.starts_with('.')).unwrap_or_else(|| "stokes".into())
    }
}

impl Mosaic {
    fn pattern(self) -> PolarizerMosaic {
        match self {
            Self::Imx250mzr => PolarizerMosaic::IMX250MZR,
        }
    }
}

/// A frame that is there twice would count twice under two angles.
fn refuse_doubles(files: &[PathBuf]) -> Result<(), Failure> {
    let real: Vec<_> = files.iter().map(|f| f.canonicalize().ok()).collect();
    let double = files.iter().enumerate().find(|(k, _)| real[*k].is_some() && real[..*k].contains(&real[*k]));
    double.map_or(Ok(()), |(_, file)| {
        let what = format!("{} is given twice", file.display());
        Err(Failure::new(Exit::Usage, what, "Each frame is a picture of its own: name every file once."))
    })
}

/// What all names begin with, without digits and separators at its end.
fn common_start(names: &[String]) -> Option<String> {
    let first = names.first()?;
    let same = |i: usize, c: char| names.iter().all(|n| n.get(i..).is_some_and(|rest| rest.starts_with(c)));
    let end = first.char_indices().find(|(i, c)| !same(*i, *c)).map_or(first.len(), |(i, _)| i);
    Some(first.get(..end)?.trim_end_matches(|c: char| c.is_ascii_digit() || "_-. ".contains(c)).to_owned())
}

fn number(text: &str, fits: impl Fn(f64) -> bool, wanted: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v| fits(*v)).ok_or_else(|| format!("expected {wanted}"))
}

fn angle(text: &str) -> Result<f64, String> {
    number(text, |v| v.abs() <= 3600.0, "an angle in degrees, from -3600 to 3600")
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |v| (LEVEL_LIMIT.recip()..=LEVEL_LIMIT).contains(&v), "a number above 0, of at most 1e30")
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |v| (0.0..=LEVEL_LIMIT).contains(&v), "a number from 0 to 1e30")
}

fn efficiency(text: &str) -> Result<f64, String> {
    number(text, |v| v > 0.0 && v <= 1.0, "a number above 0 and at most 1")
}

fn ratio(text: &str) -> Result<f64, String> {
    number(text, |v| v > 1.0, "a ratio above 1")
}

fn black(text: &str) -> Result<Black, String> {
    if text.eq_ignore_ascii_case("auto") {
        return Ok(Black::Auto);
    }
    let level = number(text, |v| v.abs() <= LEVEL_LIMIT, "a level in DN, from -1e30 to 1e30, or auto")?;
    #[expect(clippy::cast_possible_truncation, reason = "a level in DN; rounding to f32 as the samples are")]
    Ok(Black::Level(level as f32))
}
