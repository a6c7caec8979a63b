//! Random draws by counter: a draw depends on what it is for and on nothing that happened before, so results are the same
//! for any number of threads and any subset of effects.
//!
//! SplitMix64 (Steele, Lea and Flood 2014; constants of Vigna's public-domain code), started at a hash of the counter.

use rand::RngCore;

/// What a draw is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Draw {
    Bumps = 1,
    Wheel = 2,
    Prnu = 3,
    Dark = 4,
    Shot = 5,
    Read = 6,
}

/// The draws of one purpose, view and frame: one generator per index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stream(u64);

/// The generator of one index.
#[derive(Clone, Debug)]
pub(crate) struct Generator(u64);

/// 2^64 over the golden ratio, odd.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Stream {
    pub(crate) fn new(seed: u64, draw: Draw, view: u64, frame: u64) -> Self {
        Self(
            [draw as u64, view, frame].into_iter().fold(mix(seed), |key, part| mix(key ^ mix(part.wrapping_add(STEP)))),
        )
    }

    pub(crate) fn at(self, index: u64) -> Generator {
        Generator(mix(self.0 ^ mix(index.wrapping_mul(STEP))))
    }
}

impl RngCore for Generator {
    fn next_u32(&mut self) -> u32 {
        // The upper half is the better one.
        u32::try_from(self.next_u64() >> 32).unwrap_or(0)
    }

    fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        mix(self.0)
    }

    fn fill_bytes(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.next_u64().to_le_bytes()[..chunk.len()]);
        }
    }
}

fn mix(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first outputs from state 1234567 of the published splitmix64.c.
    #[test]
    fn the_generator_is_splitmix64() {
        let mut generator = Generator(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([0; 3].map(|_: u64| generator.next_u64()), expected);
    }

    /// Neighboring counters in every coordinate: bits are balanced, and no two streams are alike.
    #[test]
    fn neighbors_are_unrelated() {
        let first = |seed, draw, view, frame, index| Stream::new(seed, draw, view, frame).at(index).next_u64();
        let base = first(1, Draw::Shot, 0, 0, 0);
        let others = [
            first(2, Draw::Shot, 0, 0, 0),
            first(1, Draw::Read, 0, 0, 0),
            first(1, Draw::Shot, 1, 0, 0),
            first(1, Draw::Shot, 0, 1, 0),
            first(1, Draw::Shot, 0, 0, 1),
        ];
        for other in others {
            let differing = (base ^ other).count_ones();
            assert!((16..=48).contains(&differing), "{differing} of 64 bits");
        }
        let ones: u32 = (0..4096).map(|k| first(7, Draw::Shot, 0, 0, k).count_ones()).sum();
        // 262144 fair bits: σ = 256.
        assert!((i64::from(ones) - 131_072).abs() < 1280, "{ones}");
    }
}
