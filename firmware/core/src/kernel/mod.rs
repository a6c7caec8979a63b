//! The strip kernel: N frames in, Stokes integers, residual and flags out; integers only, no allocation.
//!
//! [`protocol_polar::fixed::StokesPlan::photosite`] is the definition; what is here computes the same bits fast. The common
//! photosite (nothing saturated, nothing clamped) goes through vector loops: `x86` holds the 16-bit ones for AVX2 and
//! AVX-512, `portable` those for any processor, `wide` the 32-bit ones. The others are computed one by one, with weights
//! kept per mask.
//!
//! Bits of the proof that 32-bit accumulators are enough stand in docs/NUMERICS.md.

mod masks;
mod narrow;
pub mod polar_form;
mod portable;
mod simd;
#[cfg(test)]
mod tests;
mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use masks::WeightTable;

use protocol_polar::fixed::{GainQ15, StokesPlan};

/// Dark level of each photosite.
#[derive(Clone, Copy, Debug)]
pub enum Dark<'a> {
    /// The same everywhere, DN.
    Level(u16),
    /// One value per photosite of the strip, DN; all below the white level.
    Map(&'a [u16]),
}

impl Dark<'_> {
    fn at(&self, i: usize) -> u16 {
        match self {
            Self::Level(level) => *level,
            Self::Map(map) => map.get(i).copied().unwrap_or(0),
        }
    }
}

/// What goes into a strip: all slices have one value per photosite of the strip, row-major.
#[derive(Clone, Copy, Debug)]
pub struct StripInput<'a> {
    /// N frames of raw samples, in the plan's slot order.
    pub frames: &'a [&'a [u16]],
    /// Dark level.
    pub dark: Dark<'a>,
    /// Flat gain, Q1.15 (see [`GainQ15`]); `None` is 1 everywhere.
    pub flat: Option<&'a [u16]>,
}

/// Where a strip goes: all slices have one value per photosite of the strip, row-major.
#[derive(Debug)]
pub struct StripOutput<'a, S, R> {
    /// s0, s1, s2 in the plan's Q format.
    pub stokes: [&'a mut [S]; 3],
    /// rms residual per degree of freedom, same Q format, unsigned; all 0 with three frames.
    pub residual: &'a mut [R],
    /// [`protocol_polar::Flags`].
    pub flags: &'a mut [u8],
}

/// Why a strip was not computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StripError {
    /// A slice has another length than the strip, or there are not N frames.
    Length {
        /// Photosites in the strip.
        expected: usize,
        /// Values there were.
        found: usize,
    },
    /// The plan's format is of another word than the output.
    Format,
}

pub use narrow::stokes_i16;
pub use wide::stokes_i32;

/// Checks every slice against the number of photosites once, so that the loops need not.
fn check<S, R>(plan: &StokesPlan, input: &StripInput, output: &StripOutput<S, R>) -> Result<usize, StripError> {
    let expected = output.flags.len();
    let same = |found: usize| if found == expected { Ok(()) } else { Err(StripError::Length { expected, found }) };
    if input.frames.len() != plan.frame_count() {
        return Err(StripError::Length { expected: plan.frame_count(), found: input.frames.len() });
    }
    for frame in input.frames {
        same(frame.len())?;
    }
    if let Dark::Map(map) = input.dark {
        same(map.len())?;
    }
    if let Some(flat) = input.flat {
        same(flat.len())?;
    }
    for plane in &output.stokes {
        same(plane.len())?;
    }
    same(output.residual.len())?;
    Ok(expected)
}

fn gain_at(flat: Option<&[u16]>, i: usize) -> GainQ15 {
    flat.and_then(|f| f.get(i)).map_or(GainQ15::ONE, |g| GainQ15(*g))
}
