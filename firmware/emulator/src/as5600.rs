//! The encoder chip, seen from the bus: ams AS5600, datasheet v1-06 (registers from its "Register Map", Figure 21).

use crate::World;
use boards::Encoder;
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

const STATUS: u8 = 0x0B;
const RAW_ANGLE_HIGH: u8 = 0x0C;
const RAW_ANGLE_LOW: u8 = 0x0D;
const ANGLE_HIGH: u8 = 0x0E;
const ANGLE_LOW: u8 = 0x0F;
/// STATUS with MD set, ML and MH clear: a magnet, neither too weak nor too strong.
const MAGNET_DETECTED: u8 = 0x20;
const COUNTS: f64 = 4096.0;

/// An AS5600 alone on its bus, under the polarizer's magnet. Reads only: no register that can be written is emulated.
#[derive(Clone, Debug)]
pub struct EmulatedAs5600 {
    world: World,
    encoder: Encoder,
    /// Where the next read begins.
    pointer: u8,
}

impl EmulatedAs5600 {
    /// The chip as the board has it on this world's wheel.
    #[must_use]
    pub fn new(world: World, encoder: Encoder) -> Self {
        Self { world, encoder, pointer: 0 }
    }

    /// 12 bits of the magnet's angle.
    fn raw_angle(&self) -> u16 {
        let axis_deg = self.world.axis().0;
        let magnet_turns = self.encoder.turns_per_polarizer_turn * (axis_deg - self.encoder.offset_deg) / 360.0;
        let counts = (magnet_turns * COUNTS).round().rem_euclid(COUNTS);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 4095, whole")]
        let raw = counts as u16;
        raw
    }

    fn register(&self, address: u8) -> u8 {
        let [low, high] = self.raw_angle().to_le_bytes();
        match address {
            STATUS => MAGNET_DETECTED,
            RAW_ANGLE_HIGH | ANGLE_HIGH => high,
            RAW_ANGLE_LOW | ANGLE_LOW => low,
            _ => 0,
        }
    }
}

impl ErrorType for EmulatedAs5600 {
    type Error = ErrorKind;
}

impl I2c for EmulatedAs5600 {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        if address != self.encoder.i2c_address {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        for operation in operations {
            match operation {
                Operation::Write([pointer]) => self.pointer = *pointer,
                Operation::Write([]) => {}
                Operation::Write(_) => return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data)),
                Operation::Read(bytes) => {
                    // "Automatic increment of the address pointer", but for the angles, where it stays.
                    for (to, address) in bytes.iter_mut().zip(self.pointer..) {
                        *to = self.register(address);
                    }
                }
            }
        }
        Ok(())
    }
}
