//! The strip kernel against the memory traffic it cannot avoid, in one run: `cargo bench -p firmware-core --bench kernel`.
//!
//! One row per case: ns per photosite, and the ratio to `memcpy` of half the bytes the kernel reads and writes (a copy reads
//! and writes each of its bytes once). Copy and kernel take turns; the ratio is per turn, and its median, least and most are
//! printed. Single thread, 5 MP, buffers touched before.
use firmware_core::kernel::polar_form::polar_form;
use firmware_core::kernel::{Dark, StripInput, StripOutput, WeightTable, stokes_i16, stokes_i32};
use protocol_polar::fixed::{Noise, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees};
use std::hint::black_box;
use std::time::Instant;

const PHOTOSITES: usize = 2448 * 2048;
const TURNS: usize = 15;

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

fn main() {
    let mut s = [vec![0_i16; PHOTOSITES], vec![0; PHOTOSITES], vec![0; PHOTOSITES]];
    let mut residual = vec![0_u16; PHOTOSITES];
    let mut flags = vec![0_u8; PHOTOSITES];
    let dark = vec![256_u16; PHOTOSITES];
    let flat = vec![33_000_u16; PHOTOSITES];
    let cases: [(&str, usize, u64, bool); 7] = [
        ("4 frames, i16", 4, 0, false),
        ("4 frames, i16, dark and flat maps", 4, 0, true),
        ("4 frames, i16, 0.5 % clipped", 4, 5, false),
        ("3 frames, i16", 3, 0, false),
        ("6 frames, i16", 6, 0, false),
        ("8 frames, i16", 8, 0, false),
        ("16 frames, i16", 16, 0, false),
    ];
    for (name, count, clipped, maps) in cases {
        let data = frames(count, clipped);
        let inputs: Vec<&[u16]> = data.iter().map(Vec::as_slice).collect();
        let plan = plan(count, Word::I16);
        let mut table = WeightTable::new();
        let read = 2 * count + if maps { 4 } else { 0 };
        compare(name, (read + 9) as f64 / 2.0, || {
            let [a, b, c] = &mut s;
            let input = StripInput {
                frames: black_box(&inputs),
                dark: if maps { Dark::Map(&dark) } else { Dark::Level(256) },
                flat: maps.then_some(&flat),
            };
            let output = StripOutput { stokes: [a, b, c], residual: &mut residual, flags: &mut flags };
            stokes_i16(&plan, &mut table, input, output).unwrap();
        });
    }
    let data = frames(4, 0);
    let inputs: Vec<&[u16]> = data.iter().map(Vec::as_slice).collect();
    let wide = plan(4, Word::I32);
    let mut table = WeightTable::new();
    let mut w = [vec![0_i32; PHOTOSITES], vec![0; PHOTOSITES], vec![0; PHOTOSITES]];
    let mut wide_residual = vec![0_u32; PHOTOSITES];
    compare("4 frames, i32 (the definition)", (8.0 + 17.0) / 2.0, || {
        let [a, b, c] = &mut w;
        let input = StripInput { frames: &inputs, dark: Dark::Level(256), flat: None };
        let output = StripOutput { stokes: [a, b, c], residual: &mut wide_residual, flags: &mut flags };
        stokes_i32(&wide, &mut table, input, output).unwrap();
    });
    let mut polar = vec![(0_u16, 0_u16); PHOTOSITES];
    compare("DoLP and AoLP from i16 planes (CORDIC)", (6.0 + 4.0) / 2.0, || {
        for (i, out) in polar.iter_mut().enumerate() {
            let p = polar_form([s[0][i].into(), s[1][i].into(), s[2][i].into()]);
            *out = (p.dolp_q16, p.aolp_turn16);
        }
    });
}
