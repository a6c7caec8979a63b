//! The range of radiance by elevation: what is known of light whose azimuth is not.

use super::Interval;
use crate::optical::Radiance;
use crate::optical::numbers::{cell, real, single};
use core::f64::consts::FRAC_PI_2;

/// Belts of equal height between the horizon and the zenith.
const BELTS: usize = 90;

/// Range of L of one band over each belt, horizon first.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    belts: Vec<Interval>,
}

impl Profile {
    /// Formulas by their own terms: those in ω_z are monotonic, an aureole is between nothing and its largest value. A look-up in a
    /// map reaches a row farther than its direction.
    pub(crate) fn new(radiance: &Radiance) -> Self {
        let ends = |k: usize| [k, k + 1].map(|k| FRAC_PI_2 * real(k) / real(BELTS));
        let formula = |of: &dyn Fn(f64) -> f64, more: f64| {
            let belt = |k: usize| {
                let [a, b] = ends(k).map(|elevation| of(elevation.sin()));
                Interval::new(a.min(b), a.max(b) + more)
            };
            (0..BELTS).map(belt).collect()
        };
        let belts = match radiance {
            Radiance::Uniform(u) => formula(&|_| u.radiance, 0.0),
            Radiance::Overcast(o) => formula(&|z| o.zenith * (1.0 + 2.0 * z) / 3.0, 0.0),
            Radiance::Clear(c) => formula(&|z| c.base + c.horizon * (1.0 - z) * (1.0 - z), c.aureole),
            Radiance::Map(map) => {
                let (width, height) = map.size();
                let row = |row: &[[f32; 3]]| {
                    let range = row.iter().fold([f32::INFINITY, 0.0], |r, [l, ..]| [r[0].min(*l), r[1].max(*l)]);
                    Interval::new(f64::from(range[0]), f64::from(range[1]))
                };
                // A row below the horizon is reached as well.
                let rows: Vec<Interval> = map.pixels().chunks(width).take(height / 2 + 2).map(row).collect();
                let belt = |k: usize| {
                    // Row r is centered at the polar angle π (r + ½)/height.
                    let [top, bottom] = [k + 1, k].map(|k| 0.5 * real(height) * (1.0 - real(k) / real(BELTS)) - 0.5);
                    let first = cell(single(top), height - 1).0.saturating_sub(1);
                    let last = (cell(single(bottom), height - 1).0 + 2).min(rows.len() - 1);
                    rows[first..=last].iter().fold(rows[first], |a, b| a.hull(*b))
                };
                (0..BELTS).map(belt).collect()
            }
        };
        Self { belts }
    }

    /// Over elevations in radians; the sky alone.
    pub(crate) fn range(&self, elevation: Interval) -> Interval {
        let index = |e: f64| cell(single(e / FRAC_PI_2 * real(BELTS)), BELTS - 1).0;
        // 1e-6 covers the rounding of the index.
        let (first, last) = (index(elevation.low - 1e-6), index(elevation.high + 1e-6));
        self.belts[first..=last].iter().fold(self.belts[first], |a, b| a.hull(*b))
    }
}
