//! The strip kernels compute the same bits as the definition, whatever is thrown at them.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    reason = "tests choose numbers that fit"
)]

use firmware_core::kernel::polar_form::{polar_form, polar_form_strip};
use firmware_core::kernel::{Dark, StripError, StripInput, StripOutput, WeightTable, stokes_i16, stokes_i32};
use proptest::prelude::*;
use protocol_polar::fixed::{GainQ15, Noise, Photosite, SensorRange, StokesPlan, Word};
use protocol_polar::{Analyzer, Degrees, Flags};

#[derive(Debug)]
struct Case {
    plan: StokesPlan,
    frames: Vec<Vec<u16>>,
    dark: Result<u16, Vec<u16>>,
    flat: Option<Vec<u16>>,
}

impl Case {
    fn definition(&self, i: usize) -> Photosite {
        let samples: Vec<u16> = self.frames.iter().map(|f| f[i]).collect();
        let dark = self.dark.as_ref().map_or_else(|map| map[i], |level| *level);
        let gain = self.flat.as_ref().map_or(GainQ15::ONE, |f| GainQ15(f[i]));
        let weights = self.plan.weights(self.plan.saturated(&samples)).ok();
        self.plan.photosite(weights.as_ref(), &samples, dark, gain)
    }

    fn kernel(&self) -> Vec<Photosite> {
        let n = self.frames[0].len();
        let frames: Vec<&[u16]> = self.frames.iter().map(Vec::as_slice).collect();
        let dark = self.dark.as_ref().map_or_else(|map| Dark::Map(map), |level| Dark::Level(*level));
        let input = StripInput { frames: &frames, dark, flat: self.flat.as_deref() };
        let mut table = WeightTable::new();
        let mut flags = vec![0; n];
        let (stokes, residual): (Vec<[i32; 3]>, Vec<u32>) = match self.plan.format().word {
            Word::I16 => {
                let mut s = [vec![0_i16; n], vec![0; n], vec![0; n]];
                let mut residual = vec![0_u16; n];
                let [a, b, c] = &mut s;
                let output = StripOutput { stokes: [a, b, c], residual: &mut residual, flags: &mut flags };
                stokes_i16(&self.plan, &mut table, input, output).unwrap();
                let stokes = (0..n).map(|i| s.each_ref().map(|plane| plane[i].into())).collect();
                (stokes, residual.into_iter().map(u32::from).collect())
            }
            Word::I32 => {
                let mut s = [vec![0_i32; n], vec![0; n], vec![0; n]];
                let mut residual = vec![0_u32; n];
                let [a, b, c] = &mut s;
                let output = StripOutput { stokes: [a, b, c], residual: &mut residual, flags: &mut flags };
                stokes_i32(&self.plan, &mut table, input, output).unwrap();
                ((0..n).map(|i| s.each_ref().map(|plane| plane[i])).collect(), residual)
            }
        };
        stokes
            .into_iter()
            .zip(residual)
            .zip(flags)
            .map(|((stokes, residual), flags)| Photosite { stokes, residual, flags: Flags(flags) })
            .collect()
    }
}

fn samples(bits: u8) -> impl Strategy<Value = u16> {
    let top = u16::MAX >> (16 - bits);
    // Black, noise around it, the middle, the brink of saturation, and garbage beyond the bit depth.
    prop_oneof![3 => 0..=top, 1 => Just(0_u16), 2 => (top / 16 - 8)..(top / 16 + 8), 1 => (top - 3)..=top, 1 => any::<u16>()]
}

fn cases() -> impl Strategy<Value = Case> {
    (3..=16_usize, 8..=14_u8, prop_oneof![Just(Word::I16), Just(Word::I32)], 1..400_usize).prop_flat_map(
        |(n, bits, word, photosites)| {
            let top = u16::MAX >> (16 - bits);
            let frame = prop::collection::vec(samples(bits), photosites);
            let dark = prop_oneof![
                Just(Ok(top / 16)),
                prop::collection::vec(0..top / 8, photosites).prop_map(Err),
                // A hot photosite may be brighter in the dark than the white level allows.
                prop::collection::vec(0..=top, photosites).prop_map(Err),
            ];
            let flat = prop::option::of(prop::collection::vec(prop_oneof![Just(32768_u16), any::<u16>()], photosites));
            let offsets = prop::collection::vec(-3.0..3.0_f64, n);
            let others = (0.0..6.0_f64, prop_oneof![3 => Just(1.0), 1 => 1e-3..1.0_f64]);
            (prop::collection::vec(frame, n), dark, flat, offsets, others).prop_filter_map(
                "exposures so unequal need wider words",
                move |(frames, dark, flat, offsets, (misfit_sigma, throughput))| {
                    let mut analyzers: Vec<Analyzer> = offsets
                        .iter()
                        .enumerate()
                        .map(|(k, o)| Analyzer::ideal(Degrees(o + 180.0 * k as f64 / n as f64).to_radians()))
                        .collect();
                    analyzers[n / 2].throughput = throughput;
                    let noise = Noise { read_dn: 1.5, electrons_per_dn: 2.0, misfit_sigma };
                    let range = SensorRange { bit_depth: bits, white_level: top - 1 };
                    Some(Case { plan: StokesPlan::new(&analyzers, word, range, noise).ok()?, frames, dark, flat })
                },
            )
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn kernel_is_the_definition(case in cases()) {
        for (i, got) in case.kernel().into_iter().enumerate() {
            prop_assert_eq!(got, case.definition(i), "photosite {} {:?}", i, case.frames.iter().map(|f| f[i]).collect::<Vec<_>>());
        }
    }
}

proptest! {
    #[test]
    fn polar_form_of_a_strip_is_that_of_its_photosites(
        stokes in prop::collection::vec(any::<[i16; 3]>(), 0..200),
        small in prop::collection::vec([-3..4_i16, -3..4_i16, -3..4_i16], 0..200),
    ) {
        let stokes: Vec<[i16; 3]> = stokes.into_iter().chain(small).collect();
        let planes = [0, 1, 2].map(|j| stokes.iter().map(|s| s[j]).collect::<Vec<_>>());
        let (mut dolp, mut aolp) = (vec![1; stokes.len()], vec![1; stokes.len()]);
        polar_form_strip(planes.each_ref().map(Vec::as_slice), &mut dolp, &mut aolp);
        for (i, s) in stokes.iter().enumerate() {
            let want = polar_form(s.map(i32::from));
            prop_assert_eq!((dolp[i], aolp[i]), (want.dolp_q16, want.aolp_turn16), "{:?}", s);
        }
    }
}

fn plan(angles: &[f64], misfit_sigma: f64) -> StokesPlan {
    let analyzers: Vec<Analyzer> = angles.iter().map(|a| Analyzer::ideal(Degrees(*a).to_radians())).collect();
    let noise = Noise { read_dn: 1.5, electrons_per_dn: 2.0, misfit_sigma };
    StokesPlan::new(&analyzers, Word::I16, SensorRange { bit_depth: 12, white_level: 4095 }, noise).unwrap()
}

/// PHYSICS §4: one clipped frame of four turns DoLP 0.8 into 0.667. Dropped, it stays 0.8.
#[test]
fn a_saturated_sample_is_dropped_not_used() {
    let case = Case {
        plan: plan(&[0.0, 45.0, 90.0, 135.0], 5.0),
        frames: vec![vec![4095; 200], vec![2500; 200], vec![500; 200], vec![2500; 200]],
        dark: Ok(0),
        flat: None,
    };
    // The light: s0 = 5000, s1 = 4000; the frame at 0° would be 4500 and clips.
    for photosite in case.kernel() {
        let [s0, s1, s2] = photosite.stokes.map(|s| f64::from(s) * 0.25);
        assert!((s0 - 5000.0).abs() < 1.0 && (s1 - 4000.0).abs() < 1.0 && s2.abs() < 1.0, "{photosite:?}");
        assert_eq!(photosite.flags, Flags::SATURATED);
    }
}

#[test]
fn all_saturated_is_reported_and_dark_is_zero() {
    let saturated =
        Case { plan: plan(&[0.0, 60.0, 120.0], 5.0), frames: vec![vec![4095; 130]; 3], dark: Ok(256), flat: None };
    for photosite in saturated.kernel() {
        assert_eq!(photosite, Photosite { flags: Flags::SATURATED.with(Flags::TOO_FEW), ..Photosite::default() });
    }
    let black = Case { frames: vec![vec![256; 130]; 3], ..saturated };
    for photosite in black.kernel() {
        assert_eq!(photosite, Photosite::default());
    }
}

#[test]
fn a_frame_from_another_scene_is_a_misfit() {
    let mut frames = vec![vec![1000_u16; 140], vec![1000; 140], vec![1000; 140], vec![1000; 140]];
    frames[2][7] = 2500;
    let case = Case { plan: plan(&[0.0, 45.0, 90.0, 135.0], 5.0), frames, dark: Ok(256), flat: None };
    let flags: Vec<u8> = case.kernel().iter().map(|p| p.flags.0).collect();
    assert_eq!(flags[7], Flags::MISFIT.0);
    assert!(flags.iter().enumerate().all(|(i, f)| i == 7 || *f == 0));
}

#[test]
fn wrong_lengths_are_refused() {
    let plan = plan(&[0.0, 60.0, 120.0], 5.0);
    let (long, short) = (vec![0_u16; 100], vec![0_u16; 99]);
    let frames = [&long[..], &short[..], &long[..]];
    let mut s = [vec![0_i16; 100], vec![0; 100], vec![0; 100]];
    let [a, b, c] = &mut s;
    let (mut residual, mut flags) = (vec![0_u16; 100], vec![0_u8; 100]);
    let output = StripOutput { stokes: [a, b, c], residual: &mut residual, flags: &mut flags };
    let input = StripInput { frames: &frames, dark: Dark::Level(0), flat: None };
    let result = stokes_i16(&plan, &mut WeightTable::new(), input, output);
    assert_eq!(result, Err(StripError::Length { expected: 100, found: 99 }));
}
