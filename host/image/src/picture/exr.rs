//! OpenEXR frames: one flat layer with `Y`, or with `R`, `G`, `B` (alpha is dropped), half or float. Linear by the
//! format's definition.

use std::collections::HashMap;
use std::io::{BufRead, Seek};
use std::path::Path;

use exr::prelude::FlatSamples;

use super::{Encoding, Picture, Samples};
use crate::ImageError;
use crate::error::FileContext;
use crate::exr_file::{self, PlaneRef};

pub(super) fn read(reader: impl BufRead + Seek + Send, file: FileContext<'_>) -> Result<Picture, ImageError> {
    let mut checked = exr_file::open(reader, file)?;
    let names: Vec<String> = checked.channel_names().into_iter().filter(|n| n != "A").collect();
    let wanted: &[&str] = match names.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["Y"] => &["Y"],
        ["B", "G", "R"] => &["R", "G", "B"],
        other => {
            return Err(
                file.unsupported(format!("OpenEXR channels {other:?}; Y, or R, G and B in one layer, are read"))
            );
        }
    };
    let (width, height) = (checked.width, checked.height);
    let mut planes = checked.read_channels(file)?;
    let mut columns = Vec::new();
    for name in wanted {
        let plane = match planes.remove(*name) {
            Some(FlatSamples::F32(v)) => v,
            Some(FlatSamples::F16(v)) => v.into_iter().map(|h| h.to_f32()).collect(),
            Some(FlatSamples::U32(_)) => {
                return Err(file.unsupported(format!("OpenEXR channel {name} of integers; half and float are read")));
            }
            None => return Err(file.missing(format!("channel {name}"))),
        };
        columns.push(plane);
    }
    let samples = match columns.as_slice() {
        [r, g, b] => r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b]).collect(),
        _ => columns.swap_remove(0),
    };
    Ok(Picture { width, height, channels: wanted.len(), samples: Samples::F32(samples), encoding: Encoding::Linear })
}

pub(super) fn write(picture: &Picture, path: &Path) -> Result<(), ImageError> {
    let Samples::F32(samples) = &picture.samples else {
        return Err(ImageError::Unsupported {
            path: path.into(),
            what: "OpenEXR is written from float pictures; integers go to PNG or npy".into(),
        });
    };
    let plane = |i: usize| samples.iter().skip(i).step_by(picture.channels).copied().collect::<Vec<f32>>();
    let planes: Vec<Vec<f32>> = (0..picture.channels).map(plane).collect();
    let channels = picture.channel_names().iter().zip(&planes).map(|(n, p)| ((*n).to_owned(), PlaneRef::F32(p)));
    exr_file::save(path, (picture.width, picture.height), channels, HashMap::new())
}
