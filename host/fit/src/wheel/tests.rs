use super::*;
use protocol_polar::{Degrees, Stokes};

const NOISE: Noise = Noise { read_dn: 1.5, electrons_per_dn: 2.0, misfit_sigma: 5.0 };

/// Numbers of a fixed seed: uniform in [0, 1), and normal.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

fn nominal(n: usize) -> Vec<Analyzer> {
    (0..n).map(|k| Analyzer::ideal(Degrees(180.0 * k as f64 / n as f64).to_radians())).collect()
}

/// Samples of lights drawn by `light`, through nominal angles plus errors, with noise and rounding, DN.
fn frames(
    analyzers: &[Analyzer],
    errors: &[f64],
    count: usize,
    random: &mut Random,
    light: impl Fn(&mut Random) -> Stokes,
) -> Vec<Vec<f64>> {
    let sample = |_| {
        let light = light(random);
        let seen = |(a, e): (&Analyzer, &f64)| {
            let turned = Analyzer { angle: Radians(a.angle.0 + e), ..*a };
            let x: f64 = turned.row().iter().zip(light.0).map(|(r, s)| r * s).sum();
            (x + (NOISE.read_dn.powi(2) + x / NOISE.electrons_per_dn).sqrt() * random.normal()).round()
        };
        analyzers.iter().zip(errors).map(seen).collect()
    };
    (0..count).map(sample).collect()
}

fn calibrated(analyzers: &[Analyzer], samples: &[Vec<f64>], prior_deg: f64) -> WheelEstimate {
    let options = WheelOptions { prior: Degrees(prior_deg).to_radians(), noise: NOISE };
    calibrate_wheel(analyzers, options, samples.len(), |i, x| {
        x.copy_from_slice(&samples[i]);
        true
    })
    .unwrap()
}

fn spread(random: &mut Random) -> Stokes {
    let (s0, p, angle) = (500.0 + 3000.0 * random.uniform(), 0.5 * random.uniform(), 3.2 * random.uniform());
    Stokes::linear(s0, p, Radians(angle))
}

/// Rms of what is left of the errors, degrees, the common turn taken out.
fn left(found: &WheelEstimate, errors: &[f64]) -> f64 {
    let off: Vec<f64> = errors.iter().zip(&found.corrections).map(|(e, c)| (e - c.0).to_degrees()).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    (off.iter().map(|o| (o - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
}

/// PHYSICS §4: errors of 2° come back to some hundredths of a degree with five and six angles, and not with four.
#[test]
fn errors_of_the_wheel_are_found_in_the_pictures() {
    let mut random = Random(5);
    for n in [5, 6, 8] {
        let analyzers = nominal(n);
        for _ in 0..5 {
            let errors: Vec<f64> = (0..n).map(|_| random.normal() * 2_f64.to_radians()).collect();
            let samples = frames(&analyzers, &errors, 20_000, &mut random, spread);
            let found = calibrated(&analyzers, &samples, 2.0);
            let off = left(&found, &errors);
            println!("N = {n}: {off:.4} deg left of {:.2}", left(&calibrated(&analyzers, &samples, 1e-6), &errors));
            assert!(off < 0.1, "N = {n}: {off}");
            assert_eq!(found.identifiability, Identifiability::Complete);
            assert!((found.chi2_per_freedom - 1.0).abs() < 0.05, "{}", found.chi2_per_freedom);
            // The prior holds the common turn at 0.
            assert!(found.corrections.iter().map(|c| c.0).sum::<f64>().abs() < 1e-6);
        }
    }
    let four = nominal(4);
    let errors = [2.0, -1.0, 0.5, -2.5_f64].map(f64::to_radians);
    let samples = frames(&four, &errors, 20_000, &mut random, spread);
    let found = calibrated(&four, &samples, 2.0);
    assert_eq!(found.identifiability, Identifiability::Partial { free: 2 });
    let three = nominal(3);
    let found = calibrated(&three, &frames(&three, &errors[..3], 1000, &mut random, spread), 2.0);
    assert_eq!(found.identifiability, Identifiability::Nothing);
    assert!(found.corrections.iter().all(|c| c.0.abs() < 1e-9));
}

/// The scatter of the answers over many draws of errors and noise is the covariance stated, common turn included.
#[test]
fn the_covariance_is_the_scatter() {
    let (n, draws, prior) = (6, 60, 1_f64.to_radians());
    let analyzers = nominal(n);
    let mut random = Random(11);
    let (mut whitened, mut turn) = (0.0, 0.0);
    for _ in 0..draws {
        let errors: Vec<f64> = (0..n).map(|_| random.normal() * prior).collect();
        let samples = frames(&analyzers, &errors, 400, &mut random, spread);
        let found = calibrated(&analyzers, &samples, 1.0);
        let off: Vec<f64> = errors.iter().zip(&found.corrections).map(|(e, c)| e - c.0).collect();
        let solved = Cholesky::new(&found.covariance, n).unwrap().solve(&off);
        whitened += off.iter().zip(&solved).map(|(a, b)| a * b).sum::<f64>();
        turn += (off.iter().sum::<f64>() / n as f64 / prior).powi(2) * n as f64;
    }
    // χ² of 6 × 60 degrees of freedom: 360 ± 27.
    assert!((whitened - 360.0).abs() < 3.5 * 27.0, "{whitened}");
    assert!((turn / f64::from(draws) - 1.0).abs() < 0.65, "{turn}");
}

/// One AoLP, or none: noise is not taken for a spread of it.
#[test]
fn a_scene_without_spread_is_not_identifiable() {
    let analyzers = nominal(6);
    let errors = [1.0, -2.0, 0.5, 1.5, -1.0, 2.0_f64].map(f64::to_radians);
    let mut random = Random(3);
    let unpolarized =
        frames(&analyzers, &errors, 50_000, &mut random, |r| Stokes::linear(3000.0 * r.uniform(), 0.0, Radians(0.0)));
    let found = calibrated(&analyzers, &unpolarized, 1.0);
    assert_eq!(found.identifiability, Identifiability::Nothing, "{found:?}");
    assert!(found.corrections.iter().all(|c| c.to_degrees().0.abs() < 1.0));
    let one =
        frames(&analyzers, &errors, 50_000, &mut random, |r| Stokes::linear(3000.0, 0.5 * r.uniform(), Radians(0.7)));
    assert!(matches!(calibrated(&analyzers, &one, 1.0).identifiability, Identifiability::Partial { free: 2.. }));
}

/// A corner of the picture in which something moved between the frames does not pull the angles.
#[test]
fn what_moved_is_left_out() {
    let analyzers = nominal(6);
    let errors = [1.0, -2.0, 0.5, 1.5, -1.0, 2.0_f64].map(f64::to_radians);
    let mut random = Random(8);
    let mut samples = frames(&analyzers, &errors, 20_000, &mut random, spread);
    for sample in &mut samples[..1000] {
        sample[2] *= 1.3;
    }
    let found = calibrated(&analyzers, &samples, 2.0);
    assert!(left(&found, &errors) < 0.1, "{}", left(&found, &errors));
    assert!(found.samples < 19_500 && found.samples > 17_000, "{}", found.samples);
    // Saturated ones are not even looked at.
    let options = WheelOptions { prior: Degrees(1.0).to_radians(), noise: NOISE };
    let none = calibrate_wheel(&analyzers, options, 100, |_, _| false).unwrap();
    assert_eq!((none.samples, none.identifiability), (0, Identifiability::Nothing));
}
