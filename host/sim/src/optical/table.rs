//! The specular Stokes response of one surface in one view, tabulated.
//!
//! It depends on the normal n and on ω_o. Under a map, in the coordinates (mirror direction r, ω_o), the two scales separate: along r
//! it changes with the light and the lobe (cubic interpolation on a grid as fine as the measured error asks for), along ω_o at
//! fixed r it only sees Fresnel terms and frames turn (a polynomial over the picture's few degrees). Under a smooth sky (n, ω_o)
//! serve better: normals cover less than mirrored rays do, and every pair is one that pixels may have, where r and ω_o from
//! opposite ends of the picture mean facets far off, whose lobes a horizon cuts. All values are Stokes in the camera frame of
//! their own ω_o, which is smooth in both. Only nodes some pixel asks for are computed.

use super::chart::{Axis, Chart, Extent, lagrange};
use super::numbers::{cell, count_above, real, single};
use super::survey::Pixels;
use glam::{DVec3, Vec3};
use host_optics::prefilter::Rgb;
use rayon::prelude::*;

/// Nine numbers, padded to whole vectors: band-major (s0, s1, s2).
pub(crate) type Lanes = [f32; 12];

/// Linear or cubic steps between two computed nodes of ω_o.
const FINE: usize = 4;

/// Below this tolerance ω_o is interpolated by cubics: four times the work of a look-up.
const CUBIC_BELOW: f64 = 1e-3;

/// The coordinate of a table beside ω_o.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Over {
    Mirror,
    Normal,
}

#[derive(Clone, Debug)]
pub(crate) struct Table {
    over: Over,
    chart: Chart,
    view: Chart,
    x: Axis,
    y: Axis,
    origin: [f32; 2],
    per_unit: [f32; 2],
    fine: [usize; 2],
    cubic: bool,
    /// [a][b][y][x] of fine view nodes and the chart's.
    values: Vec<Lanes>,
    computed: usize,
}

impl Table {
    /// Over the pixels of one surface, for interpolation that errs by about `tolerance` of s0, with nodes `spacing[0]` apart over the
    /// chart and about `spacing[1]` over ω_o (a polynomial of degree 2 and up). `None` where it would take more than `limit`.
    pub(crate) fn build(
        pixels: &Pixels<'_>,
        over: Over,
        spacing: [f64; 2],
        tolerance: f64,
        limit: usize,
        node: impl Fn(DVec3, DVec3) -> Rgb + Sync,
    ) -> Option<Self> {
        let chart = over.chart(pixels);
        let (view, r, o) = (pixels.view_chart, extent(pixels, over), &pixels.view);
        let x = Axis::over(r.low[0], r.high[0], spacing[0]);
        let y = Axis::over(r.low[1], r.high[1], spacing[0]);
        let coarse: [usize; 2] = core::array::from_fn(|k| {
            let size = f64::from(o.high[k] - o.low[k]);
            if size < 1e-5 { 1 } else { count_above(size / spacing[1]).max(2) + 1 }
        });
        let fine = coarse.map(|n| if n == 1 { 1 } else { FINE * (n - 1) + 1 });
        let wanted = wanted(pixels, over, &x, &y);
        let views = coarse[0] * coarse[1];
        if wanted.len() * views > limit || x.nodes * y.nodes * fine[0] * fine[1] > 1 << 22 {
            return None;
        }
        let place = |k: usize, n: usize, axis: usize| {
            let (low, high) = (f64::from(o.low[axis]), f64::from(o.high[axis]));
            if n == 1 { 0.5 * (low + high) } else { low + (high - low) * chebyshev(k, n) }
        };
        let rows: Vec<Vec<Lanes>> = wanted
            .par_iter()
            .map(|at| {
                let place_of = chart.direction([x.at(at % x.nodes), y.at(at / x.nodes)]);
                let computed: Vec<Lanes> = (0..views)
                    .map(|k| {
                        let wo =
                            view.direction([place(k / coarse[1], coarse[0], 0), place(k % coarse[1], coarse[1], 1)]);
                        lanes(&node(over.normal(place_of, wo), wo))
                    })
                    .collect();
                spread(&computed, coarse, fine)
            })
            .collect();
        let plane = x.nodes * y.nodes;
        let mut values = vec![[0.0; 12]; plane * fine[0] * fine[1]];
        for (at, row) in wanted.iter().zip(&rows) {
            for (k, value) in row.iter().enumerate() {
                values[k * plane + at] = *value;
            }
        }
        let per_unit = core::array::from_fn(|k| {
            let size = f64::from(o.high[k] - o.low[k]);
            if fine[k] == 1 { 0.0 } else { single(real(fine[k] - 1) / size) }
        });
        let (cubic, computed) = (tolerance < CUBIC_BELOW, wanted.len() * views);
        Some(Self { over, chart, view, x, y, origin: o.low, per_unit, fine, cubic, values, computed })
    }

    pub(crate) fn computed(&self) -> usize {
        self.computed
    }

    /// How many fine nodes of an axis of ω_o a look-up meets.
    #[inline]
    fn neighbors(&self, axis: usize) -> usize {
        self.fine[axis].min(if self.cubic { 4 } else { 2 })
    }

    /// The first of them around a coordinate, and their weights.
    #[inline]
    fn around(&self, axis: usize, place: f32) -> (usize, [f32; 4]) {
        let x = (place - self.origin[axis]) * self.per_unit[axis];
        if self.cubic && self.fine[axis] > 1 {
            let (first, t) = cell(x - 1.0, self.fine[axis] - 4);
            (first, lagrange(t))
        } else {
            let (first, t) = cell(x, self.fine[axis].saturating_sub(2));
            (first, [1.0 - t, t, 0.0, 0.0])
        }
    }

    /// Of a pixel with unit normal and ω_o, n·ω_o > 0.
    pub(crate) fn at(&self, normal: Vec3, wo: Vec3) -> Lanes {
        let [px, py] = self.chart.project(self.over.of(normal, wo));
        let [a, b] = self.view.project(wo);
        let ((ix, wx), (iy, wy)) = (self.x.cubic(px), self.y.cubic(py));
        let ((ia, wa), (ib, wb)) = (self.around(0, a), self.around(1, b));
        let (wa, wb) = (&wa[..self.neighbors(0)], &wb[..self.neighbors(1)]);
        let plane = self.x.nodes * self.y.nodes;
        let mut sum = [0.0_f32; 12];
        for (da, wa) in wa.iter().enumerate() {
            for (db, wb) in wb.iter().enumerate() {
                let slab = ((ia + da) * self.fine[1] + ib + db) * plane;
                let share = wa * wb;
                for (j, v) in wy.iter().enumerate() {
                    let start = slab + (iy + j) * self.x.nodes + ix;
                    let v = v * share;
                    for (node, u) in self.values[start..start + 4].iter().zip(wx) {
                        let w = u * v;
                        for (s, value) in sum.iter_mut().zip(node) {
                            *s += w * value;
                        }
                    }
                }
            }
        }
        sum
    }
}

/// The kth of n Chebyshev points from 0 to 1, both ends among them: polynomials through many of them stay tame.
fn chebyshev(k: usize, n: usize) -> f64 {
    if n == 1 { 0.0 } else { 0.5 - 0.5 * (core::f64::consts::PI * real(k) / real(n - 1)).cos() }
}

pub(crate) fn lanes(rgb: &Rgb) -> Lanes {
    let mut out = [0.0; 12];
    for (o, v) in out.iter_mut().zip(rgb.iter().flatten()) {
        *o = single(*v);
    }
    out
}

impl Over {
    fn chart(self, pixels: &Pixels<'_>) -> Chart {
        match self {
            Self::Mirror => pixels.mirror_chart,
            Self::Normal => pixels.extent.normal_chart,
        }
    }

    /// The coordinate's direction of a pixel.
    fn of(self, normal: Vec3, wo: Vec3) -> Vec3 {
        match self {
            Self::Mirror => normal * (2.0 * normal.dot(wo)) - wo,
            Self::Normal => normal,
        }
    }

    /// The normal of a node.
    fn normal(self, direction: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::Mirror => (direction + wo).normalize_or(wo),
            Self::Normal => direction,
        }
    }
}

/// Where the pixels lie.
fn extent(pixels: &Pixels<'_>, over: Over) -> Extent {
    let chart = over.chart(pixels);
    let project = |(normal, wo): (Vec3, Vec3)| chart.project(over.of(normal, wo));
    let empty = || Extent::EMPTY;
    let add = |mut extent: Extent, p| {
        extent.add(p);
        extent
    };
    pixels.rows().map(project).fold(empty, add).reduce(empty, |mut a, b| {
        a.merge(&b);
        a
    })
}

/// Nodes of the grid around some pixel, ascending.
fn wanted(pixels: &Pixels<'_>, over: Over, x: &Axis, y: &Axis) -> Vec<usize> {
    let chart = over.chart(pixels);
    let marks = pixels.rows().fold(
        || vec![false; x.nodes * y.nodes],
        |mut marks, (normal, wo)| {
            let [px, py] = chart.project(over.of(normal, wo));
            let ((ix, _), (iy, _)) = (x.cubic(px), y.cubic(py));
            marks[iy * x.nodes + ix] = true;
            marks
        },
    );
    let marks = marks.reduce(
        || vec![false; x.nodes * y.nodes],
        |mut a, b| {
            for (a, b) in a.iter_mut().zip(b) {
                *a |= b;
            }
            a
        },
    );
    let mut wide = vec![false; marks.len()];
    for at in (0..marks.len()).filter(|k| marks[*k]) {
        for j in 0..4 {
            for i in 0..4 {
                wide[at + j * x.nodes + i] = true;
            }
        }
    }
    (0..wide.len()).filter(|k| wide[*k]).collect()
}

/// Values at coarse view nodes carried to the fine ones by the polynomial through all of them.
fn spread(coarse_values: &[Lanes], coarse: [usize; 2], fine: [usize; 2]) -> Vec<Lanes> {
    let weights = [0, 1].map(|k| basis(coarse[k], fine[k]));
    let mut out = Vec::with_capacity(fine[0] * fine[1]);
    for wa in &weights[0] {
        for wb in &weights[1] {
            let mut sum = [0.0_f32; 12];
            for (k, value) in coarse_values.iter().enumerate() {
                let w = single(wa[k / coarse[1]] * wb[k % coarse[1]]);
                for (s, v) in sum.iter_mut().zip(value) {
                    *s += w * v;
                }
            }
            out.push(sum);
        }
    }
    out
}

/// Lagrange weights of `coarse` Chebyshev points at `fine` equally spaced places.
fn basis(coarse: usize, fine: usize) -> Vec<Vec<f64>> {
    let weight = |x: f64, k: usize| {
        let others = (0..coarse).filter(|j| *j != k);
        others.map(|j| (x - chebyshev(j, coarse)) / (chebyshev(k, coarse) - chebyshev(j, coarse))).product::<f64>()
    };
    let place = |f: usize| if fine == 1 { 0.0 } else { real(f) / real(fine - 1) };
    (0..fine).map(|f| (0..coarse).map(|k| weight(place(f), k)).collect()).collect()
}
