//! A camera on USB: a vendor-class interface with one bulk endpoint each way (libusb through rusb).
//!
//! A camera is known by its interface's class triple, not by vendor and product: those are the board's. Both sides end a
//! burst with a short or empty packet, so that the other's pending read completes.

mod interface;

use crate::transport::ROOM;
use crate::{LinkError, Transport};
pub use interface::{CLASS, PROTOCOL, SUBCLASS};
use interface::{Endpoint, Pipes, Setting, choose};
use rusb::{Context, Device, DeviceHandle, TransferType, UsbContext};
use std::time::{Duration, Instant};

/// Bytes asked for at once: many packets, so that a read is not one packet long; a multiple of every packet size.
const READ_BYTES: usize = 256 * 1024;
/// While a device enumerates, opening it fails for a moment.
const OPEN_ATTEMPTS: u32 = 10;
const OPEN_PAUSE: Duration = Duration::from_millis(100);

/// A camera on USB, not opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Serial number; `None` where it could not be read, mostly for lack of permission.
    pub serial: Option<String>,
    /// idVendor.
    pub vendor_id: u16,
    /// idProduct.
    pub product_id: u16,
    /// Bus it is on.
    pub bus: u8,
    /// Its address there.
    pub address: u8,
}

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.serial {
            Some(serial) => f.write_str(serial)?,
            None => f.write_str("serial number unreadable")?,
        }
        write!(f, " (bus {} address {}, {:04x}:{:04x})", self.bus, self.address, self.vendor_id, self.product_id)
    }
}

/// Every camera on USB.
///
/// # Errors
/// [`LinkError::Usb`] where the system has no USB or it fails.
pub fn list() -> Result<Vec<Found>, LinkError> {
    Ok(cameras(&context()?)?.into_iter().map(|(_, found)| found).collect())
}

/// An open camera.
pub struct Usb {
    handle: DeviceHandle<Context>,
    pipes: Pipes,
    found: Found,
    staged: Vec<u8>,
    /// What of `staged` is not handed on yet.
    pending: std::ops::Range<usize>,
}

impl Usb {
    /// Opens the camera with this serial number, or the only one there is.
    ///
    /// # Errors
    /// [`LinkError::NoCamera`], [`LinkError::SeveralCameras`], [`LinkError::Permission`], [`LinkError::InUse`],
    /// [`LinkError::NoEndpoints`]; [`LinkError::Usb`] where USB fails otherwise.
    pub fn open(serial: Option<&str>) -> Result<Self, LinkError> {
        let context = context()?;
        let mut attempt = 0;
        loop {
            attempt += 1;
            match Self::try_open(&context, serial) {
                Err(LinkError::Usb(rusb::Error::NotFound) | LinkError::Gone) if attempt < OPEN_ATTEMPTS => {
                    std::thread::sleep(OPEN_PAUSE);
                }
                result => return result,
            }
        }
    }

    fn try_open(context: &Context, serial: Option<&str>) -> Result<Self, LinkError> {
        let cameras = cameras(context)?;
        let found = pick(&cameras.iter().map(|(_, found)| found.clone()).collect::<Vec<_>>(), serial)?;
        let (device, _) = cameras
            .into_iter()
            .find(|(_, other)| *other == found)
            .ok_or_else(|| LinkError::NoCamera { serial: serial.map(str::to_owned) })?;
        let pipes = pipes_of(&device).unwrap_or(Err(LinkError::NoEndpoints))?;
        let refused = |error| refusal(error, &found);
        let handle = device.open().map_err(refused)?;
        handle.claim_interface(pipes.interface).map_err(refused)?;
        Ok(Self { handle, pipes, found, staged: vec![0; READ_BYTES], pending: 0..0 })
    }
}

impl Transport for Usb {
    fn read(&mut self, buf: &mut [u8], timeout: Duration) -> Result<usize, LinkError> {
        if self.pending.is_empty() {
            // Never straight into `buf`: a packet longer than the room left for it is lost with an overflow.
            match self.handle.read_bulk(self.pipes.from_camera, &mut self.staged, at_least_one_ms(timeout)) {
                Ok(n) => self.pending = 0..n,
                Err(rusb::Error::Timeout | rusb::Error::Interrupted) => return Ok(0),
                Err(error) => return Err(failure(error)),
            }
        }
        let ready = self.staged.get(self.pending.clone()).unwrap_or_default();
        let n = ready.len().min(buf.len());
        for (to, from) in buf.iter_mut().zip(ready) {
            *to = *from;
        }
        self.pending.start += n;
        Ok(n)
    }

    fn write_all(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), LinkError> {
        let deadline = Instant::now() + timeout;
        let mut rest = bytes;
        let mut end_packet = !bytes.is_empty() && bytes.len().is_multiple_of(self.pipes.packet_bytes);
        while !rest.is_empty() || end_packet {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(LinkError::Timeout { waiting_for: ROOM });
            }
            match self.handle.write_bulk(self.pipes.to_camera, rest, at_least_one_ms(left)) {
                Ok(_) if rest.is_empty() => end_packet = false,
                Ok(n) => rest = rest.get(n..).unwrap_or_default(),
                Err(rusb::Error::Timeout | rusb::Error::Interrupted) => {}
                Err(error) => return Err(failure(error)),
            }
        }
        Ok(())
    }

    fn describe(&self) -> String {
        format!("USB camera {}", self.found)
    }
}

impl std::fmt::Debug for Usb {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Usb").field("found", &self.found).field("pipes", &self.pipes).finish_non_exhaustive()
    }
}

/// libusb takes 0 for "wait for ever", and rusb cuts to whole milliseconds.
fn at_least_one_ms(timeout: Duration) -> Duration {
    timeout.max(Duration::from_millis(1))
}

/// A context of our own: rusb's global one panics where the system has no USB.
fn context() -> Result<Context, LinkError> {
    Context::new().map_err(LinkError::Usb)
}

fn cameras(context: &Context) -> Result<Vec<(Device<Context>, Found)>, LinkError> {
    let devices = context.devices().map_err(LinkError::Usb)?;
    let cameras = devices.iter().filter(|device| pipes_of(device).is_some());
    Ok(cameras.filter_map(|device| look_at(&device).map(|found| (device, found))).collect())
}

/// `None` where the device has just left.
fn look_at(device: &Device<Context>) -> Option<Found> {
    let descriptor = device.device_descriptor().ok()?;
    let serial = device.open().and_then(|handle| handle.read_serial_number_string_ascii(&descriptor)).ok();
    Some(Found {
        serial,
        vendor_id: descriptor.vendor_id(),
        product_id: descriptor.product_id(),
        bus: device.bus_number(),
        address: device.address(),
    })
}

fn pipes_of(device: &Device<Context>) -> Option<Result<Pipes, LinkError>> {
    let config = device.active_config_descriptor().ok()?;
    let settings: Vec<_> = config
        .interfaces()
        .flat_map(|interface| interface.descriptors())
        .map(|d| Setting {
            interface: d.interface_number(),
            alternate: d.setting_number(),
            triple: (d.class_code(), d.sub_class_code(), d.protocol_code()),
            endpoints: d
                .endpoint_descriptors()
                .map(|e| Endpoint {
                    address: e.address(),
                    bulk: e.transfer_type() == TransferType::Bulk,
                    max_packet: e.max_packet_size(),
                })
                .collect(),
        })
        .collect();
    choose(&settings)
}

/// The camera meant by `serial` among those found.
fn pick(found: &[Found], serial: Option<&str>) -> Result<Found, LinkError> {
    let none = || LinkError::NoCamera { serial: serial.map(str::to_owned) };
    match (serial, found) {
        (None, []) => Err(none()),
        (None, [only]) => Ok(only.clone()),
        (None, several) => Err(LinkError::SeveralCameras(several.iter().map(Found::to_string).collect())),
        (Some(serial), found) => {
            let same = found.iter().find(|camera| camera.serial.as_deref() == Some(serial));
            // One whose serial number cannot be read may be it; opening it says why it cannot.
            same.or_else(|| found.iter().find(|camera| camera.serial.is_none())).cloned().ok_or_else(none)
        }
    }
}

/// What an error means while opening.
fn refusal(error: rusb::Error, found: &Found) -> LinkError {
    match error {
        rusb::Error::Access => LinkError::Permission {
            device: found.to_string(),
            rule: format!(
                "SUBSYSTEM==\"usb\", ATTR{{idVendor}}==\"{:04x}\", ATTR{{idProduct}}==\"{:04x}\", MODE=\"0660\", TAG+=\"uaccess\"",
                found.vendor_id, found.product_id
            ),
        },
        rusb::Error::Busy => LinkError::InUse,
        error => failure(error),
    }
}

/// What an error means while talking. An unplug shows as any of three.
fn failure(error: rusb::Error) -> LinkError {
    match error {
        rusb::Error::NoDevice | rusb::Error::Io | rusb::Error::Pipe => LinkError::Gone,
        error => LinkError::Usb(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(serial: Option<&str>) -> Found {
        Found { serial: serial.map(str::to_owned), vendor_id: 0x1209, product_id: 1, bus: 3, address: 9 }
    }

    #[test]
    fn the_camera_meant_is_picked() {
        let (a, b, locked) = (found(Some("A")), found(Some("B")), found(None));
        assert_eq!(pick(&[a.clone(), b.clone()], Some("B")).unwrap(), b);
        assert_eq!(pick(std::slice::from_ref(&a), None).unwrap(), a);
        assert!(matches!(pick(&[], None), Err(LinkError::NoCamera { serial: None })));
        assert!(
            matches!(pick(std::slice::from_ref(&a), Some("C")), Err(LinkError::NoCamera { serial: Some(s) }) if s == "C")
        );
        assert!(matches!(pick(&[a.clone(), b], None), Err(LinkError::SeveralCameras(list)) if list[0].contains('A')));
        assert_eq!(pick(&[a, locked.clone()], Some("C")).unwrap(), locked, "so that opening says `no permission`");
    }

    #[test]
    fn errors_say_what_to_do() {
        let said = refusal(rusb::Error::Access, &found(None)).to_string();
        assert!(said.contains(r#"ATTR{idVendor}=="1209", ATTR{idProduct}=="0001""#), "{said}");
        assert!(matches!(refusal(rusb::Error::Busy, &found(None)), LinkError::InUse));
        for unplugged in [rusb::Error::NoDevice, rusb::Error::Io, rusb::Error::Pipe] {
            assert!(matches!(failure(unplugged), LinkError::Gone));
        }
        assert!(matches!(failure(rusb::Error::Overflow), LinkError::Usb(rusb::Error::Overflow)));
    }

    /// On a machine without USB this is an error, and never a panic.
    #[test]
    fn listing_never_panics() {
        if let Err(error) = list() {
            assert!(matches!(error, LinkError::Usb(_)), "{error}");
        }
    }
}
