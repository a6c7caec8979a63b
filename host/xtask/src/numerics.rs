//! The tables of docs/NUMERICS.md, computed by the code they describe: no number in them is typed by hand.

use crate::process;
use anyhow::{Context, Result, bail};
use protocol_polar::fixed::{FixedError, Noise, PlaneFormat, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees};
use std::fmt::Write;

const FILE: &str = "docs/NUMERICS.md";
const BEGIN: &str = "<!-- tables: cargo xtask numerics --write -->";
const END: &str = "<!-- end of tables -->";

/// Angle sets of the second table, degrees.
const SETS: [(&str, &[f64]); 4] = [
    ("0/60/120", &[0.0, 60.0, 120.0]),
    ("0/45/90", &[0.0, 45.0, 90.0]),
    ("4 equispaced", &[0.0, 45.0, 90.0, 135.0]),
    ("8 equispaced", &[0.0, 22.5, 45.0, 67.5, 90.0, 112.5, 135.0, 157.5]),
];

/// Checks the tables in the document, or writes them.
pub(crate) fn run(write: bool) -> Result<String> {
    let path = process::root().join(FILE);
    let text = std::fs::read_to_string(&path).with_context(|| FILE.to_owned())?;
    let no_markers = || format!("{FILE} lacks the lines {BEGIN:?} and {END:?}");
    let (before, rest) = text.split_once(BEGIN).with_context(no_markers)?;
    let (tables, after) = rest.split_once(END).with_context(no_markers)?;
    let wanted = format!("\n{}", tables_text()?);
    let rows = wanted.lines().filter(|line| line.starts_with('|')).count();
    if tables == wanted {
        return Ok(format!("{rows} table lines as the code computes them"));
    }
    if !write {
        let differing = wanted.lines().zip(tables.lines().chain(std::iter::repeat(""))).find(|(a, b)| a != b);
        let (want, have) = differing.unwrap_or(("fewer lines", "more lines"));
        bail!(
            "{FILE} is not what the code computes; `cargo xtask numerics --write` mends it\n    computed: {want}\n    written:  {have}"
        );
    }
    std::fs::write(&path, format!("{before}{BEGIN}{wanted}{END}{after}")).with_context(|| FILE.to_owned())?;
    Ok(format!("{rows} table lines written"))
}

fn tables_text() -> Result<String> {
    let mut text =
        String::from("\n| word | sensor bits | format | last place, DN | largest value, DN |\n|---|---|---|---|---|\n");
    let formats: Vec<(Word, u8, PlaneFormat)> = [Word::I16, Word::I32]
        .into_iter()
        .flat_map(|word| (8..=16).map(move |bits| (word, bits)))
        .filter_map(|(word, bits)| PlaneFormat::for_bits(word, bits).map(|format| (word, bits, format)))
        .collect();
    for (word, bits, format) in &formats {
        let integer_bits = 8 * format.bytes() - 1 - usize::from(format.frac_bits);
        let largest = f64::from(format.limits().1) * format.lsb_dn();
        let (name, fraction) = (name(*word), format.frac_bits);
        writeln!(text, "| {name} | {bits} | Q{integer_bits}.{fraction} | 2^−{fraction} | {largest} |")?;
    }
    text.push_str(
        "\n| word | sensor bits | angles | s0, DN | s1, DN | s2, DN | worst, last places | residual, DN |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for (word, bits, format) in formats.iter().filter(|(_, bits, _)| bits % 2 == 0) {
        for (set, angles) in SETS {
            let plan = plan(*word, *bits, angles)?;
            let weights = plan.weights(0).map_err(refused)?;
            let [s0, s1, s2] = weights.bound_dn();
            let worst = s0.max(s1).max(s2) / format.lsb_dn();
            let residual = if angles.len() > 3 { upwards(weights.residual_bound_dn()) } else { "–".into() };
            let (name, [s0, s1, s2, worst]) = (name(*word), [s0, s1, s2, worst].map(upwards));
            writeln!(text, "| {name} | {bits} | {set} | {s0} | {s1} | {s2} | {worst} | {residual} |")?;
        }
    }
    text.push('\n');
    Ok(text)
}

fn plan(word: Word, bits: u8, angles: &[f64]) -> Result<StokesPlan> {
    let frames: Vec<Analyzer> = angles.iter().map(|angle| Analyzer::ideal(Degrees(*angle).to_radians())).collect();
    let range = SensorRange { bit_depth: bits, white_level: u16::MAX >> (16 - bits) };
    let noise = Noise { read_dn: 0.0, electrons_per_dn: 0.0, misfit_sigma: 0.0 };
    StokesPlan::new(&frames, word, range, noise).map_err(refused)
}

fn refused(error: FixedError) -> anyhow::Error {
    anyhow::anyhow!("a set of the table is refused: {error:?}")
}

fn name(word: Word) -> &'static str {
    match word {
        Word::I16 => "i16",
        Word::I32 => "i32",
    }
}

/// Three significant digits, rounded up: what is printed is still a bound.
fn upwards(x: f64) -> String {
    let mut digits = format!("{x:.2e}");
    if digits.parse::<f64>().is_ok_and(|shown| shown < x) {
        let exponent: i32 = digits.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
        digits = format!("{:.2e}", x + 0.5 * 10_f64.powi(exponent - 2));
    }
    match digits.parse::<f64>() {
        Ok(shown) if (1e-3..1e4).contains(&shown) => shown.to_string(),
        _ => digits,
    }
}

#[cfg(test)]
mod tests {
    use super::upwards;

    #[test]
    fn printed_bounds_are_bounds() {
        for x in [0.125, 0.1251, 1.0, 0.999_01, 3.333_333e-7, 9.999_9e-9, 1234.5, 0.001_000_1] {
            let shown: f64 = upwards(x).parse().unwrap();
            assert!(shown >= x && shown <= x * 1.0101, "{x} -> {shown}");
        }
        assert_eq!(upwards(0.125), "0.125");
    }
}
