//! Sub-pixel refinement of where a view sees the plane, from the pictures themselves.
//!
//! Compared is what depends least on the view: ln I_min, I_min = ½ (s0 − √(s1² + s2²)) the least any polarizer passes,
//! which holds the diffuse light and little of the specular; less its local mean, over its local spread, so that
//! shading, exposure and the light's own unevenness drop out. Least squares over an affine motion in the plane and a
//! gain, Gauss-Newton with the view resampled at each step (the criterion of Evangelidis and Psarakis 2008, "Parametric
//! image alignment using enhanced correlation coefficient"). The pose stays as it is: directions do not change by a
//! pixel's worth of plane.
//!
//! Appearance does depend on the view, and that pulls too: between 56° and 10° a bumpy, textured sample of an exact
//! pose asks for 0.25 to 0.45 px. So a motion is taken only if it halves the residual, beyond chance, and is small; it
//! repairs a pose that is off by more than that, and is no finer.

use glam::{DMat3, DVec2};
use rayon::prelude::*;

use super::dense::NormalEquations;
use super::kernel::Footprint;
use super::{Interpolation, RegisteredView, Registration};
use crate::FitError;
use crate::maps::Grid;
use crate::session::homography;

/// What became of one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Its number.
    pub view: usize,
    /// Rms motion of the plane's nodes in its picture, pixels; as found, taken or not.
    pub motion_px: f64,
    /// Residual variance against the reference, in units of the local contrast, by the pose.
    pub before: f64,
    /// The same after the motion.
    pub after: f64,
    /// Whether it was taken.
    pub outcome: Result<(), Refused>,
}

/// Why a motion was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The pictures hold nothing to compare: no texture, or no overlap.
    NoTexture,
    /// It explains the pictures no better than chance and appearance would.
    NotSignificant,
    /// It is larger than what poses are off by.
    TooFar,
}

/// Nodes a side of the net on which pictures are compared, at most.
const MOST_NODES: usize = 400;
/// Local mean and spread are over ± this many nodes.
const RADIUS: usize = 7;
/// A residual variance must fall to below this share.
const SHARE: f64 = 0.5;
/// F statistic of six parameters, above which chance is out of the question.
const SIGNIFICANT: f64 = 12.0;
/// Nodes that are as good as one independent measurement: smoothing and interpolation tie neighbors together.
const TIED: f64 = 16.0;
/// Largest rms motion, pixels.
const FARTHEST_PX: f64 = 3.0;
const STEPS: usize = 12;

/// A texture on the net, row-major; NaN where there is none.
struct Texture {
    cols: usize,
    values: Vec<f64>,
}

impl Registration<'_> {
    /// Moves the other views onto view `reference` where that is clearly right; the best reference is the sharpest
    /// view, close to the normal.
    ///
    /// # Errors
    /// [`FitError::Size`] for a view that is not there, or frames that disagree.
    pub fn refine(&mut self, reference: usize) -> Result<Vec<Refinement>, FitError> {
        let views = self.views.len();
        if reference >= views {
            return Err(FitError::Size { what: "number of the reference view", found: reference, expected: views });
        }
        let net = self.grid.thinned(MOST_NODES);
        let fixed = self.views[reference].texture(&net)?;
        let others = (0..views).filter(|v| *v != reference);
        others
            .map(|number| {
                let found = self.views[number].aligned(number, &net, &fixed)?;
                if found.0.outcome.is_ok() {
                    self.views[number].homography = found.1;
                }
                Ok(found.0)
            })
            .collect()
    }
}

impl RegisteredView<'_> {
    /// The motion of this view onto `fixed`, and the homography with it.
    fn aligned(&mut self, view: usize, net: &Grid, fixed: &Texture) -> Result<(Refinement, DMat3), FitError> {
        let start = self.homography;
        let mut result = Refinement { view, motion_px: 0.0, before: 1.0, after: 1.0, outcome: Err(Refused::NoTexture) };
        let mut best = start;
        let mut count = 0.0;
        for step in 0..STEPS {
            let Some(fit) = Fit::new(net, fixed, &self.texture(net)?) else { break };
            if step == 0 {
                (result.before, result.after, count) = (fit.variance, fit.variance, fit.count);
                result.outcome = Err(Refused::NotSignificant);
            } else if fit.variance < result.after {
                (result.after, best, count) = (fit.variance, self.homography, fit.count.min(count));
            } else if step > 3 && fit.variance > 1.02 * result.after {
                break;
            }
            self.homography *= fit.motion;
            if fit.largest_nodes < 2e-3 {
                break;
            }
        }
        self.homography = start;
        result.motion_px = motion_px(net, &start, &best);
        let f = (result.before - result.after) / 6.0 / (result.after / (count / TIED));
        if result.outcome == Err(Refused::NotSignificant) && result.after < SHARE * result.before && f > SIGNIFICANT {
            result.outcome = if result.motion_px <= FARTHEST_PX { Ok(()) } else { Err(Refused::TooFar) };
        }
        Ok((result, best))
    }

    /// ln I_min of every node, smoothed, less its local mean, over its local spread.
    fn texture(&self, net: &Grid) -> Result<Texture, FitError> {
        let mut values = vec![f64::NAN; net.rows * net.columns];
        for (rows, cols) in net.squares(64) {
            let Some(window) = self.window_of(net, &rows, &cols)? else { continue };
            let lines = values.par_chunks_mut(net.columns).enumerate().skip(rows.start).take(rows.len());
            lines.for_each_init(Footprint::default, |footprint, (row, line)| {
                for col in cols.clone() {
                    let node = net.node(row, col);
                    let (found, _) = self.observe(0, net, node, &window, footprint, Interpolation::Cubic);
                    if let Some(o) = found.filter(|o| o.covariance.iter().all(|c| c[0].is_finite())) {
                        let least: f32 = o.stokes.iter().map(|[a, b, c]| a - b.hypot(*c)).sum();
                        line[col] = f64::from(least).ln();
                    }
                }
            });
        }
        Ok(Texture { cols: net.columns, values }.smoothed().normalized())
    }
}

impl Texture {
    /// Binomial over 3 × 3; NaN at the edge.
    fn smoothed(self) -> Self {
        let (cols, count) = (self.cols, self.values.len());
        let along = |values: &[f64], stride: usize| -> Vec<f64> {
            let at = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
            (0..count).map(|i| 0.25 * at(i.wrapping_sub(stride)) + 0.5 * at(i) + 0.25 * at(i + stride)).collect()
        };
        let mut values = along(&along(&self.values, 1), cols);
        // Neighbors along a row must not come from the next one.
        values
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| i % cols == 0 || i % cols == cols - 1)
            .for_each(|(_, v)| *v = f64::NAN);
        Self { cols, values }
    }

    /// (value − local mean)/(local spread + a tenth of the usual one).
    fn normalized(self) -> Self {
        let mean = self.boxed(|v| v);
        let square = self.boxed(|v| v * v);
        let spread: Vec<f64> =
            mean.values.iter().zip(&square.values).map(|(m, s)| (s - m * m).max(0.0).sqrt()).collect();
        let mut known: Vec<f64> = spread.iter().copied().filter(|s| s.is_finite()).collect();
        let middle = known.len() / 2;
        if known.is_empty() {
            return self;
        }
        let usual = *known.select_nth_unstable_by(middle, f64::total_cmp).1;
        let floor = 0.1 * usual + f64::MIN_POSITIVE;
        let values =
            self.values.iter().zip(&mean.values).zip(&spread).map(|((v, m), s)| (v - m) / (s + floor)).collect();
        Self { cols: self.cols, values }
    }

    /// Mean of f over a square of ± [`RADIUS`], NaN where it is cut: running sums along rows, then columns.
    fn boxed(&self, f: impl Fn(f64) -> f64 + Sync) -> Self {
        let (cols, rows) = (self.cols, self.values.len() / self.cols);
        let running = |line: &mut dyn Iterator<Item = f64>, length: usize| -> Vec<f64> {
            let line: Vec<f64> = line.collect();
            let side = 2 * RADIUS + 1;
            let mut out = vec![f64::NAN; length];
            for (middle, window) in line.windows(side).enumerate() {
                out[middle + RADIUS] = window.iter().sum::<f64>() / side as f64;
            }
            out
        };
        let across: Vec<f64> =
            self.values.chunks_exact(cols).flat_map(|line| running(&mut line.iter().map(|v| f(*v)), cols)).collect();
        let mut values = vec![f64::NAN; self.values.len()];
        for col in 0..cols {
            let column = running(&mut across.iter().skip(col).step_by(cols).copied(), rows);
            column.into_iter().enumerate().for_each(|(row, v)| values[row * cols + col] = v);
        }
        Self { cols, values }
    }
}

/// One step of Gauss-Newton.
struct Fit {
    /// Mean square residual of what is compared, gain fitted.
    variance: f64,
    /// How many nodes.
    count: f64,
    /// x → x + motion(x) in the plane.
    motion: DMat3,
    /// Largest motion, in nodes.
    largest_nodes: f64,
}

impl Fit {
    fn new(net: &Grid, fixed: &Texture, moved: &Texture) -> Option<Self> {
        let (rows, cols) = (net.rows, net.columns);
        let half = DVec2::new(cols as f64, rows as f64) * 0.5;
        let (mut both, mut own, mut count) = (0.0, 0.0, 0.0);
        for (a, b) in fixed.values.iter().zip(&moved.values).filter(|(a, b)| a.is_finite() && b.is_finite()) {
            (both, own, count) = (both + a * b, own + b * b, count + 1.0);
        }
        // A hundredth of the net, or nothing to go by.
        if count < 0.01 * (rows * cols) as f64 || count < 200.0 || own <= 0.0 {
            return None;
        }
        let gain = both / own;
        let mut equations = NormalEquations::<7>::new();
        let mut sum = 0.0;
        for row in 1..rows - 1 {
            for col in 1..cols - 1 {
                let i = row * cols + col;
                let (a, b) = (fixed.values[i], moved.values[i]);
                let by_col = 0.5 * (moved.values[i + 1] - moved.values[i - 1]) * gain;
                let by_row = 0.5 * (moved.values[i + cols] - moved.values[i - cols]) * gain;
                if !(a + b + by_col + by_row).is_finite() {
                    continue;
                }
                let at = (DVec2::new(col as f64, row as f64) - half) / half;
                let residual = a - gain * b;
                let line = [by_col, by_col * at.x, by_col * at.y, by_row, by_row * at.x, by_row * at.y, b];
                equations.add(&line, residual);
                sum += residual * residual;
            }
        }
        let [a, b, c, d, e, f, _] = equations.solve()?;
        // In nodes: columns by a + b x̂ + c ŷ, rows by d + e x̂ + f ŷ, (x̂, ŷ) = (node − half)/half.
        let (x, y) = (DVec2::new(1.0 + b / half.x, e / half.x), DVec2::new(c / half.y, 1.0 + f / half.y));
        let nodes = DMat3::from_cols(x.extend(0.0), y.extend(0.0), DVec2::new(a - b - c, d - e - f).extend(1.0));
        let to_plane = DMat3::from_translation(net.node(0, 0)) * DMat3::from_scale(net.step());
        let motion = to_plane * nodes * to_plane.inverse();
        let largest_nodes = [a, b, c, d, e, f].into_iter().map(f64::abs).fold(0.0, f64::max);
        Some(Self { variance: sum / count, count, motion, largest_nodes })
    }
}

/// Rms distance over the net between where two homographies see its nodes.
fn motion_px(net: &Grid, a: &DMat3, b: &DMat3) -> f64 {
    let at = |k: usize, count: usize| k * (count - 1) / 8;
    let points = (0..81).map(|k| net.node(at(k / 9, net.rows), at(k % 9, net.columns)));
    let squared = points.filter_map(|p| Some(homography::project(a, p)?.distance_squared(homography::project(b, p)?)));
    let (sum, count) = squared.fold((0.0, 0.0), |(s, n), d| (s + d, n + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}
