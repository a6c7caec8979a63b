//! The proved error bound of the fixed-point Stokes against exact rational arithmetic, at inputs chosen to be worst.
//!
//! The reference shares nothing with the code under test but the analyzer rows: the pseudo-inverse is the normal
//! equations solved by Cramer's rule in big rationals.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    clippy::needless_range_loop,
    reason = "tests choose numbers that fit, and follow the formula's indices"
)]

use num_bigint::BigInt;
use num_rational::BigRational;
use proptest::prelude::*;
use protocol_polar::fixed::{GainQ15, Noise, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees, Flags};

fn exact(x: f64) -> BigRational {
    BigRational::from_float(x).unwrap()
}

fn int(x: i64) -> BigRational {
    BigRational::from_integer(BigInt::from(x))
}

fn to_f64(x: &BigRational) -> f64 {
    use num_bigint::ToBigInt;
    // 2^80 fractional bits are far more than the comparison needs.
    let scaled = (x * int(1 << 40) * int(1 << 40)).round().to_integer();
    let (sign, digits) = scaled.to_bigint().unwrap().to_u64_digits();
    let magnitude = digits.iter().rev().fold(0.0, |acc, d| acc * 2f64.powi(64) + *d as f64);
    (if sign == num_bigint::Sign::Minus { -magnitude } else { magnitude }) / 2f64.powi(80)
}

/// (AᵀSA)⁻¹AᵀS by Cramer's rule, 3 rows of N.
fn exact_pseudo_inverse(frames: &[Analyzer]) -> Vec<Vec<BigRational>> {
    let rows: Vec<[BigRational; 3]> = frames.iter().map(|f| f.row().map(exact)).collect();
    // Weight 1/σ² = 1/throughput, as StokesPlan states (its σ is the rounded square root; that is part of the bound).
    let weight: Vec<BigRational> = frames.iter().map(|f| exact(f.throughput).recip()).collect();
    let mut m: Vec<Vec<BigRational>> = vec![vec![int(0); 3]; 3];
    for (row, w) in rows.iter().zip(&weight) {
        for i in 0..3 {
            for j in 0..3 {
                m[i][j] = &m[i][j] + w * &row[i] * &row[j];
            }
        }
    }
    let minor = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        &m[a][c] * &m[b][d] - &m[a][d] * &m[b][c]
    };
    let determinant = &m[0][0] * minor(0, 0) + &m[0][1] * minor(0, 1) + &m[0][2] * minor(0, 2);
    (0..3)
        .map(|i| {
            rows.iter()
                .zip(&weight)
                .map(|(row, w)| (0..3).map(|j| minor(j, i) / &determinant * &row[j] * w).sum())
                .collect()
        })
        .collect()
}

fn dot(row: &[BigRational], samples: &[u16], dark: u16) -> BigRational {
    row.iter().zip(samples).map(|(w, x)| w * int(i64::from(*x) - i64::from(dark))).sum()
}

/// Exact rms residual per degree of freedom, whitened like the plan: √(Σ (x − A s)²/t / (N − 3)).
fn exact_residual(frames: &[Analyzer], inverse: &[Vec<BigRational>], samples: &[u16], dark: u16) -> f64 {
    if frames.len() == 3 {
        return 0.0;
    }
    let s: Vec<BigRational> = inverse.iter().map(|row| dot(row, samples, dark)).collect();
    let sum: BigRational = frames
        .iter()
        .zip(samples)
        .map(|(f, x)| {
            let model: BigRational = f.row().iter().zip(&s).map(|(a, s)| exact(*a) * s).sum();
            let r = int(i64::from(*x) - i64::from(dark)) - model;
            &r * &r / exact(f.throughput)
        })
        .sum();
    (to_f64(&sum) / (frames.len() - 3) as f64).sqrt()
}

fn frame_sets() -> impl Strategy<Value = Vec<Analyzer>> {
    let equispaced = (3..=16_usize, 0.0..180.0_f64)
        .prop_map(|(n, offset)| (0..n).map(|k| (offset + 180.0 * k as f64 / n as f64, 1.0, 1.0)).collect::<Vec<_>>());
    let any = prop::collection::vec((0.0..180.0_f64, 0.25..1.0_f64, 0.6..=1.0_f64), 3..=8);
    prop_oneof![equispaced, any, Just(vec![(0.0, 1.0, 1.0), (45.0, 1.0, 1.0), (90.0, 1.0, 1.0)])].prop_map(|set| {
        let analyzer =
            |(a, throughput, efficiency)| Analyzer { angle: Degrees(a).to_radians(), throughput, efficiency };
        set.into_iter().map(analyzer).collect()
    })
}

fn check(
    frames: &[Analyzer],
    word: Word,
    bits: u8,
    dark_share: f64,
    seed: u64,
    gain: u16,
) -> Result<f64, TestCaseError> {
    let top = u16::MAX >> (16 - bits);
    let noise = Noise { read_dn: 1.0, electrons_per_dn: 2.0, misfit_sigma: 0.0 };
    let Ok(plan) = StokesPlan::new(frames, word, SensorRange { bit_depth: bits, white_level: top }, noise) else {
        return Ok(0.0);
    };
    let weights = plan.weights(0).unwrap();
    let inverse = exact_pseudo_inverse(frames);
    let dark = (f64::from(top) * dark_share) as u16;
    let gain = GainQ15(gain);
    let lsb = plan.format().lsb_dn();
    let mut closest: f64 = 0.0;
    // Per component: the samples that push the quantization error of the weights as far as it goes, both ways, and noise.
    for (j, row) in weights.stokes_rows().iter().enumerate() {
        let fraction = i32::from(row.shift) + i32::from(plan.format().frac_bits);
        let error: Vec<f64> = (0..frames.len())
            .map(|k| to_f64(&(exact(f64::from(row.q[k]) * 2f64.powi(-fraction)) - &inverse[j][k])))
            .collect();
        let extreme = |up: bool| error.iter().map(|e| if (*e > 0.0) == up { top - 1 } else { 0 }).collect::<Vec<u16>>();
        let noisy: Vec<u16> = (0..frames.len())
            .map(|k| {
                (seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(k as u32 * 7 + j as u32) % u64::from(top)) as u16
            })
            .collect();
        for samples in [extreme(true), extreme(false), noisy] {
            let got = plan.photosite(Some(&weights), &samples, dark, gain);
            if got.flags.contains(Flags::OUT_OF_RANGE) {
                continue;
            }
            for i in 0..3 {
                let want = dot(&inverse[i], &samples, dark) * exact(gain.to_f64());
                let off = to_f64(&(exact(f64::from(got.stokes[i]) * lsb) - want)).abs();
                let bound = weights.bound_dn()[i] * gain.to_f64() + if gain == GainQ15::ONE { 0.0 } else { 0.5 * lsb };
                prop_assert!(off <= bound, "s{i}: off by {off}, bound {bound}, {samples:?} dark {dark}");
                closest = closest.max(off / bound);
            }
            let want = exact_residual(frames, &inverse, &samples, dark);
            let limit = f64::from(plan.format().residual_limit()) * lsb;
            if gain == GainQ15::ONE && want < limit {
                let off = (f64::from(got.residual) * lsb - want).abs();
                prop_assert!(off <= weights.residual_bound_dn(), "residual {off} > {}", weights.residual_bound_dn());
            }
        }
    }
    Ok(closest)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn narrow_words_stay_within_the_bound(frames in frame_sets(), bits in 8..=14_u8, dark in 0.0..0.3_f64, seed: u64, gain in prop_oneof![Just(32768_u16), 20000..50000_u16]) {
        check(&frames, Word::I16, bits, dark, seed, gain)?;
    }

    #[test]
    fn wide_words_stay_within_the_bound(frames in frame_sets(), bits in 8..=16_u8, dark in 0.0..0.3_f64, seed: u64, gain in prop_oneof![Just(32768_u16), 20000..50000_u16]) {
        check(&frames, Word::I32, bits, dark, seed, gain)?;
    }
}

/// A bound that is never approached says nothing: the search must come close to it.
#[test]
fn the_bound_is_tight() {
    let frames: Vec<Analyzer> =
        [3.0, 63.5, 121.0, 150.0].iter().map(|a| Analyzer::ideal(Degrees(*a).to_radians())).collect();
    let closest = (0..200).map(|seed| check(&frames, Word::I16, 12, 0.0, seed, 32768).unwrap()).fold(0.0, f64::max);
    assert!(closest > 0.8, "closest approach {closest}");
}
