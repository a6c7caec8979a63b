//! One file per chip, generic over embedded-hal 1.0: servo wheel, encoder, button, and the wheel they make together.
//!
//! Conventions: polarizer axes are [`protocol_polar::Degrees`] in the camera frame, where 0° and 180° are one axis;
//! servo angles are degrees at the servo's own shaft, 0 at the shortest pulse. Times are microseconds. A driver owns its
//! bus and gives it back with `release`. Nothing here reads a clock: waits go through
//! [`DelayNs`](embedded_hal::delay::DelayNs), and time that must be known is an argument.
#![no_std]
#![warn(clippy::indexing_slicing, clippy::expect_used, clippy::panic)]

#[cfg(test)]
extern crate std;

mod button;
mod encoder;
mod servo_wheel;
#[cfg(test)]
mod test_bench;
mod wheel;

pub use button::{Active, Button, Edge};
pub use encoder::{EncoderConfig, EncoderError, WheelEncoder};
pub use servo_wheel::{Approach, Move, ServoConfig, ServoError, ServoWheel};
pub use wheel::{Arrival, ArrivalConfig, EncodedWheel, WheelError};

use protocol_polar::Degrees;

/// The axis `angle` names, in [0°, 180°) but for rounding.
fn as_axis(angle: Degrees) -> Degrees {
    angle.to_radians().as_axis().to_degrees()
}

/// How far apart two axes are, the short way round, in [0°, 90°].
fn axis_distance(a: Degrees, b: Degrees) -> Degrees {
    Degrees(libm::fabs(a.to_radians().axis_difference(b.to_radians()).to_degrees().0))
}
