//! The output folder: OpenEXR, previews, npy, report.

use std::path::Path;

use host_image::{ImageError, Picture, Samples};
use protocol_polar::Flags;

use super::Stokes;
use super::analyze::Analysis;
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures;
use crate::report::Report;
use crate::terminal::{Outcome, Terminal};

pub(super) fn write(
    command: &Stokes,
    analysis: &Analysis,
    folder: OutputFolder,
    terminal: &Terminal,
) -> Result<Outcome, Failure> {
    warn_of_findings(analysis, terminal);
    let figures = pictures::write(&analysis.image, &folder, command.dolp_max, terminal)?;
    if command.npy {
        let npy = folder.path().join("npy");
        let saved = analysis.image.save_npy(&npy).and_then(|()| save_covariance(analysis, &npy));
        saved.map_err(|e| pictures::failed(&folder, &e))?;
    }

    let mut report = Report::new(
        format!("Stokes image of {}", folder.destination().file_name().unwrap_or_default().display()),
        "Intensity, degree and angle of linear polarization of every pixel, from photographs through a polarizer.",
    );
    let facts = analysis.facts();
    terminal.warnings().into_iter().for_each(|w| report.warning(w));
    facts.iter().for_each(|(name, value)| report.fact(*name, value));
    figures.into_iter().for_each(|f| report.figure(f));
    pictures::write_report(&report, &folder)?;

    let json = folder.commit(analysis.json(command.efficiency(), &terminal.warnings()))?;
    let output = json.get("output").and_then(|o| o.as_str()).unwrap_or_default().to_owned();
    let mut text: String = facts.iter().map(|(name, value)| format!("{name:<20} {value}\n")).collect();
    text.push_str(&pictures::places(&output, analysis.image.colors.iter().any(|c| c.residual.is_some())));
    Ok(Outcome { text, brief: format!("{output}\n"), json })
}

/// What a user should not have to find out alone.
fn warn_of_findings(analysis: &Analysis, terminal: &Terminal) {
    let worst = |f: fn(&host_fit::Statistics) -> usize| {
        analysis.colors.iter().map(|c| c.statistics.percent(f(&c.statistics))).fold(0.0, f64::max)
    };
    let no_light = worst(|s| s.no_light);
    if no_light > 99.9 {
        terminal.warn("there is no light in these frames (s0 <= 0 everywhere): check --black and the exposure");
    }
    let too_few = worst(|s| s.count(Flags::TOO_FEW));
    if too_few > 1.0 {
        terminal.warn(format!(
            "{too_few:.1} % of the pixels are saturated in so many frames that they have no value: expose less"
        ));
    }
    let out_of_range = worst(|s| s.count(Flags::OUT_OF_RANGE));
    if out_of_range > 1.0 {
        terminal.warn(format!(
            "{out_of_range:.1} % of the pixels are beyond what a 32-bit float can hold and were clamped: scale the samples down"
        ));
    }
    let above_one = worst(|s| s.above_one);
    if above_one > 1.0 {
        terminal.warn(format!(
            "{above_one:.1} % of the pixels are lit and have a DoLP above 1, which light cannot have: a wrong black level, \
             samples that are not linear, or much noise"
        ));
    }
}

/// `VARIANCE.c.npy` (variances of s0, s1, s2) and `COVARIANCE.c.npy` (of s0 and s1, s0 and s2, s1 and s2), H × W × 3.
fn save_covariance(analysis: &Analysis, folder: &Path) -> Result<(), ImageError> {
    for color in &analysis.colors {
        let Some(covariance) = &color.covariance else { continue };
        for (name, pick) in [("VARIANCE", [0, 3, 5]), ("COVARIANCE", [1, 2, 4])] {
            let samples = Samples::F32(covariance.iter().flat_map(|c| pick.map(|i: usize| c[i])).collect());
            let (width, height) = (analysis.image.width, analysis.image.height);
            let encoding = host_image::Encoding::Unstated;
            Picture { width, height, channels: 3, samples, encoding }
                .write_npy(&folder.join(format!("{name}.{}.npy", color.color.name())))?;
        }
    }
    Ok(())
}
