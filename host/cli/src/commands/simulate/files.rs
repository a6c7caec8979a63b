//! The folder of a view: `view-N` with the Stokes image, its previews and report, `truth/` and `frames/`.

use std::path::Path;

use host_image::{Encoding, ImageError, Picture, Samples};
use host_sim::Scene;
use host_sim::frames::{Exposer, FrameSpec};
use rayon::prelude::*;

use super::{View, explain};
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures;
use crate::report::Report;
use crate::terminal::Terminal;

/// Writes everything of a view.
pub(super) fn write(
    scene: &Scene,
    view: &View,
    exposer: Option<&Exposer<'_>>,
    folder: &OutputFolder,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let figures = pictures::write(&view.simulation.image, folder, None, terminal)?;
    let mut report = Report::new(
        format!("{}, view {}", scene.name, view.index),
        "Intensity, degree and angle of linear polarization of every pixel, simulated without noise.",
    );
    report.fact("tolerance", explain::share(view.simulation.plan.tolerance));
    explain::plan_facts(view).into_iter().for_each(|(name, value)| report.fact(name, value));
    figures.into_iter().for_each(|f| report.figure(f));
    pictures::write_report(&report, folder)?;
    let own = gather(folder, &name(view)).map_err(|e| pictures::unwritable(folder, &e))?;
    maps(view, &own).map_err(|e| pictures::failed(folder, &e))?;
    match exposer {
        Some(exposer) => frames(scene, exposer, &own).map_err(|e| pictures::failed(folder, &e)),
        None => Ok(()),
    }
}

/// What is where in the folder of a view.
pub(super) fn places(view: &View, output: &str, scene: &Scene) -> String {
    let folder = Path::new(output).join(name(view));
    let line = |file: &str, what: &str| format!("  {:<40} {what}\n", folder.join(file).display());
    let mut text = line("stokes.exr", "s0, s1, s2 of R, G, B, without noise");
    text.push_str(&line("report.html", "all pictures on one page: open it in a browser"));
    text.push_str(&line("truth", "what each pixel sees: normals, albedo, alpha, index, ..."));
    if view.frames.is_some() {
        let (black, white) = (scene.camera.black_level_dn, scene.camera.white_level_dn());
        text.push_str(&line("frames", &format!("raw frames: brewster stokes --black {black} --white {white}")));
    }
    text
}

/// Name of the folder of a view.
pub(super) fn name(view: &View) -> String {
    format!("view-{}", view.index)
}

/// Moves the files that were just written at the top of the output folder into a folder of their own.
fn gather(folder: &OutputFolder, name: &str) -> std::io::Result<std::path::PathBuf> {
    let own = folder.path().join(name);
    std::fs::create_dir(&own)?;
    for entry in std::fs::read_dir(folder.path())? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            std::fs::rename(entry.path(), own.join(entry.file_name()))?;
        }
    }
    Ok(own)
}

fn maps(view: &View, own: &Path) -> Result<(), ImageError> {
    let folder = make(own, "truth")?;
    let write = |(name, picture): &(&str, Picture)| picture.write_exr(&folder.join(format!("{name}.exr")));
    view.simulation.truth.pictures().par_iter().try_for_each(write)
}

/// Where each frame of a plan is, below `frames`: `frame_045deg.png`; with several exposures a folder for each, with several
/// frames of an angle `repeat-2_045deg.png`.
pub(super) fn frame_names(scene: &Scene, specs: &[FrameSpec]) -> Vec<String> {
    let same_exposure = |a: &FrameSpec, b: &FrameSpec| a.exposure_us.to_bits() == b.exposure_us.to_bits();
    let several = specs.windows(2).any(|pair| !same_exposure(&pair[0], &pair[1]));
    let name = |(k, spec): (usize, &FrameSpec)| {
        let folder = if several { format!("{}us/", spec.exposure_us) } else { String::new() };
        let repeat = 1 + specs[..k].iter().filter(|s| s.angle == spec.angle && same_exposure(s, spec)).count();
        let prefix = if scene.plan.repeats > 1 { format!("repeat-{repeat}") } else { "frame".to_owned() };
        format!("{folder}{prefix}_{}deg.png", angle(explain::degrees(spec.commanded)))
    };
    specs.iter().enumerate().map(name).collect()
}

/// One 16-bit grey PNG per frame.
fn frames(scene: &Scene, exposer: &Exposer<'_>, own: &Path) -> Result<(), ImageError> {
    let top = make(own, "frames")?;
    let (width, height) = (usize::from(scene.camera.width_px), usize::from(scene.camera.height_px));
    for (k, name) in frame_names(scene, exposer.frames()).iter().enumerate() {
        if let Some((folder, _)) = name.split_once('/') {
            make(&top, folder)?;
        }
        let file = top.join(name);
        let samples = Samples::U16(exposer.raw(k));
        Picture { width, height, channels: 1, samples, encoding: Encoding::Linear }.write_png(&file)?;
    }
    Ok(())
}

/// An angle for a file name, where a minus would be a separator: [0, 360), three digits before the point.
fn angle(degrees: f64) -> String {
    let text = format!("{}", (degrees.rem_euclid(360.0) * 1e6).round() / 1e6);
    let whole = text.split('.').next().map_or(0, str::len);
    format!("{}{text}", "0".repeat(3_usize.saturating_sub(whole)))
}

fn make(parent: &Path, name: &str) -> Result<std::path::PathBuf, ImageError> {
    let path = parent.join(name);
    match std::fs::create_dir_all(&path) {
        Ok(()) => Ok(path),
        Err(source) => Err(ImageError::Io { path, source }),
    }
}
