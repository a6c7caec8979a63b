//! From files to a Stokes image: reading, levels, fit.

use std::path::PathBuf;

use host_fit::{
    Dark, EstimatorOptions, Frame, FrameSamples, Noise, NoiseStatistics, Statistics, StokesEstimator, StokesPlanes,
    UpperTriangle, low_percentile,
};
use host_image::{Color, ColorPlanes, StokesImage, StokesMetadata};
use protocol_polar::{Analyzer, Degrees};

use super::{Black, Stokes};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::photographs::{Calibration, Photographs, SampleType, file_name};
use crate::terminal::Terminal;

/// `--black auto`: this share of the samples of the darkest frame lies below the level taken.
const DARKEST_SHARE: f64 = 0.001;

/// False alarms of the misfit flag are at most exp(−n²/2) per pixel: 4e-6.
const MISFIT_SIGMA: f64 = 5.0;

/// The image, and what else there is to say about it.
pub(super) struct Analysis {
    pub(super) image: StokesImage,
    pub(super) colors: Vec<ColorAnalysis>,
    pub(super) files: Vec<String>,
    pub(super) angles_deg: Vec<f64>,
    pub(super) condition: f64,
    /// `None` with a dark picture.
    pub(super) black_dn: Option<f32>,
    /// `None` where nothing saturates.
    pub(super) white_dn: Option<f32>,
    pub(super) linearized: bool,
}

/// One color's figures.
pub(super) struct ColorAnalysis {
    pub(super) color: Color,
    pub(super) statistics: Statistics,
    pub(super) noise: Option<NoiseStatistics>,
    pub(super) covariance: Option<Vec<UpperTriangle>>,
}

fn frames(angles_deg: &[f64], efficiency: f64) -> Vec<Frame> {
    let frame = |d: &f64| Frame::new(Analyzer { efficiency, ..Analyzer::ideal(Degrees(*d).to_radians()) });
    angles_deg.iter().map(frame).collect()
}

/// Whether these angles determine a Stokes vector at all, and whether this polarizer does.
pub(super) fn check_angles(angles_deg: &[f64], efficiency: f64, extinction_ratio: Option<f64>) -> Result<(), Failure> {
    let check = |efficiency| StokesEstimator::new(&frames(angles_deg, efficiency), EstimatorOptions::default());
    check(1.0).map_err(|e| Failure::fitting(&e))?;
    // The angles are good: what fails now is the polarizer's fault.
    check(efficiency).map(|_| ()).map_err(|_| {
        let given = extinction_ratio.map_or_else(
            || format!("an efficiency of {efficiency}"),
            |ratio| format!("an extinction ratio of {ratio} (an efficiency of {efficiency:.3e})"),
        );
        Failure::new(
            Exit::Usage,
            format!("{given} is next to no polarizer: noise would be multiplied by more than a usable answer allows"),
            "Check the number; sheet polarizers have an efficiency above 0.9.",
        )
    })
}

pub(super) fn analyze(
    command: &Stokes,
    files: &[PathBuf],
    angles_deg: &[f64],
    terminal: &Terminal,
) -> Result<Analysis, Failure> {
    let mosaic = command.mosaic.map(super::Mosaic::pattern);
    let progress = terminal.progress(files.len(), "reading");
    let photographs = Photographs::load(files, mosaic, command.assume_srgb, terminal, &progress)?;
    progress.finish_and_clear();

    check_levels(command, photographs.sample_type)?;
    let (black, white) = levels(command, &photographs, terminal)?;
    let calibration = photographs.calibration(command.dark.as_deref(), command.flat.as_deref(), black)?;
    let noise = command.read_noise.map(|read_dn| Noise {
        read_dn,
        electrons_per_dn: command.electrons_per_dn.unwrap_or(0.0),
        misfit_sigma: MISFIT_SIGMA,
    });
    let options = EstimatorOptions { white_dn: white, noise, ..EstimatorOptions::default() };
    let estimator =
        StokesEstimator::new(&frames(angles_deg, command.efficiency()), options).map_err(|e| Failure::fitting(&e))?;

    let names: &[Color] = if photographs.planes.len() == 1 { &[Color::Y] } else { &[Color::R, Color::G, Color::B] };
    let (width, height) = (photographs.width, photographs.height);
    let (sample_type, linearized) = (photographs.sample_type, photographs.was_linearized());
    let (mut planes, mut colors) = (Vec::new(), Vec::new());
    let progress = terminal.progress(names.len(), "fitting");
    // By value: the frames of a color are let go as soon as it is fitted.
    for (channel, (frames, color)) in photographs.planes.into_iter().zip(names).enumerate() {
        let fitted = fit(&estimator, &frames, (channel, width), black, &calibration)?;
        let stokes = [&fitted.s0, &fitted.s1, &fitted.s2].map(Vec::as_slice);
        let statistics = Statistics::gather(stokes, Some(&fitted.flags), fitted.residual.as_deref());
        let noise = NoiseStatistics::gather(&fitted);
        let StokesPlanes { s0, s1, s2, flags, residual, covariance } = fitted;
        planes.push(ColorPlanes { color: *color, s0, s1, s2, flags: Some(flags), residual });
        colors.push(ColorAnalysis { color: *color, statistics, noise, covariance });
        progress.inc(1);
    }
    progress.finish_and_clear();

    let files: Vec<String> = files.iter().map(|f| file_name(f)).collect();
    let black_dn = command.dark.is_none().then_some(black);
    let metadata = StokesMetadata {
        unit: "DN".into(),
        angles_deg: angles_deg.to_vec(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: black_dn.map(f64::from),
        white_level_dn: white.map(f64::from),
        bit_depth: sample_type.bits(),
        fixed_point: None,
        bayer: None,
        source: files.join(", "),
        camera_serial: None,
        capture_id: None,
        software_version: concat!("brewster ", env!("CARGO_PKG_VERSION")).into(),
    };
    let image = StokesImage { width, height, colors: planes, metadata };
    let (angles_deg, condition) = (angles_deg.to_vec(), estimator.condition());
    Ok(Analysis { image, colors, files, angles_deg, condition, black_dn, white_dn: white, linearized })
}

/// One color.
fn fit(
    estimator: &StokesEstimator,
    frames: &[Vec<f32>],
    (channel, width): (usize, usize),
    black: f32,
    calibration: &Calibration,
) -> Result<StokesPlanes, Failure> {
    let samples: Vec<FrameSamples<'_>> = frames
        .iter()
        .enumerate()
        .map(|(k, samples)| FrameSamples {
            samples,
            dark: calibration.dark(channel, k).map_or(Dark::Level(black), Dark::Map),
            gain: calibration.gain(channel, k),
        })
        .collect();
    estimator.image(&samples, width).map_err(|e| Failure::fitting(&e))
}

/// Levels and noise beyond what an integer sample can hold are for other files than these.
fn check_levels(command: &Stokes, sample_type: SampleType) -> Result<(), Failure> {
    let Some(full) = sample_type.full_scale().map(f64::from) else { return Ok(()) };
    let black = match command.black {
        Some(Black::Level(level)) => Some(f64::from(level)),
        _ => None,
    };
    let given = [("--black", black), ("--white", command.white), ("--read-noise", command.read_noise)];
    match given.into_iter().find_map(|(name, value)| Some((name, value.filter(|v| !(0.0..=full).contains(v))?))) {
        None => Ok(()),
        Some((name, value)) => Err(Failure::new(
            Exit::Usage,
            format!("{name} {value} is outside the range of these samples, 0 to {full}"),
            "Give it in the DN of the files.",
        )),
    }
}

/// Black and white level, linear, in DN.
fn levels(command: &Stokes, photographs: &Photographs, terminal: &Terminal) -> Result<(f32, Option<f32>), Failure> {
    let sample_type = photographs.sample_type;
    let black = match command.black {
        None => photographs.linear_level(0.0),
        Some(Black::Level(level)) => photographs.linear_level(level),
        Some(Black::Auto) => {
            let frames = photographs.planes.iter().flatten();
            let lowest = frames.filter_map(|f| low_percentile(f, DARKEST_SHARE)).fold(f32::INFINITY, f32::min);
            terminal.warn(format!(
                "black level {lowest} DN, from the darkest pixels: right only if some part of the scene sent no light; a \
                 picture with the lens cap on (--dark) is better"
            ));
            lowest
        }
    };
    #[expect(clippy::cast_possible_truncation, reason = "a level in DN; rounding to f32 as the samples are")]
    let stated = command.white.map(|w| w as f32);
    let white = stated.or(sample_type.full_scale()).map(|w| photographs.linear_level(w));
    if let Some(white) = white.filter(|w| *w <= black) {
        return Err(Failure::new(
            Exit::Usage,
            format!("white level {white} is not above black level {black}"),
            "Check --black and --white.",
        ));
    }
    let full = [1023.0, 4095.0, 16383.0_f32].into_iter().find(|f| (f - photographs.largest).abs() < 0.5);
    if let (None, SampleType::U16, Some(full)) = (stated, sample_type, full) {
        terminal.warn(format!(
            "the largest sample is {full}: if that is where this camera saturates, say --white {full}, or clipped samples \
             are taken for light"
        ));
    }
    Ok((black, white))
}
