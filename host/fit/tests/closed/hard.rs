//! Inputs that determine nothing, or are no measurement at all: an answer in range with its reason, never NaN, never a panic.

use crate::{Noise, WHITE, clear, facet, observed, single, table, towards};
use glam::DVec3;
use host_fit::closed::{Estimate, SkyTable, pixel, sky_aware};
use host_fit::material::{MAX_VIEWS, Observation};

use host_fit::closed::Reasons;

fn sound(e: &Estimate) {
    let n = e.normal();
    let inside = e.albedo.iter().all(|x| (0.0..=1.0).contains(x))
        && (1.0..=3.0).contains(&e.facets.eta)
        && e.facets.alpha > 0.0
        && e.facets.alpha <= 1.0
        && n.is_finite()
        && n.z > 0.0
        && e.facets.slope.iter().all(|x| x.is_finite());
    let sigma = e.sigma.albedo.iter().chain([&e.sigma.eta, &e.sigma.normal_rad]).all(|x| !x.is_nan() && *x >= 0.0);
    assert!(inside && sigma, "{e:?}");
}

fn both(seen: &[Observation], axes: &[DVec3], sky: &SkyTable, expected: Reasons) {
    let closed = pixel(seen, axes, sky);
    sound(&closed);
    sound(&sky_aware(seen, axes, sky));
    assert!(closed.reasons.contains(expected | Reasons::ROUGHNESS), "{:?} without {expected:?}", closed.reasons);
}

fn noisy(mut seen: Vec<Observation>, sigma: f32) -> Vec<Observation> {
    let v = sigma * sigma;
    for o in &mut seen {
        o.covariance = [[v, 0.0, 0.0, 2.0 * v, 0.0, 2.0 * v]; 3];
    }
    seen
}

#[test]
fn geometry_that_determines_nothing() {
    let sky = SkyTable::uniform([1.0; 3]);
    let see = |views: &[DVec3]| {
        let (seen, axes) = observed(views, |_, view| facet(&WHITE, 1.5, DVec3::Z, 0.3, view));
        (noisy(seen, 1e-3), axes)
    };
    let (seen, axes) = see(&[towards(56.0, 10.0), towards(50.0, 10.0)]);
    both(&seen, &axes, &sky, Reasons::VIEWS_TOO_PARALLEL | Reasons::NORMAL);
    let (seen, axes) = see(&[towards(56.0, 10.0), towards(56.0, 190.0)]);
    both(&seen, &axes, &sky, Reasons::VIEWS_TOO_PARALLEL | Reasons::NORMAL);
    let (seen, axes) = see(&[towards(56.0, 10.0)]);
    both(&seen, &axes, &sky, Reasons::ONE_VIEW | Reasons::AMBIGUOUS_AZIMUTH | Reasons::NORMAL);
    // The one view still says in which plane the normal lies: the mean normal does.
    assert!(pixel(&seen, &axes, &sky).normal().angle_between(DVec3::Z) < 1e-4);
    // Along the normal nothing is polarized.
    let tilted = [DVec3::Z, DVec3::new(1e-9, 0.0, 1.0).normalize()];
    let axes = [DVec3::X, DVec3::X];
    let (seen, _) =
        observed(&[towards(1e-7, 0.0), towards(1e-7, 90.0)], |_, view| facet(&WHITE, 1.5, DVec3::Z, 0.3, view));
    let seen: Vec<Observation> =
        noisy(seen, 1e-3).iter().zip(tilted).map(|(o, direction)| Observation { direction, ..*o }).collect();
    both(&seen, &axes, &sky, Reasons::AMBIGUOUS_AZIMUTH | Reasons::INDEX | Reasons::NORMAL);
    both(&[], &[], &sky, Reasons::ONE_VIEW | Reasons::NORMAL | Reasons::INDEX | Reasons::ALBEDO);
}

#[test]
fn light_that_is_not_there() {
    let views = [towards(56.0, 10.0), towards(56.0, 100.0)];
    let (seen, axes) = observed(&views, |_, view| facet(&WHITE, 1.5, DVec3::Z, 0.3, view));
    both(&seen, &axes, &SkyTable::uniform([0.0; 3]), Reasons::NO_MIRRORED_LIGHT | Reasons::INDEX);
    both(&seen, &axes, &SkyTable::uniform([f64::NAN; 3]), Reasons::NO_MIRRORED_LIGHT | Reasons::INDEX);
    // A facet that mirrors the ground.
    let low = [towards(85.0, 10.0), towards(85.0, 100.0)];
    let away = towards(30.0, 235.0);
    let (seen, axes) = observed(&low, |_, view| {
        let side = host_optics::Frame::camera(view.direction, away.cross(view.direction)).unwrap();
        let [q, u] = view.frame.turn_to(side.x).apply([0.1, 0.0]);
        [0.3, q, u]
    });
    both(&seen, &axes, &SkyTable::uniform([1.0; 3]), Reasons::NO_MIRRORED_LIGHT | Reasons::INDEX);
}

#[test]
fn samples_that_are_none() {
    let sky = table(&clear(0.8));
    let views = [towards(56.0, 10.0), towards(56.0, 100.0)];
    let (good, axes) = observed(&views, |_, view| facet(&WHITE, 1.5, DVec3::Z, 0.3, view));
    let with = |change: &dyn Fn(&mut Observation)| {
        let mut seen = noisy(good.clone(), 1e-3);
        change(&mut seen[0]);
        seen
    };
    both(&with(&|o| o.stokes = [[f32::NAN; 3]; 3]), &axes, &sky, Reasons::TOO_DARK | Reasons::ONE_VIEW);
    both(&with(&|o| o.stokes[1] = [f32::INFINITY; 3]), &axes, &sky, Reasons::NONE);
    both(&with(&|o| o.stokes = [[-0.5, 0.1, 0.1]; 3]), &axes, &sky, Reasons::TOO_DARK | Reasons::ONE_VIEW);
    both(&with(&|o| o.stokes = [[0.0; 3]; 3]), &axes, &sky, Reasons::TOO_DARK);
    both(&with(&|o| o.stokes = [[0.1, 0.2, 0.0]; 3]), &axes, &sky, Reasons::OUTSIDE_MODEL);
    both(&with(&|o| o.covariance = [[f32::INFINITY; 6]; 3]), &axes, &sky, Reasons::TOO_DARK);
    both(&with(&|o| o.covariance = [[-1.0, 0.0, 0.0, -1.0, 0.0, -1.0]; 3]), &axes, &sky, Reasons::NONE);
    both(&with(&|o| o.direction = DVec3::ZERO), &axes, &sky, Reasons::ONE_VIEW);
    both(&with(&|o| o.direction = DVec3::NAN), &axes, &sky, Reasons::ONE_VIEW);
    both(&with(&|o| o.view = 9), &axes, &sky, Reasons::ONE_VIEW);
    both(&good, &[views[0], views[1]], &sky, Reasons::ONE_VIEW);
}

#[test]
fn anything_at_all_is_answered() {
    let sky = table(&clear(0.8));
    let mut random = Noise(11);
    for count in (0..=MAX_VIEWS + 1).cycle().take(3000) {
        let mut wild = || match random.uniform() {
            x if x < 0.03 => f64::NAN,
            x if x < 0.06 => f64::INFINITY,
            x if x < 0.1 => 0.0,
            x if x < 0.2 => random.normal() * 10.0_f64.powf(60.0 * random.uniform() - 30.0),
            _ => random.normal(),
        };
        let seen: Vec<Observation> = (0..count)
            .map(|view| Observation {
                view,
                direction: DVec3::new(wild(), wild(), wild().abs()).normalize_or_zero(),
                stokes: [[0.0; 3]; 3].map(|s| s.map(|_: f64| single(wild()))),
                covariance: [[0.0; 6]; 3].map(|s| s.map(|_: f64| 0.01 * single(wild()))),
            })
            .collect();
        let axes: Vec<DVec3> = (0..count).map(|_| DVec3::new(wild(), wild(), wild())).collect();
        sound(&pixel(&seen, &axes, &sky));
        sound(&sky_aware(&seen, &axes, &sky));
    }
}
