//! Pixels with little or nothing in them: a value or a reason, no NaN, an end.

use crate::shared::{CAMERAS, DIRECTIONS, Random, Truth, direct, numbers, sky};
use glam::DVec3;
use host_fit::direct::Direct;
use host_fit::joint::{Fit, Loss, Reasons, Settings, Starts, fit};
use host_fit::material::{Facets, Forward, Observation, Response};
use host_optics::{Conductor, Ior};
use proptest::prelude::*;

const PLAIN: Truth = Truth { albedo: [0.1, 0.2, 0.3], facets: Facets { eta: 1.5, alpha: 0.2, slope: [0.05, -0.03] } };

fn pixel(truth: &Truth, seed: u64) -> Vec<Observation> {
    let mut random = Random(seed);
    truth.pixel(&direct(), 3, 0.003, || random.normal())
}

/// With every way to start; none may end in NaN.
fn fits(forward: &impl Forward, observations: &[Observation]) -> [Fit; 3] {
    [Starts::Given, Starts::Auto, Starts::All].map(|starts| {
        let settings = Settings { starts, ..Settings::default() };
        let found = fit(forward, observations, &[], &settings);
        assert!(numbers(&found).iter().all(|x| !x.is_nan()), "{found:?}");
        assert!(found.evaluations < 1500, "{}", found.evaluations);
        found
    })
}

fn says(found: &[Fit], reasons: Reasons) {
    for fit in found {
        assert!(fit.reasons.contains(reasons), "wanted {reasons}: {} {fit:?}", fit.reasons);
    }
}

#[test]
fn a_plain_pixel_has_no_reasons_against_it() {
    for found in fits(&direct(), &pixel(&PLAIN, 1)) {
        assert!(found.reasons.is_empty() && found.second.is_none() && found.freedom == 20, "{}", found.reasons);
    }
}

#[test]
fn black_pixels_are_dark() {
    let mut black = pixel(&PLAIN, 1);
    for observation in &mut black {
        observation.stokes = [[0.0; 3]; 3];
    }
    let found = fits(&direct(), &black);
    says(&found, Reasons::TOO_DARK);
    assert!(found[1].albedo.iter().all(|rho| *rho < 0.01));
}

#[test]
fn missing_bands_are_left_out() {
    let mut clipped = pixel(&PLAIN, 1);
    clipped[0].covariance[1] = [f32::INFINITY, f32::NAN, f32::NAN, f32::NAN, f32::NAN, f32::NAN];
    clipped[0].stokes[1] = [f32::NAN; 3];
    let found = fits(&direct(), &clipped);
    says(&found, Reasons::CLIPPED);
    assert!(found[1].reasons == Reasons::CLIPPED && found[1].freedom == 17);

    // No view has the green band.
    for observation in &mut clipped {
        observation.covariance[1][0] = f32::INFINITY;
    }
    let found = fits(&direct(), &clipped);
    says(&found, Reasons::CLIPPED | Reasons::ALBEDO);
    assert!(found[0].covariance[1][1].is_infinite() && found[0].sigma()[0] < 0.01, "{:?}", found[0].sigma());
    assert!((found[0].facets.eta - 1.5).abs() < 5.0 * found[0].sigma()[3]);

    // Nothing at all.
    for observation in &mut clipped {
        observation.covariance = [[f32::INFINITY; 6]; 3];
    }
    says(&fits(&direct(), &clipped), Reasons::CLIPPED | Reasons::TOO_FEW_DATA | Reasons::NORMAL);
    says(&fits(&direct(), &[]), Reasons::TOO_FEW_DATA | Reasons::TOO_DARK);
}

#[test]
fn a_mirror_has_no_roughness_to_speak_of() {
    let mirror = Truth { facets: Facets { alpha: 1e-3, ..PLAIN.facets }, ..PLAIN };
    let found = fits(&direct(), &pixel(&mirror, 2));
    says(&found, Reasons::ROUGHNESS);
    for fit in found {
        assert!(fit.alpha_interval[0] < 0.02 && fit.alpha_interval[1] < 0.1, "{:?}", fit.alpha_interval);
        assert!((fit.facets.eta - 1.5).abs() < 5.0 * fit.sigma()[3]);
    }
}

#[test]
fn white_and_index_one() {
    let white = Truth { albedo: [0.99, 1.0, 1.0], ..PLAIN };
    for found in fits(&direct(), &pixel(&white, 3)) {
        assert!((found.albedo[1] - 1.0).abs() < 5.0 * found.sigma()[1] && found.sigma()[1] < 0.1, "{found:?}");
    }
    let gone = Truth { facets: Facets { eta: 1.001, ..PLAIN.facets }, ..PLAIN };
    let found = fits(&direct(), &pixel(&gone, 3));
    says(&found, Reasons::NO_MIRRORED_LIGHT | Reasons::ROUGHNESS);
    assert!((found[1].albedo[0] - 0.1).abs() < 0.01);
}

#[test]
fn views_that_say_the_same() {
    let forward = direct();
    let mut random = Random(4);
    let direction = DIRECTIONS[0];
    let one = [PLAIN.observed(&forward, 0, direction, 0.003, || random.normal())];
    let found = fits(&forward, &one);
    says(&found, Reasons::ONE_VIEW);
    assert!(found.iter().all(|fit| fit.views == 1 && fit.freedom == 2));
    says(&fits(&forward, &[one[0], one[0]]), Reasons::VIEWS_TOO_PARALLEL);
    let parallel = [one[0], PLAIN.observed(&forward, 1, direction, 0.003, || random.normal())];
    says(&fits(&forward, &parallel), Reasons::VIEWS_TOO_PARALLEL);
    let along = [0, 1].map(|view| PLAIN.observed(&forward, view, DVec3::Z, 0.003, || random.normal()));
    says(&fits(&forward, &along), Reasons::VIEWS_TOO_PARALLEL);
    // More views than are taken.
    let many = [one[0]; 9];
    says(&fits(&forward, &many), Reasons::BAD_INPUT);
}

/// The sun itself, where the Rayleigh sky has its neutral point, in the mirror direction of a view.
#[test]
fn a_neutral_point_in_the_mirror_direction() {
    let wo = DIRECTIONS[0].normalize();
    let sun = DVec3::new(-wo.x, -wo.y, wo.z);
    let forward = Direct::new([sky(sun, 0.8); 3], CAMERAS.to_vec(), 7);
    let mut random = Random(5);
    let truth = Truth { facets: Facets { slope: [0.0; 2], ..PLAIN.facets }, ..PLAIN };
    let pixel = truth.pixel(&forward, 3, 0.003, || random.normal());
    for found in fits(&forward, &pixel) {
        assert!((found.facets.eta - 1.5).abs() < 5.0 * found.sigma()[3], "{found:?}");
    }
}

#[test]
fn a_known_index_is_no_parameter() {
    let copper = Ior::from(Conductor::new(0.27, 3.4).unwrap());
    let forward = direct().with_index(copper);
    let mut random = Random(6);
    let pixel = PLAIN.pixel(&forward, 3, 0.003, || random.normal());
    for found in fits(&forward, &pixel) {
        assert!(found.freedom == 21 && found.sigma()[3] <= 0.0 && !found.reasons.contains(Reasons::INDEX));
        assert!((found.facets.alpha - 0.2).abs() < 5.0 * found.sigma()[4], "{found:?}");
    }
}

#[test]
fn what_is_no_number_is_left_out() {
    let plain = pixel(&PLAIN, 1);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, 1e38, 1e-38] {
        for entry in 0..6 {
            let mut broken = plain.clone();
            broken[1].covariance[2][entry] = bad;
            if entry < 3 {
                broken[2].stokes[0][entry] = bad;
            }
            let found = fits(&direct(), &broken);
            if bad.is_nan() {
                says(&found, Reasons::BAD_INPUT);
            }
        }
    }
    for bad in [DVec3::NAN, DVec3::ZERO, DVec3::splat(f64::INFINITY), DVec3::new(0.0, 0.0, -2.0)] {
        let mut broken = plain.clone();
        broken[1].direction = bad;
        let found = fits(&direct(), &broken);
        says(&found, Reasons::BAD_INPUT);
        assert!(found.iter().all(|fit| fit.views == 2));
    }
    // Starts that are none.
    let nowhere = Facets { eta: f64::NAN, alpha: -1.0, slope: [f64::INFINITY, 0.0] };
    let far = Facets { eta: 900.0, alpha: 1e-30, slope: [1e30, -1e30] };
    for starts in [vec![nowhere], vec![far], vec![nowhere, far, PLAIN.facets]] {
        let found = fit(&direct(), &plain, &starts, &Settings::default());
        assert!((found.facets.eta - 1.5).abs() < 0.05, "{found:?}");
    }
}

/// A model that answers with whatever bits come out of its input.
struct Garbage(u64);

impl Forward for Garbage {
    fn index_is_free(&self) -> bool {
        !self.0.is_multiple_of(3)
    }

    fn response(&self, view: usize, _: DVec3, facets: &Facets) -> Response {
        let mut random = Random(self.0 ^ facets.alpha.to_bits() ^ view as u64);
        let mut response = Response::BLACK;
        let kind = self.0 % 5;
        let mut value = || match (kind, random.uniform()) {
            (1, u) if u < 0.01 => f64::NAN,
            (2, u) if u < 0.01 => f64::INFINITY,
            (3, u) => 1e300 * (u - 0.5),
            (_, u) => u - 0.5,
        };
        response.specular = response.specular.map(|_| value());
        response.diffuse = response.diffuse.map(|_| value());
        response.specular_by = response.specular_by.map(|lanes| lanes.map(|_| value()));
        response.diffuse_by = response.diffuse_by.map(|lanes| lanes.map(|_| value()));
        response
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_input_and_no_model_make_a_nan(
        bits in prop::collection::vec(any::<u32>(), 27), wild in any::<bool>(), seed in any::<u64>(), views in 0..5_usize,
    ) {
        let float = |k: usize| {
            let x = f32::from_bits(bits[k % 27]);
            if wild { x } else { (x.to_bits() >> 9) as f32 / (1 << 23) as f32 }
        };
        let observation = |view: usize| {
            let mut next = 7 * view;
            let mut float = || { next += 1; float(next) };
            Observation {
                view,
                direction: DIRECTIONS[view % 3].normalize(),
                stokes: [[0; 3]; 3].map(|band| band.map(|_: i32| float())),
                covariance: [[0; 3]; 3].map(|band: [i32; 3]| {
                    let [a, b, c] = band.map(|_| float().abs());
                    [a, 0.3 * a.min(b), 0.0, b, 0.0, c]
                }),
            }
        };
        let observations: Vec<_> = (0..views).map(observation).collect();
        let loss = [Loss::Squares, Loss::Huber(2.0), Loss::Tukey(5.0)][(seed % 3) as usize];
        let light_sigma = if seed % 2 == 0 { 0.02 } else { 0.0 };
        let settings = Settings { loss, light_sigma, rotation_sigma_deg: light_sigma, starts: Starts::All, ..Settings::default() };
        let found = fit(&Garbage(seed >> 3), &observations, &[], &settings);
        prop_assert!(numbers(&found).iter().all(|x| !x.is_nan()), "{found:?}");
    }
}
