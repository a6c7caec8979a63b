//! 16-bit planes, 32-bit accumulators: the fast setting.
//!
//! Work goes in blocks of [`BLOCK`] photosites that stay in the first-level cache: each loop below is one pass over a block,
//! simple enough to be vectorized. What is rare (a saturated sample, a clamped value) is found by block and then recomputed
//! photosite by photosite with the definition.
#![expect(clippy::indexing_slicing, reason = "every index runs over a block, whose length is part of its type")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "integer words change width on purpose; each place says why the value fits"
)]

use super::{Dark, StripError, StripInput, StripOutput, WeightTable, check, gain_at};
use protocol_polar::fixed::{Row, StokesPlan, Weights, Word};
use protocol_polar::{Flags, MAX_FRAMES};

/// Photosites per block: all arrays of one block together take about 4 KiB.
const BLOCK: usize = 128;

/// Computes one strip with 16-bit planes. Shapes: see [`StripInput`] and [`StripOutput`].
///
/// # Errors
/// [`StripError`]; nothing is written then.
pub fn stokes_i16(
    plan: &StokesPlan,
    table: &mut WeightTable,
    input: StripInput,
    output: StripOutput<i16, u16>,
) -> Result<(), StripError> {
    let photosites = check(plan, &input, &output)?;
    if plan.format().word != Word::I16 {
        return Err(StripError::Format);
    }
    // A checked plan has weights for the full set.
    let Some(weights) = table.weights(plan, 0).cloned() else { return Err(StripError::Format) };
    let fast = Fast::new(plan, &weights);
    let [s0, s1, s2] = output.stokes;
    let mut strip = Strip { plan, table, input, s: [s0, s1, s2], residual: output.residual, flags: output.flags };
    let mut start = 0;
    while start + BLOCK <= photosites {
        strip.block(&fast, start);
        start += BLOCK;
    }
    for i in start..photosites {
        strip.by_definition(i);
    }
    Ok(())
}

/// The weights of the full set, in the kernel's own widths.
struct Fast {
    rows: [FastRow; MAX_FRAMES],
    residual_rows: usize,
    white: u16,
    misfit_floor: u32,
    misfit_slope: u32,
}

#[derive(Clone, Copy)]
struct FastRow {
    q: [i16; MAX_FRAMES],
    half: i32,
    shift: u32,
    /// Σ q: a dark level common to all frames comes out as one product.
    sum: i32,
}

impl FastRow {
    fn new(row: &Row) -> Self {
        Self {
            q: row.q.map(|q| q as i16), // 16-bit planes have 16-bit weights, by construction of the row
            half: row.half as i32,      // below the accumulator's limit, by construction of the row
            shift: u32::from(row.shift),
            sum: row.q.iter().fold(0_i32, |sum, q| sum.wrapping_add(*q)),
        }
    }
}

impl Fast {
    fn new(plan: &StokesPlan, weights: &Weights) -> Self {
        let mut rows = [FastRow { q: [0; MAX_FRAMES], half: 0, shift: 1, sum: 0 }; MAX_FRAMES];
        for (to, from) in rows.iter_mut().zip(weights.stokes_rows().iter().chain(weights.residual_rows())) {
            *to = FastRow::new(from);
        }
        Self {
            rows,
            residual_rows: weights.residual_rows().len(),
            white: plan.range().white_level,
            misfit_floor: u32::try_from(weights.misfit().floor).unwrap_or(u32::MAX),
            misfit_slope: u32::try_from(weights.misfit().slope).unwrap_or(0),
        }
    }
}

struct Strip<'a, 't> {
    plan: &'a StokesPlan,
    table: &'t mut WeightTable,
    input: StripInput<'a>,
    s: [&'a mut [i16]; 3],
    residual: &'a mut [u16],
    flags: &'a mut [u8],
}

/// One block's frames and darks, and its results.
struct Block<'a> {
    frames: [&'a [u16; BLOCK]; MAX_FRAMES],
    dark: [u16; BLOCK],
    s: [[i16; BLOCK]; 3],
    residual: [u16; BLOCK],
    flags: [u8; BLOCK],
    /// Something rare is in this block.
    rare: bool,
}

impl<'a> Strip<'a, '_> {
    fn block(&mut self, fast: &Fast, start: usize) {
        const EMPTY: &[u16; BLOCK] = &[0; BLOCK];
        let range = start..start + BLOCK;
        let of = |frame: &'a [u16]| frame[range.clone()].first_chunk().unwrap_or(EMPTY);
        // Places beyond the last frame hold the first one again: their weight is 0 and the extremes do not change.
        let mut frames = [of(self.input.frames[0]); MAX_FRAMES];
        for (to, from) in frames.iter_mut().zip(self.input.frames) {
            *to = of(from);
        }
        let mut dark = [0; BLOCK];
        match self.input.dark {
            Dark::Level(level) => dark = [level; BLOCK],
            Dark::Map(map) => dark.copy_from_slice(&map[range.clone()]),
        }
        let mut block =
            Block { frames, dark, s: [[0; BLOCK]; 3], residual: [0; BLOCK], flags: [0; BLOCK], rare: false };
        simd::run(fast, self.input.frames.len(), self.input.flat.map(|flat| &flat[range.clone()]), &mut block);
        for (plane, values) in self.s.iter_mut().zip(&block.s) {
            plane[range.clone()].copy_from_slice(values);
        }
        self.residual[range.clone()].copy_from_slice(&block.residual);
        self.flags[range.clone()].copy_from_slice(&block.flags);
        if block.rare {
            for i in range {
                let saturated = self.input.frames.iter().any(|frame| frame[i] >= fast.white);
                let clamped = self.s.iter().any(|plane| plane[i] == i16::MIN || plane[i] == i16::MAX);
                // With a flat, a value may have been clamped before the gain and lie anywhere after it.
                if saturated || clamped || self.input.flat.is_some() {
                    self.by_definition(i);
                }
            }
        }
    }

    fn by_definition(&mut self, i: usize) {
        let mut samples = [0; MAX_FRAMES];
        let samples = &mut samples[..self.input.frames.len()];
        for (sample, frame) in samples.iter_mut().zip(self.input.frames) {
            *sample = frame[i];
        }
        let weights = self.table.weights(self.plan, self.plan.saturated(samples));
        let photosite = self.plan.photosite(weights, samples, self.input.dark.at(i), gain_at(self.input.flat, i));
        for (plane, value) in self.s.iter_mut().zip(photosite.stokes) {
            plane[i] = value as i16; // clamped to the format's limits
        }
        self.residual[i] = photosite.residual as u16; // clamped to the format's limit
        self.flags[i] = photosite.flags.0;
    }
}

/// The passes over one block, for a number of frames known when compiled.
///
/// `inline(always)`: compiled once for each instruction set that calls it.
#[inline(always)]
fn passes<const N: usize>(fast: &Fast, flat: Option<&[u16]>, block: &mut Block) {
    let frames: [&[u16; BLOCK]; N] = core::array::from_fn(|k| block.frames[k]);
    let dark = &block.dark;

    let mut brightest = 0;
    for i in 0..BLOCK {
        let mut low = frames[0][i];
        let mut high = low;
        for frame in &frames[1..] {
            low = low.min(frame[i]);
            high = high.max(frame[i]);
        }
        brightest = brightest.max(high);
        block.flags[i] = u8::from(low < dark[i]) * Flags::BELOW_BLACK.0;
    }
    let mut rare = brightest >= fast.white;

    for (row, out) in fast.rows.iter().zip(&mut block.s) {
        let (mut least, mut most) = (i32::MAX, i32::MIN);
        for i in 0..BLOCK {
            let value = component(row, &frames, dark, i);
            least = least.min(value);
            most = most.max(value);
            out[i] = clamp_i16(value);
        }
        rare |= least < i32::from(i16::MIN) || most > i32::from(i16::MAX);
    }

    if let [row] = &fast.rows[3..3 + fast.residual_rows] {
        for i in 0..BLOCK {
            block.residual[i] = component(row, &frames, dark, i).unsigned_abs().min(65535) as u16;
        }
    } else if fast.residual_rows > 1 {
        let mut sum = [0_u32; BLOCK];
        for row in &fast.rows[3..3 + fast.residual_rows] {
            for i in 0..BLOCK {
                // Beyond 65535 the root saturates whatever the rest is, and so does this.
                let r = component(row, &frames, dark, i).unsigned_abs().min(65535);
                sum[i] = sum[i].saturating_add(r * r);
            }
        }
        for i in 0..BLOCK {
            block.residual[i] = isqrt(sum[i]);
        }
    }
    if fast.residual_rows > 0 {
        for i in 0..BLOCK {
            let r = u32::from(block.residual[i]);
            // 15 bits of s0 times 17 bits of slope, and a floor of 31 bits: the sum fits.
            let s0 = u32::from(block.s[0][i].max(0) as u16);
            let allowed = fast.misfit_floor.wrapping_add((s0 * fast.misfit_slope) >> 8);
            block.flags[i] |= u8::from(r * r > allowed) * Flags::MISFIT.0;
        }
    }

    if let Some(gain) = flat.and_then(|flat| flat.first_chunk::<BLOCK>()) {
        for out in &mut block.s {
            let mut clamped = 0;
            for i in 0..BLOCK {
                // i16 times u16 and the rounding constant stay inside i32.
                let scaled = (i32::from(out[i]) * i32::from(gain[i]) + (1 << 14)) >> 15;
                out[i] = clamp_i16(scaled);
                clamped |= scaled ^ i32::from(out[i]);
            }
            rare |= clamped != 0;
        }
        for i in 0..BLOCK {
            let scaled = (u32::from(block.residual[i]) * u32::from(gain[i]) + (1 << 14)) >> 15;
            block.residual[i] = scaled.min(65535) as u16;
        }
    }
    block.rare = rare;
}

/// (Σ q_k x_k − dark Σ q_k + ½) >> shift. Partial sums may wrap; the whole does not, and wrapping is exact modulo 2³².
#[inline(always)]
fn component<const N: usize>(row: &FastRow, frames: &[&[u16; BLOCK]; N], dark: &[u16; BLOCK], i: usize) -> i32 {
    let mut sum = row.half.wrapping_sub(row.sum.wrapping_mul(i32::from(dark[i])));
    for k in 0..N {
        // A sample of 16 bits turns negative here; it is beyond white, and its photosite is computed again.
        sum = sum.wrapping_add(i32::from(row.q[k]) * i32::from(frames[k][i] as i16));
    }
    sum >> row.shift
}

#[inline(always)]
fn clamp_i16(value: i32) -> i16 {
    value.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}

/// Largest integer whose square is at most `x`, digit by digit without branches, so that it vectorizes.
#[inline(always)]
fn isqrt(x: u32) -> u16 {
    let (mut rest, mut root) = (x, 0_u32);
    for step in (0..16).rev() {
        let bit = 1_u32 << (2 * step);
        let trial = root + bit;
        let fits = rest >= trial;
        rest -= if fits { trial } else { 0 };
        root = (root >> 1) + if fits { bit } else { 0 };
    }
    root as u16 // below 2¹⁶
}

/// Picks the widest vectors this processor has. The result is the same bits everywhere.
mod simd {
    use super::{Block, Fast, passes};

    #[cfg(target_arch = "x86_64")]
    cpufeatures::new!(has_avx2, "avx2");

    pub(super) fn run(fast: &Fast, frames: usize, flat: Option<&[u16]>, block: &mut Block) {
        #[cfg(target_arch = "x86_64")]
        if has_avx2::get() {
            // SAFETY: the processor has just said that it has AVX2, the only thing the function asks for.
            #[expect(
                unsafe_code,
                reason = "calling a function compiled for more than the baseline; 3x faster on x86-64"
            )]
            unsafe {
                run_avx2(fast, frames, flat, block);
            }
            return;
        }
        by_count(fast, frames, flat, block);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn run_avx2(fast: &Fast, frames: usize, flat: Option<&[u16]>, block: &mut Block) {
        by_count(fast, frames, flat, block);
    }

    #[inline(always)]
    fn by_count(fast: &Fast, frames: usize, flat: Option<&[u16]>, block: &mut Block) {
        match frames {
            3 => passes::<3>(fast, flat, block),
            4 => passes::<4>(fast, flat, block),
            5 => passes::<5>(fast, flat, block),
            6 => passes::<6>(fast, flat, block),
            7 | 8 => passes::<8>(fast, flat, block),
            9..=12 => passes::<12>(fast, flat, block),
            _ => passes::<16>(fast, flat, block),
        }
    }
}
