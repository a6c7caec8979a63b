//! 32-bit planes, 64-bit accumulators: the accurate setting. Loops over blocks that the compiler vectorizes; a photosite with
//! a saturated sample is computed by the definition.
#![expect(clippy::needless_range_loop, reason = "one index runs over all arrays of a block")]
#![expect(clippy::indexing_slicing, reason = "every index runs over a block, whose length is part of its type")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "integer words change width on purpose; each place says why the value fits"
)]

use super::narrow::RECOMPUTE;
use super::{Dark, StripError, StripInput, StripOutput, WeightTable, check, gain_at, simd};
use core::array;
use protocol_polar::fixed::{Row, StokesPlan, Weights, Word};
use protocol_polar::{Flags, MAX_FRAMES};

/// Photosites per block: with sixteen frames, what a block keeps takes 6 KiB.
const BLOCK: usize = 64;

/// Computes one strip with 32-bit planes. Shapes: see [`StripInput`] and [`StripOutput`].
///
/// # Errors
/// [`StripError`]; nothing is written then.
pub fn stokes_i32(
    plan: &StokesPlan,
    table: &mut WeightTable,
    input: StripInput,
    output: StripOutput<i32, u32>,
) -> Result<(), StripError> {
    let photosites = check(plan, &input, &output)?;
    if plan.format().word != Word::I32 {
        return Err(StripError::Format);
    }
    // A checked plan has weights for the full set.
    let Some(weights) = table.weights(plan, 0).cloned() else { return Err(StripError::Format) };
    let white = plan.range().white_level;
    let mut strip = Strip { plan, table, input, output };
    let whole = photosites - photosites % BLOCK;
    for start in (0..whole).step_by(BLOCK) {
        simd::widest(
            #[inline(always)]
            || match input.frames.len() {
                3 => strip.block::<3>(&weights, white, start),
                4 => strip.block::<4>(&weights, white, start),
                5 | 6 => strip.block::<6>(&weights, white, start),
                7 | 8 => strip.block::<8>(&weights, white, start),
                _ => strip.block::<16>(&weights, white, start),
            },
        );
        for i in start..start + BLOCK {
            if strip.output.flags[i] & RECOMPUTE != 0 {
                strip.by_definition(i);
            }
        }
    }
    for i in whole..photosites {
        strip.by_definition(i);
    }
    Ok(())
}

struct Strip<'a, 't> {
    plan: &'a StokesPlan,
    table: &'t mut WeightTable,
    input: StripInput<'a>,
    output: StripOutput<'a, i32, u32>,
}

impl Strip<'_, '_> {
    /// Computes `start..start + BLOCK` of up to `N` frames: a place beyond the last holds the first again, with weight 0.
    #[inline(always)]
    fn block<const N: usize>(&mut self, weights: &Weights, white: u16, start: usize) {
        const EMPTY: &[u16; BLOCK] = &[0; BLOCK];
        let of = |plane: &'_ [u16]| *plane[start..start + BLOCK].first_chunk().unwrap_or(EMPTY);
        let mut marks = [0_u8; BLOCK];
        let mut differences = [[0_i32; BLOCK]; N];
        let dark: [u16; BLOCK] = match self.input.dark {
            Dark::Level(level) => [level; BLOCK],
            Dark::Map(map) => of(map),
        };
        for (k, difference) in differences.iter_mut().enumerate() {
            let frame = of(self.input.frames.get(k).unwrap_or(&self.input.frames[0]));
            for i in 0..BLOCK {
                difference[i] = i32::from(frame[i]) - i32::from(dark[i]);
                marks[i] |= select(frame[i] >= white, RECOMPUTE) | select(frame[i] < dark[i], Flags::BELOW_BLACK.0);
            }
        }
        let mut stokes: [[i32; BLOCK]; 3] = [[0; BLOCK]; 3];
        for (row, out) in weights.stokes_rows().iter().zip(&mut stokes) {
            for i in 0..BLOCK {
                out[i] = clamp_i32(component(row, &differences, i), &mut marks[i]);
            }
        }
        let mut residual = [0_u64; BLOCK];
        match weights.residual_rows() {
            [] => {}
            [row] => {
                for i in 0..BLOCK {
                    residual[i] = component(row, &differences, i).unsigned_abs().min(u32::MAX.into());
                }
            }
            rows => {
                for row in rows {
                    for i in 0..BLOCK {
                        let r = component(row, &differences, i).unsigned_abs().min(u32::MAX.into());
                        residual[i] = residual[i].saturating_add(r * r);
                    }
                }
                roots(&mut residual);
            }
        }
        let misfit = weights.misfit();
        for i in 0..BLOCK {
            let shot = (u64::from(stokes[0][i].max(0) as u32) * misfit.slope) >> 8;
            marks[i] |= select(residual[i] * residual[i] > misfit.floor + shot, Flags::MISFIT.0);
        }
        if let Some(flat) = self.input.flat {
            let gain = of(flat);
            for out in &mut stokes {
                for i in 0..BLOCK {
                    out[i] = clamp_i32((i64::from(out[i]) * i64::from(gain[i]) + (1 << 14)) >> 15, &mut marks[i]);
                }
            }
            for i in 0..BLOCK {
                residual[i] = ((residual[i] * u64::from(gain[i]) + (1 << 14)) >> 15).min(u32::MAX.into());
            }
        }
        for (plane, values) in self.output.stokes.iter_mut().zip(&stokes) {
            plane[start..start + BLOCK].copy_from_slice(values);
        }
        let residual: [u32; BLOCK] = array::from_fn(|i| residual[i] as u32); // clamped before
        self.output.residual[start..start + BLOCK].copy_from_slice(&residual);
        self.output.flags[start..start + BLOCK].copy_from_slice(&marks);
    }

    fn by_definition(&mut self, i: usize) {
        let mut samples = [0; MAX_FRAMES];
        let samples = &mut samples[..self.input.frames.len()];
        for (sample, frame) in samples.iter_mut().zip(self.input.frames) {
            *sample = frame[i];
        }
        let weights = self.table.weights(self.plan, self.plan.saturated(samples));
        let photosite = self.plan.photosite(weights, samples, self.input.dark.at(i), gain_at(self.input.flat, i));
        for (plane, value) in self.output.stokes.iter_mut().zip(photosite.stokes) {
            plane[i] = value;
        }
        self.output.residual[i] = photosite.residual;
        self.output.flags[i] = photosite.flags.0;
    }
}

fn select(condition: bool, flag: u8) -> u8 {
    u8::from(condition) * flag
}

/// (Σ q_k (x_k − dark) + ½) >> shift. Sixteen products of 32 and 17 bits fit without a look at the weights.
#[inline(always)]
fn component<const N: usize>(row: &Row, differences: &[[i32; BLOCK]; N], i: usize) -> i64 {
    let mut sum = row.half;
    for k in 0..N {
        sum += i64::from(row.q[k]) * i64::from(differences[k][i]);
    }
    sum >> row.shift
}

#[inline(always)]
fn clamp_i32(wide: i64, marks: &mut u8) -> i32 {
    let narrow = wide.clamp(i32::MIN.into(), i32::MAX.into());
    *marks |= select(narrow != wide, Flags::OUT_OF_RANGE.0);
    narrow as i32
}

/// Integer roots in place, clamped to 32 bits, bit by bit from the highest that any of the block has.
#[inline(always)]
fn roots(squares: &mut [u64; BLOCK]) {
    let most = squares.iter().fold(0, |most, square| most | square);
    let mut roots = [0_u64; BLOCK];
    for bit in (0..(u64::BITS - most.leading_zeros()).div_ceil(2)).rev().map(|bit| 1_u64 << (2 * bit)) {
        for (root, rest) in roots.iter_mut().zip(&mut *squares) {
            let trial = *root + bit;
            let fits = *rest >= trial;
            *rest -= if fits { trial } else { 0 };
            *root = (*root >> 1) + if fits { bit } else { 0 };
        }
    }
    *squares = roots;
}
