//! Pictures by Mitsuba 3 of planar samples: s0, s1, s2 of every pixel that does not touch an edge.
//!
//! Its reference axis for a ray d is normalize(d × up), ours the camera's x axis made orthogonal to the ray: up to half a degree
//! apart in the corners, so its Stokes vectors are turned before they are compared.

use crate::shared::{exr, json, numbers};
use glam::{DMat3, DVec3};
use host_optics::frames::Turn;
use host_optics::sky::{StokesMap, Uniform};
use host_optics::{Frame, Ggx, Ior, Masking};
use host_sim::EffectSet;
use host_sim::optical::{Body, Evaluation, Pixel, PixelMap, Radiance, Renderer, SceneLight, Surface};

struct Capture {
    width: usize,
    camera_x: DVec3,
    pixels: Vec<Pixel>,
    surfaces: Vec<Surface>,
    /// [band][s0, s1, s2] in our frames; `None` where not scored.
    truth: Vec<Option<[[f32; 3]; 3]>>,
}

fn light(capture: &str) -> Option<SceneLight> {
    if capture == "S3_const" {
        let one = Radiance::Uniform(Uniform { radiance: 1.0 });
        return Some(SceneLight::unpolarized([one.clone(), one.clone(), one]));
    }
    let (width, height, channels) = exr(&format!("captures/{capture}/light/probe.exr"))?;
    let band = |name: &str| {
        let pixels = channels[name].iter().map(|l| [*l, 0.0, 0.0]).collect();
        Radiance::Map(StokesMap::new(width, height, pixels).unwrap())
    };
    Some(SceneLight::unpolarized([band("R"), band("G"), band("B")]))
}

impl Capture {
    fn load(capture: &str, view: &str) -> Option<Self> {
        let meta = json(&format!("captures/{capture}/{view}/capture.json"))?;
        let (width, height, maps) = exr(&format!("captures/{capture}/truth/{view}/maps.exr"))?;
        let (_, _, stokes) = exr(&format!("captures/{capture}/truth/{view}/stokes.exr"))?;
        let camera = &meta["camera"];
        let rows: Vec<DVec3> =
            camera["R_world_to_camera"].as_array().unwrap().iter().map(|r| DVec3::from_slice(&numbers(r))).collect();
        let k: Vec<Vec<f64>> = camera["K"].as_array().unwrap().iter().map(numbers).collect();
        let to_world = DMat3::from_cols(rows[0], rows[1], rows[2]);
        let up = -rows[1];
        let mut out = Self { width, camera_x: rows[0], pixels: Vec::new(), surfaces: Vec::new(), truth: Vec::new() };
        let mut keys: Vec<(f32, f32, f32)> = Vec::new();
        for i in 0..width * height {
            let (u, v) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let d = (to_world * DVec3::new((u - k[0][2]) / k[0][0], (v - k[1][2]) / k[1][1], 1.0)).normalize();
            let mask = maps["mask"][i];
            let scored = mask >= 10.0;
            let normal = ["normal.X", "normal.Y", "normal.Z"].map(|c| maps[c][i]);
            // Alpha and index are constant over a patch up to the rounding of the mean over subpixels.
            let key = (mask, (maps["eta"][i] * 1e4).round() / 1e4, (maps["alpha"][i] * 1e4).round() / 1e4);
            let surface = if scored {
                let at = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                    keys.push(key);
                    let ior = Ior::new(f64::from(key.1), 0.0).unwrap();
                    let ggx = Ggx::new(f64::from(key.2), Masking::Separable).unwrap();
                    out.surfaces.push(Surface { ior: [ior; 3], ggx, body: Body::Interface });
                    keys.len() - 1
                });
                u16::try_from(at).unwrap()
            } else {
                Pixel::NOTHING
            };
            let wo = -d;
            out.pixels.push(Pixel {
                normal: DVec3::from(normal.map(f64::from)).normalize_or(DVec3::Z).as_vec3().into(),
                to_camera: wo.as_vec3().into(),
                albedo: ["albedo.R", "albedo.G", "albedo.B"].map(|c| maps[c][i]),
                surface,
            });
            let turn: Turn = Frame::camera(wo, out.camera_x).unwrap().turn_to(d.cross(up));
            let band = |c: &str| {
                let [s0, s1, s2] = ["s0", "s1", "s2"].map(|s| f64::from(stokes[&format!("{s}.{c}")][i]));
                turn.apply_linear([s0, s1, s2]).map(|x| x as f32)
            };
            out.truth.push(scored.then(|| ["R", "G", "B"].map(band)));
        }
        Some(out)
    }

    fn map(&self) -> PixelMap<'_> {
        PixelMap { width: self.width, camera_x: self.camera_x, pixels: &self.pixels }
    }
}

/// Root mean square and largest difference of each component over bands and scored pixels, relative to the true s0.
fn errors(found: &[[[f32; 3]; 3]], truth: &[Option<[[f32; 3]; 3]>]) -> [[f64; 2]; 3] {
    let mut sums = [[0.0_f64; 2]; 3];
    let mut count = 0.0;
    for (f, t) in found.iter().zip(truth).filter_map(|(f, t)| t.as_ref().map(|t| (f, t))) {
        for (f, t) in f.iter().zip(t) {
            count += 1.0;
            for k in 0..3 {
                let e = f64::from((f[k] - t[k]) / t[0]);
                sums[k] = [sums[k][0] + e * e, sums[k][1].max(e.abs())];
            }
        }
    }
    sums.map(|[square, worst]| [(square / count).sqrt(), worst])
}

#[test]
fn renderings_agree_with_mitsuba() {
    for capture in ["S3_const", "S3_hdr", "S1"] {
        let Some(light) = light(capture) else { return };
        for view in ["v0", "v1", "v2"] {
            let Some(capture_data) = Capture::load(capture, view) else { return };
            let evaluation = Evaluation::Prefiltered { tolerance: 1e-3 };
            let renderer = Renderer::new(&light, &capture_data.surfaces, EffectSet::ALL, evaluation).unwrap();
            let rendering = renderer.render(&capture_data.map());
            let [s0, s1, s2] = errors(&rendering.stokes, &capture_data.truth);
            let summary = [s0, s1, s2].map(|[rms, worst]| format!("{rms:.1e} (worst {worst:.1e})"));
            println!("{capture} {view}: rms of s0, s1, s2 in units of s0: {}", summary.join(", "));
            // Mitsuba's own noise and the normals that vary within a pixel account for 6e-4 (S3) to 1e-3 (S1) of it.
            for [rms, _] in [s0, s1, s2] {
                assert!(rms < 1.3e-3, "{capture} {view}: {rms:.2e}");
            }
            assert!(s2[0] < 4e-4, "{capture} {view}: s2 {:.2e}", s2[0]);
        }
    }
}
