//! `brewster calibrate`: the camera's dark map and flat field.

use std::ops::ControlFlow;

use clap::{Args, ValueEnum};
use protocol_wire::Calibrate as Request;
use serde_json::json;

use crate::camera::{DeviceArgs, link_failure};
use crate::failure::Failure;
use crate::terminal::{Outcome, Terminal};

/// Take the camera's dark map or flat field, or forget both
///
/// The dark map is taken at the exposure of the last capture, the flat field at one that is metered. The maps correct every
/// capture from then on, until they are cleared or the camera is switched off.
#[derive(Args)]
pub(crate) struct Calibrate {
    /// dark: with the lens capped; flat: before an evenly lit white; clear: forget both
    what: What,
    #[command(flatten)]
    device: DeviceArgs,
    /// Pictures to average
    #[arg(long, value_name = "1..16", default_value = "8", value_parser = clap::value_parser!(u8).range(1..=16))]
    frames: u8,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    Dark,
    Flat,
    Clear,
}

impl Calibrate {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let mut opened = self.device.open()?;
        let name = opened.name();
        let frames = self.frames;
        let (request, done) = match self.what {
            What::Dark => (Request::Dark { frames }, "dark map taken; captures are corrected with it"),
            What::Flat => (Request::Flat { frames }, "flat field taken; captures are corrected with it"),
            What::Clear => (Request::Clear, "dark map and flat field forgotten"),
        };
        let progress = terminal.progress(usize::from(frames) + 1, "calibrating");
        let result = opened.client.calibrate(request, |news| {
            if let Some(news) = news {
                progress.set_position(u64::from(news.done));
            }
            ControlFlow::Continue(())
        });
        progress.finish_and_clear();
        opened.tell_warnings(terminal);
        result.map_err(|error| link_failure(&error, &name))?;
        let text = format!("{done}\n");
        let json = json!({ "command": "calibrate", "done": done, "warnings": terminal.warnings() });
        Ok(Outcome { brief: text.clone(), text, json })
    }
}
