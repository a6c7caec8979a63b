//! `brewster info`: what is in a file.

use std::path::{Path, PathBuf};

use clap::Args;
use host_fit::Statistics;
use host_image::{Color, ImageError, Picture, Samples, StokesImage};
use protocol_polar::Flags;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::photographs::encoding_words;
use crate::terminal::Outcome;

/// Show what is in a file: size, type and range of a picture; how a Stokes image was measured
#[derive(Args)]
pub(crate) struct Info {
    /// A Stokes image (OpenEXR made by brewster), or any picture: PNG, TIFF, OpenEXR, npy
    file: PathBuf,
}

impl Info {
    pub(crate) fn run(&self) -> Result<Outcome, Failure> {
        let (json, lines) = match read(&self.file).map_err(|e| Failure::reading(&e))? {
            Content::Stokes(image) => (stokes_json(&image), stokes_lines(&image)),
            Content::Picture(picture) => (picture_json(&picture), picture_lines(&picture)),
        };
        let text: String = lines.iter().map(|(name, value)| format!("{name:<16} {value}\n")).collect();
        Ok(Outcome { brief: text.clone(), text, json })
    }
}

enum Content {
    Stokes(Box<StokesImage>),
    Picture(Picture),
}

/// A file is taken for a Stokes image if it is one, or nearly: an OpenEXR file that is no plain picture either.
fn read(path: &Path) -> Result<Content, ImageError> {
    let mut magic = [0; 4];
    let opened = std::fs::File::open(path).and_then(|mut f| std::io::Read::read_exact(&mut f, &mut magic));
    if opened.is_err() || magic != [0x76, 0x2f, 0x31, 0x01] {
        return Picture::read(path).map(Content::Picture);
    }
    match StokesImage::load_exr(path) {
        Ok(image) => Ok(Content::Stokes(Box::new(image))),
        Err(missing @ ImageError::Missing { .. }) => Picture::read(path).map(Content::Picture).map_err(|e| match e {
            ImageError::Unsupported { .. } => missing,
            other => other,
        }),
        Err(other) => Err(other),
    }
}

type Lines = Vec<(String, String)>;

/// Name of a channel, its smallest and largest value.
type Range = (&'static str, f32, f32);

fn range(samples: &[f32]) -> (f32, f32) {
    samples.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

/// Smallest and largest sample of each channel.
fn picture_ranges(picture: &Picture) -> Vec<Range> {
    let names: &[&str] = if picture.channels == 1 { &["Y"] } else { &["R", "G", "B"] };
    let channel = |c: usize| -> (f32, f32) {
        fn every<T: Copy + Into<f32>>(v: &[T], c: usize, step: usize) -> (f32, f32) {
            range(&v.iter().skip(c).step_by(step).map(|x| (*x).into()).collect::<Vec<f32>>())
        }
        match &picture.samples {
            Samples::U8(v) => every(v, c, picture.channels),
            Samples::U16(v) => every(v, c, picture.channels),
            Samples::F32(v) => every(v, c, picture.channels),
        }
    };
    names.iter().enumerate().map(|(c, name)| (*name, channel(c).0, channel(c).1)).collect()
}

fn type_words(samples: &Samples) -> &'static str {
    match samples {
        Samples::U8(_) => "8-bit integer",
        Samples::U16(_) => "16-bit integer",
        Samples::F32(_) => "32-bit float",
    }
}

fn picture_lines(picture: &Picture) -> Lines {
    let mut lines = vec![
        ("kind".into(), "picture".into()),
        ("size".into(), format!("{} x {}", picture.width, picture.height)),
        ("channels".into(), if picture.channels == 1 { "grey".into() } else { "RGB".into() }),
        ("type".into(), type_words(&picture.samples).into()),
        ("encoding".into(), encoding_words(picture.encoding)),
    ];
    lines.extend(
        picture_ranges(picture).into_iter().map(|(name, a, b)| (format!("range {name}"), format!("{a} to {b}"))),
    );
    lines
}

fn picture_json(picture: &Picture) -> Value {
    let ranges: Vec<Value> = picture_ranges(picture)
        .into_iter()
        .map(|(channel, min, max)| json!({ "channel": channel, "min": min, "max": max }))
        .collect();
    json!({
        "command": "info",
        "kind": "picture",
        "width": picture.width,
        "height": picture.height,
        "channels": picture.channels,
        "type": type_words(&picture.samples),
        "encoding": encoding_words(picture.encoding),
        "ranges": ranges,
    })
}

/// Ranges and statistics of each color of a Stokes image.
fn colors(image: &StokesImage) -> Vec<(Color, Vec<Range>, Statistics)> {
    let one = |c: &host_image::ColorPlanes| {
        let planes = [("s0", Some(&c.s0)), ("s1", Some(&c.s1)), ("s2", Some(&c.s2)), ("residual", c.residual.as_ref())];
        let ranges = planes.into_iter().filter_map(|(name, plane)| {
            let (min, max) = range(plane?);
            Some((name, min, max))
        });
        let statistics = Statistics::gather([&c.s0, &c.s1, &c.s2], c.flags.as_deref(), c.residual.as_deref());
        (c.color, ranges.collect(), statistics)
    };
    image.colors.iter().map(one).collect()
}

fn stokes_lines(image: &StokesImage) -> Lines {
    let m = &image.metadata;
    let list = |v: &[f64], unit: &str| {
        let text: Vec<String> = v.iter().map(|x| format!("{x}{unit}")).collect();
        if text.is_empty() { "not known".into() } else { text.join(", ") }
    };
    let mut lines = vec![
        ("kind".to_owned(), "Stokes image".to_owned()),
        ("size".into(), format!("{} x {}", image.width, image.height)),
        ("unit".into(), m.unit.clone()),
        ("frame".into(), host_image::FRAME_CONVENTION.into()),
        ("source".into(), m.source.clone()),
        ("made by".into(), m.software_version.clone()),
        ("angles".into(), list(&m.angles_deg, "\u{b0}")),
        ("exposures".into(), list(&m.exposure_us, " \u{b5}s")),
    ];
    let optional = [
        ("gain", m.gain.map(|v| v.to_string())),
        ("black level", m.black_level_dn.map(|v| format!("{v} DN, already subtracted"))),
        ("white level", m.white_level_dn.map(|v| format!("{v} DN"))),
        ("bit depth", m.bit_depth.map(|v| v.to_string())),
        ("color filters", m.bayer.map(|b| b.name().to_owned())),
        ("camera", m.camera_serial.clone()),
        ("capture", m.capture_id.clone()),
        (
            "fixed point",
            m.fixed_point.map(|f| {
                let [a, b, c] = f.error_bound_dn;
                format!(
                    "{} bits, {} of them fractional; error at most {a:.3}, {b:.3}, {c:.3} DN where no sample was dropped",
                    f.word_bits, f.fractional_bits
                )
            }),
        ),
    ];
    lines.extend(optional.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))));
    for (color, ranges, statistics) in colors(image) {
        let color = color.name();
        for (name, min, max) in ranges {
            lines.push((format!("{name} {color}"), format!("{min} to {max} {}", m.unit)));
        }
        lines.push((format!("mean DoLP {color}"), format!("{:.4}", statistics.mean_dolp)));
        let flags = Flags::NAMES.iter().zip(statistics.flagged).filter(|(_, count)| *count > 0);
        let flags: Vec<String> =
            flags.map(|((_, name), count)| format!("{name} {:.3} %", statistics.percent(count))).collect();
        let flags = if flags.is_empty() { "none".to_owned() } else { flags.join(", ") };
        lines.push((format!("flagged {color}"), flags));
    }
    lines
}

fn stokes_json(image: &StokesImage) -> Value {
    let colors: Vec<Value> = colors(image)
        .into_iter()
        .map(|(color, ranges, s)| {
            let ranges: serde_json::Map<String, Value> =
                ranges.into_iter().map(|(name, min, max)| (name.into(), json!([min, max]))).collect();
            let flags: serde_json::Map<String, Value> = Flags::NAMES
                .iter()
                .zip(s.flagged)
                .map(|((_, name), count)| (name.replace(' ', "_"), json!(s.percent(count))))
                .collect();
            json!({ "color": color.name(), "ranges": ranges, "mean_dolp": s.mean_dolp, "percent": flags })
        })
        .collect();
    json!({
        "command": "info",
        "kind": "stokes",
        "width": image.width,
        "height": image.height,
        "frame": host_image::FRAME_CONVENTION,
        "metadata": image.metadata,
        "colors": colors,
    })
}
