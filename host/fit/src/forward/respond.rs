//! From a material to its response: the contraction of a table.

use super::index::Weights;
use super::solve::{MOST as MOST_TERMS, terms};
use super::spline::Place;
use super::view::{BLOCK, Level, ViewTable};
use crate::material::{Facets, Lanes, Response, by};
use glam::DVec3;

/// Most blocks: nine numbers for each of six indices.
pub(super) const MOST_BLOCKS: usize = 7;

/// A material's mirror direction and normal on their way through the table, with their changes by the two slopes.
pub(super) struct Oriented {
    pub(super) normal: DVec3,
    pub(super) by: [DVec3; 2],
    /// n·ω_o > 0.
    pub(super) cosine: f64,
}

impl Oriented {
    /// `None` where the surface faces away.
    pub(super) fn new(wo: DVec3, slope: [[f64; 2]; 2]) -> Option<Self> {
        let [[x, keep_x], [y, keep_y]] = slope;
        let inverse = 1.0 / (1.0 + x * x + y * y).sqrt();
        let normal = DVec3::new(x, y, 1.0) * inverse;
        let cosine = normal.dot(wo);
        let by =
            [(DVec3::X - normal * normal.x) * (inverse * keep_x), (DVec3::Y - normal * normal.y) * (inverse * keep_y)];
        (cosine > 0.0).then_some(Self { normal, by, cosine })
    }
}

impl ViewTable {
    /// See [`crate::material::Forward::response`].
    pub(super) fn response(&self, wo: DVec3, facets: &Facets) -> Response {
        let Some(at) = Oriented::new(wo, facets.slope.map(|s| self.limits.slope.hold(s))) else {
            return Response::BLACK;
        };
        let mirror = at.normal * (2.0 * at.cosine) - wo;
        let mirror_by = at.by.map(|d| (at.normal * d.dot(wo) + d * at.cosine) * 2.0);
        let [place, by_x, by_y] = self.mirror.project_with(mirror, mirror_by);
        let alpha = facets.alpha.max(1e-12);
        let [log_alpha, keep_alpha] = self.limits.log_alpha.hold(alpha.ln());
        let [eta, keep_eta] = self.limits.eta.hold(facets.eta);
        let roughness = self.roughness.place(log_alpha);
        let (patch, within) = self.patches.find(self.rays.project(wo));
        let levels = [0, 1, 2].map(|k| &patch.levels[roughness.first + k]);
        let work = Contraction {
            levels,
            places: levels.map(|l| [l.axes[0].place(place[0]), l.axes[1].place(place[1])]),
            roughness: &roughness,
            terms: terms(within).map(super::numbers::single),
            count: patch.terms,
            blocks: self.blocks,
        };
        let sums = work.sums();
        let [weights, slopes] = self.index.at(eta);
        let indices = self.index.nodes.len();
        let mut out = Response::BLACK;
        out.specular = combine(&sums[0], &weights, indices, 1.0);
        out.specular_by[by::ETA] = combine(&sums[0], &slopes, indices, keep_eta);
        out.specular_by[by::ALPHA] = combine(&sums[1], &weights, indices, keep_alpha / alpha);
        let [along_x, along_y] = [&sums[2], &sums[3]].map(|s| combine(s, &weights, indices, 1.0));
        for k in 0..9 {
            out.specular_by[by::SLOPE_X][k] = along_x[k] * by_x[0] + along_y[k] * by_x[1];
            out.specular_by[by::SLOPE_Y][k] = along_x[k] * by_y[0] + along_y[k] * by_y[1];
        }
        self.body.add(&mut out, wo, self.camera_x, &at, [eta, keep_eta]);
        out
    }
}

/// Σ_j w_j of nine numbers each.
fn combine(sums: &[f32; MOST_BLOCKS * BLOCK], weights: &Weights, indices: usize, scale: f64) -> Lanes {
    let mut nine = [0.0_f32; 9];
    for (w, values) in weights.iter().zip(sums.chunks_exact(9)).take(indices) {
        for (n, v) in nine.iter_mut().zip(values) {
            *n += w * v;
        }
    }
    nine.map(|n| f64::from(n) * scale)
}

/// Where a material lies in a patch's table.
pub(super) struct Contraction<'a> {
    /// Three nodes of ln α, each with its own grid and the place in it.
    pub(super) levels: [&'a Level; 3],
    pub(super) places: [[Place; 2]; 3],
    pub(super) roughness: &'a Place,
    /// Terms of ω_o, `count` of them stored.
    pub(super) terms: [f32; MOST_TERMS],
    pub(super) count: usize,
    /// Vectors per term.
    pub(super) blocks: usize,
}

/// The value and its derivatives by ln α and by the two coordinates of the mirror direction.
pub(super) type Sums = [[f32; MOST_BLOCKS * BLOCK]; 4];

impl Contraction<'_> {
    fn sums(&self) -> Sums {
        #[cfg(target_arch = "x86_64")]
        if let Some(sums) = super::x86::sums(self) {
            return sums;
        }
        self.portable()
    }

    pub(super) fn portable(&self) -> Sums {
        match self.blocks {
            2 => self.sum::<2>(),
            3 => self.sum::<3>(),
            4 => self.sum::<4>(),
            5 => self.sum::<5>(),
            6 => self.sum::<6>(),
            _ => self.sum::<MOST_BLOCKS>(),
        }
    }

    /// ω_o first, which needs no derivative, then x, y and α: each adds one more derivative to fewer numbers.
    fn sum<const B: usize>(&self) -> Sums {
        let mut total = [[[0.0_f32; BLOCK]; B]; 4];
        for (k, (level, [x, y])) in self.levels.iter().zip(&self.places).enumerate() {
            let stride = self.count * B;
            let mut plane = [[[0.0_f32; BLOCK]; B]; 3];
            for j in 0..3 {
                let mut row = [[[0.0_f32; BLOCK]; B]; 2];
                for i in 0..3 {
                    let start = ((y.first + j) * level.axes[0].nodes + x.first + i) * stride;
                    let (values, _) = level.values[start..start + stride].as_chunks::<B>();
                    let mut node = [[0.0_f32; BLOCK]; B];
                    for (term, values) in self.terms.iter().zip(values) {
                        add(&mut node, *term, values);
                    }
                    add(&mut row[0], x.weights[i], &node);
                    add(&mut row[1], x.slopes[i], &node);
                }
                add(&mut plane[0], y.weights[j], &row[0]);
                add(&mut plane[1], y.weights[j], &row[1]);
                add(&mut plane[2], y.slopes[j], &row[0]);
            }
            let (weight, slope) = (self.roughness.weights[k], self.roughness.slopes[k]);
            add(&mut total[0], weight, &plane[0]);
            add(&mut total[1], slope, &plane[0]);
            add(&mut total[2], weight, &plane[1]);
            add(&mut total[3], weight, &plane[2]);
        }
        let mut out = [[0.0; MOST_BLOCKS * BLOCK]; 4];
        for (o, t) in out.iter_mut().zip(&total) {
            o[..B * BLOCK].copy_from_slice(t.as_flattened());
        }
        out
    }
}

fn add<const B: usize>(sum: &mut [[f32; BLOCK]; B], weight: f32, more: &[[f32; BLOCK]; B]) {
    for b in 0..B {
        for l in 0..BLOCK {
            sum[b][l] += weight * more[b][l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::numbers::{real, single};
    use super::super::spline::Axis;
    use super::*;

    /// Whatever the processor offers gives the portable sum.
    #[test]
    fn vectors_change_the_rounding_only() {
        for blocks in 2..=MOST_BLOCKS {
            for count in [1, 3, 6] {
                let level = |k: usize| {
                    let axes = [Axis::over([-1.0, 1.0], 0.3, 2), Axis::over([-0.5, 0.7], 0.2, 2)];
                    let nodes = axes[0].nodes * axes[1].nodes * count * blocks;
                    let value = |i: usize| core::array::from_fn(|l| single((real(i * BLOCK + l + k) * 0.618).fract()));
                    Level { axes, values: (0..nodes).map(value).collect() }
                };
                let levels = [level(0), level(5), level(11)];
                let work = Contraction {
                    levels: [&levels[0], &levels[1], &levels[2]],
                    places: levels.each_ref().map(|l| [l.axes[0].place(0.33), l.axes[1].place(-0.21)]),
                    roughness: &levels[0].axes[0].place(0.4),
                    terms: terms([0.3, -0.7]).map(single),
                    count,
                    blocks,
                };
                let (fast, portable) = (work.sums(), work.portable());
                for (a, b) in fast.as_flattened().iter().zip(portable.as_flattened()) {
                    assert!((a - b).abs() < 2e-5, "{blocks} blocks, {count} terms: {a} {b}");
                }
                assert!(
                    portable
                        .iter()
                        .all(|s| s[blocks * BLOCK - 1] != 0.0 && s[blocks * BLOCK..].iter().all(|x| *x == 0.0))
                );
            }
        }
    }
}
