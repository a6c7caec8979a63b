//! Value, first and second derivative along one coordinate, each an interval: enclosures of derivatives over a box.

use super::Interval;
use core::ops::{Add, Mul, Sub};

/// f, f', f''.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet {
    pub(crate) value: Interval,
    pub(crate) first: Interval,
    pub(crate) second: Interval,
}

impl Jet {
    pub(crate) fn constant(value: Interval) -> Self {
        Self { value, first: Interval::at(0.0), second: Interval::at(0.0) }
    }

    /// a + b x for the coordinate x itself.
    pub(crate) fn linear(a: Interval, b: Interval, x: Interval) -> Self {
        Self { value: a + b * x, first: b, second: Interval::at(0.0) }
    }

    pub(crate) fn scale(self, k: f64) -> Self {
        Self { value: self.value.scale(k), first: self.first.scale(k), second: self.second.scale(k) }
    }

    /// Times a number that is known within an interval.
    pub(crate) fn scale_by(self, k: Interval) -> Self {
        Self { value: self.value * k, first: self.first * k, second: self.second * k }
    }

    pub(crate) fn offset(self, k: f64) -> Self {
        Self { value: self.value + Interval::at(k), ..self }
    }

    pub(crate) fn square(self) -> Self {
        let Self { value, first, second } = self;
        Self {
            value: value.square(),
            first: (value * first).scale(2.0),
            second: (first.square() + value * second).scale(2.0),
        }
    }

    /// g(f) for g with these enclosures of g, g', g'' over the values of f.
    fn through(self, g: Interval, g1: Interval, g2: Interval) -> Self {
        Self { value: g, first: g1 * self.first, second: g2 * self.first.square() + g1 * self.second }
    }

    pub(crate) fn reciprocal(self) -> Self {
        let r = self.value.reciprocal();
        let r2 = r.square();
        self.through(r, -r2, (r2 * r).scale(2.0))
    }

    pub(crate) fn sqrt(self) -> Self {
        let s = self.value.sqrt();
        let r = s.reciprocal();
        self.through(s, r.scale(0.5), (r.square() * r).scale(-0.25))
    }

    pub(crate) fn exp(self) -> Self {
        let e = self.value.exp();
        self.through(e, e, e)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, first: self.first + o.first, second: self.second + o.second }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, first: self.first - o.first, second: self.second - o.second }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            first: self.first * o.value + self.value * o.first,
            second: self.second * o.value + (self.first * o.first).scale(2.0) + self.value * o.second,
        }
    }
}
