//! All that the pixels have in common, made once.

use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::noise::ModelNoise;
use super::solve::Pixels;
use super::wheels::WheelNoise;
use super::{BodyChoice, FitOptions, PipelineError, identity, metals};
use crate::closed::SkyTable;
use crate::forward::{Body, TableOptions, Tables, ViewRays, ViewReport};
use crate::joint::{self, Settings, Starts};
use crate::light::KnownLight;
use crate::maps::Grid;
use crate::register::{Interpolation, Refinement, Registration};
use crate::session::{Session, SessionQuality};
use crate::tiles::{Job, SettingsHash};
use crate::wheel::WheelEstimate;

/// A session ready to be fitted.
pub struct Prepared<'a> {
    pub(super) options: FitOptions,
    pub(super) grid: Grid,
    pub(super) registration: Registration<'a>,
    pub(super) sky: SkyTable,
    pub(super) axes: Vec<DVec3>,
    /// In joint modes.
    pub(super) tables: Option<Tables>,
    pub(super) metals: Vec<Tables>,
    pub(super) noise: ModelNoise,
    pub(super) settings: Settings,
    identity: SettingsHash,
    report: Report,
}

/// What preparation found.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Geometry of the views.
    pub quality: SessionQuality,
    /// Repaired poses, if that was asked for.
    pub refinements: Vec<Refinement>,
    /// Tables of each view, in joint modes.
    pub tables: Vec<ViewReport>,
    /// What the choice of a body rests on, if it was open.
    pub body_trial: Option<BodyTrial>,
    /// What the pixels are fitted with.
    pub body: Body,
    /// σ of the light's scale and of the polarizers' zero (degrees), as the fit takes them.
    pub nuisances: [f64; 2],
    /// σ relative to s0 that is added for the model, by view.
    pub model_sigma: Vec<f64>,
    /// Time of registration, light, choice of the body, tables.
    pub times: [Duration; 4],
}

/// χ² of a sample of pixels with either body, each pixel's limited to 50.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyTrial {
    /// Of [`Body::Lambert`].
    pub lambert: f64,
    /// Of [`Body::Interface`].
    pub interface: f64,
    /// Pixels.
    pub pixels: usize,
}

/// Nodes a side of the closed forms' light.
const SKY_NODES: usize = 256;
/// Nodes a side of the net of pixels that choose the body.
const TRIAL_NODES: usize = 12;
/// Most of χ² that one of them has a say with.
const TRIAL_LIMIT: f64 = 50.0;
/// Tolerance of the tables that choose it: bodies differ by some hundredths.
const TRIAL_TOLERANCE: f64 = 5e-3;

impl<'a> Prepared<'a> {
    /// Prepares a session whose wheels are calibrated; `wheels` as [`super::calibrate_wheels`] answered.
    ///
    /// # Errors
    /// [`PipelineError`] as its variants say.
    pub fn new(
        session: &'a Session,
        wheels: &[Option<WheelEstimate>],
        options: FitOptions,
    ) -> Result<Self, PipelineError> {
        options.check()?;
        let views = session.views.len();
        if options.mode.is_joint() && views < 2 {
            return Err(PipelineError::TooFewViews { views, needed: 2 });
        }
        let grid = options.resolution.map_or_else(|| Grid::finest(session), |n| Grid::with_side(&session.sample, n));
        let grid = Grid::new(grid.columns, grid.rows, grid.plane)?;
        let (quality, clock) = (session.quality(), Instant::now());
        let mut registration = Registration::new(session, grid, Interpolation::default())?;
        let refinements =
            if options.refine && views > 1 { registration.refine(sharpest(&quality))? } else { Vec::new() };
        let registered = clock.elapsed();

        let clock = Instant::now();
        let light = session.light.known()?;
        let sky = SkyTable::sample(|w| light.stokes(w), |n| light.irradiance(n), SKY_NODES);
        let lit = clock.elapsed();

        let wheels: Vec<WheelNoise> = session
            .views
            .iter()
            .zip(wheels.iter().map(Option::as_ref).chain(std::iter::repeat(None)))
            .map(|(view, wheel)| WheelNoise::new(&view.data.analyzers(), wheel))
            .collect();
        let turn_deg = wheels.iter().map(|w| w.turn_deg).fold(0.0, f64::max);
        let settings = options.settings(light.scale_uncertainty(), turn_deg);
        let noise = ModelNoise { relative: vec![options.model_sigma; views], wheels };
        let axes = session.views.iter().map(|v| v.camera.right()).collect();
        let report = Report {
            quality,
            refinements,
            tables: Vec::new(),
            body_trial: None,
            body: Body::Lambert,
            nuisances: [settings.light_sigma, settings.rotation_sigma_deg],
            model_sigma: Vec::new(),
            times: [registered, lit, Duration::ZERO, Duration::ZERO],
        };
        let (tables, metals, identity) = (None, Vec::new(), SettingsHash::EMPTY);
        let mut prepared =
            Self { options, grid, registration, sky, axes, tables, metals, noise, settings, identity, report };
        if prepared.options.mode.is_joint() {
            prepared.model(session, &light)?;
        }
        prepared.report.model_sigma.clone_from(&prepared.noise.relative);
        prepared.identity = identity::of(session, &prepared.options, &light, prepared.report.body);
        Ok(prepared)
    }

    /// The forward model.
    fn model(&mut self, session: &Session, light: &KnownLight) -> Result<(), PipelineError> {
        let clock = Instant::now();
        let rays = rays(session);
        let body = match self.options.body {
            BodyChoice::Lambert => Body::Lambert,
            BodyChoice::Interface => Body::Interface,
            BodyChoice::Auto => {
                let coarse = |body| {
                    let options = self.options.tables(body);
                    let tolerance = options.tolerance.max(TRIAL_TOLERANCE);
                    Tables::new(light, &rays, &TableOptions { tolerance, ..options })
                };
                let trial = self.trial(&coarse(Body::Lambert)?, &coarse(Body::Interface)?)?;
                self.report.body_trial = Some(trial);
                if trial.interface < trial.lambert { Body::Interface } else { Body::Lambert }
            }
        };
        self.report.times[2] = clock.elapsed();
        let clock = Instant::now();
        let tables = Tables::new(light, &rays, &self.options.tables(body))?;
        // Half the 95th percentile of a table's errors is their σ.
        for (relative, report) in self.noise.relative.iter_mut().zip(tables.reports()) {
            *relative = relative.hypot(0.5 * report.error[1]);
        }
        self.metals = metals::tables(&self.options, light, &rays)?;
        self.report.times[3] = clock.elapsed();
        self.report.body = body;
        self.report.tables = tables.reports().to_vec();
        self.tables = Some(tables);
        Ok(())
    }

    fn trial(&self, lambert: &Tables, interface: &Tables) -> Result<BodyTrial, PipelineError> {
        let mut noise = self.noise.clone();
        // Both bodies answer to one measure: the larger error of the two.
        for (view, relative) in noise.relative.iter_mut().enumerate() {
            let error = |tables: &Tables| tables.reports().get(view).map_or(0.0, |r| 0.5 * r.error[1]);
            *relative = relative.hypot(error(lambert).max(error(interface)));
        }
        let pixels = self.net(TRIAL_NODES, &noise)?;
        let settings = Settings { starts: Starts::All, ..self.settings };
        let score = |tables: &Tables, i: usize| joint::fit(tables, pixels.get(i), &[], &settings).chi2.min(TRIAL_LIMIT);
        let both = (0..pixels.len()).into_par_iter().filter(|i| !pixels.get(*i).is_empty());
        let scores: Vec<[f64; 2]> = both.map(|i| [score(lambert, i), score(interface, i)]).collect();
        let sum = |k: usize| scores.iter().map(|s| s[k]).sum();
        Ok(BodyTrial { lambert: sum(0), interface: sum(1), pixels: scores.len() })
    }

    /// Pixels at the nodes of a net over the grid.
    fn net(&self, side: usize, noise: &ModelNoise) -> Result<Pixels, PipelineError> {
        let places = |count: usize| (0..side).map(move |k| ((2 * k + 1) * count / (2 * side)).min(count - 1));
        let mut all = Pixels::default();
        for row in places(self.grid.rows) {
            for column in places(self.grid.columns) {
                let tile = self.registration.tile(row..row + 1, column..column + 1)?;
                all.push(tile.node(0), noise);
            }
        }
        Ok(all)
    }

    /// The job that [`Self::run`] does: grid, tiles, and the identity of all that the answer depends on.
    ///
    /// # Errors
    /// [`crate::maps::MapsError::Inconsistent`] for a tile's side out of range.
    pub fn job(&self) -> Result<Job, PipelineError> {
        Ok(Job::new(self.grid, self.options.tile, self.identity, self.options.covariance)?)
    }

    pub(super) fn identity(&self) -> SettingsHash {
        self.identity
    }

    /// Where the samples lie.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// What preparation found.
    #[must_use]
    pub fn report(&self) -> &Report {
        &self.report
    }
}

/// The view nearest to the normal.
fn sharpest(quality: &SessionQuality) -> usize {
    let angles = quality.directions.iter().enumerate();
    angles.min_by(|(_, a), (_, b)| a[0].total_cmp(&b[0])).map_or(0, |(view, _)| view)
}

/// Corners, edges and middle of the sample as each view sees them.
fn rays(session: &Session) -> Vec<ViewRays> {
    let ([left, right], [bottom, top]) = (session.sample.x, session.sample.y);
    let at = |low: f64, high: f64, k: u8| low + (high - low) * 0.5 * f64::from(k);
    let points = || (0..9).map(|k| DVec2::new(at(left, right, k % 3), at(bottom, top, k / 3)));
    let view = |view: &crate::session::ViewCapture| ViewRays {
        camera_x: view.camera.right(),
        rays: points().map(|p| view.camera.towards(p)).collect(),
    };
    session.views.iter().map(view).collect()
}
