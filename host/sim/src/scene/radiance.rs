//! Radiance pictures (`.hdr`, RGBE): the usual file of an environment map.
//!
//! Ward, "Real Pixels", Graphics Gems II, and the Radiance file format reference: a text header up to an empty line, a line
//! `-Y height +X width`, then scan lines of (r, g, b, e), value = mantissa · 2^(e − 136), flat or each component run-length
//! coded ("new" RLE). The older pixel-wise RLE is not read.

use std::path::Path;

use host_image::{Encoding, ImageError, MAX_PIXELS, Picture, Samples};

/// First bytes of the format.
pub(super) const MAGIC: &[u8] = b"#?";

/// Decodes the bytes of a file; `path` names it in errors. Samples are linear RGB, height × width × 3, rows run down.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<Picture, ImageError> {
    let malformed = |what: String| ImageError::Malformed { path: path.into(), what };
    let unsupported = |what: String| ImageError::Unsupported { path: path.into(), what };
    let mut rest = bytes;
    loop {
        let line = take_line(&mut rest).ok_or_else(|| malformed("the header has no end".into()))?;
        if line.is_empty() {
            break;
        }
        if let Some(format) = line.strip_prefix("FORMAT=").filter(|f| *f != "32-bit_rle_rgbe") {
            return Err(unsupported(format!("Radiance FORMAT={format}; 32-bit_rle_rgbe is read")));
        }
    }
    let size = take_line(&mut rest).unwrap_or_default();
    let (width, height) = match size.split_ascii_whitespace().collect::<Vec<_>>().as_slice() {
        ["-Y", height, "+X", width] => (parse(width), parse(height)),
        _ => return Err(unsupported(format!("Radiance size line {size:?}; `-Y height +X width` is read"))),
    };
    let (Some(width), Some(height)) = (width, height) else {
        return Err(malformed(format!("Radiance size line {size:?}")));
    };
    let pixels = width.checked_mul(height).filter(|n| (1..=MAX_PIXELS).contains(&(*n as u64)));
    let too_large = || ImageError::TooLarge { path: path.into(), width: width as u64, height: height as u64 };
    let pixels = pixels.ok_or_else(too_large)?;
    // A run of 127 takes two bytes; anything smaller cannot hold that many pixels.
    if pixels / 64 > rest.len() {
        return Err(malformed(format!("{} bytes for {width} x {height} pixels", rest.len())));
    }
    let mut samples = Vec::with_capacity(3 * pixels);
    let mut planes = vec![0_u8; 4 * width];
    for row in 0..height {
        scan_line(&mut rest, width, &mut planes).ok_or_else(|| malformed(format!("scan line {row} is broken")))?;
        for column in 0..width {
            let component = |k: usize| f32::from(planes[k * width + column]);
            // e = 0 is black; 2^(e − 136) of the others is exact in f32 but for the very smallest.
            let exponent = planes[3 * width + column];
            let scale = if exponent == 0 { 0.0 } else { f32::from(i16::from(exponent) - 136).exp2() };
            samples.extend([0, 1, 2].map(|k| component(k) * scale));
        }
    }
    Ok(Picture { width, height, channels: 3, samples: Samples::F32(samples), encoding: Encoding::Linear })
}

/// One scan line into four planes of `width` bytes; `None` where the file breaks off or a run is too long.
fn scan_line(rest: &mut &[u8], width: usize, planes: &mut [u8]) -> Option<()> {
    let head: [u8; 4] = rest.get(..4)?.try_into().ok()?;
    let coded = head[0] == 2 && head[1] == 2 && usize::from(u16::from_be_bytes([head[2], head[3]])) == width;
    if !(coded && (8..0x8000).contains(&width)) {
        let (line, after) = rest.split_at_checked(4 * width)?;
        for (column, pixel) in line.as_chunks::<4>().0.iter().enumerate() {
            // (1, 1, 1, n) repeats the last pixel in the older coding.
            if pixel[..3] == [1, 1, 1] {
                return None;
            }
            for (k, byte) in pixel.iter().enumerate() {
                planes[k * width + column] = *byte;
            }
        }
        *rest = after;
        return Some(());
    }
    *rest = rest.get(4..)?;
    for plane in planes.chunks_exact_mut(width) {
        let mut filled = 0;
        while filled < width {
            let (&code, after) = rest.split_first()?;
            let count = usize::from(if code > 128 { code - 128 } else { code });
            let to = plane.get_mut(filled..filled + count).filter(|t| !t.is_empty())?;
            if code > 128 {
                let (&value, after) = after.split_first()?;
                to.fill(value);
                *rest = after;
            } else {
                let (values, after) = after.split_at_checked(count)?;
                to.copy_from_slice(values);
                *rest = after;
            }
            filled += count;
        }
    }
    Some(())
}

fn take_line<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let end = rest.iter().position(|b| *b == b'\n')?;
    let (line, after) = rest.split_at(end);
    *rest = after.get(1..)?;
    std::str::from_utf8(line).ok().map(str::trim_end)
}

fn parse(number: &str) -> Option<usize> {
    number.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the bytes: an answer, and one of the size the header states.
        #[test]
        fn no_file_is_too_strange(
            width in 1_usize..20, height in 1_usize..4, mut data in prop::collection::vec(any::<u8>(), 0..300), coded: bool,
        ) {
            if coded && data.len() >= 4 {
                data[..4].copy_from_slice(&[2, 2, 0, u8::try_from(width).unwrap()]);
            }
            if let Ok(picture) = decode(&file(&format!("-Y {height} +X {width}"), &data), Path::new("sky.hdr")) {
                prop_assert_eq!(picture.samples.len(), 3 * width * height);
                prop_assert_eq!(picture.first_non_finite(), None);
            }
        }
    }

    const HEADER: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";

    fn file(size: &str, data: &[u8]) -> Vec<u8> {
        [HEADER, size.as_bytes(), b"\n", data].concat()
    }

    fn samples(bytes: &[u8]) -> Vec<f32> {
        match decode(bytes, Path::new("sky.hdr")).unwrap().samples {
            Samples::F32(v) => v,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn flat_and_run_length_lines_hold_the_same_light() {
        // (128, 64, 32) · 2^(137 − 136) and, for exponent 0, black.
        let flat: Vec<u8> = [[128, 64, 32, 137]; 7].concat().into_iter().chain([9, 9, 9, 0]).collect();
        let coded =
            [2, 2, 0, 8, 135, 128, 1, 9, 135, 64, 1, 9, 135, 32, 1, 9, 7, 137, 137, 137, 137, 137, 137, 137, 129, 0];
        let expected: Vec<f32> = [[256.0, 128.0, 64.0]; 7].concat().into_iter().chain([0.0; 3]).collect();
        assert_eq!(samples(&file("-Y 1 +X 8", &flat)), expected);
        assert_eq!(samples(&file("-Y 1 +X 8", &coded)), expected);
    }

    #[test]
    fn broken_files_are_malformed_and_strange_ones_unsupported() {
        let refused = |bytes: &[u8]| decode(bytes, Path::new("sky.hdr")).unwrap_err();
        let coded = [2, 2, 0, 8, 135, 128, 1];
        for cut in [&file("-Y 1 +X 8", &coded)[..], &file("-Y 2 +X 1", &[1, 2, 3, 4]), b"#?RADIANCE\nFORMAT"] {
            assert!(matches!(refused(cut), ImageError::Malformed { .. }));
        }
        let overrun = [2, 2, 0, 8, 137, 128];
        assert!(matches!(refused(&file("-Y 1 +X 8", &overrun)), ImageError::Malformed { .. }));
        assert!(matches!(refused(&file("-Y 99999 +X 99999", &coded)), ImageError::TooLarge { .. }));
        assert!(matches!(refused(&file("+X 8 -Y 1", &coded)), ImageError::Unsupported { .. }));
        assert!(matches!(refused(b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n"), ImageError::Unsupported { .. }));
    }
}
