//! Maps of material: what the fit found for every sample of a grid, plane by plane.
//!
//! - Planes are row-major rows × columns, rows run *down*; [`Grid`] says where the samples lie.
//! - Normals are unit vectors of the world (x, y, z; the plane is z = 0, its mean normal +z).
//! - NaN is "not fitted"; an infinite σ "fitted, but not determined". Neither is an answer.

mod error;
mod exr;
mod grid;
mod preview;
mod statistics;

use std::collections::BTreeMap;

pub use error::MapsError;
pub use grid::{Grid, PlaneRect};
pub use preview::MapPreview;
pub(crate) use statistics::quantile;
pub use statistics::{MapStatistics, Spread};

use crate::joint::{Fit, Reasons};

/// Numbers of the upper triangle of a 7 × 7 covariance.
pub const COVARIANCES: usize = 28;

/// A plane of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Plane {
    /// ρ_d of red.
    AlbedoR,
    /// ρ_d of green.
    AlbedoG,
    /// ρ_d of blue.
    AlbedoB,
    /// Index of refraction.
    Eta,
    /// GGX α.
    Alpha,
    /// x of the normal.
    NormalX,
    /// y of the normal.
    NormalY,
    /// z of the normal.
    NormalZ,
    /// σ of ρ_d of red.
    SigmaAlbedoR,
    /// σ of ρ_d of green.
    SigmaAlbedoG,
    /// σ of ρ_d of blue.
    SigmaAlbedoB,
    /// σ of η.
    SigmaEta,
    /// σ of α.
    SigmaAlpha,
    /// σ of the normal, degrees: rms angle over both directions across it.
    SigmaNormal,
    /// χ² at the minimum.
    Chi2,
    /// η of the second minimum; NaN where there is none.
    SecondEta,
    /// α of the second minimum; NaN where there is none.
    SecondAlpha,
}

impl Plane {
    /// All, in the order of their numbers.
    pub const ALL: [Self; 17] = [
        Self::AlbedoR,
        Self::AlbedoG,
        Self::AlbedoB,
        Self::Eta,
        Self::Alpha,
        Self::NormalX,
        Self::NormalY,
        Self::NormalZ,
        Self::SigmaAlbedoR,
        Self::SigmaAlbedoG,
        Self::SigmaAlbedoB,
        Self::SigmaEta,
        Self::SigmaAlpha,
        Self::SigmaNormal,
        Self::Chi2,
        Self::SecondEta,
        Self::SecondAlpha,
    ];

    /// Name of the channel in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AlbedoR => "albedo.R",
            Self::AlbedoG => "albedo.G",
            Self::AlbedoB => "albedo.B",
            Self::Eta => "eta",
            Self::Alpha => "alpha",
            Self::NormalX => "normal.X",
            Self::NormalY => "normal.Y",
            Self::NormalZ => "normal.Z",
            Self::SigmaAlbedoR => "sigma.albedo.R",
            Self::SigmaAlbedoG => "sigma.albedo.G",
            Self::SigmaAlbedoB => "sigma.albedo.B",
            Self::SigmaEta => "sigma.eta",
            Self::SigmaAlpha => "sigma.alpha",
            Self::SigmaNormal => "sigma.normal",
            Self::Chi2 => "chi2",
            Self::SecondEta => "second.eta",
            Self::SecondAlpha => "second.alpha",
        }
    }
}

/// What the fit found, per sample of a grid.
#[derive(Clone, Debug)]
pub struct MaterialMaps {
    /// Where the samples lie.
    pub grid: Grid,
    /// By [`Plane`].
    floats: Vec<Vec<f32>>,
    /// Upper triangle, row by row, in the order of [`crate::joint::PARAMETERS`]; 28 planes or none.
    pub covariance: Vec<Vec<f32>>,
    /// Measurements less parameters.
    pub freedom: Vec<u32>,
    /// Views that had data.
    pub views: Vec<u32>,
    /// Bits of [`Reasons`].
    pub reasons: Vec<u32>,
    /// Name of each bit of `reasons`, from bit 0; none has a comma.
    pub reason_names: Vec<String>,
    /// What else a file should say, by name: settings, source, program. `grid`, `reasons`, `schema` and `convention` are
    /// taken.
    pub attributes: BTreeMap<String, String>,
}

impl MaterialMaps {
    /// Nothing fitted yet; `covariance` also keeps the 28 numbers per sample, which more than doubles the memory.
    #[must_use]
    pub fn new(grid: Grid, covariance: bool) -> Self {
        let n = grid.samples();
        let nan = |planes: usize| (0..planes).map(|_| vec![f32::NAN; n]).collect();
        Self {
            grid,
            floats: nan(Plane::ALL.len()),
            covariance: nan(if covariance { COVARIANCES } else { 0 }),
            freedom: vec![0; n],
            views: vec![0; n],
            reasons: vec![0; n],
            reason_names: reason_names(),
            attributes: BTreeMap::new(),
        }
    }

    /// Takes over the answer for sample `index` (row · columns + column); outside the grid nothing happens.
    #[expect(clippy::cast_possible_truncation, reason = "maps are f32")]
    pub fn set(&mut self, index: usize, fit: &Fit) {
        if index >= self.grid.samples() {
            return;
        }
        let normal = fit.facets.normal();
        let [r, g, b] = fit.albedo;
        let [sr, sg, sb, s_eta, s_alpha, ..] = fit.sigma();
        let [eta, alpha] = fit.second.map_or([f64::NAN; 2], |s| [s.facets.eta, s.facets.alpha]);
        let facets = fit.facets;
        let values = [r, g, b, facets.eta, facets.alpha, normal.x, normal.y, normal.z];
        let sigmas = [sr, sg, sb, s_eta, s_alpha, fit.normal_sigma_deg];
        let rest = [fit.chi2, eta, alpha];
        for (plane, value) in self.floats.iter_mut().zip(values.into_iter().chain(sigmas).chain(rest)) {
            plane[index] = value as f32;
        }
        let triangle = (0..7).flat_map(|i| (i..7).map(move |j| (i, j)));
        for (plane, (i, j)) in self.covariance.iter_mut().zip(triangle) {
            plane[index] = fit.covariance[i][j] as f32;
        }
        self.freedom[index] = fit.freedom;
        self.views[index] = fit.views;
        self.reasons[index] = fit.reasons.0;
    }

    /// A plane, row-major rows × columns.
    #[must_use]
    pub fn plane(&self, plane: Plane) -> &[f32] {
        &self.floats[plane as usize]
    }

    /// A plane to write to; its length stays.
    pub fn plane_mut(&mut self, plane: Plane) -> &mut [f32] {
        &mut self.floats[plane as usize]
    }

    /// η and α of the second minimum of a sample that has one.
    #[must_use]
    pub fn second(&self, index: usize) -> Option<[f32; 2]> {
        let at = |plane| self.plane(plane).get(index).copied().filter(|v| !v.is_nan());
        Some([at(Plane::SecondEta)?, at(Plane::SecondAlpha)?])
    }

    /// Whether two maps hold the same bits (NaN included), names and attributes.
    #[must_use]
    pub fn same_bits(&self, other: &Self) -> bool {
        let same = |(a, b): (&Vec<f32>, &Vec<f32>)| {
            a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x.to_bits() == y.to_bits())
        };
        self.grid == other.grid
            && self.covariance.len() == other.covariance.len()
            && self.float_planes().zip(other.float_planes()).all(same)
            && self.integer_planes() == other.integer_planes()
            && (&self.reason_names, &self.attributes) == (&other.reason_names, &other.attributes)
    }

    /// All float planes: those of [`Plane`], then the covariance.
    pub(crate) fn float_planes(&self) -> impl Iterator<Item = &Vec<f32>> {
        self.floats.iter().chain(&self.covariance)
    }

    pub(crate) fn float_planes_mut(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        self.floats.iter_mut().chain(&mut self.covariance)
    }

    /// Freedom, views, reasons.
    pub(crate) fn integer_planes(&self) -> [&Vec<u32>; 3] {
        [&self.freedom, &self.views, &self.reasons]
    }

    pub(crate) fn integer_planes_mut(&mut self) -> [&mut Vec<u32>; 3] {
        [&mut self.freedom, &mut self.views, &mut self.reasons]
    }

    /// Whether every plane has the grid's size: fields are public, so that writers ask.
    ///
    /// # Errors
    /// [`MapsError::Inconsistent`].
    pub fn check(&self) -> Result<(), MapsError> {
        let n = self.grid.samples();
        let floats = self.float_planes().map(Vec::len);
        let lengths = floats.chain(self.integer_planes().into_iter().map(Vec::len));
        if let Some(held) = lengths.into_iter().find(|held| *held != n) {
            return Err(MapsError::Inconsistent { what: format!("{held} numbers in a plane of {n} samples") });
        }
        if !matches!(self.covariance.len(), 0 | COVARIANCES) {
            let what = format!("{} planes of covariance; {COVARIANCES} or none are held", self.covariance.len());
            return Err(MapsError::Inconsistent { what });
        }
        Ok(())
    }
}

/// Names of the bits of [`Reasons`].
pub(crate) fn reason_names() -> Vec<String> {
    let names = (0..32).map(|bit| Reasons(1 << bit).to_string());
    names.take_while(|name| !name.is_empty()).collect()
}
