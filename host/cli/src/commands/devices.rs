//! `brewster devices`: the cameras within reach.

use clap::Args;
use host_link::{LinkError, usb};
use serde_json::json;

use crate::camera::link_failure;
use crate::failure::Failure;
use crate::terminal::{Outcome, Terminal};

/// List the cameras within reach
#[derive(Args)]
pub(crate) struct Devices {}

impl Devices {
    pub(crate) fn run(&self, terminal: &Terminal) -> Result<Outcome, Failure> {
        let found = match usb::list() {
            Ok(found) => found,
            // A machine without USB is a machine without cameras on USB.
            Err(LinkError::Usb(error)) => {
                terminal.warn(format!("USB cannot be looked at: {error}"));
                Vec::new()
            }
            Err(error) => return Err(link_failure(&error, "usb")),
        };
        let mut text = String::new();
        for camera in &found {
            let name = camera.serial.as_ref().map_or_else(|| "usb".to_owned(), |serial| format!("usb:{serial}"));
            text.push_str(&format!("{name:<24} {camera}\n"));
        }
        if found.is_empty() {
            text.push_str("no camera on USB\n");
        }
        text.push_str(&format!("{:<24} a camera inside this program; see brewster capture --help\n", "emulated"));
        let cameras: Vec<_> = found
            .iter()
            .map(|c| json!({ "serial": c.serial, "vendor_id": c.vendor_id, "product_id": c.product_id, "bus": c.bus }))
            .collect();
        let json = json!({ "command": "devices", "usb": cameras, "warnings": terminal.warnings() });
        Ok(Outcome { brief: text.clone(), text, json })
    }
}
