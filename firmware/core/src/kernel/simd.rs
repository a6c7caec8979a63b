//! Picks the widest vectors this processor has. The result is the same bits everywhere.

use super::narrow::Twin;
use super::portable;
#[cfg(target_arch = "x86_64")]
use super::x86;

#[cfg(target_arch = "x86_64")]
cpufeatures::new!(has_avx2, "avx2");
#[cfg(target_arch = "x86_64")]
cpufeatures::new!(has_avx512, "avx512f", "avx512bw", "avx512dq", "avx512vl");

/// The twins for 16-bit planes that this processor can run, the fastest first.
pub(super) fn twins() -> [Option<Twin>; 3] {
    #[cfg(target_arch = "x86_64")]
    {
        let avx512: Twin = |fast, input, output| {
            // SAFETY: given out below only where the processor has the four parts of AVX-512 that the function asks for.
            #[expect(unsafe_code, reason = "a function compiled for more than the baseline; 4x faster than portable")]
            unsafe {
                x86::avx512::strip(fast, input, output)
            }
        };
        let avx2: Twin = |fast, input, output| {
            // SAFETY: given out below only where the processor has AVX2, the only thing the function asks for.
            #[expect(unsafe_code, reason = "a function compiled for more than the baseline; 2x faster than portable")]
            unsafe {
                x86::avx2::strip(fast, input, output)
            }
        };
        [has_avx512::get().then_some(avx512), has_avx2::get().then_some(avx2), Some(portable::strip)]
    }
    #[cfg(not(target_arch = "x86_64"))]
    [None, None, Some(portable::strip)]
}

/// The fastest of [`twins`].
pub(super) fn narrow() -> Twin {
    twins().into_iter().flatten().next().unwrap_or(portable::strip)
}

/// Calls `work`, compiled for the widest vectors this processor has. What `work` calls must be inlined to profit.
#[inline(always)]
pub(super) fn widest(work: impl FnOnce()) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        fn with_avx512(work: impl FnOnce()) {
            work();
        }
        #[target_feature(enable = "avx2")]
        fn with_avx2(work: impl FnOnce()) {
            work();
        }
        if has_avx512::get() {
            // SAFETY: the processor has just said that it has the four parts of AVX-512 the function asks for.
            #[expect(
                unsafe_code,
                reason = "calling a function compiled for more than the baseline; 4x faster on x86-64"
            )]
            return unsafe { with_avx512(work) };
        }
        if has_avx2::get() {
            // SAFETY: the processor has just said that it has AVX2, the only thing the function asks for.
            #[expect(
                unsafe_code,
                reason = "calling a function compiled for more than the baseline; 2x faster on x86-64"
            )]
            return unsafe { with_avx2(work) };
        }
    }
    work();
}
