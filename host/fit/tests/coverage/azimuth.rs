//! A sky polarized to 0.8 turns the angle of polarization 10° below Brewster's angle by up to 25°, and the closed form's
//! normal with it. The joint fit knows the sky.

use crate::pixels::{Camera, Material, Random};
use core::f64::consts::PI;
use glam::DVec3;
use host_fit::closed::{self, SkyTable};
use host_fit::direct::{Body, Direct};
use host_fit::joint::{Fit, Reasons, Settings, fit};
use host_fit::material::Facets;
use host_optics::frames::tangents;
use host_optics::integral::FixedPoints;
use host_optics::sky::{Polarized, Rayleigh, Uniform};
use rayon::prelude::*;

const ETA: f64 = 1.5;

/// Of each Stokes component, over s0.
const NOISE: f64 = 0.003;

/// Places of the sun.
const SUNS: u32 = 9;

const PIXELS: u64 = 15;

/// Degrees from the azimuth of `truth` about `direction` to that of `found`, as axes.
fn azimuth_error(direction: DVec3, truth: DVec3, found: DVec3) -> f64 {
    let (x, y) = tangents(direction);
    let azimuth = |n: DVec3| n.dot(y).atan2(n.dot(x));
    let turn = (azimuth(found) - azimuth(truth)).rem_euclid(PI);
    turn.min(PI - turn).to_degrees()
}

#[test]
fn the_azimuth_is_right_where_the_sky_turns_it() {
    let theta = ETA.atan().to_degrees() - 10.0;
    let cameras = [Camera::at(theta, 0.0), Camera::at(theta, 90.0)];
    let axes = cameras.map(|camera| camera.x_axis);
    let truth = Material { albedo: [0.02; 3], facets: Facets { eta: ETA, alpha: 0.05, slope: [0.0; 2] } };
    let (normal, direction) = (truth.facets.normal(), cameras[0].direction([0.0; 2]));
    let mirrored = normal * (2.0 * normal.dot(direction)) - direction;
    let (x, y) = tangents(mirrored);
    let rule = FixedPoints::new(12);
    // Wherever the sun stands across the mirrored ray, that ray comes from where the sky is polarized most.
    let case = |step: u32| {
        let (s, c) = (PI * f64::from(step) / f64::from(SUNS)).sin_cos();
        let sun = (x * c + y * s) * (x * c + y * s).z.signum();
        let light = Polarized { light: Uniform { radiance: 1.0 }, pattern: Rayleigh::new(sun, 0.8).unwrap() };
        let lights = [light; 3];
        let forward = Direct::new(lights, axes.to_vec(), 8).with_body(Body::Polarized);
        let pixel = |noise: f64, seed: u64| {
            let mut random = Random::new(seed);
            truth.pixel(&lights, &rule, (&cameras, [0.0; 2]), noise, || random.normal())
        };
        let error = |found: DVec3| azimuth_error(direction, normal, found);
        let by_phase = error(closed::pixel(&pixel(1e-6, 0), &axes, &SkyTable::uniform([1.0; 3])).normal());
        let joint = |noise: f64, seed: u64| fit(&forward, &pixel(noise, seed), &[], &Settings::default());
        let noisy: Vec<Fit> = (0..PIXELS).map(|seed| joint(NOISE, seed)).collect();
        let sine = normal.cross(direction).length();
        let errors = [
            by_phase,
            error(joint(1e-4, 0).facets.normal()),
            median(noisy.iter().map(|fit| error(fit.facets.normal())).collect()),
            // Of the two directions across the normal, the one that turns the azimuth; 0.67 σ is the median of errors.
            median(noisy.iter().map(|fit| 0.6745 * fit.normal_sigma_deg / (2.0_f64.sqrt() * sine)).collect()),
        ];
        (errors, noisy.iter().filter(|fit| fit.reasons.contains(Reasons::SECOND_MINIMUM)).count())
    };
    let cases: Vec<([f64; 4], usize)> = (0..SUNS).into_par_iter().map(case).collect();
    println!("## Under a sky polarized to 0.8, 10 degrees below Brewster's angle: errors of the azimuth in degrees");
    println!(
        "| the sun turned by, degrees | closed | joint, noise 0.01 % | joint, median of noise 0.3 % | as its sigma says | told of a second minimum |\n|---|---|---|---|---|---|"
    );
    for (k, ([closed, exact, noisy, sigma], second)) in cases.iter().enumerate() {
        println!(
            "| {} | {closed:.1} | {exact:.3} | {noisy:.2} | {sigma:.2} | {second} of {PIXELS} |",
            180 * k / cases.len()
        );
    }
    let worst = |k: usize| cases.iter().map(|(errors, _)| errors[k]).fold(0.0, f64::max);
    assert!((20.0..32.0).contains(&worst(0)) && worst(1) < 0.5, "{cases:?}");
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
