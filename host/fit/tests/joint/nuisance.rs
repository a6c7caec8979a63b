//! Light of uncertain scale, polarizers of uncertain zero.

use crate::shared::{Random, direct};
use host_fit::joint::{Settings, Starts, fit};

#[test]
fn an_uncertain_light_widens_the_intervals() {
    let forward = direct();
    for seed in 0..20 {
        let mut random = Random(seed);
        let truth = random.material([0.12, 0.35], [0.05, 0.3]);
        let pixel = truth.pixel(&forward, 3, 0.003, || random.normal());
        let known = Settings { starts: Starts::Given, ..Settings::default() };
        let unknown = Settings { light_sigma: 0.02, ..known };
        // At the same parameters: without a descent.
        let [sure, unsure] = [known, unknown]
            .map(|settings| fit(&forward, &pixel, &[truth.facets], &Settings { iterations: 0, ..settings }));
        for k in 0..7 {
            assert!(unsure.sigma()[k] > sure.sigma()[k], "{k}");
        }
        // A scale of 2 % is 2 % of an albedo at least in quadrature, less what polarization says about it.
        let widened = (unsure.covariance[0][0] - sure.covariance[0][0]).sqrt() / truth.albedo[0];
        assert!((0.005..0.08).contains(&widened), "{widened}");

        // Data of a light 3 % brighter: outside the model if the light is known, a 1.5 σ matter if not.
        let mut brighter = pixel.clone();
        for band in brighter.iter_mut().flat_map(|view| &mut view.stokes) {
            *band = band.map(|s| 1.03 * s);
        }
        let [unsure, found] = [&pixel, &brighter].map(|data| fit(&forward, data, &[truth.facets], &unknown));
        assert!(found.chi2 < unsure.chi2 + 9.0, "{} {}", found.chi2, unsure.chi2);
        let pull = (found.albedo[0] - truth.albedo[0]) / found.sigma()[0];
        assert!(pull.abs() < 4.0, "{pull}");
    }
}

/// A wheel zero that is off by 1° in one view, and known to 1°.
#[test]
fn an_uncertain_zero_takes_up_a_turned_polarizer() {
    let forward = direct();
    let mut relief = 0.0;
    for seed in 0..20 {
        let mut random = Random(seed);
        let truth = random.material([0.12, 0.35], [0.05, 0.2]);
        let mut pixel = truth.pixel(&forward, 3, 0.001, || random.normal());
        let (s, c) = 2.0_f32.to_radians().sin_cos();
        for [_, s1, s2] in &mut pixel[0].stokes {
            (*s1, *s2) = (c * *s1 - s * *s2, s * *s1 + c * *s2);
        }
        let known = Settings::default();
        let unknown = Settings { rotation_sigma_deg: 1.0, ..known };
        let [refused, taken] = [known, unknown].map(|settings| fit(&forward, &pixel, &[truth.facets], &settings));
        assert!(taken.chi2 < 45.0, "{}", taken.chi2);
        relief += (refused.chi2 - taken.chi2) / 20.0;
        let pull = (taken.facets.eta - truth.facets.eta) / taken.sigma()[3];
        assert!(pull.abs() < 4.0, "{pull}");
    }
    println!("chi2 is lower by {relief:.1} on average");
    assert!(relief > 20.0, "{relief}");
}
