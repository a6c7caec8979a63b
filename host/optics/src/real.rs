//! The two floating-point types the pointwise functions of Fresnel and GGX are made for: f64, and f32 for lanes.
//!
//! Only what those formulas need, so that each is written once. No fused multiply-add: without the instruction in the build's
//! target it is a call into libm that costs more than a whole reflectance and keeps loops from being vectorized.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// f32 or f64.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + PartialOrd
    + From<f32>
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// ½.
    const HALF: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// 4.
    const FOUR: Self;
    /// 1/π.
    const FRAC_1_PI: Self;
    /// +∞.
    const INFINITY: Self;
    /// Least denominator where a limit is infinite: its inverse, times the inverse of the least roughness, is still finite.
    const TINY: Self;

    /// Relative to 1, what is small and still has most of its digits after a subtraction of corrected numbers: 2^−16.
    const LITTLE: Self;

    /// √self, correctly rounded (one instruction).
    #[must_use]
    fn sqrt(self) -> Self;

    /// |self| with the sign of `other`: bits, where a comparison of angles would be a branch that no processor foresees.
    #[must_use]
    fn with_sign(self, other: Self) -> Self;

    /// The product rounded, and what the rounding took off.
    #[must_use]
    fn product(self, other: Self) -> (Self, Self);

    /// The sum rounded, and what the rounding took off (Knuth).
    #[inline]
    #[must_use]
    fn sum(self, other: Self) -> (Self, Self) {
        let rounded = self + other;
        let of_other = rounded - self;
        (rounded, (self - (rounded - of_other)) + (other - of_other))
    }

    /// The larger of two; of a NaN and a number the number `other`.
    #[inline]
    #[must_use]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of two.
    #[inline]
    #[must_use]
    fn at_most(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// self², once rounded.
    #[inline]
    #[must_use]
    fn squared(self) -> Self {
        self * self
    }

    /// self/denominator where the denominator is not below [`Self::TINY`], the quotient by that elsewhere: finite, and 0 for
    /// 0/0, for what vanishes at least as fast as its denominator. No branch.
    #[inline]
    #[must_use]
    fn over(self, denominator: Self) -> Self {
        self / denominator.at_least(Self::TINY)
    }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const HALF: Self = 0.5;
    const ONE: Self = 1.0;
    const TWO: Self = 2.0;
    const FOUR: Self = 4.0;
    const FRAC_1_PI: Self = core::f64::consts::FRAC_1_PI;
    const INFINITY: Self = Self::INFINITY;
    const TINY: Self = 1e-290;
    const LITTLE: Self = 1.0 / 65536.0;

    #[inline]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline]
    fn with_sign(self, other: Self) -> Self {
        self.copysign(other)
    }

    /// Dekker 1971: both factors split into halves of 26 bits, whose products are exact.
    #[inline]
    fn product(self, other: Self) -> (Self, Self) {
        const SPLIT: f64 = 134_217_729.0; // 2^27 + 1
        let halves = |x: f64| {
            let shifted = SPLIT * x;
            let high = shifted - (shifted - x);
            (high, x - high)
        };
        let rounded = self * other;
        let ((a, b), (c, d)) = (halves(self), halves(other));
        (rounded, ((a * c - rounded) + a * d + b * c) + b * d)
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const HALF: Self = 0.5;
    const ONE: Self = 1.0;
    const TWO: Self = 2.0;
    const FOUR: Self = 4.0;
    const FRAC_1_PI: Self = core::f32::consts::FRAC_1_PI;
    const INFINITY: Self = Self::INFINITY;
    const TINY: Self = 1e-30;
    const LITTLE: Self = 1.0 / 65536.0;

    #[inline]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline]
    fn with_sign(self, other: Self) -> Self {
        self.copysign(other)
    }

    /// The product of two f32 is exact in f64.
    #[inline]
    fn product(self, other: Self) -> (Self, Self) {
        let rounded = self * other;
        (rounded, single(f64::from(self) * f64::from(other) - f64::from(rounded)))
    }
}

/// Rounded to single precision.
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is meant")]
pub(crate) fn single(x: f64) -> f32 {
    x as f32
}
