//! The output folder of a fit: material.exr, previews, the page, the record.

use std::path::Path;

use host_fit::maps::{MapPreview, MapStatistics, MaterialMaps, Plane};
use host_image::{Encoding, Picture, Samples};
use serde_json::json;

use super::work::Done;
use super::{Fit, failures, words};
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures::{self, unwritable};
use crate::report::{Figure, Report};
use crate::terminal::{Outcome, Terminal};

/// Columns of a preview, at most.
const PREVIEW_WIDTH: usize = 1200;

pub(super) fn write(
    command: &Fit,
    mut maps: MaterialMaps,
    done: Option<&Done<'_>>,
    folder: OutputFolder,
    terminal: &Terminal,
) -> Result<Outcome, Failure> {
    let statistics = MapStatistics::gather(&maps, 0);
    maps.attributes.insert("program".into(), concat!("brewster ", env!("CARGO_PKG_VERSION")).into());
    let mode = format!("{:?}", command.mode).to_lowercase();
    if let Some(done) = done {
        maps.attributes.insert("mode".into(), mode.clone());
        let report = done.prepared.report();
        if !report.tables.is_empty() {
            maps.attributes.insert("body".into(), format!("{:?}", report.body).to_lowercase());
        }
        if !done.metals.is_empty() {
            maps.attributes.insert("metals".into(), done.metals.join(","));
        }
    }
    let kinds: Vec<MapPreview> = MapPreview::ALL.into_iter().collect();
    let progress = terminal.progress(kinds.len() + 1, "writing");
    let in_words = |failure: Failure| failure.map_text(|text| folder.in_words(text));
    maps.save_exr(&folder.path().join("material.exr")).map_err(|e| in_words(failures::maps(&e)))?;
    progress.inc(1);
    let mut report = Report::new(
        command.name(),
        "Index of refraction, roughness, diffuse albedo and normal of every point of the sample, and how well they are known.",
    );
    terminal.warnings().into_iter().for_each(|w| report.warning(w));
    words::facts(&maps, &statistics, done).into_iter().for_each(|(name, value)| report.fact(name, value));
    for kind in kinds {
        progress.inc(1);
        let picture = maps.preview(kind, PREVIEW_WIDTH).map_err(|e| in_words(failures::maps(&e)))?;
        let (title, caption) = caption(kind);
        figure(&folder, &mut report, &picture, (kind.name(), title, caption))?;
    }
    let (picture, text) = histogram(&maps);
    figure(&folder, &mut report, &picture, ("misfit-histogram", "How well the model explains the pictures", &text))?;
    if let Some(shared) = done.and_then(|d| d.shared.as_ref()) {
        let picture = labels(&shared.labels, maps.grid.columns);
        let text = "Each color is a region with one index and one roughness; black belongs to none.";
        figure(&folder, &mut report, &picture, ("regions", "Regions", text))?;
    }
    pictures::write_report(&report, &folder)?;
    progress.finish_and_clear();
    let mut json = words::json(&maps, &statistics, done);
    json["mode"] = json!(mode);
    json["warnings"] = json!(terminal.warnings());
    let json = folder.commit(json)?;
    let output = json["output"].as_str().unwrap_or_default().to_owned();
    let text = format!("{}\n{}", words::summary(&maps, &statistics, done), places(&output));
    Ok(Outcome { text, brief: format!("{output}\n"), json })
}

fn figure(
    folder: &OutputFolder,
    report: &mut Report,
    picture: &Picture,
    (name, title, caption): (&str, &str, &str),
) -> Result<(), Failure> {
    let path = folder.path().join(format!("{name}.png"));
    picture.write_png(&path).map_err(|e| pictures::failed(folder, &e))?;
    let png = std::fs::read(path).map_err(|e| unwritable(folder, &e))?;
    report.figure(Figure { title: title.into(), caption: caption.into(), png });
    Ok(())
}

fn caption(kind: MapPreview) -> (&'static str, &'static str) {
    match kind {
        MapPreview::Albedo => ("Diffuse albedo", "The color of the body below the surface."),
        MapPreview::Eta => ("Index of refraction", "Of the surface; how strongly it reflects."),
        MapPreview::Alpha => ("Roughness", "GGX alpha: 0 is a mirror."),
        MapPreview::Normal => ("Normal", "x as red, y as green, z as blue; a flat sample is light blue."),
        MapPreview::SigmaAlbedo => ("Uncertainty of the albedo", "One standard deviation, mean of the bands."),
        MapPreview::SigmaEta => ("Uncertainty of the index", "One standard deviation."),
        MapPreview::SigmaAlpha => ("Uncertainty of the roughness", "One standard deviation."),
        MapPreview::SigmaNormal => ("Uncertainty of the normal", "Rms angle, degrees."),
        MapPreview::Misfit => ("Misfit", "Chi-squared by degree of freedom: 1 where noise is all."),
        MapPreview::Reasons => ("Reasons", "Where an answer is not to be trusted, and why."),
    }
}

/// Size of the histogram, bars, and the misfit at its right edge.
const HISTOGRAM: (usize, usize, usize, f32) = (480, 200, 48, 6.0);

/// χ² by freedom of all samples that have any, as bars; what lies beyond is in the last bar.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "bars and pixels; the casts saturate"
)]
fn histogram(maps: &MaterialMaps) -> (Picture, String) {
    let (width, height, bars, end) = HISTOGRAM;
    let mut counts = vec![0_usize; bars];
    for (chi2, freedom) in maps.plane(Plane::Chi2).iter().zip(&maps.freedom) {
        let misfit = chi2 / *freedom as f32;
        if *freedom > 0 && misfit.is_finite() {
            counts[((misfit / end * bars as f32) as usize).min(bars - 1)] += 1;
        }
    }
    let highest = counts.iter().copied().max().unwrap_or(0).max(1);
    let (all, one) = (counts.iter().sum::<usize>().max(1), (bars as f32 / end) as usize * (width / bars));
    let mut samples = vec![255_u8; 3 * width * height];
    for (i, pixel) in samples.chunks_exact_mut(3).enumerate() {
        let (x, y) = (i % width, height - 1 - i / width);
        if y * highest < counts[(x * bars / width).min(bars - 1)] * height {
            pixel.copy_from_slice(&[70, 110, 170]);
        }
        if x == one {
            pixel.copy_from_slice(&[200, 60, 40]);
        }
    }
    let beyond = 100.0 * counts[bars - 1] as f64 / all as f64;
    let text = format!(
        "Number of samples by chi-squared per degree of freedom, from 0 to {end}; the red line is 1, where noise is all. \
         {beyond:.1} % lie at the end or beyond."
    );
    let samples = Samples::U8(samples);
    (Picture { width, height, channels: 3, samples, encoding: Encoding::Srgb }, text)
}

/// Regions in colors that differ.
fn labels(labels: &[u32], columns: usize) -> Picture {
    let color = |label: &u32| match label {
        0 => [0; 3],
        n => [97, 151, 211].map(|step| u8::try_from(64 + (n * step) % 192).unwrap_or(u8::MAX)),
    };
    let samples = Samples::U8(labels.iter().flat_map(color).collect());
    let height = labels.len() / columns.max(1);
    Picture { width: columns, height, channels: 3, samples, encoding: Encoding::Srgb }
}

fn places(output: &str) -> String {
    let line = |file: &str, what: &str| format!("  {:<40} {what}\n", Path::new(output).join(file).display());
    let maps = line("material.exr", "all maps and their uncertainty");
    let page = line("report.html", "all pictures on one page: open it in a browser");
    format!("{output}\n{maps}{page}")
}
