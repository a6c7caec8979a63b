//! The camera without the hardware: emulated chips and cameras around the real firmware.
//!
//! What tests, CI and `brewster demo` run. The shape is that of every board program: a board file, an implementation of
//! each trait of `firmware-core`, and wiring. What is emulated is what the firmware can touch: pulses in, registers and
//! samples out, and time. Time is virtual unless asked otherwise: a wait advances a shared clock and nobody sleeps.
//!
//! Conventions: polarizer axes are in the camera frame (picture: x right, y up, counter-clockwise; rows run down), servo
//! angles at the servo's own shaft. Stokes fields are row-major, in DN at [`REFERENCE_EXPOSURE_US`].

mod analytic;
mod as5600;
mod camera;
mod clock;
mod error;
mod light;
mod live;
mod noise;
mod port;
mod replay;
mod scene;
mod servo;
mod setup;
mod source;
mod store;
mod wheel;
mod world;

pub use analytic::{AnalyticCamera, FixedPattern, REFERENCE_EXPOSURE_US};
pub use as5600::EmulatedAs5600;
pub use camera::{Camera, EmulatedWheel, Running, start, start_live};
pub use clock::Clock;
pub use error::EmulatorError;
/// What a cable to the emulated camera must be able to do.
pub use firmware_core::{ByteLink, LinkGone};
pub use light::Light;
pub use live::{Exposure, Eye, LiveCamera};
#[cfg(unix)]
pub use port::UnixPort;
pub use port::{Jack, Port, TcpPort, jack};
pub use replay::{Mosaic, ReplayCamera, ReplaySource, ReplayWheel};
pub use scene::{uniform, wheel_chart};
pub use servo::EmulatedServo;
pub use setup::setup;
pub use source::Source;
pub use store::MemoryStore;
pub use wheel::BoardWheel;
pub use world::World;
