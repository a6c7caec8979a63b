//! The AVX-512 instance of [`super::blocks`]; comparisons make masks here, which become lanes again.
#![expect(
    clippy::indexing_slicing,
    reason = "every index runs over arrays fixed when compiled or slices cut to length"
)]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "bit patterns of lanes, and numbers whose bits the comments count"
)]

use super::{blocks::twin, memory::memory, rows::rows};
use core::arch::x86_64::{
    __m256i as Half, __m512i as Vector, _mm512_abs_epi16 as abs_epi16, _mm512_add_epi16 as add_epi16,
    _mm512_add_epi32 as add_epi32, _mm512_adds_epi16 as adds_epi16, _mm512_and_si512 as and,
    _mm512_andnot_si512 as andnot, _mm512_cmpeq_epi16_mask, _mm512_cmpgt_epi32_mask, _mm512_cvtepi16_epi8,
    _mm512_madd_epi16 as madd_epi16, _mm512_max_epi16 as max_epi16, _mm512_max_epu16 as max_epu16,
    _mm512_min_epu16 as min_epu16, _mm512_min_epu32 as min_epu32, _mm512_movm_epi16, _mm512_movm_epi32,
    _mm512_mulhrs_epi16 as mulhrs_epi16, _mm512_or_si512 as or, _mm512_packs_epi32 as packs_epi32,
    _mm512_set1_epi16 as splat_epi16, _mm512_set1_epi32 as splat_epi32, _mm512_setzero_si512 as zero,
    _mm512_srai_epi16 as srai_epi16, _mm512_srav_epi32 as srav_epi32, _mm512_srli_epi32 as srli_epi32,
    _mm512_sub_epi16 as sub_epi16, _mm512_sub_epi32 as sub_epi32, _mm512_subs_epu16 as subs_epu16,
    _mm512_test_epi32_mask, _mm512_unpackhi_epi16 as unpackhi_epi16, _mm512_unpacklo_epi16 as unpacklo_epi16,
    _mm512_xor_si512 as xor,
};

/// Photosites in one register.
const LANES: usize = 32;

twin!("avx512f,avx512bw,avx512dq,avx512vl");
memory!("avx512f,avx512bw,avx512dq,avx512vl");
rows!("avx512f,avx512bw,avx512dq,avx512vl");

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn cmpeq_epi16(a: Vector, b: Vector) -> Vector {
    _mm512_movm_epi16(_mm512_cmpeq_epi16_mask(a, b))
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn cmpgt_epi32(a: Vector, b: Vector) -> Vector {
    _mm512_movm_epi32(_mm512_cmpgt_epi32_mask(a, b))
}

/// Whether a bit is set in both.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn intersect(a: Vector, b: Vector) -> bool {
    _mm512_test_epi32_mask(a, b) != 0
}

/// Bytes of values below 256.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn low_bytes(values: Vector) -> Half {
    _mm512_cvtepi16_epi8(values)
}
