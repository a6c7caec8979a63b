//! The ink print of the paper's §5, simulated: the only accuracy the paper states is the index of its inks.
//!
//! The scene's three views (two near Brewster's angle a quarter turn apart, one near the normal) are simulated, given noise, and
//! fitted. A second fit repeats what a reference of the wrong index does: the paper takes its chart's casing for 1.46 and finds
//! inks lower than their references; a casing of 1.49 taken for 1.46 makes everything else that mirrors look darker.

use super::score;
use super::statistics::quantile;
use crate::process;
use anyhow::{Context, Result, bail};
use glam::DVec2;
use host_fit::joint::Reasons;
use host_fit::maps::Plane;
use host_fit::pipeline::{BodyChoice, FitOptions, Mode, Prepared};
use host_fit::session::{
    BandLight, Camera, LightSpec, Placement, PoseOrigin, Radiance, ReferenceAxis, Sample, Session, StokesNoise,
    StokesSource, ViewCapture, ViewData,
};
use host_image::StokesImage;
use host_optics::{Dielectric, Incidence, Ior};
use host_sim::Scene;
use host_sim::camera::Pinhole;
use host_sim::scene::{Field, Index, SkyRadiance, Surface};
use protocol_polar::Degrees;
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use std::fmt::Write;

const SCENE: &str = "host/sim/scenes/ink-print.toml";

/// σ of s0 over s0; of s1 and s2 √2 of that.
const NOISE: f64 = 0.003;

/// Errors of the simulation, relative to s0.
const TOLERANCE: f64 = 0.005;

/// Samples nearer to another surface than this many steps of the grid are not scored.
const EDGE: f64 = 3.0;

/// What the paper reads, and its references (supplement, §5).
const PAPER: [(&str, f64, &str); 3] =
    [("black", 1.65, "1.60"), ("blue", 1.49, "1.53 to 1.54"), ("yellow", 1.49, "1.53 to 1.54")];

/// The casing as the paper takes it, and as it may be.
const CASING: [f64; 2] = [1.46, 1.49];

/// One field of the print.
pub(super) struct Ink {
    pub(super) name: String,
    /// η and α.
    pub(super) truth: [f64; 2],
    /// Medians of η, α, σ of η, σ of α.
    pub(super) found: [f64; 4],
    /// Median of η where the light was measured with the wrong casing.
    casing: f64,
    samples: usize,
    answered: usize,
}

/// Of a surface: how many samples, and η, α and their σ of those against which nothing speaks.
#[derive(Clone, Default)]
struct Answers {
    samples: usize,
    sound: Vec<[f64; 4]>,
}

/// Simulates the print and fits it.
pub(super) fn fit() -> Result<Vec<Ink>> {
    println!("  {SCENE}");
    let scene = Scene::read(&process::root().join(SCENE))?;
    let image = |view| Ok(host_sim::simulate(&scene, view, TOLERANCE, false)?.image);
    let images = (0..scene.views.len()).map(image).collect::<Result<Vec<StokesImage>>>()?;
    let mirrored = |eta| -> Result<f64> {
        let at = Incidence::from_angle(Degrees(57.0).to_radians());
        let [through_s, through_p] = Dielectric::new(eta)?.transmittance(at);
        Ok(2.0 - through_s - through_p)
    };
    // Light of the true casing's brightness is taken for that much more of it.
    let scale = mirrored(CASING[0])? / mirrored(CASING[1])?;
    let (right, wrong) = (answers(&scene, &images, 1.0)?, answers(&scene, &images, scale)?);
    let surfaces = scene.sample.surfaces.iter().zip(right.into_iter().zip(wrong));
    surfaces.map(|(surface, (right, wrong))| ink(surface, &right, &wrong)).collect()
}

fn ink(surface: &Surface, right: &Answers, wrong: &Answers) -> Result<Ink> {
    let name = surface.name.clone();
    let (Index::Constant([_, Ior::Dielectric(ior), _]), Field::Constant(alpha)) = (&surface.ior, &surface.alpha) else {
        bail!("{SCENE}: the index and the roughness of {name} are not constant");
    };
    let median = |of: &Answers, k: usize| {
        let values = of.sound.iter().map(|answer| answer[k]).collect();
        quantile(values, 0.5).with_context(|| format!("{SCENE}: no answer for {name}"))
    };
    let mut found = [0.0; 4];
    for (k, found) in found.iter_mut().enumerate() {
        *found = median(right, k)?;
    }
    let casing = median(wrong, 0)?;
    let truth = [ior.eta(), *alpha];
    Ok(Ink { truth, found, casing, samples: right.samples, answered: right.sound.len(), name })
}

/// Fits the views with their Stokes vectors times `scale`; by surface.
fn answers(scene: &Scene, images: &[StokesImage], scale: f64) -> Result<Vec<Answers>> {
    let session = session(scene, images, scale)?;
    let options = FitOptions { mode: Mode::Joint, body: BodyChoice::Lambert, refine: false, ..FitOptions::default() };
    let prepared = Prepared::new(&session, &[], options)?;
    let maps = score::fitted(&prepared, Mode::Joint)?;
    let mut out = vec![Answers::default(); scene.sample.surfaces.len()];
    let [eta, alpha, sigma_eta, sigma_alpha] =
        [Plane::Eta, Plane::Alpha, Plane::SigmaEta, Plane::SigmaAlpha].map(|plane| maps.plane(plane));
    let grid = maps.grid;
    let [step_x, step_y] = [grid.plane.right - grid.plane.left, grid.plane.top - grid.plane.bottom];
    let step = DVec2::new(step_x / grid.columns as f64, step_y / grid.rows as f64) * EDGE;
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let at = DVec2::from(grid.position(column, row));
            let surface = |x: f64, y: f64| scene.sample.at(at + step * DVec2::new(x, y)).map(|point| point.surface);
            let Some(here) = surface(0.0, 0.0) else { continue };
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
            if corners.iter().any(|(x, y)| surface(*x, *y) != Some(here)) {
                continue;
            }
            let i = row * grid.columns + column;
            out[here].samples += 1;
            if maps.reasons[i] == Reasons::NONE.0 {
                out[here].sound.push([eta[i], alpha[i], sigma_eta[i], sigma_alpha[i]].map(f64::from));
            }
        }
    }
    Ok(out)
}

/// What a fit would read of the simulated views, with noise.
fn session(scene: &Scene, images: &[StokesImage], scale: f64) -> Result<Session> {
    let view = |(index, (camera, image)): (usize, (&Pinhole, &StokesImage))| -> Result<ViewCapture> {
        let (rotation, translation) = camera.world_to_camera();
        let size = [camera.width, camera.height];
        let camera = Camera::new(size, camera.intrinsics(), rotation, translation)?;
        let seed = scene.seed + index as u64;
        Ok(ViewCapture {
            name: format!("view {index}"),
            camera,
            placement: Placement { origin: PoseOrigin::Pose, residual_px: None },
            reference: ReferenceAxis::Camera,
            data: ViewData::Stokes(Box::new(StokesSource {
                image: noisy(image, scale, seed),
                radiance_per_unit: [1.0; 3],
                noise: StokesNoise::Relative(NOISE),
            })),
        })
    };
    let band = |sky: &SkyRadiance| match sky {
        SkyRadiance::Overcast(sky) => Ok(BandLight { radiance: Radiance::Overcast(*sky), polarization: None }),
        _ => bail!("{SCENE}: the sky is not overcast"),
    };
    let [r, g, b] = scene.light.bands.each_ref().map(|sky| band(&sky.radiance));
    let half = 0.5 * scene.sample.side_m;
    Ok(Session {
        views: scene.views.iter().zip(images).enumerate().map(view).collect::<Result<_>>()?,
        light: LightSpec { bands: [r?, g?, b?], sun: None, photograph_sigma: None },
        sample: Sample { x: [-half, half], y: [-half, half] },
        strip: None,
    })
}

/// Times `scale`, with noise.
#[expect(clippy::cast_possible_truncation, reason = "images are f32")]
fn noisy(image: &StokesImage, scale: f64, seed: u64) -> StokesImage {
    let mut random = SmallRng::seed_from_u64(seed);
    let mut normal = || -> f64 { random.sample(StandardNormal) };
    let mut image = image.clone();
    for color in &mut image.colors {
        for ((s0, s1), s2) in color.s0.iter_mut().zip(&mut color.s1).zip(&mut color.s2) {
            let sigma = NOISE * scale * f64::from(*s0);
            for (s, share) in [(s0, 1.0), (s1, core::f64::consts::SQRT_2), (s2, core::f64::consts::SQRT_2)] {
                *s = (scale * f64::from(*s) + share * sigma * normal()) as f32;
            }
        }
    }
    image
}

/// The section.
pub(super) fn text(inks: &[Ink]) -> String {
    let mut text = format!(
        "`{SCENE}` is a *simulated* print: black, blue and yellow ink on coated paper under an overcast sky, two views at 57° a \
         quarter turn apart and one at 10°, {:.1} % of noise; the paper photographed a real one, so the last column is no \
         competitor. `casing` is the same fit with a light that was measured on a reference of η {} taken for {}, as the paper \
         may have: it is what moves an index down by what the paper's blue and yellow are low.\n\n\
         | ink | true η | η: median | σ of a pixel | casing | true α | α: median | σ of a pixel | answered | the paper \
         reads | its reference |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
        100.0 * NOISE,
        CASING[1],
        CASING[0]
    );
    for ink in inks {
        let Ink { name, truth: [eta, alpha], found, casing, samples, answered } = ink;
        let [found_eta, found_alpha, sigma_eta, sigma_alpha] = found;
        let paper = PAPER.iter().find(|(ink, ..)| ink == name);
        let (reads, reference) = paper.map_or(("–".to_owned(), "–"), |(_, reads, of)| (format!("{reads:.2}"), *of));
        let _ = writeln!(
            text,
            "| {name} | {eta:.3} | {found_eta:.3} | {sigma_eta:.3} | {casing:.3} | {alpha:.2} | {found_alpha:.3} | \
             {sigma_alpha:.3} | {answered} of {samples} | {reads} | {reference} |"
        );
    }
    text
}
