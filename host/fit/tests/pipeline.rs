//! The whole fit on a drawn session: a flat plastic with albedo that varies, under a polarized sky, drawn by quadrature
//! ([`Direct`], which the fit's tables know nothing of), seen from two sides behind a polarizer.

#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    reason = "helpers of tests fail by panicking, as tests do; drawn pictures are f32"
)]

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DMat3, DVec2, DVec3};
use host_fit::direct::{Body, Direct};
use host_fit::forward;
use host_fit::maps::{MapsError, MaterialMaps, Plane};
use host_fit::material::{Facets, Forward};
use host_fit::pipeline::{BodyChoice, FitOptions, Mode, PipelineError, Prepared, Regions, calibrate_wheels};
use host_fit::session::{Camera, Pictures, Session};
use host_fit::tiles::{Share, TileStore, merge};
use host_image::{Encoding, Picture, Samples};
use host_optics::sky::{Polarized, Rayleigh, Uniform};
use protocol_polar::{Analyzer, Degrees};
use serde_json::{Value, json};

const SIZE: [usize; 2] = [36, 36];
const FOCAL: f64 = 190.0;
const ANGLES: [f64; 5] = [0.0, 36.0, 72.0, 108.0, 144.0];
const TRUTH: Facets = Facets { eta: 1.5, alpha: 0.2, slope: [0.06, -0.04] };
const POSES: [[f64; 2]; 3] = [[56.0, 10.0], [56.0, 100.0], [56.0, 190.0]];
const SUN: [f64; 2] = [300.0, 35.0];
const MAX_DOLP: f64 = 0.7;
const RADIANCE: [f64; 3] = [1.0, 1.3, 1.6];
static GO: AtomicBool = AtomicBool::new(false);

fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    DVec3::new(ce * ca, ce * sa, se)
}

fn camera([theta, azimuth]: [f64; 2]) -> (Camera, Value) {
    let back = direction(azimuth, 90.0 - theta);
    let right = DVec3::Z.cross(back).normalize();
    let rotation = DMat3::from_cols(right, right.cross(back), -back).transpose();
    let t = -(rotation * (back * 6.0));
    let k = DMat3::from_cols(
        DVec3::X * FOCAL,
        DVec3::Y * FOCAL,
        DVec3::new(0.5 * SIZE[0] as f64, 0.5 * SIZE[1] as f64, 1.0),
    );
    let rows = |m: DMat3| m.transpose().to_cols_array_2d();
    let stated = json!({ "K": rows(k), "R_world_to_camera": rows(rotation), "t_world_to_camera": t.to_array() });
    (Camera::new(SIZE, k, rotation, t).unwrap(), stated)
}

/// ρ_d at a place.
fn albedo(p: DVec2) -> [f64; 3] {
    // Also what lies beside the sample is some color.
    [0.15 + 0.2 * p.x.clamp(-0.5, 0.5), 0.3 + 0.1 * p.y.clamp(-0.5, 0.5), 0.2]
}

/// Frames of a view, 100 + 1000 DN of radiance, with the noise of a sensor from a fixed seed.
fn draw(folder: &Path, number: usize, body: Body) -> Value {
    let (camera, stated) = camera(POSES[number]);
    let pattern = Rayleigh::new(direction(SUN[0], SUN[1]), MAX_DOLP).unwrap();
    let light = RADIANCE.map(|radiance| Polarized { light: Uniform { radiance }, pattern });
    let model = Direct::new(light, vec![camera.right()], 24).with_body(body);
    let back = camera.plane_to_pixel().inverse();
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| {
        let p = back * DVec3::new((i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5, 1.0);
        let p = p.truncate() / p.z;
        let response = model.response(0, camera.towards(p), &TRUTH);
        let rho = albedo(p);
        let stokes = |b: usize| [0, 1, 2].map(|k| response.specular[3 * b + k] + rho[b] * response.diffuse[3 * b + k]);
        [stokes(0), stokes(1), stokes(2)]
    });
    let pixels: Vec<[[f64; 3]; 3]> = pixels.collect();
    let mut seed = 7 + number as u64;
    let mut normal = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (a, b) = (uniform(), uniform());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    };
    let frames = ANGLES.map(|angle| {
        let row = Analyzer::ideal(Degrees(angle).to_radians()).row();
        let sample = |s: &[f64; 3]| {
            let signal = 1000.0 * (row[0] * s[0] + row[1] * s[1] + row[2] * s[2]);
            (100.0 + signal + (0.01 + signal / 1000.0).sqrt() * normal()) as f32
        };
        let samples = Samples::F32(pixels.iter().flatten().map(sample).collect());
        let file = format!("{number}_{angle}.exr");
        let [width, height] = SIZE;
        Picture { width, height, channels: 3, samples, encoding: Encoding::Linear }
            .write_exr(&folder.join(&file))
            .unwrap();
        json!({ "file": file, "nominal_angle_deg": angle })
    });
    json!({
        "view": format!("v{number}"), "camera": stated, "exposure_s": 1.0,
        "sensor": { "black_level_dn": 100, "gain_e_per_dn": 1000.0, "read_noise_e": 100.0,
            "responsivity_dn_per_radiance_s": 1000 },
        "polarizer": { "reference_axis": "camera" }, "sequences": { "plan": frames }
    })
}

fn session(views: &[usize], body: Body) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let views: Vec<Value> = views.iter().map(|v| draw(folder.path(), *v, body)).collect();
    let light = json!({ "type": "constant", "radiance_rgb": RADIANCE,
        "polarization": { "type": "rayleigh", "max_dolp": MAX_DOLP },
        "sun_azimuth_deg": SUN[0], "sun_elevation_deg": SUN[1] });
    let document = json!({ "version": 1, "views": views, "light": light });
    std::fs::write(folder.path().join("views.json"), document.to_string()).unwrap();
    Session::open(folder.path(), &Pictures::Best).unwrap()
}

/// Coarse tables of a narrow range, exact angles: quick, and the drawing's.
fn options(mode: Mode) -> FitOptions {
    FitOptions {
        mode,
        body: BodyChoice::Lambert,
        regions: Regions::One,
        eta: [1.35, 1.7],
        alpha: [0.1, 0.4],
        slope: 0.15,
        tolerance: 3e-3,
        wheel_sigma_deg: 0.0,
        resolution: Some(18),
        refine: false,
        tile: 8,
        ..FitOptions::default()
    }
}

fn store(folder: &Path, prepared: &Prepared<'_>) -> TileStore {
    TileStore::open(folder, prepared.job().unwrap()).unwrap()
}

/// All tiles in a pool of so many threads.
fn fitted(prepared: &Prepared<'_>, threads: usize) -> MaterialMaps {
    let folder = tempfile::tempdir().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let tiles = store(folder.path(), prepared);
    pool.install(|| prepared.run(&tiles, Share::ALL, &GO, |_| {})).unwrap();
    merge(&[folder.path().to_owned()]).unwrap()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|v| !v.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Median of |found − true| of η, α, the normal (degrees), ρ_d of green; and rms z of η with it.
fn errors(maps: &MaterialMaps) -> ([f64; 4], f64) {
    let n = maps.grid.samples();
    let off = |plane: Plane, truth: f64| median(maps.plane(plane).iter().map(|v| (f64::from(*v) - truth).abs()));
    let angle = |i: usize| {
        let at = |p| f64::from(maps.plane(p)[i]);
        let normal = DVec3::new(at(Plane::NormalX), at(Plane::NormalY), at(Plane::NormalZ));
        normal.cross(TRUTH.normal()).length().asin().to_degrees()
    };
    let green = |i: usize| {
        let [x, y] = maps.grid.position(i % maps.grid.columns, i / maps.grid.columns);
        (f64::from(maps.plane(Plane::AlbedoG)[i]) - albedo(DVec2::new(x, y))[1]).abs()
    };
    let z = |i: usize| (f64::from(maps.plane(Plane::Eta)[i]) - TRUTH.eta) / f64::from(maps.plane(Plane::SigmaEta)[i]);
    let square = median((0..n).map(|i| z(i).powi(2)));
    let medians = [
        off(Plane::Eta, TRUTH.eta),
        off(Plane::Alpha, TRUTH.alpha),
        median((0..n).map(angle)),
        median((0..n).map(green)),
    ];
    (medians, square)
}

/// The tables find what quadrature drew, to what noise of a thousandth allows; η and α shared, ten times closer. One thread
/// or two, three shares, a run that was stopped: the same bits.
#[test]
fn what_was_drawn_is_found_however_the_work_is_shared() {
    let session = session(&[0, 1, 2], Body::Lambert);
    let prepared = Prepared::new(&session, &[], options(Mode::JointShared)).unwrap();
    let mut maps = fitted(&prepared, 2);
    let (medians, z) = errors(&maps);
    println!("joint: eta, alpha, normal, albedo off by {medians:.4?}, median z² of eta {z:.2}");
    let [eta, alpha, normal, green] = medians;
    assert!(eta < 0.03 && alpha < 0.01 && normal < 0.3 && green < 5e-3);
    // Of χ² with one degree of freedom the median is 0.45; the tables' error is stated with a margin.
    assert!(z < 0.9, "{z}");

    assert!(fitted(&prepared, 1).same_bits(&maps));
    let folders = [0, 1, 2].map(|_| tempfile::tempdir().unwrap());
    for (index, folder) in folders.iter().enumerate() {
        prepared.run(&store(folder.path(), &prepared), Share::new(index, 3).unwrap(), &GO, |_| {}).unwrap();
    }
    assert!(merge(&folders.each_ref().map(|f| f.path().to_owned())).unwrap().same_bits(&maps));

    // Stopped after the second tile, gone on with later, in another process for all the tiles know.
    let (folder, stop) = (tempfile::tempdir().unwrap(), AtomicBool::new(false));
    let halfway = |p: host_fit::tiles::Progress| stop.store(p.finished >= 2, Ordering::Relaxed);
    let first = prepared.run(&store(folder.path(), &prepared), Share::ALL, &stop, halfway).unwrap();
    assert!(first.finished >= 2 && first.finished < first.total, "{first:?}");
    let again = Prepared::new(&session, &[], options(Mode::JointShared)).unwrap();
    let second = again.run(&store(folder.path(), &again), Share::ALL, &GO, |_| {}).unwrap();
    assert_eq!((second.resumed, second.finished), (first.finished, first.total));
    assert!(merge(&[folder.path().to_owned()]).unwrap().same_bits(&maps));

    // Other settings are another job.
    let other = FitOptions { model_sigma: 0.01, ..options(Mode::JointShared) };
    let other = Prepared::new(&session, &[], other).unwrap();
    let refused = other.run(&store(folder.path(), &other), Share::ALL, &GO, |_| {});
    assert!(matches!(refused, Err(PipelineError::Maps(MapsError::ForeignTile { .. }))), "{refused:?}");

    let shared = prepared.share(&mut maps, &GO).unwrap().unwrap();
    println!("shared: {:?}", shared.regions);
    assert_eq!(shared.regions.len(), 1);
    let region = shared.regions[0];
    let off = [(region.eta[0] - TRUTH.eta).abs(), (region.alpha[0] - TRUTH.alpha).abs()];
    assert!(off[0] < 0.005 && off[1] < 0.002, "{off:?}");
    let (shared, _) = errors(&maps);
    println!("shared: eta, alpha, normal, albedo off by {shared:.4?}");
    assert!(shared[2] <= 1.05 * normal && shared[3] < green);
}

/// The body that the pictures were drawn with is the one that is chosen.
#[test]
fn the_body_is_told_by_its_polarization() {
    for (drawn, expected) in [(Body::Lambert, forward::Body::Lambert), (Body::Polarized, forward::Body::Interface)] {
        let session = session(&[0, 1], drawn);
        let options = FitOptions { body: BodyChoice::Auto, resolution: Some(6), ..options(Mode::Joint) };
        let prepared = Prepared::new(&session, &[], options).unwrap();
        println!("{drawn:?}: {:?}", prepared.report().body_trial);
        assert_eq!(prepared.report().body, expected);
    }
}

/// Closed forms need no tables, and hold the normal well though their η is a mirror's.
#[test]
fn closed_modes_go_the_same_way() {
    let session = session(&[0, 1, 2], Body::Lambert);
    for mode in [Mode::Closed, Mode::SkyAware] {
        let prepared = Prepared::new(&session, &[], options(mode)).unwrap();
        assert!(prepared.report().tables.is_empty());
        let maps = fitted(&prepared, 2);
        let ([eta, _, normal, green], _) = errors(&maps);
        println!("{mode:?}: eta, normal, albedo off by {eta:.4} {normal:.4} {green:.4}");
        let limit = if mode == Mode::SkyAware { 2.0 } else { 8.0 };
        assert!(normal < limit && green < 0.05 && maps.views.contains(&3));
        assert!(maps.plane(Plane::Chi2).iter().all(|c| c.is_nan()) && maps.freedom.iter().all(|f| *f == 0));
    }
}

/// What cannot work is said before anything is computed.
#[test]
fn what_cannot_be_fitted_is_refused() {
    let mut session = session(&[0, 1], Body::Lambert);
    let refused = |session: &Session, options| Prepared::new(session, &[], options).err().unwrap();
    for wrong in [
        FitOptions { model_sigma: -0.1, ..options(Mode::Closed) },
        FitOptions { light_sigma: Some(f64::NAN), ..options(Mode::Closed) },
        FitOptions { resolution: Some(1), ..options(Mode::Closed) },
        FitOptions { wheel_sigma_deg: 90.0, ..options(Mode::Closed) },
    ] {
        assert!(matches!(refused(&session, wrong), PipelineError::Option { .. }));
    }
    let range = FitOptions { eta: [1.5, 1.4], ..options(Mode::Joint) };
    assert!(matches!(refused(&session, range), PipelineError::Optics(_)));
    let maps = MaterialMaps::new(Prepared::new(&session, &[], options(Mode::Closed)).unwrap().grid(), false);
    let closed = Prepared::new(&session, &[], options(Mode::Closed)).unwrap();
    assert!(matches!(closed.share(&mut maps.clone(), &GO), Err(PipelineError::Option { .. })));
    session.views.truncate(1);
    assert!(matches!(refused(&session, options(Mode::Joint)), PipelineError::TooFewViews { views: 1, needed: 2 }));
    assert!(calibrate_wheels(&mut session, 0.0).unwrap().iter().all(Option::is_none));
}
