//! Stokes images as OpenEXR files: channels are named layer.color, so viewers show `S0` as one RGB layer.

use std::collections::HashMap;
use std::path::Path;

use exr::prelude::FlatSamples;

use super::attributes::{Attributes, from_metadata};
use super::{Color, ColorPlanes, StokesImage};
use crate::ImageError;
use crate::error::FileContext;
use crate::exr_file::{self, PlaneRef};
use crate::picture::open;

pub(super) fn save(image: &StokesImage, path: &Path) -> Result<(), ImageError> {
    // OpenEXR has no 8-bit channels; its uint is 32 bits wide, and run lengths make the zeros vanish.
    let wide = |flags: &Vec<u8>| flags.iter().map(|&f| u32::from(f)).collect::<Vec<u32>>();
    let flags: Vec<Option<Vec<u32>>> = image.colors.iter().map(|c| c.flags.as_ref().map(wide)).collect();
    let channels = image.colors.iter().zip(&flags).flat_map(|(planes, flags)| {
        let floats = planes.float_planes().map(|(plane, v)| (plane, PlaneRef::F32(v)));
        let all = floats.chain(flags.iter().map(|f| ("FLAGS", PlaneRef::U32(f))));
        all.map(|(plane, samples)| (format!("{plane}.{}", planes.color.name()), samples))
    });
    exr_file::save(path, (image.width, image.height), channels, from_metadata(&image.metadata))
}

pub(super) fn load(path: &Path) -> Result<StokesImage, ImageError> {
    let (reader, file) = open(path)?;
    let mut checked = exr_file::open(reader, file)?;
    let metadata = Attributes { file, find: |name: &str| checked.attribute(name) }.metadata()?;
    let names = checked.channel_names();
    let mosaic = names.iter().any(|n| n.ends_with(".Y"));
    let expected: &[Color] = if mosaic { &[Color::Y] } else { &[Color::R, Color::G, Color::B] };
    for color in expected {
        for plane in ["S0", "S1", "S2"] {
            let name = format!("{plane}.{}", color.name());
            if !names.contains(&name) {
                return Err(file.missing(format!("channel {name}")));
            }
        }
    }
    let (width, height) = (checked.width, checked.height);
    let mut channels = Channels { by_name: checked.read_channels(file)?, file, width };
    let colors = expected
        .iter()
        .map(|&color| {
            Ok(ColorPlanes {
                color,
                s0: channels.required("S0", color)?,
                s1: channels.required("S1", color)?,
                s2: channels.required("S2", color)?,
                flags: channels.flags(color)?,
                residual: channels.float("RESIDUAL", color)?,
            })
        })
        .collect::<Result<_, ImageError>>()?;
    Ok(StokesImage { width, height, colors, metadata })
}

struct Channels<'a> {
    by_name: HashMap<String, FlatSamples>,
    file: FileContext<'a>,
    width: usize,
}

impl Channels<'_> {
    fn float(&mut self, plane: &str, color: Color) -> Result<Option<Vec<f32>>, ImageError> {
        let name = format!("{plane}.{}", color.name());
        match self.by_name.remove(&name) {
            None => Ok(None),
            Some(FlatSamples::F32(v)) => {
                self.file.finite(&v, self.width, &name)?;
                Ok(Some(v))
            }
            Some(_) => Err(self.file.unsupported(format!("channel {name} is not float"))),
        }
    }

    fn required(&mut self, plane: &str, color: Color) -> Result<Vec<f32>, ImageError> {
        let missing = format!("channel {plane}.{}", color.name());
        self.float(plane, color)?.ok_or_else(|| self.file.missing(missing))
    }

    fn flags(&mut self, color: Color) -> Result<Option<Vec<u8>>, ImageError> {
        let name = format!("FLAGS.{}", color.name());
        match self.by_name.remove(&name) {
            None => Ok(None),
            Some(FlatSamples::U32(v)) => {
                let narrow = |&wide: &u32| {
                    u8::try_from(wide).map_err(|_| self.file.malformed(format!("flags {wide:#x} in channel {name}")))
                };
                v.iter().map(narrow).collect::<Result<_, _>>().map(Some)
            }
            Some(_) => Err(self.file.unsupported(format!("channel {name} is not uint"))),
        }
    }
}
