//! The AVX2 instance of [`super::blocks`].
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
    __m128i as Half, __m256i as Vector, _mm_packus_epi16, _mm256_abs_epi16 as abs_epi16, _mm256_add_epi16 as add_epi16,
    _mm256_add_epi32 as add_epi32, _mm256_adds_epi16 as adds_epi16, _mm256_and_si256 as and,
    _mm256_andnot_si256 as andnot, _mm256_castsi256_si128, _mm256_cmpeq_epi16 as cmpeq_epi16,
    _mm256_cmpgt_epi32 as cmpgt_epi32, _mm256_extracti128_si256, _mm256_madd_epi16 as madd_epi16,
    _mm256_max_epi16 as max_epi16, _mm256_max_epu16 as max_epu16, _mm256_min_epu16 as min_epu16,
    _mm256_min_epu32 as min_epu32, _mm256_mulhrs_epi16 as mulhrs_epi16, _mm256_or_si256 as or,
    _mm256_packs_epi32 as packs_epi32, _mm256_set1_epi16 as splat_epi16, _mm256_set1_epi32 as splat_epi32,
    _mm256_setzero_si256 as zero, _mm256_srai_epi16 as srai_epi16, _mm256_srav_epi32 as srav_epi32,
    _mm256_srli_epi32 as srli_epi32, _mm256_sub_epi16 as sub_epi16, _mm256_sub_epi32 as sub_epi32,
    _mm256_subs_epu16 as subs_epu16, _mm256_testz_si256, _mm256_unpackhi_epi16 as unpackhi_epi16,
    _mm256_unpacklo_epi16 as unpacklo_epi16, _mm256_xor_si256 as xor,
};

/// Photosites in one register.
const LANES: usize = 16;

twin!("avx2");
memory!("avx2");
rows!("avx2");

/// Whether a bit is set in both.
#[inline]
#[target_feature(enable = "avx2")]
fn intersect(a: Vector, b: Vector) -> bool {
    _mm256_testz_si256(a, b) == 0
}

/// Bytes of values below 256.
#[inline]
#[target_feature(enable = "avx2")]
fn low_bytes(values: Vector) -> Half {
    _mm_packus_epi16(_mm256_castsi256_si128(values), _mm256_extracti128_si256::<1>(values))
}
