//! PNG frames (PNG specification, third edition; chunks sRGB, gAMA, iCCP, cICP).

use std::io::{BufRead, Seek};
use std::path::Path;

use png::{BitDepth, ColorType, DecodingError, EncodingError, ScaledFloat, SrgbRenderingIntent};

use super::{Encoding, Picture, Samples, drop_alpha};
use crate::ImageError;
use crate::atomic::write_atomically;
use crate::error::FileContext;

/// What decoder bookkeeping may take beside the picture's rows (ICC profiles and the like), in bytes.
const CHUNK_BUDGET: usize = 64 << 20;

pub(super) fn read(reader: impl BufRead + Seek, file: FileContext<'_>) -> Result<Picture, ImageError> {
    let decoding = |e: DecodingError| match e {
        DecodingError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => file.io(e),
        DecodingError::IoError(_) => file.malformed("the file is cut short"),
        DecodingError::LimitsExceeded => file.malformed("a chunk states an absurd length"),
        other => file.malformed(other.to_string()),
    };
    let mut decoder = png::Decoder::new(reader);
    decoder.set_ignore_text_chunk(true);
    let header = decoder.read_header_info().map_err(decoding)?;
    let (color, depth) = (header.color_type, header.bit_depth);
    let (stored, channels) = match color {
        ColorType::Grayscale => (1, 1),
        ColorType::GrayscaleAlpha => (2, 1),
        ColorType::Rgb => (3, 3),
        ColorType::Rgba => (4, 3),
        ColorType::Indexed => return Err(file.unsupported("PNG with a palette; grey and RGB are read")),
    };
    let bytes = match depth {
        BitDepth::Eight => 1,
        BitDepth::Sixteen => 2,
        other => return Err(file.unsupported(format!("PNG with {} bits; 8 and 16 are read", other as u8))),
    };
    let (width, height) = file.bounded(header.width.into(), header.height.into(), (stored * bytes) as u64)?;
    decoder.set_limits(png::Limits { bytes: CHUNK_BUDGET + 64 * width });
    let mut reader = decoder.read_info().map_err(decoding)?;
    let size = reader.output_buffer_size().ok_or_else(|| file.malformed("the header states an absurd size"))?;
    let mut raw = vec![0_u8; size];
    reader.next_frame(&mut raw).map_err(decoding)?;
    // Reads on to IEND: a file cut behind its last row is still a cut file.
    reader.finish().map_err(decoding)?;
    let samples = match depth {
        BitDepth::Sixteen => {
            // Network byte order, PNG specification section 7.1.
            let v: Vec<u16> = raw.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
            Samples::U16(drop_alpha(v, stored, channels))
        }
        _ => Samples::U8(drop_alpha(raw, stored, channels)),
    };
    let encoding = encoding(reader.info());
    Ok(Picture { width, height, channels, samples, encoding })
}

/// The chunk that wins, in the order of the specification's section 4.3: cICP, iCCP, sRGB, gAMA.
fn encoding(info: &png::Info<'_>) -> Encoding {
    if info.coding_independent_code_points.is_some() || info.icc_profile.is_some() {
        Encoding::Profile
    } else if info.srgb.is_some() {
        Encoding::Srgb
    } else if let Some(gamma) = info.gama_chunk {
        if gamma.into_scaled() == 100_000 { Encoding::Linear } else { Encoding::Gamma { exponent: gamma.into_value() } }
    } else if info.bit_depth == BitDepth::Eight {
        Encoding::ProbablyGamma
    } else {
        Encoding::Unstated
    }
}

pub(super) fn write(picture: &Picture, path: &Path) -> Result<(), ImageError> {
    let unsupported = |what: &str| ImageError::Unsupported { path: path.into(), what: what.into() };
    let (depth, bytes) = match &picture.samples {
        Samples::U8(v) => (BitDepth::Eight, v.clone()),
        Samples::U16(v) => (BitDepth::Sixteen, v.iter().flat_map(|s| s.to_be_bytes()).collect()),
        Samples::F32(_) => return Err(unsupported("PNG holds integers; float pictures go to EXR or npy")),
    };
    let (Ok(width), Ok(height)) = (u32::try_from(picture.width), u32::try_from(picture.height)) else {
        return Err(unsupported("more than 2^32 rows or columns"));
    };
    let encoding = |e: EncodingError| match e {
        EncodingError::IoError(source) => ImageError::Io { path: path.into(), source },
        other => ImageError::Unsupported { path: path.into(), what: other.to_string() },
    };
    write_atomically(path, |out| {
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(if picture.channels == 1 { ColorType::Grayscale } else { ColorType::Rgb });
        encoder.set_depth(depth);
        match picture.encoding {
            Encoding::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::Perceptual),
            Encoding::Gamma { exponent } => encoder.set_source_gamma(ScaledFloat::new(exponent)),
            Encoding::Linear => encoder.set_source_gamma(ScaledFloat::from_scaled(100_000)),
            Encoding::Profile | Encoding::ProbablyGamma | Encoding::Unstated => {}
        }
        let mut writer = encoder.write_header().map_err(encoding)?;
        writer.write_image_data(&bytes).map_err(encoding)?;
        writer.finish().map_err(encoding)
    })
}
