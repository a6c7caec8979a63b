//! Polarization patterns of the clear sky, apart from its radiance: Rayleigh, and Berry-Dennis-Lee with its four neutral
//! points.

use crate::error::in_range;
use crate::frames::direction;
use crate::{Frame, Light, OpticsError};
use glam::DVec3;

/// A polarization pattern: (Q, U)/L by direction.
pub trait Pattern {
    /// (Q, U)/L of the light out of unit `direction`, in [`Frame::sky`] of that direction; √(q² + u²) <= 1.
    fn fraction(&self, direction: DVec3) -> [f64; 2];
}

/// Light with the radiance of `light` and the polarization of `pattern`: an analytic polarization put on a sky formula or
/// on an unpolarized map. Whatever polarization `light` had is dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polarized<L, P> {
    /// Gives L.
    pub light: L,
    /// Gives (Q, U)/L.
    pub pattern: P,
}

impl<L: Light, P: Pattern> Light for Polarized<L, P> {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let [l, ..] = self.light.stokes(direction);
        let [q, u] = self.pattern.fraction(direction);
        [l, l * q, l * u]
    }
}

/// Single scattering: DoLP = P_max sin² γ/(1 + cos² γ) across the plane of the sun, γ the angle to the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rayleigh {
    sun: DVec3,
    max_dolp: f64,
}

impl Rayleigh {
    /// Sun direction (any length) and P_max in [0, 1], about 0.8 for a clear sky.
    ///
    /// # Errors
    /// [`OpticsError::Direction`] or [`OpticsError::Range`].
    pub fn new(sun: DVec3, max_dolp: f64) -> Result<Self, OpticsError> {
        Ok(Self { sun: direction(sun)?, max_dolp: in_range("maximum DoLP", max_dolp, 0.0, 1.0)? })
    }
}

impl Pattern for Rayleigh {
    /// With v = ω × sun, a = v·x, b = v·y: (a² − b², 2ab) P_max/(1 + cos² γ), exactly 0 and smooth at sun and antisun.
    fn fraction(&self, direction: DVec3) -> [f64; 2] {
        let frame = Frame::sky(direction);
        let v = direction.cross(self.sun);
        let (a, b) = (v.dot(frame.x), v.dot(frame.y));
        let cos_gamma = direction.dot(self.sun);
        let scale = self.max_dolp / (1.0 + cos_gamma * cos_gamma);
        [scale * (a - b) * (a + b), scale * 2.0 * a * b]
    }
}

/// Berry, Dennis and Lee 2004, "Polarization singularities in the clear sky": neutral points half the splitting above and
/// below the sun (Babinet, Brewster) and the antisun (Arago, fourth).
///
/// In the stereographic plane ζ = tan(γ/2) e^(iχ) with the sun at 0 and the zenith along +i,
/// W = −4 (ζ² + A²)(ζ² + 1/A²)/((1 + |ζ|²)² (A + 1/A)²), A = tan(splitting/4); DoLP = P_max |W|/(2 − |W|), direction
/// arg(W)/2. A → 0 is [`Rayleigh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Berry {
    sun: DVec3,
    across: DVec3,
    up: DVec3,
    a_squared: f64,
    max_dolp: f64,
}

impl Berry {
    /// Sun direction (any length), the angle in degrees between the two neutral points by the sun, in [0.001, 179],
    /// and P_max in [0, 1]. Measured splittings are about 24° to 40°. Under a sun at the zenith itself the splitting lies
    /// along +y.
    ///
    /// # Errors
    /// [`OpticsError::Direction`] or [`OpticsError::Range`].
    pub fn new(sun: DVec3, splitting_deg: f64, max_dolp: f64) -> Result<Self, OpticsError> {
        let sun = direction(sun)?;
        let splitting = in_range("splitting of the neutral points in degrees", splitting_deg, 1e-3, 179.0)?;
        let up = direction(DVec3::Z - sun * sun.z).unwrap_or(DVec3::Y);
        let a = (0.25 * splitting.to_radians()).tan();
        Ok(Self {
            sun,
            across: up.cross(sun),
            up,
            a_squared: a * a,
            max_dolp: in_range("maximum DoLP", max_dolp, 0.0, 1.0)?,
        })
    }
}

impl Pattern for Berry {
    fn fraction(&self, direction: DVec3) -> [f64; 2] {
        // Two charts, centered on the sun and on the antisun, so that the pole of neither is used. The formula is the
        // same in both (ζ → 1/ζ* maps W to its conjugate times e^(4iχ)); the plane is seen from the other side.
        let towards = self.sun.dot(direction);
        let center = if towards >= 0.0 { self.sun } else { -self.sun };
        let scale = 1.0 + towards.abs();
        let (p1, p2) = (direction.dot(self.across), direction.dot(self.up));
        let (x, y) = (p1 / scale, p2 / scale);
        let square = ((x - y) * (x + y), 2.0 * x * y);
        let (near, far) = (square.0 + self.a_squared, square.0 + 1.0 / self.a_squared);
        // −(scale/(A + 1/A))² times the product of the two complex factors; 4/(1 + |ζ|²)² = scale².
        let factor = -scale * scale * self.a_squared / (1.0 + self.a_squared).powi(2);
        let w = (factor * (near * far - square.1 * square.1), factor * square.1 * (near + far));
        let modulus = w.0.hypot(w.1);
        // The plane's x axis carried to the direction along the great circle (it is conformal: angles are kept).
        let axis = self.across - (center + direction) * (p1 / scale);
        let turn = Frame::sky(direction).turn_to(axis);
        // About the sun the plane's angles run against those of light that arrives; about the antisun with them.
        let w = if towards >= 0.0 { [w.0, -w.1] } else { [w.0, w.1] };
        let dolp_over_w = self.max_dolp / (2.0 - modulus);
        turn.apply([dolp_over_w * w[0], dolp_over_w * w[1]])
    }
}
