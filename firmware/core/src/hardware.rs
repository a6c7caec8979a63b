//! What the camera's decisions need from the world: a wheel, a camera, a store and a link.
//!
//! Each has at least two implementations: the board's and the emulator's. They block only as long as the thing itself
//! takes (a wheel move, an exposure); a link never blocks.

use heapless::{String, Vec};
use protocol_polar::Degrees;
use protocol_wire::{CaptureDescription, CaptureId, CaptureSummary, MAX_CAPTURES, PlaneKind};

/// A time on the camera's own clock, µs since it started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Micros(pub u64);

/// Where the wheel ended up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelAxis {
    /// Transmission axis in the camera frame.
    pub angle: Degrees,
    /// Measured by an encoder; else it is the commanded axis.
    pub measured: bool,
}

/// Why the wheel is not where it should be.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum WheelError {
    /// It did not move at all.
    Stuck {
        /// Axis asked.
        asked: Degrees,
        /// Axis seen.
        seen: Degrees,
    },
    /// It moved, but not to the axis asked.
    Missed {
        /// Axis asked.
        asked: Degrees,
        /// Axis seen.
        seen: Degrees,
    },
    /// It does not answer, or cannot reach the axis; in words.
    Failed(String<64>),
}

/// A polarizer that can be turned.
pub trait Wheel {
    /// Turns the polarizer to `axis` (modulo 180°), waits until it has settled, and says where it is.
    ///
    /// # Errors
    /// [`WheelError`], as its variants say. The wheel can be asked again.
    fn move_to(&mut self, axis: Degrees) -> Result<WheelAxis, WheelError>;
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraError(
    /// What happened, in words.
    pub String<64>,
);

/// A camera that gives raw linear samples.
///
/// It keeps one picture per slot (in memory, on storage), so that the frames of a capture can be read back strip by strip:
/// the computation's memory does not grow with their number.
pub trait FrameSource {
    /// Takes one picture with locked gain and puts it in `slot`, replacing what was there. Returns when it began.
    ///
    /// # Errors
    /// [`CameraError`] where the camera failed; the slot is then empty.
    fn expose(&mut self, slot: u8, exposure_us: u32, now: Micros) -> Result<Micros, CameraError>;

    /// Reads whole rows from the picture in `slot`, beginning at `first_row`; `rows.len()` is a multiple of the width.
    ///
    /// # Errors
    /// [`CameraError`] where the slot is empty or the rows are not there.
    fn read_rows(&mut self, slot: u8, first_row: u32, rows: &mut [u16]) -> Result<(), CameraError>;
}

/// Why captures could not be kept or read.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StoreError {
    /// Not enough room.
    Full {
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        free: u64,
    },
    /// No such capture or strip.
    Missing,
    /// The storage failed, in words.
    Failed(String<64>),
}

/// Keeps captures until the host releases them.
pub trait CaptureStore {
    /// Makes room for a capture of `bytes` bytes in all its planes.
    ///
    /// # Errors
    /// [`StoreError::Full`].
    fn begin(&mut self, id: CaptureId, bytes: u64) -> Result<(), StoreError>;

    /// Keeps one strip's values and their CRC-32.
    ///
    /// # Errors
    /// [`StoreError`].
    fn write(&mut self, id: CaptureId, plane: PlaneKind, strip: u16, values: &[u8], crc: u32)
    -> Result<(), StoreError>;

    /// Marks the capture whole: from here on it survives whatever the store survives.
    ///
    /// # Errors
    /// [`StoreError`].
    fn finish(&mut self, description: &CaptureDescription) -> Result<(), StoreError>;

    /// Reads one strip's values to the front of `values`; returns how many bytes they are, and the CRC-32 that was written
    /// with them (not computed anew: it tells the host if the storage lied).
    ///
    /// # Errors
    /// [`StoreError::Missing`], or `Failed` where the storage failed.
    fn read(
        &mut self,
        id: CaptureId,
        plane: PlaneKind,
        strip: u16,
        values: &mut [u8],
    ) -> Result<(usize, u32), StoreError>;

    /// The description of a whole capture.
    ///
    /// # Errors
    /// [`StoreError::Missing`], or `Failed` where the storage failed.
    fn describe(&mut self, id: CaptureId) -> Result<CaptureDescription, StoreError>;

    /// Whole captures, oldest first.
    fn list(&mut self) -> Vec<CaptureSummary, MAX_CAPTURES>;

    /// Forgets a capture, whole or not.
    ///
    /// # Errors
    /// [`StoreError::Missing`], or `Failed` where the storage failed.
    fn remove(&mut self, id: CaptureId) -> Result<(), StoreError>;

    /// Room left, bytes.
    fn free_bytes(&self) -> u64;
}

/// The other end is gone: unplugged, closed, crashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkGone;

/// A byte pipe to the host that never blocks.
pub trait ByteLink {
    /// Takes what has arrived; 0 where nothing has.
    ///
    /// # Errors
    /// [`LinkGone`].
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LinkGone>;

    /// Sends as many bytes as fit now; 0 where none do.
    ///
    /// # Errors
    /// [`LinkGone`].
    fn write(&mut self, bytes: &[u8]) -> Result<usize, LinkGone>;
}

/// As much of a text as fits.
#[must_use]
pub fn text<const N: usize>(from: &str) -> String<N> {
    let mut to = String::new();
    for c in from.chars() {
        if to.push(c).is_err() {
            break;
        }
    }
    to
}
