//! Maps minus reference, sample by sample.

use rayon::prelude::*;

use super::Reference;
use super::reference::{FIRST_SCORED, Sample};
use super::report::Comparison;
use crate::maps::{Grid, MapsError, MaterialMaps, Plane};

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Quantity {
    /// Angle between the normals, degrees, >= 0.
    Normal,
    /// η.
    Eta,
    /// α.
    Alpha,
    /// ρ_d of red.
    AlbedoR,
    /// ρ_d of green.
    AlbedoG,
    /// ρ_d of blue.
    AlbedoB,
}

/// How to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompareOptions {
    /// Samples with any of these reasons are refused: counted, not scored.
    pub refuse: u32,
    /// Whether grids that do not coincide may be compared: the reference is then interpolated, bilinear within a class.
    pub resample: bool,
}

/// Errors as planes over the grid of the maps, for previews; NaN where nothing was scored.
#[derive(Clone, Debug)]
pub struct Differences {
    /// Grid of the maps under test.
    pub grid: Grid,
    /// By [`Quantity`]: maps minus reference; the normal's angle in degrees.
    pub errors: [Vec<f32>; 6],
    /// By [`Quantity`]: error over σ, that of the reference included; NaN also where σ is 0 or infinite.
    pub z: [Vec<f32>; 6],
    /// Class of the reference at each sample; −1 where there is none.
    pub classes: Vec<i16>,
}

impl Quantity {
    /// All, in the order of their numbers.
    pub const ALL: [Self; 6] = [Self::Normal, Self::Eta, Self::Alpha, Self::AlbedoR, Self::AlbedoG, Self::AlbedoB];

    /// A short name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Eta => "eta",
            Self::Alpha => "alpha",
            Self::AlbedoR => "albedo.R",
            Self::AlbedoG => "albedo.G",
            Self::AlbedoB => "albedo.B",
        }
    }

    /// Plane of the value (for the normal its x), and of its σ.
    const fn planes(self) -> [Plane; 2] {
        match self {
            Self::Normal => [Plane::NormalX, Plane::SigmaNormal],
            Self::Eta => [Plane::Eta, Plane::SigmaEta],
            Self::Alpha => [Plane::Alpha, Plane::SigmaAlpha],
            Self::AlbedoR => [Plane::AlbedoR, Plane::SigmaAlbedoR],
            Self::AlbedoG => [Plane::AlbedoG, Plane::SigmaAlbedoG],
            Self::AlbedoB => [Plane::AlbedoB, Plane::SigmaAlbedoB],
        }
    }
}

impl Default for CompareOptions {
    /// Every reason refuses; grids must coincide.
    fn default() -> Self {
        Self { refuse: u32::MAX, resample: false }
    }
}

/// Compares maps with a reference, at every sample of the maps.
///
/// A sample is scored in a quantity where the reference is of a class of 10 or more, none of the refused reasons stands
/// against it, and value and σ are finite. Memory beside the maps: 12 planes.
///
/// # Errors
/// [`MapsError::GridMismatch`] if the samples do not coincide and resampling is not allowed; [`MapsError::Inconsistent`].
pub fn compare(maps: &MaterialMaps, reference: &Reference, options: CompareOptions) -> Result<Comparison, MapsError> {
    maps.check()?;
    let resampled = !maps.grid.coincides(&reference.grid);
    if resampled && !options.resample {
        let (found, reference) = (maps.grid.to_string(), reference.grid.to_string());
        return Err(MapsError::GridMismatch { found, reference });
    }
    let columns = maps.grid.columns;
    let nothing = || std::array::from_fn(|_| vec![f32::NAN; maps.grid.samples()]);
    let (mut errors, mut z): ([Vec<f32>; 6], [Vec<f32>; 6]) = (nothing(), nothing());
    let mut classes = vec![-1_i16; maps.grid.samples()];
    let row_of = |row: usize| -> Vec<(i16, [[f32; 2]; 6])> {
        (0..columns).map(|column| score(maps, reference, options, [column, row])).collect()
    };
    // A few rows at a time: what is in flight stays small beside the planes.
    for first in (0..maps.grid.rows).step_by(64) {
        let rows: Vec<_> = (first..maps.grid.rows.min(first + 64)).into_par_iter().map(row_of).collect();
        for (i, (class, scores)) in (first * columns..).zip(rows.into_iter().flatten()) {
            classes[i] = class;
            for (k, [error, over_sigma]) in scores.into_iter().enumerate() {
                errors[k][i] = error;
                z[k][i] = over_sigma;
            }
        }
    }
    let differences = Differences { grid: maps.grid, errors, z, classes };
    Ok(Comparison::of(differences, maps, options, resampled))
}

/// Class of a sample, and error and z of each quantity.
fn score(
    maps: &MaterialMaps,
    reference: &Reference,
    options: CompareOptions,
    [column, row]: [usize; 2],
) -> (i16, [[f32; 2]; 6]) {
    let nothing = [[f32::NAN; 2]; 6];
    let Some(truth) = reference.at(maps.grid.position(column, row)) else { return (-1, nothing) };
    let i = row * maps.grid.columns + column;
    if truth.class < FIRST_SCORED || maps.reasons[i] & options.refuse != 0 {
        return (truth.class, nothing);
    }
    (truth.class, Quantity::ALL.map(|quantity| one(maps, i, &truth, quantity)))
}

/// Error and z; NaN where there is none.
#[expect(clippy::cast_possible_truncation, reason = "planes are f32")]
fn one(maps: &MaterialMaps, i: usize, truth: &Sample, quantity: Quantity) -> [f32; 2] {
    let value = |plane: Plane| f64::from(maps.plane(plane)[i]);
    let [plane, sigma_plane] = quantity.planes();
    let error = match quantity {
        Quantity::Normal => {
            let [.., x, y, z] = truth.values;
            angle_deg([Plane::NormalX, Plane::NormalY, Plane::NormalZ].map(value), [x, y, z])
        }
        _ => value(plane) - truth.values[plane as usize],
    };
    let sigma = value(sigma_plane);
    if !error.is_finite() || !sigma.is_finite() {
        return [f32::NAN; 2];
    }
    let sigma = sigma.hypot(truth.sigmas[sigma_plane as usize - Plane::SigmaAlbedoR as usize]);
    [error as f32, if sigma > 0.0 { (error / sigma) as f32 } else { f32::NAN }]
}

/// Angle between two vectors, from cross and dot product: exact to rounding at 0 and 180 degrees too.
fn angle_deg([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> f64 {
    let cross = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    sine.atan2(ax * bx + ay * by + az * bz).to_degrees()
}
