//! Facets spread the reflection over a lobe; left out, every pixel is a mirror (paper eq. 8), evaluated in closed form.

use crate::Assessment;
use crate::optical::bounds::{Interval, Lobe, MirrorBox};
use crate::optical::facts::Enclosure;
use crate::optical::{OpticalFacts, Radiance, Surface, SurfaceExtent};
use glam::DVec3;
use host_optics::Ior;

const COST_NS: f64 = 100.0;

/// Beyond this roughness no useful bound comes out of it; it is not tried.
const ROUGHEST: f64 = 0.05;

/// Rings of slopes with suprema of their own, as shares of the lobe's reach.
const RINGS: [f64; 7] = [0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 0.98];

/// Cells a view is cut into along each side.
const CELLS: u8 = 3;

/// The reflection is ∫ P22 G2 (1 + m·t)₊ F dm against F(0) ([`Lobe`]). For unpolarized light without edges, by rings of slopes
/// r_k whose mirrored rays all see the sky: opposite slopes cancel to first order, so that they differ by at most
/// ½ sup_k |∂²((1 + m·t)F)| ∫_k P22 |m|² dm; masking takes at most 1 − G2 of what is there; slopes beyond the last ring bring at
/// most the lobe's tail and miss at most their mass of F(0). All of an s0 of at least [`Lobe::least`]. Polarization P adds
/// P/(1 − P) on the rough side and P on the mirror's.
pub(crate) fn assess(facts: &OpticalFacts<'_>) -> Assessment {
    let roughest = facts.shown().map(|(s, _)| s.ggx.alpha()).fold(0.0, f64::max);
    let p = facts.bounds.max_dolp;
    if facts.shown().all(|(s, _)| s.is_mirror()) {
        return Assessment::new(0.0, COST_NS, "every surface is a mirror".into());
    }
    let bound = if facts.light.sun.is_some() || p >= 1.0 {
        f64::INFINITY
    } else {
        let bare = facts.worst(|surface, extent, lobe| bound(facts, surface, extent, lobe));
        let polarized = super::share(p, p);
        let smooth = if p > 0.0 { polarized + (1.0 + polarized) * (bare + p * (1.0 + bare)) } else { bare };
        smooth.min(facts.enclosed(|e| enclosed(e, p)))
    };
    Assessment::new(bound, COST_NS, format!("GGX alpha up to {roughest}"))
}

/// Of any roughness and light: the enclosures of the rough picture and of the mirror's, as far apart as they may be. s1 and s2 in the
/// frame of the pixel's plane of incidence, where a mirror has no s2 under unpolarized light; polarized light adds up to P times
/// s0 to either.
fn enclosed(e: &Enclosure, p: f64) -> f64 {
    let apart = |a: [f64; 2], b: Interval| (a[1] - b.low).max(b.high - a[0]);
    let [power, polarized] = e.mirror;
    let s0 = apart([e.lobe.least, e.lobe.most], power);
    let rest = apart(e.lobe.along, polarized).hypot(e.lobe.across) + p * (e.lobe.most + power.high);
    e.share(s0.max(rest))
}

fn bound(facts: &OpticalFacts<'_>, surface: &Surface, extent: &SurfaceExtent, lobe: &Lobe<'_>) -> f64 {
    if surface.is_mirror() {
        return 0.0;
    }
    if surface.ggx.alpha() > ROUGHEST || lobe.reach <= 0.0 || extent.view_radius > 0.5 {
        return f64::INFINITY;
    }
    let gray = surface.ior[0] == surface.ior[1] && surface.ior[1] == surface.ior[2];
    let [r, g, b] = &facts.light.radiance;
    let bands = if gray && r.proportional(g) && r.proportional(b) { 1 } else { 3 };
    let of_band = |k: usize| {
        let Ior::Dielectric(ior) = surface.ior[k] else { return f64::INFINITY };
        let mut worst = 0.0_f64;
        for cell in cells(extent) {
            worst = worst.max(of_cell(lobe, &cell, &facts.light.radiance[k], ior, k));
        }
        worst
    };
    (0..bands).map(of_band).fold(0.0, |w, b| if b.is_nan() { f64::INFINITY } else { w.max(b) })
}

fn of_cell(lobe: &Lobe<'_>, cell: &MirrorBox, radiance: &Radiance, ior: host_optics::Dielectric, k: usize) -> f64 {
    let mut least = super::least_specular(lobe, k);
    let (mut curved, mut masked) = (0.0, 0.0);
    let mut inner = 0.0;
    let mut best = f64::INFINITY;
    for share in RINGS {
        let r = share * lobe.reach;
        let Some(found) = cell.suprema(radiance, ior, r) else { break };
        least = least.max((1.0 - lobe.mass_beyond(r)) * lobe.least_masking(r) * found.least);
        curved += 0.5 * found.second * (lobe.second_within(r) - lobe.second_within(inner));
        // 1 + m·t is at most 2 within the reach.
        let mass = lobe.mass_beyond(inner) - lobe.mass_beyond(r);
        masked += 2.0 * mass * (1.0 - lobe.least_masking(r)) * found.value;
        inner = r;
        let center = lobe.mass_beyond(r) * lobe.mirror_range(0.0, k)[1];
        best = best.min((curved + masked + lobe.tail(r, k) + center) / least);
    }
    best
}

/// The views of a surface in cells, with all of its normals.
fn cells(extent: &SurfaceExtent) -> Vec<MirrorBox> {
    let (low, high) = (extent.view.low.map(f64::from), extent.view.high.map(f64::from));
    let n = f64::from(CELLS);
    let half: [f64; 2] = core::array::from_fn(|k| 0.5 * (high[k] - low[k]) / n);
    // Stereographic coordinates do not shrink lengths by more than their own square.
    let view_radius = 1.05 * half[0].hypot(half[1]) + 1e-6;
    let mut out = Vec::new();
    for i in 0..CELLS {
        for j in 0..CELLS {
            let at = [low[0] + half[0] * f64::from(2 * i + 1), low[1] + half[1] * f64::from(2 * j + 1)];
            let view: DVec3 = extent.view_chart.direction(at);
            let normal_radius = extent.normal_radius + 1e-6;
            out.push(MirrorBox { normal: extent.mean_normal, normal_radius, view, view_radius });
        }
    }
    out
}
