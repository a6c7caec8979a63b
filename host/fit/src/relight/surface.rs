//! The material at a point of the plane, out of maps.

use glam::DVec2;

use crate::maps::{MaterialMaps, Plane, quantile};
use crate::material::{BANDS, Facets};

/// ρ_d (3), η, α, slopes of the normal (2).
const VALUES: usize = 7;
/// Smallest α that is drawn: below it the disk of the sun, and the texels of a map, are wider than the lobe.
const LEAST_ALPHA: f64 = 0.01;
/// Share of the samples at either end of a range that the tables need not cover.
const TAIL: f64 = 1e-3;

/// Maps to look things up in.
pub(super) struct Surface<'a> {
    maps: &'a MaterialMaps,
    answered: Vec<bool>,
}

/// At a point of the plane.
pub(super) enum Found {
    /// Outside of the maps.
    Beyond,
    /// The nearest sample has no answer.
    Unanswered,
    /// A material.
    Material(Material),
}

/// What eq. 6 needs of a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    pub(super) albedo: [f64; BANDS],
    pub(super) facets: Facets,
}

/// \[least, largest\] over the samples with an answer, but for the tails.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranges {
    pub(super) eta: [f64; 2],
    pub(super) alpha: [f64; 2],
    /// Largest |slope|.
    pub(super) slope: f64,
}

impl<'a> Surface<'a> {
    /// `refuse` are the reasons that void an answer.
    pub(super) fn new(maps: &'a MaterialMaps, refuse: u32) -> Self {
        let values = [
            Plane::AlbedoR,
            Plane::AlbedoG,
            Plane::AlbedoB,
            Plane::Eta,
            Plane::Alpha,
            Plane::NormalX,
            Plane::NormalY,
            Plane::NormalZ,
        ];
        let undetermined = [Plane::SigmaEta, Plane::SigmaAlpha, Plane::SigmaNormal];
        let answered = |i: usize| {
            maps.reasons[i] & refuse == 0
                && values.iter().all(|p| maps.plane(*p)[i].is_finite())
                && maps.plane(Plane::NormalZ)[i] > 0.0
                // Metals stand in the maps as negative numbers of their kind; what they are is not in the file.
                && maps.plane(Plane::Eta)[i] >= 1.0
                && undetermined.iter().all(|p| !maps.plane(*p)[i].is_infinite())
        };
        Self { maps, answered: (0..maps.grid.samples()).map(answered).collect() }
    }

    /// `None` without any answer.
    pub(super) fn ranges(&self) -> Option<Ranges> {
        let ends = |k: usize| -> Option<[f64; 2]> {
            let mut values: Vec<f32> = self.samples().map(|v| single(v[k])).collect();
            Some([quantile(&mut values, TAIL)?.into(), quantile(&mut values, 1.0 - TAIL)?.into()])
        };
        let (eta, alpha) = (ends(3)?, ends(4)?);
        let slope = ends(5)?.into_iter().chain(ends(6)?).map(f64::abs).fold(0.0, f64::max);
        Some(Ranges {
            eta: eta.map(|e| e.max(1.0)),
            alpha: alpha.map(|a| a.clamp(LEAST_ALPHA, 1.0)),
            // A little room: two slopes of one size make a larger one across.
            slope: (1.05 * slope + 0.01).min(5.0),
        })
    }

    /// Samples with an answer that lie outside of `ranges`.
    pub(super) fn outside(&self, ranges: &Ranges) -> usize {
        let out = |value: f64, [low, high]: [f64; 2]| value < low - 1e-6 || value > high + 1e-6;
        let slopes = [-ranges.slope, ranges.slope];
        let is_out = |v: &[f64; VALUES]| {
            out(v[3], ranges.eta) || out(v[4], ranges.alpha) || out(v[5], slopes) || out(v[6], slopes)
        };
        self.samples().filter(is_out).count()
    }

    /// Bilinear between the four samples around, of which those without an answer are left out; there is one only where the
    /// nearest has.
    pub(super) fn at(&self, point: DVec2) -> Found {
        let grid = &self.maps.grid;
        let [column, row] = grid.locate(point.to_array());
        let inside = |at: f64, count: usize| (-0.5..=count as f64 - 0.5).contains(&at);
        if !inside(column, grid.columns) || !inside(row, grid.rows) {
            return Found::Beyond;
        }
        let (columns, rows) = (around(column, grid.columns), around(row, grid.rows));
        let (mut sum, mut total, mut nearest) = ([0.0; VALUES], 0.0, (0.0, false));
        for (r, down) in rows {
            for (c, right) in columns {
                let (i, weight) = (r * grid.columns + c, right * down);
                if weight > nearest.0 {
                    nearest = (weight, self.answered[i]);
                }
                if self.answered[i] {
                    total += weight;
                    for (s, v) in sum.iter_mut().zip(self.sample(i)) {
                        *s += weight * v;
                    }
                }
            }
        }
        if !nearest.1 {
            return Found::Unanswered;
        }
        let [r, g, b, eta, alpha, x, y] = sum.map(|s| s / total);
        let facets = Facets { eta: eta.max(1.0), alpha: alpha.clamp(LEAST_ALPHA, 1.0), slope: [x, y] };
        Found::Material(Material { albedo: [r, g, b], facets })
    }

    fn samples(&self) -> impl Iterator<Item = [f64; VALUES]> {
        self.answered.iter().enumerate().filter(|(_, answered)| **answered).map(|(i, _)| self.sample(i))
    }

    fn sample(&self, i: usize) -> [f64; VALUES] {
        let at = |plane: Plane| f64::from(self.maps.plane(plane)[i]);
        let z = at(Plane::NormalZ);
        [
            at(Plane::AlbedoR),
            at(Plane::AlbedoG),
            at(Plane::AlbedoB),
            at(Plane::Eta),
            at(Plane::Alpha),
            at(Plane::NormalX) / z,
            at(Plane::NormalY) / z,
        ]
    }
}

/// The two samples around `at` with their weights; within half a cell of the edge the outermost alone.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0 .. count")]
fn around(at: f64, count: usize) -> [(usize, f64); 2] {
    let last = count - 1;
    let at = at.clamp(0.0, last as f64);
    let first = (at.floor() as usize).min(last.saturating_sub(1));
    let second = at - first as f64;
    [(first, 1.0 - second), ((first + 1).min(last), second)]
}

#[expect(clippy::cast_possible_truncation, reason = "the maps are f32")]
fn single(value: f64) -> f32 {
    value as f32
}
