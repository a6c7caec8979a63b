//! The common turn of each view's angles from the reference strip, where there is one.

use glam::DVec2;
use protocol_polar::Radians;

use super::PipelineError;
use crate::forward::{Body, IndexRange, TableOptions, Tables, ViewRays};
use crate::maps::{Grid, PlaneRect};
use crate::register::{Interpolation, Registration};
use crate::session::{ReferenceStrip, Session, ViewData};
use crate::wheel::{WheelEstimate, Zero, zeros};

/// Of the strip's sides so much is left out at each edge: what neighboring pixels spill.
const EDGE: f64 = 0.15;
/// Nodes along the longer and the shorter side.
const NODES: [usize; 2] = [160, 10];
/// What the tables and the strip's flatness leave uncertain.
const MODEL_SIGMA: Radians = Radians(0.1 * std::f64::consts::PI / 180.0);

/// Turns the angles of all views that see the strip, and tells the estimates how well they are known now.
pub(super) fn read(session: &mut Session, estimates: &mut [Option<WheelEstimate>]) -> Result<(), PipelineError> {
    let Some(strip) = session.strip else { return Ok(()) };
    if estimates.iter().all(Option::is_none) {
        return Ok(());
    }
    let found = zeros_of(session, strip)?;
    for ((view, estimate), zero) in session.views.iter_mut().zip(estimates).zip(found) {
        let (ViewData::Frames(frames), Some(estimate), Some(zero)) = (&mut view.data, estimate, zero) else { continue };
        let n = estimate.corrections.len() as f64;
        let variance = estimate.covariance.iter().sum::<f64>() / (n * n);
        let spread = estimate.covariance.iter().step_by(estimate.corrections.len() + 1).sum::<f64>() / n - variance;
        // What is left of the frames' own errors turns the strip's AoLP too, two of N directions of it.
        let sigma = (zero.sigma.0.powi(2) + MODEL_SIGMA.0.powi(2) + spread.max(0.0) * 2.0 / n).sqrt();
        let zero = Zero { sigma: Radians(sigma), ..zero }.with_prior(Radians(variance.max(0.0).sqrt()));
        for (analyzer, correction) in frames.analyzers.iter_mut().zip(&mut estimate.corrections) {
            analyzer.angle.0 += zero.turn.0;
            correction.0 += zero.turn.0;
        }
        estimate.covariance.iter_mut().for_each(|c| *c += zero.sigma.0.powi(2) - variance);
    }
    Ok(())
}

fn zeros_of(session: &Session, strip: ReferenceStrip) -> Result<Vec<Option<Zero>>, PipelineError> {
    let ([x0, x1], [y0, y1]) = (strip.place.x, strip.place.y);
    let edge = EDGE * (x1 - x0).min(y1 - y0);
    let (wide, inside) =
        (x1 - x0 >= y1 - y0, PlaneRect { left: x0 + edge, right: x1 - edge, bottom: y0 + edge, top: y1 - edge });
    let [long, short] = NODES;
    let grid = if wide { Grid::new(long, short, inside) } else { Grid::new(short, long, inside) }?;
    let views: Vec<ViewRays> = session
        .views
        .iter()
        .map(|view| {
            let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1), (0.5 * (x0 + x1), 0.5 * (y0 + y1))];
            let rays = corners.iter().map(|(x, y)| view.camera.towards(DVec2::new(*x, *y))).collect();
            ViewRays { camera_x: view.camera.right(), rays }
        })
        .collect();
    let options = TableOptions {
        index: IndexRange::Free([strip.eta * 0.98, strip.eta * 1.02]),
        alpha: [0.015, 0.6],
        slope: 0.02,
        body: Body::Interface,
        tolerance: 3e-3,
        ..TableOptions::default()
    };
    let tables = Tables::new(&session.light.known()?, &views, &options)?;
    let tile = Registration::new(session, grid, Interpolation::default())?.tile(0..grid.rows, 0..grid.columns)?;
    Ok(zeros(&tables, &tile, session.views.len(), strip.eta))
}
