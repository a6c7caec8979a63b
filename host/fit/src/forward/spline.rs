//! Quadratic B-splines on equally spaced nodes: three nodes a coordinate, continuous slope, error 0.008 h³ f'''.

use super::numbers::{count_above, nearest, real, single};

/// First of the three nodes, their weights, and the weights' derivatives by the coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) first: usize,
    pub(super) weights: [f32; 3],
    pub(super) slopes: [f32; 3],
}

/// Equally spaced nodes along one coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    origin: f64,
    step: f64,
    pub(super) nodes: usize,
}

impl Axis {
    /// Nodes at most `step` apart over [low, high] and `margin` beyond each end (at least one, which splines need).
    pub(super) fn over([low, high]: [f64; 2], step: f64, margin: usize) -> Self {
        let cells = count_above((high - low) / step);
        let step = ((high - low) / real(cells)).max(1e-9);
        Self { origin: low - real(margin) * step, step, nodes: cells + 1 + 2 * margin }
    }

    pub(super) fn at(&self, node: usize) -> f64 {
        self.origin + real(node) * self.step
    }

    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// Held at the ends.
    pub(super) fn place(&self, x: f64) -> Place {
        let (node, t) = nearest((x - self.origin) / self.step, 1, self.nodes - 2);
        let (before, after) = (0.5 - t, 0.5 + t);
        let weights = [0.5 * before * before, 0.75 - t * t, 0.5 * after * after].map(single);
        let slopes = [-before, -2.0 * t, after].map(|s| single(s / self.step));
        Place { first: node - 1, weights, slopes }
    }
}

/// Turns values at `count` nodes, each of `width` numbers and `stride` apart, into coefficients of the spline through them:
/// c₋/8 + 6c/8 + c₊/8 = v, the two ends held.
pub(super) fn interpolate(values: &mut [f32], count: usize, width: usize, stride: usize) {
    if count < 3 {
        return;
    }
    // Elimination downwards: every row but the ends reads (1, 6, 1) c = 8 v.
    let mut factors = vec![0.0_f32; count];
    for k in 1..count - 1 {
        let pivot = 1.0 / (6.0 - factors[k - 1]);
        factors[k] = pivot;
        for i in 0..width {
            values[k * stride + i] = (8.0 * values[k * stride + i] - values[(k - 1) * stride + i]) * pivot;
        }
    }
    for k in (1..count - 1).rev() {
        for i in 0..width {
            values[k * stride + i] -= factors[k] * values[(k + 1) * stride + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_goes_through_its_nodes_and_errs_as_the_cube_of_its_step() {
        let f = |x: f64| (2.0 * x).sin();
        let mut last = f64::INFINITY;
        for step in [0.2, 0.1, 0.05] {
            let axis = Axis::over([-1.0, 1.0], step, 3);
            let mut c: Vec<f32> = (0..axis.nodes).map(|k| single(f(axis.at(k)))).collect();
            interpolate(&mut c, axis.nodes, 1, 1);
            let (mut worst, mut slope_worst) = (0.0_f64, 0.0_f64);
            for k in 0..=400 {
                let x = -1.0 + 0.005 * f64::from(k);
                let at = axis.place(x);
                let sum = |w: [f32; 3]| -> f64 { (0..3).map(|j| f64::from(w[j] * c[at.first + j])).sum() };
                worst = worst.max((sum(at.weights) - f(x)).abs());
                slope_worst = slope_worst.max((sum(at.slopes) - 2.0 * (2.0 * x).cos()).abs());
            }
            assert!(worst < 0.0085 * 8.0 * step.powi(3) + 1e-6 && worst < 0.3 * last, "{step}: {worst}");
            assert!(slope_worst < 8.0 * step * step, "{step}: {slope_worst}");
            last = worst;
        }
    }
}
