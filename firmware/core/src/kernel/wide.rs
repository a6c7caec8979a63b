//! 32-bit planes, 64-bit accumulators: the accurate setting. Every photosite by the definition.

use super::{StripError, StripInput, StripOutput, WeightTable, check, gain_at};
use protocol_polar::MAX_FRAMES;
use protocol_polar::fixed::{StokesPlan, Word};

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
    let [s0, s1, s2] = output.stokes;
    let mut samples = [0_u16; MAX_FRAMES];
    let samples = samples.get_mut(..input.frames.len()).unwrap_or_default();
    let planes = s0.iter_mut().zip(s1).zip(s2).zip(output.residual).zip(output.flags);
    for (i, ((((s0, s1), s2), residual), flags)) in (0..photosites).zip(planes) {
        for (sample, frame) in samples.iter_mut().zip(input.frames) {
            *sample = frame.get(i).copied().unwrap_or(0);
        }
        let weights = table.weights(plan, plan.saturated(samples));
        let photosite = plan.photosite(weights, samples, input.dark.at(i), gain_at(input.flat, i));
        [*s0, *s1, *s2] = photosite.stokes;
        *residual = photosite.residual;
        *flags = photosite.flags.0;
    }
    Ok(())
}
