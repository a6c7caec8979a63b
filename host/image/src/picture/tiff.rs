//! TIFF frames (TIFF 6.0 and BigTIFF): raw, LZW or deflate; strips or tiles; the first image of the file.

use std::io::{Read, Seek};

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use super::{Encoding, Picture, Samples, drop_alpha};
use crate::ImageError;
use crate::error::FileContext;

pub(super) fn read(reader: impl Read + Seek, file: FileContext<'_>) -> Result<Picture, ImageError> {
    let decoding = |e: TiffError| match e {
        TiffError::IoError(e) if is_about_content(&e) => file.malformed(format!("cut short or corrupt: {e}")),
        TiffError::IoError(e) => file.io(e),
        TiffError::UnsupportedError(e) => file.unsupported(e.to_string()),
        other => file.malformed(other.to_string()),
    };
    let mut decoder = Decoder::new(reader).map_err(decoding)?;
    let (width, height) = decoder.dimensions().map_err(decoding)?;
    let color = decoder.colortype().map_err(decoding)?;
    let (stored, channels, bits) = match color {
        ColorType::Gray(bits) => (1, 1, bits),
        ColorType::GrayA(bits) => (2, 1, bits),
        ColorType::RGB(bits) => (3, 3, bits),
        ColorType::RGBA(bits) => (4, 3, bits),
        other => return Err(file.unsupported(format!("TIFF with colors {other:?}; grey and RGB are read"))),
    };
    // A turned picture turns every polarization angle with it, silently: better none than a wrong one.
    if let Some(turned) = decoder.find_tag_unsigned::<u16>(Tag::Orientation).map_err(decoding)?.filter(|&o| o != 1) {
        return Err(file.unsupported(format!("TIFF Orientation {turned}; store the frame upright (Orientation 1)")));
    }
    let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(decoding)?;
    if stored > 1 && planar == Some(2) {
        return Err(file.unsupported("TIFF with separate color planes; interleaved ones are read"));
    }
    let (width, height) = file.bounded(width.into(), height.into(), stored as u64 * u64::from(bits.div_ceil(8)))?;
    let size = width * height * stored * usize::from(bits.div_ceil(8));
    let mut limits = Limits::default();
    limits.decoding_buffer_size = size;
    limits.intermediate_buffer_size = size.max(1 << 20);
    let decoded = decoder.with_limits(limits).read_image().map_err(decoding)?;
    let samples = match decoded {
        DecodingResult::U8(v) if bits == 8 => Samples::U8(drop_alpha(v, stored, channels)),
        DecodingResult::U16(v) if bits == 16 => Samples::U16(drop_alpha(v, stored, channels)),
        DecodingResult::F32(v) => Samples::F32(drop_alpha(v, stored, channels)),
        _ => {
            return Err(file.unsupported(format!(
                "TIFF with {bits}-bit samples of this kind; unsigned 8 and 16 bit and 32-bit float are read"
            )));
        }
    };
    if samples.len() != width * height * channels {
        return Err(file.malformed(format!("{} samples for {width} x {height} pixels", samples.len())));
    }
    let encoding = if bits == 8 { Encoding::ProbablyGamma } else { Encoding::Unstated };
    Ok(Picture { width, height, channels, samples, encoding })
}

/// The decoders report bad bytes as I/O errors of these kinds; the others are the machine's.
fn is_about_content(e: &std::io::Error) -> bool {
    use std::io::ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
    matches!(e.kind(), UnexpectedEof | InvalidData | InvalidInput | Other)
}
