//! The pyramid: an integral against a lobe takes as many cells as the lobe has features and not as many as the map has
//! texels.
//!
//! A cell holds ∫ (L, Q, U) dω of three bands. (Q, U) of its texels are carried to the cell's centroid by parallel transport
//! before they are added: sky frames turn about the zenith. The centroid is weighted by radiance, so that a small sun stays
//! where it is; a sum over cells errs by the second moment of what is inside only.

use super::{Rgb, real, single, single3};
use crate::frames::transport;
use crate::sky::StokesMap;
use crate::{Frame, Light, OpticsError};
use core::f64::consts::{PI, TAU};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// One cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Unit centroid of the radiance inside.
    pub direction: Vec3,
    /// No light of the cell is farther from the centroid, radians; 0 for a texel.
    pub radius: f32,
    /// |∫ L ω dω|/∫ L dω: what a cosine over the cell falls short of the cosine at its centroid.
    pub length: f32,
    /// ∫ L dω, R, G, B.
    pub power: [f32; 3],
}

/// A cell a sum looks at.
#[derive(Clone, Copy, Debug)]
pub struct Found<'a> {
    /// Where it is and how bright.
    pub cell: &'a Cell,
    /// ∫ (Q, U) dω, R, G, B, in [`Frame::sky`] of the centroid.
    pub polarization: [[f32; 2]; 3],
}

/// Three bands of light above the world horizon, at every resolution.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// The finest first.
    levels: Vec<Level>,
    polarized: bool,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    cells: Vec<Cell>,
    /// [`Found::polarization`]; empty for unpolarized light.
    polarization: Vec<[[f32; 2]; 3]>,
}

/// One cell on its way down the pyramid.
#[derive(Clone, Copy, Debug)]
struct Place {
    level: usize,
    row: usize,
    column: usize,
}

impl Pyramid {
    /// Columns and rows over the sphere that serve a smooth formula.
    pub const FORMULA_SIZE: [usize; 2] = [256, 128];

    /// From (L, Q, U) of R, G and B at every texel of an equirectangular map of `width` × `height` over the sphere, laid out
    /// as [`StokesMap`]; asked for as (row, column, direction of the center), above the world horizon only.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] for a size without texels.
    pub fn new(
        [width, height]: [usize; 2],
        texel: impl Fn(usize, usize, DVec3) -> Rgb + Sync,
    ) -> Result<Self, OpticsError> {
        if width == 0 || height == 0 {
            return Err(OpticsError::MapSize { width, height, expected: 0, found: 0 });
        }
        let finest = Level::finest(width, height, texel);
        let polarized = !finest.polarization.is_empty();
        let mut levels = vec![finest];
        while let Some(last) = levels.last()
            && last.height > 4
        {
            let next = last.halved();
            levels.push(next);
        }
        Ok(Self { levels, polarized })
    }

    /// Of light sampled at the centers of texels.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] for a size without texels.
    pub fn sample(size: [usize; 2], bands: &[impl Light + Sync; 3]) -> Result<Self, OpticsError> {
        Self::new(size, |_, _, direction| bands.each_ref().map(|b| b.stokes(direction)))
    }

    /// Of three maps, their own texels exactly. Maps smaller than the largest are sampled at its texels.
    ///
    /// # Errors
    /// None that a [`StokesMap`] can cause.
    pub fn of_maps(bands: &[StokesMap; 3]) -> Result<Self, OpticsError> {
        let sizes = bands.each_ref().map(StokesMap::size);
        let [width, height] = sizes.iter().fold([0, 0], |[w, h], s| [w.max(s.0), h.max(s.1)]);
        Self::new([width, height], |row, column, direction| {
            bands.each_ref().map(|map| {
                if map.size() == (width, height) {
                    map.pixels()[row * width + column].map(f64::from)
                } else {
                    map.stokes(direction)
                }
            })
        })
    }

    /// Whether any Q or U differs from 0.
    #[must_use]
    pub fn polarized(&self) -> bool {
        self.polarized
    }

    /// The same light without its polarization.
    #[must_use]
    pub fn unpolarized(mut self) -> Self {
        for level in &mut self.levels {
            level.polarization = Vec::new();
        }
        self.polarized = false;
        self
    }

    /// The larger step between texels, radians.
    #[must_use]
    pub fn texel(&self) -> f64 {
        self.levels.first().map_or(0.0, |l| TAU / real(l.width.min(4 * l.height)))
    }

    /// Visits cells from the top; `visit` answers whether a cell is fine enough (and has been used) or is to be opened. Texels
    /// are not opened, whatever the answer: a visit uses a cell of radius 0. Dark cells are left out.
    pub fn walk(&self, mut visit: impl FnMut(&Found<'_>) -> bool) {
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
    fn finest(width: usize, height: usize, texel: impl Fn(usize, usize, DVec3) -> Rgb + Sync) -> Self {
        let upper = height.div_ceil(2);
        let step = TAU / real(width);
        let rows = (0..upper).into_par_iter().map(|row| {
            let [top, bottom] = [row, row + 1].map(|r| (PI * real(r) / real(height)).min(0.5 * PI));
            let (sine, cosine) = (PI * (real(row) + 0.5) / real(height)).min(0.5 * PI).sin_cos();
            let solid_angle = step * (top.cos() - bottom.cos());
            let mut cells = Vec::with_capacity(width);
            let mut polarization = Vec::with_capacity(width);
            for column in 0..width {
                let (s, c) = (step * (real(column) + 0.5)).sin_cos();
                let direction = DVec3::new(sine * c, sine * s, cosine);
                let light = texel(row, column, direction).map(|band| band.map(|x| single(x * solid_angle)));
                let power = light.map(|[l, ..]| l);
                cells.push(Cell { direction: single3(direction), radius: 0.0, length: 1.0, power });
                polarization.push(light.map(|[_, q, u]| [q, u]));
            }
            (cells, polarization)
        });
        let (cells, polarization): (Vec<_>, Vec<_>) = rows.unzip();
        let mut polarization: Vec<[[f32; 2]; 3]> = polarization.concat();
        if polarization.iter().flatten().flatten().all(|x| *x == 0.0) {
            polarization = Vec::new();
        }
        Self { width, height: upper, cells: cells.concat(), polarization }
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
