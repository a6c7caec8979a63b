//! What goes in comes out, and the errors are what σ says.

use crate::shared::{Random, direct, direct_of, parameters};
use host_fit::joint::{Loss, Reasons, Settings, Starts, fit};
use host_fit::material::Facets;
use rayon::prelude::*;

/// Without noise, but for the rounding of pixels to f32, materials are recovered to 1e-6: from a guess that knows nothing.
#[test]
fn noise_free_materials_are_recovered() {
    let forward = direct_of(14);
    let worst = (0..24_u64)
        .into_par_iter()
        .map(|seed| {
            let truth = Random(seed).material([0.08, 0.45], [0.02, 0.6]);
            let pixel = truth.pixel(&forward, 3, 1e-7, || 0.0);
            let found = fit(&forward, &pixel, &[], &Settings::default());
            assert!(!found.reasons.contains(Reasons::NOT_CONVERGED), "{seed}: {}", found.reasons);
            let (expected, sigma) = (truth.parameters(), found.sigma());
            let found = parameters(found.albedo, &found.facets);
            let miss = |k: usize| (found[k] - expected[k]).abs();
            for k in 0..7 {
                // The rounding is 3e-8; where even σ of 1e-7 leaves more open than 1e-6 there is nothing to ask.
                assert!(miss(k) < 1e-6_f64.max(3.0 * sigma[k]), "{seed}, {k}: {found:?} {expected:?} {sigma:?}");
            }
            (0..7).map(miss).fold(0.0, f64::max)
        })
        .reduce(|| 0.0, f64::max);
    println!("worst {worst:.1e}");
}

/// 68 % intervals cover 62 to 74 % of 2000 noisy pixels in every parameter, and χ² is of its degrees of freedom.
#[test]
fn intervals_cover_what_they_say() {
    let forward = direct();
    let settings = Settings::default();
    let (mut inside, mut evaluations, mut chi2) = ([0_u32; 7], 0_u64, 0.0);
    let fits: Vec<_> = (0..2000_u64)
        .into_par_iter()
        .map(|seed| {
            let mut random = Random(1_000_000 + seed);
            let truth = random.material([0.12, 0.35], [0.05, 0.3]);
            let pixel = truth.pixel(&forward, 3, 0.003, || random.normal());
            let guess = Facets { eta: 1.5, alpha: 0.2, slope: [0.0; 2] };
            (truth, fit(&forward, &pixel, &[guess], &settings))
        })
        .collect();
    for (truth, found) in &fits {
        let (values, expected, sigma) = (parameters(found.albedo, &found.facets), truth.parameters(), found.sigma());
        for k in 0..7 {
            inside[k] += u32::from((values[k] - expected[k]).abs() < sigma[k]);
        }
        evaluations += u64::from(found.evaluations);
        chi2 += found.chi2 / f64::from(found.freedom);
    }
    println!("covered {inside:?} of 2000, {evaluations} evaluations, mean reduced chi2 {}", chi2 / 2000.0);
    for count in inside {
        assert!((1240..=1480).contains(&count), "{inside:?}");
    }
    assert!((chi2 / 2000.0 - 1.0).abs() < 0.03);
}

/// From a neighbor's answer a pixel costs a handful of evaluations.
#[test]
fn a_good_start_is_cheap() {
    let forward = direct();
    let settings = Settings { starts: Starts::Given, profile: false, ..Settings::default() };
    let mut evaluations = 0;
    for seed in 0..200 {
        let mut random = Random(seed);
        let truth = random.material([0.1, 0.35], [0.05, 0.3]);
        let near = Facets {
            eta: truth.facets.eta + 0.01 * random.normal(),
            alpha: truth.facets.alpha * (1.0 + 0.03 * random.normal()),
            slope: truth.facets.slope.map(|s| s + 0.01 * random.normal()),
        };
        let pixel = truth.pixel(&forward, 2, 0.003, || random.normal());
        let found = fit(&forward, &pixel, &[near], &settings);
        assert!(!found.reasons.contains(Reasons::NOT_CONVERGED));
        evaluations += found.evaluations;
    }
    println!("mean evaluations {}", f64::from(evaluations) / 200.0);
    assert!(evaluations < 200 * 6, "{evaluations}");
}

/// A band of a view that saw something else (a passing bird) spoils least squares, and robust losses hardly.
#[test]
fn robust_losses_shrug_off_an_outlier() {
    let forward = direct();
    let mut worst = [0.0_f64; 3];
    for seed in 0..20 {
        let mut random = Random(seed);
        let truth = random.material([0.12, 0.35], [0.05, 0.3]);
        let mut pixel = truth.pixel(&forward, 3, 0.003, || random.normal());
        pixel[1].stokes[1] = pixel[1].stokes[1].map(|s| 1.3 * s);
        for (loss, worst) in [Loss::Squares, Loss::Huber(2.5), Loss::Tukey(6.0)].into_iter().zip(&mut worst) {
            let settings = Settings { loss, ..Settings::default() };
            let found = fit(&forward, &pixel, &[truth.facets], &settings);
            assert!(loss != Loss::Squares || found.reasons.contains(Reasons::OUTSIDE_MODEL));
            let (values, sigma) = (parameters(found.albedo, &found.facets), found.sigma());
            assert!(sigma.iter().all(|s| *s < 0.1), "{loss:?} {sigma:?}");
            let pulls = truth.parameters().into_iter().zip(values).zip(sigma).map(|((t, v), s)| ((v - t) / s).abs());
            *worst = pulls.fold(*worst, f64::max);
        }
    }
    println!("worst pulls {worst:?}");
    assert!(worst[0] > 15.0 && worst[1] < 8.0 && worst[2] < 5.0, "{worst:?}");
}
