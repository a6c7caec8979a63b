//! The pixels of a tile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::noise::ModelNoise;
use super::{Mode, PipelineError, Prepared, metals};
use crate::FitError;
use crate::closed::{self, Estimate};
use crate::forward::Tables;
use crate::joint::{self, Fit, Reasons, Settings, Starts};
use crate::maps::MaterialMaps;
use crate::material::{Facets, Observation};
use crate::tiles::{self, Progress, Share, Tile, TileStore};

/// What asks for a second look, from other starts. Parameters that are not identifiable or at a bound are not among it: noise
/// is not cured by looking again.
const SECOND_LOOK: u32 = Reasons::OUTSIDE_MODEL.0 | Reasons::NOT_CONVERGED.0 | Reasons::NO_MODEL.0;

/// Measurements of many pixels.
#[derive(Debug, Default)]
pub(super) struct Pixels {
    observations: Vec<Observation>,
    /// Where each ends.
    ends: Vec<usize>,
}

impl Pixels {
    /// Takes in what the views saw of the next pixel, with the errors of model and wheel.
    pub(super) fn push(&mut self, node: &[Option<Observation>], noise: &ModelNoise) {
        let first = self.observations.len();
        self.observations.extend(node.iter().flatten());
        self.observations[first..].iter_mut().for_each(|o| noise.add(o));
        self.ends.push(self.observations.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn get(&self, i: usize) -> &[Observation] {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.observations[start..self.ends[i]]
    }
}

impl Prepared<'_> {
    /// Fits one tile; `None` once `cancel` is true.
    ///
    /// # Errors
    /// [`FitError::Size`] for a tile of another grid.
    pub fn solve(&self, tile: &Tile, cancel: &AtomicBool) -> Result<Option<MaterialMaps>, FitError> {
        let pixels = self.pixels(tile)?;
        let mut maps = MaterialMaps::new(tile.grid, self.options.covariance);
        let fits = match (&self.tables, self.options.mode) {
            (Some(tables), _) => self.joint(tables, &pixels, tile.grid.columns, cancel),
            (None, mode) => (0..pixels.len())
                .map(|i| (!cancel.load(Ordering::Relaxed)).then(|| self.closed(mode, pixels.get(i))))
                .collect(),
        };
        let Some(fits) = fits else { return Ok(None) };
        for (i, fit) in fits.iter().enumerate() {
            match fit {
                Some(fit) => maps.set(i, fit),
                None => maps.reasons[i] = Reasons::TOO_FEW_DATA.0,
            }
        }
        Ok(Some(maps))
    }

    /// Fits the tiles of `share` that `store` does not have yet; see [`tiles::run`].
    ///
    /// # Errors
    /// As [`tiles::run`], and [`PipelineError::Fit`].
    pub fn run(
        &self,
        store: &TileStore,
        share: Share,
        cancel: &AtomicBool,
        report: impl Fn(Progress) + Sync,
    ) -> Result<Progress, PipelineError> {
        let refused = Mutex::new(None);
        let progress = tiles::run(store, share, cancel, report, |tile| match self.solve(tile, cancel) {
            Ok(maps) => maps,
            Err(error) => {
                *refused.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                None
            }
        })?;
        match refused.into_inner().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(progress),
            Some(error) => Err(error.into()),
        }
    }

    pub(super) fn pixels(&self, tile: &Tile) -> Result<Pixels, FitError> {
        let (rows, columns) = (tile.row..tile.row + tile.grid.rows, tile.column..tile.column + tile.grid.columns);
        let registered = self.registration.tile(rows, columns)?;
        let mut pixels = Pixels::default();
        (0..registered.len()).for_each(|i| pixels.push(registered.node(i), &self.noise));
        Ok(pixels)
    }

    fn closed(&self, mode: Mode, observations: &[Observation]) -> Option<Fit> {
        if observations.is_empty() {
            return None;
        }
        let estimate = match mode {
            Mode::Closed => closed::pixel(observations, &self.axes, &self.sky),
            _ => closed::sky_aware(observations, &self.axes, &self.sky),
        };
        Some(as_fit(&estimate, observations.len()))
    }

    /// Row by row, each pixel from the better of its neighbors' answers and a closed form; then the doubtful ones again.
    fn joint(&self, tables: &Tables, pixels: &Pixels, columns: usize, cancel: &AtomicBool) -> Option<Vec<Option<Fit>>> {
        let thorough = self.settings.starts == Starts::All;
        let first = Settings { starts: if thorough { Starts::All } else { Starts::Given }, ..self.settings };
        let mut fits: Vec<Option<Fit>> = Vec::with_capacity(pixels.len());
        for i in 0..pixels.len() {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            let observations = pixels.get(i);
            if observations.is_empty() {
                fits.push(None);
                continue;
            }
            let neighbors = [(i % columns > 0).then(|| i - 1), i.checked_sub(columns)];
            let mut starts = vec![closed::pixel(observations, &self.axes, &self.sky).facets];
            starts.extend(neighbors.into_iter().flatten().filter_map(|k| facets(&fits, k)));
            fits.push(Some(joint::fit(tables, observations, &starts, &first)));
        }
        if self.settings.starts == Starts::Auto {
            for i in 0..pixels.len() {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let Some(fit) = fits[i].filter(|fit| fit.reasons.0 & SECOND_LOOK != 0) else { continue };
                let around = [
                    Some(i),
                    i.checked_sub(columns),
                    (i + columns < pixels.len()).then_some(i + columns),
                    (i % columns > 0).then(|| i - 1),
                    (i % columns + 1 < columns).then_some(i + 1),
                ];
                let mut starts = vec![closed::sky_aware(pixels.get(i), &self.axes, &self.sky).facets];
                starts.extend(around.into_iter().flatten().filter_map(|k| facets(&fits, k)));
                let again = joint::fit(tables, pixels.get(i), &starts, &self.settings);
                if again.chi2 <= fit.chi2 {
                    fits[i] = Some(again);
                }
            }
        }
        for (i, fit) in fits.iter_mut().enumerate().filter(|_| !self.metals.is_empty()) {
            if let Some(dielectric) = fit.filter(|fit| fit.reasons.contains(Reasons::OUTSIDE_MODEL)) {
                let metal = metals::fit(&self.metals, pixels.get(i), &dielectric, &self.settings);
                *fit = metal.or(*fit);
            }
        }
        Some(fits)
    }
}

fn facets(fits: &[Option<Fit>], at: usize) -> Option<Facets> {
    fits.get(at).copied().flatten().filter(|fit| fit.chi2.is_finite()).map(|fit| fit.facets)
}

/// A closed form as maps hold it: no χ², no covariances between parameters, α unknown.
fn as_fit(estimate: &Estimate, views: usize) -> Fit {
    let sigma = estimate.sigma;
    let [r, g, b] = sigma.albedo;
    // The rms angle is over both directions across the normal.
    let across = sigma.normal_rad / std::f64::consts::SQRT_2;
    let mut covariance = [[0.0; 7]; 7];
    for (k, sigma) in [r, g, b, sigma.eta, f64::INFINITY, across, across].into_iter().enumerate() {
        covariance[k][k] = sigma * sigma;
    }
    Fit {
        albedo: estimate.albedo,
        facets: estimate.facets,
        covariance,
        normal_sigma_deg: sigma.normal_rad.to_degrees(),
        alpha_interval: [0.0, f64::INFINITY],
        chi2: f64::NAN,
        freedom: 0,
        views: u32::try_from(views).unwrap_or(u32::MAX),
        evaluations: 0,
        reasons: estimate.reasons,
        second: None,
    }
}
