//! What one reads first off the maps: how much of the sample has an answer, and which.

use super::{MaterialMaps, Plane};

/// Percentiles of the finite numbers of a plane, linear between order statistics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// How many numbers are finite.
    pub count: usize,
    /// 5th percentile.
    pub low: f32,
    /// Median.
    pub median: f32,
    /// 95th percentile.
    pub high: f32,
}

/// Counts and spreads over a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStatistics {
    /// All samples of the grid.
    pub samples: usize,
    /// Samples that were fitted.
    pub fitted: usize,
    /// Samples that were fitted and have no reason against them.
    pub sound: usize,
    /// Samples with a second minimum.
    pub second_minima: usize,
    /// Name and count of each reason, from bit 0.
    pub reasons: Vec<(String, usize)>,
    /// χ² over degrees of freedom, of the samples that have any; `None` of nothing.
    pub chi2_per_freedom: Option<Spread>,
    /// Every plane that has a finite number.
    pub planes: Vec<(Plane, Spread)>,
}

impl Spread {
    /// Of the finite ones among `values`; `None` of nothing.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f32>) -> Option<Self> {
        let mut values: Vec<f32> = values.into_iter().filter(|v| v.is_finite()).collect();
        let [low, median, high] = [0.05, 0.5, 0.95].map(|q| quantile(&mut values, q));
        Some(Self { count: values.len(), low: low?, median: median?, high: high? })
    }
}

impl MapStatistics {
    /// Gathers the statistics of all samples without any of the reasons `leave_out`; counts are of all samples.
    #[must_use]
    pub fn gather(maps: &MaterialMaps, leave_out: u32) -> Self {
        let fitted = |i: usize| !maps.plane(Plane::NormalZ)[i].is_nan();
        let kept: Vec<bool> = maps.reasons.iter().map(|r| r & leave_out == 0).collect();
        let spread = |plane: Plane| {
            let values = maps.plane(plane).iter().zip(&kept).filter(|(_, kept)| **kept).map(|(v, _)| *v);
            Spread::of(values).map(|s| (plane, s))
        };
        let named = maps.reason_names.iter().enumerate();
        let count = |bit: usize| maps.reasons.iter().filter(|r| **r >> bit & 1 == 1).count();
        let chi2 = maps.plane(Plane::Chi2).iter().zip(&maps.freedom).zip(&kept);
        #[expect(clippy::cast_precision_loss, reason = "degrees of freedom are few")]
        let ratio = chi2.filter(|((_, f), kept)| **kept && **f > 0).map(|((chi2, f), _)| chi2 / *f as f32);
        let all = || 0..maps.grid.samples();
        Self {
            samples: maps.grid.samples(),
            fitted: all().filter(|i| fitted(*i)).count(),
            sound: all().filter(|i| fitted(*i) && maps.reasons[*i] == 0).count(),
            second_minima: all().filter(|i| maps.second(*i).is_some()).count(),
            reasons: named.map(|(bit, name)| (name.clone(), count(bit))).collect(),
            chi2_per_freedom: Spread::of(ratio),
            planes: Plane::ALL.into_iter().filter_map(spread).collect(),
        }
    }
}

/// The `q` quantile, q in [0, 1], linear between order statistics (type 7 of Hyndman and Fan 1996); `None` of nothing.
/// Reorders `values`, which are not NaN.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index of the slice; between two of its values"
)]
pub(crate) fn quantile(values: &mut [f32], q: f64) -> Option<f32> {
    let at = q.clamp(0.0, 1.0) * values.len().checked_sub(1)? as f64;
    let (_, low, above) = values.select_nth_unstable_by(at.floor() as usize, f32::total_cmp);
    let high = above.iter().copied().min_by(f32::total_cmp).unwrap_or(*low);
    let (low, high) = (f64::from(*low), f64::from(high));
    Some((low + (high - low) * at.fract()) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_numpys() {
        // numpy.quantile([3, 1, 2, 10], [0, .05, .5, .95, 1]) = 1, 1.15, 2.5, 8.95, 10
        for (q, expected) in [(0.0, 1.0), (0.05, 1.15), (0.5, 2.5), (0.95, 8.95), (1.0, 10.0)] {
            assert!((quantile(&mut [3.0, 1.0, 2.0, 10.0], q).unwrap() - expected).abs() < 1e-6, "{q}");
        }
        assert_eq!(quantile(&mut [], 0.5), None);
    }
}
