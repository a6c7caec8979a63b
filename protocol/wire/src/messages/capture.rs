//! What a capture is: the request for one, and the description of one that the camera holds.
//!
//! Angles are degrees in the camera frame (picture: x right, y up, counter-clockwise), signals DN, times µs.

use heapless::{String, Vec};
use postcard_schema::Schema;
use protocol_polar::MAX_FRAMES;
use serde::{Deserialize, Serialize};

/// Most captures a camera lists at once.
pub const MAX_CAPTURES: usize = 16;
/// Most planes of one capture: three Stokes, flags, residual, two previews, two maps, and the raw frames.
pub const MAX_PLANES: usize = 9 + MAX_FRAMES;

/// Names a capture for as long as the camera holds it; never reused within a boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Schema)]
pub struct CaptureId(pub u32);

/// Storage word of the Stokes planes; the Q format follows from it and the bit depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Word {
    /// 16 bits.
    I16,
    /// 32 bits.
    I32,
}

impl From<Word> for protocol_polar::fixed::Word {
    fn from(word: Word) -> Self {
        match word {
            Word::I16 => Self::I16,
            Word::I32 => Self::I32,
        }
    }
}

/// Colour of photosite (row 0, column 0), then of the next one right, then of the row below.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Bayer {
    /// No colour filter.
    Mono,
    /// Red first.
    Rggb,
    /// Blue first.
    Bggr,
    /// Green first, red right of it.
    Grbg,
    /// Green first, blue right of it.
    Gbrg,
}

/// The sensor, as the board file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SensorInfo {
    /// Maker's name.
    pub model: String<32>,
    /// Photosites across.
    pub width: u32,
    /// Photosites down.
    pub height: u32,
    /// Bits of a sample.
    pub bit_depth: u8,
    /// Colour filter.
    pub bayer: Bayer,
    /// DN without light.
    pub black_level_dn: u16,
    /// DN from which a sample is saturated.
    pub white_level_dn: u16,
    /// Electrons per DN.
    pub gain_e_per_dn: f64,
    /// Read noise, electrons.
    pub read_noise_e: f64,
    /// Photosite pitch, µm.
    pub pixel_pitch_um: f64,
}

/// How long to expose the reference frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Exposure {
    /// The camera meters at every angle and then locks one exposure so that none clips.
    Auto,
    /// This long, µs.
    Fixed(u32),
}

/// One frame asked for. Repeated angles average; different ratios bracket.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FrameRequest {
    /// Polarizer axis, degrees.
    pub angle_deg: f64,
    /// Exposure relative to the reference frame, in (0, 1].
    pub exposure_ratio: f64,
}

/// A capture asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct CaptureRequest {
    /// The frames, in the order to take them; at least three distinct axes.
    pub frames: Vec<FrameRequest, MAX_FRAMES>,
    /// Exposure of a frame with ratio 1.
    pub exposure: Exposure,
    /// Word of the Stokes planes.
    pub word: Word,
    /// Keep the raw frames too, so that the host can replay the computation.
    pub keep_raw: bool,
}

/// One frame taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct FrameInfo {
    /// Axis that was asked for, degrees.
    pub asked_deg: f64,
    /// Axis the weights were computed with: measured where there is an encoder, else commanded; degrees.
    pub angle_deg: f64,
    /// Whether `angle_deg` was measured.
    pub measured: bool,
    /// Throughput relative to the reference frame.
    pub throughput: f64,
    /// Polarizer efficiency.
    pub efficiency: f64,
    /// Exposure, µs.
    pub exposure_us: u32,
    /// Start of the exposure on the camera's clock, µs.
    pub timestamp_us: u64,
}

/// What a plane holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
pub enum PlaneKind {
    /// Stokes component s0, signed.
    S0,
    /// Stokes component s1, signed.
    S1,
    /// Stokes component s2, signed.
    S2,
    /// [`protocol_polar::Flags`], one byte each.
    Flags,
    /// rms residual per degree of freedom, unsigned; only with more than three frames.
    Residual,
    /// Preview: degree of linear polarization, u8, 256 = 1, clamped to 255.
    PreviewDolp,
    /// Preview: angle of linear polarization, u8, 256 = 180°.
    PreviewAolp,
    /// Raw samples of frame slot n, u16.
    Raw(u8),
    /// The dark map that was subtracted, u16; kept with the raw frames.
    DarkMap,
    /// The flat gains that were applied, u16 Q1.15; kept with the raw frames.
    FlatMap,
}

/// A plane the camera can send: row-major, little-endian, cut in strips of whole rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PlaneInfo {
    /// What it holds.
    pub kind: PlaneKind,
    /// Bytes of one value: 1, 2 or 4.
    pub value_bytes: u8,
    /// Values across.
    pub width: u32,
    /// Values down.
    pub height: u32,
    /// Rows of every strip but the last.
    pub strip_rows: u16,
    /// Number of strips.
    pub strips: u16,
}

/// How far a capture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CaptureState {
    /// Being taken or computed.
    Running,
    /// Whole, and kept until released.
    Complete,
}

/// The per-photosite corrections that went into a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Calibration {
    /// A dark map was subtracted (else the black level).
    pub dark_map: bool,
    /// A flat field was applied.
    pub flat_map: bool,
}

/// A capture the camera holds, in one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CaptureSummary {
    /// Its name.
    pub id: CaptureId,
    /// How far it is.
    pub state: CaptureState,
    /// Number of frames.
    pub frames: u8,
    /// Bytes of all its planes.
    pub bytes: u64,
}

/// All there is to know about a capture: enough for the host to replay the integers bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct CaptureDescription {
    /// Its name.
    pub id: CaptureId,
    /// Which start of the camera it was taken in: names may come again after one, this number does not.
    pub boot: u32,
    /// How far it is.
    pub state: CaptureState,
    /// The sensor it was taken with.
    pub sensor: SensorInfo,
    /// Frames in slot order.
    pub frames: Vec<FrameInfo, MAX_FRAMES>,
    /// Word of the Stokes planes.
    pub word: Word,
    /// Fractional bits of the Stokes planes and the residual.
    pub frac_bits: u8,
    /// Proved bound on |plane − exact least squares| of s0, s1, s2, DN, where no sample was dropped and without a flat.
    pub bound_dn: [f64; 3],
    /// Standard deviations that count as misfit.
    pub misfit_sigma: f64,
    /// Corrections that were applied.
    pub calibration: Calibration,
    /// What can be fetched.
    pub planes: Vec<PlaneInfo, MAX_PLANES>,
}
