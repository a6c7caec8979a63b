//! Every twin this processor can run, and the definition, agree on every bit.
extern crate std;

use super::narrow::{Twin, stokes_i16_by};
use super::{Dark, StripInput, StripOutput, WeightTable, simd};
use protocol_polar::fixed::{GainQ15, Noise, Photosite, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees, Flags};
use std::collections::BTreeMap;
use std::vec::Vec;
use std::{format, vec};

/// More than one span of the kernel, and a rest that is no whole block.
const PHOTOSITES: usize = 16 * 128 + 2 * 128 + 5;

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % limit
    }

    /// Smooth light, noise, black, the brink of saturation, and garbage beyond the bit depth.
    fn sample(&mut self, i: usize) -> u16 {
        match self.below(40) {
            0 => 0,
            1 => self.below(4096) as u16,
            2 => 4090 + self.below(6) as u16,
            3 => self.below(65536) as u16,
            _ => 250 + (i % 1500) as u16 + self.below(20) as u16,
        }
    }
}

fn run(twin: Twin, plan: &StokesPlan, input: StripInput) -> Vec<Photosite> {
    let mut s = [vec![0_i16; PHOTOSITES], vec![0; PHOTOSITES], vec![0; PHOTOSITES]];
    let (mut residual, mut flags) = (vec![0_u16; PHOTOSITES], vec![0; PHOTOSITES]);
    let stokes = s.each_mut().map(Vec::as_mut_slice);
    let output = StripOutput { stokes, residual: &mut residual, flags: &mut flags };
    stokes_i16_by(twin, plan, &mut WeightTable::new(), input, output).unwrap();
    (0..PHOTOSITES)
        .map(|i| Photosite {
            stokes: s.each_ref().map(|plane| plane[i].into()),
            residual: residual[i].into(),
            flags: Flags(flags[i]),
        })
        .collect()
}

/// Throughputs below 1 drive values over the ends of their words, of 3 to 16 frames, with and without maps.
#[test]
fn twins_are_the_definition() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    for frames in 3..=16_usize {
        for (maps, throughput) in [(false, 1.0), (true, 1.0), (false, 0.55), (true, 0.3), (false, 0.26)] {
            let analyzers: Vec<Analyzer> = (0..frames)
                .map(|k| Analyzer {
                    throughput: if k % 3 == 1 { throughput } else { 1.0 },
                    ..Analyzer::ideal(Degrees(3.0 + 180.0 * k as f64 / frames as f64).to_radians())
                })
                .collect();
            let noise = Noise { read_dn: 1.5, electrons_per_dn: 2.0, misfit_sigma: 3.0 };
            let range = SensorRange { bit_depth: 12, white_level: 4095 };
            let plan = StokesPlan::new(&analyzers, Word::I16, range, noise).unwrap();
            let data: Vec<Vec<u16>> =
                (0..frames).map(|_| (0..PHOTOSITES).map(|i| random.sample(i)).collect()).collect();
            let data: Vec<&[u16]> = data.iter().map(Vec::as_slice).collect();
            let dark: Vec<u16> =
                (0..PHOTOSITES).map(|_| 240 + random.below(20) as u16 * random.below(40) as u16).collect();
            let flat: Vec<u16> = (0..PHOTOSITES).map(|_| 24_000 + random.below(41_536) as u16).collect();
            let input = StripInput {
                frames: &data,
                dark: if maps { Dark::Map(&dark) } else { Dark::Level(256) },
                flat: maps.then_some(&flat),
            };
            let mut known = BTreeMap::new();
            let want: Vec<Photosite> = (0..PHOTOSITES)
                .map(|i| {
                    let samples: Vec<u16> = data.iter().map(|frame| frame[i]).collect();
                    let dropped = plan.saturated(&samples);
                    let weights = known.entry(dropped).or_insert_with(|| plan.weights(dropped).ok());
                    let gain = if maps { GainQ15(flat[i]) } else { GainQ15::ONE };
                    plan.photosite(weights.as_ref(), &samples, input.dark.at(i), gain)
                })
                .collect();
            for (which, twin) in simd::twins().into_iter().enumerate() {
                let Some(twin) = twin else { continue };
                for (i, (got, want)) in run(twin, &plan, input).into_iter().zip(&want).enumerate() {
                    let samples = data.iter().map(|frame| frame[i]);
                    let context =
                        || format!("twin {which}, photosite {i}, {:?}, maps {maps}", samples.collect::<Vec<_>>());
                    assert_eq!(got, *want, "{}", context());
                }
            }
        }
    }
}
