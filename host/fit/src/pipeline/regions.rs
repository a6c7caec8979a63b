//! Which pixels are one material: by a mask, or by what a first pass found.
//!
//! Clusters: a single pixel's η and α are mostly noise, so each is first replaced by the median of the sound pixels around
//! it. What is compared is the hue of ρ_d (its shares of red and green; not its brightness, which texture changes), η and
//! ln α, each in units of what materials differ by, or of what the medians scatter by where that is more. Centers are the
//! fullest cells of a histogram, one after the other, each with all within reach of it taken out; then the medians of
//! their pixels, a few times over.

use std::collections::BTreeMap;

use host_image::{Picture, Samples};
use rayon::prelude::*;

use super::Regions;
use crate::joint::Reasons;
use crate::maps::{Grid, MaterialMaps, Plane, quantile};

/// What keeps a pixel from telling about its region.
pub(super) const UNUSABLE: u32 = Reasons::BAD_INPUT.0
    | Reasons::TOO_DARK.0
    | Reasons::ONE_VIEW.0
    | Reasons::TOO_FEW_DATA.0
    | Reasons::NO_MODEL.0
    | Reasons::OUTSIDE_MODEL.0;

/// Medians are over ± this many samples.
const RADIUS: usize = 3;
/// Materials differ by this much, at least, in the shares of red and green, η and ln α.
const SCALE: [f32; FEATURES] = [0.03, 0.03, 0.08, 0.3];
/// A center reaches this far, in scales.
const REACH: f32 = 1.5;
/// Regions are at least this share of the usable samples, and this many.
const LEAST: (f64, usize) = (0.004, 30);
const MOST_REGIONS: usize = 64;
const ROUNDS: usize = 5;
const FEATURES: usize = 4;

type Feature = [f32; FEATURES];

/// The region of each sample of the grid, from 1; 0 for none.
pub(super) fn label(regions: &Regions, maps: &MaterialMaps) -> Vec<u32> {
    match regions {
        Regions::One => vec![1; maps.grid.samples()],
        Regions::Mask(picture) => masked(picture, &maps.grid),
        Regions::Clusters => clustered(maps),
    }
}

/// Values of the picture, each its own region, in their order.
fn masked(picture: &Picture, grid: &Grid) -> Vec<u32> {
    let bits = |i: usize| match &picture.samples {
        Samples::U8(v) => u32::from(v[i]),
        Samples::U16(v) => u32::from(v[i]),
        Samples::F32(v) => v[i].max(0.0).to_bits(),
    };
    let at = |i: usize| {
        let row = (2 * (i / grid.columns) + 1) * picture.height / (2 * grid.rows);
        let column = (2 * (i % grid.columns) + 1) * picture.width / (2 * grid.columns);
        bits((row * picture.width + column) * picture.channels)
    };
    let values: Vec<u32> = (0..grid.samples()).map(at).collect();
    let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
    values.iter().filter(|v| **v != 0).for_each(|v| {
        numbers.insert(*v, 0);
    });
    numbers.values_mut().zip(1..).for_each(|(number, k)| *number = k);
    values.iter().map(|v| numbers.get(v).copied().unwrap_or(0)).collect()
}

fn clustered(maps: &MaterialMaps) -> Vec<u32> {
    let single = singles(maps);
    let smooth = medians(&single, maps.grid.columns);
    let scale = scales(maps);
    let points: Vec<Option<Feature>> =
        smooth.iter().map(|f| f.map(|f| std::array::from_fn(|k| f[k] / scale[k]))).collect();
    let mut centers = peaks(&points);
    for _ in 0..ROUNDS {
        let members = |number: usize| {
            points.iter().flatten().filter(|p| nearest(&centers, p) == Some(number)).copied().collect::<Vec<_>>()
        };
        centers = (0..centers.len()).into_par_iter().map(members).filter_map(|m| middle(&m)).collect();
    }
    let number = |p: &Feature| nearest(&centers, p).and_then(|n| u32::try_from(n + 1).ok());
    points.par_iter().map(|p| p.as_ref().and_then(number).unwrap_or(0)).collect()
}

/// Of each usable sample by itself.
fn singles(maps: &MaterialMaps) -> Vec<Option<Feature>> {
    let [r, g, b, eta, alpha] =
        [Plane::AlbedoR, Plane::AlbedoG, Plane::AlbedoB, Plane::Eta, Plane::Alpha].map(|plane| maps.plane(plane));
    (0..maps.grid.samples())
        .map(|i| {
            let sum = (r[i] + g[i] + b[i]).max(1e-3);
            let feature = [r[i] / sum, g[i] / sum, eta[i], alpha[i].ln()];
            let sound = maps.reasons[i] & UNUSABLE == 0 && eta[i] > 0.0 && feature.iter().all(|x| x.is_finite());
            sound.then_some(feature)
        })
        .collect()
}

/// Of the sound samples around each sample that has a good part of them.
fn medians(single: &[Option<Feature>], columns: usize) -> Vec<Option<Feature>> {
    let rows = single.len() / columns.max(1);
    let around = |i: usize| {
        let (row, column) = (i / columns, i % columns);
        let span = |at: usize, end: usize| at.saturating_sub(RADIUS)..(at + RADIUS + 1).min(end);
        let window: Vec<Feature> = span(row, rows)
            .flat_map(|r| span(column, columns).map(move |c| r * columns + c))
            .filter_map(|k| single[k])
            .collect();
        (window.len() > RADIUS * RADIUS).then(|| middle(&window)).flatten()
    };
    (0..single.len()).into_par_iter().map(around).collect()
}

/// The median of each feature.
fn middle(of: &[Feature]) -> Option<Feature> {
    let mut out = [0.0; FEATURES];
    for (k, x) in out.iter_mut().enumerate() {
        *x = quantile(&mut of.iter().map(|f| f[k]).collect::<Vec<_>>(), 0.5)?;
    }
    Some(out)
}

/// What features differ by: medians of so many samples scatter by some σ/5.
fn scales(maps: &MaterialMaps) -> Feature {
    let median =
        |values: Vec<f32>| quantile(&mut values.into_iter().filter(|v| v.is_finite()).collect::<Vec<_>>(), 0.5);
    let relative = maps.plane(Plane::SigmaAlpha).iter().zip(maps.plane(Plane::Alpha)).map(|(s, a)| s / a).collect();
    let eta = median(maps.plane(Plane::SigmaEta).to_vec()).unwrap_or(0.0);
    let alpha = median(relative).unwrap_or(0.0);
    [SCALE[0], SCALE[1], SCALE[2].max(0.5 * eta.min(0.4)), SCALE[3].max(0.5 * alpha.min(2.0))]
}

fn distance(a: &Feature, b: &Feature) -> f32 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

fn nearest(centers: &[Feature], to: &Feature) -> Option<usize> {
    let each = centers.iter().map(|c| distance(c, to)).enumerate();
    each.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(number, _)| number)
}

/// Centers, fullest first.
fn peaks(points: &[Option<Feature>]) -> Vec<Feature> {
    let mut left: Vec<Feature> = points.iter().flatten().copied().collect();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
    let least = LEAST.1.max((LEAST.0 * left.len() as f64) as usize);
    let mut centers = Vec::new();
    while left.len() >= least && centers.len() < MOST_REGIONS {
        let mut cells: BTreeMap<[i64; FEATURES], Vec<Feature>> = BTreeMap::new();
        #[expect(clippy::cast_possible_truncation, reason = "cells of features of some tens; the cast saturates")]
        left.iter().for_each(|p| cells.entry(p.map(|x| x.floor() as i64)).or_default().push(*p));
        // Of equally full cells the first in order.
        let fullest =
            cells.values().fold(&[] as &[Feature], |best, cell| if cell.len() > best.len() { cell } else { best });
        let Some(center) = middle(fullest) else { break };
        let before = left.len();
        left.retain(|p| distance(p, &center) > REACH * REACH);
        if before - left.len() >= least {
            centers.push(center);
        } else if before == left.len() || before - left.len() < least && fullest.len() < least / 4 + 1 {
            break;
        }
    }
    if centers.is_empty() {
        centers.extend(middle(&points.iter().flatten().copied().collect::<Vec<_>>()));
    }
    centers
}
