//! The arithmetic of the closed forms: one pixel in f64, or eight in f32 side by side. No branches, so that both are the
//! same code; a choice is [`Real::less`], which is false for NaN. Nothing is fused: every processor gives the same bits.
//!
//! What is generic over [`Real`] must be inlined into a function compiled for the instructions of its lanes, so here and in what
//! builds on it: `#[inline(always)]`, loops instead of closures, and large values by reference.

use core::ops::{Add, Div, Mul, Neg, Sub};
use wide::f32x8;

/// A vector of three, lane by lane.
pub(super) type Triple<R> = [R; 3];

/// Pixels side by side.
pub(super) const LANES: usize = 8;

/// A real number per pixel.
pub(super) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The same number in every pixel.
    fn of(x: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// `then` where `self < other`, else (NaN included) `otherwise`.
    fn less(self, other: Self, then: Self, otherwise: Self) -> Self;
    /// Pixel by pixel.
    fn each(v: Triple<Self>, f: impl FnMut([f32; 3]) -> [f32; 3]) -> Triple<Self>;

    /// `other` where either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.less(other, self, other)
    }

    /// `other` where either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        other.less(self, self, other)
    }

    /// 1 where `self < other`, else 0.
    #[inline(always)]
    fn is_less(self, other: Self) -> Self {
        self.less(other, Self::of(1.0), Self::of(0.0))
    }

    /// `self`, or `otherwise` where it is NaN or huge.
    #[inline(always)]
    fn finite_or(self, otherwise: Self) -> Self {
        self.abs().less(Self::of(1e30), self, otherwise)
    }

    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }
}

/// Eight pixels in f32.
pub(super) trait Lanes: Real {
    fn load(x: [f32; LANES]) -> Self;
    fn store(self) -> [f32; LANES];

    /// [`Real::each`] of eight.
    #[inline(always)]
    fn each_lane(v: &Triple<Self>, mut f: impl FnMut([f32; 3]) -> [f32; 3]) -> Triple<Self> {
        let (x, y, z) = (v[0].store(), v[1].store(), v[2].store());
        let mut out = [[0.0; LANES]; 3];
        for k in 0..LANES {
            let [a, b, c] = f([x[k], y[k], z[k]]);
            out[0][k] = a;
            out[1][k] = b;
            out[2][k] = c;
        }
        [Self::load(out[0]), Self::load(out[1]), Self::load(out[2])]
    }
}

/// A piece of work that is generic over its lanes.
pub(super) trait Work {
    fn run<R: Lanes>(self);
}

impl Real for f64 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn less(self, other: Self, then: Self, otherwise: Self) -> Self {
        if self < other { then } else { otherwise }
    }
    #[inline(always)]
    fn each(v: Triple<Self>, mut f: impl FnMut([f32; 3]) -> [f32; 3]) -> Triple<Self> {
        f(v.map(single)).map(Self::from)
    }
}

impl Real for f32x8 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(single(x))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn less(self, other: Self, then: Self, otherwise: Self) -> Self {
        self.simd_lt(other).bitselect(then, otherwise)
    }
    #[inline(always)]
    fn each(v: Triple<Self>, f: impl FnMut([f32; 3]) -> [f32; 3]) -> Triple<Self> {
        Self::each_lane(&v, f)
    }
}

impl Lanes for f32x8 {
    #[inline(always)]
    fn load(x: [f32; LANES]) -> Self {
        Self::from(x)
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        self.to_array()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what is asked for")]
pub(super) fn single(x: f64) -> f32 {
    x as f32
}

#[inline(always)]
pub(super) fn dot<R: Real>(a: Triple<R>, b: Triple<R>) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross<R: Real>(a: Triple<R>, b: Triple<R>) -> Triple<R> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + b · s.
#[inline(always)]
pub(super) fn along<R: Real>(a: Triple<R>, b: Triple<R>, s: R) -> Triple<R> {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}

#[inline(always)]
pub(super) fn times<R: Real>(a: Triple<R>, s: R) -> Triple<R> {
    // Spelled out, as `map` is not always inlined.
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `then` where `a < b`, else `otherwise`.
#[inline(always)]
pub(super) fn choose<R: Real>(a: R, b: R, then: Triple<R>, otherwise: Triple<R>) -> Triple<R> {
    [a.less(b, then[0], otherwise[0]), a.less(b, then[1], otherwise[1]), a.less(b, then[2], otherwise[2])]
}
