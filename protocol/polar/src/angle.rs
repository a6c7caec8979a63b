//! Angles as types: radians inside, degrees at the edges (files, command line, wire).

use core::f64::consts::PI;

/// An angle in radians.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Radians(pub f64);

/// An angle in degrees, for people and files.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Degrees(pub f64);

impl Radians {
    /// The same angle in degrees.
    #[must_use]
    pub fn to_degrees(self) -> Degrees {
        Degrees(self.0 * (180.0 / PI))
    }

    /// The axis this angle names, in [0, π): a polarizer at φ and at φ + π are the same polarizer.
    ///
    /// Exact for inputs already in [0, π); a tiny negative input gives 0 and never π itself.
    #[must_use]
    pub fn as_axis(self) -> Self {
        let wrapped = self.0 - PI * libm::floor(self.0 / PI);
        // floor() of a tiny negative quotient is −1 and the sum rounds up to π: that axis is 0.
        if (0.0..PI).contains(&wrapped) { Self(wrapped) } else { Self(0.0) }
    }

    /// Signed distance from `other` to `self` as axes, in (−π/2, π/2].
    #[must_use]
    pub fn axis_difference(self, other: Self) -> Self {
        let d = Self(self.0 - other.0).as_axis().0;
        if d > PI / 2.0 { Self(d - PI) } else { Self(d) }
    }

    /// (cos 2θ, sin 2θ): how every angle enters a Mueller matrix.
    #[must_use]
    pub fn cos_sin_double(self) -> (f64, f64) {
        (libm::cos(2.0 * self.0), libm::sin(2.0 * self.0))
    }
}

impl Degrees {
    /// The same angle in radians.
    #[must_use]
    pub fn to_radians(self) -> Radians {
        Radians(self.0 * (PI / 180.0))
    }
}

/// How many different polarizer axes there are among `angles`: 0° and 180° are one, and so are two axes closer than
/// `tolerance`. Input of any length; order does not matter.
#[must_use]
pub fn distinct_axes(angles: &[Radians], tolerance: Radians) -> usize {
    angles
        .iter()
        .enumerate()
        .filter(|(i, a)| !angles.iter().take(*i).any(|b| libm::fabs(a.axis_difference(*b).0) <= tolerance.0))
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_and_180_are_one_axis() {
        let deg = |d: f64| Degrees(d).to_radians();
        let tolerance = deg(0.1);
        assert_eq!(distinct_axes(&[deg(0.0), deg(180.0), deg(90.0)], tolerance), 2);
        assert_eq!(distinct_axes(&[deg(0.0), deg(60.0), deg(120.0)], tolerance), 3);
        assert_eq!(distinct_axes(&[deg(-0.01), deg(179.99), deg(360.0)], tolerance), 1);
        assert_eq!(distinct_axes(&[], tolerance), 0);
    }

    #[test]
    fn axis_is_in_half_open_range() {
        for a in [-1e-300, -1e-17, 0.0, PI, 2.0 * PI, -PI, 1e9, PI - f64::EPSILON] {
            let x = Radians(a).as_axis().0;
            assert!((0.0..PI).contains(&x), "{a} -> {x}");
        }
    }

    #[test]
    fn difference_of_axes_is_the_short_way() {
        let d = Degrees(179.0).to_radians().axis_difference(Degrees(1.0).to_radians()).to_degrees().0;
        assert!((d + 2.0).abs() < 1e-12, "{d}");
    }
}
