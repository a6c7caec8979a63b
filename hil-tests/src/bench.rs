//! An emulated camera, and a host that talks to it over a pipe in this process.

use boards::Board;
use firmware_core::{ByteLink, FrameSource, LinkGone, Wheel};
use firmware_emulator::{Camera, MemoryStore, Running, jack};
use host_link::in_process::{DeviceEnd, HostEnd, pair};
use host_link::{Client, Options};
use protocol_wire::{CaptureRequest, Exposure, FrameRequest, Word};
use std::fmt;
use std::path::Path;
use std::sync::mpsc::Sender;
use std::time::Duration;

/// Room in the pipe, bytes: more than a strip, less than a plane.
const PIPE: usize = 256 * 1024;

/// A running camera and the jack its cable goes into.
#[derive(Debug)]
pub struct Bench {
    plug: Sender<Plugged>,
    running: Running,
}

/// The camera's end of a cable, possibly a faulty one.
pub struct Plugged(Box<dyn ByteLink + Send>);

struct Wire(DeviceEnd);

impl Bench {
    /// Starts a camera.
    #[must_use]
    pub fn start<W: Wheel + Send + 'static, C: FrameSource + Send + 'static>(camera: Camera<W, C>) -> Self {
        let (plug, jack) = jack();
        Self { plug, running: camera.spawn(jack).unwrap() }
    }

    /// Plugs a new cable in and gives its host end.
    #[must_use]
    pub fn cable(&self) -> HostEnd {
        self.cable_through(|wire| wire)
    }

    /// As [`Self::cable`], with something between cable and camera.
    #[must_use]
    pub fn cable_through<L: ByteLink + Send + 'static>(&self, between: impl FnOnce(Plugged) -> L) -> HostEnd {
        let (host, device) = pair(PIPE);
        let wire = between(Plugged(Box::new(Wire(device))));
        self.plug.send(Plugged(Box::new(wire))).unwrap();
        host
    }

    /// Plugs a new cable in and opens a session.
    #[must_use]
    pub fn connect(&self) -> Client<HostEnd> {
        Client::connect_with(self.cable(), "story", options()).unwrap()
    }

    /// Cuts the power; what was stored stays.
    #[must_use]
    pub fn power_cut(self) -> MemoryStore {
        self.running.stop().unwrap()
    }
}

impl ByteLink for Wire {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        self.0.read(bytes).map_err(|_| LinkGone)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        self.0.write(bytes).map_err(|_| LinkGone)
    }
}

impl ByteLink for Plugged {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        self.0.read(bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        self.0.write(bytes)
    }
}

impl fmt::Debug for Plugged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Plugged")
    }
}

/// The emulated board.
#[must_use]
pub fn board() -> Board {
    Board::parse(boards::EMULATED_TOML, Path::new("emulated.toml")).unwrap()
}

/// The emulated board with a sensor of this size, so that a story is short.
#[must_use]
pub fn board_of(width_px: u32, height_px: u32) -> Board {
    let mut board = board();
    (board.sensor.width_px, board.sensor.height_px) = (width_px, height_px);
    board
}

/// Patient enough for a slow machine, and the same bytes every time.
#[must_use]
pub fn options() -> Options {
    Options { reply: Duration::from_secs(30), first_sequence: 100, ..Options::default() }
}

/// A capture of these axes in 16-bit words, raw frames kept.
#[must_use]
pub fn capture_request(angles_deg: &[f64], exposure: Exposure) -> CaptureRequest {
    let frames = angles_deg.iter().map(|angle| FrameRequest { angle_deg: *angle, exposure_ratio: 1.0 });
    CaptureRequest { frames: frames.collect(), exposure, word: Word::I16, keep_raw: true }
}
