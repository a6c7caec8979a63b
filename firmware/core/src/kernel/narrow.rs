//! 16-bit planes, 32-bit accumulators: the fast setting.
//!
//! A strip is cut into spans that stay in the first two caches. A span is computed in whole blocks by one of the twins
//! (`x86` where the processor has AVX2 or AVX-512, `portable` elsewhere). Each leaves [`RECOMPUTE`] in the flags of what is
//! rare: a saturated sample, a value at an end of its word, a dark level beyond white. Those are computed one by one in 32
//! bits, or by the definition where even that might not hold them, as are the few behind the last whole block.
#![expect(clippy::indexing_slicing, reason = "`check` has compared every length with the strip's before")]
#![expect(
    clippy::cast_possible_truncation,
    reason = "integer words change width on purpose; each place says why the value fits"
)]

use super::{Dark, StripError, StripInput, StripOutput, WeightTable, check, gain_at, simd};
use protocol_polar::fixed::{GainQ15, Row, StokesPlan, Weights, Word};
use protocol_polar::{Flags, MAX_FRAMES};

/// Photosites the twins take at a time.
pub(super) const BLOCK: usize = 128;
/// Photosites between two looks for what is rare: with four frames, frames and planes of a span take 35 KB.
const SPAN: usize = 16 * BLOCK;
/// Flags looked at together for marks.
const CHUNK: usize = 32;
/// Computes whole blocks and says whether any photosite is left to the definition.
pub(super) type Twin = fn(&Fast, &StripInput, StripOutput<i16, u16>) -> bool;
/// In a flag byte: the definition must compute this photosite. No flag of the protocol; never left in the output.
pub(super) const RECOMPUTE: u8 = 1 << 7;

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
    stokes_i16_by(simd::narrow(), plan, table, input, output)
}

/// [`stokes_i16`] with the twin given, so that a test can compare them.
pub(super) fn stokes_i16_by(
    twin: Twin,
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
    let Some(weights) = table.weights(plan, 0) else { return Err(StripError::Format) };
    let fast = Fast::new(plan, weights);
    let mut strip = Strip { plan, table, input, output };
    let whole = photosites - photosites % BLOCK;
    for start in (0..whole).step_by(SPAN) {
        strip.span(twin, &fast, start, whole.min(start + SPAN));
    }
    for i in whole..photosites {
        strip.by_definition(i);
    }
    Ok(())
}

/// The weights of the full set, in the twins' own widths.
pub(super) struct Fast {
    rows: [FastRow; MAX_FRAMES],
    residual_rows: usize,
    /// A sample at or above this is saturated.
    pub(super) white: u16,
    /// The misfit threshold's constant; at its largest no 15-bit residual exceeds it.
    pub(super) misfit_floor: i32,
    /// The misfit threshold's slope over s0, 17 bits, 8 of them fractional.
    pub(super) misfit_slope: i32,
}

/// One [`Row`] of the full set.
#[derive(Clone, Copy)]
pub(super) struct FastRow {
    pub(super) q: [i16; MAX_FRAMES],
    pub(super) half: i32,
    pub(super) shift: u32,
}

impl FastRow {
    fn new(row: &Row) -> Self {
        Self {
            q: row.q.map(|q| q as i16), // 16-bit planes have 16-bit weights, by construction of the row
            half: row.half as i32,      // below the accumulator's limit, by construction of the row
            shift: u32::from(row.shift),
        }
    }
}

impl Fast {
    fn new(plan: &StokesPlan, weights: &Weights) -> Self {
        let mut rows = [FastRow { q: [0; MAX_FRAMES], half: 0, shift: 1 }; MAX_FRAMES];
        for (to, from) in rows.iter_mut().zip(weights.stokes_rows().iter().chain(weights.residual_rows())) {
            *to = FastRow::new(from);
        }
        let misfit = weights.misfit();
        Self {
            rows,
            residual_rows: weights.residual_rows().len(),
            white: plan.range().white_level,
            misfit_floor: i32::try_from(misfit.floor).unwrap_or(i32::MAX),
            misfit_slope: i32::try_from(misfit.slope).unwrap_or(0), // 17 bits, by construction
        }
    }

    /// The rows of s0, s1, s2.
    pub(super) fn stokes_rows(&self) -> [&FastRow; 3] {
        let [s0, s1, s2, ..] = &self.rows;
        [s0, s1, s2]
    }

    /// The N − 3 residual rows.
    pub(super) fn residual_rows(&self) -> &[FastRow] {
        &self.rows[3..3 + self.residual_rows]
    }
}

struct Strip<'a, 't> {
    plan: &'a StokesPlan,
    table: &'t mut WeightTable,
    input: StripInput<'a>,
    output: StripOutput<'a, i16, u16>,
}

impl Strip<'_, '_> {
    /// Photosites `start..end`, whole blocks.
    fn span(&mut self, twin: Twin, fast: &Fast, start: usize, end: usize) {
        let range = start..end;
        let mut frames = [&[][..]; MAX_FRAMES];
        for (to, from) in frames.iter_mut().zip(self.input.frames) {
            *to = &from[range.clone()];
        }
        let input = StripInput {
            frames: &frames[..self.input.frames.len()],
            dark: match self.input.dark {
                Dark::Level(level) => Dark::Level(level),
                Dark::Map(map) => Dark::Map(&map[range.clone()]),
            },
            flat: self.input.flat.map(|flat| &flat[range.clone()]),
        };
        let output = StripOutput {
            stokes: self.output.stokes.each_mut().map(|plane| &mut plane[range.clone()]),
            residual: &mut self.output.residual[range.clone()],
            flags: &mut self.output.flags[range.clone()],
        };
        if !twin(fast, &input, output) {
            return;
        }
        // Which chunks of flags have a mark, first without a branch: where marks are few, each would be mispredicted.
        let mut marked = [0_u16; SPAN / CHUNK];
        let mut count = 0;
        for (chunk, flags) in (0_u16..).zip(self.output.flags[range].as_chunks::<CHUNK>().0) {
            marked[count] = chunk;
            count += usize::from(flags.iter().fold(0, |all, flags| all | flags) & RECOMPUTE != 0);
        }
        for chunk in &marked[..count] {
            let at = start + CHUNK * usize::from(*chunk);
            let mut marks = self.output.flags[at..].first_chunk().map_or(0, marks_in);
            while marks != 0 {
                self.rare(at + marks.trailing_zeros() as usize);
                marks &= marks - 1;
            }
        }
    }

    /// A photosite the twin left: in 32 bits like the twin where only samples are saturated, else by the definition.
    fn rare(&mut self, i: usize) {
        let white = self.plan.range().white_level;
        let dark = self.input.dark.at(i);
        let mut differences = [0_i32; MAX_FRAMES];
        let (mut dropped, mut signs) = (0_u16, 0);
        for ((k, difference), frame) in (0..).zip(&mut differences).zip(self.input.frames) {
            let saturated = frame[i] >= white;
            dropped |= u16::from(saturated) << k;
            // A dropped frame's weight is 0.
            *difference = if saturated { 0 } else { i32::from(frame[i]) - i32::from(dark) };
            signs |= *difference;
        }
        let computed =
            self.table.weights(self.plan, dropped).filter(|_| dark < white).and_then(|weights| {
                photosite(weights, &differences, self.input.frames.len(), gain_at(self.input.flat, i))
            });
        let Some((stokes, residual, misfit)) = computed else { return self.by_definition(i) };
        for (plane, value) in self.output.stokes.iter_mut().zip(stokes) {
            plane[i] = value;
        }
        self.output.residual[i] = residual;
        let flag = |raised: bool, flag: Flags| u8::from(raised) * flag.0;
        self.output.flags[i] =
            flag(dropped != 0, Flags::SATURATED) | flag(signs < 0, Flags::BELOW_BLACK) | flag(misfit, Flags::MISFIT);
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
            plane[i] = value as i16; // clamped to the format's limits
        }
        self.output.residual[i] = photosite.residual as u16; // clamped to the format's limit
        self.output.flags[i] = photosite.flags.0;
    }
}

/// Bit i is set where byte i is marked.
fn marks_in(flags: &[u8; CHUNK]) -> u32 {
    flags.as_chunks().0.iter().rev().fold(0, |marks, eight| {
        let tops = u64::from_le_bytes(*eight) & u64::from_le_bytes([RECOMPUTE; 8]);
        // Brings the top bit of byte i to bit 56 + i; no two products meet.
        marks << 8 | (tops.wrapping_mul(0x0002_0408_1020_4081) >> 56) as u32
    })
}

/// Stokes, residual and misfit of one photosite, or nothing where a value reaches an end of its word. Differences of a used
/// frame are those of admissible samples, so that 32 bits are enough.
fn photosite(
    weights: &Weights,
    differences: &[i32; MAX_FRAMES],
    frames: usize,
    gain: GainQ15,
) -> Option<([i16; 3], u16, bool)> {
    let component = |row: &Row| {
        let products = row.q.iter().zip(differences).take(frames).map(|(q, x)| q.wrapping_mul(*x));
        products.fold(row.half as i32, i32::wrapping_add) >> row.shift
    };
    let inside = |s: i32| s.unsigned_abs() < i16::MAX.unsigned_abs().into();
    let gain = i32::from(gain.0);
    let [s0, s1, s2] = weights.stokes_rows().each_ref().map(component);
    let scaled = [s0, s1, s2].map(|s| (s.wrapping_mul(gain).wrapping_add(1 << 14)) >> 15);
    let mut fits = inside(s0) & inside(s1) & inside(s2) & scaled.iter().all(|s| inside(*s));
    let r = match weights.residual_rows() {
        [] => 0,
        [row] => component(row).unsigned_abs(),
        rows => {
            let squares = rows.iter().map(|row| u64::from(component(row).unsigned_abs())).map(|r| r * r);
            squares.sum::<u64>().isqrt().min(u32::MAX.into()) as u32
        }
    };
    fits &= r < 1 << 15;
    if !fits {
        return None;
    }
    let allowed = weights.misfit().floor + ((u64::from(s0.max(0).unsigned_abs()) * weights.misfit().slope) >> 8);
    let residual = (r * gain.unsigned_abs() + (1 << 14)) >> 15;
    Some((scaled.map(|s| s as i16), residual as u16, u64::from(r * r) > allowed))
}
