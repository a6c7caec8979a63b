//! Planes of integers as a Stokes image in DN, and the raw frames as pictures.

use host_image::{
    BayerPattern, Color, ColorPlanes, Encoding, FixedPointFormat, Picture, Samples, StokesImage, StokesMetadata,
};
use protocol_polar::fixed::PlaneFormat;
use protocol_wire::{Bayer, CaptureDescription, PlaneKind};

use super::Received;

impl Received {
    /// The Stokes image in DN at the reference exposure, camera frame.
    pub(crate) fn image(&self, serial: &str, source: &str) -> StokesImage {
        let d = &self.description;
        let lsb = PlaneFormat { word: d.word.into(), frac_bits: d.frac_bits }.lsb_dn();
        let residual = self.planes.contains_key(&PlaneKind::Residual);
        let planes = ColorPlanes {
            color: Color::Y,
            s0: self.signed(PlaneKind::S0, lsb),
            s1: self.signed(PlaneKind::S1, lsb),
            s2: self.signed(PlaneKind::S2, lsb),
            flags: self.planes.get(&PlaneKind::Flags).cloned(),
            residual: residual.then(|| self.unsigned(PlaneKind::Residual, lsb)),
        };
        StokesImage {
            width: size(d.sensor.width),
            height: size(d.sensor.height),
            colors: vec![planes],
            metadata: metadata(d, serial, source),
        }
    }

    /// The raw frame in `slot`.
    pub(crate) fn raw(&self, slot: u8) -> Option<Picture> {
        let bytes = self.planes.get(&PlaneKind::Raw(slot))?;
        Some(Picture {
            width: size(self.description.sensor.width),
            height: size(self.description.sensor.height),
            channels: 1,
            samples: Samples::U16(bytes.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b)).collect()),
            encoding: Encoding::Linear,
        })
    }

    /// Integers of a plane times `lsb`, DN. Every i16 is exact in f32; an i32 is rounded to 24 bits.
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the format of the image")]
    fn signed(&self, kind: PlaneKind, lsb: f64) -> Vec<f32> {
        let bytes = self.planes.get(&kind).map(Vec::as_slice).unwrap_or_default();
        if self.narrow() {
            bytes.as_chunks().0.iter().map(|b| (f64::from(i16::from_le_bytes(*b)) * lsb) as f32).collect()
        } else {
            bytes.as_chunks().0.iter().map(|b| (f64::from(i32::from_le_bytes(*b)) * lsb) as f32).collect()
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the format of the image")]
    fn unsigned(&self, kind: PlaneKind, lsb: f64) -> Vec<f32> {
        let bytes = self.planes.get(&kind).map(Vec::as_slice).unwrap_or_default();
        if self.narrow() {
            bytes.as_chunks().0.iter().map(|b| (f64::from(u16::from_le_bytes(*b)) * lsb) as f32).collect()
        } else {
            bytes.as_chunks().0.iter().map(|b| (f64::from(u32::from_le_bytes(*b)) * lsb) as f32).collect()
        }
    }

    fn narrow(&self) -> bool {
        self.description.word == protocol_wire::Word::I16
    }
}

fn metadata(d: &CaptureDescription, serial: &str, source: &str) -> StokesMetadata {
    StokesMetadata {
        unit: "DN".into(),
        angles_deg: d.frames.iter().map(|frame| frame.angle_deg).collect(),
        exposure_us: d.frames.iter().map(|frame| f64::from(frame.exposure_us)).collect(),
        gain: None,
        black_level_dn: Some(d.sensor.black_level_dn.into()),
        white_level_dn: Some(d.sensor.white_level_dn.into()),
        bit_depth: Some(d.sensor.bit_depth),
        fixed_point: Some(FixedPointFormat {
            word_bits: if d.word == protocol_wire::Word::I16 { 16 } else { 32 },
            fractional_bits: d.frac_bits,
            error_bound_dn: d.bound_dn,
        }),
        bayer: match d.sensor.bayer {
            Bayer::Mono => None,
            Bayer::Rggb => Some(BayerPattern::Rggb),
            Bayer::Bggr => Some(BayerPattern::Bggr),
            Bayer::Grbg => Some(BayerPattern::Grbg),
            Bayer::Gbrg => Some(BayerPattern::Gbrg),
        },
        source: source.into(),
        camera_serial: Some(serial.into()),
        capture_id: Some(d.id.0.to_string()),
        software_version: concat!("brewster ", env!("CARGO_PKG_VERSION")).into(),
    }
}

fn size(value: u32) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}
