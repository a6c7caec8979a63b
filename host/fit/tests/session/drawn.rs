//! A plane with a pattern one can write down, seen by cameras whose pictures are drawn by hand.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use host_fit::session::{Pictures, Session, SessionError};
use host_image::{Encoding, Picture, Samples};
use protocol_polar::{Analyzer, Degrees};
use serde_json::{Value, json};

pub(crate) const SIZE: [usize; 2] = [320, 240];
pub(crate) const FOCAL: f64 = 1400.0;
pub(crate) const ANGLES: [f64; 4] = [0.0, 45.0, 90.0, 135.0];
pub(crate) const CORNERS: [[f64; 2]; 4] = [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]];

/// Numbers of a fixed seed.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (a, b) = (uniform(), uniform());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// (R, t) of a camera at zenith angle θ and azimuth φ, 6 units away, its picture's horizontal level.
pub(crate) fn pose(theta: f64, phi: f64) -> (DMat3, DVec3) {
    let (theta, phi) = (theta.to_radians(), phi.to_radians());
    let back = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
    let right = DVec3::new(-phi.sin(), phi.cos(), 0.0);
    let rotation = DMat3::from_cols(right, -back.cross(right), -back).transpose();
    (rotation, -(rotation * (back * 6.0)))
}

pub(crate) fn intrinsics() -> DMat3 {
    DMat3::from_cols(DVec3::X * FOCAL, DVec3::Y * FOCAL, DVec3::new(160.0, 120.0, 1.0))
}

pub(crate) fn rows(m: DMat3) -> [[f64; 3]; 3] {
    m.transpose().to_cols_array_2d()
}

/// s0, s1, s2 in the plane's middle units: smooth, and of wavelengths that four pixels resolve.
pub(crate) fn light(p: DVec2) -> [f64; 3] {
    let wave = |x: f64, y: f64| (x * p.x + y * p.y + 0.3).sin();
    let s0 = 1.0 + 0.3 * wave(17.0, 9.0) + 0.2 * wave(-11.0, 19.0);
    [s0, 0.3 * s0 * wave(5.0, -3.0), 0.2 * s0 * wave(2.0, 6.0)]
}

/// Frames of a view, DN in floats: 100 + 1000 I(φ), one ray to each pixel; `moved` is where the picture really looks.
pub(crate) fn draw(
    folder: &Path,
    name: &str,
    (rotation, t): (DMat3, DVec3),
    moved: DVec2,
    noise: &mut dyn FnMut(f64) -> f64,
) {
    let h = intrinsics() * DMat3::from_cols(rotation.x_axis, rotation.y_axis, t);
    let back = (DMat3::from_translation(moved) * h).inverse();
    for angle in ANGLES {
        let row = Analyzer::ideal(Degrees(angle).to_radians()).row();
        let samples = (0..SIZE[0] * SIZE[1]).flat_map(|i| {
            let p = back * DVec3::new((i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5, 1.0);
            let s = light(p.truncate() / p.z);
            let signal = 1000.0 * (row[0] * s[0] + row[1] * s[1] + row[2] * s[2]);
            [0, 1, 2].map(|_| (100.0 + signal + noise(signal)) as f32)
        });
        let samples = Samples::F32(samples.collect());
        let picture = Picture { width: SIZE[0], height: SIZE[1], channels: 3, samples, encoding: Encoding::Linear };
        picture.write_exr(&folder.join(format!("{name}_{angle}.exr"))).unwrap();
    }
}

pub(crate) fn view(name: &str, (rotation, t): (DMat3, DVec3)) -> Value {
    let frames: Vec<Value> =
        ANGLES.iter().map(|a| json!({ "file": format!("{name}_{a}.exr"), "nominal_angle_deg": a })).collect();
    json!({
        "view": name,
        "camera": { "K": rows(intrinsics()), "R_world_to_camera": rows(rotation), "t_world_to_camera": t.to_array() },
        "sensor": {
            "black_level_dn": 100, "white_level_dn": 4000, "gain_e_per_dn": 2.0, "read_noise_e": 4.0,
            "responsivity_dn_per_radiance_s": 500
        },
        "exposure_s": 2.0,
        "polarizer": { "reference_axis": "camera" },
        "sequences": { "plan": frames }
    })
}

pub(crate) fn session(views: &[Value]) -> Value {
    json!({ "version": 1, "views": views, "light": { "type": "constant", "radiance_rgb": [1, 1, 1] } })
}

pub(crate) fn open(folder: &Path, document: &Value) -> Result<Session, SessionError> {
    std::fs::write(folder.join("views.json"), document.to_string()).unwrap();
    Session::open(folder, &Pictures::Best)
}

pub(crate) const POSES: [(f64, f64); 2] = [(50.0, 20.0), (10.0, 110.0)];

/// Two views without noise, the first one's picture moved.
pub(crate) fn drawn(moved: DVec2) -> (tempfile::TempDir, Session) {
    let folder = tempfile::tempdir().unwrap();
    let poses = POSES.map(|(t, p)| pose(t, p));
    draw(folder.path(), "a", poses[0], moved, &mut |_| 0.0);
    draw(folder.path(), "b", poses[1], DVec2::ZERO, &mut |_| 0.0);
    let found = open(folder.path(), &session(&[view("a", poses[0]), view("b", poses[1])])).unwrap();
    (folder, found)
}
