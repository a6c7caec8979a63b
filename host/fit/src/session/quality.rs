//! How good the geometry of the views is, before anything is fitted.

use glam::DVec2;

use super::homography;
use super::{Sample, Session, ViewCapture};

/// Geometry of all views.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionQuality {
    /// (θ, φ) of each view from the sample's middle, radians: angle from the normal, azimuth from +x towards +y.
    pub directions: Vec<[f64; 2]>,
    /// Share of the sample that each view sees.
    pub coverage: Vec<f64>,
    /// Every two views.
    pub pairs: Vec<ViewPair>,
    /// Share of the sample that all views see.
    pub overlap: f64,
}

/// Two views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPair {
    /// Their numbers.
    pub views: [usize; 2],
    /// Angle between their planes of incidence on the mean normal, radians, in [0, π/2]: 0 where both AoLPs say the
    /// same of the normal; also 0 for a view along the normal, whose plane is none.
    pub separation: f64,
    /// Rms of the normal per rms of AoLP, sin θ √2/sin(separation) with the larger θ: 1.2 at 56° and 90°; infinite for
    /// views that are parallel.
    pub normal_gain: f64,
    /// Share of the sample both see.
    pub overlap: f64,
}

impl ViewPair {
    /// Above this gain two views alone do not hold a normal: they are less than 15° apart, as planes.
    pub const LARGEST_GAIN: f64 = 4.5;

    /// Whether the AoLPs of the two hardly hold the normal together.
    #[must_use]
    pub fn too_parallel(&self) -> bool {
        self.normal_gain > Self::LARGEST_GAIN
    }
}

/// The sample is looked at on a net of this many points a side.
const NET: usize = 33;

impl Session {
    /// Measures the geometry of the views.
    #[must_use]
    pub fn quality(&self) -> SessionQuality {
        let middle =
            DVec2::new(0.5 * (self.sample.x[0] + self.sample.x[1]), 0.5 * (self.sample.y[0] + self.sample.y[1]));
        let towards: Vec<_> = self.views.iter().map(|v| v.camera.towards(middle)).collect();
        let seen: Vec<Vec<bool>> = self.views.iter().map(|v| seen(v, &self.sample)).collect();
        let share = |of: &dyn Fn(usize) -> bool| (0..NET * NET).filter(|i| of(*i)).count() as f64 / (NET * NET) as f64;
        let pairs = (0..self.views.len()).flat_map(|a| (a + 1..self.views.len()).map(move |b| (a, b)));
        let pair = |(a, b): (usize, usize)| {
            let (p, q) = (towards[a].truncate(), towards[b].truncate());
            let sine = p.perp_dot(q).abs() / (p.length() * q.length());
            let sine = if sine.is_finite() { sine.min(1.0) } else { 0.0 };
            ViewPair {
                views: [a, b],
                separation: sine.asin(),
                normal_gain: p.length().max(q.length()) * std::f64::consts::SQRT_2 / sine,
                overlap: share(&|i| seen[a][i] && seen[b][i]),
            }
        };
        SessionQuality {
            directions: towards.iter().map(|w| [w.x.hypot(w.y).atan2(w.z), w.y.atan2(w.x)]).collect(),
            coverage: seen.iter().map(|s| share(&|i| s[i])).collect(),
            pairs: pairs.map(pair).collect(),
            overlap: share(&|i| seen.iter().all(|s| s[i])),
        }
    }
}

/// Which points of the net a view has in its picture.
fn seen(view: &ViewCapture, sample: &Sample) -> Vec<bool> {
    let h = view.camera.plane_to_pixel();
    let [width, height] = view.camera.size();
    let limit = DVec2::new(width as f64, height as f64);
    let at = |[a, b]: [f64; 2], i: usize| a + (b - a) * i as f64 / (NET - 1) as f64;
    let inside = |i: usize| {
        let point = DVec2::new(at(sample.x, i % NET), at(sample.y, i / NET));
        homography::project(&h, point).is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(limit).all())
    };
    (0..NET * NET).map(inside).collect()
}
