//! What works, and what comes out.

use host_image::{Encoding, Samples};
use protocol_polar::Flags;
use serde_json::json;

use crate::world::{World, picture, tiff};

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-4
}

#[test]
fn three_photographs_become_a_folder_of_results() {
    let w = World::new();
    let files = w.three();
    let run = w.ok(&["stokes", files[0], files[1], files[2], "-o", "result"]);
    assert_eq!(
        w.names("result"),
        ["aolp-dolp.png", "aolp.png", "brewster.json", "dolp.png", "flags.png", "report.html", "s0.png", "stokes.exr"]
    );
    for word in ["0\u{b0} a_000.png", "45\u{b0} a_045.png", "90\u{b0} a_090.png", "mean DoLP", "0.5000", "result"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
    assert_eq!(run.stderr, "");
    let image = w.stokes("result");
    assert_eq!((image.width, image.height, image.colors.len()), (4, 2, 1));
    assert_eq!(image.colors[0].s0, vec![2000.0; 8]);
    assert_eq!(image.colors[0].s1, vec![1000.0; 8]);
    assert!(image.colors[0].s2.iter().all(|v| v.abs() < 1e-3));
    assert_eq!(image.metadata.angles_deg, [0.0, 45.0, 90.0]);
    let page = std::fs::read_to_string(w.path("result/report.html")).unwrap();
    assert_eq!(page.matches("data:image/png;base64,").count(), 5);
}

#[test]
fn json_is_all_there_is_on_stdout_and_quiet_is_the_folder() {
    let w = World::new();
    w.three();
    let run = w.ok(&["--json", "stokes", "."]);
    let json = run.json();
    assert_eq!(json["angles_deg"], json!([0.0, 45.0, 90.0]));
    assert!(near(json["colors"][0]["mean_dolp"].as_f64().unwrap(), 0.5));
    assert_eq!(json["warnings"], json!([]));
    assert_eq!(run.stderr, "");
    let output = json["output"].as_str().unwrap();
    assert!(output.starts_with("out/"), "{output}");
    let record: serde_json::Value =
        serde_json::from_slice(&std::fs::read(w.path(output).join("brewster.json")).unwrap()).unwrap();
    assert_eq!(record, json);

    // Without -o every run has a folder of its own.
    let quiet = w.ok(&["-q", "stokes", "."]);
    assert_eq!(quiet.stdout, format!("{output}-2\n"));
}

#[test]
fn angles_may_be_given_and_need_not_be_in_any_order() {
    let w = World::new();
    for (name, dn) in [("left.png", 500), ("mid.png", 1500), ("right.png", 1000)] {
        w.grey(name, 2, &[dn; 2]);
    }
    w.ok(&["stokes", "left.png", "mid.png", "right.png", "--angles", "90,180,-135", "-o", "r"]);
    let image = w.stokes("r");
    assert!(near(image.colors[0].s1[0].into(), 1000.0) && near(image.colors[0].s2[0].into(), 0.0));
}

#[test]
fn color_is_fitted_per_channel_and_four_frames_have_a_residual() {
    let w = World::new();
    // R horizontal, G unpolarized, B at 45 degrees.
    for (angle, rgb) in [(0, [400, 200, 200]), (45, [200, 200, 400]), (90, [0, 200, 200]), (135, [200, 200, 0])] {
        let frame = picture(1, 3, Samples::U16(rgb.to_vec()), Encoding::Linear);
        frame.write_png(&w.path(&format!("p{angle}deg.png"))).unwrap();
    }
    let json = w.ok(&["stokes", ".", "--json", "--npy", "--read-noise", "3", "--electrons-per-dn", "2"]).json();
    let folder = json["output"].as_str().unwrap();
    let image = w.stokes(folder);
    let planes: Vec<[f32; 3]> = image.colors.iter().map(|c| [c.s0[0], c.s1[0], c.s2[0]]).collect();
    for (found, want) in planes.iter().zip([[400.0, 400.0, 0.0], [400.0, 0.0, 0.0], [400.0, 0.0, 400.0]]) {
        assert!(found.iter().zip(want).all(|(a, b): (&f32, f64)| near((*a).into(), b)), "{planes:?}");
    }
    assert!(image.colors.iter().all(|c| c.residual.as_ref().is_some_and(|r| r[0] < 1e-3)));
    assert!(w.names(folder).contains(&"residual.png".to_owned()));
    let npy = w.names(&format!("{folder}/npy"));
    for name in ["S1.G.npy", "RESIDUAL.B.npy", "VARIANCE.R.npy", "COVARIANCE.R.npy", "metadata.json"] {
        assert!(npy.contains(&name.to_owned()), "{npy:?}");
    }
    // Four equispaced frames of unpolarized light: var s1 = 8 sigma^2 / 4, of 200 DN behind the polarizer.
    let sigma = ((9.0 + 100.0 + 1.0 / 12.0) * 2.0_f64).sqrt() / 400.0;
    let red = json["colors"][0]["median_sigma_dolp"].as_f64().unwrap();
    assert!(red > 0.5 * sigma && red < 2.0 * sigma, "{red} {sigma}");
}

#[test]
fn one_mosaic_frame_is_enough() {
    let w = World::new();
    // 90 45 / 135 0, fully polarized at 45 degrees.
    let raw = [100, 200, 100, 200, 0, 100, 0, 100];
    picture(4, 1, Samples::U8(raw.to_vec()), Encoding::Unstated).write_png(&w.path("raw.png")).unwrap();
    let run = w.ok(&["stokes", "raw.png", "--mosaic", "imx250mzr", "-o", "r"]);
    assert_eq!(run.stderr, "", "raw mosaics are linear: no warning");
    let image = w.stokes("r");
    assert_eq!((image.width, image.height), (2, 1));
    assert!(image.colors[0].s2.iter().all(|v| near((*v).into(), 200.0)));
    assert!(image.colors[0].s1.iter().all(|v| near((*v).into(), 0.0)));
}

#[test]
fn gamma_coded_pictures_warn_and_can_be_made_linear() {
    let w = World::new();
    // sRGB codes of light 0.75, 0.5, 0.25 (IEC 61966-2-1): 225, 188, 137.
    for (name, code) in [("a_0.png", 225_u8), ("a_45.png", 188), ("a_90.png", 137)] {
        picture(2, 1, Samples::U8(vec![code; 4]), Encoding::Srgb).write_png(&w.path(name)).unwrap();
    }
    let run = w.ok(&["stokes", ".", "-o", "coded"]);
    assert!(run.stderr.contains("not linear") && run.stderr.contains("--assume-srgb"), "{}", run.stderr);
    let run = w.ok(&["stokes", ".", "-o", "linear", "--assume-srgb", "--json"]);
    assert_eq!(run.stderr, "");
    assert!((run.json()["colors"][0]["mean_dolp"].as_f64().unwrap() - 0.5).abs() < 0.005);
    let coded = w.ok(&["info", "coded/stokes.exr", "--json"]).json();
    assert!((coded["colors"][0]["mean_dolp"].as_f64().unwrap() - 0.5).abs() > 0.2);

    std::fs::create_dir(w.path("tiff")).unwrap();
    for angle in [0, 60, 120] {
        std::fs::write(w.path(&format!("tiff/{angle}.tif")), tiff(2, 8, &[9; 4])).unwrap();
    }
    assert!(w.ok(&["stokes", "tiff", "-o", "t"]).stderr.contains("8-bit"));
}

#[test]
fn dark_and_flat_pictures_even_out_the_sensor() {
    let w = World::new();
    // Two pixels: black 100 and 300, sensitivity 1 and 1/2; the same light as in `three`.
    for (name, dn) in [("a_0.png", 1500), ("a_45.png", 1000), ("a_90.png", 500), ("flat.png", 4000), ("dark.png", 0)] {
        w.grey(name, 2, &[100 + dn, 300 + dn / 2]);
    }
    w.ok(&["stokes", ".", "--dark", "dark.png", "--flat", "flat.png", "-o", "r"]);
    let image = w.stokes("r");
    let c = &image.colors[0];
    assert!((c.s0[0] / c.s0[1] - 1.0).abs() < 1e-6);
    assert!(c.s1.iter().zip(&c.s0).all(|(s1, s0)| (s1 / s0 - 0.5).abs() < 1e-6));
    assert_eq!(image.metadata.black_level_dn, None);
    std::fs::remove_file(w.path("flat.png")).unwrap();
    w.refused(&["stokes", ".", "--dark", "dark.png", "--flat", "dark.png"], 3, &["dark.png", "flat", "above"]);
}

#[test]
fn black_and_white_levels_are_used() {
    let w = World::new();
    for (name, dn) in [("a_0.png", 1500), ("a_45.png", 1000), ("a_90.png", 500), ("a_135.png", 1000)] {
        w.grey(name, 2, &[64 + dn, 64]);
    }
    w.ok(&["stokes", ".", "--black", "64", "--white", "1500", "-o", "r"]);
    let c = &w.stokes("r").colors[0];
    assert_eq!(c.flags.as_deref(), Some(&[Flags::SATURATED.0, 0][..]));
    assert!(near((c.s1[0] / c.s0[0]).into(), 0.5), "three frames are left, and enough");
    let auto = w.ok(&["stokes", ".", "--black", "auto", "-o", "auto"]);
    assert!(auto.stderr.contains("black level 64 DN"), "{}", auto.stderr);
    assert_eq!(w.stokes("auto").metadata.black_level_dn, Some(64.0));
    w.grey("a_45.png", 2, &[4095, 64]);
    assert!(w.ok(&["stokes", ".", "-o", "hint"]).stderr.contains("--white 4095"));
}

#[test]
fn darkness_and_glare_are_results_too() {
    let w = World::new();
    for name in ["dark_0.png", "dark_60.png", "dark_120.png"] {
        w.grey(name, 2, &[0; 4]);
    }
    let json = w.ok(&["stokes", ".", "--json"]).json();
    assert!(near(json["colors"][0]["mean_dolp"].as_f64().unwrap(), 0.0));
    assert!(near(json["colors"][0]["no_light_percent"].as_f64().unwrap(), 100.0));
    assert!(json["warnings"][0].as_str().unwrap().contains("no light"));

    for name in ["dark_0.png", "dark_60.png", "dark_120.png"] {
        w.grey(name, 2, &[65535; 4]);
    }
    let run = w.ok(&["stokes", ".", "-o", "glare"]);
    assert!(run.stderr.contains("expose less"));
    let flags = Flags::SATURATED.with(Flags::TOO_FEW).0;
    assert_eq!(w.stokes("glare").colors[0].flags.as_deref(), Some(&[flags; 4][..]));
}

#[test]
fn signals_that_cancel_are_no_light_and_what_no_float_holds_is_told() {
    let w = World::new();
    for (angle, dn) in [(0, 257), (45, 256), (90, 255)] {
        w.grey(&format!("c_{angle}.png"), 2, &[dn; 4]);
    }
    let json = w.ok(&["stokes", ".", "--black", "256", "-o", "r", "--json"]).json();
    assert!(near(json["colors"][0]["no_light_percent"].as_f64().unwrap(), 100.0), "{json}");
    assert_eq!(w.stokes("r").colors[0].s0, vec![0.0; 4]);

    std::fs::create_dir(w.path("big")).unwrap();
    for angle in [0, 45, 90] {
        let frame = picture(2, 1, Samples::F32(vec![3e38; 2]), Encoding::Linear);
        frame.write_exr(&w.path(&format!("big/e_{angle}.exr"))).unwrap();
    }
    assert!(w.ok(&["stokes", "big", "-o", "b"]).stderr.contains("100.0 % of the pixels are beyond"));
}

#[test]
fn info_tells_what_a_file_is() {
    let w = World::new();
    w.three();
    let text = w.ok(&["info", "a_045.png"]).stdout;
    for word in ["picture", "4 x 2", "16-bit", "grey", "1000 to 1000"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    w.ok(&["stokes", ".", "-o", "r"]);
    let json = w.ok(&["info", "r/stokes.exr", "--json"]).json();
    assert_eq!(json["kind"], "stokes");
    assert_eq!(json["metadata"]["angles_deg"], json!([0.0, 45.0, 90.0]));
    assert_eq!(json["colors"][0]["ranges"]["s0"], json!([2000.0, 2000.0]));
    assert!(w.ok(&["info", "r/stokes.exr"]).stdout.contains("counter-clockwise"));
    picture(2, 3, Samples::F32(vec![0.5; 12]), Encoding::Linear).write_exr(&w.path("f.exr")).unwrap();
    assert!(w.ok(&["info", "f.exr"]).stdout.contains("range G          0.5 to 0.5"));
}

#[test]
fn help_and_completions_say_what_there_is() {
    let w = World::new();
    let help = w.ok(&["--help"]).stdout;
    for word in [
        "stokes",
        "info",
        "completions",
        "Exit codes",
        "not_identifiable",
        "130  interrupted",
        "143  terminated",
        "--json",
    ] {
        assert!(help.contains(word), "{word}: {help}");
    }
    assert!(w.ok(&["stokes", "--help"]).stdout.contains("Angles from file names"));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(w.ok(&["completions", shell]).stdout.contains("assume-srgb"), "{shell}");
    }
}
