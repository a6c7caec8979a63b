//! Round trips with the same bits, what other writers make, and files cut at every byte.

use super::*;

fn grey8() -> Picture {
    let samples = Samples::U8((0..35).map(|i| i * 7).collect());
    Picture { width: 7, height: 5, channels: 1, samples, encoding: Encoding::ProbablyGamma }
}

fn rgb16() -> Picture {
    let samples = Samples::U16((0..6 * 4 * 3).map(|i| i * 911).collect());
    Picture { width: 6, height: 4, channels: 3, samples, encoding: Encoding::Unstated }
}

fn float(channels: usize) -> Picture {
    let special = [-0.0, f32::MIN_POSITIVE / 4.0, f32::MAX, -1.5e-30];
    let samples = (0_u16..).map(|i| f32::from(i) * 0.1).skip(4);
    let samples = special.into_iter().chain(samples).take(6 * 5 * channels).collect();
    Picture { width: 6, height: 5, channels, samples: Samples::F32(samples), encoding: Encoding::Linear }
}

fn bits(p: &Picture) -> Vec<u32> {
    match &p.samples {
        Samples::U8(v) => v.iter().map(|&x| x.into()).collect(),
        Samples::U16(v) => v.iter().map(|&x| x.into()).collect(),
        Samples::F32(v) => v.iter().map(|x| x.to_bits()).collect(),
    }
}

/// Writes `bytes` to a file of its own and reads it.
fn read_bytes(bytes: &[u8]) -> Result<Picture, ImageError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame");
    std::fs::write(&path, bytes).unwrap();
    Picture::read(&path)
}

fn bytes_of(write: impl FnOnce(&Path) -> Result<(), ImageError>) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame");
    write(&path).unwrap();
    std::fs::read(&path).unwrap()
}

/// A little-endian TIFF with its directory in front of the samples, as TIFF 6.0 sections 2 and 8 describe it.
fn tiff(width: u32, height: u32, samples: u16, bits: u16, format: u16, orientation: u16, data: &[u8]) -> Vec<u8> {
    let (short, long) = (3_u16, 4_u16);
    let count = u32::from(samples);
    let after_directory = 8 + 2 + 12 * 11 + 4;
    // BitsPerSample and SampleFormat of several samples do not fit the entry: they stand behind the directory.
    let outside = if samples > 2 { 2 * count } else { 0 };
    let both = |v: u16| u32::from(v) | if samples == 2 { u32::from(v) << 16 } else { 0 };
    let (bits_at, format_at) =
        if outside > 0 { (after_directory, after_directory + outside) } else { (both(bits), both(format)) };
    let entries = [
        (256_u16, long, 1, width),
        (257, long, 1, height),
        (258, short, count, bits_at),
        (259, short, 1, 1),
        (262, short, 1, if samples >= 3 { 2 } else { 1 }),
        (273, long, 1, after_directory + 2 * outside),
        (274, short, 1, orientation.into()),
        (277, short, 1, samples.into()),
        (278, long, 1, height),
        (279, long, 1, u32::try_from(data.len()).unwrap()),
        (339, short, count, format_at),
    ];
    let mut file = b"II*\0\x08\0\0\0\x0b\0".to_vec();
    for (tag, kind, n, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(u32::to_le_bytes(n));
        file.extend(u32::to_le_bytes(value));
    }
    file.extend([0; 4]);
    for value in [bits, format] {
        for _ in 0..outside / 2 {
            file.extend(value.to_le_bytes());
        }
    }
    file.extend(data);
    file
}

#[test]
fn png_keeps_every_bit_and_the_encoding() {
    for encoding in [Encoding::ProbablyGamma, Encoding::Srgb, Encoding::Linear, Encoding::Gamma { exponent: 0.45455 }] {
        let picture = Picture { encoding, ..grey8() };
        assert_eq!(read_bytes(&bytes_of(|p| picture.write_png(p))).unwrap(), picture);
    }
    assert_eq!(read_bytes(&bytes_of(|p| rgb16().write_png(p))).unwrap(), rgb16());
}

#[test]
fn png_alpha_is_dropped_and_palettes_are_refused() {
    let png = |color, depth, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_palette([9, 9, 9, 8, 8, 8].as_slice());
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        read_bytes(&bytes)
    };
    use ::png::{BitDepth, ColorType};
    let p = png(ColorType::Rgba, BitDepth::Eight, &[1, 2, 3, 255, 4, 5, 6, 0]).unwrap();
    assert_eq!((p.channels, p.samples), (3, Samples::U8(vec![1, 2, 3, 4, 5, 6])));
    let p = png(ColorType::GrayscaleAlpha, BitDepth::Sixteen, &[1, 2, 0, 0, 3, 4, 9, 9]).unwrap();
    assert_eq!((p.channels, p.samples), (1, Samples::U16(vec![0x0102, 0x0304])));
    let refused = png(ColorType::Indexed, BitDepth::Eight, &[0, 1]);
    assert!(matches!(refused, Err(ImageError::Unsupported { .. })), "{refused:?}");
}

#[test]
fn npy_and_exr_keep_every_bit() {
    for picture in [float(1), float(3), rgb16(), grey8()] {
        let back = read_bytes(&bytes_of(|p| picture.write_npy(p))).unwrap();
        assert_eq!((back.width, back.height, back.channels), (picture.width, picture.height, picture.channels));
        assert_eq!(bits(&back), bits(&picture));
        assert_eq!(back.encoding, Encoding::Unstated);
    }
    for picture in [float(1), float(3)] {
        let back = read_bytes(&bytes_of(|p| picture.write_exr(p))).unwrap();
        assert_eq!(bits(&back), bits(&picture));
        assert_eq!(back.encoding, Encoding::Linear);
    }
}

#[test]
fn npy_of_doubles_is_rounded_or_refused() {
    let npy = |values: [f64; 2]| {
        let mut file = bytes_of(|p| crate::npy::write(p, &[1, 2], &[0.0_f32; 2]));
        file.truncate(128);
        let at = file.windows(3).position(|w| w == b"<f4").unwrap();
        file[at + 2] = b'8';
        file.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        read_bytes(&file)
    };
    assert_eq!(npy([0.1, -3.0]).unwrap().samples, Samples::F32(vec![0.1, -3.0]));
    for bad in [f64::NAN, 1e300] {
        let Err(ImageError::NotFinite { sample, .. }) = npy([0.1, bad]) else { panic!("{bad} was read") };
        assert_eq!((sample.column, sample.row, sample.value.to_bits()), (1, 0, bad.to_bits()));
    }
}

#[test]
fn tiff_of_every_kind_that_is_read() {
    let p = read_bytes(&tiff(2, 2, 1, 8, 1, 1, &[1, 2, 3, 4])).unwrap();
    assert_eq!((p.width, p.height, p.channels), (2, 2, 1));
    assert_eq!((p.samples, p.encoding), (Samples::U8(vec![1, 2, 3, 4]), Encoding::ProbablyGamma));
    let p = read_bytes(&tiff(2, 1, 3, 16, 1, 1, &[1, 0, 2, 0, 3, 0, 4, 1, 5, 1, 6, 1])).unwrap();
    assert_eq!((p.channels, p.samples), (3, Samples::U16(vec![1, 2, 3, 260, 261, 262])));
    let data: Vec<u8> = [0.5_f32, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let p = read_bytes(&tiff(1, 2, 1, 32, 3, 1, &data)).unwrap();
    assert_eq!((p.samples, p.encoding), (Samples::F32(vec![0.5, -2.0]), Encoding::Unstated));
    let p = read_bytes(&tiff(1, 1, 4, 8, 1, 1, &[7, 8, 9, 255])).unwrap();
    assert_eq!((p.channels, p.samples), (3, Samples::U8(vec![7, 8, 9])));
}

#[test]
fn tiff_that_would_be_misread_is_refused() {
    let turned = read_bytes(&tiff(2, 2, 1, 8, 1, 6, &[1, 2, 3, 4]));
    assert!(
        matches!(&turned, Err(ImageError::Unsupported { what, .. }) if what.contains("Orientation 6")),
        "{turned:?}"
    );
    for (bits, format, bytes) in [(16, 2, 8), (32, 1, 16), (64, 3, 32)] {
        let refused = read_bytes(&tiff(2, 2, 1, bits, format, 1, &vec![0; bytes]));
        assert!(matches!(refused, Err(ImageError::Unsupported { .. })), "{bits} {format}: {refused:?}");
    }
    let bomb = read_bytes(&tiff(20_000, 20_000, 1, 8, 1, 1, &[0; 4]));
    assert!(matches!(bomb, Err(ImageError::Malformed { .. })), "{bomb:?}");
    let large = read_bytes(&tiff(60_000, 60_000, 1, 8, 1, 1, &[0; 4]));
    assert!(matches!(large, Err(ImageError::TooLarge { width: 60_000, .. })), "{large:?}");
}

#[test]
fn a_bad_float_sample_is_named_with_its_place() {
    let mut picture = float(3);
    let Samples::F32(samples) = &mut picture.samples else { panic!("float") };
    samples[3 * (2 * 6 + 4) + 1] = f32::NAN;
    for bytes in [bytes_of(|p| picture.write_npy(p)), bytes_of(|p| picture.write_exr(p))] {
        let Err(ImageError::NotFinite { sample, path }) = read_bytes(&bytes) else { panic!("NaN was read") };
        assert_eq!((sample.column, sample.row, sample.channel.as_str()), (4, 2, "G"));
        assert!(path.ends_with("frame"));
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error_and_no_panic() {
    let data: Vec<u8> = (0..48).collect();
    let files = [
        ("png", bytes_of(|p| rgb16().write_png(p))),
        ("npy", bytes_of(|p| float(3).write_npy(p))),
        ("exr", bytes_of(|p| float(3).write_exr(p))),
        ("tiff", tiff(4, 4, 3, 8, 1, 1, &data)),
    ];
    for (kind, bytes) in files {
        assert!(read_bytes(&bytes).is_ok(), "{kind}");
        for cut in 0..bytes.len() {
            let read = read_bytes(&bytes[..cut]);
            assert!(matches!(read, Err(ImageError::Malformed { .. })), "{kind} cut at {cut}: {read:?}");
        }
    }
}

#[test]
fn a_file_with_any_byte_changed_does_not_panic() {
    let data: Vec<u8> = (0..48).collect();
    let files = [
        bytes_of(|p| rgb16().write_png(p)),
        bytes_of(|p| float(1).write_npy(p)),
        bytes_of(|p| float(1).write_exr(p)),
        tiff(4, 4, 3, 8, 1, 1, &data),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame");
    for bytes in files {
        for at in 0..bytes.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= change;
                std::fs::write(&path, &changed).unwrap();
                if let Ok(picture) = Picture::read(&path) {
                    picture.check().unwrap();
                }
            }
        }
    }
}

#[test]
fn what_is_not_read_says_what_it_is() {
    let jpeg = read_bytes(&[0xff, 0xd8, 0xff, 0xe0, 0, 16, b'J', b'F', b'I', b'F']);
    assert!(matches!(&jpeg, Err(ImageError::Unsupported { what, .. }) if what.contains("JPEG")), "{jpeg:?}");
    assert!(matches!(read_bytes(b"just text"), Err(ImageError::Unsupported { .. })));
    assert!(matches!(read_bytes(b""), Err(ImageError::Malformed { .. })));
    assert!(matches!(Picture::read(Path::new("no/such.png")), Err(ImageError::Io { .. })));
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(Picture::read(folder.path()), Err(ImageError::Io { .. })));
    assert!(matches!(float(1).write_png(&folder.path().join("a.png")), Err(ImageError::Unsupported { .. })));
    assert!(matches!(grey8().write_exr(&folder.path().join("a.exr")), Err(ImageError::Unsupported { .. })));
    let wrong = Picture { width: 8, ..grey8() };
    assert!(matches!(wrong.write_png(&folder.path().join("a.png")), Err(ImageError::Inconsistent { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
