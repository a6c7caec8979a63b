//! The tables of a board file, schema 1: names, units and meaning of every key.

use serde::{Deserialize, Serialize};

/// One device, as its file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Always [`crate::SCHEMA`].
    pub schema: i64,
    /// Who it is.
    #[serde(rename = "board")]
    pub identity: Identity,
    /// The image sensor.
    pub sensor: Sensor,
    /// The turning polarizer and what turns it.
    pub wheel: Wheel,
    /// How a capture becomes Stokes planes unless the host asks otherwise.
    pub stokes: Stokes,
    /// What it says of itself on the bus.
    pub usb: Usb,
    /// What a capture may use.
    pub memory: Memory,
    /// How true to life the emulated parts are. Only on a board of kind [`BoardKind::Emulated`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emulation: Option<Emulation>,
}

/// `[board]`: who it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// Short name, the file's stem by custom.
    pub name: String,
    /// What was built.
    pub model: String,
    /// Which one of them it is; also its USB serial number.
    pub serial: String,
    /// One sentence for people.
    pub description: String,
    /// Which program wires it.
    pub kind: BoardKind,
}

/// Which program wires the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoardKind {
    /// Emulated chips and camera.
    Emulated,
    /// Raspberry Pi: rppal, libcamera, FunctionFS.
    RaspberryPi,
}

/// `[sensor]`: the image sensor. DN are raw digital numbers, e are photoelectrons.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Part number.
    pub model: String,
    /// Photosites in a row.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Distance of neighbouring photosites.
    pub pixel_pitch_um: f64,
    /// Bits of a raw sample, 8 to 16.
    pub bit_depth: u8,
    /// Raw value of a dark photosite.
    pub black_level_dn: u16,
    /// Raw value from which a sample counts as saturated, at most 2^bit_depth − 1.
    pub white_level_dn: u16,
    /// Color filter over the photosites; the first row is read left to right.
    pub bayer: Bayer,
    /// Photoelectrons a photosite holds.
    pub full_well_e: f64,
    /// Noise of reading one sample, rms.
    pub read_noise_e: f64,
    /// Photoelectrons per raw DN at unit analog gain.
    pub gain_e_per_dn: f64,
    /// Shortest exposure.
    pub exposure_min_us: u32,
    /// Longest exposure.
    pub exposure_max_us: u32,
}

/// Color filter array, named by its first 2 × 2 photosites, row-major.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bayer {
    /// No filter.
    Mono,
    /// Red, green / green, blue.
    Rggb,
    /// Blue, green / green, red.
    Bggr,
    /// Green, red / blue, green.
    Grbg,
    /// Green, blue / red, green.
    Gbrg,
}

/// `[wheel]`: polarizer axis = `zero_offset_deg` + `gear_ratio` × servo angle, in the camera frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheel {
    /// Polarizer turns per servo turn; negative where the gear reverses.
    pub gear_ratio: f64,
    /// Polarizer axis in the camera frame at servo angle 0 (pulse `pulse_min_us`), reached by the one-sided approach.
    pub zero_offset_deg: f64,
    /// What turns it.
    pub servo: Servo,
    /// What is turned.
    pub polarizer: Polarizer,
    /// What measures where it is, if anything does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder: Option<Encoder>,
}

/// `[wheel.servo]`: every angle here is at the servo's own shaft, 0 at `pulse_min_us`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// Pulse at servo angle 0, and the shortest ever sent.
    pub pulse_min_us: u32,
    /// Pulse at `travel_deg`, and the longest ever sent.
    pub pulse_max_us: u32,
    /// Servo angle between the two pulses.
    pub travel_deg: f64,
    /// One frame of the servo signal.
    pub pwm_period_us: u32,
    /// Speed under load.
    pub slew_deg_per_s: f64,
    /// Rest after the motion before a frame may be exposed.
    pub settle_ms: u32,
    /// Play of gear and servo together.
    pub backlash_deg: f64,
    /// The side every position is approached from.
    pub approach: Approach,
    /// How far beyond the backlash the run-up to a position starts.
    pub overshoot_deg: f64,
}

/// Direction of the last motion of every move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Approach {
    /// Towards longer pulses.
    Increasing,
    /// Towards shorter pulses.
    Decreasing,
}

/// `[wheel.polarizer]`: the filter itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polarizer {
    /// k₁/k₂, power along the axis over power across it.
    pub extinction_ratio: f64,
    /// Share of unpolarized light that passes, at most ½ for a good polarizer.
    pub transmission: f64,
}

/// `[wheel.encoder]`: encoder angle = `turns_per_polarizer_turn` × (polarizer axis − `offset_deg`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// Which chip.
    pub chip: EncoderChip,
    /// 7-bit address.
    pub i2c_address: u8,
    /// Polarizer axis in the camera frame where the chip reads 0.
    pub offset_deg: f64,
    /// Turns of its magnet per turn of the polarizer; negative where it counts the other way.
    pub turns_per_polarizer_turn: f64,
    /// Farthest the polarizer may be from the commanded axis and still count as arrived.
    pub tolerance_deg: f64,
    /// How long to wait for that, beyond the servo's own slew and settling.
    pub timeout_ms: u32,
}

/// Encoder chips there are drivers for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EncoderChip {
    /// ams AS5600, 12-bit magnetic.
    As5600,
}

/// `[stokes]`: how a capture becomes Stokes planes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stokes {
    /// Word of a plane.
    pub word: StokesWord,
    /// Polarizer axes of a capture, in order, in the camera frame.
    #[serde(default = "default_angles_deg")]
    pub angles_deg: Vec<f64>,
    /// Residual, in standard deviations of the noise, from which a photosite is flagged as a misfit.
    pub misfit_sigma: f64,
}

/// Word of a Stokes plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StokesWord {
    /// 16 bits.
    I16,
    /// 32 bits.
    I32,
}

/// `[usb]`: the device descriptor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Usb {
    /// idVendor.
    pub vendor_id: u16,
    /// idProduct.
    pub product_id: u16,
}

/// `[memory]`: what a capture may use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Most memory all captures together may use, in 10^6 bytes.
    pub budget_mb: u32,
    /// Rows of one strip of a plane.
    pub strip_rows: u32,
}

/// `[emulation]`: how true to life the emulated parts are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Emulation {
    /// Seed of every random draw.
    pub seed: u64,
    /// Standard deviation of where the servo comes to rest, at the polarizer.
    pub wheel_jitter_deg: f64,
    /// Whether frames have shot and read noise.
    pub sensor_noise: bool,
}

/// 0/60/120: the three axes that give the least total variance.
fn default_angles_deg() -> Vec<f64> {
    vec![0.0, 60.0, 120.0]
}
