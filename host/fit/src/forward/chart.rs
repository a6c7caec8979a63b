//! Charts of the sphere: stereographic about a center, smooth but at the antipode, so that no interpolation meets a pole of a
//! frame. Small distances are radians at the center.

use glam::DVec3;

/// Stereographic coordinates about `center`, the first one along `x`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    x: DVec3,
    y: DVec3,
    center: DVec3,
}

impl Chart {
    /// `x` need not lie across the unit `center`; where it lies along it, any direction serves.
    pub(super) fn about(center: DVec3, x: DVec3) -> Self {
        let x = (x - center * x.dot(center)).try_normalize().unwrap_or_else(|| center.any_orthonormal_vector());
        Self { x, y: center.cross(x), center }
    }

    pub(super) fn direction(&self, [x, y]: [f64; 2]) -> DVec3 {
        let (x, y) = (0.5 * x, 0.5 * y);
        let k = x * x + y * y;
        (self.x * (2.0 * x) + self.y * (2.0 * y) + self.center * (1.0 - k)) / (1.0 + k)
    }

    pub(super) fn project(&self, w: DVec3) -> [f64; 2] {
        let scale = 2.0 / self.depth(w);
        [w.dot(self.x) * scale, w.dot(self.y) * scale]
    }

    /// The place of `w` and its changes for two changes of `w`: [place, by first, by second].
    pub(super) fn project_with(&self, w: DVec3, by: [DVec3; 2]) -> [[f64; 2]; 3] {
        let inverse = 1.0 / self.depth(w);
        let place = [w.dot(self.x), w.dot(self.y)].map(|p| 2.0 * inverse * p);
        let change = |d: DVec3| {
            let shrink = d.dot(self.center) * inverse;
            [2.0 * inverse * d.dot(self.x) - place[0] * shrink, 2.0 * inverse * d.dot(self.y) - place[1] * shrink]
        };
        [place, change(by[0]), change(by[1])]
    }

    /// The antipode itself is taken to a far, finite place.
    fn depth(&self, w: DVec3) -> f64 {
        (1.0 + w.dot(self.center)).max(1e-3)
    }
}

/// Smallest box around points of a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Extent {
    pub(super) const EMPTY: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    pub(super) fn add(&mut self, p: [f64; 2]) {
        for ((low, high), p) in self.low.iter_mut().zip(&mut self.high).zip(p) {
            *low = low.min(p);
            *high = high.max(p);
        }
    }

    pub(super) fn half(&self, axis: usize) -> f64 {
        0.5 * (self.high[axis] - self.low[axis])
    }

    pub(super) fn middle(&self, axis: usize) -> f64 {
        0.5 * (self.high[axis] + self.low[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_returns_what_it_was_given_and_knows_its_slope() {
        let chart = Chart::about(DVec3::new(0.6, 0.0, 0.8), DVec3::Z);
        for w in [DVec3::Z, DVec3::X, DVec3::new(-0.48, 0.6, 0.64)] {
            let place = chart.project(w);
            assert!(chart.direction(place).distance(w) < 1e-14);
            let (t, b) = w.any_orthonormal_pair();
            let [same, by_t, by_b] = chart.project_with(w, [t, b]);
            assert!((same[0] - place[0]).abs() < 1e-15);
            for (d, by) in [(t, by_t), (b, by_b)] {
                let h = 1e-6;
                let (high, low) = (chart.project((w + d * h).normalize()), chart.project((w - d * h).normalize()));
                for k in 0..2 {
                    assert!(((high[k] - low[k]) / (2.0 * h) - by[k]).abs() < 1e-8);
                }
            }
        }
        let poles = Chart::about(DVec3::Z, DVec3::Z);
        assert!(poles.project(-DVec3::Z).iter().all(|p| p.is_finite()));
    }
}
