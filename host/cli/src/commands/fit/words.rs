//! What a fit found, in words, in a table and in JSON.

use std::time::Duration;

use host_fit::maps::{MapStatistics, MaterialMaps, Spread};
use host_fit::session::{Session, ViewData};
use host_fit::wheel::{Identifiability, WheelEstimate};
use protocol_polar::Radians;
use serde_json::{Value, json};

use super::work::Done;
use crate::terminal::Terminal;

/// χ² by freedom of a wheel's frames above which something moved.
const WHEEL_MISFIT: f64 = 2.0;

/// What may be wrong with the captures.
pub(super) fn warn(session: &Session, wheels: &[Option<WheelEstimate>], terminal: &Terminal) {
    let quality = session.quality();
    for pair in quality.pairs.iter().filter(|_| session.views.len() == 2).filter(|p| p.too_parallel()) {
        terminal.warn(format!(
            "views {} and {} look from so nearly the same or the opposite side that polarization hardly tells the normal: \
             turn the sample or the camera by 45 to 90 degrees around the normal between views",
            session.views[pair.views[0]].name, session.views[pair.views[1]].name
        ));
    }
    for (view, wheel) in session.views.iter().zip(wheels) {
        if let Some(wheel) = wheel.as_ref().filter(|w| w.chi2_per_freedom > WHEEL_MISFIT) {
            terminal.warn(format!(
                "{}: the frames do not follow the polarizer within their noise (chi-squared {:.1} per degree of freedom): \
                 motion, light that changes, or another noise than stated",
                view.name, wheel.chi2_per_freedom
            ));
        }
    }
}

/// Lines of the report's table, and of the summary.
pub(super) fn facts(maps: &MaterialMaps, statistics: &MapStatistics, done: Option<&Done<'_>>) -> Vec<(String, String)> {
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut say = |name: &str, value: String| facts.push((name.to_owned(), value));
    say("grid", maps.grid.to_string());
    if let Some(done) = done {
        let report = done.prepared.report();
        for (k, (view, [theta, phi])) in done.session.views.iter().zip(&report.quality.directions).enumerate() {
            let frames = match &view.data {
                ViewData::Frames(frames) => format!("{} frames", frames.analyzers.len()),
                ViewData::Stokes(_) => "Stokes image".to_owned(),
            };
            let seen = 100.0 * report.quality.coverage[k];
            let side = format!("{:.0} degrees from the normal, azimuth {:.0}", theta.to_degrees(), phi.to_degrees());
            let wheel = done.wheels.get(k).and_then(Option::as_ref).map(wheel).unwrap_or_default();
            say(&format!("view {}", view.name), format!("{side}, sees {seen:.0} %, {frames}{wheel}"));
        }
        for (view, table) in done.session.views.iter().zip(&report.tables) {
            let [median, most, worst] = table.error.map(|e| 100.0 * e);
            let size = table.bytes as f64 / f64::from(1 << 20);
            let name = format!("table {}", view.name);
            let time = table.time.as_secs_f64();
            say(
                &name,
                format!("{size:.0} MB in {time:.1} s, error {median:.2} % ({most:.2} % at 95 %, {worst:.1} % worst)"),
            );
        }
        if !report.tables.is_empty() {
            let body = format!("{:?}", report.body).to_lowercase();
            let trial = report.body_trial.map(|t| {
                format!(": chi-squared of {} pixels {:.0} Lambert, {:.0} interface", t.pixels, t.lambert, t.interface)
            });
            say("body", body + &trial.unwrap_or_default());
        }
        let moved = report.refinements.iter().filter(|r| r.outcome.is_ok()).count();
        say("poses", if moved > 0 { format!("{moved} repaired from the pictures") } else { "as stated".to_owned() });
        for region in done.shared.iter().flat_map(|s| &s.regions) {
            let ([eta, eta_sigma], [alpha, alpha_sigma]) = (region.eta, region.alpha);
            let trust = if region.reasons.is_empty() { String::new() } else { format!("; {}", region.reasons) };
            let text = format!(
                "{} samples: eta {eta:.4} +- {eta_sigma:.4}, alpha {alpha:.4} +- {alpha_sigma:.4}, chi-squared {:.2}{trust}",
                region.pixels, region.chi2_per_freedom
            );
            say(&format!("region {}", region.label), text);
        }
    }
    for (plane, spread) in statistics.planes.iter().filter(|(plane, _)| !plane.name().starts_with("second")) {
        say(plane.name(), spread_text(*spread));
    }
    if let Some(spread) = statistics.chi2_per_freedom {
        say("chi-squared per freedom", spread_text(spread));
    }
    let share = |count: usize| format!("{count} ({:.1} %)", 100.0 * count as f64 / statistics.samples.max(1) as f64);
    say("samples", statistics.samples.to_string());
    say("fitted", share(statistics.fitted));
    say("without any reason against", share(statistics.sound));
    statistics.reasons.iter().filter(|(_, n)| *n > 0).for_each(|(name, count)| say(name, share(*count)));
    if let Some(done) = done {
        let seconds = |time: Duration| format!("{:.2} s", time.as_secs_f64());
        let [read, wheels, preparing, tiling, regions] = done.times;
        let [registered, lit, choice, tables] = done.prepared.report().times.map(seconds);
        say("time, reading", seconds(read));
        say("time, wheels", seconds(wheels));
        let parts = format!("registration {registered}, light {lit}, choice of body {choice}, tables {tables}");
        say("time, preparation", format!("{} ({parts})", seconds(preparing)));
        let rate = rate(done).map(|r| format!(" ({r:.4} MP/s)")).unwrap_or_default();
        say("time, tiles", seconds(tiling) + &rate);
        if done.shared.is_some() {
            say("time, regions", seconds(regions));
        }
    }
    facts
}

fn wheel(estimate: &WheelEstimate) -> String {
    let largest = estimate.corrections.iter().map(|Radians(c)| c.abs()).fold(0.0, f64::max).to_degrees();
    match estimate.identifiability {
        Identifiability::Complete => format!(", wheel corrected by up to {largest:.2} degrees"),
        Identifiability::Partial { free } => {
            format!(
                ", wheel corrected by up to {largest:.2} degrees ({free} of {} directions not seen)",
                estimate.corrections.len()
            )
        }
        Identifiability::Nothing => ", wheel taken as stated".to_owned(),
    }
}

fn spread_text(spread: Spread) -> String {
    format!("{:.4} ({:.4} to {:.4})", spread.median, spread.low, spread.high)
}

/// MP/s of the tiles of this run.
fn rate(done: &Done<'_>) -> Option<f64> {
    let seconds = done.times[3].as_secs_f64();
    (done.computed > 0 && seconds > 0.0).then(|| 1e-6 * done.computed as f64 / seconds)
}

pub(super) fn summary(maps: &MaterialMaps, statistics: &MapStatistics, done: Option<&Done<'_>>) -> String {
    let facts = facts(maps, statistics, done);
    let width = facts.iter().map(|(name, _)| name.len()).max().unwrap_or(0) + 2;
    let lines = facts.iter().map(|(name, value)| format!("{name:<width$}{value}\n"));
    lines.collect::<String>() + "numbers of maps: median (5 % to 95 %)\n"
}

pub(super) fn json(maps: &MaterialMaps, statistics: &MapStatistics, done: Option<&Done<'_>>) -> Value {
    let spread = |s: &Spread| json!({ "count": s.count, "low": s.low, "median": s.median, "high": s.high });
    let planes: serde_json::Map<String, Value> =
        statistics.planes.iter().map(|(plane, s)| (plane.name().to_owned(), spread(s))).collect();
    let reasons: serde_json::Map<String, Value> =
        statistics.reasons.iter().filter(|(_, n)| *n > 0).map(|(name, n)| (name.clone(), json!(n))).collect();
    let grid = maps.grid;
    let mut out = json!({
        "command": "fit",
        "grid": { "columns": grid.columns, "rows": grid.rows, "left": grid.plane.left, "right": grid.plane.right,
            "bottom": grid.plane.bottom, "top": grid.plane.top },
        "samples": statistics.samples, "fitted": statistics.fitted, "sound": statistics.sound,
        "planes": planes, "reasons": reasons,
        "chi2_per_freedom": statistics.chi2_per_freedom.as_ref().map(spread),
    });
    let Some(done) = done else { return out };
    let report = done.prepared.report();
    let angles = |wheel: &WheelEstimate| wheel.corrections.iter().map(|c| c.0.to_degrees()).collect::<Vec<_>>();
    let views = done.session.views.iter().enumerate().map(|(k, view)| {
        let wheel = done.wheels.get(k).and_then(Option::as_ref);
        json!({ "name": view.name, "theta_phi_deg": report.quality.directions[k].map(f64::to_degrees),
            "coverage": report.quality.coverage[k], "wheel_correction_deg": wheel.map(angles),
            "wheel_chi2_per_freedom": wheel.map(|w| w.chi2_per_freedom),
            "model_sigma": report.model_sigma.get(k),
            "table": report.tables.get(k).map(|t| json!({ "bytes": t.bytes, "seconds": t.time.as_secs_f64(), "error": t.error })) })
    });
    out["views"] = views.collect();
    out["body"] = json!(format!("{:?}", report.body).to_lowercase());
    out["body_trial"] =
        json!(report.body_trial.map(|t| json!({ "pixels": t.pixels, "lambert": t.lambert, "interface": t.interface })));
    out["light_sigma"] = json!(report.nuisances[0]);
    out["rotation_sigma_deg"] = json!(report.nuisances[1]);
    out["metals"] = json!(done.metals);
    let regions = done.shared.iter().flat_map(|s| &s.regions).map(|r| {
        json!({ "label": r.label, "samples": r.pixels, "eta": r.eta[0], "sigma_eta": r.eta[1], "alpha": r.alpha[0],
            "sigma_alpha": r.alpha[1], "chi2_per_freedom": r.chi2_per_freedom, "reasons": r.reasons.to_string() })
    });
    out["regions"] = regions.collect();
    let [read, wheels, preparing, tiling, shared] = done.times.map(|t| t.as_secs_f64());
    out["seconds"] =
        json!({ "reading": read, "wheels": wheels, "preparation": preparing, "tiles": tiling, "regions": shared });
    out["megapixels_per_second"] = json!(rate(done));
    out
}
