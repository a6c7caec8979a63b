//! η and α shared by regions: the pass over the whole map that follows the tiles.
//!
//! Pixels that their own fit has outside the model (edges, dirt) do not vote, unless that is most of a region; they keep
//! their own answers. σ of the shared two also holds what all pixels have in common: it is how far η and α move when a
//! view's polarizer is turned, and the light scaled, by their σ.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::regions::{self, UNUSABLE};
use super::{PipelineError, Prepared};
use crate::forward::Tables;
use crate::joint::{Reasons, Region, fit_region};
use crate::maps::{MaterialMaps, Plane};
use crate::material::{Facets, Observation};
use crate::tiles::Job;

/// What the regions are.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Of each sample, row-major; from 1, 0 for none.
    pub labels: Vec<u32>,
    /// In the order of their labels.
    pub regions: Vec<RegionSummary>,
}

/// One region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionSummary {
    /// Its label.
    pub label: u32,
    /// Pixels that were fitted together.
    pub pixels: usize,
    /// η and its σ.
    pub eta: [f64; 2],
    /// α and its σ.
    pub alpha: [f64; 2],
    /// χ² over degrees of freedom.
    pub chi2_per_freedom: f64,
    /// What speaks against it.
    pub reasons: Reasons,
}

/// Pixels fitted together, at most: larger regions are cut into parts of as many, by rows.
const MOST_PIXELS: usize = 60_000;
/// Pixels that tell how far a common error moves the shared two.
const SYSTEMATIC_PIXELS: usize = 400;

/// One pixel of a region.
struct Member(Vec<Observation>);

impl AsRef<[Observation]> for Member {
    fn as_ref(&self) -> &[Observation] {
        &self.0
    }
}

impl Prepared<'_> {
    /// Replaces the answers of a finished first pass by those with shared η and α; `None` once `cancel` is true.
    ///
    /// Memory: a region's measurements at a time, some 0.5 KB a pixel.
    ///
    /// # Errors
    /// [`PipelineError::Option`] for maps of another grid, or in a mode without tables; [`PipelineError::Fit`].
    pub fn share(&self, maps: &mut MaterialMaps, cancel: &AtomicBool) -> Result<Option<Shared>, PipelineError> {
        let expected = "the maps of a joint first pass on this grid are needed";
        let Some(tables) = self.tables.as_ref().filter(|_| maps.grid == self.grid()) else {
            return Err(PipelineError::Option { option: "the grid", found: maps.grid.to_string(), expected });
        };
        let labels = regions::label(&self.options.regions, maps);
        let count = labels.iter().copied().max().unwrap_or(0);
        let mut shared = Shared { labels, regions: Vec::new() };
        for label in 1..=count {
            let all: Vec<usize> = (0..shared.labels.len()).filter(|i| shared.labels[*i] == label).collect();
            let voting: Vec<usize> = all.iter().copied().filter(|i| maps.reasons[*i] & UNUSABLE == 0).collect();
            let hopeless = |i: &usize| maps.views[*i] < 2;
            let members =
                if 2 * voting.len() >= all.len() { voting } else { all.into_iter().filter(|i| !hopeless(i)).collect() };
            for part in members.chunks(MOST_PIXELS) {
                if cancel.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let pixels = self.members(part)?;
                shared.regions.push(self.region(tables, label, part, &pixels, maps));
            }
        }
        Ok(Some(shared))
    }

    /// What the views saw of these samples, in rising order.
    fn members(&self, samples: &[usize]) -> Result<Vec<Member>, PipelineError> {
        let columns = self.grid().columns;
        let job = Job::new(self.grid(), self.options.tile, self.identity(), false)?;
        let mut out: Vec<(usize, Member)> = Vec::with_capacity(samples.len());
        for tile in (0..job.tiles()).map(|index| job.tile(index)) {
            let rows: Range<usize> = tile.row..tile.row + tile.grid.rows;
            let inside = rows.flat_map(|row| {
                let start = row * columns + tile.column;
                let from = samples.partition_point(|s| *s < start);
                let to = samples.partition_point(|s| *s < start + tile.grid.columns);
                samples[from..to].iter().copied()
            });
            let inside: Vec<usize> = inside.collect();
            if inside.is_empty() {
                continue;
            }
            let pixels = self.pixels(&tile)?;
            out.extend(inside.into_iter().map(|sample| {
                let (row, column) = (sample / columns - tile.row, sample % columns - tile.column);
                (sample, Member(pixels.get(row * tile.grid.columns + column).to_vec()))
            }));
        }
        out.sort_by_key(|(sample, _)| *sample);
        Ok(out.into_iter().map(|(_, member)| member).collect())
    }

    fn region(
        &self,
        tables: &Tables,
        label: u32,
        samples: &[usize],
        pixels: &[Member],
        maps: &mut MaterialMaps,
    ) -> RegionSummary {
        let starts: Vec<Facets> = samples.iter().map(|i| start(maps, *i)).collect();
        let mut region = fit_region(tables, pixels, &starts, &self.settings);
        let common = self.systematic(tables, pixels, &region);
        add(&mut region.covariance, 0, common);
        let limits = &self.settings.limits;
        for (sample, fit) in samples.iter().zip(&mut region.pixels) {
            add(&mut fit.covariance, 3, common);
            let sigma = fit.sigma();
            if sigma[3] > limits.eta {
                fit.reasons |= Reasons::INDEX;
            }
            if sigma[4] > limits.alpha || sigma[4] > limits.alpha_relative * fit.facets.alpha {
                fit.reasons |= Reasons::ROUGHNESS;
            }
            maps.set(*sample, fit);
        }
        RegionSummary {
            label,
            pixels: samples.len(),
            eta: [region.eta, region.covariance[0][0].sqrt()],
            alpha: [region.alpha, region.covariance[1][1].sqrt()],
            chi2_per_freedom: region.chi2 / f64::from(region.freedom.max(1)),
            reasons: region.reasons,
        }
    }

    /// Covariance of (η, α) by errors that all pixels share.
    fn systematic(&self, tables: &Tables, pixels: &[Member], region: &Region) -> [[f64; 2]; 2] {
        let every = pixels.len().div_ceil(SYSTEMATIC_PIXELS).max(1);
        let chosen = || pixels.iter().zip(&region.pixels).step_by(every);
        let starts: Vec<Facets> = chosen().map(|(_, fit)| fit.facets).collect();
        let solve = |change: &dyn Fn(&mut Observation)| {
            let changed: Vec<Member> = chosen()
                .map(|(member, _)| {
                    let mut observations = member.0.clone();
                    observations.iter_mut().for_each(change);
                    Member(observations)
                })
                .collect();
            let found = fit_region(tables, &changed, &starts, &self.settings);
            [found.eta, found.alpha]
        };
        let still = solve(&|_| {});
        let mut covariance = [[0.0; 2]; 2];
        let mut moved = |to: [f64; 2]| {
            let [a, b] = [to[0] - still[0], to[1] - still[1]];
            add(&mut covariance, 0, [[a * a, a * b], [a * b, b * b]]);
        };
        let turn = self.settings.rotation_sigma_deg.to_radians();
        if turn > 0.0 {
            (0..self.axes.len()).for_each(|view| moved(solve(&|o| turned(o, if o.view == view { turn } else { 0.0 }))));
        }
        if self.settings.light_sigma > 0.0 {
            moved(solve(&|o| scaled(o, 1.0 + self.settings.light_sigma)));
        }
        covariance
    }
}

/// Adds to the block of (η, α), which begins at `first`.
fn add<const N: usize>(covariance: &mut [[f64; N]; N], first: usize, more: [[f64; 2]; 2]) {
    for (row, more) in covariance.iter_mut().skip(first).zip(more) {
        row.iter_mut().skip(first).zip(more).for_each(|(c, more)| *c += more);
    }
}

/// From where a pixel's normal starts; η and α by the median of all.
fn start(maps: &MaterialMaps, i: usize) -> Facets {
    let [eta, alpha, x, y, z] =
        [Plane::Eta, Plane::Alpha, Plane::NormalX, Plane::NormalY, Plane::NormalZ].map(|p| f64::from(maps.plane(p)[i]));
    let slope = [x / z, y / z].map(|s| if s.is_finite() { s } else { 0.0 });
    Facets { eta, alpha, slope }
}

/// Stokes vectors with their frame turned by `angle`; the covariance stays, small as the angle is.
fn turned(observation: &mut Observation, angle: f64) {
    let (sin, cos) = (2.0 * angle).sin_cos();
    for stokes in &mut observation.stokes {
        let [s0, s1, s2] = stokes.map(f64::from);
        *stokes = [s0, cos * s1 + sin * s2, cos * s2 - sin * s1].map(single);
    }
}

fn scaled(observation: &mut Observation, by: f64) {
    observation.stokes.iter_mut().flatten().for_each(|s| *s = single(f64::from(*s) * by));
}

#[expect(clippy::cast_possible_truncation, reason = "observations are f32")]
fn single(value: f64) -> f32 {
    value as f32
}
