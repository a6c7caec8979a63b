//! Stokes from frames: weighted least squares with its covariance, and the bias of the DoLP.

use super::{Case, Report};
use anyhow::{Result, bail};
use host_fit::{EstimatorOptions, FitError, Frame, StokesEstimator, mas, uncertainty};
use protocol_polar::{Analyzer, Degrees};
use std::f64::consts::TAU;

/// Beyond this condition number the right answer is that the frames determine nothing.
const CONDITION_LIMIT: f64 = 1e8;

/// Least squares (paper eq. 5) to 1e-13 times the condition number, or a refusal.
pub(super) fn least_squares(case: &Case, report: &mut Report) -> Result<()> {
    let name = case.name();
    let (angles, throughput) = (case.numbers("angles_deg")?, case.numbers("throughput")?);
    let (efficiency, sigma) = (case.numbers("efficiency")?, case.numbers("sigma")?);
    let frames: Vec<Frame> = angles
        .iter()
        .zip(throughput)
        .zip(efficiency)
        .zip(&sigma)
        .map(|(((angle, throughput), efficiency), sigma)| Frame {
            analyzer: Analyzer { angle: Degrees(*angle).to_radians(), throughput, efficiency },
            sigma: *sigma,
        })
        .collect();
    let options = EstimatorOptions { condition_limit: CONDITION_LIMIT, ..EstimatorOptions::default() };
    let condition = case.number("cond")?;
    let identifiable = case.number("rank")? > 2.5 && condition < CONDITION_LIMIT;
    let estimator = match StokesEstimator::new(&frames, options) {
        Ok(estimator) => Some(estimator),
        Err(FitError::NotIdentifiable { .. }) => None,
        Err(error) => bail!("{name}: {error}"),
    };
    report.holds("refused exactly where not identifiable", estimator.is_some() == identifiable, &name);
    let Some(estimator) = estimator.filter(|_| identifiable) else { return Ok(()) };

    let found_condition = estimator.condition();
    report.see("condition, of its square", 1e-12, [found_condition, condition, condition * condition], &name);
    let variances: Vec<f64> = sigma.iter().map(|s| s * s).collect();
    let found = estimator.estimate(&case.numbers("intensities")?, Some(&variances), 0);
    let expected = case.triple("s")?;
    report.all("s, of s0 and the condition", 1e-13, &found.stokes, &expected, expected[0] * condition, &name);
    let Some(covariance) = found.covariance else { bail!("{name}: no covariance although variances were given") };
    let expected = case.rows("cov")?;
    let scale = expected.iter().enumerate().filter_map(|(k, row)| row.get(k)).fold(0.0, |a: f64, b| a.max(*b));
    let what = "covariance, of its largest and the condition";
    report.all(what, 1e-13, covariance.as_flattened(), &expected.concat(), scale * condition, &name);
    if condition < 100.0 {
        let freedom: f64 = frames.iter().skip(3).map(|_| 1.0).sum();
        let (chi2, expected) = (found.residual.powi(2) * freedom, case.number("chi2")?);
        report.see("chi2, of 1 + chi2", 1e-9, [chi2, expected, 1.0 + expected], &name);
        let Some(found) = uncertainty(found.stokes, covariance) else { bail!("{name}: no light") };
        for (sigma, key) in [(found.dolp, "sigma_dolp_first_order"), (found.aolp.0, "sigma_aolp_rad_first_order")] {
            let expected = case.number(key)?;
            report.see("sigma of DoLP and AoLP, of themselves", 1e-11, [sigma, expected, expected], &name);
        }
    }
    Ok(())
}

/// The modified asymptotic estimator by value, and its mean and the naive one's under noise.
pub(super) fn dolp_bias(case: &Case, report: &mut Report) -> Result<()> {
    let name = case.name();
    if case.text("kind")? == "mas" {
        let expected = case.number("p_mas")?;
        let found = mas(case.number("p_measured")?, case.number("sigma")?);
        report.see("MAS, of itself", 1e-12, [found, expected, expected], &name);
    } else {
        let p = case.number("p_true_over_sigma")?;
        let mean = rician_mean(p, |x| mas(x, 1.0));
        report.see("mean of MAS, in sigma", 1e-9, [mean, case.number("mean_mas_over_sigma")?, 1.0], &name);
    }
    Ok(())
}

/// Mean of f(|z|) for z in the plane, normal about (p, 0) with σ = 1: Simpson in the radius, trapezoids around the circle
/// (which converge exponentially).
fn rician_mean(p: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (steps, around) = (4000, 128);
    let h = (p + 10.0) / f64::from(steps);
    let density = |r: f64| {
        let ring = |k: i32| {
            let angle = TAU * f64::from(k) / f64::from(around);
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
