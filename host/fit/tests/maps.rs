//! Maps in files and pictures: the same bits, the same bytes, and refusals by name.

#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking, as tests do")]

use std::path::Path;

use glam::DVec3;
use host_fit::joint::{Alternative, Fit, Reasons};
use host_fit::maps::{Grid, MapPreview, MapStatistics, MapsError, MaterialMaps, Plane, PlaneRect};
use host_fit::material::Facets;
use host_image::{ImageError, Layers};

const PLANE: PlaneRect = PlaneRect { left: -0.5, right: 1.0 / 3.0, bottom: -0.1, top: 0.7 };

/// Every number of its own, so that no two can be swapped unseen.
fn fit(k: f64) -> Fit {
    let facets = Facets { eta: 1.3 + k / 100.0, alpha: 0.1 + k / 200.0, slope: [0.1 * k.sin(), 0.1 * k.cos()] };
    let mut covariance = [[0.0; 7]; 7];
    for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
        covariance[i][j] = if i == j { (0.01 * (i as f64 + 1.0)).powi(2) } else { 1e-5 * (i + j) as f64 };
    }
    Fit {
        albedo: [0.2 + k / 300.0, 0.3 + k / 300.0, 0.4 + k / 300.0],
        facets,
        covariance,
        normal_sigma_deg: 0.5 + k / 50.0,
        alpha_interval: [0.1, 0.2],
        chi2: 11.0 + k,
        freedom: 11,
        views: 2 + u32::from(k > 6.0),
        evaluations: 40,
        reasons: if k > 6.0 { Reasons::SECOND_MINIMUM | Reasons::CLIPPED } else { Reasons::NONE },
        second: (k > 6.0).then_some(Alternative {
            albedo: [0.1; 3],
            facets: Facets { eta: 1.7, ..facets },
            chi2: 13.0,
        }),
    }
}

/// 4 × 3: nine fitted, one with infinite σ, two not fitted.
fn example(covariance: bool) -> MaterialMaps {
    let mut maps = MaterialMaps::new(Grid::new(4, 3, PLANE).unwrap(), covariance);
    for i in 0..9 {
        maps.set(i, &fit(i as f64));
    }
    maps.set(9, &Fit { normal_sigma_deg: f64::INFINITY, reasons: Reasons::NORMAL, ..fit(9.0) });
    maps.attributes.insert("source".into(), "Größe".into());
    maps
}

#[test]
fn a_fit_lands_in_its_planes() {
    let maps = example(true);
    let fit = fit(7.0);
    let normal: DVec3 = fit.facets.normal();
    let near = |plane: Plane, expected: f64| {
        let found = f64::from(maps.plane(plane)[7]);
        assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0), "{}: {found}, {expected}", plane.name());
    };
    near(Plane::AlbedoR, 0.2 + 7.0 / 300.0);
    near(Plane::AlbedoB, 0.4 + 7.0 / 300.0);
    near(Plane::Eta, 1.37);
    near(Plane::Alpha, 0.135);
    near(Plane::NormalX, normal.x);
    near(Plane::NormalZ, normal.z);
    // σ are roots of the diagonal, which is (0.01 (k + 1))² here.
    near(Plane::SigmaAlbedoG, 0.02);
    near(Plane::SigmaEta, 0.04);
    near(Plane::SigmaAlpha, 0.05);
    near(Plane::SigmaNormal, 0.64);
    near(Plane::Chi2, 18.0);
    assert_eq!((maps.second(7), maps.second(6)), (Some([1.7, 0.135]), None));
    assert_eq!((maps.freedom[7], maps.views[7], maps.reasons[7]), (11, 3, 1 << 11 | 1 << 2));
    // Upper triangle, row by row: (0, 0), (0, 1) ... (0, 6), (1, 1): the eighth.
    assert!((maps.covariance[7][7] - 4e-4).abs() < 1e-9 && (maps.covariance[27][7] - 4.9e-3).abs() < 1e-9);
    assert!(maps.plane(Plane::Eta)[11].is_nan() && maps.reasons[11] == 0);
}

#[test]
fn files_give_back_the_same_bits_and_are_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for covariance in [false, true] {
        let maps = example(covariance);
        let (a, b) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
        maps.save_exr(&a).unwrap();
        let back = MaterialMaps::load_exr(&a).unwrap();
        assert!(back.same_bits(&maps));
        assert!(!back.same_bits(&example(!covariance)));
        back.save_exr(&b).unwrap();
        assert!(std::fs::read(a).unwrap() == std::fs::read(b).unwrap());
    }
    let layers = Layers::load(&folder.path().join("a.exr")).unwrap();
    assert_eq!(layers.channels.len(), 17 + 28 + 3);
    assert!(layers.required("reasons").unwrap().starts_with("bad input,too dark,"));
    assert_eq!(layers.required("grid").unwrap(), "4 3 -0.5 0.3333333333333333 -0.1 0.7");
}

#[test]
fn files_that_are_no_maps_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let load_changed = |change: &dyn Fn(&mut Layers<'static>)| {
        example(false).save_exr(&path).unwrap();
        let mut layers = Layers::load(&path).unwrap();
        change(&mut layers);
        layers.save(&path).unwrap();
        MaterialMaps::load_exr(&path)
    };
    assert!(load_changed(&|_| {}).is_ok());
    for name in ["sigma.eta", "reasons", "normal.Y"] {
        let loaded = load_changed(&|l| _ = l.channels.remove(name));
        let named = |n: &str| n == format!("channel {name}");
        assert!(
            matches!(&loaded, Err(MapsError::Image(ImageError::Missing { name, .. })) if named(name)),
            "{loaded:?}"
        );
    }
    for (name, value) in [("schema", "material 2"), ("convention", "y down")] {
        let loaded = load_changed(&|l| _ = l.attributes.insert(name.into(), value.into()));
        let seen = |what: &str| what.contains(value);
        assert!(matches!(&loaded, Err(MapsError::Image(ImageError::Unsupported { what, .. })) if seen(what)));
    }
    for grid in ["4 3 0 1 0", "4 3 0 1 1 0", "3 4 0 1 0 1", "4 3 0 1 0 x"] {
        let loaded = load_changed(&|l| _ = l.attributes.insert("grid".into(), grid.into()));
        assert!(matches!(loaded, Err(MapsError::Image(ImageError::Malformed { .. }))), "{grid}");
    }
    let mut torn = example(false);
    torn.views.pop();
    let untouched = Path::new("nowhere/at-all.exr");
    assert!(matches!(torn.save_exr(untouched), Err(MapsError::Inconsistent { .. })));
    let mut taken = example(false);
    taken.attributes.insert("grid".into(), String::new());
    assert!(matches!(taken.save_exr(untouched), Err(MapsError::Inconsistent { .. })));
}

#[test]
fn statistics_count_what_is_there() {
    let found = MapStatistics::gather(&example(false), 0);
    assert_eq!((found.samples, found.fitted, found.sound, found.second_minima), (12, 10, 7, 3));
    let of = |name: &str| found.reasons.iter().find(|(n, _)| n == name).unwrap().1;
    assert_eq!((of("clipped"), of("second minimum"), of("normal not identifiable"), of("too dark")), (2, 2, 1, 0));
    let spread = |found: &MapStatistics, plane| found.planes.iter().find(|(p, _)| *p == plane).unwrap().1;
    // η of 0 ... 9 is 1.30 ... 1.39; the infinite σ of the last is left out.
    let eta = spread(&found, Plane::Eta);
    assert_eq!(eta.count, 10);
    assert!((eta.median - 1.345).abs() < 1e-6 && (eta.low - 1.3045).abs() < 1e-6 && (eta.high - 1.3855).abs() < 1e-6);
    assert_eq!(spread(&found, Plane::SigmaNormal).count, 9);
    assert!((found.chi2_per_freedom.unwrap().median - 15.5 / 11.0).abs() < 1e-6);
    let sound = MapStatistics::gather(&example(false), u32::MAX);
    assert_eq!((sound.fitted, spread(&sound, Plane::Eta).count), (10, 7));
}

#[test]
fn every_preview_can_be_drawn_even_of_nothing() {
    let nothing = MaterialMaps::new(Grid::new(4, 3, PLANE).unwrap(), false);
    for maps in [example(false), nothing] {
        for kind in MapPreview::ALL {
            let picture = maps.preview(kind, 2).unwrap();
            assert!(picture.width > 240 && picture.channels == 3, "{}", kind.name());
            assert!(maps.preview(kind, 0).is_err());
        }
    }
}
