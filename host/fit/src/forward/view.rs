//! One view's table: what is stored and where a material is found in it.

use super::body::BodyTable;
use super::chart::{Chart, Extent};
use super::index::IndexBasis;
use super::spline::Axis;
use glam::DVec3;

/// Numbers in a block: one vector.
pub(super) const BLOCK: usize = 8;

/// The table of a view.
#[derive(Debug)]
pub(super) struct ViewTable {
    pub(super) camera_x: DVec3,
    /// Of ω_o.
    pub(super) rays: Chart,
    pub(super) patches: Patches,
    /// Of the mirror direction.
    pub(super) mirror: Chart,
    /// ln α.
    pub(super) roughness: Axis,
    pub(super) index: IndexBasis,
    pub(super) body: BodyTable,
    /// Vectors per term of a node: nine numbers for every index, one after the other.
    pub(super) blocks: usize,
    pub(super) limits: Limits,
}

/// Where parameters begin to be held back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) slope: Soft,
    pub(super) log_alpha: Soft,
    pub(super) eta: Soft,
}

/// A range that is left ever more slowly: by at most `margin`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Soft {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) margin: f64,
}

/// Equal patches of the box of ω_o, row by row.
#[derive(Debug)]
pub(super) struct Patches {
    pub(super) extent: Extent,
    pub(super) grid: [usize; 2],
    pub(super) all: Vec<Patch>,
}

/// A part of the view over which a parabola holds.
#[derive(Debug)]
pub(super) struct Patch {
    pub(super) terms: usize,
    /// One per node of ln α.
    pub(super) levels: Vec<Level>,
}

/// Spline coefficients over mirror directions: \[y\]\[x\]\[term\]\[block\].
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) axes: [Axis; 2],
    pub(super) values: Vec<[f32; BLOCK]>,
}

impl ViewTable {
    pub(super) fn bytes(&self) -> usize {
        let blocks: usize = self.patches.all.iter().flat_map(|p| &p.levels).map(|l| l.values.len()).sum();
        core::mem::size_of::<f32>() * (BLOCK * blocks + self.body.len())
    }
}

impl Soft {
    /// The value kept and its derivative.
    pub(super) fn hold(&self, x: f64) -> [f64; 2] {
        let over = |d: f64| {
            let shrink = 1.0 / (1.0 + d / self.margin);
            [d * shrink, shrink * shrink]
        };
        if x > self.high {
            let [d, slope] = over(x - self.high);
            [self.high + d, slope]
        } else if x < self.low {
            let [d, slope] = over(self.low - x);
            [self.low - d, slope]
        } else {
            [x, 1.0]
        }
    }

    /// With the margins.
    pub(super) fn reach(&self) -> [f64; 2] {
        [self.low - self.margin, self.high + self.margin]
    }
}

impl Patches {
    /// The patch of a place on the chart of ω_o and the coordinates within, in [−1, 1]; places outside are moved to the edge.
    pub(super) fn find(&self, place: [f64; 2]) -> (&Patch, [f64; 2]) {
        let mut index = [0; 2];
        let mut within = [0.0; 2];
        for k in 0..2 {
            let count = super::numbers::real(self.grid[k]);
            let size = (self.extent.high[k] - self.extent.low[k]).max(1e-12);
            let x = ((place[k] - self.extent.low[k]) / size).clamp(0.0, 1.0) * count;
            let (cell, rest) = super::numbers::nearest(x - 0.5, 0, self.grid[k] - 1);
            index[k] = cell;
            within[k] = 2.0 * rest;
        }
        (&self.all[index[0] * self.grid[1] + index[1]], within)
    }

    /// Middle and half sizes of patch number `index`.
    pub(super) fn place(&self, index: usize) -> [[f64; 2]; 2] {
        let at = [index / self.grid[1], index % self.grid[1]];
        let half: [f64; 2] = core::array::from_fn(|k| self.extent.half(k) / super::numbers::real(self.grid[k]));
        let middle = core::array::from_fn(|k| self.extent.low[k] + half[k] * (2.0 * super::numbers::real(at[k]) + 1.0));
        [middle, half]
    }
}
