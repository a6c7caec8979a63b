use super::*;
use proptest::prelude::*;
use protocol_polar::Stokes;

fn ideal(degrees: &[f64]) -> Vec<Frame> {
    degrees.iter().map(|d| Frame::new(Analyzer::ideal(Degrees(*d).to_radians()))).collect()
}

fn signals(frames: &[Frame], light: Stokes) -> Vec<f32> {
    let seen = |f: &Frame| f.analyzer.row().iter().zip(light.0).map(|(r, s)| r * s).sum::<f64>();
    #[expect(clippy::cast_possible_truncation, reason = "samples of a few thousand DN")]
    frames.iter().map(|f| seen(f) as f32).collect()
}

/// One-pixel frames.
fn pixel(estimator: &StokesEstimator, samples: &[f32], dark: f32) -> StokesPlanes {
    let frames: Vec<FrameSamples> =
        samples.chunks(1).map(|samples| FrameSamples { samples, dark: Dark::Level(dark), gain: None }).collect();
    estimator.image(&frames, 1).unwrap()
}

#[test]
fn sets_that_do_not_determine_the_light_are_refused() {
    let refused = |degrees: &[f64]| StokesEstimator::new(&ideal(degrees), EstimatorOptions::default()).err();
    for (degrees, axes) in [(&[0.0, 90.0][..], 2), (&[0.0, 180.0, 90.0], 2), (&[10.0, 190.0, -170.0], 1)] {
        let found = refused(degrees).unwrap();
        assert_eq!(found, FitError::NotIdentifiable { axes, condition: f64::INFINITY }, "{degrees:?}");
    }
    let near = refused(&[20.0, 21.0, 22.0]).unwrap();
    assert!(matches!(near, FitError::NotIdentifiable { axes: 3, condition } if condition > 1e3 && condition < 1e4));
    assert_eq!(refused(&[1.0; 17]), Some(FitError::TooManyFrames { frames: 17 }));
    assert_eq!(refused(&[0.0, f64::NAN, 60.0]), Some(FitError::BadFrame { frame: 1 }));
}

/// PHYSICS §4: one clipped frame turns DoLP 0.8 into 0.667; dropped, it does no harm.
#[test]
fn a_saturated_sample_is_dropped_not_clipped_in() {
    let frames = ideal(&[0.0, 45.0, 90.0, 135.0]);
    let white_dn = Some(1000.0);
    let estimator = StokesEstimator::new(&frames, EstimatorOptions { white_dn, ..Default::default() }).unwrap();
    let mut samples = signals(&frames, Stokes([2000.0 / 1.8, 1600.0 / 1.8, 0.0, 0.0]));
    assert!((samples[0] - 1000.0).abs() < 1e-3);
    samples[0] = 1000.0;
    let found = pixel(&estimator, &samples, 0.0);
    assert_eq!(Flags(found.flags[0]), Flags::SATURATED);
    assert!((f64::from(found.s1[0] / found.s0[0]) - 0.8).abs() < 1e-6);

    let blind = pixel(&estimator, &[1000.0, 1000.0, 400.0, 300.0], 0.0);
    assert_eq!(Flags(blind.flags[0]), Flags::SATURATED.with(Flags::TOO_FEW));
    assert_eq!((blind.s0[0], blind.s1[0], blind.s2[0]), (0.0, 0.0, 0.0));
}

#[test]
fn darkness_is_dark_and_what_lies_below_black_keeps_its_sign() {
    let estimator = StokesEstimator::new(&ideal(&[0.0, 60.0, 120.0]), EstimatorOptions::default()).unwrap();
    let zero = pixel(&estimator, &[64.0; 3], 64.0);
    assert_eq!((zero.s0[0], zero.s1[0], zero.s2[0], zero.flags[0]), (0.0, 0.0, 0.0, 0));
    let below = pixel(&estimator, &[61.0; 3], 64.0);
    assert!((below.s0[0] + 6.0).abs() < 1e-5);
    assert_eq!(Flags(below.flags[0]), Flags::BELOW_BLACK);
    assert_eq!(below.residual, None);
}

/// Signals of whole numbers that cancel leave no light, not 2e-16 of it (of which a DoLP of 1e16 would be made); and what
/// does not cancel stays.
#[test]
fn what_cancels_exactly_is_exactly_zero() {
    let solved = |degrees: &[f64], signals: &[f64]| {
        let estimator = StokesEstimator::new(&ideal(degrees), EstimatorOptions::default()).unwrap();
        estimator.estimate(signals, None, 0).stokes
    };
    let three = StokesEstimator::new(&ideal(&[0.0, 45.0, 90.0]), EstimatorOptions::default()).unwrap();
    let none = pixel(&three, &[256.0; 3], 256.0);
    assert_eq!((none.s0[0], none.s1[0], none.s2[0]), (0.0, 0.0, 0.0));
    // Of 0, 45, 90: s0 = a + c, s1 = a - c, s2 = 2b - a - c.
    for a in -40..=40_i32 {
        for (b, c) in [(-3, -a), (0, -a), (a, a), (7, a), (11, 3 - a)] {
            let found = solved(&[0.0, 45.0, 90.0], &[a, b, c].map(f64::from));
            for (found, exact) in found.into_iter().zip([a + c, a - c, 2 * b - a - c].map(f64::from)) {
                let zero = found.abs() < f64::MIN_POSITIVE;
                assert!(
                    zero == (exact.abs() < 0.5) && (found - exact).abs() < 1e-13,
                    "{a} {b} {c}: {found} for {exact}"
                );
            }
        }
    }
    // Of 0, 60, 120: s0 = 2(a + b + c)/3, and s2 = 4 (b - c)/(2 sqrt 3).
    let [s0, _, s2] = solved(&[0.0, 60.0, 120.0], &[2.0, -1.0, -1.0]);
    assert_eq!((s0.to_bits(), s2.to_bits()), (0, 0));
    let found = pixel(&three, &[257.0, 256.0, 255.0], 256.0);
    let statistics = crate::Statistics::gather([&found.s0, &found.s1, &found.s2], None, None);
    assert_eq!((statistics.no_light, statistics.above_one), (1, 0));
}

#[test]
fn results_beyond_f32_are_clamped_and_flagged() {
    let estimator = StokesEstimator::new(&ideal(&[0.0, 45.0, 90.0]), EstimatorOptions::default()).unwrap();
    let found = pixel(&estimator, &[f32::MAX, 0.0, f32::MAX], 0.0);
    assert_eq!(Flags(found.flags[0]), Flags::OUT_OF_RANGE);
    assert!(found.s0[0].is_finite());
}

#[test]
fn each_frame_has_its_own_dark_and_gain_maps() {
    let frames = ideal(&[0.0, 60.0, 120.0, 150.0]);
    let estimator = StokesEstimator::new(&frames, EstimatorOptions::default()).unwrap();
    let light = [Stokes::linear(900.0, 0.4, Radians(0.3)), Stokes::linear(500.0, 0.1, Radians(2.0))];
    let (darks, gains) =
        ([[10.0, 20.0], [1.0, 2.0], [0.0, 0.5], [7.0, 9.0]], [[1.0, 2.0], [0.5, 4.0], [1.0, 1.0], [8.0, 0.25]]);
    let samples: Vec<[f32; 2]> =
        (0..4).map(|k| std::array::from_fn(|i| signals(&frames, light[i])[k] / gains[k][i] + darks[k][i])).collect();
    let given: Vec<FrameSamples> = (0..4)
        .map(|k| FrameSamples { samples: &samples[k], dark: Dark::Map(&darks[k]), gain: Some(&gains[k]) })
        .collect();
    let found = estimator.image(&given, 2).unwrap();
    for (i, s) in light.iter().enumerate() {
        assert!((f64::from(found.s1[i]) - s.0[1]).abs() < 1e-3 && (f64::from(found.s2[i]) - s.0[2]).abs() < 1e-3);
    }
    assert!(found.residual.unwrap().iter().all(|r| *r < 1e-3));
    assert!(matches!(estimator.image(&given[..3], 2), Err(FitError::Size { found: 3, expected: 4, .. })));
    assert!(matches!(estimator.image(&given, 3), Err(FitError::Size { .. })));
    let short = FrameSamples { gain: Some(&gains[0][..1]), ..given[0] };
    assert!(matches!(estimator.image(&[short, given[1], given[2], given[3]], 2), Err(FitError::Size { .. })));
}

/// A frame that moved is a misfit; plain noise within the model is not, at 5 σ, in 4000 pixels.
#[test]
fn misfits_are_flagged_and_noise_is_not() {
    let frames = ideal(&[0.0, 30.0, 60.0, 90.0, 120.0, 150.0]);
    let noise = Noise { read_dn: 2.0, electrons_per_dn: 2.0, misfit_sigma: 5.0 };
    let estimator =
        StokesEstimator::new(&frames, EstimatorOptions { noise: Some(noise), ..Default::default() }).unwrap();
    let clean = signals(&frames, Stokes::linear(1000.0, 0.3, Radians(1.0)));
    let mut state = 1_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let noisy: Vec<Vec<f32>> = clean
        .iter()
        .map(|x| {
            let sigma = (4.0 + x / 2.0).sqrt();
            // Twelve uniform numbers have variance 1.
            (0..4000).map(|_| x + sigma * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0)).collect()
        })
        .collect();
    let given = |frames: &[Vec<f32>]| {
        let view: Vec<FrameSamples> =
            frames.iter().map(|samples| FrameSamples { samples, dark: Dark::Level(0.0), gain: None }).collect();
        estimator.image(&view, 80).unwrap()
    };
    let found = given(&noisy);
    assert!(found.flags.iter().all(|f| *f == 0));
    let mut moved = noisy.clone();
    moved[2].iter_mut().for_each(|x| *x *= 1.6);
    assert!(given(&moved).flags.iter().all(|f| Flags(*f).contains(Flags::MISFIT)));

    // The predicted covariance is the scatter's, off-diagonal terms included.
    let predicted = found.covariance.as_ref().unwrap()[0].map(f64::from);
    let planes = [&found.s0, &found.s1, &found.s2].map(|p| p.iter().map(|v| f64::from(*v)).collect::<Vec<_>>());
    let mean = planes.each_ref().map(|p| p.iter().sum::<f64>() / p.len() as f64);
    for (k, (i, j)) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
        let scatter: f64 =
            planes[i].iter().zip(&planes[j]).map(|(a, b)| (a - mean[i]) * (b - mean[j])).sum::<f64>() / 3999.0;
        assert!((scatter - predicted[k]).abs() < 0.1 * predicted[0], "{i}{j}: {scatter} against {}", predicted[k]);
    }
}

proptest! {
    #[test]
    fn any_light_comes_back_through_any_frames_that_are_left(
        angles in prop::collection::vec(0.0..180.0_f64, 4..9),
        dropped in 0_u16..256,
        (s0, p, psi) in (0.1..10.0_f64, 0.0..1.0_f64, 0.0..3.2_f64),
    ) {
        let frames = ideal(&angles);
        let Ok(estimator) = StokesEstimator::new(&frames, EstimatorOptions::default()) else { return Ok(()) };
        let dropped = dropped & ((1 << angles.len()) - 1);
        let light = Stokes::linear(s0, p, Radians(psi));
        let seen: Vec<f64> =
            frames.iter().map(|f| f.analyzer.row().iter().zip(light.0).map(|(r, s)| r * s).sum()).collect();
        let found = estimator.estimate(&seen, None, dropped);
        if found.flags.contains(Flags::TOO_FEW) {
            prop_assert!(dropped != 0);
        } else {
            for (a, b) in found.stokes.iter().zip(light.0) {
                prop_assert!((a - b).abs() < 1e-10 * s0, "{found:?}");
            }
        }
    }
}
