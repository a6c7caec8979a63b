//! What is fixed for a whole capture: frames, format, sensor range, noise; and the weights for any set of valid frames.

use super::weights::MisfitThreshold;
use super::{PlaneFormat, Weights, Word};
use crate::{Analyzer, LeastSquares, MAX_FRAMES, SolveError};

/// The sensor's numbers that the integers depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorRange {
    /// Bits of a sample, 8..=16.
    pub bit_depth: u8,
    /// A sample at or above this is saturated and not used; at most 2^bit_depth − 1.
    pub white_level: u16,
}

/// Noise of one sample, for the misfit flag: variance = read² + x / gain, all in DN and electrons per DN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Read noise, DN.
    pub read_dn: f64,
    /// Electrons per DN; 0 switches the shot term off.
    pub electrons_per_dn: f64,
    /// How many standard deviations are a misfit (false alarms per photosite at most exp(−n²/2)); 0 switches the flag off.
    pub misfit_sigma: f64,
}

/// Why a capture cannot be computed in this format.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FixedError {
    /// The frames do not determine the Stokes vector.
    Solve(SolveError),
    /// They do, but amplify noise beyond use.
    IllConditioned {
        /// Condition number of the analyzer matrix, above [`LeastSquares::USABLE_CONDITION`].
        condition: f64,
    },
    /// This word cannot hold this sensor.
    Unsupported {
        /// The word asked for.
        word: Word,
        /// The sensor's bits.
        bit_depth: u8,
    },
    /// White level of 0 or beyond the bit depth.
    WhiteLevel {
        /// The level given.
        white_level: u16,
    },
    /// The weights do not fit the accumulator (a very unequal set of throughputs).
    WeightsTooLarge,
}

/// One capture's recipe; see the module.
#[derive(Clone, Debug)]
pub struct StokesPlan {
    frames: [Analyzer; MAX_FRAMES],
    sigma: [f64; MAX_FRAMES],
    count: usize,
    format: PlaneFormat,
    range: SensorRange,
    noise: Noise,
}

impl StokesPlan {
    /// Checks the whole recipe once.
    ///
    /// Frames are weighted by 1/√throughput in noise: where exposures differ, photons count (shot-noise limit).
    ///
    /// # Errors
    /// [`FixedError`], as its variants say.
    pub fn new(frames: &[Analyzer], word: Word, range: SensorRange, noise: Noise) -> Result<Self, FixedError> {
        let unsupported = FixedError::Unsupported { word, bit_depth: range.bit_depth };
        if !(8..=16).contains(&range.bit_depth) {
            return Err(unsupported);
        }
        let bits = range.bit_depth.saturating_add(headroom_bits(frames));
        let format = PlaneFormat::for_bits(word, bits).ok_or(unsupported)?;
        if range.white_level == 0 || u32::from(range.white_level) >= 1_u32 << range.bit_depth {
            return Err(FixedError::WhiteLevel { white_level: range.white_level });
        }
        let count = frames.len();
        let mut plan = Self {
            frames: [Analyzer::ideal(crate::Radians(0.0)); MAX_FRAMES],
            sigma: [1.0; MAX_FRAMES],
            count,
            format,
            range,
            noise,
        };
        if !(3..=MAX_FRAMES).contains(&count) {
            return Err(FixedError::Solve(SolveError::FrameCount { frames: count }));
        }
        for ((slot, sigma), frame) in plan.frames.iter_mut().zip(&mut plan.sigma).zip(frames) {
            *slot = *frame;
            *sigma = libm::sqrt(frame.throughput);
        }
        plan.weights(0)?;
        Ok(plan)
    }

    /// Number of frames N.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.count
    }

    /// The frames, as given.
    #[must_use]
    pub fn frames(&self) -> &[Analyzer] {
        self.frames.get(..self.count).unwrap_or(&[])
    }

    /// Q format of the planes.
    #[must_use]
    pub fn format(&self) -> PlaneFormat {
        self.format
    }

    /// The sensor's range.
    #[must_use]
    pub fn range(&self) -> SensorRange {
        self.range
    }

    /// Largest sample and largest dark level the bound holds for: 2^bit_depth − 1.
    #[must_use]
    pub fn span(&self) -> u16 {
        u16::MAX >> 16_u8.saturating_sub(self.range.bit_depth)
    }

    /// Integer weights when the frames whose bit is set in `dropped` are left out.
    ///
    /// # Errors
    /// [`FixedError::Solve`] or [`FixedError::IllConditioned`] where the others do not determine the Stokes vector.
    pub fn weights(&self, dropped: u16) -> Result<Weights, FixedError> {
        let mut frames = [Analyzer::ideal(crate::Radians(0.0)); MAX_FRAMES];
        let mut sigma = [1.0; MAX_FRAMES];
        let mut slots = [0_u8; MAX_FRAMES];
        let mut kept = 0;
        for (slot, (frame, noise)) in (0_u8..).zip(self.frames().iter().zip(&self.sigma)) {
            if dropped >> slot & 1 == 0
                && let (Some(f), Some(n), Some(s)) = (frames.get_mut(kept), sigma.get_mut(kept), slots.get_mut(kept))
            {
                (*f, *n, *s) = (*frame, *noise, slot);
                kept += 1;
            }
        }
        let solver = LeastSquares::weighted(frames.get(..kept).unwrap_or(&[]), &sigma).map_err(FixedError::Solve)?;
        if solver.condition() > LeastSquares::USABLE_CONDITION {
            return Err(FixedError::IllConditioned { condition: solver.condition() });
        }
        let misfit = self.misfit_threshold(solver.frames() - 3);
        Weights::quantize(&solver, &slots, self.format, self.span(), misfit)
    }

    /// Misfit threshold on the squared residual, in squared units of the last place: `floor + (s0 · slope >> 8)`.
    ///
    /// χ² of d degrees of freedom exceeds d + n√(2d) + n² with probability at most exp(−n²/2) (Laurent & Massart 2000,
    /// lemma 1). No frame holds more than s0, so the shot term is an upper bound and no photosite is flagged for it.
    /// The limits keep the comparison within 32 bits for 16-bit planes and 64 bits for 32-bit planes.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped just before")]
    fn misfit_threshold(&self, degrees_of_freedom: usize) -> MisfitThreshold {
        let n = self.noise.misfit_sigma;
        let (floor_limit, slope_limit) = match self.format.word {
            Word::I16 => (i32::MAX as u64, (1 << 17) - 1),
            Word::I32 => (1 << 62, (1 << 31) - 1),
        };
        if degrees_of_freedom == 0 || n <= 0.0 {
            return MisfitThreshold { floor: u64::MAX >> 1, slope: 0 };
        }
        let d = f64::from(u8::try_from(degrees_of_freedom).unwrap_or(u8::MAX));
        let factor = (d + n * libm::sqrt(2.0 * d) + n * n) / d;
        let lsb = self.format.lsb_dn();
        // The quantization of the samples (1/12 DN²) is noise as well.
        let floor = factor * (self.noise.read_dn * self.noise.read_dn + 1.0 / 12.0) / (lsb * lsb);
        let shot = if self.noise.electrons_per_dn > 0.0 { 1.0 / self.noise.electrons_per_dn } else { 0.0 };
        let slope = 256.0 * factor * shot / lsb;
        MisfitThreshold {
            floor: (libm::ceil(floor.max(0.0)) as u64).min(floor_limit),
            slope: (libm::ceil(slope.max(0.0)) as u64).min(slope_limit),
        }
    }
}

/// How many bits the light that the shortest frame can hold is above the reference's range.
///
/// A ratio of a quarter that an exposure rounds to 0.2499 is still two bits: 3 % are left to clamping and its flag.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped just before")]
fn headroom_bits(frames: &[Analyzer]) -> u8 {
    let least = frames.iter().map(|frame| frame.throughput).fold(1.0, f64::min);
    libm::ceil(libm::log2(1.0 / least.max(1e-9)) - 0.05).clamp(0.0, 30.0) as u8
}
