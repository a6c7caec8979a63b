//! `brewster simulate`: from a scene file to Stokes images, ground truth and raw frames.

mod explain;
mod files;

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use host_sim::frames::{Exposer, FramePlan, true_difference};
use host_sim::simulate::{Simulation, noise_of, simulate};
use host_sim::{EffectSet, Facts, Scene, SimError};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::terminal::{Outcome, Terminal};

/// Simulate what a camera sees of a scene: noise-free Stokes images, ground truth, raw frames
///
/// A scene file (TOML) says what is looked at, from where, in what light and with which camera. Only the effects that can
/// matter at the tolerance are simulated; each has a proved bound of what leaving it out changes. Writes a folder for each view
/// with stokes.exr, previews, a page to look at (report.html), maps of the truth (truth/*.exr) and, with --frames, what the
/// camera would have stored.
#[derive(Args)]
pub(crate) struct Simulate {
    /// The scene file
    scene: PathBuf,
    /// Which view, counted from 0, or all
    #[arg(long, value_name = "N|all", default_value = "all")]
    view: Views,
    /// Largest error of s0, s1 and s2 against the full simulation, as a share of s0: a number, or a part of this camera's noise
    ///
    /// Time grows steeply below 0.005: noise/10 of an ordinary camera is about 0.0001.
    #[arg(long, value_name = "T|noise|noise/N", default_value = "0.005")]
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

/// How exact.
#[derive(Clone, Copy)]
enum Tolerance {
    Share(f64),
    /// The camera's noise divided by this.
    Noise(f64),
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
    frames: Option<Frames>,
}

/// The frames of a view.
struct Frames {
    plan: FramePlan,
    exposures_us: Vec<f64>,
    count: usize,
    /// Of the planned frames, and of those without one effect, against those with all.
    verified: Option<(f64, Vec<f64>)>,
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

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected a number above 0 and at most 1, noise, or noise/10".to_owned();
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite()).ok_or_else(wrong);
        match text.strip_prefix("noise") {
            Some("") => Ok(Self::Noise(1.0)),
            Some(part) => part.strip_prefix('/').ok_or_else(wrong).and_then(number).map(Self::Noise),
            None => number(text).and_then(|v| if v <= 1.0 { Ok(Self::Share(v)) } else { Err(wrong()) }),
        }
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
        let tolerance = match self.tolerance {
            Tolerance::Share(share) => share,
            Tolerance::Noise(part) => (noise_of(&scene) / part).min(1.0),
        };
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
        let mut exposer = None;
        let frames = if self.frames {
            let facts = Facts::new(scene, index, &simulation.image).map_err(failed)?;
            let plan = FramePlan::new(&facts, tolerance);
            let made = Exposer::new(scene, index, &simulation.image, plan.effects).map_err(failed)?;
            let exposures_us = made.frames().iter().map(|f| f.exposure_us).collect();
            let verified =
                if self.verify { Some(verify(scene, index, &simulation, &plan).map_err(failed)?) } else { None };
            let count = made.frames().len();
            exposer = Some(made);
            Some(Frames { plan, exposures_us, count, verified })
        } else {
            None
        };
        let view = View { index, simulation, frames };
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

/// True differences of the planned frames, and of frames without one effect (0 where the scene does not have it).
fn verify(scene: &Scene, index: usize, simulation: &Simulation, plan: &FramePlan) -> Result<(f64, Vec<f64>), SimError> {
    let all = EffectSet::all();
    let against = |effects| true_difference(scene, index, &simulation.image, effects, all);
    let alone = plan.rows.iter().map(|r| if r.assessment.applies { against(all.without(r.effect)) } else { Ok(0.0) });
    Ok((against(plan.effects)?, alone.collect::<Result<_, _>>()?))
}

/// A scene that was refused, with what to do.
fn refused(scene: &std::path::Path, error: &SimError) -> Failure {
    let advice = match error {
        SimError::Io { .. } => "Check the name and the folder you are in.",
        SimError::UnknownSchema { .. } => "Write the scene for the schema this brewster reads, or use another version.",
        SimError::UnknownKey { .. } => "Correct the key, or take the line out: nothing in a scene is ignored.",
        SimError::Map { .. } => "Maps are looked for in the scene's own folder: check the name and the file.",
        SimError::Parse { .. }
        | SimError::UnknownValue { .. }
        | SimError::OutOfRange { .. }
        | SimError::Optics { .. } => "Correct this line of the scene.",
        SimError::NotSimulated { .. } => "Change the scene: leaving it out silently would make another scene.",
        SimError::NoLight => "Check the light of the scene, and that the view sees the sample.",
        _ => "",
    };
    // These carry no place of their own.
    let what = match error {
        SimError::NotSimulated { .. } | SimError::NoLight => format!("{}: {error}", scene.display()),
        _ => error.to_string(),
    };
    Failure::new(Exit::BadInput, what, advice)
}
