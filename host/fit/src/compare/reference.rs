//! What maps are compared with.

use std::path::Path;

use host_image::Layers;

use crate::maps::{Grid, MapsError, MaterialMaps, Plane, PlaneRect};

/// From this class on samples are scored: those below are background, plate and fiducials, −1 is an edge.
pub(super) const FIRST_SCORED: i16 = 10;

/// Planes of values: ρ_d (3), η, α, normal (3).
const VALUES: usize = 8;
/// Planes of σ: ρ_d (3), η, α, normal in degrees.
const SIGMAS: usize = 6;
/// Fraction of a cell below which a position is on a sample.
const ON_SAMPLE: f64 = 1e-6;

/// Maps to compare with: values, and where they are themselves uncertain their σ.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Where the samples lie.
    pub grid: Grid,
    /// [`VALUES`] planes, then [`SIGMAS`] or none.
    planes: Vec<Vec<f32>>,
    /// Class of each sample.
    classes: Vec<i16>,
}

/// The reference at one place.
pub(super) struct Sample {
    pub(super) class: i16,
    pub(super) values: [f64; VALUES],
    /// 0 where the reference is exact.
    pub(super) sigmas: [f64; SIGMAS],
}

impl Reference {
    /// A truth file: channels `albedo.R` ..., `eta`, `alpha`, `normal.X` ... and `mask` (the class of each sample; those
    /// of 10 and more are scored), node registered: the outermost samples stand on the edges of `nodes`.
    ///
    /// # Errors
    /// [`MapsError::Image`] for a file that cannot be read or misses a channel; [`MapsError::Inconsistent`] for `nodes`
    /// without an area.
    pub fn load_truth(path: &Path, nodes: PlaneRect) -> Result<Self, MapsError> {
        let mut layers = Layers::load(path)?;
        let grid = Grid::from_nodes(layers.width, layers.height, nodes)?;
        let values = &Plane::ALL[..VALUES];
        let planes = values.iter().map(|plane| layers.take_f32(plane.name())).collect::<Result<_, _>>()?;
        #[expect(clippy::cast_possible_truncation, reason = "saturates; classes are small whole numbers")]
        let class = |v: f32| if v.is_finite() { v.round() as i16 } else { -1 };
        let classes = layers.take_f32("mask")?.into_iter().map(class).collect();
        Ok(Self { grid, planes, classes })
    }

    /// Other maps, with their σ. Samples that were not fitted, or have one of the reasons `refuse`, are no reference.
    #[must_use]
    pub fn from_maps(maps: &MaterialMaps, refuse: u32) -> Self {
        let planes = Plane::ALL[..VALUES + SIGMAS].iter().map(|p| maps.plane(*p).to_vec()).collect();
        let class = |reasons: &u32| if reasons & refuse == 0 { FIRST_SCORED } else { -1 };
        Self { grid: maps.grid, planes, classes: maps.reasons.iter().map(class).collect() }
    }

    /// The reference at plane coordinates: bilinear between the four samples around, of which all that count must be of
    /// one class; normals are made unit vectors again. `None` outside, on the border of classes, and where a value that
    /// counts is missing for the normal.
    pub(super) fn at(&self, position: [f64; 2]) -> Option<Sample> {
        let [(column, right), (row, down)] = {
            let [c, r] = self.grid.locate(position);
            [split(c, self.grid.columns)?, split(r, self.grid.rows)?]
        };
        let corners = [
            (0, 0, (1.0 - right) * (1.0 - down)),
            (1, 0, right * (1.0 - down)),
            (0, 1, (1.0 - right) * down),
            (1, 1, right * down),
        ];
        let counting = corners.iter().filter(|(.., weight)| *weight > 0.0);
        let counting = counting.map(|(c, r, weight)| ((row + r) * self.grid.columns + column + c, *weight));
        let class = self.classes[row * self.grid.columns + column];
        let (mut values, mut sigmas) = ([0.0; VALUES], [0.0; SIGMAS]);
        for (i, weight) in counting {
            if self.classes[i] != class {
                return None;
            }
            for (sum, plane) in values.iter_mut().chain(&mut sigmas).zip(&self.planes) {
                *sum += weight * f64::from(plane[i]);
            }
        }
        let [.., x, y, z] = &mut values;
        let length = (*x * *x + *y * *y + *z * *z).sqrt();
        for n in [x, y, z] {
            *n /= length;
        }
        (length > 0.0).then_some(Sample { class, values, sigmas })
    }
}

/// The sample at or before `at`, and the fraction of a cell beyond it; `None` outside of the first and last of `count`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be between 0 and count")]
fn split(at: f64, count: usize) -> Option<(usize, f64)> {
    let nearest = at.round();
    let at = if (at - nearest).abs() < ON_SAMPLE { nearest } else { at };
    ((0.0..=(count - 1) as f64).contains(&at)).then(|| (at.floor() as usize, at.fract()))
}
