//! Errors in numbers: over all scored samples, and class by class.

use std::collections::BTreeSet;

use super::reference::FIRST_SCORED;
use super::{CompareOptions, Differences, Quantity};
use crate::maps::{MaterialMaps, Plane, quantile};

/// The answer of a comparison.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Over all classes that are scored.
    pub all: ClassReport,
    /// Class by class, ascending.
    pub classes: Vec<ClassReport>,
    /// Whether the reference was interpolated.
    pub resampled: bool,
    /// Errors as planes.
    pub differences: Differences,
}

/// Errors over the samples of one class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassReport {
    /// The class; `None` for all that are scored.
    pub class: Option<i16>,
    /// Samples of the maps at which the reference is of this class.
    pub samples: usize,
    /// Of these, samples that were never fitted.
    pub not_fitted: usize,
    /// Of these, fitted ones with one of the refused reasons.
    pub refused: usize,
    /// Name and count of each refused reason among `refused`; a sample may have several.
    pub refused_by: Vec<(String, usize)>,
    /// By [`Quantity`]; `None` where nothing was scored.
    pub quantities: [Option<ErrorSummary>; 6],
}

/// Absolute errors of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSummary {
    /// Scored samples.
    pub count: usize,
    /// Median of the absolute errors.
    pub median: f64,
    /// 95th percentile of the absolute errors.
    pub percentile_95: f64,
    /// Root mean square.
    pub rms: f64,
    /// Errors over σ; `None` where no σ is known.
    pub z: Option<ZSummary>,
}

/// Errors over σ: 1, 0.683 and 0.95 for a σ that is right and errors that are Gaussian.
///
/// The error of the normal has two components and its σ is that of both: its square over σ² is then exponential, and the
/// limits for 68.3 % and 95 % are √(−ln 0.317) = 1.072 and √(−ln 0.05) = 1.731 instead of 1 and 1.96. They take the two
/// components as equally uncertain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZSummary {
    /// Samples with a σ.
    pub count: usize,
    /// Root mean square.
    pub rms: f64,
    /// Share within the 68.3 % limit.
    pub within_68: f64,
    /// Share within the 95 % limit.
    pub within_95: f64,
}

/// P(|x| < 1) of a standard normal x.
const ONE_SIGMA: f64 = 0.682_689_492_137_086;
/// P(|x| < this) = 0.95 of a standard normal x.
const NORMAL_95: f64 = 1.959_963_984_540_054;

impl Comparison {
    pub(super) fn of(differences: Differences, maps: &MaterialMaps, options: CompareOptions, resampled: bool) -> Self {
        let scored: BTreeSet<i16> = differences.classes.iter().copied().filter(|c| *c >= FIRST_SCORED).collect();
        let report = |class| ClassReport::of(class, &differences, maps, options);
        let classes = scored.into_iter().map(|class| report(Some(class))).collect();
        Self { all: report(None), classes, resampled, differences }
    }
}

impl ClassReport {
    fn of(class: Option<i16>, differences: &Differences, maps: &MaterialMaps, options: CompareOptions) -> Self {
        let is_in = |c: i16| class.map_or(c >= FIRST_SCORED, |class| c == class);
        let within = || differences.classes.iter().enumerate().filter(|(_, c)| is_in(**c)).map(|(i, _)| i);
        let fitted = || within().filter(|i| !maps.plane(Plane::NormalZ)[*i].is_nan());
        let refusing = |i: usize| maps.reasons[i] & options.refuse;
        let count = |bit: usize| fitted().filter(|i| refusing(*i) >> bit & 1 == 1).count();
        let named = maps.reason_names.iter().enumerate().filter(|(bit, _)| options.refuse >> bit & 1 == 1);
        let quantities = Quantity::ALL.map(|quantity| {
            let values = |plane: &[f32]| within().map(|i| plane[i]).filter(|v| !v.is_nan()).collect::<Vec<f32>>();
            let z = ZSummary::of(&values(&differences.z[quantity as usize]), quantity);
            ErrorSummary::of(values(&differences.errors[quantity as usize]), z)
        });
        let samples = within().count();
        Self {
            class,
            samples,
            not_fitted: samples - fitted().count(),
            refused: fitted().filter(|i| refusing(*i) != 0).count(),
            refused_by: named.map(|(bit, name)| (name.clone(), count(bit))).filter(|(_, n)| *n > 0).collect(),
            quantities,
        }
    }

    /// The summary of one quantity.
    #[must_use]
    pub fn quantity(&self, quantity: Quantity) -> Option<&ErrorSummary> {
        self.quantities[quantity as usize].as_ref()
    }
}

impl ErrorSummary {
    fn of(mut errors: Vec<f32>, z: Option<ZSummary>) -> Option<Self> {
        errors.iter_mut().for_each(|e| *e = e.abs());
        Some(Self {
            count: errors.len(),
            rms: rms(&errors)?,
            median: quantile(&mut errors, 0.5)?.into(),
            percentile_95: quantile(&mut errors, 0.95)?.into(),
            z,
        })
    }
}

impl ZSummary {
    fn of(z: &[f32], quantity: Quantity) -> Option<Self> {
        let [limit_68, limit_95] = match quantity {
            Quantity::Normal => [(-(1.0 - ONE_SIGMA).ln()).sqrt(), (-0.05_f64.ln()).sqrt()],
            _ => [1.0, NORMAL_95],
        };
        let share = |limit: f64| z.iter().filter(|z| f64::from(z.abs()) <= limit).count() as f64 / z.len() as f64;
        Some(Self { count: z.len(), rms: rms(z)?, within_68: share(limit_68), within_95: share(limit_95) })
    }
}

/// Root mean square; `None` of nothing.
fn rms(values: &[f32]) -> Option<f64> {
    let sum: f64 = values.iter().map(|v| f64::from(*v).powi(2)).sum();
    (!values.is_empty()).then(|| (sum / values.len() as f64).sqrt())
}
