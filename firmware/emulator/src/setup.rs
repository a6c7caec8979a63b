//! From a board file to what the camera's decisions start from.

use boards::{Bayer, Board, StokesWord};
use firmware_core::{Setup, text};
use protocol_polar::efficiency_from_extinction_ratio;
use protocol_wire::{CaptureId, FrameRequest, SensorInfo, Word};

/// The setup of `board` for boot number `boot`; the first capture is named `first_capture`.
#[must_use]
pub fn setup(board: &Board, boot: u32, first_capture: CaptureId) -> Setup {
    let sensor = &board.sensor;
    let angles = board.stokes.angles_deg.iter();
    Setup {
        serial: text(&board.identity.serial),
        board: text(&board.identity.name),
        firmware: text(env!("CARGO_PKG_VERSION")),
        sensor: SensorInfo {
            model: text(&sensor.model),
            width: sensor.width_px,
            height: sensor.height_px,
            bit_depth: sensor.bit_depth,
            bayer: match sensor.bayer {
                Bayer::Mono => protocol_wire::Bayer::Mono,
                Bayer::Rggb => protocol_wire::Bayer::Rggb,
                Bayer::Bggr => protocol_wire::Bayer::Bggr,
                Bayer::Grbg => protocol_wire::Bayer::Grbg,
                Bayer::Gbrg => protocol_wire::Bayer::Gbrg,
            },
            black_level_dn: sensor.black_level_dn,
            white_level_dn: sensor.white_level_dn,
            gain_e_per_dn: sensor.gain_e_per_dn,
            read_noise_e: sensor.read_noise_e,
            pixel_pitch_um: sensor.pixel_pitch_um,
        },
        exposure_limits_us: (sensor.exposure_min_us, sensor.exposure_max_us),
        polarizer_efficiency: efficiency_from_extinction_ratio(board.wheel.polarizer.extinction_ratio),
        misfit_sigma: board.stokes.misfit_sigma,
        // The board file was checked: there are no more angles than frames.
        default_frames: angles.map(|angle| FrameRequest { angle_deg: *angle, exposure_ratio: 1.0 }).collect(),
        default_word: match board.stokes.word {
            StokesWord::I16 => Word::I16,
            StokesWord::I32 => Word::I32,
        },
        strip_rows: u16::try_from(board.memory.strip_rows).unwrap_or(u16::MAX),
        boot,
        first_capture,
    }
}
