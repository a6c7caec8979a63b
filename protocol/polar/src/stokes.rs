//! The Stokes vector and what is read off it.

use crate::{Mueller, Radians};

/// Stokes vector `[s0, s1, s2, s3]` of one beam, in a stated frame (see the crate's conventions).
///
/// Units are the caller's (radiance, DN); `s0` is the full power. It means nothing without its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stokes(pub [f64; 4]);

impl Stokes {
    /// Unit unpolarized light.
    pub const UNPOLARIZED: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// Linearly polarized light: power `s0`, degree of linear polarization `dolp` in [0, 1], angle `aolp`.
    #[must_use]
    pub fn linear(s0: f64, dolp: f64, aolp: Radians) -> Self {
        let (c, s) = aolp.cos_sin_double();
        Self([s0, s0 * dolp * c, s0 * dolp * s, 0.0])
    }

    /// The same light in a frame turned counter-clockwise by `axis` from the present one.
    #[must_use]
    pub fn in_frame(self, axis: Radians) -> Self {
        Mueller::rotation(Radians(-axis.0)).apply(self)
    }

    /// Degree of linear polarization √(s1² + s2²)/s0; 0 where there is no light (`s0 <= 0`).
    ///
    /// Not clamped: noise makes it exceed 1, and a caller that clamps hides it.
    #[must_use]
    pub fn dolp(self) -> f64 {
        let [s0, s1, s2, _] = self.0;
        if s0 > 0.0 { libm::hypot(s1, s2) / s0 } else { 0.0 }
    }

    /// Angle of linear polarization ½ atan2(s2, s1), in [0, π). 0 where s1 = s2 = 0 (the angle is undefined there).
    #[must_use]
    pub fn aolp(self) -> Radians {
        let [_, s1, s2, _] = self.0;
        Radians(0.5 * libm::atan2(s2, s1)).as_axis()
    }

    /// What an ideal linear polarizer at `angle` passes: ½ (s0 + s1 cos 2φ + s2 sin 2φ).
    #[must_use]
    pub fn through_polarizer(self, angle: Radians) -> f64 {
        let (c, s) = angle.cos_sin_double();
        let [s0, s1, s2, _] = self.0;
        0.5 * (s0 + s1 * c + s2 * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    #[test]
    fn light_at_45_degrees_is_plus_s2() {
        let s = Stokes::linear(2.0, 0.5, Radians(PI / 4.0));
        assert!((s.0[2] - 1.0).abs() < 1e-15 && s.0[1].abs() < 1e-15);
        assert!((s.dolp() - 0.5).abs() < 1e-15);
        assert!((s.aolp().0 - PI / 4.0).abs() < 1e-15);
    }

    #[test]
    fn turning_the_frame_subtracts_from_the_angle() {
        let s = Stokes::linear(1.0, 0.7, Radians(1.0)).in_frame(Radians(0.3));
        assert!((s.aolp().0 - 0.7).abs() < 1e-14, "{:?}", s.aolp());
    }

    #[test]
    fn angle_of_polarization_stays_below_pi() {
        let almost = Stokes([1.0, 1.0, -1e-20, 0.0]).aolp().0;
        assert!((0.0..PI).contains(&almost), "{almost}");
    }

    #[test]
    fn no_light_has_no_polarization() {
        assert_eq!(Stokes([0.0, 0.0, 0.0, 0.0]).dolp().to_bits(), 0.0_f64.to_bits());
        assert_eq!(Stokes([-1e-3, 1e-3, 0.0, 0.0]).dolp().to_bits(), 0.0_f64.to_bits());
    }
}
