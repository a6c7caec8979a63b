//! How fine the grids over mirror directions must be.
//!
//! A quadratic spline errs by 0.008 h³ f'''. The third derivative is measured, as a difference over h itself, at places spread
//! over the grid and near the brightest light; h follows until the error is a share of the tolerance.

use super::build::{Maker, Workspace};
use super::chart::Extent;
use glam::Vec3;
use rayon::prelude::*;

/// Largest step: what Fresnel terms change over.
const WIDEST: f64 = 0.2;
/// Places measured, spread and near the brightest light each.
const PLACES: usize = 12;
/// Levels of α between two that are measured.
const SKIP: usize = 3;
/// √3/216: largest error of a quadratic spline for h³ f''' = 1.
const SPLINE: f64 = 0.008;

/// Steps along both axes for every level of a patch.
pub(super) fn choose(maker: &Maker<'_>, patch: usize, extent: &Extent) -> Vec<[f64; 2]> {
    let levels = maker.roughness.nodes;
    let bright = brightest(maker, extent);
    let mut measured: Vec<(usize, [f64; 2])> = Vec::new();
    let mut level = 0;
    loop {
        let alpha = maker.roughness.at(level).exp();
        let places = places(extent, &bright, alpha);
        measured.push((level, [0, 1].map(|axis| step(maker, patch, level, axis, alpha, &places))));
        if level + 1 >= levels {
            break;
        }
        level = (level + SKIP).min(levels - 1);
    }
    let between = |level: usize| {
        let after = measured.partition_point(|(l, _)| *l < level).min(measured.len() - 1);
        let (b, high) = measured[after];
        let (a, low) = measured[after.saturating_sub(1)];
        let t = if a < b { super::numbers::real(level - a) / super::numbers::real(b - a) } else { 0.0 };
        core::array::from_fn(|k| if a < b { low[k].powf(1.0 - t) * high[k].powf(t) } else { high[k] })
    };
    (0..levels).map(between).collect()
}

/// The brightest directions that can be mirrored: cells of about 2°.
fn brightest(maker: &Maker<'_>, extent: &Extent) -> Vec<[f64; 2]> {
    let mut cells: Vec<(f32, Vec3)> = Vec::new();
    maker.light.pyramid().walk(|found| {
        if found.cell.radius > 0.03 {
            return false;
        }
        cells.push((found.cell.power.iter().sum(), found.cell.direction));
        true
    });
    cells.extend(maker.light.sources().points.first().map(|(w, _)| (f32::INFINITY, w.as_vec3())));
    cells.sort_by(|a, b| b.0.total_cmp(&a.0));
    let inside = |p: &[f64; 2]| (0..2).all(|k| p[k] > extent.low[k] && p[k] < extent.high[k]);
    let all = cells.iter().map(|(_, w)| maker.mirror.project(w.as_dvec3()));
    all.filter(inside).take(3).collect()
}

/// Places spread evenly, and within some widths of the lobe around the bright ones.
fn places(extent: &Extent, bright: &[[f64; 2]], alpha: f64) -> Vec<[f64; 2]> {
    let share = |k: usize, base: f64| (super::numbers::real(k + 1) * base).fract();
    let spread = (0..PLACES).map(|k| {
        let s = [share(k, 0.754_877_666), share(k, 0.569_840_291)];
        core::array::from_fn(|a| extent.low[a] + (extent.high[a] - extent.low[a]) * s[a])
    });
    let near = bright.iter().flat_map(|b| {
        (0..PLACES / 3).map(move |k| {
            let (s, c) = (2.4 * super::numbers::real(k)).sin_cos();
            let radius = 1.5 * alpha * (super::numbers::real(k) + 0.3);
            [b[0] + radius * c, b[1] + radius * s]
        })
    });
    spread.chain(near).collect()
}

fn step(maker: &Maker<'_>, patch: usize, level: usize, axis: usize, alpha: f64, places: &[[f64; 2]]) -> f64 {
    let goal = 0.4 * maker.options.tolerance;
    let mut h = (0.5 * alpha).min(WIDEST);
    for _ in 0..4 {
        let differences: Vec<(f64, f64)> = places
            .par_iter()
            .map_init(Workspace::default, |space, place| {
                let mut at = |offset: f64| {
                    let mut moved = *place;
                    moved[axis] += offset * h;
                    maker.sample(space, patch, level, moved)
                };
                let [a, b, c, d] = [at(-1.5), at(-0.5), at(0.5), at(1.5)];
                // The worst band of each component against its own s0.
                let worst = (0..9).map(|k| {
                    let third = d[k] - 3.0 * (c[k] - b[k]) - a[k];
                    (f64::from(third.abs()), f64::from(b[k - k % 3].abs()))
                });
                worst.fold((0.0, 0.0), |m: (f64, f64), w| if w.0 > m.0 { w } else { m })
            })
            .collect();
        let floor = 0.01 * differences.iter().map(|d| d.1).fold(0.0, f64::max);
        let mut errors: Vec<f64> = differences.iter().map(|(d, s0)| SPLINE * d / s0.max(floor).max(1e-30)).collect();
        errors.sort_by(f64::total_cmp);
        // All but the worst tenth.
        let error = errors.get(errors.len() - 1 - errors.len() / 10).copied().unwrap_or(0.0);
        let ratio = (goal / error.max(1e-12)).cbrt().clamp(0.3, 2.0);
        let next = (h * ratio).min(WIDEST);
        if (0.8..1.25).contains(&(next / h)) {
            return next;
        }
        h = next;
    }
    h
}
