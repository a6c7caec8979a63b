//! The strip kernel against the memory traffic it cannot avoid, in one run: `cargo bench -p firmware-core --bench kernel`.
//!
//! One row per case: ns per photosite, and the ratio to `memcpy` of half the bytes the kernel reads and writes (a copy reads
//! and writes each of its bytes once). Copy and kernel take turns; the ratio is per turn, and its median, least and most are
//! printed. Single thread, 5 MP, buffers touched before.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    reason = "a bench chooses numbers that fit"
)]

use firmware_core::kernel::polar_form::polar_form_strip;
use firmware_core::kernel::{Dark, StripInput, StripOutput, WeightTable, stokes_i16, stokes_i32};
use protocol_polar::fixed::{Noise, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees};
use std::hint::black_box;
use std::ops::Range;
use std::time::Instant;

const PHOTOSITES: usize = 2448 * 2048;
const TURNS: usize = 25;

/// Samples like a photograph's: s0 between 300 and 4000 DN, some polarization, ±20 DN of noise; `clipped` of 1000
/// photosites have one saturated sample.
fn frames(count: usize, clipped: u64) -> Vec<Vec<u16>> {
    let mut state = 0x1234_5678_9ABC_DEF0_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let mut frames = vec![vec![0_u16; PHOTOSITES]; count];
    for i in 0..PHOTOSITES {
        let level = 300 + (i % 2448) as u64 / 2;
        let clips = next() % 1000 < clipped;
        for frame in &mut frames {
            frame[i] = (256 + level + next() % 40) as u16;
        }
        if clips {
            frames[(next() % count as u64) as usize][i] = 4095;
        }
    }
    frames
}

fn plan(count: usize, word: Word) -> StokesPlan {
    let analyzers: Vec<Analyzer> =
        (0..count).map(|k| Analyzer::ideal(Degrees(0.7 + 180.0 * k as f64 / count as f64).to_radians())).collect();
    let noise = Noise { read_dn: 1.5, electrons_per_dn: 2.0, misfit_sigma: 5.0 };
    StokesPlan::new(&analyzers, word, SensorRange { bit_depth: 12, white_level: 4095 }, noise).unwrap()
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// Times `kernel` in turns with a copy of `bytes` bytes per photosite.
fn compare(name: &str, bytes: f64, mut kernel: impl FnMut()) {
    let total = (PHOTOSITES as f64 * bytes) as usize;
    let (from, mut to) = (vec![1_u8; total], vec![2_u8; total]);
    kernel();
    let mut turns: Vec<(f64, f64)> = (0..TURNS)
        .map(|_| {
            let copy = seconds(|| black_box(&mut to).copy_from_slice(black_box(&from)));
            let own = seconds(&mut kernel);
            (own / copy, own)
        })
        .collect();
    turns.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (ratio, own) = turns[TURNS / 2];
    let (least, most) = (turns[0].0, turns[TURNS - 1].0);
    println!(
        "{name:<44} {:6.3} ns/photosite   {ratio:5.2}x copy ({least:.2} to {most:.2}) of {bytes} B/photosite",
        own / PHOTOSITES as f64 * 1e9
    );
}

/// Strips of a few rows, as the camera computes them: what one step leaves in the cache, the next finds there.
const STRIP: usize = 8 * 2448;

/// Planes of one word, where the kernels write.
struct Planes<S, R> {
    s: [Vec<S>; 3],
    residual: Vec<R>,
    flags: Vec<u8>,
}

impl<S: Copy + From<bool>, R: Copy + From<bool>> Planes<S, R> {
    fn new() -> Self {
        // Written, not merely allocated: the first touch of a page is not the kernel's cost.
        let plane = || vec![S::from(true); PHOTOSITES];
        Self { s: [plane(), plane(), plane()], residual: vec![R::from(true); PHOTOSITES], flags: vec![1; PHOTOSITES] }
    }

    fn output(&mut self, range: Range<usize>) -> StripOutput<'_, S, R> {
        StripOutput {
            stokes: self.s.each_mut().map(|plane| &mut plane[range.clone()]),
            residual: &mut self.residual[range.clone()],
            flags: &mut self.flags[range],
        }
    }
}

fn main() {
    // `cargo bench -- clipped` runs the rows with that word.
    let only = std::env::args().skip(1).find(|word| !word.starts_with('-')).unwrap_or_default();
    let dark = vec![256_u16; PHOTOSITES];
    let flat = vec![33_000_u16; PHOTOSITES];
    let mut planes = Planes::<i16, u16>::new();
    let cases: [(&str, usize, u64, bool); 8] = [
        ("4 frames, i16", 4, 0, false),
        ("4 frames, i16, dark and flat maps", 4, 0, true),
        ("4 frames, i16, 0.5 % clipped", 4, 5, false),
        ("3 frames, i16", 3, 0, false),
        ("5 frames, i16", 5, 0, false),
        ("6 frames, i16", 6, 0, false),
        ("8 frames, i16", 8, 0, false),
        ("16 frames, i16", 16, 0, false),
    ];
    for (name, count, clipped, maps) in cases.into_iter().filter(|(name, ..)| name.contains(&only)) {
        let data = frames(count, clipped);
        let inputs: Vec<&[u16]> = data.iter().map(Vec::as_slice).collect();
        let plan = plan(count, Word::I16);
        let mut table = WeightTable::new();
        let read = 2 * count + if maps { 4 } else { 0 };
        compare(name, (read + 9) as f64 / 2.0, || {
            let input = StripInput {
                frames: black_box(&inputs),
                dark: if maps { Dark::Map(&dark) } else { Dark::Level(256) },
                flat: maps.then_some(&flat),
            };
            stokes_i16(&plan, &mut table, input, planes.output(0..PHOTOSITES)).unwrap();
        });
    }

    let (mut dolp, mut aolp) = (vec![1_u16; PHOTOSITES], vec![1_u16; PHOTOSITES]);
    let name = "4 frames, i16, with DoLP and AoLP";
    if name.contains(&only) {
        let data = frames(4, 0);
        let plan = plan(4, Word::I16);
        let mut table = WeightTable::new();
        compare(name, (8.0 + 9.0 + 4.0) / 2.0, || {
            for start in (0..PHOTOSITES).step_by(STRIP) {
                let range = start..PHOTOSITES.min(start + STRIP);
                let inputs: [&[u16]; 4] = std::array::from_fn(|k| &data[k][range.clone()]);
                let input = StripInput { frames: &inputs, dark: Dark::Level(256), flat: None };
                stokes_i16(&plan, &mut table, input, planes.output(range.clone())).unwrap();
                let stokes = planes.s.each_ref().map(|plane| &plane[range.clone()]);
                polar_form_strip(stokes, &mut dolp[range.clone()], &mut aolp[range]);
            }
        });
    }
    let name = "DoLP and AoLP from i16 planes (CORDIC)";
    if name.contains(&only) {
        compare(name, (6.0 + 4.0) / 2.0, || {
            polar_form_strip(planes.s.each_ref().map(Vec::as_slice), &mut dolp, &mut aolp);
        });
    }
    drop(planes);

    let mut planes = Planes::<i32, u32>::new();
    for (name, count) in
        [("4 frames, i32", 4), ("8 frames, i32", 8)].into_iter().filter(|(name, _)| name.contains(&only))
    {
        let data = frames(count, 0);
        let inputs: Vec<&[u16]> = data.iter().map(Vec::as_slice).collect();
        let plan = plan(count, Word::I32);
        let mut table = WeightTable::new();
        compare(name, (2 * count + 17) as f64 / 2.0, || {
            let input = StripInput { frames: black_box(&inputs), dark: Dark::Level(256), flat: None };
            stokes_i32(&plan, &mut table, input, planes.output(0..PHOTOSITES)).unwrap();
        });
    }
}
