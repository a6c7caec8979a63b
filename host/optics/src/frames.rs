//! Directions, angles of incidence, Stokes frames and the turns between them.
//!
//! World: right-handed, the planar sample in z = 0 with mean normal +z; directions are unit [`DVec3`] that point away
//! from the surface. A frame is (x, y) with x × y along the propagation of the light: −ω for light that arrives from
//! direction ω, +ω for light that leaves towards it. No angle is ever formed: a turn by α is the pair (cos 2α, sin 2α),
//! which is all a Mueller matrix asks for and stays smooth where α jumps by π.

use crate::OpticsError;
use crate::real::single;
use glam::DVec3;
use protocol_polar::{Mueller, Radians};

/// An angle θ in [0, π] between a direction and a normal as (cos θ, sin² θ), both accurate: sin² comes from a cross
/// product or a difference of vectors and never from 1 − cos².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence<T = f64> {
    /// cos θ.
    pub cosine: T,
    /// sin² θ.
    pub sine_squared: T,
}

impl Incidence {
    /// From an angle in radians.
    #[must_use]
    pub fn from_angle(theta: Radians) -> Self {
        let (s, c) = theta.0.sin_cos();
        Self { cosine: c, sine_squared: s * s }
    }

    /// Between two unit vectors: c = n·v, s² = |n × v|².
    #[inline]
    #[must_use]
    pub fn between(normal: DVec3, direction: DVec3) -> Self {
        Self { cosine: normal.dot(direction), sine_squared: normal.cross(direction).length_squared() }
    }

    /// On the facet that mirrors unit `wi` into unit `wo`: c = |ω_i + ω_o|/2, s² = |ω_i − ω_o|²/4.
    #[inline]
    #[must_use]
    pub fn on_facet(wi: DVec3, wo: DVec3) -> Self {
        Self { cosine: 0.5 * (wi + wo).length(), sine_squared: 0.25 * (wi - wo).length_squared() }
    }

    /// Both numbers rounded to f32, for lanes.
    #[must_use]
    pub fn single(self) -> Incidence<f32> {
        Incidence { cosine: single(self.cosine), sine_squared: single(self.sine_squared) }
    }
}

/// A rotation of Stokes parameters by an angle α, carried as (cos 2α, sin 2α).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// cos 2α.
    pub cos: f64,
    /// sin 2α.
    pub sin: f64,
}

impl Turn {
    /// No rotation.
    pub const NONE: Self = Self { cos: 1.0, sin: 0.0 };

    /// By the angle α.
    #[must_use]
    pub fn by(alpha: Radians) -> Self {
        let (cos, sin) = alpha.cos_sin_double();
        Self { cos, sin }
    }

    /// To the direction (c, s) of any non-zero length, as seen from (1, 0).
    #[inline]
    #[must_use]
    pub fn towards(c: f64, s: f64) -> Self {
        let scale = c.abs().max(s.abs());
        if scale == 0.0 {
            return Self::NONE;
        }
        let (c, s) = (c / scale, s / scale);
        let inverse = 1.0 / (c * c + s * s);
        Self { cos: (c - s) * (c + s) * inverse, sin: 2.0 * c * s * inverse }
    }

    /// By −α.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { cos: self.cos, sin: -self.sin }
    }

    /// By α and then by `next`.
    #[inline]
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self { cos: self.cos * next.cos - self.sin * next.sin, sin: self.sin * next.cos + self.cos * next.sin }
    }

    /// M_rot(α) on (Q, U), paper eq. 3: takes Stokes given in a frame whose x axis lies at α in the target frame into
    /// the target frame.
    #[inline]
    #[must_use]
    pub fn apply(self, [q, u]: [f64; 2]) -> [f64; 2] {
        [self.cos * q - self.sin * u, self.sin * q + self.cos * u]
    }

    /// M_rot(α) on linear Stokes (L, Q, U).
    #[inline]
    #[must_use]
    pub fn apply_linear(self, [l, q, u]: [f64; 3]) -> [f64; 3] {
        let [q, u] = self.apply([q, u]);
        [l, q, u]
    }

    /// The full 4 × 4 M_rot(α).
    #[must_use]
    pub fn mueller(self) -> Mueller {
        let (c, s) = (self.cos, self.sin);
        Mueller([[1.0, 0.0, 0.0, 0.0], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]])
    }
}

/// A Stokes frame of one beam: unit x and y across the beam, x × y along its propagation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Reference axis: s1 > 0 is polarized along it.
    pub x: DVec3,
    /// s2 > 0 is polarized along x + y.
    pub y: DVec3,
}

impl Frame {
    /// Frame of light that arrives from the sky out of unit direction ω: x = normalize(ω × z), y up. At the poles,
    /// where ω × z vanishes, x = (0, −1, 0), which is the limit along the azimuth of +x.
    #[inline]
    #[must_use]
    pub fn sky(direction: DVec3) -> Self {
        let x = sky_axis(direction);
        Self { x, y: x.cross(direction) }
    }

    /// Frame of light that arrives out of unit direction ω, with its x axis as close to `axis` as can be.
    ///
    /// # Errors
    /// [`OpticsError::AxisAlongRay`] if `axis` has no component across the ray.
    pub fn incident(direction: DVec3, axis: DVec3) -> Result<Self, OpticsError> {
        let x = across(axis, direction)?;
        Ok(Self { x, y: x.cross(direction) })
    }

    /// Frame of the ray that leaves along unit direction ω towards a camera whose picture has `x_camera` to the right:
    /// x = normalize(x_camera − (x_camera·k) k), y = k × x, k = ω.
    ///
    /// # Errors
    /// [`OpticsError::AxisAlongRay`] for the ray along `x_camera` itself (90° off the optical axis).
    pub fn camera(direction: DVec3, x_camera: DVec3) -> Result<Self, OpticsError> {
        let x = across(x_camera, direction)?;
        Ok(Self { x, y: direction.cross(x) })
    }

    /// Where `axis` (across the beam, of any non-zero length) points in this frame.
    #[inline]
    #[must_use]
    pub fn turn_to(&self, axis: DVec3) -> Turn {
        Turn::towards(axis.dot(self.x), axis.dot(self.y))
    }
}

/// The angle, as an axis in [0, π), at which `axis` lies in `frame`.
#[must_use]
pub fn axis_angle(frame: &Frame, axis: DVec3) -> Radians {
    Radians(axis.dot(frame.y).atan2(axis.dot(frame.x))).as_axis()
}

/// `v` scaled to length 1.
///
/// # Errors
/// [`OpticsError::Direction`] if it has no direction.
pub fn direction(v: DVec3) -> Result<DVec3, OpticsError> {
    scaled_unit(v).ok_or(OpticsError::Direction { x: v.x, y: v.y, z: v.z })
}

/// The perpendicular (s) axis of reflection from unit `wi` to unit `wo`, of unit length: along ω_i × ω_o.
///
/// At retro-reflection (and straight transmission) it is arbitrary; one axis across both beams is returned, which
/// leaves every product M_rot M_ref M_rot unchanged as long as it is used on both sides.
#[inline]
#[must_use]
pub fn s_axis(wi: DVec3, wo: DVec3) -> DVec3 {
    // (ω_i − ω_o) × (ω_i + ω_o) = 2 ω_i × ω_o, whose factors are exact differences where the product is small.
    scaled_unit((wi - wo).cross(wi + wo)).unwrap_or_else(|| wo.any_orthonormal_vector())
}

/// Unit vectors (t, b) across unit `normal` with t × b = normal.
#[inline]
#[must_use]
pub fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    normal.any_orthonormal_pair()
}

/// Parallel transport along the great circle of a vector `v` across unit `from`, to unit `to`. Between antipodes no great
/// circle is the shortest; `v`, which lies across both, stays what it is.
#[inline]
#[must_use]
pub fn transport(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let apart = 1.0 + from.dot(to);
    if apart > 0.0 { v - (from + to) * (v.dot(to) / apart) } else { v }
}

fn sky_axis(w: DVec3) -> DVec3 {
    scaled_unit(DVec3::new(w.y, -w.x, 0.0)).unwrap_or(DVec3::NEG_Y)
}

fn across(axis: DVec3, k: DVec3) -> Result<DVec3, OpticsError> {
    let across = scaled_unit(axis).and_then(|axis| scaled_unit(axis - k * axis.dot(k)));
    across.ok_or(OpticsError::AxisAlongRay)
}

/// Unit vector along `v`, without overflow or underflow on the way; `None` where there is none.
fn scaled_unit(v: DVec3) -> Option<DVec3> {
    let scale = v.abs().max_element();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let v = v / scale;
    Some(v / v.length())
}
