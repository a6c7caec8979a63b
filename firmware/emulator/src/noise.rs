//! Seeded random draws by number, not by order: draw `n` of a key is the same whoever asks, in whatever order.
//!
//! The bits are SplitMix64's (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators"), whose finalizer
//! passes BigCrush on consecutive counters.

/// Golden ratio · 2^64: the increment of SplitMix64.
const GAMMA: u64 = 0x9E37_79B9_7F4A_7C15;

/// A key under which draws are numbered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draws(u64);

impl Draws {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self(mix(mix(seed) ^ stream.wrapping_mul(GAMMA)))
    }

    /// 64 even bits.
    #[inline]
    fn bits(self, number: u64) -> u64 {
        mix(self.0.wrapping_add(number.wrapping_mul(GAMMA)))
    }

    /// Draw `number` of a distribution of mean 0 and variance 1 that is normal for all a sensor needs: 128 fair coins and
    /// a uniform variate to fill the steps between them. Variance and mean are exact; excess kurtosis is −2/128; it ends
    /// at ±11 σ.
    #[inline]
    pub(crate) fn normal(self, number: u64) -> f32 {
        let (a, b) = (self.bits(2 * number), self.bits(2 * number + 1));
        // 24 bits of a product of both are as good as new for smoothing.
        let fill = (a.wrapping_mul(b | 1) >> 40) as u32;
        #[expect(clippy::cast_precision_loss, reason = "24 bits are exact")]
        let fill = fill as f32 * (1.0 / 16_777_216.0) - 0.5;
        #[expect(clippy::cast_precision_loss, reason = "at most 128")]
        let heads = (a.count_ones() + b.count_ones()) as f32 - 64.0;
        // Variance of the coins 128/4, of the filling 1/12.
        (heads + fill) * (1.0 / 5.664_215_f32)
    }
}

#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_normal() {
        let n = 400_000;
        let all: Vec<f64> = (0..n).map(|i| f64::from(Draws::new(7, 3).normal(i))).collect();
        let count = all.len() as f64;
        let moment = |p: i32| all.iter().map(|x| x.powi(p)).sum::<f64>() / count;
        // Standard errors: √(1/n), √(2/n), √(15/n), √(96/n).
        assert!(moment(1).abs() < 5.0 / count.sqrt(), "mean {}", moment(1));
        assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "variance {}", moment(2));
        assert!(moment(3).abs() < 5.0 * (15.0 / count).sqrt(), "skewness {}", moment(3));
        assert!((moment(4) - 3.0 + 2.0 / 128.0).abs() < 5.0 * (96.0 / count).sqrt(), "kurtosis {}", moment(4));
        for (limit, share) in [(1.0, 0.682_69), (2.0, 0.954_50), (3.0, 0.997_30)] {
            let inside = all.iter().filter(|x| x.abs() < limit).count() as f64 / count;
            assert!((inside - share).abs() < 0.003, "{inside} within {limit} σ");
        }
    }

    #[test]
    fn neighbours_and_streams_are_independent() {
        let n = 100_000_u64;
        let correlation = |a: &dyn Fn(u64) -> f32, b: &dyn Fn(u64) -> f32| {
            (0..n).map(|i| f64::from(a(i)) * f64::from(b(i))).sum::<f64>() / n as f64
        };
        let (x, y, z) = (Draws::new(1, 0), Draws::new(1, 1), Draws::new(2, 0));
        let limit = 5.0 / (n as f64).sqrt();
        for other in [&|i| x.normal(i + 1), &|i| x.normal(i + 1280), &|i| y.normal(i), &|i| z.normal(i)]
            as [&dyn Fn(u64) -> f32; 4]
        {
            assert!(correlation(&|i| x.normal(i), other).abs() < limit);
        }
    }
}
