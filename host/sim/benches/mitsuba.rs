//! The picture that `host/xtask/perf/mitsuba_peer.py` renders with Mitsuba 3, rendered here: processor time and error.
//! `cargo bench -p host-sim --bench mitsuba -- FOLDER`, FOLDER being what that program wrote; it says what is in there.
//!
//! Prints JSON: [{alpha, tolerance, cpu_s, error}]. `cpu_s` is processor time of all threads for one picture of 1024 × 1024 in
//! *three* bands, light and tables included, from nothing. `error` is the rms difference to Mitsuba's mean over 8 × 8 pixels of
//! many samples, worst component, in units of the mean s0; that mean has noise of its own.

use glam::DVec3;
use host_optics::frames::Frame;
use host_optics::sky::StokesMap;
use host_optics::{Ggx, Ior, Masking};
use host_sim::EffectSet;
use host_sim::optical::{Body, Evaluation, Pixel, PixelMap, Radiance, Renderer, SceneLight, Surface};
use std::error::Error;
use std::path::Path;

const SIDE: usize = 1024;
const COARSE: usize = 128;
const MAP: (usize, usize) = (2048, 1024);
const RUNS: u32 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds --bench of its own.
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    let Some(folder) = folder else {
        println!("[]");
        return Ok(());
    };
    let folder = Path::new(&folder);
    let texels = floats(&folder.join("map.f32"))?.iter().map(|l| [*l, 0.0, 0.0]).collect();
    let map = Radiance::Map(StokesMap::new(MAP.0, MAP.1, texels)?);
    let light = SceneLight::unpolarized([map.clone(), map.clone(), map]);
    let pixels = pixels();
    let view = PixelMap { width: SIDE, camera_x: DVec3::Y, pixels: &pixels };
    let mut rows = Vec::new();
    for alpha in [0.1, 0.25] {
        let reference = reference(&floats(&folder.join(format!("alpha_{alpha}.f32")))?)?;
        let surface =
            Surface { ior: [Ior::new(1.5, 0.0)?; 3], ggx: Ggx::new(alpha, Masking::Separable)?, body: Body::Lambert };
        let surfaces = [surface];
        for tolerance in [1e-2, 3e-3, 1e-3] {
            let render = || -> Result<_, Box<dyn Error>> {
                let evaluation = Evaluation::Prefiltered { tolerance };
                Ok(Renderer::new(&light, &surfaces, EffectSet::ALL, evaluation)?.render(&view))
            };
            let start = processor_seconds()?;
            let mut rendering = render()?;
            for _ in 1..RUNS {
                rendering = render()?;
            }
            let cpu_s = (processor_seconds()? - start) / f64::from(RUNS);
            let error = error(&rendering.stokes, &reference);
            rows.push(format!(
                r#"{{"alpha": {alpha}, "tolerance": {tolerance}, "cpu_s": {cpu_s:.4}, "error": {error:.3e}}}"#
            ));
        }
    }
    println!("[{}]", rows.join(",\n "));
    Ok(())
}

/// The rays of a pixel grid `side` wide: ω_o of each, and where it leaves.
fn directions(side: usize) -> impl Iterator<Item = DVec3> {
    let (s, c) = 56.0_f64.to_radians().sin_cos();
    let to_camera = DVec3::new(s, 0.0, c);
    let up = DVec3::new(-c, 0.0, s);
    (0..side * side).map(move |k| {
        let place = |n: usize| ((n as f64 + 0.5) / side as f64 - 0.5) * 0.2;
        (to_camera - DVec3::Y * place(k % side) + up * place(k / side)).normalize()
    })
}

fn pixels() -> Vec<Pixel> {
    let pixel =
        |wo: DVec3| Pixel { normal: [0.0, 0.0, 1.0], to_camera: wo.as_vec3().into(), albedo: [0.0; 3], surface: 0 };
    directions(SIDE).map(pixel).collect()
}

/// Mitsuba's axis of a ray d is normalize(d × up), ours the picture's x axis made orthogonal to the ray.
fn reference(stokes: &[f32]) -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let (s, c) = 56.0_f64.to_radians().sin_cos();
    let up = DVec3::new(-c, 0.0, s);
    let turned = |(wo, s): (DVec3, &[f32; 3])| {
        let turn = Frame::camera(wo, DVec3::Y)?.turn_to((-wo).cross(up));
        Ok(turn.apply_linear(s.map(f64::from)))
    };
    directions(COARSE).zip(stokes.as_chunks::<3>().0).map(turned).collect()
}

/// rms over the coarse pixels of the worst component, in units of the mean s0.
fn error(stokes: &[[[f32; 3]; 3]], reference: &[[f64; 3]]) -> f64 {
    let block = SIDE / COARSE;
    let mut squares = [0.0; 3];
    for (k, expected) in reference.iter().enumerate() {
        let (row, column) = (k / COARSE * block, k % COARSE * block);
        let mut mean = [0.0; 3];
        for at in (row..row + block).flat_map(|r| (column..column + block).map(move |c| r * SIDE + c)) {
            let [band, ..] = stokes[at];
            for (m, s) in mean.iter_mut().zip(band) {
                *m += f64::from(s) / (block * block) as f64;
            }
        }
        for ((square, m), e) in squares.iter_mut().zip(mean).zip(expected) {
            *square += (m - e).powi(2);
        }
    }
    let brightness = reference.iter().map(|[s0, ..]| s0).sum::<f64>();
    let count = reference.len() as f64;
    squares.into_iter().map(|square| (square * count).sqrt() / brightness).fold(0.0, f64::max)
}

fn floats(path: &Path) -> Result<Vec<f32>, Box<dyn Error>> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

/// User and system time of this process, all threads (Linux, proc(5): fields 14 and 15 of stat, in hundredths).
fn processor_seconds() -> Result<f64, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    let (_, after_name) = stat.rsplit_once(')').ok_or("no name in /proc/self/stat")?;
    let ticks: f64 = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum();
    Ok(ticks / 100.0)
}
