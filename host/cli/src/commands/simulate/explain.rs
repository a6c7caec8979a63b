//! The plan of a simulation in words, as a table and as JSON.

use std::time::Duration;

use host_sim::Scene;
use host_sim::planner::Why;
use host_sim::simulate::noise_of;
use protocol_polar::Radians;
use serde_json::{Value, json};

use super::{FrameVerification, View};

/// A line of the table, of either half.
struct Line {
    effect: &'static str,
    bound: f64,
    on: bool,
    why: Why,
    reason: String,
    estimated_ns: f64,
    /// Wall time per pixel that the full picture takes longer than the one without, if both were made.
    measured_ns: Option<f64>,
    /// True difference of the full picture without it.
    difference: Option<f64>,
}

/// What holds for all views.
pub(super) fn facts(scene: &Scene, tolerance: f64) -> Vec<(&'static str, String)> {
    vec![
        ("picture", format!("{} x {} pixels", scene.camera.width_px, scene.camera.height_px)),
        ("camera noise", format!("{} of s0 at full wells, all frames together", share(noise_of(scene)))),
        ("tolerance", format!("{} of s0", share(tolerance))),
    ]
}

/// A view in a few lines.
pub(super) fn summary(view: &View) -> String {
    let simulation = &view.simulation;
    let timing = simulation.timing;
    let mut text = format!(
        "view {}: {} of {} effects, at most {} of s0 is lost; {} (bounds {}, picture {})\n",
        view.index,
        simulation.plan.rows.iter().filter(|r| r.on).count(),
        simulation.plan.rows.len(),
        share(simulation.plan.bound),
        time(timing.truth + timing.planning + timing.rendering),
        time(timing.planning),
        time(timing.rendering),
    );
    if simulation.map_bound > 0.0 {
        let bound = share(simulation.map_bound);
        text.push_str(&format!("  maps of alpha and index: levels between which at most {bound} of s0 is lost\n"));
    }
    if let Some(v) = &simulation.verification {
        text.push_str(&format!(
            "  true difference from the full simulation: {} of s0 at worst, {} rms; the full one took {}\n",
            share(v.planned.worst),
            share(v.planned.rms),
            time(v.full),
        ));
    }
    if let Some(frames) = &view.frames {
        let on = frames.plan.rows.iter().filter(|r| r.on).count();
        let (count, all, bound) = (view.schedule.len(), frames.plan.rows.len(), share(frames.plan.bound));
        text.push_str(&format!("  {count} frames: {on} of {all} effects, at most {bound} of s0 is lost\n"));
        if let Some(FrameVerification { worst, .. }) = &frames.verified {
            text.push_str(&format!(
                "  true difference from frames with all effects: {} of s0 at worst\n",
                share(*worst)
            ));
        }
    }
    text
}

/// The table of `--explain`.
pub(super) fn table(view: &View) -> String {
    let verified = view.simulation.verification.is_some();
    let columns = if verified { format!(" {:>9} {:>10}", "measured", "true") } else { String::new() };
    let mut text = format!("  {:<22} {:>9}  {:<4}{:>8}{columns}  why\n", "effect", "bound", "on", "ns/px");
    let mut kept = false;
    for (title, lines) in halves(view) {
        text.push_str(&format!("  {title}\n"));
        kept |= lines.iter().any(|line| line.difference == Some(0.0));
        for line in lines {
            let number = |v: Option<f64>, exact: fn(f64) -> String| v.map_or_else(|| "-".to_owned(), exact);
            let measured = if verified {
                let ns = number(line.measured_ns, |v| format!("{v:.0}"));
                format!(" {ns:>9} {:>10}", number(line.difference, share))
            } else {
                String::new()
            };
            text.push_str(&format!(
                "  {:<22} {:>9}  {:<4}{:>8.0}{measured}  {}\n",
                line.effect,
                share(line.bound),
                if line.on { "on" } else { "off" },
                line.estimated_ns,
                words(&line),
            ));
        }
    }
    if kept {
        text.push_str("  A true difference of 0: the method keeps the effect, as leaving it out would save nothing.\n");
    }
    text
}

/// The same for a report, without times, which differ from run to run.
pub(super) fn plan_facts(view: &View) -> Vec<(String, String)> {
    let lines = halves(view).into_iter().flat_map(|(_, lines)| lines);
    lines
        .map(|line| {
            let on = if line.on { "on" } else { "off" };
            (line.effect.to_owned(), format!("{on}, bound {}: {}", share(line.bound), words(&line)))
        })
        .collect()
}

/// For programs.
pub(super) fn json(view: &View) -> Value {
    let simulation = &view.simulation;
    let seconds = |d: Duration| d.as_secs_f64();
    let effects = |lines: Vec<Line>| -> Vec<Value> {
        let one = |l: Line| {
            json!({
                "effect": l.effect, "bound": finite(l.bound), "on": l.on, "why": word(l.why), "reason": l.reason,
                "estimated_ns_per_pixel": l.estimated_ns, "measured_ns_per_pixel": l.measured_ns,
                "true_difference": l.difference,
            })
        };
        lines.into_iter().map(one).collect()
    };
    let mut lines = halves(view).into_iter().map(|(_, lines)| lines);
    let optical = effects(lines.next().unwrap_or_default());
    let frames = view.frames.as_ref().map(|frames| {
        json!({
            "count": view.schedule.len(),
            "exposures_us": view.schedule.iter().map(|f| f.exposure_us).collect::<Vec<_>>(),
            "bound": frames.plan.bound,
            "true_difference": frames.verified.as_ref().map(|v| v.worst),
            "effects": effects(lines.next().unwrap_or_default()),
        })
    });
    json!({
        "view": view.index,
        "folder": format!("view-{}", view.index),
        "bound": simulation.plan.bound,
        "map_bound": simulation.map_bound,
        "effects": optical,
        "frames": frames,
        "seconds": {
            "truth": seconds(simulation.timing.truth),
            "planning": seconds(simulation.timing.planning),
            "rendering": seconds(simulation.timing.rendering),
            "full": simulation.verification.as_ref().map(|v| seconds(v.full)),
        },
        "true_difference": simulation.verification.as_ref().map(|v| {
            json!({ "worst": v.planned.worst, "rms": v.planned.rms })
        }),
    })
}

/// Optics, and the camera if there are frames.
fn halves(view: &View) -> Vec<(&'static str, Vec<Line>)> {
    let simulation = &view.simulation;
    let pixels: f64 = simulation.truth.mask.iter().map(|_| 1.0).sum();
    let optical = simulation.plan.rows.iter().map(|row| {
        let verified = simulation.verification.as_ref();
        let alone = verified.and_then(|v| v.alone.iter().find(|(e, _)| *e == row.effect).map(|(_, d)| (d, v.full)));
        Line {
            effect: row.effect.name(),
            bound: row.assessment.bound,
            on: row.on,
            why: row.why,
            reason: row.assessment.reason.clone(),
            estimated_ns: row.assessment.cost_ns_per_pixel,
            measured_ns: alone.map(|(d, full)| 1e9 * (full.as_secs_f64() - d.time.as_secs_f64()) / pixels),
            difference: alone.map(|(d, _)| d.worst),
        }
    });
    let mut halves = vec![("optics", optical.collect())];
    if let Some(frames) = &view.frames {
        let alone = |k: usize| frames.verified.as_ref().and_then(|v| *v.alone.get(k)?);
        let line = |(k, row): (usize, &host_sim::frames::FrameRow)| Line {
            effect: row.effect.name(),
            bound: row.assessment.bound,
            on: row.on,
            why: row.why,
            reason: row.assessment.reason.clone(),
            estimated_ns: row.assessment.cost_ns_per_pixel,
            measured_ns: alone(k).map(|(_, ns)| ns),
            difference: alone(k).map(|(difference, _)| difference),
        };
        halves.push(("camera, per frame", frames.plan.rows.iter().enumerate().map(line).collect()));
    }
    halves
}

fn words(line: &Line) -> String {
    let why = match line.why {
        Why::Absent => "not in this scene",
        Why::Negligible => "within the tolerance",
        Why::Needed => "above the tolerance",
        Why::BudgetSpent => "small, but others use the tolerance up",
        _ => "",
    };
    if line.reason.is_empty() { why.to_owned() } else { format!("{why}: {}", line.reason) }
}

fn word(why: Why) -> &'static str {
    match why {
        Why::Absent => "absent",
        Why::Negligible => "negligible",
        Why::Needed => "needed",
        Why::BudgetSpent => "budget_spent",
        _ => "other",
    }
}

/// JSON has no infinity: `null` is no bound.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A share of s0, two digits.
pub(super) fn share(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        v if !v.is_finite() => "no bound".to_owned(),
        v if v >= 10.0 => format!("{v:.0}"),
        v if v >= 0.01 => format!("{v:.3}"),
        v => format!("{v:.1e}"),
    }
}

fn time(duration: Duration) -> String {
    let ms = 1e3 * duration.as_secs_f64();
    if ms < 1000.0 { format!("{ms:.0} ms") } else { format!("{:.1} s", 1e-3 * ms) }
}

/// Degrees, free of the rounding of the way to radians and back.
pub(super) fn degrees(angle: Radians) -> f64 {
    (angle.to_degrees().0 * 1e9).round() / 1e9
}
