//! First-order σ against the spread of many noisy pixels.

use crate::{Noise, WHITE, clear, facet, observed, single, table, towards};
use glam::DVec3;
use host_fit::closed::{Estimate, SkyTable, pixel, sky_aware};
use host_fit::material::Observation;

const DRAWS: u32 = 3000;

/// Rows of a lower triangle whose square is the covariance: correlated, and not the same for s1 and s2.
const ROOT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.3, 1.2, 0.0], [-0.2, 0.4, 1.5]];

/// Worst relative difference between the stated σ and the spread, over normal, η and the three albedos.
fn against_draws(
    clean: &[Observation],
    axes: &[DVec3],
    noise: f64,
    solve: impl Fn(&[Observation], &[DVec3]) -> Estimate,
) -> f64 {
    let root = ROOT.map(|row| row.map(|x| x * noise));
    let square = |a: usize, b: usize| single((0..3).map(|k| root[a][k] * root[b][k]).sum());
    let covariance = [square(0, 0), square(0, 1), square(0, 2), square(1, 1), square(1, 2), square(2, 2)];
    let clean: Vec<Observation> = clean.iter().map(|o| Observation { covariance: [covariance; 3], ..*o }).collect();
    let stated = solve(&clean, axes);
    let mut random = Noise(7);
    let mut sums = [[0.0; 2]; 4];
    let mut tilt = 0.0;
    for _ in 0..DRAWS {
        let mut noisy = clean.clone();
        for band in noisy.iter_mut().flat_map(|o| &mut o.stokes) {
            let e = [0; 3].map(|_| random.normal());
            for (s, row) in band.iter_mut().zip(root) {
                *s += single(row.iter().zip(e).map(|(r, e)| r * e).sum());
            }
        }
        let found = solve(&noisy, axes);
        tilt += found.normal().cross(stated.normal()).length_squared();
        let [r, g, b] = found.albedo;
        for (sum, x) in sums.iter_mut().zip([found.facets.eta, r, g, b]) {
            sum[0] += x;
            sum[1] += x * x;
        }
    }
    let count = f64::from(DRAWS);
    let spread = sums.map(|[one, two]| (two / count - (one / count).powi(2)).sqrt());
    let [r, g, b] = stated.sigma.albedo;
    let stated = [stated.sigma.normal_rad, stated.sigma.eta, r, g, b];
    let drawn = [(tilt / count).sqrt(), spread[0], spread[1], spread[2], spread[3]];
    println!("stated {stated:.5?}\ndrawn  {drawn:.5?}");
    stated.iter().zip(drawn).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn closed_says_how_well_it_knows() {
    let normal = DVec3::new(0.08, -0.05, 1.0).normalize();
    for views in [
        vec![towards(52.0, 10.0), towards(60.0, 95.0)],
        vec![towards(52.0, 10.0), towards(60.0, 95.0), towards(56.0, 200.0)],
        // A third view near the normal, with little polarization.
        vec![towards(57.0, 10.0), towards(57.0, 100.0), towards(12.0, 40.0)],
    ] {
        let (seen, axes) = observed(&views, |b, view| facet(&WHITE, 1.5, normal, [0.1, 0.2, 0.4][b], view));
        let sky = SkyTable::uniform([1.0; 3]);
        let worst = against_draws(&seen, &axes, 1e-3, |o, a| pixel(o, a, &sky));
        assert!(worst < 0.1, "{worst} with {} views", views.len());
    }
}

#[test]
fn sky_aware_says_how_well_it_knows() {
    let lights = clear(0.6);
    let sky = table(&lights);
    let normal = DVec3::new(0.03, -0.05, 1.0).normalize();
    let views = [towards(52.0, 10.0), towards(60.0, 95.0)];
    let (seen, axes) = observed(&views, |b, view| facet(&lights[b], 1.5, normal, [0.2, 0.3, 0.4][b], view));
    let worst = against_draws(&seen, &axes, 3e-4, |o, a| sky_aware(o, a, &sky));
    assert!(worst < 0.1, "{worst}");
}
