//! `brewster render`: fitted maps under another light, from another side.

pub(super) mod arguments;
mod light;
mod view;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use host_fit::forward::Body;
use host_fit::maps::{MapsError, MaterialMaps, Plane};
use host_fit::relight::{Exposure, RelightError, RelightOptions, Relit, Sight, display, relight};
use host_image::{ImageError, Picture};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::pictures;
use crate::report::{Figure, Report};
use crate::terminal::{Outcome, Terminal};
pub(crate) use light::LightArgs;
pub(crate) use view::ViewArgs;

/// Show fitted maps under another light: an environment map, an analytic sky, a sun
///
/// Reads material.exr as brewster fit writes it. Writes render.png (exposed for the screen; what has no answer is hatched,
/// never filled), stokes.exr (linear radiance s0, s1, s2 of R, G, B), previews of degree and angle of polarization, a page to
/// look at (report.html) and the record brewster.json.
#[derive(Args)]
pub(crate) struct Render {
    /// Maps that brewster fit made
    material: PathBuf,
    #[command(flatten)]
    light: LightArgs,
    #[command(flatten)]
    view: ViewArgs,
    /// What the diffuse part is [default: what the maps were fitted with]
    #[arg(long, value_enum, value_name = "KIND")]
    body: Option<BodyKind>,
    /// Rays per side of a pixel, averaged over its area
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=8))]
    rays: u8,
    /// Show only samples without any reason against them
    #[arg(long)]
    strict: bool,
    /// Stops brighter than an exposure that clips one pixel in 200
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = arguments::finite)]
    exposure: f64,
    /// Radiance that is white in render.png, instead
    #[arg(long, value_name = "RADIANCE", value_parser = arguments::positive, conflicts_with = "exposure")]
    white: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Where light that enters the body comes out again.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum BodyKind {
    /// Unpolarized, the same in all directions
    Lambert,
    /// Through the interface both ways, partly polarized
    Interface,
}

impl Render {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let maps = MaterialMaps::load_exr(&self.material).map_err(|e| not_maps(&e))?;
        let metals = maps.plane(Plane::Eta).iter().filter(|eta| **eta < 0.0).count();
        if metals > 0 {
            terminal.warn(format!("{metals} samples are metals, whose index is not in the maps: they are hatched"));
        }
        let light = self.light.light()?;
        let (camera, view_words) = self.view.camera(&maps)?;
        let options = RelightOptions {
            body: self.body(&maps),
            rays: self.rays,
            refuse: if self.strict { u32::MAX } else { 0 },
            ..RelightOptions::default()
        };
        let folder = OutputFolder::prepare(&self.output, "render")?;
        let progress = terminal.progress(1, "rendering");
        let start = Instant::now();
        let relit = relight(&maps, &camera, &light, &options).map_err(|e| failed(&e))?;
        let seconds = start.elapsed().as_secs_f64();
        progress.finish_and_clear();
        let exposure = self.white.map_or(Exposure::Auto { stops: self.exposure }, Exposure::White);
        let (picture, white) = display(&relit, exposure).map_err(|e| pictures::failed(&folder, &e))?;

        let facts = facts(&relit, &[("light", self.light.words()), ("view", view_words)], white);
        let figures = write(&relit, &picture, &folder, terminal)?;
        let title = "Fitted material under another light";
        let mut report =
            Report::new(title, "Paper eq. 6 at every pixel, with the roughness, index, normal and albedo of the maps.");
        terminal.warnings().into_iter().for_each(|text| report.warning(text));
        facts.iter().for_each(|(name, value)| report.fact(*name, value));
        figures.into_iter().for_each(|figure| report.figure(figure));
        pictures::write_report(&report, &folder)?;

        let json = json!({
            "command": "render",
            "version": env!("CARGO_PKG_VERSION"),
            "material": self.material,
            "light": self.light.words(),
            "body": if options.body == Body::Lambert { "lambert" } else { "interface" },
            "width": relit.image.width,
            "height": relit.image.height,
            "white": white,
            "pixels": {
                "material": relit.count(Sight::Material),
                "unanswered": relit.count(Sight::Unanswered),
                "beyond": relit.count(Sight::Beyond),
            },
            "samples_outside_table": relit.held,
            "table_error": relit.table.map(|t| json!({ "median": t.error[0], "percentile_95": t.error[1], "worst": t.error[2] })),
            "seconds": seconds,
            "warnings": terminal.warnings(),
        });
        let json = folder.commit(json)?;
        let output = json.get("output").and_then(Value::as_str).unwrap_or_default().to_owned();
        let mut text: String = facts.iter().map(|(name, value)| format!("{name:<20} {value}\n")).collect();
        text.push_str(&pictures::places(&output, false));
        let shown = std::path::Path::new(&output).join("render.png");
        text.push_str(&format!("  {:<40} the picture, exposed for the screen\n", shown.display()));
        Ok(Outcome { text, brief: format!("{output}\n"), json })
    }

    /// As asked for, else as the maps say, else Lambert.
    fn body(&self, maps: &MaterialMaps) -> Body {
        let fitted = || match maps.attributes.get("body").map(String::as_str) {
            Some("interface") => BodyKind::Interface,
            _ => BodyKind::Lambert,
        };
        match self.body.unwrap_or_else(fitted) {
            BodyKind::Lambert => Body::Lambert,
            BodyKind::Interface => Body::Interface,
        }
    }
}

/// Writes `render.png`, `stokes.exr` and its previews.
pub(crate) fn write(
    relit: &Relit,
    picture: &Picture,
    folder: &OutputFolder,
    terminal: &Terminal,
) -> Result<Vec<Figure>, Failure> {
    let path = folder.path().join("render.png");
    picture.write_png(&path).map_err(|e| pictures::failed(folder, &e))?;
    let png = std::fs::read(path).map_err(|e| pictures::unwritable(folder, &e))?;
    let mut figures = vec![Figure {
        title: "Rendering".into(),
        caption: "Exposed for the screen. Dark grey: beside the sample. Purple hatch: no answer in the maps.".into(),
        png,
    }];
    figures.extend(pictures::write(&relit.image, folder, None, terminal)?);
    Ok(figures)
}

/// What is said of a rendering.
pub(crate) fn facts(relit: &Relit, given: &[(&'static str, String)], white: f64) -> Vec<(&'static str, String)> {
    let share = |sight| 100.0 * relit.count(sight) as f64 / relit.sight.len() as f64;
    let mut facts = given.to_vec();
    facts.push(("picture", format!("{} x {} pixels", relit.image.width, relit.image.height)));
    facts.push(("exposure", format!("radiance {white:.4} is white in render.png; brighter is clipped")));
    facts.push(("on the sample", format!("{:.2} % of the pixels", share(Sight::Material))));
    facts.push(("without an answer", format!("{:.2} % of the pixels, hatched", share(Sight::Unanswered))));
    if let Some(table) = relit.table {
        let [median, most, worst] = table.error.map(|e| 100.0 * e);
        facts.push((
            "error of the sky",
            format!("{median:.2} % of s0 in the median, {most:.2} % for one in twenty, {worst:.1} % at worst"),
        ));
    }
    if relit.held > 0 && relit.table.is_some() {
        let text = format!("{} samples of the maps, drawn with the nearest material inside", relit.held);
        facts.push(("outside the table", text));
    }
    facts
}

/// A file that is no map of material.
pub(crate) fn not_maps(error: &MapsError) -> Failure {
    match error {
        MapsError::Image(image @ (ImageError::Missing { .. } | ImageError::Unsupported { .. })) => {
            let advice =
                "Name the material.exr that brewster fit wrote: it has albedo, eta, alpha and normals of a sample.";
            Failure::new(Exit::BadInput, format!("not a map of material: {image}"), advice)
        }
        MapsError::Image(image) => Failure::reading(image),
        other => Failure::new(Exit::BadInput, other.to_string(), ""),
    }
}

/// A rendering that was refused.
pub(crate) fn failed(error: &RelightError) -> Failure {
    let (exit, advice) = match error {
        RelightError::NoLight => (
            Exit::BadInput,
            "The map's upper half lights the sample (zenith up), the lower never does: check the map, or add --sun or --sky.",
        ),
        RelightError::NoMaterial { .. } => {
            (Exit::BadInput, "Leave out --strict. Maps of the closed forms have no roughness: fit with --mode joint.")
        }
        RelightError::NothingSeen => {
            (Exit::BadInput, "The camera belongs to another sample: leave out --camera, or choose --view.")
        }
        RelightError::View(_) => {
            (Exit::Usage, "Choose --view THETA,PHI with THETA from 0 (straight above) to below 89 degrees.")
        }
        RelightError::SunBelowHorizon { .. } => {
            (Exit::Usage, "Choose --sun AZIMUTH,ELEVATION with an elevation above 0 to 90.")
        }
        RelightError::NoSun { .. } => {
            (Exit::Usage, "Add --sun AZIMUTH,ELEVATION; with an irradiance of 0 its disk stays dark.")
        }
        RelightError::Number { .. } | RelightError::Optics(_) | RelightError::Rays { .. } => {
            (Exit::BadInput, "Correct this number of the light.")
        }
        RelightError::Image(image) => return Failure::reading(image),
        RelightError::Maps(maps) => return not_maps(maps),
        _ => (Exit::BadInput, ""),
    };
    Failure::new(exit, error.to_string(), advice)
}
