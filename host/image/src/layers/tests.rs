//! Any plane comes back with the same bits, and the same planes are the same file.

use super::*;

/// 3 × 2: values that a careless copy would change.
const HARD: [u32; 6] = [0x7fc0_1234, 0xff80_0000, 0x8000_0000, 0x0000_0003, 0x3f80_0000, 0x7f7f_ffff];

fn hard() -> Vec<f32> {
    HARD.iter().map(|b| f32::from_bits(*b)).collect()
}

fn example<'a>(floats: &'a [f32], integers: &'a [u32]) -> Layers<'a> {
    let mut layers = Layers::new(3, 2);
    for name in ["albedo.R", "sigma.eta", "eta", "normal.X", "a rather long name, longer than 31 bytes.Z"] {
        layers.lend_f32(name, floats);
    }
    layers.lend_u32("reasons", integers);
    for i in 0..20 {
        layers.attributes.insert(format!("name_{i}"), format!("Größe {i}"));
    }
    layers
}

#[test]
fn planes_and_attributes_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let (floats, integers) = (hard(), [0, 1, u32::MAX, 1 << 24 | 1, 7, 8]);
    let saved = example(&floats, &integers);
    saved.save(&path).unwrap();
    let mut back = Layers::load(&path).unwrap();
    assert_eq!((back.width, back.height, &back.attributes), (3, 2, &saved.attributes));
    assert!(back.channels.keys().eq(saved.channels.keys()));
    let bits: Vec<u32> = back.take_f32("sigma.eta").unwrap().iter().map(|v| v.to_bits()).collect();
    assert_eq!(bits, HARD);
    assert_eq!(back.take_u32("reasons").unwrap(), integers);
    let missing = back.take_f32("sigma.eta").unwrap_err();
    assert!(matches!(&missing, ImageError::Missing { name, .. } if name == "channel sigma.eta"), "{missing}");
    assert!(missing.to_string().contains("a.exr"), "{missing}");
    assert!(matches!(back.take_u32("eta"), Err(ImageError::Unsupported { .. })));
    assert!(matches!(back.required("nothing"), Err(ImageError::Missing { .. })));
    assert_eq!(back.required("name_7").unwrap(), "Größe 7");
}

#[test]
fn the_same_content_is_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let floats = hard();
    let file = |name: &str| {
        let path = folder.path().join(name);
        example(&floats, &[0; 6]).save(&path).unwrap();
        std::fs::read(path).unwrap()
    };
    let first = file("0.exr");
    for i in 1..8 {
        assert!(file(&format!("{i}.exr")) == first);
    }
    // 20 attributes in order.
    let at = |i: usize| {
        let name = format!("brewster:name_{i}\0");
        first.windows(name.len()).position(|w| w == name.as_bytes()).unwrap()
    };
    let mut names: Vec<usize> = (0..20).collect();
    names.sort_by_key(|i| i.to_string());
    assert!(names.is_sorted_by_key(|i| at(*i)));
}

#[test]
fn contradictions_are_refused_before_a_file_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let floats = hard();
    let changes: [fn(&mut Layers<'_>); 6] = [
        |l| l.width = 4,
        |l| l.height = 0,
        |l| l.channels.clear(),
        |l| _ = l.channels.insert("größe".into(), Plane::F32(vec![0.0; 6].into())),
        |l| _ = l.channels.insert(String::new(), Plane::F32(vec![0.0; 6].into())),
        |l| _ = l.attributes.insert("x".repeat(250), String::new()),
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut layers = example(&floats, &[0; 6]);
        change(&mut layers);
        assert!(matches!(layers.save(&path), Err(ImageError::Inconsistent { .. })), "change {i}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_file_cut_anywhere_is_malformed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let floats = hard();
    example(&floats, &[9; 6]).save(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for cut in 0..bytes.len() {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let loaded = Layers::load(&path);
        assert!(matches!(loaded, Err(ImageError::Malformed { .. })), "cut at {cut}: {loaded:?}");
    }
}

/// Files by the OpenEXR library, with values that its Python binding 3.5.3 reads from them.
#[test]
fn files_of_the_openexr_library_are_read() {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let truth = root.join("captures/S1/truth");
    if !truth.exists() {
        println!("skipped: no ../shared");
        return;
    }
    let sum = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>();
    let mut plane = Layers::load(&truth.join("sample_plane.exr")).unwrap();
    assert_eq!((plane.width, plane.height, plane.channels.len()), (256, 256, 9));
    let albedo = plane.take_f32("albedo.R").unwrap();
    assert!((albedo[100 * 256 + 37] - 0.348_632_8).abs() < 1e-9);
    assert!((sum(&albedo) - 23_646.244_720_458_984).abs() < 1e-6);
    // Half and float channels in one file.
    let mut maps = Layers::load(&truth.join("v0/maps.exr")).unwrap();
    assert_eq!((maps.width, maps.height, maps.channels.len()), (384, 232, 12));
    assert!((sum(&maps.take_f32("mask").unwrap()) - 443_377.0).abs() < 1e-6);
    let x = sum(&maps.take_f32("normal.X").unwrap());
    assert!((x + 33.563_300_369_719_46).abs() < 1e-6, "{x}");
}
