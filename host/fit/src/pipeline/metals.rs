//! Metals for the pixels that refuse a dielectric: each candidate is fitted, and taken where it explains the pixel clearly
//! better.
//!
//! A metal has no body, so ρ_d is 0, and its index is known. The map says which it is: η holds −k for the k-th candidate,
//! counted from 1.

use super::{FitOptions, PipelineError};
use crate::forward::{Body, IndexRange, TableOptions, Tables, ViewRays};
use crate::joint::{self, Fit, Reasons, Settings, Starts};
use crate::light::KnownLight;
use crate::material::{BANDS, Facets, Observation};

/// χ² by which a metal must be better than the dielectric.
const GATE: f64 = 9.0;

/// The candidates' forward models.
pub(super) fn tables(
    options: &FitOptions,
    light: &KnownLight,
    views: &[ViewRays],
) -> Result<Vec<Tables>, PipelineError> {
    let made = options.metals.iter().map(|metal| {
        let table = TableOptions { index: IndexRange::Fixed(metal.index), ..options.tables(Body::Interface) };
        Tables::new(light, views, &table)
    });
    Ok(made.collect::<Result<_, _>>()?)
}

/// The best candidate, if it passes the gate.
pub(super) fn fit(
    metals: &[Tables],
    observations: &[Observation],
    dielectric: &Fit,
    settings: &Settings,
) -> Option<Fit> {
    let settings = Settings { starts: Starts::All, ..*settings };
    let start = [Facets { eta: 1.5, ..dielectric.facets }];
    let fits = metals.iter().map(|tables| joint::fit(tables, observations, &start, &settings));
    let (number, mut best) = fits.enumerate().min_by(|(_, a), (_, b)| a.chi2.total_cmp(&b.chi2))?;
    if !best.chi2.is_finite() || best.chi2 > dielectric.chi2 - GATE {
        return None;
    }
    best.albedo = [0.0; BANDS];
    (0..BANDS).for_each(|k| best.covariance[k] = [0.0; 7]);
    best.reasons = Reasons(best.reasons.0 & !(Reasons::ALBEDO.0 | Reasons::INDEX.0));
    best.facets.eta = -(1.0 + f64::from(u32::try_from(number).unwrap_or(u32::MAX)));
    Some(best)
}
