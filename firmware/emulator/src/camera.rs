//! The camera put together, and the thread it runs in.

use crate::replay::{ReplayCamera, ReplayWheel};
use crate::{
    AnalyticCamera, BoardWheel, Clock, EmulatedAs5600, EmulatedServo, EmulatorError, Eye, LiveCamera, MemoryStore,
    Port, Source, World, setup, uniform, wheel_chart,
};
use boards::{Board, Encoder, EncoderChip};
use firmware_core::kernel::WeightTable;
use firmware_core::{Activity, Device, FrameSource, Lengths, Memory, Setup, SetupError, Wheel};
use std::hash::{BuildHasher, Hasher};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// The wheel of a board whose chips are emulated.
pub type EmulatedWheel = BoardWheel<EmulatedServo, EmulatedAs5600>;

/// How long to look away when there is nothing to do.
const IDLE: Duration = Duration::from_micros(200);

/// All parts of a camera, not running yet.
#[derive(Debug)]
pub struct Camera<W, C> {
    /// What the board file says.
    pub setup: Setup,
    /// The wheel.
    pub wheel: W,
    /// The sensor.
    pub sensor: C,
    /// Where captures are kept.
    pub store: MemoryStore,
    /// Time.
    pub clock: Clock,
}

/// A camera that runs in a thread of its own until it is stopped or dropped.
#[derive(Debug)]
pub struct Running {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<MemoryStore, SetupError>>>,
}

/// Builds the camera that `source` calls for and starts it behind `port`, under a boot number of its own.
///
/// # Errors
/// [`EmulatorError`].
pub fn start(
    board: &Board,
    source: &Source,
    clock: Clock,
    port: impl Port + 'static,
) -> Result<Running, EmulatorError> {
    match source {
        Source::WheelChart => {
            let field = wheel_chart(board.sensor.width_px, board.sensor.height_px);
            Camera::analytic(board, field, clock)?.booted().spawn(port)
        }
        Source::Uniform { s0_dn, dolp, aolp } => {
            let field = uniform(board.sensor.width_px, board.sensor.height_px, *s0_dn, *dolp, *aolp);
            Camera::analytic(board, field, clock)?.booted().spawn(port)
        }
        Source::Replay(source) => Camera::replay(board, source, clock)?.booted().spawn(port),
    }
}

/// As [`start`], with the pictures of `eye` ([`Camera::live`]).
///
/// # Errors
/// [`EmulatorError`].
pub fn start_live(board: &Board, eye: Eye, clock: Clock, port: impl Port + 'static) -> Result<Running, EmulatorError> {
    Camera::live(board, World::new(board, clock), eye)?.booted().spawn(port)
}

impl Camera<EmulatedWheel, AnalyticCamera> {
    /// The board's own camera and wheel before `field` (see [`AnalyticCamera::new`]).
    ///
    /// # Errors
    /// [`EmulatorError::Servo`].
    pub fn analytic(board: &Board, field: Vec<[f32; 3]>, clock: Clock) -> Result<Self, EmulatorError> {
        let world = World::new(board, clock.clone());
        let wheel = emulated_wheel(board, &world)?;
        Ok(Self::of(board, wheel, AnalyticCamera::new(board, world, field), clock))
    }
}

impl Camera<EmulatedWheel, LiveCamera> {
    /// The board's own wheel, as it stands in `world`, before a sensor with the pictures of `eye`; the board must say what
    /// sensor that is.
    ///
    /// # Errors
    /// [`EmulatorError::Servo`].
    pub fn live(board: &Board, world: World, eye: Eye) -> Result<Self, EmulatorError> {
        let (wheel, clock) = (emulated_wheel(board, &world)?, world.clock().clone());
        let sensor = LiveCamera::new(world, board.sensor.width_px as usize, eye);
        Ok(Self::of(board, wheel, sensor, clock))
    }
}

impl Camera<ReplayWheel, ReplayCamera> {
    /// Photographs in place of the board's sensor and wheel.
    ///
    /// # Errors
    /// [`EmulatorError`] where they cannot be read or do not go together.
    pub fn replay(board: &Board, source: &crate::ReplaySource, clock: Clock) -> Result<Self, EmulatorError> {
        let (wheel, sensor) = source.open(&clock)?;
        let mut camera = Self::of(board, wheel, sensor, clock);
        camera.sensor.describe(&mut camera.setup);
        Ok(camera)
    }
}

impl<W: Wheel, C: FrameSource> Camera<W, C> {
    /// Any wheel and sensor, with the rest as `board` says and nothing stored.
    #[must_use]
    pub fn of(board: &Board, wheel: W, sensor: C, clock: Clock) -> Self {
        let store = MemoryStore::new(u64::from(board.memory.budget_mb) * 1_000_000);
        Self { setup: setup(board, 1, store.next_id()), wheel, sensor, store, clock }
    }

    /// The same camera with a boot number that no other start of it has had. (Without, it is 1: tests are to repeat.)
    fn booted(mut self) -> Self {
        // The standard library's hash seeds are the one source of randomness that needs no further crate.
        let [a, b, c, d, ..] = std::hash::RandomState::new().build_hasher().finish().to_le_bytes();
        self.setup.boot = u32::from_le_bytes([a, b, c, d]).max(1);
        self
    }

    /// The same camera with what another one had stored.
    #[must_use]
    pub fn with_store(mut self, mut store: MemoryStore) -> Self {
        // Far enough from the sessions of the run before.
        self.setup.boot += store.restart() << 16;
        self.setup.first_capture = store.next_id();
        Self { store, ..self }
    }

    /// Runs until `stop` is set; gives back what is stored. Says on `started` whether it runs at all.
    fn run(
        self,
        port: &mut impl Port,
        stop: &AtomicBool,
        started: &SyncSender<Option<SetupError>>,
    ) -> Result<MemoryStore, SetupError> {
        let lengths = Lengths::new(&self.setup.sensor, self.setup.strip_rows);
        let mut buffers = Buffers::new(&lengths);
        let device = Device::new(self.setup, self.wheel, self.sensor, self.store, buffers.lend());
        started.send(device.as_ref().err().copied()).ok(); // whoever started it may not care
        let mut device = device?;
        while !stop.load(Ordering::Relaxed) {
            if device.poll(self.clock.now(), port.link()) == Activity::Idle {
                std::thread::sleep(IDLE);
            }
        }
        Ok(device.release().2)
    }
}

impl<W: Wheel + Send + 'static, C: FrameSource + Send + 'static> Camera<W, C> {
    /// Runs in a thread of its own.
    ///
    /// # Errors
    /// [`EmulatorError::Setup`] where it does not start.
    pub fn spawn(self, mut port: impl Port + 'static) -> Result<Running, EmulatorError> {
        let stop = Arc::new(AtomicBool::new(false));
        let (started, outcome) = sync_channel(1);
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || self.run(&mut port, &flag, &started));
        match outcome.recv() {
            Ok(Some(error)) => Err(EmulatorError::Setup(error)),
            _ => Ok(Running { stop, thread: Some(thread) }),
        }
    }
}

impl Running {
    /// Stops the camera, as pulling its power does: between two steps of its work. Gives back what is stored; `None`
    /// where its thread panicked.
    #[must_use]
    pub fn stop(mut self) -> Option<MemoryStore> {
        self.halt()
    }

    /// What stops it when set, for a signal handler.
    #[must_use]
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// Waits until something has set the flag.
    pub fn wait(mut self) {
        self.thread.take().map(JoinHandle::join);
    }

    fn halt(&mut self) -> Option<MemoryStore> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take()?.join().ok()?.ok()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.halt();
    }
}

/// The wheel of a board, with emulated chips that share `world`.
fn emulated_wheel(board: &Board, world: &World) -> Result<EmulatedWheel, EmulatorError> {
    let servo = EmulatedServo::new(world.clone(), board.wheel.servo.pwm_period_us);
    let encoder = board.wheel.encoder.clone().unwrap_or_else(nothing_on_the_bus);
    let chip = EmulatedAs5600::new(world.clone(), encoder);
    BoardWheel::new(board, servo, chip, world.clock().clone())
}

/// For a board without an encoder: its wheel never asks.
fn nothing_on_the_bus() -> Encoder {
    Encoder {
        chip: EncoderChip::As5600,
        i2c_address: 0x36,
        offset_deg: 0.0,
        turns_per_polarizer_turn: 1.0,
        tolerance_deg: 0.0,
        timeout_ms: 0,
    }
}

/// The camera's working memory.
struct Buffers {
    samples: Vec<u16>,
    narrow: Vec<i16>,
    narrow_residual: Vec<u16>,
    wide: Vec<i32>,
    wide_residual: Vec<u32>,
    flags: Vec<u8>,
    bytes: Vec<u8>,
    outgoing: Vec<u8>,
    dark: Vec<u16>,
    flat: Vec<u16>,
    weights: Box<WeightTable>,
}

impl Buffers {
    fn new(lengths: &Lengths) -> Self {
        Self {
            samples: vec![0; lengths.samples],
            narrow: vec![0; lengths.planes],
            narrow_residual: vec![0; lengths.photosites],
            wide: vec![0; lengths.planes],
            wide_residual: vec![0; lengths.photosites],
            flags: vec![0; lengths.photosites],
            bytes: vec![0; lengths.bytes],
            outgoing: vec![0; lengths.outgoing],
            dark: vec![0; lengths.sensor],
            flat: vec![0; lengths.sensor],
            weights: Box::default(),
        }
    }

    fn lend(&mut self) -> Memory<'_> {
        Memory {
            samples: &mut self.samples,
            narrow: &mut self.narrow,
            narrow_residual: &mut self.narrow_residual,
            wide: &mut self.wide,
            wide_residual: &mut self.wide_residual,
            flags: &mut self.flags,
            bytes: &mut self.bytes,
            outgoing: &mut self.outgoing,
            dark: &mut self.dark,
            flat: &mut self.flat,
            weights: &mut self.weights,
        }
    }
}
