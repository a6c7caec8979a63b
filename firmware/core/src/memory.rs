//! The memory a camera works in, lent by whoever runs it.

use crate::kernel::WeightTable;
use protocol_polar::MAX_FRAMES;
use protocol_wire::{HEADER_BYTES, SensorInfo};

/// Room for a strip header in front of its values.
const STRIP_HEADER_ROOM: usize = 64;
/// The outgoing frame holds at least the largest control message.
const LARGEST_MESSAGE: usize = 8 * 1024;

/// Working memory: for one strip of [`Lengths::photosites`], and for the maps of the whole sensor.
#[derive(Debug)]
pub struct Memory<'a> {
    /// Samples of all frames of one strip.
    pub samples: &'a mut [u16],
    /// Three 16-bit planes of one strip.
    pub narrow: &'a mut [i16],
    /// A 16-bit residual.
    pub narrow_residual: &'a mut [u16],
    /// Three 32-bit planes of one strip.
    pub wide: &'a mut [i32],
    /// A 32-bit residual.
    pub wide_residual: &'a mut [u32],
    /// Flags of one strip.
    pub flags: &'a mut [u8],
    /// Values on their way to storage.
    pub bytes: &'a mut [u8],
    /// The outgoing frame.
    pub outgoing: &'a mut [u8],
    /// Dark map of the sensor, DN.
    pub dark: &'a mut [u16],
    /// Flat gains of the sensor, Q1.15.
    pub flat: &'a mut [u16],
    /// Weights per mask of dropped frames.
    pub weights: &'a mut WeightTable,
}

/// How long each piece of [`Memory`] must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lengths {
    /// Photosites of one strip.
    pub photosites: usize,
    /// Photosites of the sensor: the maps.
    pub sensor: usize,
    /// Values of all frames of a strip.
    pub samples: usize,
    /// Values of three planes of a strip.
    pub planes: usize,
    /// Bytes of the widest plane of a strip.
    pub bytes: usize,
    /// Bytes of the outgoing frame.
    pub outgoing: usize,
}

impl Lengths {
    /// For strips of `strip_rows` rows of this sensor.
    #[must_use]
    pub fn new(sensor: &SensorInfo, strip_rows: u16) -> Self {
        let width = usize::try_from(sensor.width).unwrap_or(0);
        let height = usize::try_from(sensor.height).unwrap_or(0);
        let photosites = width * usize::from(strip_rows).min(height);
        let bytes = photosites * 4;
        Self {
            photosites,
            sensor: width * height,
            samples: photosites * MAX_FRAMES,
            planes: photosites * 3,
            bytes,
            outgoing: (HEADER_BYTES + STRIP_HEADER_ROOM + bytes).max(LARGEST_MESSAGE),
        }
    }

    /// Whether `memory` is large enough everywhere.
    #[must_use]
    pub fn fit(&self, memory: &Memory) -> bool {
        memory.samples.len() >= self.samples
            && memory.narrow.len() >= self.planes
            && memory.narrow_residual.len() >= self.photosites
            && memory.wide.len() >= self.planes
            && memory.wide_residual.len() >= self.photosites
            && memory.flags.len() >= self.photosites
            && memory.bytes.len() >= self.bytes
            && memory.outgoing.len() >= self.outgoing
            && memory.dark.len() >= self.sensor
            && memory.flat.len() >= self.sensor
    }
}
