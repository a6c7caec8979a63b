//! Maps against a reference: a table, pictures of the errors, JSON.

use std::path::Path;

use host_fit::compare::{
    ClassReport, CompareOptions, Comparison, Differences, ErrorSummary, Quantity, Reference, compare,
};
use host_fit::maps::MaterialMaps;
use host_image::{Colors, ImageError, PlanePreview, plane_preview};
use serde_json::{Value, json};

use super::{Compare, Rect, load, refused};
use crate::failure::Failure;
use crate::output::OutputFolder;
use crate::pictures;
use crate::report::{Figure, Report};
use crate::terminal::{Outcome, Terminal};

/// Columns of a picture of errors.
const WIDTH: usize = 1024;

impl Compare {
    /// The reference is a `truth`, or other maps.
    pub(super) fn maps(&self, truth: bool, terminal: &Terminal) -> Result<Outcome, Failure> {
        let maps = load(&self.file)?;
        let refuse = if self.all { 0 } else { u32::MAX };
        let reference = if truth {
            let nodes = self.truth_plane.map_or(maps.grid.plane, |Rect(plane)| plane);
            Reference::load_truth(&self.reference, nodes).map_err(|e| refused(&e))?
        } else {
            Reference::from_maps(&load(&self.reference)?, refuse)
        };
        let options = CompareOptions { refuse, resample: true };
        let comparison = compare(&maps, &reference, options).map_err(|e| refused(&e))?;
        if comparison.all.samples == 0 {
            terminal.warn("the reference covers no sample of the maps: is --truth-plane right?");
        }
        let folder = OutputFolder::prepare(&self.output, "compare")?;
        let figures = figures(&comparison.differences, folder.path()).map_err(|e| pictures::failed(&folder, &e))?;
        let (file, by) = (self.file.display(), self.reference.display());
        let mut report =
            Report::new("Fitted maps against a reference", format!("{file} minus {by}, sample by sample."));
        terminal.warnings().into_iter().for_each(|text| report.warning(text));
        lines(&comparison.all).into_iter().for_each(|(name, value)| report.fact(name, value));
        figures.into_iter().for_each(|figure| report.figure(figure));
        pictures::write_report(&report, &folder)?;
        let json = json!({
            "command": "compare",
            "version": env!("CARGO_PKG_VERSION"),
            "kind": "maps",
            "file": self.file,
            "reference": self.reference,
            "resampled": comparison.resampled,
            "all": class_json(&comparison.all),
            "classes": comparison.classes.iter().map(class_json).collect::<Vec<_>>(),
            "warnings": terminal.warnings(),
        });
        let json = folder.commit(json)?;
        let output = json.get("output").and_then(Value::as_str).unwrap_or_default().to_owned();
        let mut text = table(&comparison);
        let page = Path::new(&output).join("report.html");
        text.push_str(&format!("\n{output}\n  {:<40} the errors as pictures: open it in a browser\n", page.display()));
        Ok(Outcome { text, brief: format!("{output}\n"), json })
    }
}

/// The comparison of maps in words: counts, and a line for each quantity.
pub(crate) fn table(comparison: &Comparison) -> String {
    let all = &comparison.all;
    let mut text = counts(all).into_iter().map(|(name, value)| format!("{name:<20} {value}\n")).collect::<String>();
    text.push_str(&format!(
        "\n  {:<18} {:>9} {:>9} {:>9} {:>8}  {}\n",
        "|error|", "median", "95 %", "rms", "samples", "within 68.3 % / 95 % limits"
    ));
    text.push_str(&rows(all));
    if comparison.classes.len() > 1 {
        for class in &comparison.classes {
            let number = class.class.map_or_else(String::new, |c| c.to_string());
            let scored = class.quantity(Quantity::Normal).map_or(0, |q| q.count);
            text.push_str(&format!("\n  class {number}: {scored} of {} samples scored\n", class.samples));
            text.push_str(&rows(class));
        }
    }
    text
}

fn rows(class: &ClassReport) -> String {
    let row = |quantity: &Quantity| {
        let name = name(*quantity);
        match class.quantity(*quantity) {
            None => format!("  {name:<18} {:>9}\n", "none"),
            Some(q) => format!(
                "  {name:<18} {:>9.4} {:>9.4} {:>9.4} {:>8}  {}\n",
                q.median,
                q.percentile_95,
                q.rms,
                q.count,
                coverage(q)
            ),
        }
    };
    Quantity::ALL.iter().map(row).collect()
}

fn coverage(summary: &ErrorSummary) -> String {
    let percent = |share: f64| 100.0 * share;
    summary.z.map_or_else(
        || "no uncertainty stated".to_owned(),
        |z| format!("{:.1} % / {:.1} %", percent(z.within_68), percent(z.within_95)),
    )
}

fn counts(all: &ClassReport) -> Vec<(String, String)> {
    let of = |n: usize| format!("{n} of {} samples", all.samples);
    let mut lines = vec![("not fitted".to_owned(), of(all.not_fitted)), ("refused".to_owned(), of(all.refused))];
    lines.extend(all.refused_by.iter().map(|(reason, n)| (format!("  {reason}"), n.to_string())));
    lines
}

/// For the report.
fn lines(all: &ClassReport) -> Vec<(String, String)> {
    let mut lines = counts(all);
    for quantity in Quantity::ALL {
        if let Some(q) = all.quantity(quantity) {
            let value =
                format!("median {:.4}, 95 % {:.4}, rms {:.4}; {}", q.median, q.percentile_95, q.rms, coverage(q));
            lines.push((name(quantity).to_owned(), value));
        }
    }
    lines
}

const fn name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Normal => "normal, degrees",
        Quantity::Eta => "index eta",
        Quantity::Alpha => "roughness alpha",
        Quantity::AlbedoR => "albedo R",
        Quantity::AlbedoG => "albedo G",
        Quantity::AlbedoB => "albedo B",
    }
}

/// For programs.
pub(crate) fn class_json(class: &ClassReport) -> Value {
    let quantities: serde_json::Map<String, Value> = Quantity::ALL
        .iter()
        .filter_map(|quantity| {
            let q = class.quantity(*quantity)?;
            let z = q.z.map(|z| json!({ "rms": z.rms, "within_68": z.within_68, "within_95": z.within_95, "count": z.count }));
            let value = json!({
                "count": q.count, "median": q.median, "percentile_95": q.percentile_95, "rms": q.rms, "error_over_sigma": z,
            });
            Some((quantity.name().to_owned(), value))
        })
        .collect();
    json!({
        "class": class.class,
        "samples": class.samples,
        "not_fitted": class.not_fitted,
        "refused": class.refused,
        "refused_by": class.refused_by.iter().map(|(r, n)| json!({ "reason": r, "count": n })).collect::<Vec<_>>(),
        "quantities": quantities,
    })
}

/// `error-normal.png` and so on: the normal's angle from 0, the others from minus to plus, to the 95th percentile.
pub(crate) fn figures(differences: &Differences, folder: &Path) -> Result<Vec<Figure>, ImageError> {
    let one = |quantity: &Quantity| -> Result<Figure, ImageError> {
        let values = &differences.errors[*quantity as usize];
        let end = end_of_scale(values);
        let colors = match quantity {
            Quantity::Normal => Colors::Scalar { values, min: 0.0, max: end, unit: "degrees" },
            _ => Colors::Signed { values, max: end, unit: "maps - reference" },
        };
        let title = name(*quantity);
        let (width, height) = (differences.grid.columns, differences.grid.rows);
        let preview = PlanePreview { title, width, height, max_width: WIDTH, colors, notes: Vec::new() };
        let path = folder.join(format!("error-{}.png", quantity.name()));
        plane_preview(&preview)?.write_png(&path)?;
        let png = std::fs::read(&path).map_err(|source| ImageError::Io { path, source })?;
        Ok(Figure {
            title: format!("Error of {title}"),
            caption: "Maps minus reference; grey: not scored.".into(),
            png,
        })
    };
    Quantity::ALL.iter().map(one).collect()
}

/// The 95th percentile of |error|; a millionth where there is none.
pub(super) fn end_of_scale(values: &[f32]) -> f64 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    sizes.sort_by(f32::total_cmp);
    let at = sizes.len().saturating_sub(1) * 95 / 100;
    sizes.get(at).map_or(0.0, |v| f64::from(*v)).max(1e-6)
}

/// Maps in memory, samples without any reason against them.
pub(crate) fn against(maps: &MaterialMaps, reference: &Reference) -> Result<Comparison, Failure> {
    compare(maps, reference, CompareOptions { resample: true, ..CompareOptions::default() }).map_err(|e| refused(&e))
}
