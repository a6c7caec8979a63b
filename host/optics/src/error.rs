//! What this crate refuses, with the value it saw.

/// An input outside the domain of the model.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OpticsError {
    /// A refractive index this crate has no physics for.
    #[error(
        "refractive index {n} + {k}i is outside the model (dielectrics: 1 <= n <= 1000; conductors: 0 < n, k <= 1000)"
    )]
    Index {
        /// Real part.
        n: f64,
        /// Imaginary part, >= 0 for absorbing media.
        k: f64,
    },
    /// A perpendicular reflectance that no dielectric shows at this angle.
    #[error("R_perp = {reflectance} at cos(theta) = {cosine} is not the reflectance of a dielectric with n >= 1")]
    NotADielectric {
        /// R⊥ as given.
        reflectance: f64,
        /// Cosine of the angle of incidence.
        cosine: f64,
    },
    /// A roughness outside [1e-6, 1].
    #[error("GGX roughness alpha = {0} is outside [1e-6, 1]; alpha -> 0 is the mirror limit and has its own function")]
    Roughness(f64),
    /// A direction of length zero or with a component that is not finite.
    #[error("({x}, {y}, {z}) is not a direction")]
    Direction {
        /// Components as given.
        x: f64,
        /// Components as given.
        y: f64,
        /// Components as given.
        z: f64,
    },
    /// The camera's x axis lies along the ray, so it gives the ray no frame.
    #[error("the camera's x axis is parallel to the ray: that ray has no camera frame")]
    AxisAlongRay,
    /// A number that must lie in an interval and does not.
    #[error("{name} = {value} is outside [{low}, {high}]")]
    Range {
        /// Which parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Lower bound, inclusive.
        low: f64,
        /// Upper bound, inclusive.
        high: f64,
    },
    /// An image whose number of samples is not what its size says, or with no pixel at all.
    #[error("an environment map of {width} x {height} needs {expected} samples and has {found}")]
    MapSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Samples expected for that size.
        expected: usize,
        /// Samples given.
        found: usize,
    },
}

/// `value` if it lies in [low, high].
pub(crate) fn in_range(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, OpticsError> {
    if (low..=high).contains(&value) { Ok(value) } else { Err(OpticsError::Range { name, value, low, high }) }
}
