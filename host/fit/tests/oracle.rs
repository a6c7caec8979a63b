//! Against 80-digit reference data (oracles/analytic), which know nothing of this code.

use std::path::{Path, PathBuf};

use host_fit::{EstimatorOptions, FitError, Frame, StokesEstimator, mas, uncertainty};
use protocol_polar::{Analyzer, Degrees};
use serde_json::Value;

/// The cases of one family; `None` (and a line that says so) on a machine without the data.
fn cases(family: &str) -> Option<Vec<Value>> {
    let shared = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(shared.join(format!("oracles/analytic/{family}.json"))) else {
        println!("skipped: no ../shared");
        return None;
    };
    let file: Value = serde_json::from_str(&text).expect("the oracle is JSON");
    Some(file["cases"].as_array().expect("it has cases").clone())
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| v.as_str().and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("number: {v}")))
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap_or_else(|| panic!("array: {v}")).iter().map(number).collect()
}

#[test]
fn weighted_least_squares() {
    let Some(cases) = cases("stokes_wls") else { return };
    let (mut solved, mut refused) = (0, 0);
    for case in &cases {
        let (angles, t, e) = (numbers(&case["angles_deg"]), numbers(&case["throughput"]), numbers(&case["efficiency"]));
        let (sigma, signals) = (numbers(&case["sigma"]), numbers(&case["intensities"]));
        let frames: Vec<Frame> = (0..angles.len())
            .map(|k| Frame {
                analyzer: Analyzer { angle: Degrees(angles[k]).to_radians(), throughput: t[k], efficiency: e[k] },
                sigma: sigma[k],
            })
            .collect();
        let estimator = StokesEstimator::new(&frames, EstimatorOptions { condition_limit: 1e8, ..Default::default() });
        let condition = number(&case["cond"]);
        let identifiable = number(&case["rank"]) > 2.5 && condition < 1e8;
        let estimator = match estimator {
            Ok(estimator) if identifiable => estimator,
            Err(FitError::NotIdentifiable { .. }) if !identifiable => {
                refused += 1;
                continue;
            }
            other => panic!("{}: {:?}", case["tag"], other.err()),
        };
        solved += 1;
        assert!((estimator.condition() / condition - 1.0).abs() < 1e-12 * condition);
        let variances: Vec<f64> = sigma.iter().map(|s| s * s).collect();
        let found = estimator.estimate(&signals, Some(&variances), 0);
        let (s, covariance) = (numbers(&case["s"]), found.covariance.expect("variances were given"));
        let tolerance = 1e-13 * condition;
        for (a, b) in found.stokes.iter().zip(&s) {
            assert!((a - b).abs() <= tolerance * s[0].abs(), "{}: {:?} against {s:?}", case["index"], found.stokes);
        }
        let reference: Vec<Vec<f64>> = case["cov"].as_array().expect("rows").iter().map(numbers).collect();
        let scale = reference[0][0].max(reference[1][1]).max(reference[2][2]);
        for (a, b) in covariance.iter().flatten().zip(reference.iter().flatten()) {
            assert!((a - b).abs() <= tolerance * scale, "{}: {covariance:?}", case["index"]);
        }
        if condition < 100.0 {
            let freedom = (angles.len() - 3) as f64;
            let chi2 = found.residual.powi(2) * freedom;
            assert!((chi2 - number(&case["chi2"])).abs() < 1e-9 * (1.0 + chi2), "{}", case["index"]);
            let u = uncertainty(found.stokes, covariance).expect("there is light");
            for (a, name) in [(u.dolp, "sigma_dolp_first_order"), (u.aolp.0, "sigma_aolp_rad_first_order")] {
                assert!((a / number(&case[name]) - 1.0).abs() < 1e-11, "{}: {name} {a}", case["index"]);
            }
        }
    }
    assert!(solved > 50 && refused >= 8, "{solved} solved, {refused} refused");
}

#[test]
fn modified_asymptotic_estimator() {
    let Some(cases) = cases("dolp_bias") else { return };
    let (mut worst, mut means) = (0.0_f64, 0);
    for case in &cases {
        if case["kind"] == "mas" {
            let (p, sigma, want) = (number(&case["p_measured"]), number(&case["sigma"]), number(&case["p_mas"]));
            let error = (mas(p, sigma) - want).abs();
            worst = worst.max(if want > 0.0 { error / want } else { error });
        } else {
            let p = number(&case["p_true_over_sigma"]);
            let want = number(&case["mean_mas_over_sigma"]);
            let mean = rician_mean(p, |x| mas(x, 1.0));
            assert!((mean - want).abs() < 1e-9, "true p {p}: {mean} against {want}");
            means += 1;
        }
    }
    println!("largest relative error of mas {worst:e}");
    assert!(worst <= 1e-15, "{worst:e}");
    assert!(means > 0);
}

/// Mean of f(|z|) for z in the plane, normal about (p, 0) with σ = 1: Simpson in the radius, trapezoids around the circle
/// (which converge exponentially).
fn rician_mean(p: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (steps, around) = (4000, 128);
    let h = (p + 10.0) / f64::from(steps);
    let density = |r: f64| {
        let ring = |k: i32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            (-0.5 * (r * r + p * p - 2.0 * r * p * angle.cos())).exp()
        };
        r * (0..around).map(ring).sum::<f64>() / f64::from(around)
    };
    let weight = |k| if k == 0 || k == steps { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
    let term = |k| {
        let r = f64::from(k) * h;
        weight(k) * f(r) * density(r)
    };
    (0..=steps).map(term).sum::<f64>() * h / 3.0
}
