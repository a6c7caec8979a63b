//! From the numbers of a file to linear signals: tone curves, black level, flat field.

use crate::FitError;

/// How a coded sample follows the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToneCurve {
    /// IEC 61966-2-1.
    Srgb,
    /// sample = light^exponent.
    Gamma {
        /// The exponent, > 0; 1/2.2 is usual.
        exponent: f64,
    },
}

impl ToneCurve {
    /// Light in [0, 1] of a coded sample in [0, 1]; continued as an odd function below 0 and by the same formula above 1.
    #[must_use]
    pub fn to_linear(self, coded: f64) -> f64 {
        let x = coded.abs();
        let light = match self {
            // IEC 61966-2-1, 5.2.
            Self::Srgb if x <= 0.04045 => x / 12.92,
            Self::Srgb => ((x + 0.055) / 1.055).powf(2.4),
            Self::Gamma { exponent } => x.powf(1.0 / exponent),
        };
        light.copysign(coded)
    }
}

/// Per-pixel gain of a flat field, median(flat − dark)/(flat − dark): 1 in the middle of its distribution.
///
/// `flat` (an evenly lit, unpolarized white, linear) and `dark` are height × width, row-major, as is the answer.
///
/// # Errors
/// [`FitError::FlatNotAboveDark`] with the first such sample; [`FitError::Size`].
pub fn flat_field_gain(flat: &[f32], dark: &[f32]) -> Result<Vec<f32>, FitError> {
    if flat.len() != dark.len() {
        return Err(FitError::Size { what: "samples of the dark map", found: dark.len(), expected: flat.len() });
    }
    let signal: Vec<f32> = flat.iter().zip(dark).map(|(f, d)| f - d).collect();
    if let Some(index) = signal.iter().position(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(FitError::FlatNotAboveDark { index });
    }
    let mut sorted = signal.clone();
    if sorted.is_empty() {
        return Ok(Vec::new());
    }
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    Ok(signal.iter().map(|s| median / s).collect())
}

/// The value that `share` (0 to 1) of the samples lie below; `None` of no samples.
#[must_use]
pub fn low_percentile(samples: &[f32], share: f64) -> Option<f32> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of the length, clamped to it just after"
    )]
    let index = (share.clamp(0.0, 1.0) * samples.len() as f64) as usize;
    let index = index.min(samples.len().checked_sub(1)?);
    let mut sorted = samples.to_vec();
    Some(*sorted.select_nth_unstable_by(index, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mid grey 0.5 is 0.21404 of the light (IEC 61966-2-1); the two branches meet.
    #[test]
    fn srgb_is_the_standard_curve() {
        assert!((ToneCurve::Srgb.to_linear(0.5) - 0.214_041_14).abs() < 1e-8);
        let ends = [0.0, 1.0, -1.0].map(|x| (ToneCurve::Srgb.to_linear(x) - x).abs());
        assert!(ends.iter().all(|e| *e < 1e-15));
        let step = ToneCurve::Srgb.to_linear(0.040_450_001) - ToneCurve::Srgb.to_linear(0.04045);
        assert!(step.abs() < 1e-6);
        assert!((ToneCurve::Gamma { exponent: 0.5 }.to_linear(0.5) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn a_flat_field_makes_the_flat_picture_flat() {
        let (flat, dark) = ([110.0, 60.0, 210.0, 110.0, 85.0], [10.0_f32; 5]);
        let gain = flat_field_gain(&flat, &dark).unwrap();
        for ((f, d), g) in flat.iter().zip(&dark).zip(&gain) {
            assert!(((f - d) * g - 100.0).abs() < 1e-4);
        }
        assert_eq!(flat_field_gain(&[5.0, 1.0], &[1.0, 1.0]), Err(FitError::FlatNotAboveDark { index: 1 }));
        assert!(matches!(flat_field_gain(&[5.0], &[]), Err(FitError::Size { .. })));
    }

    #[test]
    fn percentiles_of_few_samples() {
        let v = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(low_percentile(&v, 0.0), Some(1.0));
        assert_eq!(low_percentile(&v, 0.5), Some(3.0));
        assert_eq!(low_percentile(&v, 1.0), Some(5.0));
        assert_eq!(low_percentile(&[], 0.5), None);
    }
}
