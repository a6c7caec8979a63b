//! Every oracle in a folder against the code: values made without any of it (20-digit tables of each pointwise family,
//! integrals of paper eq. 6 by other methods, Mitsuba's matrices and renders).
//!
//! A file is one JSON object with lists of cases. Its family is its `family`, else the longest family name in its file name;
//! nothing else about a file is taken for granted, so that other cases of a known family need no change here. Each check
//! states its bound; none is tuned to a case.

mod case;
mod integrals;
mod inverse;
mod mitsuba;
mod mueller;
mod pointwise;
mod report;
mod stokes;

use crate::process;
use anyhow::{Context, Result, bail};
use case::Case;
use rayon::prelude::*;
use report::Report;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// How the cases of a family are checked.
struct Family {
    name: &'static str,
    evaluate: fn(&Case, &mut Report) -> Result<()>,
    /// What the check leaves open.
    remark: &'static str,
}

const FAMILIES: [Family; 12] = [
    Family { name: "fresnel", evaluate: pointwise::fresnel, remark: "" },
    Family { name: "ggx", evaluate: pointwise::ggx, remark: "" },
    Family { name: "sky", evaluate: pointwise::sky, remark: "" },
    Family { name: "brdf_mueller", evaluate: mueller::microfacet, remark: "" },
    Family { name: "diffuse_polarized", evaluate: mueller::diffuse, remark: "" },
    Family { name: "stokes_wls", evaluate: stokes::least_squares, remark: "" },
    Family { name: "dolp_bias", evaluate: stokes::dolp_bias, remark: "" },
    Family { name: "eq6_integrals", evaluate: integrals::eq6, remark: integrals::SHADOWED_EDGE },
    Family { name: "inverse", evaluate: inverse::joint, remark: inverse::REMARK },
    Family { name: "smooth_fresnel_mueller", evaluate: mitsuba::smooth, remark: "" },
    Family { name: "bsdf_mueller", evaluate: mitsuba::rough, remark: "" },
    Family { name: "mc_reference", evaluate: mitsuba::renders, remark: "" },
];

/// What became of one file.
enum Outcome {
    Evaluated { family: &'static Family, cases: usize, report: Report },
    Unknown(String),
}

/// Checks every oracle in `folder` (default: `$BREWSTER_SHARED/oracles`, or `../shared/oracles` beside the workspace);
/// `strict` also fails on families this knows nothing of.
pub(crate) fn run(folder: Option<&Path>, strict: bool) -> Result<String> {
    let folder = folder.map_or_else(default_folder, Path::to_path_buf);
    let (mut values, mut evaluated, mut failed, mut unknown) = (0, 0, Vec::new(), 0);
    for (file, outcome) in evaluate(&folder)? {
        match outcome {
            Ok(Outcome::Evaluated { family, cases, report }) => {
                println!("{file}: {}, {cases} cases", family.name);
                print!("{report}");
                if !family.remark.is_empty() {
                    println!("  note: {}", family.remark);
                }
                evaluated += 1;
                values += report.values();
                failed.extend(
                    report.failures().map(|(what, factor)| format!("{file}: {what}: {factor:.2} times the bound")),
                );
            }
            Ok(Outcome::Unknown(family)) => {
                println!("{file}: not evaluated, family {family} is not known");
                unknown += 1;
                if strict {
                    failed.push(format!("{file}: not evaluated"));
                }
            }
            Err(error) => failed.push(format!("{file}: {error:#}")),
        }
    }
    if !failed.is_empty() {
        bail!("{} of the checks fail:\n  {}", failed.len(), failed.join("\n  "));
    }
    Ok(format!("{values} values in {evaluated} files, {unknown} files not evaluated"))
}

/// `$BREWSTER_SHARED/oracles`, or `../shared/oracles` beside the workspace.
fn default_folder() -> PathBuf {
    std::env::var_os("BREWSTER_SHARED").map_or_else(|| process::root().join("../shared"), PathBuf::from).join("oracles")
}

/// Every file in and below `folder`, by name.
fn evaluate(folder: &Path) -> Result<Vec<(String, Result<Outcome>)>> {
    let mut files = Vec::new();
    tables(folder, &mut files)?;
    files.sort();
    if files.is_empty() {
        bail!("no tables in {}", folder.display());
    }
    let name = |file: &Path| file.strip_prefix(folder).unwrap_or(file).display().to_string();
    Ok(files.iter().map(|file| (name(file), evaluate_file(file))).collect())
}

/// Adds the JSON files in and below `folder`.
fn tables(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            tables(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "json") {
            files.push(path);
        }
    }
    Ok(())
}

fn evaluate_file(path: &Path) -> Result<Outcome> {
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let stated = file.get("family").and_then(Value::as_str);
    let Some(family) = family(stated, &stem) else {
        return Ok(Outcome::Unknown(stated.map_or(stem, str::to_owned)));
    };
    let cases = Case::of_file(&file);
    if cases.is_empty() {
        bail!("no cases");
    }
    let check = |case: &Case| {
        let mut report = Report::default();
        (family.evaluate)(case, &mut report).with_context(|| case.name()).map(|()| report)
    };
    // In the file's order, so that a report does not depend on the scheduler.
    let reports: Vec<Report> = cases.par_iter().map(check).collect::<Result<_>>()?;
    let report = reports.into_iter().fold(Report::default(), Report::merge);
    Ok(Outcome::Evaluated { family, cases: cases.len(), report })
}

/// The family as stated, else the one with the longest name that stands in the file's name.
fn family(stated: Option<&str>, stem: &str) -> Option<&'static Family> {
    match stated {
        Some(stated) => FAMILIES.iter().find(|family| family.name == stated),
        None => FAMILIES.iter().filter(|family| stem.contains(family.name)).max_by_key(|family| family.name.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables live beside the checkout; without them this says so and passes.
    #[test]
    fn every_oracle_at_hand_is_met() {
        let folder = default_folder();
        if !folder.is_dir() {
            println!("skipped: no ../shared/oracles");
            return;
        }
        for (file, outcome) in evaluate(&folder).unwrap() {
            if let Outcome::Evaluated { report, .. } = outcome.unwrap() {
                println!("{file}\n{report}");
                let failures: Vec<_> = report.failures().collect();
                assert!(failures.is_empty(), "{file}: {failures:?}");
            }
        }
    }

    #[test]
    fn a_file_is_known_by_what_it_says_or_by_its_name() {
        let found = |stated, stem| family(stated, stem).map(|family| family.name);
        assert_eq!(found(Some("ggx"), "sky"), Some("ggx"));
        assert_eq!(found(Some("gadgets"), "sky"), None);
        assert_eq!(found(None, "smooth_fresnel_mueller_2"), Some("smooth_fresnel_mueller"));
        assert_eq!(found(None, "fresnel"), Some("fresnel"));
        assert_eq!(found(None, "gadgets"), None);
    }

    #[test]
    fn a_wrong_value_a_missing_field_and_no_number_are_found() {
        let evaluated = |text: &str| {
            let file: Value = serde_json::from_str(text).unwrap();
            let mut report = Report::default();
            let result = Case::of_file(&file).iter().try_for_each(|case| stokes::dolp_bias(case, &mut report));
            (result.is_ok(), report.values(), report.failures().count())
        };
        // p = σ: 1 − (1 − 1/e)/2.
        let right =
            r#"{"cases": [{"kind": "mas", "p_measured": "1", "sigma": 1.0, "p_mas": "0.68393972058572116080"}]}"#;
        assert_eq!(evaluated(right), (true, 1, 0));
        assert_eq!(evaluated(&right.replace("0.6839397205", "0.6839397215")), (true, 1, 1));
        assert_eq!(evaluated(&right.replace("1.0,", "\"nan\",")), (true, 1, 1));
        assert_eq!(evaluated(&right.replace("p_measured", "p")), (false, 0, 0));
    }
}
