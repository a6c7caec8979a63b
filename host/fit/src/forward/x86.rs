//! The contraction of a table with AVX2 and FMA: the compiler does not find the vectors in the portable loops by itself.
#![expect(unsafe_code, reason = "vector loads, and a function compiled for more than the baseline; 6x faster")]

use super::respond::{Contraction, MOST_BLOCKS, Sums};
use super::view::BLOCK;
use core::arch::x86_64::{
    __m256, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_set1_ps, _mm256_setzero_ps, _mm256_storeu_ps,
};

/// [`Contraction::portable`], or `None` on a processor without AVX2 and FMA.
#[inline]
pub(super) fn sums(work: &Contraction<'_>) -> Option<Sums> {
    if !(std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")) {
        return None;
    }
    // SAFETY: the processor has just said that it has AVX2 and FMA, all that these functions ask for.
    Some(unsafe {
        match work.blocks {
            2 => sum::<2>(work),
            3 => sum::<3>(work),
            4 => sum::<4>(work),
            5 => sum::<5>(work),
            6 => sum::<6>(work),
            _ => sum::<MOST_BLOCKS>(work),
        }
    })
}

/// As [`Contraction::sum`].
#[target_feature(enable = "avx2,fma")]
fn sum<const B: usize>(work: &Contraction<'_>) -> Sums {
    let zero = [_mm256_setzero_ps(); B];
    let mut total = [zero; 4];
    for (k, (level, [x, y])) in work.levels.iter().zip(&work.places).enumerate() {
        let stride = work.count * B;
        let mut plane = [zero; 3];
        for j in 0..3 {
            let mut row = [zero; 2];
            let start = ((y.first + j) * level.axes[0].nodes + x.first) * stride;
            let nodes = level.values[start..start + 3 * stride].chunks_exact(stride);
            for ((weight, slope), node) in x.weights.iter().zip(&x.slopes).zip(nodes) {
                let mut value = zero;
                for (term, blocks) in work.terms.iter().zip(node.as_chunks::<B>().0) {
                    let term = _mm256_set1_ps(*term);
                    for b in 0..B {
                        value[b] = _mm256_fmadd_ps(term, load(&blocks[b]), value[b]);
                    }
                }
                add(&mut row[0], *weight, &value);
                add(&mut row[1], *slope, &value);
            }
            add(&mut plane[0], y.weights[j], &row[0]);
            add(&mut plane[1], y.weights[j], &row[1]);
            add(&mut plane[2], y.slopes[j], &row[0]);
        }
        let (weight, slope) = (work.roughness.weights[k], work.roughness.slopes[k]);
        add(&mut total[0], weight, &plane[0]);
        add(&mut total[1], slope, &plane[0]);
        add(&mut total[2], weight, &plane[1]);
        add(&mut total[3], weight, &plane[2]);
    }
    let mut out = [[0.0; MOST_BLOCKS * BLOCK]; 4];
    for (out, total) in out.iter_mut().zip(&total) {
        for (out, value) in out.as_chunks_mut::<BLOCK>().0.iter_mut().zip(total) {
            // SAFETY: `out` is eight floats; the store asks for no alignment.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), *value) };
        }
    }
    out
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn add<const B: usize>(sum: &mut [__m256; B], weight: f32, more: &[__m256; B]) {
    let weight = _mm256_set1_ps(weight);
    for b in 0..B {
        sum[b] = _mm256_fmadd_ps(weight, more[b], sum[b]);
    }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn load(values: &[f32; BLOCK]) -> __m256 {
    // SAFETY: `values` is eight floats; the load asks for no alignment.
    unsafe { _mm256_loadu_ps(values.as_ptr()) }
}
