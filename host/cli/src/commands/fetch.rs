//! `brewster fetch`: captures that a camera has kept.

use clap::Args;
use protocol_wire::{CaptureId, CaptureState};
use serde_json::json;

use crate::camera::{Delivery, DeliveryArgs, DeviceArgs, deliver, link_failure, receive};
use crate::failure::Failure;
use crate::output::{OutputArgs, OutputFolder};
use crate::terminal::{Outcome, Terminal};

/// Get a capture that a camera has kept, or list what it holds
///
/// A camera keeps every capture until it has been fetched whole: after a broken cable or a crash, nothing is lost.
#[derive(Args)]
pub(crate) struct Fetch {
    #[command(flatten)]
    device: DeviceArgs,
    /// Number of the capture; without it, the captures are listed
    #[arg(value_name = "NUMBER")]
    id: Option<u32>,
    #[command(flatten)]
    delivery: DeliveryArgs,
    #[command(flatten)]
    output: OutputArgs,
}

impl Fetch {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let mut opened = self.device.open()?;
        let Some(id) = self.id else {
            let name = opened.name();
            let captures = opened.client.list().map_err(|error| link_failure(&error, &name))?;
            let mut text: String = captures
                .iter()
                .map(|c| {
                    let state = if c.state == CaptureState::Complete { "complete" } else { "running" };
                    format!("{:>6}  {} frames  {:>8.2} MB  {state}\n", c.id.0, c.frames, c.bytes as f64 / 1e6)
                })
                .collect();
            if text.is_empty() {
                text = format!("{name} holds no captures\n");
            }
            let list: Vec<_> =
                captures.iter().map(|c| json!({ "capture": c.id.0, "frames": c.frames, "bytes": c.bytes })).collect();
            return Ok(Outcome { brief: text.clone(), text, json: json!({ "command": "fetch", "captures": list }) });
        };
        let folder = OutputFolder::prepare(&self.output, &format!("capture-{}", opened.client.identity().serial))?;
        let received = receive(&mut opened, CaptureId(id), self.delivery.needs_raw(), terminal)?;
        let title = format!("Capture {id} of {}", opened.client.identity().board);
        let delivery = Delivery {
            command: "fetch",
            title: (&title, "Intensity, degree and angle of linear polarization, computed in the camera."),
            args: &self.delivery,
            extra: None,
        };
        deliver(&mut opened, &received, folder, &delivery, terminal)
    }
}
