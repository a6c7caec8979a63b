//! 16-bit planes on any processor: loops over blocks, each simple enough for the compiler to vectorize.
//!
//! On aarch64 the products become widening multiply-adds of eight photosites. Everything a block needs between its loops
//! stays in the first-level cache. Same bits and same marks as the AVX2 twin.
#![expect(clippy::needless_range_loop, reason = "one index runs over all arrays of a block")]
#![expect(clippy::indexing_slicing, reason = "every index runs over a block, whose length is part of its type")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "integer words change width on purpose; each place says why the value fits"
)]

use super::narrow::{BLOCK, Fast, FastRow, RECOMPUTE};
use super::{Dark, StripInput, StripOutput};
use core::array;
use protocol_polar::Flags;

/// Computes whole blocks, marks what the definition must compute, and says whether there is any.
pub(super) fn strip(fast: &Fast, input: &StripInput, output: StripOutput<i16, u16>) -> bool {
    match input.frames.len() {
        3 => blocks::<3>(fast, input, output),
        4 => blocks::<4>(fast, input, output),
        5 => blocks::<5>(fast, input, output),
        6 => blocks::<6>(fast, input, output),
        7 | 8 => blocks::<8>(fast, input, output),
        9..=12 => blocks::<12>(fast, input, output),
        _ => blocks::<16>(fast, input, output),
    }
}

/// For up to `N` frames: a place beyond the last holds the first again; its weight is 0, and the extremes do not change.
fn blocks<const N: usize>(fast: &Fast, input: &StripInput, output: StripOutput<i16, u16>) -> bool {
    let count = output.flags.len() / BLOCK;
    let cut = |plane| &in_blocks(plane)[..count];
    let frames: [&[[u16; BLOCK]]; N] = array::from_fn(|k| cut(input.frames.get(k).unwrap_or(&input.frames[0])));
    let mut dark = [0; BLOCK];
    let map = match input.dark {
        Dark::Level(level) => {
            dark = [level; BLOCK];
            None
        }
        Dark::Map(map) => Some(cut(map)),
    };
    let flat = input.flat.map(cut);
    let [s0, s1, s2] = output.stokes.map(|plane| &mut plane.as_chunks_mut().0[..count]);
    let residual = &mut output.residual.as_chunks_mut().0[..count];
    let flags = &mut output.flags.as_chunks_mut().0[..count];
    let mut marks = 0;
    for b in 0..count {
        let block = Block {
            frames: frames.map(|frame| &frame[b]),
            dark: map.map_or(&dark, |map| &map[b]),
            flat: flat.map(|flat| &flat[b]),
        };
        marks |= block.compute(fast, [&mut s0[b], &mut s1[b], &mut s2[b]], &mut residual[b], &mut flags[b]);
    }
    marks & RECOMPUTE != 0
}

fn in_blocks(plane: &[u16]) -> &[[u16; BLOCK]] {
    plane.as_chunks().0
}

/// One block's input.
struct Block<'a, const N: usize> {
    frames: [&'a [u16; BLOCK]; N],
    dark: &'a [u16; BLOCK],
    flat: Option<&'a [u16; BLOCK]>,
}

impl<const N: usize> Block<'_, N> {
    fn compute(
        &self,
        fast: &Fast,
        mut stokes: [&mut [i16; BLOCK]; 3],
        residual: &mut [u16; BLOCK],
        flags: &mut [u8; BLOCK],
    ) -> u8 {
        // Marks are as wide as the samples, so that vectors need not change width.
        let mut marks = [0_u16; BLOCK];
        let mut differences = [[0_i16; BLOCK]; N];
        self.subtract_dark(fast.white, &mut differences, &mut marks);
        for (row, out) in fast.stokes_rows().into_iter().zip(&mut stokes) {
            for i in 0..BLOCK {
                out[i] = component(row, &differences, i);
                marks[i] |= at_an_end(out[i]);
            }
        }
        match fast.residual_rows() {
            [] => *residual = [0; BLOCK],
            [row] => {
                for i in 0..BLOCK {
                    residual[i] = component(row, &differences, i).unsigned_abs();
                }
            }
            rows => root_sum_of_squares(rows, &differences, residual),
        }
        if !fast.residual_rows().is_empty() {
            for i in 0..BLOCK {
                let r = u32::from(residual[i]);
                // Up to 2¹⁵, and then it is recomputed: the square is below 2³¹, and so is all that is subtracted.
                let shot = (u32::from(stokes[0][i].max(0) as u16) * fast.misfit_slope as u32) >> 8;
                let misfit = (r * r) as i32 - shot as i32 > fast.misfit_floor;
                marks[i] |= select(misfit, Flags::MISFIT.0) | select(r >= 0x7FFF, RECOMPUTE);
            }
        }
        if let Some(gain) = self.flat {
            for out in &mut stokes {
                for i in 0..BLOCK {
                    // i16 times u16 and the rounding constant stay inside i32.
                    out[i] = clamp_i16((i32::from(out[i]) * i32::from(gain[i]) + (1 << 14)) >> 15);
                    marks[i] |= at_an_end(out[i]);
                }
            }
            for i in 0..BLOCK {
                // 15 bits times almost 2.
                residual[i] = ((u32::from(residual[i]) * u32::from(gain[i]) + (1 << 14)) >> 15) as u16;
            }
        }
        for i in 0..BLOCK {
            flags[i] = marks[i] as u8; // flags are bytes
        }
        flags.iter().fold(0, |all, flags| all | flags)
    }

    /// Differences from dark, exact in 15 bits wherever the photosite is not to be recomputed.
    fn subtract_dark(&self, white: u16, differences: &mut [[i16; BLOCK]; N], marks: &mut [u16; BLOCK]) {
        for i in 0..BLOCK {
            let dark = self.dark[i];
            let (mut brightest, mut signs) = (dark, 0);
            for (difference, frame) in differences.iter_mut().zip(&self.frames) {
                brightest = brightest.max(frame[i]);
                difference[i] = frame[i].wrapping_sub(dark) as i16;
                signs |= difference[i];
            }
            marks[i] = select(brightest >= white, RECOMPUTE) | select(signs < 0, Flags::BELOW_BLACK.0);
        }
    }
}

fn select(condition: bool, flag: u8) -> u16 {
    u16::from(condition) * u16::from(flag)
}

/// A value at an end of its word may have been clamped.
fn at_an_end(s: i16) -> u16 {
    select((s == i16::MAX) | (s == i16::MIN), RECOMPUTE)
}

/// (Σ q_k (x_k − dark) + ½) >> shift, clamped. What overflows is recomputed.
#[inline(always)]
fn component<const N: usize>(row: &FastRow, differences: &[[i16; BLOCK]; N], i: usize) -> i16 {
    let mut sum = row.half;
    for k in 0..N {
        sum = sum.wrapping_add(i32::from(row.q[k]) * i32::from(differences[k][i]));
    }
    clamp_i16(sum >> row.shift)
}

#[inline(always)]
fn clamp_i16(value: i32) -> i16 {
    value.clamp(i16::MIN.into(), i16::MAX.into()) as i16
}

fn root_sum_of_squares<const N: usize>(rows: &[FastRow], differences: &[[i16; BLOCK]; N], residual: &mut [u16; BLOCK]) {
    let mut squares = [0_u32; BLOCK];
    for row in rows {
        for i in 0..BLOCK {
            let r = i32::from(component(row, differences, i));
            // Clamped to 2³⁰, whose root says that the photosite is to be recomputed.
            squares[i] = (squares[i] + (r * r) as u32).min(1 << 30);
        }
    }
    let most = squares.iter().fold(0, |most, square| most | square);
    let mut roots = [0_u32; BLOCK];
    // Bit by bit, from the highest that any of the block has: `square` becomes what is left.
    for bit in (0..(u32::BITS - most.leading_zeros()).div_ceil(2)).rev().map(|bit| 1_u32 << (2 * bit)) {
        for (root, rest) in roots.iter_mut().zip(&mut squares) {
            let trial = *root + bit;
            let fits = *rest >= trial;
            *rest -= if fits { trial } else { 0 };
            *root = (*root >> 1) + if fits { bit } else { 0 };
        }
    }
    for (to, root) in residual.iter_mut().zip(&roots) {
        *to = *root as u16; // the root of 2³⁰ at most
    }
}
