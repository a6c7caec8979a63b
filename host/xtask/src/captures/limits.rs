//! What must not get worse: loose limits on medians, so that noise does not trip them and a mistake does.

use super::inks::Ink;
use super::score::{Row, Scores, Way};
use host_fit::compare::Quantity;
use host_fit::pipeline::{BodyChoice, Mode};
use host_optics::Masking;

/// Largest medians of the joint fit with the polarized body and the default masking, of any capture: with two views, and with
/// more.
const MEDIANS: [(Quantity, f64, f64); 4] = [
    (Quantity::Normal, 3.0, 2.0),
    (Quantity::Eta, 0.10, 0.08),
    (Quantity::Alpha, 0.06, 0.05),
    (Quantity::AlbedoG, 0.03, 0.02),
];

/// Largest share of refused samples, with more than two views.
const REFUSED: f64 = 0.5;

/// Largest errors of a wheel's angles relative to each other, degrees.
const WHEEL_DEG: f64 = 0.5;

/// Largest errors of a median η and α of a simulated ink.
const INK: [f64; 2] = [0.03, 0.03];

/// What exceeds its limit, in words.
pub(super) fn exceeded(scores: &Scores) -> Vec<String> {
    let mut out = Vec::new();
    for row in scores.rows.iter().filter(|row| is_limited(&row.way)) {
        check(&scores.capture, row, &mut out);
    }
    for wheel in scores.wheels.iter().filter(|wheel| wheel.after_relative > WHEEL_DEG) {
        out.push(format!("{}: a wheel is off by {:.2} degrees", scores.capture, wheel.after_relative));
    }
    out
}

fn is_limited(way: &Way) -> bool {
    way.mode == Mode::Joint && way.body == BodyChoice::Interface && way.masking == Masking::HeightCorrelated
}

fn check(capture: &str, row: &Row, out: &mut Vec<String>) {
    let all = &row.comparison.all;
    let many = row.way.views > 2;
    for (quantity, two, more) in MEDIANS {
        let limit = if many { more } else { two };
        let median = all.quantity(quantity).map_or(f64::INFINITY, |summary| summary.median);
        if median > limit {
            let name = quantity.name();
            out.push(format!("{capture}, {} views: median error of {name} {median:.3} > {limit}", row.way.views));
        }
    }
    let refused = all.refused as f64 / all.samples.max(1) as f64;
    if many && refused > REFUSED {
        out.push(format!("{capture}: {:.0} % refused", 100.0 * refused));
    }
}

/// The same of the inks.
pub(super) fn exceeded_by_inks(inks: &[Ink]) -> Vec<String> {
    let error = |ink: &Ink| [0, 1].map(|k| (ink.found[k] - ink.truth[k]).abs());
    let exceeds = |ink: &&Ink| error(ink).iter().zip(INK).any(|(error, limit)| *error > limit);
    inks.iter().filter(exceeds).map(|ink| format!("{}: eta and alpha off by {:?}", ink.name, error(ink))).collect()
}
