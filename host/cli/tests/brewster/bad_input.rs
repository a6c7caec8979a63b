//! What cannot work: each with its exit code, the name of the culprit, and what to do.

use host_image::{Encoding, Samples};

use crate::world::{World, cut, picture, tiff};

const USAGE: i32 = 2;
const BAD_INPUT: i32 = 3;
const NOT_IDENTIFIABLE: i32 = 7;

#[test]
fn angles_that_do_not_determine_the_light() {
    let w = World::new();
    w.three();
    let given = |angles| ["stokes", "a_000.png", "a_045.png", "a_090.png", "--angles", angles];
    w.refused(&given("0,180,90"), NOT_IDENTIFIABLE, &["2 different", "180", "0, 60"]);
    w.refused(&given("30,30,30"), NOT_IDENTIFIABLE, &["1 different"]);
    w.refused(&given("30,30.5,31"), NOT_IDENTIFIABLE, &["close together"]);
    w.refused(&["stokes", "a_000.png", "a_045.png"], NOT_IDENTIFIABLE, &["2 different"]);
    w.refused(&given("0,45"), USAGE, &["2 angles for 3 files"]);
    w.refused(&given("0,45,x"), USAGE, &["x", "angle"]);
}

#[test]
fn numbers_beyond_all_sense() {
    let w = World::new();
    let [a, b, c] = w.three();
    for (option, value, words) in [
        ("--angles", "0,45,1e300", &["3600"][..]),
        ("--angles", "0,45,nan", &["3600"]),
        ("--black", "inf", &["auto"]),
        ("--black", "-1e31", &["1e30"]),
        ("--black", "65536", &["--black 65536", "0 to 65535"]),
        ("--black", "-1", &["--black -1", "0 to 65535"]),
        ("--white", "1e300", &["1e30"]),
        ("--white", "70000", &["--white 70000", "0 to 65535"]),
        ("--read-noise", "nan", &["1e30"]),
        ("--read-noise", "1e6", &["--read-noise 1000000", "0 to 65535"]),
        ("--efficiency", "1e-300", &["efficiency of", "next to no polarizer"]),
        ("--efficiency", "1e-9", &["efficiency of", "next to no polarizer"]),
        ("--extinction-ratio", "1.0000000000000002", &["extinction ratio of", "next to no polarizer"]),
    ] {
        w.refused(&["stokes", ".", option, value], USAGE, words);
    }
    // Poor angles are still the angles' fault.
    let poor = ["stokes", ".", "--angles", "0,90,180", "--efficiency", "1e-9"];
    w.refused(&poor, NOT_IDENTIFIABLE, &["2 different"]);
    w.refused(&["stokes", a, b, c, "./a_045.png", "--angles", "0,45,90,135"], USAGE, &["./a_045.png", "twice"]);
}

#[test]
fn names_that_do_not_say_the_angle() {
    let w = World::new();
    for name in ["DSC_0012.png", "DSC_0013.png", "DSC_0014.png"] {
        w.grey(name, 1, &[1]);
    }
    w.refused(&["stokes", "."], BAD_INPUT, &["DSC_0012.png", "counter", "--angles"]);
}

#[test]
fn pictures_that_do_not_belong_together() {
    let w = World::new();
    let [a, b, c] = w.three();
    w.grey("wide_090.png", 5, &[1; 10]);
    w.refused(&["stokes", a, b, "wide_090.png"], BAD_INPUT, &["wide_090.png is 5 x 2", "4 x 2"]);
    picture(4, 3, Samples::U16(vec![1; 24]), Encoding::Unstated).write_png(&w.path("rgb_090.png")).unwrap();
    w.refused(&["stokes", a, b, "rgb_090.png"], BAD_INPUT, &["rgb_090.png", "RGB", "grey"]);
    picture(4, 1, Samples::U8(vec![1; 8]), Encoding::Unstated).write_png(&w.path("byte_090.png")).unwrap();
    w.refused(&["stokes", a, b, "byte_090.png"], BAD_INPUT, &["byte_090.png is 8-bit", "16-bit"]);
    w.refused(&["stokes", a, b, c, "--dark", "wide_090.png"], BAD_INPUT, &["wide_090.png"]);
    w.refused(&["stokes", "."], BAD_INPUT, &["several series", "a_*.png (3)", "rgb_*.png (1)"]);
}

#[test]
fn damaged_files() {
    let w = World::new();
    let [a, b, c] = w.three();
    cut(&w.path(c), 20);
    w.refused(&["stokes", a, b, c], BAD_INPUT, &[c, "malformed", "copy"]);
    std::fs::write(w.path("t_090.tif"), tiff(4, 16, &[1; 16])).unwrap();
    w.ok(&["info", "t_090.tif"]);
    let whole = std::fs::read(w.path("t_090.tif")).unwrap();
    std::fs::write(w.path("t_090.tif"), &whole[..40]).unwrap();
    w.refused(&["stokes", a, b, "t_090.tif"], BAD_INPUT, &["t_090.tif", "malformed"]);
    std::fs::write(w.path("t_090.jpg"), b"\xff\xd8\xff\xe0 jpeg").unwrap();
    w.refused(&["stokes", a, b, "t_090.jpg"], BAD_INPUT, &["t_090.jpg", "JPEG"]);
    w.refused(&["info", "t_090.jpg"], BAD_INPUT, &["JPEG"]);
    w.refused(&["stokes", a, b, "nowhere_090.png"], BAD_INPUT, &["nowhere_090.png", "Check the name"]);
    w.refused(&["info", "nowhere.png"], BAD_INPUT, &["nowhere.png"]);
}

#[test]
fn numbers_that_are_none() {
    let w = World::new();
    for (bad, value) in [("NaN", f32::NAN), ("inf", f32::INFINITY)] {
        for angle in ["0", "60", "120"] {
            let mut samples = [1.0_f32; 6];
            if angle == "60" {
                samples[4] = value;
            }
            // The writers refuse such values: an npy header and raw samples.
            let mut file = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
            let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
            file.extend(format!("{header:<117}\n").bytes());
            file.extend(samples.iter().flat_map(|v| v.to_le_bytes()));
            std::fs::write(w.path(&format!("f_{angle}.npy")), file).unwrap();
        }
        w.refused(&["stokes", "."], BAD_INPUT, &["f_60.npy", bad, "column 1, row 1"]);
    }
    for angle in ["0", "60", "120"] {
        std::fs::remove_file(w.path(&format!("f_{angle}.npy"))).unwrap();
        let path = w.path(&format!("e_{angle}.exr"));
        picture(3, 1, Samples::F32(vec![0.75; 6]), Encoding::Linear).write_exr(&path).unwrap();
        if angle == "120" {
            let mut bytes = std::fs::read(&path).unwrap();
            // 0.75 is 0x3f400000; a file this small is stored as it is.
            let end = bytes.len() - 4;
            assert_eq!(bytes[end..], [0, 0, 0x40, 0x3f]);
            bytes[end..].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
            std::fs::write(&path, bytes).unwrap();
        }
    }
    w.refused(&["stokes", "."], BAD_INPUT, &["e_120.exr", "-inf at column 2, row 1"]);
}

#[test]
fn folders_and_mosaics_that_are_none() {
    let w = World::new();
    std::fs::create_dir(w.path("empty")).unwrap();
    w.refused(&["stokes", "empty"], BAD_INPUT, &["empty", "no pictures"]);
    let [a, b, _] = w.three();
    w.refused(&["stokes", "empty", a, b], USAGE, &["empty", "folder"]);
    w.grey("odd.png", 5, &[1; 10]);
    w.refused(&["stokes", "odd.png", "--mosaic", "imx250mzr"], BAD_INPUT, &["odd.png", "columns", "5"]);
    w.grey("odd.png", 4, &[1; 12]);
    w.refused(&["stokes", "odd.png", "--mosaic", "imx250mzr"], BAD_INPUT, &["odd.png", "rows", "3"]);
    picture(4, 3, Samples::U8(vec![1; 24]), Encoding::Unstated).write_png(&w.path("rgb.png")).unwrap();
    w.refused(&["stokes", "rgb.png", "--mosaic", "imx250mzr"], BAD_INPUT, &["rgb.png", "color"]);
    w.refused(&["stokes", a, b, "--mosaic", "imx250mzr"], USAGE, &["2 files", "--mosaic"]);
}

#[test]
fn levels_and_encodings_that_contradict() {
    let w = World::new();
    w.three();
    w.refused(&["stokes", ".", "--black", "100", "--white", "90"], USAGE, &["white level 90", "black level 100"]);
    w.refused(&["stokes", ".", "--black", "dark"], USAGE, &["auto"]);
    w.refused(&["stokes", ".", "--extinction-ratio", "1"], USAGE, &["above 1"]);
    w.refused(&["stokes", ".", "--efficiency", "0"], USAGE, &["above 0"]);
    for angle in ["0", "60", "120"] {
        std::fs::create_dir_all(w.path("lin")).unwrap();
        let path = w.path(&format!("lin/e_{angle}.exr"));
        picture(3, 1, Samples::F32(vec![0.75; 6]), Encoding::Linear).write_exr(&path).unwrap();
    }
    w.refused(&["stokes", "lin", "--assume-srgb"], USAGE, &["linear", "--assume-srgb"]);
}

#[test]
fn errors_for_programs_are_json() {
    let w = World::new();
    w.three();
    for (arguments, kind, code) in [
        (&["stokes", "nowhere_0.png", "--json"][..], "bad_input", 3),
        (&["stokes", ".", "--angles", "0,0,90", "--json"], "not_identifiable", 7),
        (&["--json", "stokes", "--mosaic", "none", "a.png"], "usage", 2),
    ] {
        let run = w.run(arguments);
        let error: serde_json::Value = serde_json::from_str(&run.stderr).unwrap();
        assert_eq!((run.code, run.stdout.as_str()), (code, ""));
        assert_eq!((&error["error"]["kind"], &error["error"]["exit_code"]), (&kind.into(), &code.into()), "{error}");
    }
}
