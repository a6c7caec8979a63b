//! Stokes light prefiltered: a pyramid over the sky whose cells carry what arrives through them, so that an integral against
//! a lobe takes as many cells as the lobe has features and not as many as the map has texels.
//!
//! A cell holds ∫ (L, Q, U) dω of three bands. (Q, U) of its texels are carried to the cell's centroid by parallel transport
//! before they are added: sky frames turn about the zenith. The centroid is weighted by radiance, so that a small sun stays where
//! it is; a sum over cells errs by the second moment of what is inside only.

use super::light::BandLight;
use super::numbers::{real, single, single3};
use core::f64::consts::{PI, TAU};
use glam::{DVec3, Vec3};
use host_optics::frames::transport;
use host_optics::{Frame, Light};
use rayon::prelude::*;

/// Rows over the sphere and columns at which a formula is sampled; a map keeps its own size.
const FORMULA_SIZE: [usize; 2] = [128, 256];

/// Bands of one cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// Unit centroid of the radiance inside.
    pub(crate) direction: Vec3,
    /// No light of the cell is farther from the centroid, radians; 0 for a texel.
    pub(crate) radius: f32,
    /// |∫ L ω dω|/∫ L dω: what a cosine over the cell falls short of the cosine at its centroid.
    pub(crate) length: f32,
    /// ∫ L dω, R, G, B.
    pub(crate) power: [f32; 3],
}

/// The pyramid. Level 0 is the finest.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    polarized: bool,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    cells: Vec<Cell>,
    /// ∫ (Q, U) dω, R, G, B, in the sky frame of the centroid; empty for unpolarized light.
    polarization: Vec<[[f32; 2]; 3]>,
}

/// One cell on its way down the pyramid.
#[derive(Clone, Copy, Debug)]
struct Place {
    level: usize,
    row: usize,
    column: usize,
}

/// A cell a sum stopped at.
pub(crate) struct Found<'a> {
    pub(crate) cell: &'a Cell,
    pub(crate) polarization: [[f32; 2]; 3],
}

impl Pyramid {
    /// Of the sky above the world horizon.
    pub(crate) fn new(bands: &[BandLight<'_>; 3]) -> Self {
        let polarized = bands.iter().any(BandLight::polarized);
        let [mut height, mut width] = FORMULA_SIZE;
        for (w, h) in bands.iter().filter_map(BandLight::map).map(host_optics::sky::StokesMap::size) {
            (width, height) = (width.max(w), height.max(h));
        }
        let mut levels = vec![Level::finest(bands, width, height, polarized)];
        while let Some(last) = levels.last()
            && last.height > 4
        {
            let next = last.halved();
            levels.push(next);
        }
        Self { levels, polarized }
    }

    pub(crate) fn polarized(&self) -> bool {
        self.polarized
    }

    /// Visits cells from the top; `visit` answers whether a cell is fine enough (and has been used) or is to be opened.
    pub(crate) fn walk(&self, mut visit: impl FnMut(&Found<'_>) -> bool) {
        let Some(top) = self.levels.len().checked_sub(1) else { return };
        // Depth first with at most three siblings waiting per level.
        let mut open: Vec<Place> = Vec::with_capacity(4 * self.levels.len() + 64);
        for row in 0..self.levels[top].height {
            for column in 0..self.levels[top].width {
                open.push(Place { level: top, row, column });
            }
        }
        while let Some(at) = open.pop() {
            let level = &self.levels[at.level];
            let index = at.row * level.width + at.column;
            let cell = &level.cells[index];
            if cell.power.iter().all(|p| *p <= 0.0) {
                continue;
            }
            let polarization = if self.polarized { level.polarization[index] } else { [[0.0; 2]; 3] };
            if visit(&Found { cell, polarization }) || at.level == 0 {
                continue;
            }
            let below = &self.levels[at.level - 1];
            for row in 2 * at.row..(2 * at.row + 2).min(below.height) {
                for column in 2 * at.column..(2 * at.column + 2).min(below.width) {
                    open.push(Place { level: at.level - 1, row, column });
                }
            }
        }
    }
}

impl Level {
    fn finest(bands: &[BandLight<'_>; 3], width: usize, height: usize, polarized: bool) -> Self {
        let upper = height.div_ceil(2);
        let step = TAU / real(width);
        let rows = (0..upper).into_par_iter().map(|row| {
            let [top, bottom] = [row, row + 1].map(|r| (PI * real(r) / real(height)).min(0.5 * PI));
            let (sine, cosine) = (PI * (real(row) + 0.5) / real(height)).min(0.5 * PI).sin_cos();
            let solid_angle = step * (top.cos() - bottom.cos());
            let mut cells = Vec::with_capacity(width);
            let mut polarization = Vec::with_capacity(if polarized { width } else { 0 });
            for column in 0..width {
                let (s, c) = (step * (real(column) + 0.5)).sin_cos();
                let direction = DVec3::new(sine * c, sine * s, cosine);
                let light = bands.each_ref().map(|b| {
                    let texel = b.texel(row, column, width, height);
                    let light = texel.map_or_else(|| b.stokes(direction), |own| b.with_radiance(own, direction));
                    light.map(|x| single(x * solid_angle))
                });
                cells.push(Cell {
                    direction: single3(direction),
                    radius: 0.0,
                    length: 1.0,
                    power: light.map(|[l, ..]| l),
                });
                if polarized {
                    polarization.push(light.map(|[_, q, u]| [q, u]));
                }
            }
            (cells, polarization)
        });
        let (cells, polarization): (Vec<_>, Vec<_>) = rows.unzip();
        Self { width, height: upper, cells: cells.concat(), polarization: polarization.concat() }
    }

    /// Two by two cells into one.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut cells = Vec::with_capacity(width * height);
        let mut polarization = Vec::with_capacity(if self.polarization.is_empty() { 0 } else { width * height });
        for row in 0..height {
            for column in 0..width {
                let children = [(0, 0), (0, 1), (1, 0), (1, 1)]
                    .map(|(r, c)| (2 * row + r, 2 * column + c))
                    .into_iter()
                    .filter(|(r, c)| *r < self.height && *c < self.width)
                    .map(|(r, c)| r * self.width + c);
                let (cell, turned) = self.merged(children);
                cells.push(cell);
                if !self.polarization.is_empty() {
                    polarization.push(turned);
                }
            }
        }
        Self { width, height, cells, polarization }
    }

    fn merged(&self, children: impl Iterator<Item = usize> + Clone) -> (Cell, [[f32; 2]; 3]) {
        let mut power = [0.0_f32; 3];
        let mut moment = DVec3::ZERO;
        for child in children.clone().map(|k| &self.cells[k]) {
            for (sum, p) in power.iter_mut().zip(child.power) {
                *sum += p;
            }
            moment += child.direction.as_dvec3() * f64::from(child.length * child.power.iter().sum::<f32>());
        }
        let all = f64::from(power.iter().sum::<f32>());
        let length = if all > 0.0 { single(moment.length() / all) } else { 1.0 };
        let direction = moment.try_normalize().unwrap_or(DVec3::Z);
        let mut radius = 0.0_f64;
        let mut polarization = [[0.0_f64; 2]; 3];
        let frame = Frame::sky(direction);
        for k in children {
            let child = &self.cells[k];
            if child.power.iter().all(|p| *p <= 0.0) {
                continue;
            }
            let from = child.direction.as_dvec3();
            radius = radius.max(from.distance(direction) * 1.05 + f64::from(child.radius));
            if let Some(bands) = self.polarization.get(k) {
                let axis = transport(Frame::sky(from).x, from, direction);
                let turn = frame.turn_to(axis);
                for (sum, qu) in polarization.iter_mut().zip(bands) {
                    let [q, u] = turn.apply(qu.map(f64::from));
                    *sum = [sum[0] + q, sum[1] + u];
                }
            }
        }
        let cell = Cell { direction: single3(direction), radius: single(radius), length, power };
        (cell, polarization.map(|qu| qu.map(single)))
    }
}
