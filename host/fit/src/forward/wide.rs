//! Runs inner loops compiled for the widest vectors this processor has. Fused multiply-adds round differently in the last bit:
//! results agree between processors to f32's rounding.

/// A piece of work that is generic over whether multiply-adds are fused. What it calls must be inlined to profit.
pub(super) trait Work {
    type Out;
    fn run<const FUSED: bool>(self) -> Self::Out;
}

/// `work` at its fastest.
#[inline]
pub(super) fn widest<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn with_avx2<W: Work>(work: W) -> W::Out {
            work.run::<true>()
        }
        if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
            // SAFETY: the processor has just said that it has AVX2 and FMA, all that the function asks for.
            #[expect(unsafe_code, reason = "a function compiled for more than the baseline; 3x faster on x86-64")]
            return unsafe { with_avx2(work) };
        }
    }
    work.run::<false>()
}

/// a b + c.
#[inline(always)]
pub(super) fn fma<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}
