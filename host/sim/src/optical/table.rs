//! The specular Stokes response of one surface in one view, tabulated.
//!
//! It depends on the normal and on ω_o. In the coordinates (mirror direction r, ω_o) the two scales separate: along r it changes
//! with the light and the lobe (cubic interpolation on a grid as fine as the measured error asks for), along ω_o at fixed r it
//! only sees Fresnel terms and frames turn (a polynomial over the picture's few degrees). All values are Stokes in the camera
//! frame of their own ω_o, which is smooth in both. Only nodes some pixel asks for are computed.

use super::chart::{Axis, Chart, Extent};
use super::numbers::{cell, count_above, real, single};
use super::survey::Pixels;
use glam::{DVec3, Vec3};
use host_optics::prefilter::Rgb;
use rayon::prelude::*;

/// Nine numbers, padded to whole vectors: band-major (s0, s1, s2).
pub(crate) type Lanes = [f32; 12];

/// Nodes along one coordinate of ω_o that are computed: a polynomial of degree 2 and up.
const COARSE_STEP: f64 = 0.09;
/// Linear steps between two of them.
const FINE: usize = 4;

#[derive(Clone, Debug)]
pub(crate) struct Table {
    light: Chart,
    view: Chart,
    x: Axis,
    y: Axis,
    origin: [f32; 2],
    per_unit: [f32; 2],
    fine: [usize; 2],
    /// [a][b][y][x] of fine view nodes and mirror directions.
    values: Vec<Lanes>,
    computed: usize,
}

impl Table {
    /// Over the pixels of one surface. `None` where it would take more than `limit` nodes.
    pub(crate) fn build(
        pixels: &Pixels<'_>,
        spacing: f64,
        limit: usize,
        node: impl Fn(DVec3, DVec3) -> Rgb + Sync,
    ) -> Option<Self> {
        let (light, view) = (pixels.mirror_chart, pixels.view_chart);
        let (r, o) = (extent(pixels), &pixels.view);
        let x = Axis::over(r.low[0], r.high[0], spacing);
        let y = Axis::over(r.low[1], r.high[1], spacing);
        let coarse: [usize; 2] = core::array::from_fn(|k| {
            let size = f64::from(o.high[k] - o.low[k]);
            if size < 1e-5 { 1 } else { count_above(size / COARSE_STEP).max(2) + 1 }
        });
        let fine = coarse.map(|n| if n == 1 { 1 } else { FINE * (n - 1) + 1 });
        let wanted = wanted(pixels, &x, &y);
        let views = coarse[0] * coarse[1];
        if wanted.len() * views > limit || x.nodes * y.nodes * fine[0] * fine[1] > 1 << 22 {
            return None;
        }
        let place = |k: usize, n: usize, axis: usize| {
            let (low, high) = (f64::from(o.low[axis]), f64::from(o.high[axis]));
            if n == 1 { 0.5 * (low + high) } else { low + (high - low) * real(k) / real(n - 1) }
        };
        let rows: Vec<Vec<Lanes>> = wanted
            .par_iter()
            .map(|at| {
                let mirror = light.direction([x.at(at % x.nodes), y.at(at / x.nodes)]);
                let computed: Vec<Lanes> = (0..views)
                    .map(|k| {
                        let wo =
                            view.direction([place(k / coarse[1], coarse[0], 0), place(k % coarse[1], coarse[1], 1)]);
                        lanes(&node((mirror + wo).normalize_or(wo), wo))
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
        Some(Self { light, view, x, y, origin: o.low, per_unit, fine, values, computed: wanted.len() * views })
    }

    pub(crate) fn computed(&self) -> usize {
        self.computed
    }

    /// Of a pixel with unit normal and ω_o, n·ω_o > 0.
    pub(crate) fn at(&self, normal: Vec3, wo: Vec3) -> Lanes {
        let [px, py] = self.light.project(normal * (2.0 * normal.dot(wo)) - wo);
        let [a, b] = self.view.project(wo);
        let ((ix, wx), (iy, wy)) = (self.x.cubic(px), self.y.cubic(py));
        let (ia, ta) = cell((a - self.origin[0]) * self.per_unit[0], self.fine[0].saturating_sub(2));
        let (ib, tb) = cell((b - self.origin[1]) * self.per_unit[1], self.fine[1].saturating_sub(2));
        let plane = self.x.nodes * self.y.nodes;
        let mut sum = [0.0_f32; 12];
        for (da, wa) in [1.0 - ta, ta].into_iter().enumerate().take(self.fine[0]) {
            for (db, wb) in [1.0 - tb, tb].into_iter().enumerate().take(self.fine[1]) {
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

pub(crate) fn lanes(rgb: &Rgb) -> Lanes {
    let mut out = [0.0; 12];
    for (o, v) in out.iter_mut().zip(rgb.iter().flatten()) {
        *o = single(*v);
    }
    out
}

/// Where the mirrored rays go.
fn extent(pixels: &Pixels<'_>) -> Extent {
    let project = |(normal, wo): (Vec3, Vec3)| pixels.mirror_chart.project(normal * (2.0 * normal.dot(wo)) - wo);
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

/// Nodes of the mirror grid around some pixel, ascending.
fn wanted(pixels: &Pixels<'_>, x: &Axis, y: &Axis) -> Vec<usize> {
    let marks = pixels.rows().fold(
        || vec![false; x.nodes * y.nodes],
        |mut marks, (normal, wo)| {
            let [px, py] = pixels.mirror_chart.project(normal * (2.0 * normal.dot(wo)) - wo);
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

/// Lagrange weights of `coarse` equally spaced nodes at `fine` equally spaced places.
fn basis(coarse: usize, fine: usize) -> Vec<Vec<f64>> {
    let place = |k: usize, n: usize| if n == 1 { 0.0 } else { real(k) / real(n - 1) };
    let weight = |x: f64, k: usize| {
        let others = (0..coarse).filter(|j| *j != k);
        others.map(|j| (x - place(j, coarse)) / (place(k, coarse) - place(j, coarse))).product::<f64>()
    };
    (0..fine).map(|f| (0..coarse).map(|k| weight(place(f, fine), k)).collect()).collect()
}
