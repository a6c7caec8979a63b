//! Interval arithmetic: enclosures of what real arithmetic gives.
//!
//! Results are rounded to nearest and not outward: an enclosure may be off by some 1e-15 of itself, which its users cover by
//! inflating their bounds by 1e-6.

use core::ops::{Add, Mul, Neg, Sub};

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Interval {
    pub(crate) fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    pub(crate) fn at(x: f64) -> Self {
        Self { low: x, high: x }
    }

    /// Largest modulus.
    pub(crate) fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub(crate) fn square(self) -> Self {
        let (a, b) = (self.low * self.low, self.high * self.high);
        let low = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { a.min(b) };
        Self { low, high: a.max(b) }
    }

    /// 1/x; everything where x may vanish.
    pub(crate) fn reciprocal(self) -> Self {
        if self.low > 0.0 || self.high < 0.0 {
            Self { low: 1.0 / self.high, high: 1.0 / self.low }
        } else {
            Self { low: f64::NEG_INFINITY, high: f64::INFINITY }
        }
    }

    /// √x of what of x is not negative.
    pub(crate) fn sqrt(self) -> Self {
        Self { low: self.low.max(0.0).sqrt(), high: self.high.max(0.0).sqrt() }
    }

    /// The smallest interval around both.
    pub(crate) fn hull(self, o: Self) -> Self {
        Self { low: self.low.min(o.low), high: self.high.max(o.high) }
    }

    pub(crate) fn offset(self, k: f64) -> Self {
        Self { low: self.low + k, high: self.high + k }
    }

    pub(crate) fn clamp(self, low: f64, high: f64) -> Self {
        Self { low: self.low.clamp(low, high), high: self.high.clamp(low, high) }
    }

    /// f of both ends, for f that grows.
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { low: f(self.low), high: f(self.high) }
    }

    pub(crate) fn exp(self) -> Self {
        Self { low: self.low.exp(), high: self.high.exp() }
    }

    pub(crate) fn scale(self, k: f64) -> Self {
        let (a, b) = (self.low * k, self.high * k);
        Self { low: a.min(b), high: a.max(b) }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { low: self.low + o.low, high: self.high + o.high }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { low: self.low - o.high, high: self.high - o.low }
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        // 0 · ∞ is 0 here: the infinite end is a bound, not a value.
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let p = [
            product(self.low, o.low),
            product(self.low, o.high),
            product(self.high, o.low),
            product(self.high, o.high),
        ];
        Self { low: p.into_iter().fold(f64::INFINITY, f64::min), high: p.into_iter().fold(f64::NEG_INFINITY, f64::max) }
    }
}
