//! A part of the grid with what every view measured there.

use std::ops::Range;

use glam::{DMat3, DVec2, DVec3};
use protocol_polar::Flags;
use rayon::prelude::*;

use super::kernel::{Footprint, reach};
use super::window::{PAIRS, Window};
use super::{Interpolation, RegisteredView, Registration};
use crate::FitError;
use crate::maps::Grid;
use crate::material::{BANDS, Observation};

/// What happened to a view at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeFlags {
    /// Of all pixels that made the node, all bands together. `SATURATED`: a clipped sample was dropped.
    pub pixels: Flags,
    /// The node lies outside the picture.
    pub outside: bool,
    /// The node is behind the camera, or its ray has no frame.
    pub behind: bool,
}

/// Nodes of a rectangle of the grid.
pub struct Tile {
    /// Rows of the grid.
    pub rows: Range<usize>,
    /// Columns of the grid.
    pub cols: Range<usize>,
    views: usize,
    /// Row-major nodes, views fastest.
    observations: Vec<Option<Observation>>,
    flags: Vec<NodeFlags>,
}

impl Tile {
    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len() * self.cols.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What each view measured at node `i` (row-major within the tile); `None` where it sees nothing. Panics beyond the
    /// tile.
    #[must_use]
    pub fn node(&self, i: usize) -> &[Option<Observation>] {
        &self.observations[i * self.views..(i + 1) * self.views]
    }

    /// What happened to each view at node `i`; panics beyond the tile.
    #[must_use]
    pub fn flags(&self, i: usize) -> &[NodeFlags] {
        &self.flags[i * self.views..(i + 1) * self.views]
    }
}

impl Registration<'_> {
    /// Measures the nodes of a rectangle of the grid; squares of some 64 nodes a side keep the parts of the pictures
    /// small.
    ///
    /// # Errors
    /// [`FitError::Size`] for rows or columns beyond the grid.
    pub fn tile(&self, rows: Range<usize>, cols: Range<usize>) -> Result<Tile, FitError> {
        for (what, found, expected) in
            [("rows of a grid", rows.end, self.grid.rows), ("columns of a grid", cols.end, self.grid.columns)]
        {
            if found > expected {
                return Err(FitError::Size { what, found, expected });
            }
        }
        let (views, count) = (self.views.len(), rows.len() * cols.len());
        let mut tile = Tile {
            rows,
            cols,
            views,
            observations: vec![None; count * views],
            flags: vec![NodeFlags { outside: true, ..NodeFlags::default() }; count * views],
        };
        for (v, view) in self.views.iter().enumerate() {
            let Some(window) = view.window_of(&self.grid, &tile.rows, &tile.cols)? else { continue };
            let (columns, first) = (tile.cols.len(), [tile.rows.start, tile.cols.start]);
            let nodes =
                tile.observations.par_chunks_mut(views * columns).zip(tile.flags.par_chunks_mut(views * columns));
            nodes.enumerate().for_each_init(Footprint::default, |footprint, (r, (observations, flags))| {
                for c in 0..columns {
                    let node = self.grid.node(first[0] + r, first[1] + c);
                    let measured = view.observe(v, &self.grid, node, &window, footprint, self.interpolation);
                    (observations[c * views + v], flags[c * views + v]) = measured;
                }
            });
        }
        Ok(tile)
    }
}

impl RegisteredView<'_> {
    /// The part of the picture that a rectangle of nodes needs; `None` if they are all outside.
    pub(super) fn window_of(
        &self,
        grid: &Grid,
        rows: &Range<usize>,
        cols: &Range<usize>,
    ) -> Result<Option<Window>, FitError> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let step = self.lattices.iter().flatten().map(|l| l.step).max().unwrap_or(1);
        let nodes = rows.clone().flat_map(|r| cols.clone().map(move |c| (r, c)));
        for (pixel, cell) in nodes.filter_map(|(r, c)| self.place(grid, grid.node(r, c))) {
            if self.contains(pixel) {
                let reach = reach(&cell, step);
                (low, high) = (low.min(pixel - reach), high.max(pixel + reach));
            }
        }
        let [width, height] = self.capture.camera.size();
        let span =
            |low: f64, high: f64, size: usize| clamped(low.floor(), size - 1)..clamped(high.ceil() + 1.0, size).max(1);
        if low.x > high.x {
            return Ok(None);
        }
        self.windows.window(span(low.x, high.x, width), span(low.y, high.y, height)).map(Some)
    }

    /// What this view, `number` of them, measured at a node whose pixels are in `window`.
    pub(super) fn observe(
        &self,
        number: usize,
        grid: &Grid,
        node: DVec2,
        window: &Window,
        footprint: &mut Footprint,
        interpolation: Interpolation,
    ) -> (Option<Observation>, NodeFlags) {
        let behind = NodeFlags { behind: true, ..NodeFlags::default() };
        let Some((pixel, cell)) = self.place(grid, node) else { return (None, behind) };
        if !self.contains(pixel) {
            return (None, NodeFlags { outside: true, ..NodeFlags::default() });
        }
        let direction = self.capture.camera.towards(node);
        let Some(correction) = self.correction.at(direction) else { return (None, behind) };
        let mut observation =
            Observation { view: number, direction, stokes: [[0.0; 3]; BANDS], covariance: [NO_ANSWER; BANDS] };
        let mut flags = Flags::default();
        let mut answers = 0;
        for band in 0..BANDS {
            let lattices = &self.lattices[band];
            if band == 0 || *lattices != self.lattices[band - 1] {
                footprint.fill(pixel, &cell, lattices, self.capture.camera.size(), interpolation);
            }
            let sum = summed(footprint, window, window.channel_of(band), &mut flags);
            if let Some((stokes, covariance)) = sum {
                let (stokes, covariance) = turned(correction * self.scale[band], stokes, covariance);
                observation.stokes[band] = stokes.to_array().map(single);
                observation.covariance[band] = PAIRS.map(|(i, j)| single(covariance.col(j)[i]));
                answers += 1;
            }
        }
        let flags = NodeFlags { pixels: flags, ..NodeFlags::default() };
        ((answers > 0).then_some(observation), flags)
    }
}

/// Covariance of a band that has none.
const NO_ANSWER: [f32; 6] = [f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Σ w s and Σ w² C of one channel over a footprint; `None` if a pixel has no answer.
fn summed(footprint: &Footprint, window: &Window, channel: usize, flags: &mut Flags) -> Option<(DVec3, DMat3)> {
    let (mut stokes, mut upper) = (DVec3::ZERO, [0.0; 6]);
    let mut whole = true;
    for &(at, weight) in &footprint.taps {
        let pixel = window.pixel(channel, at);
        *flags = flags.with(pixel.flags);
        whole &= !pixel.flags.contains(Flags::TOO_FEW) && pixel.covariance[0].is_finite();
        stokes += DVec3::from_array(pixel.stokes.map(f64::from)) * weight;
        upper.iter_mut().zip(pixel.covariance).for_each(|(sum, c)| *sum += weight * weight * f64::from(c));
    }
    let [a, b, c, d, e, f] = upper;
    let covariance = DMat3::from_cols(DVec3::new(a, b, c), DVec3::new(b, d, e), DVec3::new(c, e, f));
    whole.then_some((stokes, covariance))
}

/// M s and M C Mᵀ.
fn turned(m: DMat3, stokes: DVec3, covariance: DMat3) -> (DVec3, DMat3) {
    (m * stokes, m * covariance * m.transpose())
}

#[expect(clippy::cast_possible_truncation, reason = "observations are f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number, clamped to the picture")]
fn clamped(whole: f64, largest: usize) -> usize {
    (whole.max(0.0) as usize).min(largest)
}
