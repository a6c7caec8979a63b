//! The definition: one photosite, from samples to Stokes integers, residual and flags.

use super::{GainQ15, Row, StokesPlan, Weights};
use crate::Flags;

/// What the camera stores for one photosite, in units of the plane's last place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Photosite {
    /// s0, s1, s2.
    pub stokes: [i32; 3],
    /// rms residual per degree of freedom; 0 where there is none (three valid frames or fewer).
    pub residual: u32,
    /// What happened.
    pub flags: Flags,
}

impl StokesPlan {
    /// Which of `samples` are saturated, as a bit mask (bit k = frame k).
    #[must_use]
    pub fn saturated(&self, samples: &[u16]) -> u16 {
        let white = self.range().white_level;
        (0_u16..).zip(samples).fold(0, |mask, (k, x)| mask | u16::from(*x >= white) << k)
    }

    /// Stokes integers of one photosite from its N samples, its dark level and its flat gain.
    ///
    /// `weights` are those of the samples' own mask of saturated frames, or `None` where there are too few left:
    /// `plan.weights(plan.saturated(samples)).ok()`. The caller keeps them, since few masks occur.
    #[must_use]
    pub fn photosite(&self, weights: Option<&Weights>, samples: &[u16], dark: u16, gain: GainQ15) -> Photosite {
        let dropped = self.saturated(samples);
        let mut flags = if dropped == 0 { Flags::default() } else { Flags::SATURATED };
        if (0_u16..).zip(samples).any(|(k, x)| dropped >> k & 1 == 0 && *x < dark) {
            flags = flags.with(Flags::BELOW_BLACK);
        }
        let Some(weights) = weights else {
            return Photosite { flags: flags.with(Flags::TOO_FEW), ..Photosite::default() };
        };
        let (low, high) = self.format().limits();
        let mut clamp = |wide: i64| {
            let narrow = i32::try_from(wide.clamp(low.into(), high.into())).unwrap_or(0);
            if i64::from(narrow) != wide {
                flags = flags.with(Flags::OUT_OF_RANGE);
            }
            narrow
        };
        let before_flat = weights.stokes_rows().each_ref().map(|row| clamp(component(row, samples, dark)));
        let stokes = before_flat.map(|s| clamp((i64::from(s) * i64::from(gain.0) + (1 << 14)) >> 15));

        let rows = weights.residual_rows();
        // Rows grow with 1/√throughput: a square that is beyond the largest residual stays beyond it when clamped.
        let square = |row| {
            let r = component(row, samples, dark).unsigned_abs().min(u32::MAX.into());
            r * r
        };
        let sum = rows.iter().map(square).fold(0, u64::saturating_add);
        let limit = self.format().residual_limit();
        let rms = u32::try_from(sum.isqrt()).unwrap_or(u32::MAX).min(limit);
        let misfit = weights.misfit();
        let [s0, ..] = before_flat;
        let allowed = misfit.floor + ((u64::from(s0.max(0).unsigned_abs()) * misfit.slope) >> 8);
        if u64::from(rms) * u64::from(rms) > allowed {
            flags = flags.with(Flags::MISFIT);
        }
        let scaled = (u64::from(rms) * u64::from(gain.0) + (1 << 14)) >> 15;
        let residual = u32::try_from(scaled).unwrap_or(u32::MAX).min(limit);
        Photosite { stokes, residual, flags }
    }
}

/// (Σ q_k (x_k − dark) + ½) >> shift: rounds half up.
fn component(row: &Row, samples: &[u16], dark: u16) -> i64 {
    let sum: i64 = row.q.iter().zip(samples).map(|(q, x)| i64::from(*q) * (i64::from(*x) - i64::from(dark))).sum();
    (sum + row.half) >> row.shift
}
