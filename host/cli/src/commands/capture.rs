//! `brewster capture`: take a capture with a camera, fetch it, check it, write it.

use std::ops::ControlFlow;

use clap::{Args, ValueEnum};
use protocol_polar::MAX_FRAMES;
use protocol_wire::{CaptureId, CaptureRequest, Exposure, FrameRequest, Stage, Word};

use crate::camera::{Delivery, DeliveryArgs, DeviceArgs, Opened, deliver, link_failure, receive};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::terminal::{Outcome, Terminal};

/// Take a capture with a camera and write its Stokes image
///
/// The camera turns its polarizer to each angle, exposes, computes the Stokes image itself and sends it; every strip is
/// verified. Writes stokes.exr, previews, a page to look at (report.html) and the record brewster.json; then the camera may
/// forget the capture.
#[derive(Args)]
pub(crate) struct Capture {
    #[command(flatten)]
    device: DeviceArgs,
    /// Polarizer angles, degrees counter-clockwise from horizontal; repeat one to average [default: the camera's own set]
    #[arg(long, value_name = "DEG,DEG,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = axis)]
    angles: Option<Vec<f64>>,
    /// Exposure of each frame in ms, or auto: metered at every angle, locked so that none clips
    #[arg(long, value_name = "MS|auto", default_value = "auto", value_parser = exposure)]
    exposure: Exposure,
    /// Word of the Stokes planes: 16 bits are half the bytes, 32 bits round far below any noise [default: the camera's own]
    #[arg(long)]
    word: Option<WordArg>,
    #[command(flatten)]
    delivery: DeliveryArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum WordArg {
    I16,
    I32,
}

impl Capture {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let mut opened = self.device.open()?;
        let request = self.request(&opened)?;
        let raw = request.keep_raw;
        // What cannot be written is said before anything moves.
        let folder = OutputFolder::prepare(&self.output, &format!("capture-{}", opened.client.identity().serial))?;
        let id = take(&mut opened, request, terminal)?;
        let received = receive(&mut opened, id, raw, terminal)?;
        let title = format!("Capture {} of {}", id.0, opened.client.identity().board);
        let delivery = Delivery {
            command: "capture",
            title: (&title, "Intensity, degree and angle of linear polarization, computed in the camera."),
            args: &self.delivery,
            extra: None,
        };
        deliver(&mut opened, &received, folder, &delivery, terminal)
    }

    fn request(&self, opened: &Opened) -> Result<CaptureRequest, Failure> {
        let identity = opened.client.identity();
        let frames = match &self.angles {
            None => identity.default_frames.clone(),
            Some(angles) => {
                let frames = angles.iter().map(|angle| FrameRequest { angle_deg: *angle, exposure_ratio: 1.0 });
                if angles.len() > MAX_FRAMES {
                    let what = format!("{} angles; a capture has at most {MAX_FRAMES} frames", angles.len());
                    return Err(Failure::new(Exit::Usage, what, "Leave some out, or take several captures."));
                }
                frames.collect()
            }
        };
        let word = match self.word {
            None => identity.default_word,
            Some(WordArg::I16) => Word::I16,
            Some(WordArg::I32) => Word::I32,
        };
        Ok(CaptureRequest { frames, exposure: self.exposure, word, keep_raw: self.delivery.needs_raw() })
    }
}

/// Takes a capture and shows how far it is.
pub(crate) fn take(opened: &mut Opened, request: CaptureRequest, terminal: &Terminal) -> Result<CaptureId, Failure> {
    let name = opened.name();
    let progress = terminal.progress(1, "starting");
    let result = opened.client.capture(request, |news| {
        if let Some(news) = news {
            progress.set_length(u64::from(news.total));
            progress.set_position(u64::from(news.done));
            progress.set_message(match news.stage {
                Stage::Metering => "metering",
                Stage::Exposing => "exposing",
                Stage::Computing => "computing",
                Stage::Calibrating => "calibrating",
            });
        }
        ControlFlow::Continue(())
    });
    progress.finish_and_clear();
    opened.tell_warnings(terminal);
    result.map_err(|error| link_failure(&error, &name))
}

fn axis(text: &str) -> Result<f64, String> {
    let angle = text.trim().parse().ok().filter(|angle: &f64| angle.abs() <= 3600.0);
    angle.ok_or_else(|| "expected an angle in degrees, -3600 to 3600".to_owned())
}

fn exposure(text: &str) -> Result<Exposure, String> {
    if text.eq_ignore_ascii_case("auto") {
        return Ok(Exposure::Auto);
    }
    let wrong = || "expected a time in ms from 0.001 to 4000000, or auto".to_owned();
    let us = text.trim().parse::<f64>().map_err(|_| wrong())? * 1000.0;
    if !(1.0..=4e9).contains(&us) {
        return Err(wrong());
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range was checked")]
    Ok(Exposure::Fixed(us.round() as u32))
}
