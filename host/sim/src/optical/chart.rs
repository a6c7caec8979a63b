//! Charts of the sphere and cubic interpolation on grids over them.
//!
//! A chart is stereographic about a center: smooth but at the antipode, so that no interpolation meets a pole of a frame.

use super::numbers::{cell, count_above, real, single, single3};
use glam::{DVec3, Vec3};

/// Stereographic coordinates about a direction, in which small angles are radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chart {
    axes: [Vec3; 3],
    exact: [DVec3; 3],
}

impl Chart {
    pub(crate) fn about(center: DVec3) -> Self {
        let (t, b) = host_optics::frames::tangents(center);
        Self { axes: [t, b, center].map(single3), exact: [t, b, center] }
    }

    pub(crate) fn project(&self, w: Vec3) -> [f32; 2] {
        let [t, b, c] = self.axes;
        // The antipode itself is clamped to a far, finite place.
        let scale = 2.0 / (1.0 + w.dot(c)).max(1e-4);
        [w.dot(t) * scale, w.dot(b) * scale]
    }

    /// Box around the coordinates of directions of which `along` tells the range of ω·axis.
    pub(crate) fn project_box(&self, along: impl Fn(Vec3) -> [f32; 2]) -> Extent {
        let [x, y, z] = self.axes.map(along);
        let [near, far] = [z[1], z[0]].map(|z| 2.0 / (1.0 + z).max(1e-4));
        let low = [x[0], y[0]].map(|a| if a < 0.0 { a * far } else { a * near });
        let high = [x[1], y[1]].map(|a| if a > 0.0 { a * far } else { a * near });
        Extent { low, high }
    }

    pub(crate) fn direction(&self, [x, y]: [f64; 2]) -> DVec3 {
        let [t, b, c] = self.exact;
        let (x, y) = (0.5 * x, 0.5 * y);
        let k = x * x + y * y;
        (t * (2.0 * x) + b * (2.0 * y) + c * (1.0 - k)) / (1.0 + k)
    }
}

/// Smallest box around points of a chart; empty at first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) low: [f32; 2],
    pub(crate) high: [f32; 2],
}

impl Extent {
    pub(crate) const EMPTY: Self = Self { low: [f32::INFINITY; 2], high: [f32::NEG_INFINITY; 2] };

    pub(crate) fn add(&mut self, p: [f32; 2]) {
        self.merge(&Self { low: p, high: p });
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for k in 0..2 {
            self.low[k] = self.low[k].min(other.low[k]);
            self.high[k] = self.high[k].max(other.high[k]);
        }
    }

    /// Its longer side; negative if empty.
    pub(crate) fn size(&self) -> f64 {
        f64::from((self.high[0] - self.low[0]).max(self.high[1] - self.low[1]))
    }
}

/// Equally spaced nodes along one coordinate, one beyond each end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    origin: f32,
    per_unit: f32,
    pub(crate) nodes: usize,
}

impl Axis {
    pub(crate) fn over(low: f32, high: f32, spacing: f64) -> Self {
        let (low, high) = (f64::from(low), f64::from(high));
        let cells = count_above((high - low) / spacing).min(4096);
        let step = ((high - low) / real(cells)).max(1e-6);
        Self { origin: single(low - step), per_unit: single(1.0 / step), nodes: cells + 3 }
    }

    pub(crate) fn at(&self, node: usize) -> f64 {
        f64::from(self.origin) + real(node) / f64::from(self.per_unit)
    }

    /// First of the four nodes around a coordinate, and their weights (Lagrange, exact for cubics).
    pub(crate) fn cubic(&self, x: f32) -> (usize, [f32; 4]) {
        let (first, t) = cell((x - self.origin) * self.per_unit - 1.0, self.nodes - 4);
        (first, lagrange(t))
    }
}

/// Weights of nodes at −1, 0, 1 and 2 for a value at t, exact for cubics.
#[inline]
pub(crate) fn lagrange(t: f32) -> [f32; 4] {
    let (a, b, c, d) = (t + 1.0, t, t - 1.0, t - 2.0);
    [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0]
}

/// Values on a grid over a chart, N numbers a node.
#[derive(Clone, Debug)]
pub(crate) struct Field<const N: usize> {
    chart: Chart,
    x: Axis,
    y: Axis,
    values: Vec<[f32; N]>,
}

impl<const N: usize> Field<N> {
    /// `value` of every node's direction.
    pub(crate) fn build(chart: Chart, extent: &Extent, spacing: f64, value: impl Fn(DVec3) -> [f32; N] + Sync) -> Self {
        use rayon::prelude::*;
        let x = Axis::over(extent.low[0], extent.high[0], spacing);
        let y = Axis::over(extent.low[1], extent.high[1], spacing);
        let node = |k: usize| value(chart.direction([x.at(k % x.nodes), y.at(k / x.nodes)]));
        let values = (0..x.nodes * y.nodes).into_par_iter().map(node).collect();
        Self { chart, x, y, values }
    }

    pub(crate) fn nodes(&self) -> usize {
        self.values.len()
    }

    /// Distance of neighboring nodes along the finer axis, about radians.
    pub(crate) fn step(&self) -> f32 {
        1.0 / self.x.per_unit.max(self.y.per_unit)
    }

    pub(crate) fn at(&self, direction: Vec3) -> [f32; N] {
        let [px, py] = self.chart.project(direction);
        let ((ix, wx), (iy, wy)) = (self.x.cubic(px), self.y.cubic(py));
        let mut sum = [0.0; N];
        for (j, v) in wy.iter().enumerate() {
            let start = (iy + j) * self.x.nodes + ix;
            for (node, u) in self.values[start..start + 4].iter().zip(wx) {
                let w = u * v;
                for (s, x) in sum.iter_mut().zip(node) {
                    *s += w * x;
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_returns_what_it_was_given() {
        let chart = Chart::about(DVec3::new(0.6, 0.0, 0.8));
        for w in [DVec3::Z, DVec3::X, DVec3::new(-0.48, 0.6, 0.64)] {
            let [x, y] = chart.project(single3(w));
            assert!(chart.direction([f64::from(x), f64::from(y)]).distance(w) < 1e-6);
        }
    }

    #[test]
    fn cubic_weights_reproduce_a_cubic_to_the_ends() {
        let axis = Axis::over(-0.3, 1.2, 0.25);
        let f = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x + 3.0 * x * x * x;
        for x in [-0.3_f32, -0.11, 0.2, 0.77, 1.2] {
            let (first, w) = axis.cubic(x);
            let sum: f64 = w.iter().enumerate().map(|(k, w)| f64::from(*w) * f(axis.at(first + k))).sum();
            assert!((sum - f(f64::from(x))).abs() < 1e-5, "{x}: {sum}");
        }
    }
}
