//! The per-pixel fit of 5 MP frames, all threads: `cargo bench -p host-fit --bench stokes`.
//!
//! One row per case: median time of an image, ns per pixel, and GB/s of samples read and planes written: the floor is what
//! memory can do (some 10 GB/s per channel).
#![allow(clippy::cast_possible_truncation, clippy::unwrap_used, reason = "a bench chooses numbers that fit")]

use std::hint::black_box;
use std::time::Instant;

use host_fit::{Dark, EstimatorOptions, Frame, FrameSamples, Noise, StokesEstimator};
use protocol_polar::{Analyzer, Degrees};

const WIDTH: usize = 2448;
const PIXELS: usize = WIDTH * 2048;

fn main() {
    let noise = Noise { read_dn: 2.0, electrons_per_dn: 2.0, misfit_sigma: 5.0 };
    for (name, count, noise) in
        [("3 frames", 3, None), ("4 frames", 4, None), ("8 frames", 8, None), ("4 frames, covariance", 4, Some(noise))]
    {
        let frames: Vec<Frame> = (0..count)
            .map(|k| Frame::new(Analyzer::ideal(Degrees(180.0 * f64::from(k) / f64::from(count)).to_radians())))
            .collect();
        // One sample in 1000 is saturated.
        let mut state = 1_u32;
        let samples: Vec<Vec<f32>> = frames
            .iter()
            .map(|_| {
                let next = |_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    if (state >> 8).is_multiple_of(1000) { 4095.0 } else { 500.0 + (state >> 22) as f32 }
                };
                (0..PIXELS).map(next).collect()
            })
            .collect();
        let options = EstimatorOptions { white_dn: Some(4095.0), noise, ..EstimatorOptions::default() };
        let estimator = StokesEstimator::new(&frames, options).unwrap();
        let given: Vec<FrameSamples<'_>> =
            samples.iter().map(|samples| FrameSamples { samples, dark: Dark::Level(64.0), gain: None }).collect();
        let mut seconds: Vec<f64> = (0..9)
            .map(|_| {
                let start = Instant::now();
                black_box(estimator.image(black_box(&given), WIDTH).unwrap());
                start.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        let median = seconds[seconds.len() / 2];
        let residual = if count > 3 { 4 } else { 0 };
        let covariance = if noise.is_some() { 24 } else { 0 };
        let bytes = 4 * frames.len() + 13 + residual + covariance;
        println!(
            "{name:<22} {:7.1} ms {:6.2} ns/pixel {:6.2} GB/s",
            1e3 * median,
            1e9 * median / PIXELS as f64,
            (bytes * PIXELS) as f64 / median / 1e9
        );
    }
}
