//! `brewster simulate`: from a scene file to Stokes images, ground truth and raw frames.

mod explain;
mod files;
mod views;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Instant;

use clap::Args;
use host_image::StokesImage;
use host_sim::frames::{Exposer, FramePlan, FrameSpec, true_difference};
use host_sim::simulate::{Simulation, noise_of, simulate};
use host_sim::{Effect, EffectSet, Facts, Scene, SimError};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::scenes::{Tolerance, refused};
use crate::terminal::{Outcome, Terminal};

/// Simulate what a camera sees of a scene: noise-free Stokes images, ground truth, raw frames
///
/// A scene file (TOML) says what is looked at, from where, in what light and with which camera. Only the effects that can
/// matter at the tolerance are simulated; each has a proved bound of what leaving it out changes. Writes a folder for each view
/// with stokes.exr, previews, a page to look at (report.html), maps of the truth (truth/*.exr) and, with --frames, what the
/// camera would have stored; beside them views.json with cameras, light and exposures for whoever fits the pictures.
#[derive(Args)]
pub(crate) struct Simulate {
    /// The scene file
    scene: PathBuf,
    /// Which view, counted from 0, or all
    #[arg(long, value_name = "N|all", default_value = "all")]
    view: Views,
    /// Largest error of s0, s1 and s2 against the full simulation, as a share of s0: a number, or a part of this camera's noise
    ///
    /// Time grows steeply below 0.0005: noise/10 of an ordinary camera is about 0.0001.
    #[arg(long, value_name = "T|noise|noise/N", default_value_t)]
    tolerance: Tolerance,
    /// Print which effects are simulated, and why
    #[arg(long)]
    explain: bool,
    /// Also make the full simulation, and one without each effect, and say how far apart they are
    #[arg(long)]
    verify: bool,
    /// Also write raw frames, as the camera would have stored them: 16-bit PNG for brewster stokes
    #[arg(long)]
    frames: bool,
    /// Another number of pixels than the scene's camera has, with the same lens and width of the sensor
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Which views.
#[derive(Clone, Copy)]
enum Views {
    All,
    One(usize),
}

/// Of a picture.
#[derive(Clone, Copy)]
struct Size {
    width: u16,
    height: u16,
}

/// One view, done.
struct View {
    index: usize,
    simulation: Simulation,
    /// The frames of the plan, whether they are written or not; none where there is no light to expose for.
    schedule: Vec<FrameSpec>,
    frames: Option<Frames>,
}

/// The frames of a view.
struct Frames {
    plan: FramePlan,
    verified: Option<FrameVerification>,
}

impl FromStr for Views {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self::All);
        }
        text.parse().map(Self::One).map_err(|_| "expected a number from 0, or all".to_owned())
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |t: &str| t.parse::<u16>().ok().filter(|n| (1..=16384).contains(n));
        let sides = text.split_once('x').and_then(|(w, h)| Some(Self { width: side(w)?, height: side(h)? }));
        sides.ok_or_else(|| "expected columns x rows, such as 640x480, each 1 to 16384".to_owned())
    }
}

impl Simulate {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let mut scene = Scene::read(&self.scene).map_err(|e| refused(&self.scene, &e))?;
        if let Some(Size { width, height }) = self.size {
            scene = scene.resized(width, height);
        }
        let tolerance = self.tolerance.of(&scene);
        let chosen: Vec<usize> = match self.view {
            Views::All => (0..scene.views.len()).collect(),
            Views::One(view) if view < scene.views.len() => vec![view],
            Views::One(view) => {
                let error = SimError::NoView { view, views: scene.views.len() };
                return Err(Failure::new(Exit::Usage, error.to_string(), "Choose one of them with --view."));
            }
        };
        let name = self.scene.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned());
        let folder = OutputFolder::prepare(&self.output, &name)?;
        let mut views = Vec::new();
        let progress = terminal.progress(chosen.len(), "simulating");
        for index in chosen {
            views.push(self.view(&scene, index, tolerance, &folder, terminal)?);
            progress.inc(1);
        }
        progress.finish_and_clear();
        self.outcome(&scene, tolerance, &views, folder, terminal)
    }

    /// Simulates a view and writes its folder.
    fn view(
        &self,
        scene: &Scene,
        index: usize,
        tolerance: f64,
        folder: &OutputFolder,
        terminal: &Terminal,
    ) -> Result<View, Failure> {
        let failed = |e: SimError| refused(&self.scene, &e);
        let simulation = simulate(scene, index, tolerance, self.verify).map_err(failed)?;
        let schedule = match Exposer::new(scene, index, &simulation.image, EffectSet::NONE) {
            Ok(exposer) => exposer.frames().to_vec(),
            Err(SimError::NoLight) if !self.frames => Vec::new(),
            Err(error) => return Err(failed(error)),
        };
        let mut exposer = None;
        let frames = if self.frames {
            let facts = Facts::new(scene, index, &simulation.image).map_err(failed)?;
            let plan = FramePlan::new(&facts, tolerance);
            let made = Exposer::new(scene, index, &simulation.image, plan.effects).map_err(failed)?;
            let verified =
                if self.verify { Some(verify(scene, index, &simulation.image, &plan).map_err(failed)?) } else { None };
            exposer = Some(made);
            Some(Frames { plan, verified })
        } else {
            None
        };
        let view = View { index, simulation, schedule, frames };
        files::write(scene, &view, exposer.as_ref(), folder, terminal)?;
        Ok(view)
    }

    fn outcome(
        &self,
        scene: &Scene,
        tolerance: f64,
        views: &[View],
        folder: OutputFolder,
        terminal: &Terminal,
    ) -> Result<Outcome, Failure> {
        let json = json!({
            "command": "simulate",
            "version": env!("CARGO_PKG_VERSION"),
            "scene": self.scene,
            "name": scene.name,
            "width": scene.camera.width_px,
            "height": scene.camera.height_px,
            "tolerance": tolerance,
            "camera_noise": noise_of(scene),
            "black_dn": scene.camera.black_level_dn,
            "white_dn": scene.camera.white_level_dn(),
            "angles_deg": scene.plan.angles.iter().map(|a| explain::degrees(*a)).collect::<Vec<_>>(),
            "views": views.iter().map(explain::json).collect::<Vec<Value>>(),
            "warnings": terminal.warnings(),
        });
        views::write(scene, views, &folder)?;
        let json = folder.commit(json)?;
        let output = json.get("output").and_then(|o| o.as_str()).unwrap_or_default().to_owned();
        let mut text = format!("{:<20} {}\n", "scene", scene.name);
        for (name, value) in explain::facts(scene, tolerance) {
            text.push_str(&format!("{name:<20} {value}\n"));
        }
        for view in views {
            text.push('\n');
            text.push_str(&explain::summary(view));
            if self.explain {
                text.push_str(&explain::table(view));
            }
        }
        text.push_str(&format!("\n{output}\n"));
        for view in views {
            text.push_str(&files::places(view, &output, scene));
        }
        Ok(Outcome { text, brief: format!("{output}\n"), json })
    }
}

/// What the frames' effects really do and cost.
struct FrameVerification {
    /// True difference of the planned frames from those with all effects.
    worst: f64,
    /// What each effect by itself changes, and the time in ns per pixel of a frame that it takes among all; in the plan's order,
    /// `None` where the scene does not have it.
    alone: Vec<Option<(f64, f64)>>,
}

fn verify(scene: &Scene, index: usize, image: &StokesImage, plan: &FramePlan) -> Result<FrameVerification, SimError> {
    let all = EffectSet::ALL;
    let time = |effects| -> Result<f64, SimError> {
        let start = Instant::now();
        let exposer = Exposer::new(scene, index, image, effects)?;
        let frames = exposer.frames().len();
        (0..frames).for_each(|frame| drop(exposer.dn(frame)));
        Ok(1e9 * start.elapsed().as_secs_f64() / (frames * image.width * image.height) as f64)
    };
    let full = time(all)?;
    let alone = plan.rows.iter().map(|row| {
        // By itself, as its bound is: among all, a changed signal would also be another draw of noise and another rounding.
        // Photosites are compared under their own filters, but for the filters themselves.
        let mosaic = EffectSet::NONE.with(Effect::Bayer);
        let (base, alone) = (mosaic.without(row.effect), mosaic.with(row.effect));
        let difference = || true_difference(scene, index, image, base, alone);
        let one = || Ok((difference()?, full - time(all.without(row.effect))?));
        row.assessment.applies.then(one).transpose()
    });
    let alone = alone.collect::<Result<_, SimError>>()?;
    Ok(FrameVerification { worst: true_difference(scene, index, image, plan.effects, all)?, alone })
}
