//! Polarizer angles from file names.

use crate::exit::Exit;
use crate::failure::Failure;

/// The rules, for `--help`.
pub(crate) const RULES: &str = "\
Angles from file names, in degrees:
  1. A number followed by deg or \u{b0}, or preceded by pol, polarizer or angle, is the angle:
     pol-135.png, a_45deg_2.tif.
  2. Otherwise the numbers of all names are compared from left to right. Those that are the
     same in every name are not the angle, and just one must be left:
     IMG250_000.png, IMG250_045.png, IMG250_090.png.
  3. An angle is 0 to 360 and may have a decimal point (22.5). A minus is a separator, not a
     sign. A counter (1, 2, 3) is no angle unless it says deg.
  What these rules do not decide is an error: give --angles, in the order of the files.";

/// A number in a name.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Number {
    value: f64,
    mark: Mark,
}

/// What says that a number is an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    None,
    /// A word before it: pol, angle.
    Word,
    /// A unit behind it.
    Unit,
}

/// The angle of each file name, in degrees, by [`RULES`].
pub(crate) fn from_names(names: &[String]) -> Result<Vec<f64>, Failure> {
    let numbers: Vec<Vec<Number>> = names.iter().map(|n| split(n).1).collect();
    let undecided = |why: String| {
        let shown: Vec<&str> = names.iter().take(4).map(String::as_str).collect();
        let more = if names.len() > shown.len() { ", ..." } else { "" };
        Failure::new(
            Exit::BadInput,
            format!("cannot tell the polarizer angles from the names {}{more}: {why}", shown.join(", ")),
            "Give them with --angles, in the order of the files: --angles 0,45,90 (the rules are in --help).",
        )
    };
    if let Some(i) = numbers.iter().position(Vec::is_empty) {
        return Err(undecided(format!("there is no number in {}", names[i])));
    }
    let marked: Vec<Vec<Number>> =
        numbers.iter().map(|n| n.iter().filter(|n| n.mark != Mark::None).copied().collect()).collect();
    let chosen: Vec<Number> = if marked.iter().any(|m| !m.is_empty()) {
        if let Some(i) = marked.iter().position(|m| m.len() != 1) {
            let found = marked[i].len();
            return Err(undecided(format!("{} has {found} numbers marked as an angle; one was expected", names[i])));
        }
        marked.concat()
    } else {
        let columns = numbers.first().map_or(0, Vec::len);
        if let Some(i) = numbers.iter().position(|n| n.len() != columns) {
            let found = numbers[i].len();
            return Err(undecided(format!("{} numbers in {}, {columns} in {}", found, names[i], names[0])));
        }
        let varies = |c: &usize| numbers.iter().any(|n| n[*c].value.to_bits() != numbers[0][*c].value.to_bits());
        let varying: Vec<usize> = (0..columns).filter(varies).collect();
        let column = match varying.as_slice() {
            [one] => *one,
            [] if names.len() == 1 && columns == 1 => 0,
            [] => return Err(undecided("no number differs from name to name".into())),
            several => return Err(undecided(format!("{} numbers differ from name to name", several.len()))),
        };
        numbers.iter().map(|n| n[column]).collect()
    };
    if let Some(i) = chosen.iter().position(|n| n.value > 360.0) {
        return Err(undecided(format!("{} in {} is more than 360 degrees", chosen[i].value, names[i])));
    }
    if is_counter(&chosen) {
        let (first, last) = (chosen[0].value, chosen[chosen.len() - 1].value);
        return Err(undecided(format!("{first} to {last} looks like a counter, not like angles")));
    }
    Ok(chosen.iter().map(|n| n.value).collect())
}

/// Whether these are consecutive numbers, and not said to be degrees.
fn is_counter(numbers: &[Number]) -> bool {
    let mut values: Vec<f64> = numbers.iter().map(|n| n.value).collect();
    values.sort_by(f64::total_cmp);
    values.len() > 1
        && numbers.iter().all(|n| n.mark != Mark::Unit)
        && values.windows(2).all(|w| (w[1] - w[0] - 1.0).abs() < 1e-9)
}

/// The name with `*` in the place of each number: what the files of one series have in common.
pub(crate) fn template(name: &str) -> String {
    split(name).0
}

/// The template and the numbers of a file name; the extension has no numbers.
fn split(name: &str) -> (String, Vec<Number>) {
    let (stem, extension) = match name.rsplit_once('.') {
        // `scene.45` has no extension, `.png` no stem.
        Some((stem, extension)) if !stem.is_empty() && !extension.starts_with(|c: char| c.is_ascii_digit()) => {
            (stem, &name[stem.len()..])
        }
        _ => (name, ""),
    };
    let (mut template, mut numbers) = (String::new(), Vec::new());
    let mut rest = stem;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, from) = rest.split_at(start);
        template.push_str(before);
        let (digits, behind) = from.split_at(number_length(from));
        let mark = if is_unit(behind) {
            Mark::Unit
        } else if is_word(before) {
            Mark::Word
        } else {
            Mark::None
        };
        // Digits with at most one point are always a number.
        numbers.push(Number { value: digits.parse().unwrap_or(f64::INFINITY), mark });
        template.push('*');
        rest = behind;
    }
    (template + rest + extension, numbers)
}

/// Bytes of the number at the start: digits, and a fraction if digits follow the point.
fn number_length(text: &str) -> usize {
    let digits = |t: &str| t.bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(text);
    let fraction = text[whole..].strip_prefix('.').map_or(0, digits);
    if fraction > 0 { whole + 1 + fraction } else { whole }
}

fn is_unit(behind: &str) -> bool {
    let unit = behind.trim_start_matches(['_', '-', ' ']);
    unit.starts_with('\u{b0}') || unit.get(..3).is_some_and(|u| u.eq_ignore_ascii_case("deg"))
}

fn is_word(before: &str) -> bool {
    let text = before.trim_end_matches(['_', '-', ' ', '=']);
    let start = text.rfind(|c: char| !c.is_ascii_alphabetic()).map_or(0, |i| i + 1);
    let word = text.get(start..).unwrap_or_default().to_ascii_lowercase();
    matches!(word.as_str(), "pol" | "polarizer" | "polariser" | "angle")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles(names: &[&str]) -> Result<Vec<f64>, String> {
        let names: Vec<String> = names.iter().map(ToString::to_string).collect();
        from_names(&names).map_err(|f| f.text())
    }

    #[test]
    fn names_that_are_clear() {
        for (names, want) in [
            (&["six_000.png", "six_030.png", "six_120.png"][..], [0.0, 30.0, 120.0]),
            (&["x_0deg.tif", "x_45deg.tif", "x_90deg.tif"], [0.0, 45.0, 90.0]),
            (&["pol-0.png", "pol-60.png", "pol-135.png"], [0.0, 60.0, 135.0]),
            (&["0.exr", "60.exr", "120.exr"], [0.0, 60.0, 120.0]),
            (
                &["IMX250_2026-01-05_000.png", "IMX250_2026-01-05_022.5.png", "IMX250_2026-01-05_090.png"],
                [0.0, 22.5, 90.0],
            ),
            (&["IMG_0012_pol0.png", "IMG_0013_pol60.png", "IMG_0014_pol120.png"], [0.0, 60.0, 120.0]),
            (&["a 0\u{b0} 1.png", "a 60\u{b0} 2.png", "a 120\u{b0} 3.png"], [0.0, 60.0, 120.0]),
            (&["Angle=10_v2.npy", "angle=70_v2.npy", "ANGLE=130_v2.npy"], [10.0, 70.0, 130.0]),
            (&["1DEG_7.tif", "2deg_7.tif", "3 deg_7.tif"], [1.0, 2.0, 3.0]),
            (&["a_0.png", "b_45.png", "c_90.png"], [0.0, 45.0, 90.0]),
        ] {
            assert_eq!(angles(names), Ok(want.to_vec()), "{names:?}");
        }
    }

    #[test]
    fn names_that_are_not_clear_are_named_and_angles_asked_for() {
        for (names, why) in [
            (&["DSC_0012.png", "DSC_0013.png", "DSC_0014.png"][..], "counter"),
            (&["DSC_2012_0.png", "DSC_2013_45.png", "DSC_2014_90.png"], "2 numbers differ"),
            (&["left.png", "mid.png", "right.png"], "no number"),
            (&["a_45.png", "b_45.png", "c_45.png"], "no number differs"),
            (&["DSC_4011.png", "DSC_4050.png", "DSC_4100.png"], "360"),
            (&["pol0_deg45.png", "pol45_angle45.png"], "2 numbers marked"),
            (&["a_0deg.png", "a_45.png", "a_90deg.png"], "0 numbers marked"),
            (&["a_0.png", "a_45_1.png"], "2 numbers in a_45_1.png"),
        ] {
            let error = angles(names).unwrap_err();
            assert!(error.contains(why) && error.contains(names[0]) && error.contains("--angles"), "{error}");
        }
    }

    #[test]
    fn series_are_told_apart_by_their_text() {
        assert_eq!(template("six_000.png"), "six_*.png");
        assert_eq!(template("six_22.5.png"), "six_*.png");
        assert_ne!(template("six_000.png"), template("three_000.png"));
        assert_eq!(template("caf\u{e9}7\u{b0}.tif"), "caf\u{e9}*\u{b0}.tif");
    }
}
