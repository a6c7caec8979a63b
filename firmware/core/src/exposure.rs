//! Finding one exposure for all angles: the longest at which none clips.

/// How bright a picture came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Level {
    /// Level below which all but one photosite in 10 000 lie (hot ones do not count), DN.
    pub peak_dn: u16,
    /// Photosites at or above the white level, in 10 000.
    pub clipped: u16,
}

/// What to do after all angles were metered at one exposure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Meter again at this exposure, µs.
    Again(u32),
    /// Use this exposure, µs.
    Locked {
        /// The exposure.
        exposure_us: u32,
        /// Something clips even so.
        clips: bool,
    },
    /// More than half of the picture clips at the shortest exposure.
    TooBright,
}

/// One photosite in so many may clip.
const SPARED: u32 = 10_000;
/// The brightest angle is put at this share of the range, in 1/100: noise and drift go above.
const TARGET_PERCENT: u64 = 85;
const MAX_ROUNDS: u8 = 12;

/// The search over exposures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExposureSearch {
    exposure_us: u32,
    limits_us: (u32, u32),
    range_dn: (u16, u16),
    worst: Level,
    round: u8,
}

impl ExposureSearch {
    /// Starts at `first_us`; `limits_us` are the camera's, `range_dn` black and white level.
    #[must_use]
    pub(crate) fn new(first_us: u32, limits_us: (u32, u32), range_dn: (u16, u16)) -> Self {
        let exposure_us = first_us.max(limits_us.0).min(limits_us.1);
        Self { exposure_us, limits_us, range_dn, worst: Level { peak_dn: 0, clipped: 0 }, round: 0 }
    }

    /// The exposure to meter at, µs.
    #[must_use]
    pub(crate) fn exposure_us(&self) -> u32 {
        self.exposure_us
    }

    /// Takes the level of one angle.
    pub(crate) fn observe(&mut self, level: Level) {
        self.worst.peak_dn = self.worst.peak_dn.max(level.peak_dn);
        self.worst.clipped = self.worst.clipped.max(level.clipped);
    }

    /// Decides after the last angle; on `Again` the search continues at the new exposure.
    pub(crate) fn decide(&mut self) -> Verdict {
        let (shortest, longest) = self.limits_us;
        let (black, white) = self.range_dn;
        let level = core::mem::replace(&mut self.worst, Level { peak_dn: 0, clipped: 0 });
        self.round += 1;
        let last = self.round >= MAX_ROUNDS;
        if level.clipped > 1 {
            if self.exposure_us > shortest && !last {
                self.exposure_us = (self.exposure_us / 4).max(shortest);
                return Verdict::Again(self.exposure_us);
            }
            if level.clipped > 5_000 {
                return Verdict::TooBright;
            }
            return Verdict::Locked { exposure_us: self.exposure_us, clips: true };
        }
        let signal = u64::from(level.peak_dn.saturating_sub(black).max(1));
        let target = u64::from(white.saturating_sub(black)) * TARGET_PERCENT / 100;
        let wanted = u64::from(self.exposure_us) * target / signal;
        let exposure_us = u32::try_from(wanted).unwrap_or(u32::MAX).clamp(shortest, longest);
        // A dim metering picture predicts badly: go most of the way and look again.
        if exposure_us / 4 > self.exposure_us && !last {
            self.exposure_us = exposure_us / 2;
            return Verdict::Again(self.exposure_us);
        }
        self.exposure_us = exposure_us;
        Verdict::Locked { exposure_us, clips: false }
    }
}

/// Counts samples by brightness, 256 bins over the bit depth.
#[derive(Clone, Debug)]
pub(crate) struct Histogram {
    bins: [u32; 256],
    clipped: u32,
    total: u32,
    shift: u8,
    white: u16,
}

impl Histogram {
    /// An empty histogram for samples of `bit_depth` bits.
    #[must_use]
    pub(crate) fn new(bit_depth: u8, white: u16) -> Self {
        Self { bins: [0; 256], clipped: 0, total: 0, shift: bit_depth.saturating_sub(8), white }
    }

    /// Counts `samples`.
    pub(crate) fn add(&mut self, samples: &[u16]) {
        for x in samples {
            let bin = usize::from((*x).min(self.white) >> self.shift);
            if let Some(count) = self.bins.get_mut(bin) {
                *count += 1;
            }
            self.clipped += u32::from(*x >= self.white);
            self.total += 1;
        }
    }

    /// The level of all that was counted.
    #[must_use]
    pub(crate) fn level(&self) -> Level {
        let mut above = 0;
        let mut peak_dn = 0;
        for (bin, count) in (0_u16..256).zip(self.bins).rev() {
            above += count;
            if above > self.total / SPARED {
                peak_dn = (((u32::from(bin) + 1) << self.shift) - 1).try_into().unwrap_or(u16::MAX);
                break;
            }
        }
        let per_myriad = u64::from(self.clipped) * 10_000 / u64::from(self.total.max(1));
        Level { peak_dn, clipped: u16::try_from(per_myriad).unwrap_or(u16::MAX) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A sensor that answers linearly: peak = black + gain · exposure.
    fn meter(dn_per_us: f64, exposure_us: u32) -> Level {
        let dn = 256.0 + dn_per_us * f64::from(exposure_us);
        let clipped = if dn >= 4095.0 { (dn / 4095.0 * 1000.0).min(10_000.0) as u16 } else { 0 };
        Level { peak_dn: dn.min(4095.0) as u16, clipped }
    }

    proptest! {
        #[test]
        fn any_light_within_the_cameras_reach_is_exposed_well(log_gain in -5.0..0.5_f64, first in 10..1_000_000_u32) {
            let gain = 10_f64.powf(log_gain);
            let limits = (20, 2_000_000);
            let mut search = ExposureSearch::new(first, limits, (256, 4095));
            let locked = loop {
                search.observe(meter(gain, search.exposure_us()));
                match search.decide() {
                    Verdict::Again(_) => {}
                    Verdict::Locked { exposure_us, clips } => {
                        prop_assert!(!clips);
                        break exposure_us;
                    }
                    Verdict::TooBright => prop_assert!(false, "too bright at gain {gain}"),
                }
            };
            let dn = 256.0 + gain * f64::from(locked);
            prop_assert!(dn < 4095.0, "clips: {dn}");
            prop_assert!(dn > 0.6 * 4095.0 || locked == limits.1, "dim: {dn} at {locked} µs");
        }
    }

    #[test]
    fn the_sun_in_the_lens_is_too_bright() {
        let mut search = ExposureSearch::new(1000, (20, 100_000), (256, 4095));
        let verdict = loop {
            search.observe(Level { peak_dn: 4095, clipped: 9_000 });
            match search.decide() {
                Verdict::Again(us) => assert!(us >= 20),
                other => break other,
            }
        };
        assert_eq!(verdict, Verdict::TooBright);
    }

    #[test]
    fn a_hot_photosite_does_not_set_the_exposure() {
        let mut histogram = Histogram::new(12, 4095);
        histogram.add(&[1000; 30_000]);
        histogram.add(&[4095; 2]);
        let level = histogram.level();
        assert!((1000..1016).contains(&level.peak_dn) && level.clipped == 0, "{level:?}");
    }
}
