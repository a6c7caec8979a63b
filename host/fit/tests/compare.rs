//! Errors of maps and pictures against closed forms and other programs.

#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "helpers of tests fail by panicking, as tests do"
)]

use std::path::PathBuf;

use host_fit::compare::{CompareOptions, PictureOptions, Quantity, Reference, compare, compare_pictures};
use host_fit::maps::{Grid, MapsError, MaterialMaps, Plane, PlaneRect};
use host_image::{Encoding, Layers, Picture, Samples};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

const UNIT: PlaneRect = PlaneRect { left: -0.5, right: 0.5, bottom: -0.5, top: 0.5 };
const SIGMA: f32 = 0.02;

/// Constant maps with σ known.
fn constant(grid: Grid, tilt_deg: f32) -> MaterialMaps {
    let mut maps = MaterialMaps::new(grid, false);
    let (y, z) = (tilt_deg.to_radians().sin(), tilt_deg.to_radians().cos());
    let values = [0.3, 0.4, 0.5, 1.5, 0.2, 0.0, y, z, SIGMA, SIGMA, SIGMA, SIGMA, SIGMA, 1.0];
    for (plane, value) in Plane::ALL.into_iter().zip(values) {
        maps.plane_mut(plane).fill(value);
    }
    maps
}

/// A standard normal number (Box and Muller 1958).
fn gauss(rng: &mut SmallRng) -> f32 {
    let (u, v): (f32, f32) = (1.0 - rng.random::<f32>(), rng.random());
    (-2.0 * u.ln()).sqrt() * (std::f32::consts::TAU * v).cos()
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected} within {tolerance}");
}

#[test]
fn constant_offsets_are_found_exactly() {
    let grid = Grid::new(20, 10, UNIT).unwrap();
    let reference = Reference::from_maps(&constant(grid, 0.0), u32::MAX);
    let mut maps = constant(grid, 5.0);
    maps.plane_mut(Plane::Eta).iter_mut().for_each(|v| *v -= 0.03);
    // Two samples refused, one of them for two reasons; one never fitted.
    (maps.reasons[3], maps.reasons[4]) = (1 << 8, 1 << 8 | 1 << 10);
    maps.plane_mut(Plane::NormalZ)[7] = f32::NAN;
    let found = compare(&maps, &reference, CompareOptions::default()).unwrap();
    let normal = found.all.quantity(Quantity::Normal).unwrap();
    assert_eq!((normal.count, found.all.samples, found.all.refused, found.all.not_fitted), (197, 200, 2, 1));
    for angle in [normal.median, normal.percentile_95, normal.rms] {
        near(angle, 5.0, 1e-5);
    }
    let eta = found.all.quantity(Quantity::Eta).unwrap();
    near(eta.median, 0.03, 1e-6);
    // Both maps have σ = 0.02: z = −0.03/(0.02 √2).
    near(eta.z.unwrap().rms, 0.03 / (0.02 * 2.0_f64.sqrt()), 1e-5);
    near(eta.z.unwrap().within_68, 0.0, 0.0);
    near(eta.z.unwrap().within_95, 1.0, 0.0);
    assert!(found.differences.errors[Quantity::Eta as usize][0] < 0.0, "errors have a sign");
    near(found.all.quantity(Quantity::AlbedoG).unwrap().rms, 0.0, 0.0);
    let by: Vec<(&str, usize)> = found.all.refused_by.iter().map(|(n, c)| (n.as_str(), *c)).collect();
    assert_eq!(by, [("index not identifiable", 2), ("normal not identifiable", 1)]);
    let lenient = CompareOptions { refuse: 1 << 10, ..CompareOptions::default() };
    assert_eq!(compare(&maps, &reference, lenient).unwrap().all.refused, 1);
}

/// Errors drawn from the σ that is claimed: every z score must say so.
#[test]
fn a_sigma_that_is_right_is_called_right() {
    let grid = Grid::new(300, 200, UNIT).unwrap();
    let mut truth = constant(grid, 0.0);
    for plane in [Plane::SigmaEta, Plane::SigmaAlpha, Plane::SigmaAlbedoR, Plane::SigmaNormal] {
        truth.plane_mut(plane).fill(0.0);
    }
    let mut maps = constant(grid, 0.0);
    let mut rng = SmallRng::seed_from_u64(5);
    // 1° in both directions together.
    let across = 1.0_f32.to_radians() / 2.0_f32.sqrt();
    for i in 0..grid.samples() {
        maps.plane_mut(Plane::Eta)[i] += SIGMA * gauss(&mut rng);
        let (x, y) = (across * gauss(&mut rng), across * gauss(&mut rng));
        maps.plane_mut(Plane::NormalX)[i] = x;
        maps.plane_mut(Plane::NormalY)[i] = y;
        maps.plane_mut(Plane::NormalZ)[i] = (1.0 - x * x - y * y).sqrt();
    }
    let found = compare(&maps, &Reference::from_maps(&truth, 0), CompareOptions::default()).unwrap();
    for quantity in [Quantity::Eta, Quantity::Normal] {
        let summary = found.all.quantity(quantity).unwrap();
        let z = summary.z.unwrap();
        // 60000 samples: five standard errors.
        near(z.rms, 1.0, 0.015);
        near(z.within_68, 0.682_689, 0.0095);
        near(z.within_95, 0.95, 0.0045);
    }
    // Medians of |x| of a normal and of a Rayleigh distribution.
    near(found.all.quantity(Quantity::Eta).unwrap().median, 0.674_490 * 0.02, 3e-4);
    near(found.all.quantity(Quantity::Normal).unwrap().median, 2.0_f64.ln().sqrt(), 0.015);
}

#[test]
fn truth_files_are_scored_class_by_class() {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join("captures/S3_const/truth/sample_plane.exr");
    if !path.exists() {
        println!("skipped: no ../shared");
        return;
    }
    let mut truth = Layers::load(&path).unwrap();
    let mask = truth.take_f32("mask").unwrap();
    let grid = Grid::from_nodes(truth.width, truth.height, UNIT).unwrap();
    let mut maps = constant(grid, 0.0);
    for plane in &Plane::ALL[..8] {
        maps.plane_mut(*plane).copy_from_slice(&truth.take_f32(plane.name()).unwrap());
    }
    // Patch k is off by k · 0.001.
    for (eta, class) in maps.plane_mut(Plane::Eta).iter_mut().zip(&mask) {
        *eta += (class - 10.0) * 0.001;
    }
    let reference = Reference::load_truth(&path, UNIT).unwrap();
    let found = compare(&maps, &reference, CompareOptions::default()).unwrap();
    assert!(!found.resampled && found.classes.len() >= 12);
    for report in &found.classes {
        let class = f32::from(report.class.unwrap());
        assert!(class >= 10.0);
        assert_eq!(report.samples, mask.iter().filter(|m| **m == class).count());
        near(report.quantity(Quantity::Eta).unwrap().median, f64::from(class - 10.0) * 0.001, 1e-6);
        near(report.quantity(Quantity::Normal).unwrap().rms, 0.0, 1e-4);
    }
    assert_eq!(found.all.samples, mask.iter().filter(|m| **m >= 10.0).count());
    // Cells between the nodes: an error unless it is allowed, and never across the border of two patches.
    let cells = constant(Grid::new(700, 700, UNIT).unwrap(), 0.0);
    let refused = compare(&cells, &reference, CompareOptions::default());
    assert!(matches!(refused, Err(MapsError::GridMismatch { .. })));
    let resample = CompareOptions { resample: true, ..CompareOptions::default() };
    let resampled = compare(&cells, &reference, resample).unwrap();
    assert!(resampled.resampled);
    for (a, b) in found.classes.iter().zip(&resampled.classes) {
        let alpha = |r: &host_fit::compare::ClassReport| r.quantity(Quantity::Alpha).unwrap().percentile_95;
        near(alpha(b), (0.2 - (f64::from(maps.plane(Plane::Alpha)[mask_at(&mask, a.class)]))).abs(), 2e-6);
    }
}

fn mask_at(mask: &[f32], class: Option<i16>) -> usize {
    mask.iter().position(|m| Some(*m) == class.map(f32::from)).unwrap()
}

#[test]
fn resampling_a_plane_is_exact() {
    // η = 1.5 + 0.1 x − 0.2 y: bilinear interpolation has no error.
    let fill = |grid: Grid| {
        let mut maps = constant(grid, 0.0);
        for i in 0..grid.samples() {
            let [x, y] = grid.position(i % grid.columns, i / grid.columns);
            maps.plane_mut(Plane::Eta)[i] = (1.5 + 0.1 * x - 0.2 * y) as f32;
        }
        maps
    };
    let (fine, coarse) = (fill(Grid::new(97, 61, UNIT).unwrap()), fill(Grid::from_nodes(13, 29, UNIT).unwrap()));
    let options = CompareOptions { resample: true, ..CompareOptions::default() };
    let found = compare(&fine, &Reference::from_maps(&coarse, 0), options).unwrap();
    assert_eq!(found.all.samples, 97 * 61);
    near(found.all.quantity(Quantity::Eta).unwrap().rms, 0.0, 2e-7);
}

fn picture(width: usize, height: usize, channels: usize, samples: Vec<f32>) -> Picture {
    Picture { width, height, channels, samples: Samples::F32(samples), encoding: Encoding::Linear }
}

const PEAK: PictureOptions = PictureOptions { peak: Some(1.0), align_scale: false };

/// scikit-image 0.26.0 with NumPy 2.4.6, of the same formulas rounded to f32, per band k of planes a, b:
/// `structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1.)`,
/// `peak_signal_noise_ratio(a, b, data_range=1.)`; for all bands with `channel_axis=-1`.
#[test]
fn scores_are_those_of_scikit_image() {
    let (width, height) = (64, 48);
    let clean = |x: f64, y: f64, k: f64| {
        let check = (7.0 * x + 13.0 * y) % 11.0;
        0.5 + 0.3 * (0.21 * x + k).sin() * (0.17 * y).cos() + 0.1 * check / 11.0
    };
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for i in 0..width * height * 3 {
        let (x, y, k) = ((i / 3 % width) as f64, (i / 3 / width) as f64, i % 3);
        let v = clean(x, y, k as f64);
        a.push(v as f32);
        b.push((0.93 * v + 0.04 + 0.05 * (1.3 * x + 0.7 * y).sin() * [1.0, 0.5, 2.0][k]) as f32);
    }
    let found = compare_pictures(&picture(width, height, 3, a), &picture(width, height, 3, b), PEAK).unwrap();
    let ssim = [0.860_582_602_883_214_1, 0.959_440_693_701_742, 0.616_279_626_942_800_7];
    let psnr = [28.662_347_614_874_058, 33.635_335_906_230_13, 22.911_466_798_483_8];
    for (band, (ssim, psnr)) in found.bands.iter().zip(ssim.into_iter().zip(psnr)) {
        near(band.ssim, ssim, 1e-7);
        near(band.psnr_db, psnr, 1e-6);
    }
    near(found.ssim, 0.812_100_974_509_252_3, 1e-7);
    near(found.psnr_db, 26.377_200_171_871_515, 1e-6);
}

#[test]
fn constant_pictures_have_closed_forms() {
    // Without variance SSIM is its luminance term, (2 x y + C1)/(x² + y² + C1), C1 = 0.01².
    let plane = |v: f32| picture(20, 15, 1, vec![v; 300]);
    let found = compare_pictures(&plane(0.5), &plane(0.625), PEAK).unwrap();
    near(found.ssim, (0.625 + 1e-4) / (0.25 + 0.390_625 + 1e-4), 1e-12);
    near(found.psnr_db, 20.0 * 8.0_f64.log10(), 1e-12);
    let same = compare_pictures(&plane(0.5), &plane(0.5), PEAK).unwrap();
    near(same.ssim, 1.0, 1e-12);
    assert!(same.psnr_db.is_infinite());
    let aligned = compare_pictures(&plane(0.5), &plane(0.625), PictureOptions { align_scale: true, ..PEAK }).unwrap();
    near(aligned.scale, 1.25, 1e-12);
    near(aligned.bands[0].mean_squared_error, 0.0, 1e-30);
}

#[test]
fn known_noise_has_its_psnr() {
    let mut rng = SmallRng::seed_from_u64(9);
    let noisy: Vec<f32> = (0..200 * 200).map(|_| 0.5 + 0.01 * gauss(&mut rng)).collect();
    let found = compare_pictures(&picture(200, 200, 1, noisy), &picture(200, 200, 1, vec![0.5; 40_000]), PEAK).unwrap();
    // 40 dB; the variance of 40000 samples is known to 0.7 %, 0.03 dB.
    near(found.psnr_db, 40.0, 0.12);
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let plane = |width: usize, height: usize| picture(width, height, 1, vec![0.5; width * height]);
    let refused = |a: &Picture, b: &Picture, options| {
        assert!(matches!(compare_pictures(a, b, options), Err(MapsError::Inconsistent { .. })));
    };
    refused(&plane(20, 20), &plane(20, 21), PEAK);
    refused(&plane(10, 20), &plane(10, 20), PEAK);
    refused(&plane(20, 20), &plane(20, 20), PictureOptions::default());
    refused(&plane(20, 20), &plane(20, 20), PictureOptions { peak: Some(0.0), ..PEAK });
    let bytes = Picture { samples: Samples::U8(vec![7; 400]), ..plane(20, 20) };
    near(compare_pictures(&bytes, &bytes, PictureOptions::default()).unwrap().peak, 255.0, 0.0);
}
