//! A camera whose pictures somebody else makes, exposure by exposure: what it sees is decided outside of this crate, such as by
//! the simulation of a scene.

use crate::World;
use firmware_core::{CameraError, FrameSource, Micros, text};
use protocol_polar::{MAX_FRAMES, Radians};
use std::fmt;
use std::time::Duration;

/// One exposure, as it really happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// The polarizer's true axis when it begins, camera frame, [0, π).
    pub axis: Radians,
    /// How long.
    pub duration: Duration,
    /// When it begins, since the camera's start.
    pub began: Duration,
    /// How many there were before.
    pub number: u64,
}

/// What makes the pictures: raw samples in DN, row-major, height × width of the board's sensor.
pub type Eye = Box<dyn FnMut(&Exposure) -> Vec<u16> + Send>;

/// The camera; see the module.
pub struct LiveCamera {
    world: World,
    width: usize,
    eye: Eye,
    taken: u64,
    slots: [Vec<u16>; MAX_FRAMES],
}

impl LiveCamera {
    /// A sensor of rows of `width` photosites behind this world's wheel, with the pictures of `eye`.
    #[must_use]
    pub fn new(world: World, width: usize, eye: Eye) -> Self {
        Self { world, width, eye, taken: 0, slots: Default::default() }
    }
}

impl FrameSource for LiveCamera {
    fn expose(&mut self, slot: u8, exposure_us: u32, _: Micros) -> Result<Micros, CameraError> {
        let room = self.slots.get_mut(usize::from(slot)).ok_or_else(|| CameraError(text("no such slot")))?;
        let clock = self.world.clock();
        let (now, duration) = (clock.now(), Duration::from_micros(exposure_us.into()));
        let axis = self.world.axis_radians();
        *room = (self.eye)(&Exposure { axis, duration, began: clock.elapsed(), number: self.taken });
        self.taken += 1;
        clock.wait(duration);
        Ok(now)
    }

    fn read_rows(&mut self, slot: u8, first_row: u32, rows: &mut [u16]) -> Result<(), CameraError> {
        let start = first_row as usize * self.width;
        let picture = self.slots.get(usize::from(slot)).and_then(|picture| picture.get(start..start + rows.len()));
        rows.copy_from_slice(picture.ok_or_else(|| CameraError(text("the slot is empty")))?);
        Ok(())
    }
}

impl fmt::Debug for LiveCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LiveCamera").field("world", &self.world).field("taken", &self.taken).finish_non_exhaustive()
    }
}
