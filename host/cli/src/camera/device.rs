//! Where the camera is, and opening a session with it.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use boards::Board;
use firmware_emulator::{ByteLink, Clock, LinkGone, Running, Source, jack, start};
use host_link::in_process::{DeviceEnd, pair};
use host_link::{Address, Client, Transport};
use protocol_wire::LogLevel;

use super::scene_source::SceneSource;
use super::words::link_failure;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::terminal::Terminal;

/// How long to wait for a connection.
const CONNECT: Duration = Duration::from_secs(5);
/// Bytes on their way to or from an emulated camera: a few strips.
const PIPE: usize = 1 << 20;

/// Which camera.
#[derive(clap::Args)]
pub(crate) struct DeviceArgs {
    /// The camera: usb, usb:SERIAL, tcp:HOST:PORT, unix:PATH, or emulated[:SOURCE] for one in this program
    ///
    /// SOURCE is what the emulated camera sees: wheel-chart (the default), uniform:S0,DOLP,AOLP_DEG,
    /// replay:PATH[?mosaic=imx250mzr&prefix=NAME&black=DN&white=DN&bit_depth=BITS] for photographs taken at known angles, or
    /// SCENE.toml[?view=N&seed=N&tolerance=T] for a simulated scene (see brewster simulate) with the scene's own sensor.
    #[arg(long, short, value_name = "CAMERA", default_value = "usb", verbatim_doc_comment)]
    device: DeviceName,
    /// Board file of the emulated camera [default: the one built in]
    #[arg(long, value_name = "FILE")]
    board: Option<PathBuf>,
}

/// A camera's name on the command line.
#[derive(Clone, Debug)]
pub(crate) enum DeviceName {
    Emulated(Source),
    Scene(SceneSource),
    At(Address),
}

impl FromStr for DeviceName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        if name == "emulated" {
            return Ok(Self::Emulated(Source::default()));
        }
        if let Some(source) = name.strip_prefix("emulated:") {
            if let Some(scene) = SceneSource::parse(source) {
                return scene.map(Self::Scene);
            }
            return source
                .parse()
                .map(Self::Emulated)
                .map_err(|error: firmware_emulator::EmulatorError| error.to_string());
        }
        name.parse().map(Self::At).map_err(|_: host_link::LinkError| {
            "expected usb, usb:SERIAL, tcp:HOST:PORT, unix:PATH or emulated[:SOURCE]".to_owned()
        })
    }
}

/// A camera with an open session.
pub(crate) struct Opened {
    pub(crate) client: Client<Box<dyn Transport>>,
    name: DeviceName,
    /// Warnings of the camera's log, and where new sessions put them.
    warnings: (Sender<String>, Receiver<String>),
    /// Keeps the emulated camera alive.
    _running: Option<Running>,
}

impl DeviceArgs {
    /// The emulated camera before `source`.
    pub(crate) fn emulated(source: Source) -> Self {
        Self { device: DeviceName::Emulated(source), board: None }
    }

    /// Opens the camera and asks who it is.
    pub(crate) fn open(&self) -> Result<Opened, Failure> {
        let (transport, running): (Box<dyn Transport>, _) = match &self.device {
            DeviceName::At(address) => {
                if self.board.is_some() {
                    let what = "--board is the emulated camera's; a real camera has its board file with it";
                    return Err(Failure::new(Exit::Usage, what, "Leave it out, or use --device emulated."));
                }
                (open_address(address)?, None)
            }
            DeviceName::Scene(source) => {
                let (plug, port) = jack();
                let running = source.start(self.board()?, port)?;
                (plugged(&plug), Some(running))
            }
            DeviceName::Emulated(source) => {
                let board = self.board()?;
                let (plug, port) = jack();
                let running = start(&board, source, Clock::virtual_time(), port).map_err(|error| {
                    Failure::new(Exit::BadInput, error.to_string(), "Check the source behind --device emulated:.")
                })?;
                (plugged(&plug), Some(running))
            }
        };
        let warnings = channel();
        let client = connect(transport, &warnings.0).map_err(|error| link_failure(&error, &self.device.to_string()))?;
        Ok(Opened { client, name: self.device.clone(), warnings, _running: running })
    }

    fn board(&self) -> Result<Board, Failure> {
        let board = match &self.board {
            Some(file) => Board::read(file),
            None => Board::parse(boards::EMULATED_TOML, "boards/emulated.toml".as_ref()),
        };
        board.map_err(|error| Failure::new(Exit::BadInput, error.to_string(), "Mend the board file."))
    }
}

impl Opened {
    /// The camera's name, as on the command line.
    pub(crate) fn name(&self) -> String {
        self.name.to_string()
    }

    /// Opens a new session after the link broke. `None`: there is no way back to this camera.
    pub(crate) fn reopen(&mut self) -> Option<Result<(), host_link::LinkError>> {
        let DeviceName::At(address) = &self.name else { return None };
        let opened = address.open(CONNECT).and_then(|transport| connect(transport, &self.warnings.0));
        Some(opened.map(|client| self.client = client))
    }

    /// Passes the camera's warnings on.
    pub(crate) fn tell_warnings(&self, terminal: &Terminal) {
        self.warnings.1.try_iter().for_each(|text| terminal.warn(format!("the camera says: {text}")));
    }
}

/// Plugs a cable into an emulated camera and gives its other end.
fn plugged(plug: &Sender<Wire>) -> Box<dyn Transport> {
    let (host, device) = pair(PIPE);
    plug.send(Wire(device)).ok(); // the camera that would take it has just been started
    Box::new(host)
}

fn connect(
    transport: Box<dyn Transport>,
    warnings: &Sender<String>,
) -> Result<Client<Box<dyn Transport>>, host_link::LinkError> {
    let mut client = Client::connect(transport, concat!("brewster ", env!("CARGO_PKG_VERSION")))?;
    let warnings = warnings.clone();
    client.on_log(move |log| {
        if log.level == LogLevel::Warning {
            warnings.send(log.text.to_string()).ok(); // nobody reads once the command has ended
        }
    });
    Ok(client)
}

fn open_address(address: &Address) -> Result<Box<dyn Transport>, Failure> {
    address.open(CONNECT).map_err(|error| link_failure(&error, &address.to_string()))
}

impl std::fmt::Display for DeviceName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Emulated(_) | Self::Scene(_) => f.write_str("the emulated camera"),
            Self::At(address) => address.fmt(f),
        }
    }
}

/// The camera's end of the pipe, as the firmware wants it.
struct Wire(DeviceEnd);

impl ByteLink for Wire {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone> {
        self.0.read(bytes).map_err(|_| LinkGone)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone> {
        self.0.write(bytes).map_err(|_| LinkGone)
    }
}
