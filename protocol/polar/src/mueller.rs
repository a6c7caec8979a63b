//! Mueller matrices: rotation, linear polarizer, reflection (paper eq. 2-4).

use crate::{Radians, Stokes};

/// A 4 × 4 Mueller matrix, row-major; acts on [`Stokes`] in the frame the constructor states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mueller(pub [[f64; 4]; 4]);

/// What a reflection does to light, in the plane-of-incidence frame (x perpendicular).
///
/// With `δ = arg r_p − arg r_s` and fields exp(−iωt) (complex index n + ik). For a dielectric `rr_sin_delta = 0` and
/// `rr_cos_delta = r_s r_p` changes sign at the Brewster angle without a square root.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reflectance {
    /// R⊥ = |r_s|², power reflectance of perpendicular (s) light, in [0, 1].
    pub perpendicular: f64,
    /// R∥ = |r_p|², power reflectance of parallel (p) light, in [0, 1].
    pub parallel: f64,
    /// √(R⊥ R∥) cos δ = Re(r_p r_s*).
    pub rr_cos_delta: f64,
    /// √(R⊥ R∥) sin δ = Im(r_p r_s*); 0 for a dielectric.
    pub rr_sin_delta: f64,
}

impl Mueller {
    /// The identity: nothing happens.
    pub const IDENTITY: Self =
        Self([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);

    /// M_rot(α), paper eq. 3: takes Stokes given in a frame whose x axis lies at angle α (counter-clockwise from the
    /// target frame's x) into the target frame. It adds α to the angle of polarization.
    #[must_use]
    pub fn rotation(alpha: Radians) -> Self {
        let (c, s) = alpha.cos_sin_double();
        Self([[1.0, 0.0, 0.0, 0.0], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]])
    }

    /// Linear polarizer with transmission axis at `angle`, paper eq. 4 with a finite extinction ratio.
    ///
    /// `efficiency` ε in [0, 1] is (k₁ − k₂)/(k₁ + k₂) of the principal transmittances, scaled so that k₁ + k₂ = 1:
    /// ε = 1 is the ideal polarizer, ε = 0 a grey filter that passes half.
    #[must_use]
    pub fn linear_polarizer(angle: Radians, efficiency: f64) -> Self {
        let (c, s) = angle.cos_sin_double();
        // √(k₁k₂)/(k₁+k₂)·2 = √(1 − ε²): what survives of light that is neither along nor across the axis.
        let g = libm::sqrt((1.0 - efficiency) * (1.0 + efficiency));
        let h = 0.5;
        let e = efficiency;
        Self([
            [h, h * e * c, h * e * s, 0.0],
            [h * e * c, h * (c * c + g * s * s), h * (1.0 - g) * s * c, 0.0],
            [h * e * s, h * (1.0 - g) * s * c, h * (s * s + g * c * c), 0.0],
            [0.0, 0.0, 0.0, h * g],
        ])
    }

    /// M_ref, paper eq. 2: reflection in the plane-of-incidence frames on both sides.
    #[must_use]
    pub fn reflection(r: Reflectance) -> Self {
        let mean = 0.5 * (r.perpendicular + r.parallel);
        let half_difference = 0.5 * (r.perpendicular - r.parallel);
        Self([
            [mean, half_difference, 0.0, 0.0],
            [half_difference, mean, 0.0, 0.0],
            [0.0, 0.0, r.rr_cos_delta, r.rr_sin_delta],
            [0.0, 0.0, -r.rr_sin_delta, r.rr_cos_delta],
        ])
    }

    /// The Stokes vector after this element.
    #[must_use]
    pub fn apply(&self, s: Stokes) -> Stokes {
        Stokes(self.0.map(|row| row.iter().zip(s.0).map(|(m, x)| m * x).sum()))
    }

    /// The element that acts as `first` and then `self` (matrix product self · first).
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let column = |j: usize| first.0.map(|row| row.get(j).copied().unwrap_or(0.0));
        let columns = [column(0), column(1), column(2), column(3)];
        Self(self.0.map(|row| columns.map(|col| row.iter().zip(col).map(|(a, b)| a * b).sum())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;
    use proptest::prelude::*;

    #[test]
    fn malus() {
        let lit = Stokes([1.0, 1.0, 0.0, 0.0]);
        for theta in [0.0, 0.4, 1.1, 2.9_f64] {
            let Stokes([s0, ..]) = Mueller::linear_polarizer(Radians(theta), 1.0).apply(lit);
            assert!((s0 - theta.cos().powi(2)).abs() < 1e-15, "Malus at {theta}");
        }
    }

    /// Paper eq. 9 prints its last term with a minus; the Mueller product (eq. 1-4, 8) gives a plus.
    #[test]
    fn equation_9_with_the_corrected_sign_is_the_mueller_product() {
        let r = Reflectance { perpendicular: 0.16, parallel: 0.01, rr_cos_delta: -0.04, rr_sin_delta: 0.0 };
        let (l, p, psi, phi) = (1.7, 0.6, 0.5, 0.9);
        let incident = Stokes([l, l * p, 0.0, 0.0]);
        let chain =
            Mueller::rotation(Radians(phi)).after(&Mueller::reflection(r)).after(&Mueller::rotation(Radians(psi)));
        let seen = chain.apply(incident);
        let i_perp = r.perpendicular * l * 0.5 * (1.0 + p * (2.0 * psi).cos());
        let i_par = r.parallel * l * 0.5 * (1.0 - p * (2.0 * psi).cos());
        let mut worst_printed: f64 = 0.0;
        for k in 0..12 {
            let po = f64::from(k) * PI / 12.0;
            let last = 0.5 * l * p * r.rr_cos_delta * (2.0 * psi).sin() * (2.0 * (po - phi)).sin();
            let common = 0.5 * (i_perp + i_par) + 0.5 * (i_perp - i_par) * (2.0 * (po - phi)).cos();
            let product = seen.through_polarizer(Radians(po));
            assert!((common + last - product).abs() < 1e-15, "corrected eq. 9 at {po}");
            worst_printed = worst_printed.max((common - last - product).abs());
        }
        assert!(worst_printed > 1e-3, "as printed it must disagree, or the erratum is ours");
    }

    proptest! {
        #[test]
        fn rotations_compose(a in -10.0..10.0_f64, b in -10.0..10.0_f64) {
            let two = Mueller::rotation(Radians(a)).after(&Mueller::rotation(Radians(b)));
            let one = Mueller::rotation(Radians(a + b));
            for (x, y) in two.0.iter().flatten().zip(one.0.iter().flatten()) {
                prop_assert!((x - y).abs() < 1e-13);
            }
        }

        #[test]
        fn a_turned_polarizer_is_a_polarizer_in_a_turned_frame(a in -4.0..4.0_f64, e in 0.0..1.0_f64) {
            let turned = Mueller::rotation(Radians(a))
                .after(&Mueller::linear_polarizer(Radians(0.0), e))
                .after(&Mueller::rotation(Radians(-a)));
            let direct = Mueller::linear_polarizer(Radians(a), e);
            for (x, y) in turned.0.iter().flatten().zip(direct.0.iter().flatten()) {
                prop_assert!((x - y).abs() < 1e-14);
            }
        }

        #[test]
        fn light_stays_physical(a in -4.0..4.0_f64, e in 0.0..1.0_f64, p in 0.0..1.0_f64, psi in -2.0..2.0_f64) {
            let out = Mueller::linear_polarizer(Radians(a), e).apply(Stokes::linear(1.0, p, Radians(psi)));
            prop_assert!(out.0[0] >= -1e-15 && out.0[0] <= 1.0 + 1e-15);
            prop_assert!(out.0[1].hypot(out.0[2]) <= out.0[0] + 1e-14);
        }

        #[test]
        fn the_analyzer_sees_what_the_polarizer_passes(a in -4.0..4.0_f64, p in 0.0..1.0_f64, psi in -2.0..2.0_f64) {
            let s = Stokes::linear(1.0, p, Radians(psi));
            let by_mueller = Mueller::linear_polarizer(Radians(a), 1.0).apply(s).0[0];
            prop_assert!((by_mueller - s.through_polarizer(Radians(a))).abs() < 1e-15);
        }
    }
}
