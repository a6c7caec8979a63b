//! The npy format, as far as frames need it (numpy.lib.format, versions 1.0 to 3.0): little-endian, C order.
//!
//! A file is: magic `\x93NUMPY`, two version bytes, the header length (u16, from 2.0 on u32, little-endian), a Python
//! dictionary padded with spaces to a multiple of 64 and ended by a newline, and the raw samples.

use std::io::{Read, Write};
use std::path::Path;

use crate::ImageError;
use crate::atomic::write_atomically;
use crate::error::{FileContext, NonFinite, io_error};
use crate::picture::{Encoding, Picture, Samples};

/// Longest header that is read, in bytes; two or three numbers need about 120.
const MAX_HEADER: usize = 1 << 16;

/// A sample type of npy files.
pub(crate) trait Sample: Copy {
    /// NumPy's name of the type.
    const DESCR: &'static str;
    /// Appends the sample, little-endian.
    fn put(self, out: &mut Vec<u8>);
}

impl Sample for u8 {
    const DESCR: &'static str = "|u1";
    fn put(self, out: &mut Vec<u8>) {
        out.push(self);
    }
}

impl Sample for u16 {
    const DESCR: &'static str = "<u2";
    fn put(self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.to_le_bytes());
    }
}

impl Sample for f32 {
    const DESCR: &'static str = "<f4";
    fn put(self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.to_le_bytes());
    }
}

/// Writes `samples` (row-major, as many as `shape` multiplies to) atomically.
pub(crate) fn write<T: Sample>(path: &Path, shape: &[usize], samples: &[T]) -> Result<(), ImageError> {
    write_atomically(path, |out| {
        out.write_all(&header(T::DESCR, shape)).map_err(|e| io_error(path, e))?;
        let mut bytes = Vec::new();
        for block in samples.chunks(1 << 16) {
            bytes.clear();
            block.iter().for_each(|v| v.put(&mut bytes));
            out.write_all(&bytes).map_err(|e| io_error(path, e))?;
        }
        Ok(())
    })
}

/// The header of format 1.0, byte for byte what NumPy writes.
fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    const PREAMBLE: usize = 10;
    let shape = shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // A two- or three-dimensional shape keeps the text far below the 65535 that version 1.0 can state.
    let total = (PREAMBLE + text.len() + 1).next_multiple_of(64);
    text.push_str(&" ".repeat(total - PREAMBLE - text.len() - 1));
    text.push('\n');
    let length = u16::try_from(text.len()).unwrap_or(u16::MAX);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(text.as_bytes());
    bytes
}

/// Reads a frame; the caller has checked the magic.
pub(crate) fn read(mut reader: impl Read, file: FileContext<'_>) -> Result<Picture, ImageError> {
    let mut preamble = [0; 8];
    read_exact(&mut reader, &mut preamble, file)?;
    let (length, size_of_length) = match preamble {
        [.., 1, _] => {
            let mut b = [0; 2];
            read_exact(&mut reader, &mut b, file)?;
            (usize::from(u16::from_le_bytes(b)), 2)
        }
        [.., 2 | 3, _] => {
            let mut b = [0; 4];
            read_exact(&mut reader, &mut b, file)?;
            (usize::try_from(u32::from_le_bytes(b)).unwrap_or(usize::MAX), 4)
        }
        [.., major, minor] => {
            return Err(file.unsupported(format!("npy format {major}.{minor}; 1.0 to 3.0 are read")));
        }
    };
    if length > MAX_HEADER {
        return Err(file.malformed(format!("npy header of {length} bytes")));
    }
    let mut text = vec![0; length];
    read_exact(&mut reader, &mut text, file)?;
    let text = std::str::from_utf8(&text).map_err(|_| file.malformed("npy header is not text"))?;
    let header = Header::parse(text).ok_or_else(|| file.malformed(format!("npy header {:?}", text.trim_end())))?;
    if header.fortran_order {
        return Err(file.unsupported("npy in Fortran order; save numpy.ascontiguousarray(a)"));
    }
    let (height, width, channels) = match header.shape.as_slice() {
        [h, w] => (*h, *w, 1),
        [h, w, 3] => (*h, *w, 3),
        other => return Err(file.unsupported(format!("npy of shape {other:?}; H x W and H x W x 3 are read"))),
    };
    let bytes = match header.descr {
        "|u1" => 1,
        "<u2" => 2,
        "<f4" => 4,
        "<f8" => 8,
        other => {
            return Err(file.unsupported(format!("npy of type {other:?}; '|u1', '<u2', '<f4' and '<f8' are read")));
        }
    };
    let (width, height) = file.bounded(width, height, bytes * channels)?;
    let expected = (width * height) as u64 * channels * bytes;
    let held = file.length.saturating_sub((8 + size_of_length + length) as u64);
    if held != expected {
        return Err(file.malformed(format!("{held} bytes of samples where the npy header states {expected}")));
    }
    let channels = if channels == 1 { 1 } else { 3 };
    let count = width * height * channels;
    let samples = match bytes {
        1 => Samples::U8(read_samples(&mut reader, count, file, |[b]| b)?),
        2 => Samples::U16(read_samples(&mut reader, count, file, u16::from_le_bytes)?),
        4 => Samples::F32(read_samples(&mut reader, count, file, f32::from_le_bytes)?),
        _ => {
            Samples::F32(narrowed(read_samples(&mut reader, count, file, f64::from_le_bytes)?, width, channels, file)?)
        }
    };
    Ok(Picture { width, height, channels, samples, encoding: Encoding::Unstated })
}

/// Rounds f64 to f32; a value that is not finite, or is too large for f32, is named as the file has it.
fn narrowed(wide: Vec<f64>, width: usize, channels: usize, file: FileContext<'_>) -> Result<Vec<f32>, ImageError> {
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what is asked for; overflow is checked")]
    let round = |v: f64| v as f32;
    if let Some((i, &value)) = wide.iter().enumerate().find(|(_, v)| !round(**v).is_finite()) {
        let pixel = i / channels;
        let channel = if channels == 1 { "Y" } else { ["R", "G", "B"].get(i % 3).copied().unwrap_or("?") };
        let sample = NonFinite { column: pixel % width, row: pixel / width, channel: channel.into(), value };
        return Err(ImageError::NotFinite { path: file.path.into(), sample });
    }
    Ok(wide.into_iter().map(round).collect())
}

fn read_samples<T, const N: usize>(
    reader: &mut impl Read,
    count: usize,
    file: FileContext<'_>,
    decode: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, ImageError> {
    let mut samples = Vec::with_capacity(count);
    let mut block = vec![0; N << 16];
    while samples.len() < count {
        let wanted = (count - samples.len()).min(1 << 16) * N;
        let part = block.get_mut(..wanted).unwrap_or_default();
        read_exact(reader, part, file)?;
        samples.extend(part.as_chunks::<N>().0.iter().map(|b| decode(*b)));
    }
    Ok(samples)
}

fn read_exact(reader: &mut impl Read, into: &mut [u8], file: FileContext<'_>) -> Result<(), ImageError> {
    reader.read_exact(into).map_err(|e| match e.kind() {
        std::io::ErrorKind::UnexpectedEof => file.malformed("the npy file is cut short"),
        _ => file.io(e),
    })
}

/// The three entries every npy header has.
#[derive(Debug, PartialEq)]
struct Header<'a> {
    descr: &'a str,
    fortran_order: bool,
    shape: Vec<u64>,
}

impl<'a> Header<'a> {
    /// The dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }` in any order of its keys. `None`
    /// for anything else, so also for the nested `descr` of a structured type.
    fn parse(text: &'a str) -> Option<Self> {
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
        while !rest.is_empty() {
            let (key, after) = quoted(rest)?;
            let value = after.trim_start().strip_prefix(':')?.trim_start();
            let after = match key {
                "descr" => {
                    let (name, after) = quoted(value)?;
                    descr = Some(name);
                    after
                }
                "fortran_order" => {
                    let (yes, after) = value
                        .strip_prefix("True")
                        .map(|after| (true, after))
                        .or_else(|| value.strip_prefix("False").map(|after| (false, after)))?;
                    fortran_order = Some(yes);
                    after
                }
                "shape" => {
                    let (inside, after) = value.strip_prefix('(')?.split_once(')')?;
                    let inside = inside.trim();
                    let inside = inside.strip_suffix(',').unwrap_or(inside);
                    let sizes: Option<Vec<u64>> = inside.split(',').map(|n| n.trim().parse().ok()).collect();
                    shape = Some(if inside.is_empty() { Vec::new() } else { sizes? });
                    after
                }
                _ => return None,
            };
            let after = after.trim_start();
            rest = if after.is_empty() { after } else { after.strip_prefix(',')?.trim_start() };
        }
        Some(Self { descr: descr?, fortran_order: fortran_order?, shape: shape? })
    }
}

/// A string in either quotes at the start, and what follows it.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text.get(1..)?.split_once(quote)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of `numpy.save` for a (2, 3) array of float32 (NumPy 2.x writes the same as 1.x).
    #[test]
    fn header_is_what_numpy_writes() {
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
        let mut golden = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        golden.extend_from_slice(text.as_bytes());
        golden.extend_from_slice(&[b' '; 58]);
        golden.push(b'\n');
        assert_eq!(golden.len(), 128);
        assert_eq!(header("<f4", &[2, 3]), golden);
    }

    #[test]
    fn headers_of_other_writers_are_understood() {
        let expected = Header { descr: "<u2", fortran_order: false, shape: vec![4, 5, 3] };
        for text in [
            "{'descr': '<u2', 'fortran_order': False, 'shape': (4, 5, 3), }   \n",
            "{\"shape\":(4,5,3),\"fortran_order\":False,\"descr\":\"<u2\"}",
            "{ 'fortran_order' : False , 'descr' : '<u2' , 'shape' : ( 4 , 5 , 3 , ) , }",
        ] {
            assert_eq!(Header::parse(text).as_ref(), Some(&expected), "{text}");
        }
        for text in [
            "",
            "{}",
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (4,)}",
            "{'descr': '<f4', 'fortran_order': 0, 'shape': (4, 5)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-4, 5)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 99999999999999999999)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (4 5)}",
        ] {
            assert_eq!(Header::parse(text), None, "{text}");
        }
    }
}
