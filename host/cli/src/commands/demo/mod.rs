//! `brewster demo`: the whole way once, without a camera.

mod session;
mod stone;

use std::path::Path;

use clap::Args;
use firmware_emulator::{Source, wheel_chart};
use host_image::StokesImage;
use protocol_polar::{Flags, Stokes};
use protocol_wire::{CaptureRequest, Exposure};
use serde_json::{Value, json};

use super::capture::take;
use crate::camera::{Delivery, DeliveryArgs, DeviceArgs, deliver, receive};
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::terminal::{Outcome, Terminal};

/// Show the whole way without a camera: capture, verification and pictures; then fit and rendering of a simulated stone
///
/// The camera's real firmware looks at a wheel of polarizer film whose answer is known: the angle of polarization is the
/// direction one looks in from the hub. Writes what `brewster capture` writes, and how far it is from the truth. Then frames
/// of a stone under a polarized sky are simulated, its material fitted, put under another sun, and compared with the truth:
/// all in the folder stone.
#[derive(Args)]
pub(crate) struct Demo {
    #[command(flatten)]
    output: OutputArgs,
}

impl Demo {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let folder = OutputFolder::prepare(&self.output, "demo")?;
        let mut opened = DeviceArgs::emulated(Source::WheelChart).open()?;
        let identity = opened.client.identity();
        let request = CaptureRequest {
            frames: identity.default_frames.clone(),
            exposure: Exposure::Auto,
            word: identity.default_word,
            keep_raw: true,
        };
        let truth = wheel_chart(identity.sensor.width, identity.sensor.height);
        let id = take(&mut opened, request, terminal)?;
        let received = receive(&mut opened, id, true, terminal)?;
        let stone = stone::run(&folder.path().join("stone"), terminal)?;
        let extra = |image: &StokesImage| {
            let (mut facts, mut json) = against_truth(image, &truth);
            facts.extend(stone.facts.iter().cloned());
            if let Some(object) = json.as_object_mut() {
                object.insert("stone".into(), stone.json.clone());
            }
            (facts, json)
        };
        let delivery = Delivery {
            command: "demo",
            title: (
                "A polarizer wheel, seen by the emulated camera",
                "Twelve sectors of polarizer film: the angle of polarization is the direction one looks in from the hub, the \
                 degree falls in four rings towards it. Around it unpolarized grey, a wedge, a black patch, and three specular \
                 spots that clip.",
            ),
            args: &DeliveryArgs { verify: true, raw: false, keep: false },
            extra: Some(&extra),
        };
        let mut outcome = deliver(&mut opened, &received, folder, &delivery, terminal)?;
        let output = outcome.json.get("output").and_then(Value::as_str).unwrap_or_default();
        let page = Path::new(output).join("stone").join("report.html");
        let line = format!("  {:<40} the stone: maps, renderings and errors\n{}", page.display(), stone.text);
        outcome.text.push_str(&line);
        Ok(outcome)
    }
}

/// How far the picture is from the chart, where the chart is polarized and nothing clipped.
fn against_truth(image: &StokesImage, truth: &[[f32; 3]]) -> (Vec<(&'static str, String)>, Value) {
    let (mut aolp_deg, mut dolp) = (Vec::new(), Vec::new());
    for planes in &image.colors {
        let flags = planes.flags.as_deref().unwrap_or_default();
        let seen = planes.s0.iter().zip(&planes.s1).zip(&planes.s2).zip(flags);
        for ((((s0, s1), s2), flags), truth) in seen.zip(truth) {
            let truth = stokes(truth[0], truth[1], truth[2]);
            if truth.dolp() < 0.1 || Flags(*flags).contains(Flags::SATURATED) {
                continue;
            }
            let seen = stokes(*s0, *s1, *s2);
            aolp_deg.push(seen.aolp().axis_difference(truth.aolp()).to_degrees().0);
            dolp.push(seen.dolp() - truth.dolp());
        }
    }
    let (aolp, dolp) = (summary(aolp_deg), summary(dolp));
    let facts = vec![
        ("AoLP error", format!("{:.2}\u{b0} rms per photosite, {:+.3}\u{b0} in the mean", aolp.rms, aolp.mean)),
        ("DoLP error", format!("{:.4} rms per photosite, {:+.4} in the mean", dolp.rms, dolp.mean)),
    ];
    let json = json!({
        "aolp_error_deg": { "rms": aolp.rms, "mean": aolp.mean },
        "dolp_error": { "rms": dolp.rms, "mean": dolp.mean },
    });
    (facts, json)
}

fn stokes(s0: f32, s1: f32, s2: f32) -> Stokes {
    Stokes([s0.into(), s1.into(), s2.into(), 0.0])
}

#[derive(Default)]
struct Summary {
    rms: f64,
    mean: f64,
}

fn summary(errors: Vec<f64>) -> Summary {
    let count = errors.len().max(1) as f64;
    let mean = errors.iter().sum::<f64>() / count;
    Summary { mean, rms: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt() }
}
