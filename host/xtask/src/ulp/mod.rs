//! The worst error, in units in the last place, of every pointwise function that simulator and fit share.
//!
//! Inputs are taken as the f64 or f32 they are, angles of incidence as the pair (cos θ, sin² θ) the functions get; the exact value is
//! the textbook form in 256 bits ([`exact`]). Points fill each domain evenly in the coordinates of [`functions`], dense at its
//! edges, and then close in on the worst one found: a search, not a proof. It has no random numbers: every run looks at the
//! same points.

mod domain;
mod exact;
mod facets;
mod fresnel;
mod functions;

use crate::process;
use anyhow::{Context, Result, bail};
use functions::{FUNCTIONS, Function, Type};
use rayon::prelude::*;

const FILE: &str = "docs/NUMERICS.md";
const BEGIN: &str = "<!-- errors of functions: cargo xtask ulp --write -->";
const END: &str = "<!-- end of errors of functions -->";

/// Points of the first pass, and of each of the rounds that close in.
const POINTS: u32 = 60_000;
const ROUNDS: i32 = 24;

/// A point's error and where it is.
struct Worst {
    ulp: f64,
    point: [f64; 3],
}

/// Searches every function, prints the table, writes it into the document if asked, and fails above the bound.
pub(crate) fn run(write: bool) -> Result<String> {
    let cases: Vec<(Function, Type)> = cases().collect();
    let found: Vec<Worst> = cases.par_iter().map(|(f, t)| search(f, *t, POINTS)).collect();
    let mut table =
        String::from("\n| function | type | domain | unit | worst, ulp | at |\n|---|---|---|---|---|---|\n");
    for ((function, in_type), worst) in cases.iter().zip(&found) {
        let (ulp, at) = (tenths_up(worst.ulp), function.place(*in_type, worst.point));
        let (name, unit, domain) = (function.name, function.unit, function.domain(*in_type));
        table += &format!("| {name} | {} | {domain} | {unit} | {ulp:.1} | {at} |\n", in_type.name());
    }
    table.push('\n');
    print!("{table}");
    if write {
        let path = process::root().join(FILE);
        let text = std::fs::read_to_string(&path).with_context(|| FILE.to_owned())?;
        let no_markers = || format!("{FILE} lacks the lines {BEGIN:?} and {END:?}");
        let (before, rest) = text.split_once(BEGIN).with_context(no_markers)?;
        let (_, after) = rest.split_once(END).with_context(no_markers)?;
        std::fs::write(&path, format!("{before}{BEGIN}\n{table}{END}{after}")).with_context(|| FILE.to_owned())?;
    }
    let beyond: Vec<String> = (cases.iter().zip(&found))
        .filter(|((_, in_type), worst)| worst.ulp > in_type.bound())
        .map(|((function, in_type), worst)| format!("{} ({}): {:.2}", function.name, in_type.name(), worst.ulp))
        .collect();
    if !beyond.is_empty() {
        bail!("more ulp than allowed: {}", beyond.join(", "));
    }
    Ok(format!("{} searches within their bounds{}", found.len(), if write { ", table written" } else { "" }))
}

/// Every function in every type it exists in.
fn cases() -> impl Iterator<Item = (Function, Type)> {
    FUNCTIONS.into_iter().flat_map(|function| function.types().iter().map(move |in_type| (function, *in_type)))
}

/// The worst of `points` points of the whole domain and as many again around the worst.
fn search(function: &Function, in_type: Type, points: u32) -> Worst {
    let error = |point: [f64; 3]| Worst { ulp: function.error(in_type, point).unwrap_or(0.0), point };
    let worse = |a: Worst, b: Worst| if b.ulp > a.ulp { b } else { a };
    let edges = (0..343).map(|k| [k % 7, k / 7 % 7, k / 49].map(|digit| f64::from(digit) / 6.0));
    let first = edges.chain((0..points).map(spread)).map(error).fold(Worst { ulp: 0.0, point: [0.0; 3] }, worse);
    (1..=ROUNDS).fold(first, |best, round| {
        let (center, radius) = (best.point, 0.5_f64.powi(round));
        let near = |k: u32| {
            let offset = spread(k + points);
            [0, 1, 2].map(|i| (center[i] + radius * (offset[i] - 0.5)).clamp(0.0, 1.0))
        };
        (0..points / ROUNDS.unsigned_abs()).map(|k| error(near(k))).fold(best, worse)
    })
}

/// Point `k` of a sequence that fills the unit cube evenly (Roberts 2018: powers of the root of x⁴ = x + 1).
fn spread(k: u32) -> [f64; 3] {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4]
        .map(|step| (0.5 + step * f64::from(k)).fract())
}

/// One decimal, rounded up: what is printed is still a bound on what was found.
fn tenths_up(x: f64) -> f64 {
    (x * 10.0).ceil() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_is_within_its_bound() {
        for (function, in_type) in cases() {
            let worst = search(&function, in_type, 500);
            let place = function.place(in_type, worst.point);
            assert!(
                worst.ulp > 0.3 && worst.ulp <= in_type.bound(),
                "{} ({}): {:.2} ulp at {place}",
                function.name,
                in_type.name(),
                worst.ulp
            );
        }
    }

    #[test]
    fn a_wrong_last_place_is_seen() {
        let third = exact::big(1.0) / exact::big(3.0);
        let nearest = 1.0 / 3.0_f64;
        assert!(exact::ulps(nearest, &third, &third) <= 0.5);
        let off = exact::ulps(nearest.next_up().next_up(), &third, &third);
        assert!((1.5..=2.5).contains(&off), "{off}");
        let nearest = 1.0 / 3.0_f32;
        assert!(exact::ulps(nearest, &third, &third) <= 0.5);
        let off = exact::ulps(nearest.next_down().next_down(), &third, &third);
        assert!((1.5..=2.5).contains(&off), "{off}");
        let of_one = exact::ulps(1e-20, &exact::big(0.0), &exact::big(1.0));
        assert!((of_one - 1e-20 / f64::EPSILON).abs() < 1e-6);
    }
}
