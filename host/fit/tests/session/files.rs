//! Sessions as a user or the simulator writes them, and what is said of wrong ones.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use host_fit::maps::Grid;
use host_fit::register::{Interpolation, Registration};
use host_fit::session::{Pictures, PoseOrigin, Session, SessionError, homography};
use host_image::{Color, ColorPlanes, Layers, StokesImage};
use host_optics::Light;
use serde_json::{Value, json};

use crate::drawn::{ANGLES, CORNERS, POSES, SIZE, drawn, intrinsics, open, pose, rows, session, view};

/// Corners or fiducials in the picture instead of a pose give the same camera.
#[test]
fn a_view_may_be_given_by_points() {
    let (folder, by_pose) = drawn(DVec2::ZERO);
    let poses = POSES.map(|(t, p)| pose(t, p));
    let fiducials = [[-0.56, 0.56], [0.56, 0.56], [0.56, -0.56], [-0.56, -0.56], [0.0, 0.61]];
    let seen = |points: &[[f64; 2]], v: usize| -> Vec<[f64; 2]> {
        let h = by_pose.views[v].camera.plane_to_pixel();
        points.iter().map(|p| homography::project(&h, DVec2::from_array(*p)).unwrap().to_array()).collect()
    };
    let mut views = [view("a", poses[0]), view("b", poses[1])];
    for v in &mut views {
        v["camera"].as_object_mut().unwrap().retain(|key, _| key == "K");
    }
    views[0]["plane"] = json!({ "sample_corners_px": seen(&CORNERS, 0) });
    views[1]["plane"] = json!({ "fiducial_centres_plane": fiducials, "fiducial_centres_px": seen(&fiducials, 1) });
    let found = open(folder.path(), &session(&views)).unwrap();
    assert_eq!([0, 1].map(|v| found.views[v].placement.origin), [PoseOrigin::Corners, PoseOrigin::Fiducials]);
    for (a, b) in found.views.iter().zip(&by_pose.views) {
        assert!((a.camera.position() - b.camera.position()).length() < 1e-7 && a.placement.residual_px.unwrap() < 1e-7);
    }
}

/// The same light in both layouts, and a polarized one.
#[test]
fn maps_of_either_layout_are_the_same_light() {
    let (folder, _) = drawn(DVec2::ZERO);
    let (width, height) = (64, 32);
    // Brighter towards azimuth 80 degrees; no texture finer than the map.
    let bright = |azimuth: f64| (1.0 + (azimuth - 80_f64.to_radians()).cos()) as f32;
    let column = |c: usize| std::f64::consts::TAU * (c as f64 + 0.5) / width as f64;
    let plane = |value: &dyn Fn(usize) -> f32| (0..width * height).map(|i| value(i % width)).collect::<Vec<f32>>();
    let ours = plane(&|c| bright(column(c)));
    // A panorama whose middle shows azimuth 100 degrees, azimuth falling to the right.
    let seen = plane(&|c| bright(100_f64.to_radians() + std::f64::consts::PI - column(c)));
    let (quarter, none) = (plane(&|c| 0.25 * bright(column(c))), plane(&|_| 0.0));
    let write = |name: &str, channels: &[(&str, &[f32])]| {
        let mut layers = Layers::new(width, height);
        channels.iter().for_each(|(channel, samples)| layers.lend_f32(channel, samples));
        layers.save(&folder.path().join(name)).unwrap();
    };
    write("ours.exr", &[("R", &ours), ("G", &ours), ("B", &ours)]);
    write("seen.exr", &[("R", &seen), ("G", &seen), ("B", &seen)]);
    let bands = ["R", "G", "B"].map(|b| [format!("s0.{b}"), format!("s1.{b}"), format!("s2.{b}")]);
    let polarized: Vec<(&str, &[f32])> = bands
        .iter()
        .flat_map(|[a, b, c]| [(a.as_str(), &*ours), (b.as_str(), &*quarter), (c.as_str(), &*none)])
        .collect();
    write("polarized.exr", &polarized);
    let read = |light: Value| {
        let mut document = session(&POSES.map(|(t, p)| view("a", pose(t, p))));
        document["light"] = light;
        open(folder.path(), &document)
    };
    let inside = "equirectangular, zenith up, seen from inside: azimuth falls to the right";
    let a = read(json!({ "type": "map", "file": "ours.exr" })).unwrap().light;
    let b =
        read(json!({ "type": "probe", "file": "seen.exr", "layout": inside, "center_azimuth_deg": 100, "scale": 2 }))
            .unwrap()
            .light;
    let c = read(json!({ "type": "map", "file": "polarized.exr" })).unwrap().light;
    for azimuth in [0.1, 1.3, 2.9, 4.4, 6.0_f64] {
        let w = DVec3::new(0.8 * azimuth.cos(), 0.8 * azimuth.sin(), 0.6);
        let [l, ..] = a.bands[0].stokes(w);
        assert!((l - f64::from(bright(azimuth))).abs() < 5e-3);
        assert!((b.bands[2].stokes(w)[0] - 2.0 * l).abs() < 1e-2);
        let [m, q, u] = c.bands[1].stokes(w);
        assert!((m - l).abs() < 1e-6 && (q - 0.25 * l).abs() < 1e-2 * l + 1e-3 && u.abs() < 2e-2 * l + 1e-3);
        assert!((b.known().unwrap().stokes(w)[0][0] - 2.0 * l).abs() < 1e-2);
    }
    let refused = read(json!({ "type": "map", "file": "polarized.exr", "layout": inside, "center_azimuth_deg": 0 }));
    assert!(matches!(refused, Err(SessionError::Unsupported { .. })));
}

#[test]
fn what_is_wrong_with_a_session_is_said() {
    let (folder, _) = drawn(DVec2::ZERO);
    let poses = POSES.map(|(t, p)| pose(t, p));
    let sound = session(&[view("a", poses[0]), view("b", poses[1])]);
    let changed = |pointer: &str, value: Value| {
        let mut document = sound.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        document.pointer_mut(parent).unwrap().as_object_mut().unwrap().insert(key.to_owned(), value);
        open(folder.path(), &document)
    };
    let refused = |pointer: &str, value: Value| match changed(pointer, value.clone()) {
        Ok(_) => panic!("{pointer} {value} was taken"),
        Err(error) => error.to_string(),
    };
    let says = |pointer: &str, value: Value, words: &str| {
        let found = refused(pointer, value);
        assert!(found.contains(words), "{found}");
    };
    says("/version", json!(2), "version 1 is");
    says("/light", Value::Null, "light is missing; the fit must know the light");
    says("/light", json!({ "type": "lamp" }), "light.type is \"lamp\"");
    says("/light", json!({ "type": "overcast" }), "zenith_radiance");
    says("/light", json!({ "type": "constant", "radiance_rgb": [1, -1, 1] }), "not negative");
    says("/light", json!({ "type": "map", "file": "a_0.exr", "layout": "cube map" }), "cube map");
    says("/light", json!({ "type": "map", "file": "none.exr" }), "none.exr");
    says("/views/0/light", json!({ "type": "constant", "radiance_rgb": [2, 2, 2] }), "light and a do not agree");
    says("/views/1/polarizer/angle_convention", json!("clockwise from vertical"), "counter-clockwise");
    says("/views/1/polarizer/reference_axis", json!("horizon"), "\"horizon\"");
    says("/views/0/camera/model", json!("fisheye"), "\"pinhole, no distortion\" is");
    says("/views/0/camera/axes", json!("x left"), "x right, y down");
    says("/views/0/image", json!({ "width": 300, "height": 240 }), "300 x 240 and the files' 320 x 240");
    says("/views/0/sensor", Value::Null, "sensor is missing");
    says("/views/0/exposure_s", json!(0), "exposure_s is 0");
    says("/views/0/sequences", json!({}), "name the files of the frames");
    says("/views/0/sequences", json!({ "plan": [{ "file": "a_0.exr", "nominal_angle_deg": 0 }] }), "not identifiable");
    says("/views/0/camera/R_world_to_camera", json!(rows(DMat3::IDENTITY * 1.2)), "R is not a rotation");
    says("/views/0/camera/R_world_to_camera", Value::Null, "plane.sample_corners_px");
    says("/views/0/plane", json!({ "sample_corners_px": [[0, 0], [9, 0], [9, 9], [0, 9]] }), "do not agree");
    // The second camera looks past the sample.
    let mut aside = poses[1];
    aside.1 += DVec3::new(2.5, 0.0, 0.0);
    let apart = open(folder.path(), &session(&[view("a", poses[0]), view("b", aside)])).err().unwrap();
    assert!(matches!(&apart, SessionError::NoOverlap { first, second } if first == "a" && second == "b"), "{apart}");
    // Not all that is unusual is wrong.
    changed("/views/0/note", json!("windy")).unwrap();
    assert!(matches!(
        Session::open(&folder.path().join("views.json"), &Pictures::Stokes),
        Err(SessionError::Missing { .. })
    ));
    let named = Session::open(folder.path(), &Pictures::Sequence("six".into())).unwrap_err().to_string();
    assert!(named.contains("this view has plan"), "{named}");
    std::fs::write(folder.path().join("views.json"), "{\"version\": 1,").unwrap();
    assert!(matches!(Session::open(folder.path(), &Pictures::Best), Err(SessionError::Json { .. })));
    assert!(matches!(Session::open(Path::new("no/such"), &Pictures::Best), Err(SessionError::Io { .. })));
}

/// What `brewster simulate` writes: per-band response, planned frames without files, no common exposure, light by its
/// formulas.
#[test]
fn sessions_of_the_simulator_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let poses = POSES.map(|(t, p)| pose(t, p));
    let written = |name: &str, (rotation, t): (DMat3, DVec3)| {
        let plane = |v: f64| (0..SIZE[0] * SIZE[1]).map(|_| v as f32).collect::<Vec<_>>();
        let colors = [Color::R, Color::G, Color::B].map(|color| ColorPlanes {
            color,
            s0: plane(1.0),
            s1: plane(0.25),
            s2: plane(-0.5),
            flags: None,
            residual: None,
        });
        let image = StokesImage {
            width: SIZE[0],
            height: SIZE[1],
            colors: colors.into(),
            metadata: crate::captures::metadata(),
        };
        image.save_exr(&folder.path().join(format!("{name}.exr"))).unwrap();
        let frames: Vec<Value> =
            ANGLES.iter().map(|a| json!({ "nominal_angle_deg": a, "exposure_s": 0.01, "start_s": 0.0 })).collect();
        json!({
            "view": name,
            "stokes": { "file": format!("{name}.exr"), "unit": "radiance", "channels": "R, G, B" },
            "image": { "width": 320, "height": 240, "channels": "RGGB", "linear": true, "container": "PNG, 16 bit, grey" },
            "sensor": {
                "bit_depth": 12, "black_level_dn": 240, "white_level_dn": 4095, "gain_e_per_dn": 2.5, "read_noise_e": 2.0,
                "responsivity_dn_per_radiance_s": [1e4, 2e4, 1.5e4]
            },
            "exposure_s": null,
            "camera": {
                "model": "pinhole, no distortion", "K": rows(intrinsics()), "R_world_to_camera": rows(rotation),
                "t_world_to_camera": t.to_array(), "axes": "camera x right, y down, z forward (OpenCV)",
                "pixel_convention": "u to the right, v down, centre of pixel (row 0, col 0) is u=v=0.5"
            },
            "plane": { "side": 0.22, "sample_corners_plane": [[-0.11, 0.11], [0.11, 0.11], [0.11, -0.11], [-0.11, -0.11]] },
            "polarizer": {
                "angle_convention": "transmission axis, counter-clockwise from image right as seen in the picture; s1>0 \
                                     horizontal, s2>0 at +45 deg (right-up)",
                "extinction_ratio": 1e4, "transmission": 0.8
            },
            "light": {
                "type": "clear", "base_radiance": [1, 2, 3], "horizon_radiance": [0.5, 0.5, 0.5], "aureole_radiance": [5, 5, 5],
                "aureole_width_deg": 12.0, "polarization": { "type": "berry", "max_dolp": 0.7, "splitting_deg": 30.0 },
                "sun_azimuth_deg": 30.0, "sun_elevation_deg": 40.0,
                "sun_disk": { "radiance": [1e5, 9e4, 8e4], "angular_radius_deg": 0.2667 }
            },
            "sequences": { "plan": frames }
        })
    };
    let views = poses.iter().zip(["view-0", "view-1"]).map(|(pose, name)| written(name, *pose)).collect::<Vec<_>>();
    let session = open(folder.path(), &json!({ "version": 1, "capture": "test", "views": views })).unwrap();
    assert_eq!((session.sample.x, session.sample.y), ([-0.11, 0.11], [-0.11, 0.11]));
    assert!(session.light.sun.is_some_and(|(_, radiance)| radiance == [1e5, 9e4, 8e4]));
    let [l, q, u] = session.light.bands[2].stokes(DVec3::Z);
    assert!(l > 3.0 && q.hypot(u) > 0.1 * l && q.hypot(u) < 0.7 * l);
    let registration = Registration::new(&session, Grid::finest(&session), Interpolation::Cubic).unwrap();
    let [rows, cols] = [registration.grid().rows, registration.grid().columns];
    // 1400/6 pixels a unit, seen from 10 degrees off the normal.
    assert!(rows.abs_diff(51) <= 1 && cols == rows, "{rows} {cols}");
    let tile = registration.tile(0..rows, 0..cols).unwrap();
    for i in 0..tile.len() {
        for o in tile.node(i) {
            let o = o.unwrap();
            assert!(o.stokes.iter().flatten().zip([1.0, 0.25, -0.5].iter().cycle()).all(|(a, b)| (a - b).abs() < 1e-6));
            assert!(o.covariance[0][0] > 0.0 && o.covariance[0][0] < 2e-6);
        }
    }
}
