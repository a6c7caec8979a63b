//! Eight lanes in one AVX2 register: the same bits as the portable lanes, in half the instructions.
#![expect(unsafe_code, reason = "vector instructions, and a function compiled for more than the baseline")]

use super::real::{LANES, Lanes, Real, Triple, Work, single};
use core::arch::x86_64::{
    __m256, _CMP_LT_OQ, _mm256_add_ps, _mm256_andnot_ps, _mm256_blendv_ps, _mm256_cmp_ps, _mm256_div_ps,
    _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_sqrt_ps, _mm256_storeu_ps,
    _mm256_sub_ps, _mm256_xor_ps,
};
use core::ops::{Add, Div, Mul, Neg, Sub};

/// Eight numbers. Values are made and used by the work of [`with_avx2`] alone.
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

/// Does `work` with AVX2, or gives it back on a processor without.
#[inline(always)]
pub(super) fn with_avx2<W: Work>(work: W) -> Result<(), W> {
    #[target_feature(enable = "avx2")]
    fn compiled<W: Work>(work: W) {
        work.run::<Avx2>();
    }
    if !std::arch::is_x86_feature_detected!("avx2") {
        return Err(work);
    }
    // SAFETY: the processor has just said that it has AVX2, all that the function asks for.
    unsafe { compiled(work) };
    Ok(())
}

/// An instruction that asks for AVX2 only.
macro_rules! avx2 {
    ($call:expr) => {
        // SAFETY: an `Avx2` exists only below `with_avx2`, so on a processor that has it; memory is an array of eight floats and
        // needs no alignment.
        unsafe { $call }
    };
}

impl Add for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(avx2!(_mm256_add_ps(self.0, other.0)))
    }
}

impl Sub for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(avx2!(_mm256_sub_ps(self.0, other.0)))
    }
}

impl Mul for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(avx2!(_mm256_mul_ps(self.0, other.0)))
    }
}

impl Div for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(avx2!(_mm256_div_ps(self.0, other.0)))
    }
}

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(avx2!(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))))
    }
}

impl Real for Avx2 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self(avx2!(_mm256_set1_ps(single(x))))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx2!(_mm256_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx2!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn less(self, other: Self, then: Self, otherwise: Self) -> Self {
        Self(avx2!(_mm256_blendv_ps(otherwise.0, then.0, _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0))))
    }
    #[inline(always)]
    fn each(v: Triple<Self>, f: impl FnMut([f32; 3]) -> [f32; 3]) -> Triple<Self> {
        Self::each_lane(&v, f)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(avx2!(_mm256_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(avx2!(_mm256_max_ps(self.0, other.0)))
    }
}

impl Lanes for Avx2 {
    #[inline(always)]
    fn load(x: [f32; LANES]) -> Self {
        Self(avx2!(_mm256_loadu_ps(x.as_ptr())))
    }
    #[inline(always)]
    fn store(self) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        avx2!(_mm256_storeu_ps(out.as_mut_ptr(), self.0));
        out
    }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "small numbers")]
mod tests {
    use super::super::SkyTable;
    use super::super::kernel::solve;
    use super::super::phase::Seen;
    use super::*;
    use wide::f32x8;

    /// Answers of many pixels of noise, some of them no numbers at all.
    struct Pixels<'a> {
        sky: &'a SkyTable,
        out: &'a mut Vec<[f32; LANES]>,
    }

    struct Random(u64);

    impl Random {
        fn lanes<R: Lanes>(&mut self, middle: f32, width: f32) -> R {
            R::load(core::array::from_fn(|_| {
                self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let uniform = single((self.0 >> 33) as f64 / f64::from(1_u32 << 31));
                match self.0 >> 58 {
                    0 => f32::NAN,
                    1 => f32::INFINITY,
                    2 => 0.0,
                    _ => middle + width * (uniform - 0.5),
                }
            }))
        }
    }

    impl Work for Pixels<'_> {
        fn run<R: Lanes>(self) {
            let mut random = Random(1);
            for _ in 0..200 {
                let mut seen = [Seen::<R>::nothing(); 3];
                for (v, view) in seen.iter_mut().enumerate() {
                    view.present = R::of(1.0);
                    let (s, c) = (2.0 * v as f64).sin_cos();
                    view.direction = [R::of(0.8 * c), R::of(0.8 * s), R::of(0.6)];
                    view.x = [R::of(-s), R::of(c), R::of(0.0)];
                    view.y = [R::of(-0.6 * c), R::of(-0.6 * s), R::of(0.8)];
                    for b in 0..3 {
                        view.stokes[b] = [random.lanes(0.6, 0.4), random.lanes(0.1, 0.2), random.lanes(0.0, 0.2)];
                        view.covariance[b] = [R::of(1e-6); 6];
                        view.covariance[b][3] = random.lanes(2e-6, 1e-6);
                    }
                }
                let found = solve(&seen, self.sky);
                self.out.extend(found.normal.iter().chain(&found.albedo).chain(&found.sigma_albedo).map(|x| x.store()));
                let rest = [found.eta, found.alpha, found.sigma_eta, found.sigma_normal, found.reasons];
                self.out.extend(rest.map(Lanes::store));
            }
        }
    }

    #[test]
    fn every_processor_gives_the_same_bits() {
        let tilted = |w: glam::DVec3| [[1.0 + w.x, 0.0, 0.0], [2.0 + w.y * w.z, 0.0, 0.0], [1.0, 0.0, 0.0]];
        for sky in [SkyTable::uniform([1.0, 0.5, 2.0]), SkyTable::sample(tilted, |n| [1.0 + n.z; 3], 9)] {
            let (mut wide, mut portable) = (Vec::new(), Vec::new());
            if with_avx2(Pixels { sky: &sky, out: &mut wide }).is_err() {
                println!("skipped: no AVX2");
                return;
            }
            Pixels { sky: &sky, out: &mut portable }.run::<f32x8>();
            for (wide, portable) in wide.iter().zip(&portable) {
                assert_eq!(wide.map(f32::to_bits), portable.map(f32::to_bits), "{wide:?} and {portable:?}");
                assert!(wide.iter().all(|x| !x.is_nan()));
            }
        }
    }
}
