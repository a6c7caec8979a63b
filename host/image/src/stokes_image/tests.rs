//! Saving and loading give the same bits; everything else is refused with its own kind.

use super::*;
use ::exr::meta::attribute::{AttributeValue, Text};
use ::exr::prelude::{AnyChannels, FlatSamples, Image, Layer, WritableImage, read_all_flat_layers_from_file};

/// Every field a different value, so that no two can be swapped unseen.
fn metadata() -> StokesMetadata {
    StokesMetadata {
        unit: "DN".into(),
        angles_deg: vec![-0.0, 60.1, 119.999_999_999_999_99, 1.0 / 3.0],
        exposure_us: vec![1000.5, 2000.0, 3000.0, 4000.0],
        gain: Some(1.7),
        black_level_dn: Some(64.25),
        white_level_dn: Some(4095.0),
        bit_depth: Some(12),
        fixed_point: Some(FixedPointFormat { word_bits: 32, fractional_bits: 16, error_bound_dn: [0.1, 0.2, 1e-5] }),
        bayer: Some(BayerPattern::Grbg),
        source: "Kamera Größe 12 µm".into(),
        camera_serial: Some("A-0042".into()),
        capture_id: Some(String::new()),
        software_version: "0.1.0".into(),
    }
}

fn bare() -> StokesMetadata {
    StokesMetadata {
        unit: String::new(),
        angles_deg: Vec::new(),
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: String::new(),
        camera_serial: None,
        capture_id: None,
        software_version: String::new(),
    }
}

/// 5 × 3; every plane has values of its own, among them −0 and a subnormal.
fn planes(color: Color, offset: f32) -> ColorPlanes {
    let plane = |k: f32| {
        let mut v: Vec<f32> = (0_u16..15).map(|i| offset + k + f32::from(i) * 0.1).collect();
        v[7] = -0.0;
        v[8] = f32::from_bits(3);
        v
    };
    ColorPlanes {
        color,
        s0: plane(100.0),
        s1: plane(-200.0),
        s2: plane(300.0),
        flags: Some((0..15).map(|i| i * 17).collect()),
        residual: Some(plane(400.0)),
    }
}

fn mono() -> StokesImage {
    StokesImage { width: 5, height: 3, colors: vec![planes(Color::Y, 0.0)], metadata: metadata() }
}

fn rgb() -> StokesImage {
    let mut colors = vec![planes(Color::R, 1e3), planes(Color::G, 2e3), planes(Color::B, 3e3)];
    colors[1].flags = None;
    colors[1].residual = None;
    colors[2].residual = None;
    StokesImage { width: 5, height: 3, colors, metadata: StokesMetadata { bayer: None, ..bare() } }
}

fn bits(image: &StokesImage) -> Vec<Vec<u32>> {
    image.colors.iter().flat_map(|c| c.float_planes()).map(|(_, v)| v.iter().map(|x| x.to_bits()).collect()).collect()
}

/// Saves `mono()`, lets `change` edit the file as any other OpenEXR program could, and loads it.
fn load_changed(change: impl FnOnce(&mut Layer<AnyChannels<FlatSamples>>)) -> Result<StokesImage, ImageError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stokes.exr");
    mono().save_exr(&path).unwrap();
    let file = read_all_flat_layers_from_file(&path).unwrap();
    let mut layer = file.layer_data.into_iter().next().unwrap();
    change(&mut layer);
    Image::from_layer(layer).write().to_file(&path).unwrap();
    StokesImage::load_exr(&path)
}

fn set(layer: &mut Layer<AnyChannels<FlatSamples>>, name: &str, value: AttributeValue) {
    layer.attributes.other.insert(Text::from(name), value);
}

#[test]
fn exr_gives_back_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    for image in [mono(), rgb()] {
        let path = folder.path().join("stokes.exr");
        image.save_exr(&path).unwrap();
        let back = StokesImage::load_exr(&path).unwrap();
        assert_eq!(back, image);
        assert_eq!(bits(&back), bits(&image));
        let angles = |i: &StokesImage| i.metadata.angles_deg.iter().map(|a| a.to_bits()).collect::<Vec<_>>();
        assert_eq!(angles(&back), angles(&image));
    }
    // Any OpenEXR reader sees the layers by name.
    let file = read_all_flat_layers_from_file(folder.path().join("stokes.exr")).unwrap();
    let names: Vec<String> = file.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
    let expected = "FLAGS.B FLAGS.R RESIDUAL.R S0.B S0.G S0.R S1.B S1.G S1.R S2.B S2.G S2.R";
    assert_eq!(names.join(" "), expected);
}

#[test]
fn the_same_image_is_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        let path = folder.path().join(name);
        mono().save_exr(&path).unwrap();
        std::fs::read(path).unwrap()
    };
    let first = file("0.exr");
    for i in 1..8 {
        assert!(file(&format!("{i}.exr")) == first, "the order of the attributes is their names'");
    }
}

#[test]
fn another_frame_convention_is_refused() {
    let upside_down = "picture: x right, y down, clockwise";
    let loaded = load_changed(|l| set(l, "brewster:frame", AttributeValue::Text(upside_down.into())));
    assert!(matches!(&loaded, Err(ImageError::Unsupported { what, .. }) if what.contains(upside_down)), "{loaded:?}");
    let loaded = load_changed(|l| set(l, "brewster:schema", AttributeValue::I32(2)));
    assert!(matches!(loaded, Err(ImageError::Unsupported { .. })), "{loaded:?}");
    let loaded = load_changed(|l| set(l, "brewster:bayer", AttributeValue::Text("XTRANS".into())));
    assert!(matches!(loaded, Err(ImageError::Unsupported { .. })), "{loaded:?}");
}

#[test]
fn what_is_missing_is_named() {
    assert!(load_changed(|_| {}).is_ok());
    for name in ["frame", "schema", "unit", "source", "software_version", "angles_deg", "exposure_us", "word_bits"] {
        let loaded = load_changed(|l| {
            l.attributes.other.remove(&Text::from(format!("brewster:{name}").as_str())).unwrap();
        });
        assert!(matches!(&loaded, Err(ImageError::Missing { name: n, .. }) if n.contains(name)), "{name}: {loaded:?}");
    }
    for name in ["S0.Y", "S1.Y", "S2.Y"] {
        let loaded = load_changed(|l| l.channel_data.list.retain(|c| c.name != *name));
        assert!(matches!(&loaded, Err(ImageError::Missing { name: n, .. }) if n.contains(name)), "{name}: {loaded:?}");
    }
    // The optional planes are just not there.
    let loaded = load_changed(|l| l.channel_data.list.retain(|c| c.name.to_string().starts_with('S'))).unwrap();
    assert_eq!((&loaded.colors[0].flags, &loaded.colors[0].residual), (&None, &None));
}

#[test]
fn values_that_make_no_sense_are_malformed() {
    let text = |v: &str| AttributeValue::Text(v.into());
    for (name, value) in [
        ("angles_deg", text("0 sixty 120")),
        ("angles_deg", text("0 inf 120 3")),
        ("angles_deg", AttributeValue::F64(60.0)),
        ("exposure_us", text("1000 2000")),
        ("exposure_us", text("1 2 3 -4")),
        ("gain", AttributeValue::F64(0.0)),
        ("white_level_dn", AttributeValue::F64(64.0)),
        ("bit_depth", AttributeValue::I32(300)),
        ("word_bits", AttributeValue::I32(65)),
        ("error_bound_dn", text("1 2")),
        ("unit", AttributeValue::Text(Text::from_slice_unchecked(&[0xff, 0xfe]))),
    ] {
        let loaded = load_changed(|l| set(l, &format!("brewster:{name}"), value.clone()));
        assert!(matches!(loaded, Err(ImageError::Malformed { .. })), "{name} {value:?}: {loaded:?}");
    }
    let loaded = load_changed(|l| {
        let flags = l.channel_data.list.iter_mut().find(|c| c.name == *"FLAGS.Y").unwrap();
        flags.sample_data = FlatSamples::U32(vec![256; 15]);
    });
    assert!(matches!(loaded, Err(ImageError::Malformed { .. })), "{loaded:?}");
    let loaded = load_changed(|l| {
        let s1 = l.channel_data.list.iter_mut().find(|c| c.name == *"S1.Y").unwrap();
        let mut values = vec![0.0; 15];
        values[11] = f32::NAN;
        s1.sample_data = FlatSamples::F32(values);
    });
    let Err(ImageError::NotFinite { sample, .. }) = loaded else { panic!("{loaded:?}") };
    assert_eq!((sample.column, sample.row, sample.channel.as_str()), (1, 2, "S1.Y"));
}

#[test]
fn a_stokes_file_cut_anywhere_is_an_error_and_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stokes.exr");
    mono().save_exr(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for cut in 0..bytes.len() {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let loaded = StokesImage::load_exr(&path);
        assert!(matches!(loaded, Err(ImageError::Malformed { .. })), "cut at {cut}: {loaded:?}");
    }
}

#[test]
fn a_contradiction_is_refused_before_a_file_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stokes");
    let changes: [fn(&mut StokesImage); 7] = [
        |i| i.width = 6,
        |i| i.height = 0,
        |i| i.colors.clear(),
        |i| i.colors[0].color = Color::R,
        |i| i.colors[0].s2[4] = f32::NAN,
        |i| i.colors[0].flags = Some(vec![0; 14]),
        |i| i.metadata.exposure_us.truncate(2),
    ];
    for change in changes {
        let mut image = mono();
        change(&mut image);
        assert!(matches!(image.save_exr(&path), Err(ImageError::Inconsistent { .. })));
        assert!(matches!(image.save_npy(&path), Err(ImageError::Inconsistent { .. })));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_npy_folder_holds_every_plane_and_the_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("planes");
    mono().save_npy(&path).unwrap();
    for (plane, expected) in mono().colors[0].float_planes() {
        let read = crate::Picture::read(&path.join(format!("{plane}.Y.npy"))).unwrap();
        assert_eq!((read.width, read.height), (5, 3));
        assert_eq!(read.samples, crate::Samples::F32(expected.clone()));
    }
    let flags = crate::Picture::read(&path.join("FLAGS.Y.npy")).unwrap();
    assert_eq!(flags.samples, crate::Samples::U8(mono().colors[0].flags.clone().unwrap()));
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path.join("metadata.json")).unwrap()).unwrap();
    assert_eq!(json["frame"], FRAME_CONVENTION);
    assert_eq!(json["planes"].as_array().unwrap().len(), 5);
    assert_eq!((&json["bayer"], &json["angles_deg"][1]), (&"GRBG".into(), &60.1.into()));
    assert!(matches!(mono().save_npy(&path), Err(ImageError::Io { .. })), "files of a folder are never mixed");
}
