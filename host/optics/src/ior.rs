//! Refractive indices, validated once: what is an [`Ior`] has physics.
//!
//! η = n + ik with k >= 0 absorbing and fields exp(−iωt); light arrives from vacuum.

use crate::real::single;
use crate::{OpticsError, Real};

/// Largest index accepted: no optical medium comes near, and everything stays far from overflow below it.
pub const MAX_INDEX: f64 = 1e3;

/// Refractive index of a transparent medium, in [1, 1000].
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Dielectric<T = f64>(T);

/// Refractive index n + ik of an absorbing medium, 0 < n, k <= 1000.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor<T = f64> {
    n: T,
    k: T,
}

/// A refractive index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ior {
    /// Real η >= 1.
    Dielectric(Dielectric),
    /// Complex η.
    Conductor(Conductor),
}

impl Dielectric {
    /// Real η.
    ///
    /// # Errors
    /// [`OpticsError::Index`] outside [1, 1000]: light from inside a denser medium is not modeled.
    pub fn new(eta: f64) -> Result<Self, OpticsError> {
        if (1.0..=MAX_INDEX).contains(&eta) { Ok(Self(eta)) } else { Err(OpticsError::Index { n: eta, k: 0.0 }) }
    }

    /// The nearest index in f32, for lanes.
    #[must_use]
    pub fn single(self) -> Dielectric<f32> {
        Dielectric(single(self.0))
    }
}

impl<T: Real> Dielectric<T> {
    /// η.
    #[must_use]
    pub fn eta(self) -> T {
        self.0
    }

    /// η found by an inverse, if it is in the range of [`Dielectric::new`].
    pub(crate) fn found(eta: T) -> Option<Self> {
        (1.0..=MAX_INDEX).contains(&eta.into()).then_some(Self(eta))
    }
}

impl Conductor {
    /// η = n + ik.
    ///
    /// # Errors
    /// [`OpticsError::Index`] unless 0 < n <= 1000 and 0 < k <= 1000.
    pub fn new(n: f64, k: f64) -> Result<Self, OpticsError> {
        let fits = |x: f64| x > 0.0 && x <= MAX_INDEX;
        if fits(n) && fits(k) { Ok(Self { n, k }) } else { Err(OpticsError::Index { n, k }) }
    }

    /// The nearest index in f32, for lanes. An n or k below 1e-38 becomes a subnormal number or 0.
    #[must_use]
    pub fn single(self) -> Conductor<f32> {
        Conductor { n: single(self.n), k: single(self.k) }
    }
}

impl<T: Real> Conductor<T> {
    /// Real part.
    #[must_use]
    pub fn n(self) -> T {
        self.n
    }

    /// Imaginary part (extinction coefficient).
    #[must_use]
    pub fn k(self) -> T {
        self.k
    }
}

impl Ior {
    /// η = n + ik; k = 0 is a dielectric.
    ///
    /// # Errors
    /// [`OpticsError::Index`] as [`Dielectric::new`] and [`Conductor::new`].
    pub fn new(n: f64, k: f64) -> Result<Self, OpticsError> {
        if k == 0.0 { Dielectric::new(n).map(Self::Dielectric) } else { Conductor::new(n, k).map(Self::Conductor) }
    }
}

impl From<Dielectric> for Ior {
    fn from(d: Dielectric) -> Self {
        Self::Dielectric(d)
    }
}

impl From<Conductor> for Ior {
    fn from(c: Conductor) -> Self {
        Self::Conductor(c)
    }
}
