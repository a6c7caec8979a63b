//! Integer weights: the pseudo-inverse of one set of valid frames, quantized once.
//!
//! Each row j has a shift G_j as large as its words allow: 16-bit planes have 16-bit weights (one multiply-add instruction
//! takes two of them on every target), 32-bit planes have 32-bit weights; and for every admissible input
//! Σ_k |q_jk| · D + 2^(G_j − F − 1) stays below the accumulator's largest value, where D is the largest
//! |sample − dark|. So no accumulator overflows, by construction (a property test tries).
#![expect(clippy::indexing_slicing, reason = "every index runs over an array length fixed at compile time")]

use super::{FixedError, PlaneFormat, Word};
use crate::{LeastSquares, MAX_FRAMES};

/// One quantized row: component = (Σ q_k (x_k − dark) + ½) >> shift, in units of the plane's last place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Weights, one per frame slot; 0 for frames that take no part.
    pub q: [i32; MAX_FRAMES],
    /// Right shift G − F, at least 1.
    pub shift: u8,
    /// Rounding constant 2^(shift − 1).
    pub half: i64,
}

/// A photosite is a misfit where its squared residual exceeds `floor + (s0 · slope >> 8)`, all in units of the last place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MisfitThreshold {
    /// Read noise and quantization.
    pub floor: u64,
    /// Shot noise, per unit of s0, with 8 fractional bits.
    pub slope: u64,
}

/// All rows for one set of valid frames.
#[derive(Clone, Debug)]
pub struct Weights {
    rows: [Row; MAX_FRAMES],
    degrees_of_freedom: usize,
    bound_dn: [f64; 3],
    residual_bound_dn: f64,
    misfit: MisfitThreshold,
}

impl Weights {
    /// Quantizes `solver`, whose frame `i` sits in capture slot `slots[i]`; `span` is D, the largest |sample − dark|.
    ///
    /// # Errors
    /// [`FixedError::WeightsTooLarge`] where the set amplifies so much that no shift fits the accumulator.
    pub(super) fn quantize(
        solver: &LeastSquares,
        slots: &[u8],
        format: PlaneFormat,
        span: u16,
        misfit: MisfitThreshold,
    ) -> Result<Self, FixedError> {
        let degrees_of_freedom = solver.frames() - 3;
        let mut weights = Self {
            rows: [Row { q: [0; MAX_FRAMES], shift: 1, half: 1 }; MAX_FRAMES],
            degrees_of_freedom,
            bound_dn: [0.0; 3],
            residual_bound_dn: 0.0,
            misfit,
        };
        for (j, row) in solver.weights().into_iter().enumerate() {
            let (quantized, error) = quantize_row(row, slots, format, span, 1.0)?;
            let error = error + float_slack(row, solver.condition());
            weights.rows[j] = quantized;
            weights.bound_dn[j] = error * f64::from(span) + 0.5 * format.lsb_dn();
        }
        // 1/√(N−3) is folded into the rows, so that the root of the sum of squares is an rms without a division.
        let scale = 1.0 / libm::sqrt(f64::from(u8::try_from(degrees_of_freedom.max(1)).unwrap_or(1)));
        let mut sum_of_squares = 0.0;
        for (m, row) in solver.residual_rows().enumerate() {
            let (quantized, error) = quantize_row(row, slots, format, span, scale)?;
            let error = error + float_slack(row, solver.condition());
            weights.rows[3 + m] = quantized;
            let bound = error * f64::from(span) + 0.5 * format.lsb_dn();
            sum_of_squares += bound * bound;
        }
        // Triangle inequality on the norm, and the floor of the integer root.
        weights.residual_bound_dn = libm::sqrt(sum_of_squares) + format.lsb_dn();
        Ok(weights)
    }

    /// The rows of s0, s1, s2.
    #[must_use]
    pub fn stokes_rows(&self) -> &[Row; 3] {
        self.rows.first_chunk().unwrap_or(&[Row { q: [0; MAX_FRAMES], shift: 1, half: 1 }; 3])
    }

    /// The N − 3 residual rows.
    #[must_use]
    pub fn residual_rows(&self) -> &[Row] {
        &self.rows[3..3 + self.degrees_of_freedom]
    }

    /// When the residual counts as a misfit.
    #[must_use]
    pub fn misfit(&self) -> MisfitThreshold {
        self.misfit
    }

    /// Proved bound on |plane − exact least squares| of s0, s1, s2 before the flat field, DN. With a flat gain g the
    /// bound is g times this plus half a unit in the last place.
    #[must_use]
    pub fn bound_dn(&self) -> [f64; 3] {
        self.bound_dn
    }

    /// Proved bound on |residual − exact rms residual|, DN.
    #[must_use]
    pub fn residual_bound_dn(&self) -> f64 {
        self.residual_bound_dn
    }
}

/// What the f64 solver may be off from the exact pseudo-inverse: Householder QR is backward stable, so each weight is
/// within a few ulp times the condition number; 2^−47 per unit of weight leaves a factor of 30.
fn float_slack(row: &[f64], condition: f64) -> f64 {
    let magnitude: f64 = row.iter().map(|w| libm::fabs(*w)).sum();
    libm::ldexp(magnitude * condition, -47)
}

/// Quantizes one row with the largest shift that cannot overflow.
///
/// Also returns max(Σ⁺, Σ⁻) of the errors e_k = q_k 2^−G − w_k, positive and negative ones summed apart. Σ e_k (x_k − d) is
/// linear in each x_k and in d, all in [0, D], so it is extreme at a corner, and there it is at most D times that maximum.
fn quantize_row(
    row: &[f64],
    slots: &[u8],
    format: PlaneFormat,
    span: u16,
    scale: f64,
) -> Result<(Row, f64), FixedError> {
    let (weight_limit, limit) = match format.word {
        Word::I16 => (f64::from(i16::MAX), i64::from(i32::MAX)),
        Word::I32 => (f64::from(i32::MAX), i64::MAX / 2),
    };
    let frac_bits = format.frac_bits;
    let mut shift = 30;
    while shift > frac_bits {
        let mut q = [0_i32; MAX_FRAMES];
        let mut magnitude = 0_i64;
        let (mut above, mut below) = (0.0, 0.0);
        let mut fits = true;
        for (w, slot) in row.iter().zip(slots) {
            let wanted = w * scale;
            let rounded = libm::rint(libm::ldexp(wanted, i32::from(shift)));
            fits &= libm::fabs(rounded) <= weight_limit;
            #[expect(clippy::cast_possible_truncation, reason = "a float-to-int cast saturates, and `fits` says so")]
            let integer = rounded as i32;
            q[usize::from(*slot)] = integer;
            magnitude += i64::from(integer.unsigned_abs());
            let error = libm::ldexp(rounded, -i32::from(shift)) - wanted;
            above += error.max(0.0);
            below -= error.min(0.0);
        }
        let half = 1_i64 << (shift - frac_bits - 1);
        if fits && magnitude * i64::from(span) + half <= limit {
            return Ok((Row { q, shift: shift - frac_bits, half }, f64::max(above, below)));
        }
        shift -= 1;
    }
    Err(FixedError::WeightsTooLarge)
}
