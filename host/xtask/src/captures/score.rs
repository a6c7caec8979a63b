//! One capture through the pipeline in every mode, against its truth. Truth is read to score and for nothing else.

use crate::metadata::Metadata;
use anyhow::{Context, Result};
use host_fit::compare::{CompareOptions, Comparison, ErrorSummary, Quantity, Reference, compare};
use host_fit::joint::Reasons;
use host_fit::maps::{MaterialMaps, PlaneRect};
use host_fit::pipeline::{BodyChoice, FitOptions, Mode, Prepared, calibrate_wheels};
use host_fit::session::{Pictures, Session, ViewData};
use host_fit::tiles::{Share, TileStore, merge};
use host_fit::wheel::WheelEstimate;
use host_optics::Masking;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Where the truth's outer nodes stand.
const NODES: PlaneRect = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };

/// A capture's scores.
pub(super) struct Scores {
    pub(super) capture: String,
    pub(super) rows: Vec<Row>,
    pub(super) wheels: Vec<Wheel>,
}

/// One way to fit.
pub(super) struct Row {
    pub(super) way: Way,
    pub(super) comparison: Comparison,
    /// Tables and fit, s.
    pub(super) seconds: [f64; 2],
}

/// How to fit.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Way {
    pub(super) mode: Mode,
    pub(super) body: BodyChoice,
    pub(super) masking: Masking,
    pub(super) views: usize,
}

/// Errors of a view's wheel, degrees.
pub(super) struct Wheel {
    view: String,
    /// rms of nominal − true and of corrected − true.
    before: f64,
    pub(super) after: f64,
    /// The same without the mean, which no picture tells.
    before_relative: f64,
    pub(super) after_relative: f64,
}

/// Fits a capture in all ways.
pub(super) fn capture(folder: &Path) -> Result<Scores> {
    let name = folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    println!("  {name}");
    let open = || Session::open(folder, &Pictures::Best).with_context(|| folder.display().to_string());
    let reference = Reference::load_truth(&folder.join("truth/sample_plane.exr"), NODES)?;
    let mut session = open()?;
    let nominal = session.views.iter().map(|view| view.data.analyzers()).collect::<Vec<_>>();
    let estimates = calibrate_wheels(&mut session, FitOptions::default().wheel_sigma_deg)?;
    let text = std::fs::read_to_string(folder.join("truth/truth.json"))?;
    let truth: Value = serde_json::from_str(&text)?;
    let degrees = |a: &protocol_polar::Analyzer| a.angle.0.to_degrees();
    let mut wheels = Vec::new();
    for (view, nominal) in session.views.iter().zip(&nominal) {
        let ViewData::Frames(frames) = &view.data else { continue };
        let Some(exact) = true_angles(&truth, &view.name, &frames.sequence) else { continue };
        let nominal: Vec<f64> = nominal.iter().map(degrees).collect();
        let corrected: Vec<f64> = frames.analyzers.iter().map(degrees).collect();
        wheels.push(Wheel::new(view.name.clone(), &nominal, &corrected, &exact));
    }
    let mut rows = Vec::new();
    for views in [2, session.views.len()] {
        for way in ways(views) {
            let mut part = session.clone();
            part.views.truncate(views);
            let row = row(&part, &estimates[..views], &reference, way)?;
            println!("{}", line(&name, &row));
            rows.push(row);
        }
    }
    Ok(Scores { capture: name, rows, wheels })
}

/// Every mode with the body the captures have; the joint one also with the other body and with their masking.
fn ways(views: usize) -> Vec<Way> {
    let (body, masking) = (BodyChoice::Interface, Masking::HeightCorrelated);
    let way = Way { mode: Mode::Joint, body, masking, views };
    vec![
        Way { mode: Mode::Closed, ..way },
        Way { mode: Mode::SkyAware, ..way },
        Way { body: BodyChoice::Lambert, ..way },
        way,
        Way { masking: Masking::Separable, ..way },
        Way { mode: Mode::JointShared, ..way },
    ]
}

fn row(session: &Session, wheels: &[Option<WheelEstimate>], reference: &Reference, way: Way) -> Result<Row> {
    let Way { mode, body, masking, .. } = way;
    let options = FitOptions { mode, body, masking, ..FitOptions::default() };
    let start = Instant::now();
    let prepared = Prepared::new(session, wheels, options)?;
    let ready = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let maps = fitted(&prepared, mode)?;
    let seconds = [ready, start.elapsed().as_secs_f64()];
    // Closed forms never know a roughness; that alone does not refuse their answers.
    let refuse = if mode.is_joint() { u32::MAX } else { !Reasons::ROUGHNESS.0 };
    let comparison = compare(&maps, reference, CompareOptions { refuse, resample: true })?;
    Ok(Row { way, comparison, seconds })
}

/// All tiles, put together, with the second pass where the mode has one.
pub(super) fn fitted(prepared: &Prepared<'_>, mode: Mode) -> Result<MaterialMaps> {
    let folder = tiles_folder()?;
    let cancel = AtomicBool::new(false);
    let store = TileStore::open(&folder, prepared.job()?)?;
    prepared.run(&store, Share::ALL, &cancel, |_| {})?;
    let mut maps = merge(std::slice::from_ref(&folder))?;
    if mode == Mode::JointShared {
        prepared.share(&mut maps, &cancel)?;
    }
    std::fs::remove_dir_all(&folder)?;
    Ok(maps)
}

/// An empty folder below the target directory.
fn tiles_folder() -> Result<PathBuf> {
    let folder = Metadata::load()?.target_directory.join(format!("accuracy/tiles-{}", std::process::id()));
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    Ok(folder)
}

fn true_angles(truth: &Value, view: &str, sequence: &str) -> Option<Vec<f64>> {
    let views = truth["views"].as_array()?;
    let angles = &views.iter().find(|v| v["view"] == view)?["true_angles_deg"][sequence];
    angles.as_array()?.iter().map(Value::as_f64).collect()
}

impl Wheel {
    fn new(view: String, nominal: &[f64], corrected: &[f64], exact: &[f64]) -> Self {
        let errors = |found: &[f64]| found.iter().zip(exact).map(|(f, e)| f - e).collect::<Vec<f64>>();
        let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
        let rms = |e: &[f64], about: f64| mean(&e.iter().map(|x| (x - about).powi(2)).collect::<Vec<f64>>()).sqrt();
        let (before, after) = (errors(nominal), errors(corrected));
        Self {
            view,
            before: rms(&before, 0.0),
            after: rms(&after, 0.0),
            before_relative: rms(&before, mean(&before)),
            after_relative: rms(&after, mean(&after)),
        }
    }
}

impl Way {
    pub(super) fn name(&self) -> String {
        let body = match self.body {
            BodyChoice::Lambert => "Lambert body",
            BodyChoice::Interface => "polarized body",
            BodyChoice::Auto => "body chosen",
        };
        let separable = if self.masking == Masking::Separable { ", separable G" } else { "" };
        match self.mode {
            Mode::Closed => "closed".to_owned(),
            Mode::SkyAware => "sky-aware".to_owned(),
            Mode::Joint => format!("joint, {body}{separable}"),
            Mode::JointShared => format!("shared, {body}{separable}"),
        }
    }
}

/// Of a row of the table.
fn line(capture: &str, row: &Row) -> String {
    let all = &row.comparison.all;
    let error = |quantity: Quantity, digits: usize| match all.quantity(quantity) {
        Some(ErrorSummary { median, percentile_95, .. }) => format!("{median:.digits$} / {percentile_95:.digits$}"),
        None => "–".to_owned(),
    };
    let z = |quantity: Quantity| match all.quantity(quantity).and_then(|s| s.z) {
        Some(z) => format!("{:.2}, {:.0}, {:.0}", z.rms, 100.0 * z.within_68, 100.0 * z.within_95),
        None => "–".to_owned(),
    };
    let [ready, fit] = row.seconds;
    let refused = 100.0 * (all.refused + all.not_fitted) as f64 / all.samples.max(1) as f64;
    format!(
        "| {capture} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {refused:.1} % | {ready:.1} + {fit:.1} |",
        row.way.views,
        row.way.name(),
        error(Quantity::Normal, 2),
        error(Quantity::Eta, 3),
        error(Quantity::Alpha, 3),
        error(Quantity::AlbedoG, 3),
        z(Quantity::Normal),
        z(Quantity::Eta),
        z(Quantity::Alpha),
    )
}

/// The section.
pub(super) fn text(scores: &[Scores]) -> String {
    let mut text = "Captures rendered by Mitsuba 3 with sensor noise of 0.7 to 1.6 % and wheel errors of 1°, fitted from their raw \
                    frames by the whole pipeline: wheel calibration, registration, tables, tiles. Errors are absolute, median / \
                    95th percentile, over all samples with truth that no reason refuses. z is error over σ: rms, and the \
                    percentage within the 68 % and the 95 % limit. The captures have the polarized body and separable masking; \
                    an operator is not told, and the default is height-correlated. Albedo is that of green. Seconds are \
                    preparation + fit.\n\n\
                    | capture | views | way | normal, ° | η | α | ρ_d | z normal | z η | z α | refused | s |\n\
                    |---|---|---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for scores in scores {
        for row in &scores.rows {
            text.push_str(&line(&scores.capture, row));
            text.push('\n');
        }
    }
    text.push_str(
        "\nRefused samples by reason (a sample may have several):\n\n\
                   | capture | views | way | samples | reasons |\n|---|---|---|---|---|\n",
    );
    for (scores, row) in scores.iter().flat_map(|s| s.rows.iter().map(move |row| (s, row))) {
        let all = &row.comparison.all;
        let reasons: Vec<String> = all.refused_by.iter().map(|(name, count)| format!("{name} {count}")).collect();
        let line = (&scores.capture, row.way.views, row.way.name(), all.samples, reasons.join("; "));
        let _ = writeln!(text, "| {} | {} | {} | {} | {} |", line.0, line.1, line.2, line.3, line.4);
    }
    text.push_str(
        "\nAngles of the wheel, rms error in degrees; the mean of all angles of a view is what no picture tells:\n\n\
                   | capture | view | nominal | calibrated | nominal, less its mean | calibrated, less its mean |\n\
                   |---|---|---|---|---|---|\n",
    );
    for (scores, w) in scores.iter().flat_map(|s| s.wheels.iter().map(move |w| (s, w))) {
        let _ = writeln!(
            text,
            "| {} | {} | {:.2} | {:.2} | {:.2} | {:.3} |",
            scores.capture, w.view, w.before, w.after, w.before_relative, w.after_relative
        );
    }
    text
}
