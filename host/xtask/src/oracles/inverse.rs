//! The joint fit on noisy pixels of known truth: two oblique views 90° apart in azimuth, and a third near the normal.
//!
//! The starts are a grid about the mean normal; nothing of the truth goes in. The tables' optimum is the best of five starts on
//! the same data, their σ the Cramér-Rao bound at the truth.

use super::integrals::{noise_free, sky};
use super::{Case, Report};
use anyhow::{Context, Result};
use glam::DVec3;
use host_fit::direct::Direct;
use host_fit::joint::{Fit, PARAMETERS, Reasons, Settings, Starts, fit};
use host_fit::material::{Facets, Forward, Observation};

/// Order of the quadrature: its error is some 1e-7 of s0, the noise 3e-3.
const ORDER: u32 = 32;

/// What the checks on this family mean.
pub(super) const REMARK: &str = "sigma at the truth is the curvature there, without a descent; sigma at the fit is that of another \
     point, which the noise chose, and is held against the bound by its median only";

/// The names of the checks of so many views.
struct Checks {
    views: usize,
    bound: &'static str,
    chi2: &'static str,
    pull: &'static str,
    worst_pull: &'static str,
    at_truth: &'static str,
    at_fit: &'static str,
    normal: &'static str,
    second: &'static str,
    doubt: &'static str,
    converged: &'static str,
}

const CHECKS: [Checks; 2] = [
    Checks {
        views: 2,
        bound: "crlb_2_views",
        chi2: "2 views: chi2 above the tables' optimum, of 1e-4 of it + 1e-3",
        pull: "2 views: rms of (fit - truth)/sigma where trustworthy",
        worst_pull: "2 views: worst (fit - truth)/sigma where trustworthy",
        at_truth: "2 views: sigma at the truth against the bound",
        at_fit: "2 views: sigma at the fit against the bound where trustworthy, median",
        normal: "2 views: sigma of the normal at the truth against the bound",
        second: "2 views: listed second minimum found or bettered",
        doubt: "2 views: what is not identifiable is said to be, or has a wide sigma",
        converged: "2 views: descent converged",
    },
    Checks {
        views: 3,
        bound: "crlb_3_views",
        chi2: "3 views: chi2 above the tables' optimum, of 1e-4 of it + 1e-3",
        pull: "3 views: rms of (fit - truth)/sigma where trustworthy",
        worst_pull: "3 views: worst (fit - truth)/sigma where trustworthy",
        at_truth: "3 views: sigma at the truth against the bound",
        at_fit: "3 views: sigma at the fit against the bound where trustworthy, median",
        normal: "3 views: sigma of the normal at the truth against the bound",
        second: "3 views: listed second minimum found or bettered",
        doubt: "3 views: what is not identifiable is said to be, or has a wide sigma",
        converged: "3 views: descent converged",
    },
];

/// The forward model at the truth, and the fit of the noisy pixels.
pub(super) fn joint(case: &Case, report: &mut Report) -> Result<()> {
    noise_free(case, report)?;
    let shots = case.list("views")?;
    let cameras = shots.iter().map(|shot| shot.unit("x_cam")).collect::<Result<_>>()?;
    let direct = Direct::new([sky(case)?; 3], cameras, ORDER);
    let observations: Vec<_> = shots.iter().enumerate().map(observation).collect::<Result<_>>()?;
    for checks in &CHECKS {
        let observations = observations.get(..checks.views).context("too few views")?;
        pixel(case, checks, &direct, observations, report)?;
    }
    Ok(())
}

fn observation((view, shot): (usize, &Case)) -> Result<Observation> {
    let (sigma, noisy) = (shot.triple("sigma")?, shot.rows("noisy")?);
    let mut observation = Observation {
        view,
        direction: shot.unit("wo")?,
        stokes: [[f32::NAN; 3]; 3],
        covariance: sigma.map(|s| {
            let variance = single(s * s);
            [variance, 0.0, 0.0, variance, 0.0, variance]
        }),
    };
    for (band, values) in observation.stokes.iter_mut().zip(&noisy) {
        for (s, value) in band.iter_mut().zip(values) {
            *s = single(*value);
        }
    }
    Ok(observation)
}

#[expect(clippy::cast_possible_truncation, reason = "rounded to the precision of a pixel, 1e-5 of its noise")]
fn single(x: f64) -> f32 {
    x as f32
}

fn pixel(
    case: &Case,
    checks: &Checks,
    direct: &impl Forward,
    observations: &[Observation],
    report: &mut Report,
) -> Result<()> {
    let name = case.name();
    let bound = case.object(checks.bound)?;
    let settings = Settings { starts: Starts::All, ..Settings::default() };
    let found = fit(direct, observations, &[], &settings);
    report.holds(checks.converged, !found.reasons.contains(Reasons::NOT_CONVERGED), &name);

    let optimum = bound.object("mle")?.number("chi2")?;
    report.error(checks.chi2, 1.0, (found.chi2 - optimum) / (1e-4 * optimum + 1e-3), &name);

    let truth = case.object("truth")?;
    let (albedo, normal) = (truth.triple("rho_d")?, truth.unit("n")?);
    let facets = Facets { eta: truth.number("eta")?, alpha: truth.number("alpha")?, slope: slope(normal) };
    let values = parameters(albedo, &facets);
    let stated = bound.object("sigma")?;
    // No iterations: the covariance of these parameters.
    let curvature = fit(direct, observations, &[facets], &Settings { iterations: 0, ..settings });
    let expected = bound.number("sigma_normal_deg")?;
    report.see(checks.normal, 0.1, [curvature.normal_sigma_deg, expected, expected], &name);
    let trustworthy = bound.flag("crlb_trustworthy")?;
    let fitted = parameters(found.albedo, &found.facets);
    let unsure = bound.texts("not_identifiable")?;
    for (k, parameter) in PARAMETERS.iter().enumerate() {
        let expected = stated.number(parameter)?;
        let [at_truth, at_fit] = [&curvature, &found].map(|fit| fit.sigma()[k]);
        report.see(checks.at_truth, 0.1, [at_truth, expected, expected], &format!("{name}, {parameter}"));
        if trustworthy {
            let pull = (fitted[k] - values[k]) / at_fit;
            report.rms(checks.pull, 1.3, pull);
            report.error(checks.worst_pull, 5.0, pull.abs(), &format!("{name}, {parameter}"));
            report.typical(checks.at_fit, 0.1, (at_fit / expected - 1.0).abs());
        }
    }
    for parameter in unsure {
        report.holds(checks.doubt, is_doubted(&found, parameter), &format!("{name}, {parameter}"));
    }
    if let Ok(second) = bound.object("second_minimum").and_then(|second| second.number("chi2")) {
        let other = found.second.map_or(f64::INFINITY, |second| second.chi2);
        report.error(checks.second, 1.0, (other - second) / (1e-3 * second + 1e-2), &name);
    }
    Ok(())
}

/// Whether the fit says so or has a second minimum, or gives a σ beyond half of what counts as not identifiable.
fn is_doubted(found: &Fit, parameter: &str) -> bool {
    let sigma = found.sigma();
    let (reason, wide) = match parameter {
        "eta" => (Reasons::INDEX, sigma[3] > 0.1),
        "alpha" => (Reasons::ROUGHNESS, sigma[4] > 0.05 || sigma[4] > 0.25 * found.facets.alpha),
        "n" => (Reasons::NORMAL, found.normal_sigma_deg > 2.5),
        _ => (Reasons::ALBEDO, sigma[..3].iter().any(|sigma| *sigma > 0.05)),
    };
    found.reasons.contains(reason) || found.second.is_some() || wide
}

fn slope(normal: DVec3) -> [f64; 2] {
    [normal.x / normal.z, normal.y / normal.z]
}

/// In the order of [`PARAMETERS`].
fn parameters([r, g, b]: [f64; 3], facets: &Facets) -> [f64; 7] {
    let n = facets.normal();
    [r, g, b, facets.eta, facets.alpha, n.x, n.y]
}
