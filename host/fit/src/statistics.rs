//! What one reads first off a Stokes image: how much of it is good, and how polarized it is.

use protocol_polar::{Flags, Radians};

use crate::{StokesPlanes, Uncertainty, isotropic_sigma, mas, uncertainty};

/// Counts and means over the pixels of one color.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// All pixels.
    pub pixels: usize,
    /// Pixels with each flag, in the order of [`Flags::NAMES`].
    pub flagged: [usize; 5],
    /// Pixels that have a value, but no light: s0 <= 0. Their DoLP counts as 0.
    pub no_light: usize,
    /// Pixels brighter than a tenth of the mean whose measured DoLP exceeds 1: a wrong black level, samples that are not
    /// linear, or much noise. (In dark pixels any noise does it.)
    pub above_one: usize,
    /// Mean s0 of the pixels that have a value.
    pub mean_s0: f64,
    /// Σ √(s1² + s2²) / Σ s0 over the pixels with light: mean DoLP weighted by s0, so that noise in dark pixels does not
    /// count. 0 where there is no light at all.
    pub mean_dolp: f64,
    /// Root mean square of the residual over the pixels that have a value, in its unit.
    pub rms_residual: Option<f64>,
}

impl Statistics {
    /// Gathers the statistics of one color; every slice has one entry per pixel, in the same order. Pixels flagged
    /// `TOO_FEW` hold no value and count only as such.
    #[must_use]
    pub fn gather([s0, s1, s2]: [&[f32]; 3], flags: Option<&[u8]>, residual: Option<&[f32]>) -> Self {
        let mut found = Self { pixels: s0.len(), ..Self::default() };
        let (mut light, mut linear, mut sum, mut squares) = (0.0, 0.0, 0.0, 0.0);
        for (i, ((&s0, &s1), &s2)) in s0.iter().zip(s1).zip(s2).enumerate() {
            let flags = Flags(flags.and_then(|f| f.get(i)).copied().unwrap_or(0));
            for (count, (flag, _)) in found.flagged.iter_mut().zip(Flags::NAMES) {
                *count += usize::from(flags.contains(flag));
            }
            if flags.contains(Flags::TOO_FEW) {
                continue;
            }
            let (power, polarized) = (f64::from(s0), f64::from(s1).hypot(f64::from(s2)));
            sum += power;
            squares += residual.and_then(|r| r.get(i)).map_or(0.0, |r| f64::from(*r).powi(2));
            if power > 0.0 {
                light += power;
                linear += polarized;
            } else {
                found.no_light += 1;
            }
        }
        let valued = (found.pixels - found.count(Flags::TOO_FEW)).max(1) as f64;
        found.mean_s0 = sum / valued;
        let dim = (0.1 * found.mean_s0).max(0.0);
        let impossible = |((s0, s1), s2): &((&f32, &f32), &f32)| f64::from(**s0) > dim && s1.hypot(**s2) > **s0;
        found.above_one = s0.iter().zip(s1).zip(s2).filter(impossible).count();
        found.mean_dolp = if light > 0.0 { linear / light } else { 0.0 };
        found.rms_residual = residual.map(|_| (squares / valued).sqrt());
        found
    }

    /// How many pixels have `flag` (one of [`Flags::NAMES`]).
    #[must_use]
    pub fn count(&self, flag: Flags) -> usize {
        Flags::NAMES.iter().zip(self.flagged).find(|((f, _), _)| *f == flag).map_or(0, |(_, count)| count)
    }

    /// `count` as a percentage of all pixels.
    #[must_use]
    pub fn percent(&self, count: usize) -> f64 {
        100.0 * count as f64 / self.pixels.max(1) as f64
    }
}

/// What the noise model says about one color.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseStatistics {
    /// Median first-order uncertainty over the pixels that have one.
    pub median: Uncertainty,
    /// Mean DoLP as in [`Statistics::mean_dolp`], from values with their noise bias taken off ([`mas`], with its isotropic
    /// σ).
    pub mean_dolp: f64,
}

impl NoiseStatistics {
    /// `None` without covariance, or where no pixel has light.
    #[must_use]
    pub fn gather(planes: &StokesPlanes) -> Option<Self> {
        let (mut dolp, mut aolp) = (Vec::new(), Vec::new());
        let (mut light, mut linear) = (0.0, 0.0);
        for (i, [v00, v01, v02, v11, v12, v22]) in planes.covariance.as_ref()?.iter().enumerate() {
            let stokes = [&planes.s0, &planes.s1, &planes.s2].map(|p| f64::from(p[i]));
            let covariance = [[v00, v01, v02], [v01, v11, v12], [v02, v12, v22]].map(|row| row.map(|v| f64::from(*v)));
            if let Some(sigma) = isotropic_sigma(stokes[0], covariance) {
                light += stokes[0];
                linear += stokes[0] * mas(stokes[1].hypot(stokes[2]) / stokes[0], sigma);
            }
            if let Some(found) = uncertainty(stokes, covariance) {
                dolp.push(found.dolp);
                aolp.push(found.aolp.0);
            }
        }
        let median = Uncertainty { dolp: median(dolp)?, aolp: Radians(median(aolp)?) };
        Some(Self { median, mean_dolp: linear / light })
    }
}

/// The upper median; `None` of nothing.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_without_value_or_light_do_not_count_as_polarized() {
        let (s0, s1, s2) = ([2.0, 0.0, -1.0, 0.0, 2.0], [1.0, 0.0, 5.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 3.0]);
        let flags = [0, Flags::TOO_FEW.with(Flags::SATURATED).0, 0, 0, Flags::SATURATED.0];
        let residual = [0.0, 9.0, 0.0, 0.0, 4.0];
        let found = Statistics::gather([&s0, &s1, &s2], Some(&flags), Some(&residual));
        assert_eq!((found.no_light, found.above_one), (2, 1));
        assert_eq!((found.count(Flags::SATURATED), found.count(Flags::TOO_FEW), found.count(Flags::MISFIT)), (2, 1, 0));
        assert!((found.mean_dolp - 1.0).abs() < 1e-15 && (found.mean_s0 - 0.75).abs() < 1e-15);
        assert_eq!(found.rms_residual, Some(2.0));
        assert!((found.percent(2) - 40.0).abs() < 1e-12);
        assert!(Statistics::gather([&[], &[], &[]], None, None).mean_s0.abs() < 1e-300);
    }

    #[test]
    fn uncertainty_is_the_median_and_the_mean_loses_its_bias() {
        // Unpolarized light measured at p = σ: the naive mean says σ, the corrected one σ (1 − (1 − 1/e)/2).
        let planes = StokesPlanes {
            s0: vec![100.0; 3],
            s1: vec![1.0, 0.0, -1.0],
            s2: vec![0.0, 1.0, 0.0],
            flags: vec![0; 3],
            residual: None,
            covariance: Some(vec![[0.5, 0.0, 0.0, 1.0, 0.0, 1.0]; 3]),
        };
        let found = NoiseStatistics::gather(&planes).unwrap();
        assert!((found.mean_dolp - 0.01 * (0.5 + 0.5 / std::f64::consts::E)).abs() < 1e-12);
        assert!((found.median.aolp.0 - 0.5).abs() < 1e-12);
        assert!((found.median.dolp - 0.01 * (1.0 + 0.5 * 1e-4_f64).sqrt()).abs() < 1e-12);
        assert_eq!(NoiseStatistics::gather(&StokesPlanes { covariance: None, ..planes }), None);
    }
}
