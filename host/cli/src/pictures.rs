//! What every folder with a Stokes image holds: the image itself, its previews and the report.

use std::path::{Path, PathBuf};

use host_image::{ImageError, PreviewKind, PreviewOptions, StokesImage, preview};
use rayon::prelude::*;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputFolder, write_durably};
use crate::report::{Figure, Report};
use crate::terminal::Terminal;

/// Ends of the DoLP scale that previews choose from.
const DOLP_SCALES: [f64; 5] = [0.05, 0.1, 0.2, 0.5, 1.0];

/// This share of the light must lie within the scale.
const WITHIN_SCALE: f64 = 0.99;

/// Writes `stokes.exr` and one PNG for each preview the image has; the figures are those previews for a report. `dolp_max`
/// ends the DoLP scale; `None` takes the smallest round one that fits.
pub(crate) fn write(
    image: &StokesImage,
    folder: &OutputFolder,
    dolp_max: Option<f64>,
    terminal: &Terminal,
) -> Result<Vec<Figure>, Failure> {
    let has_residual = image.colors.iter().all(|c| c.residual.is_some());
    let has_flags = image.colors.iter().all(|c| c.flags.is_some());
    let kinds: Vec<PreviewKind> = PreviewKind::ALL
        .into_iter()
        .filter(|k| has_residual || *k != PreviewKind::Residual)
        .filter(|k| has_flags || *k != PreviewKind::Flags)
        .collect();
    let options =
        PreviewOptions { dolp_max: dolp_max.unwrap_or_else(|| dolp_scale(image)), ..PreviewOptions::default() };
    let progress = terminal.progress(kinds.len() + 1, "writing");
    let exr = || {
        let saved = image.save_exr(&folder.path().join("stokes.exr"));
        progress.inc(1);
        saved
    };
    let previews = || {
        let write = |kind: &PreviewKind| -> Result<(PreviewKind, PathBuf), ImageError> {
            let path = folder.path().join(format!("{}.png", kind.name()));
            preview(image, *kind, options)?.write_png(&path)?;
            progress.inc(1);
            Ok((*kind, path))
        };
        kinds.par_iter().map(write).collect::<Result<Vec<_>, _>>()
    };
    let (exr, previews) = rayon::join(exr, previews);
    progress.finish_and_clear();
    exr.map_err(|e| failed(folder, &e))?;
    let figure = |(kind, path): (PreviewKind, PathBuf)| {
        let png = std::fs::read(path).map_err(|e| unwritable(folder, &e))?;
        let (title, caption) = caption(kind);
        Ok(Figure { title: title.into(), caption: caption.into(), png })
    };
    previews.map_err(|e| failed(folder, &e))?.into_iter().map(figure).collect()
}

/// Writes `report.html`.
pub(crate) fn write_report(report: &Report, folder: &OutputFolder) -> Result<(), Failure> {
    write_durably(&folder.path().join("report.html"), &report.to_html()).map_err(|e| unwritable(folder, &e))
}

/// Where everything is, in words: the last lines of a command's text.
pub(crate) fn places(output: &str, has_residual: bool) -> String {
    let planes = if has_residual { "s0, s1, s2, flags and residual" } else { "s0, s1, s2 and flags" };
    let line = |file: &str, what: &str| format!("  {:<40} {what}\n", Path::new(output).join(file).display());
    let report = line("report.html", "all pictures on one page: open it in a browser");
    format!("\n{output}\n{}{report}", line("stokes.exr", planes))
}

/// A file that the image writers could not write, by its final name.
pub(crate) fn failed(folder: &OutputFolder, error: &ImageError) -> Failure {
    Failure::writing(error).map_text(|text| folder.in_words(text))
}

/// A file of ours that could not be written.
pub(crate) fn unwritable(folder: &OutputFolder, error: &std::io::Error) -> Failure {
    Failure::new(
        Exit::Output,
        format!("cannot write {}: {error}", folder.destination().display()),
        "Check the free space and the permissions, or choose another folder with -o.",
    )
}

/// The smallest scale that holds nearly all light: pixels count by their s0, so that noise in the dark does not stretch it.
fn dolp_scale(image: &StokesImage) -> f64 {
    let mut within = [0.0; DOLP_SCALES.len()];
    let mut light = 0.0;
    for color in &image.colors {
        for ((s0, s1), s2) in color.s0.iter().zip(&color.s1).zip(&color.s2).filter(|((s0, _), _)| **s0 > 0.0) {
            let (power, dolp) = (f64::from(*s0), f64::from(s1.hypot(*s2) / s0));
            light += power;
            within.iter_mut().zip(DOLP_SCALES).filter(|(_, scale)| dolp <= *scale).for_each(|(sum, _)| *sum += power);
        }
    }
    DOLP_SCALES.into_iter().zip(within).find(|(_, sum)| *sum >= WITHIN_SCALE * light).map_or(1.0, |(scale, _)| scale)
}

fn caption(kind: PreviewKind) -> (&'static str, &'static str) {
    match kind {
        PreviewKind::Intensity => ("Intensity", "The picture without a polarizer."),
        PreviewKind::Dolp => ("Degree of linear polarization", "Which share of the light is polarized."),
        PreviewKind::Aolp => ("Angle of linear polarization", "In which direction it swings, as seen in the picture."),
        PreviewKind::AolpDolp => (
            "Angle and degree together",
            "The hue is the angle, the brightness the degree: weakly polarized light is dark.",
        ),
        PreviewKind::Flags => ("Flags", "Which pixels not to trust, and why."),
        PreviewKind::Residual => {
            ("Residual", "What the polarizer model cannot explain: motion, changing light, wrong angles, noise.")
        }
    }
}
