//! One material for many pixels.

use crate::shared::{Random, Truth, direct, numbers};
use host_fit::joint::{Reasons, Settings, fit, fit_region};
use host_fit::material::{Facets, Observation};

/// 40 pixels of one smooth paint, each with its own tilt and color.
fn pixels(noise: f64) -> (Vec<Truth>, Vec<Vec<Observation>>) {
    let forward = direct();
    let mut random = Random(7);
    let (mut truths, mut pixels) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let own = random.material([0.1, 0.1], [0.05, 0.4]);
        let truth = Truth { facets: Facets { eta: 1.52, alpha: 0.11, ..own.facets }, ..own };
        pixels.push(truth.pixel(&forward, 2, noise, || random.normal()));
        truths.push(truth);
    }
    (truths, pixels)
}

const GUESS: Facets = Facets { eta: 1.45, alpha: 0.2, slope: [0.0; 2] };

#[test]
fn shared_parameters_are_known_better_than_any_pixel_knows_them() {
    let forward = direct();
    let settings = Settings::default();
    let (truths, pixels) = pixels(0.003);
    let region = fit_region(&forward, &pixels, &[GUESS], &settings);
    assert!(region.reasons.is_empty() && region.freedom == 40 * 13 - 2, "{} {}", region.reasons, region.freedom);
    let [sigma_eta, sigma_alpha] = [0, 1].map(|k| region.covariance[k][k].sqrt());
    assert!((region.eta - 1.52).abs() < 3.5 * sigma_eta, "{} {sigma_eta}", region.eta);
    assert!((region.alpha - 0.11).abs() < 3.5 * sigma_alpha, "{} {sigma_alpha}", region.alpha);
    let reduced = region.chi2 / f64::from(region.freedom);
    assert!((reduced - 1.0).abs() < 0.25, "{reduced}");
    let mut inside = 0;
    for ((pixel, truth), shared) in pixels.iter().zip(&truths).zip(&region.pixels) {
        let alone = fit(&forward, pixel, &[truth.facets], &settings);
        assert!(shared.chi2 >= alone.chi2 - 1e-6, "one pixel cannot fit better with others");
        assert!(
            (shared.sigma()[3] / sigma_eta - 1.0).abs() < 1e-6 && (shared.sigma()[4] / sigma_alpha - 1.0).abs() < 1e-6
        );
        for k in 0..7 {
            assert!(shared.sigma()[k] <= alone.sigma()[k] * 1.3, "{k}: {} {}", shared.sigma()[k], alone.sigma()[k]);
        }
        let n = truth.facets.normal();
        inside += u32::from((shared.facets.normal().x - n.x).abs() < shared.sigma()[5]);
    }
    assert!((18..=36).contains(&inside), "{inside}");
}

#[test]
fn without_noise_a_region_is_recovered() {
    let (truths, mut pixels) = pixels(0.0);
    for observation in pixels.iter_mut().flatten() {
        for (stokes, covariance) in observation.stokes.iter().zip(&mut observation.covariance) {
            let variance = (1e-7 * stokes[0]).powi(2);
            *covariance = [variance, 0.0, 0.0, variance, 0.0, variance];
        }
    }
    let region = fit_region(&direct(), &pixels, &[GUESS], &Settings::default());
    assert!((region.eta - 1.52).abs() < 1e-6 && (region.alpha - 0.11).abs() < 1e-6, "{} {}", region.eta, region.alpha);
    for (truth, found) in truths.iter().zip(&region.pixels) {
        for (a, b) in truth.facets.slope.iter().zip(found.facets.slope) {
            assert!((a - b).abs() < 3e-6, "{a} {b}");
        }
    }
}

#[test]
fn pixels_without_data_are_left_out() {
    let (_, mut pixels) = pixels(0.003);
    pixels[3].clear();
    pixels[5][0].stokes[0][0] = f32::NAN;
    for observation in &mut pixels[8] {
        observation.covariance = [[f32::INFINITY; 6]; 3];
    }
    let region = fit_region(&direct(), &pixels, &[], &Settings::default());
    assert!(
        region.pixels[3].reasons.contains(Reasons::NO_MODEL) && region.pixels[8].reasons.contains(Reasons::CLIPPED)
    );
    assert!((region.alpha - 0.11).abs() < 0.01);
    assert!(region.pixels.iter().flat_map(numbers).all(|x| !x.is_nan()));
    let nothing = fit_region(&direct(), &[[]], &[], &Settings::default());
    assert!(nothing.reasons.contains(Reasons::NO_MODEL) && nothing.covariance[0][0] > 1.0);
}
