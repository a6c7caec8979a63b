//! Any number of named planes in one OpenEXR file, with strings that say what they are.
//!
//! Channel names are layer.channel as every OpenEXR program shows them (`albedo.R`, `sigma.eta`); a name without a dot is
//! a layer of its own. Planes are row-major height × width; rows run *down*. Unlike in a Stokes image NaN and infinities
//! are allowed: a map says so where it has no value.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::FlatSamples;

use crate::ImageError;
use crate::error::MAX_PIXELS;
use crate::exr_file::{self, PlaneRef};
use crate::picture::open;

/// What the names of our own attributes start with.
const PREFIX: &str = "brewster:";
/// The longest name OpenEXR 2 takes.
const MAX_NAME: usize = 255;

/// Samples of one channel, row-major height × width; owned by what was read, lent by what is to be written.
#[derive(Clone, Debug, PartialEq)]
pub enum Plane<'a> {
    /// Float samples; half ones are widened when they are read.
    F32(Cow<'a, [f32]>),
    /// Unsigned integers.
    U32(Cow<'a, [u32]>),
}

/// Named planes of one size, and attributes.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Planes by channel name: printable ASCII, at most 255 bytes.
    pub channels: BTreeMap<String, Plane<'a>>,
    /// Strings (UTF-8) by name, in the file with `brewster:` before it. Others of a file are not read.
    pub attributes: BTreeMap<String, String>,
    /// The file it was loaded from, for what is missing in it; empty for one that was made here.
    pub path: PathBuf,
}

impl<'a> Layers<'a> {
    /// No planes yet.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, channels: BTreeMap::new(), attributes: BTreeMap::new(), path: PathBuf::new() }
    }

    /// Adds a plane that is lent.
    pub fn lend_f32(&mut self, name: &str, samples: &'a [f32]) {
        self.channels.insert(name.to_owned(), Plane::F32(Cow::Borrowed(samples)));
    }

    /// Adds a plane that is lent.
    pub fn lend_u32(&mut self, name: &str, samples: &'a [u32]) {
        self.channels.insert(name.to_owned(), Plane::U32(Cow::Borrowed(samples)));
    }

    /// Takes a float plane out.
    ///
    /// # Errors
    /// [`ImageError::Missing`]; [`ImageError::Unsupported`] for integers.
    pub fn take_f32(&mut self, name: &str) -> Result<Vec<f32>, ImageError> {
        match self.channels.remove(name) {
            Some(Plane::F32(v)) => Ok(v.into_owned()),
            Some(Plane::U32(_)) => Err(self.unsupported(format!("channel {name} is uint, not float"))),
            None => Err(self.missing(format!("channel {name}"))),
        }
    }

    /// Takes an integer plane out.
    ///
    /// # Errors
    /// [`ImageError::Missing`]; [`ImageError::Unsupported`] for float samples.
    pub fn take_u32(&mut self, name: &str) -> Result<Vec<u32>, ImageError> {
        match self.channels.remove(name) {
            Some(Plane::U32(v)) => Ok(v.into_owned()),
            Some(Plane::F32(_)) => Err(self.unsupported(format!("channel {name} is float, not uint"))),
            None => Err(self.missing(format!("channel {name}"))),
        }
    }

    /// An attribute that must be there, by its name without `brewster:`.
    ///
    /// # Errors
    /// [`ImageError::Missing`].
    pub fn required(&self, name: &str) -> Result<&str, ImageError> {
        let missing = || self.missing(format!("attribute {PREFIX}{name}"));
        self.attributes.get(name).map(String::as_str).ok_or_else(missing)
    }

    /// Saves as one OpenEXR file, lossless: float channels are f32 bit for bit, NaN included. Atomic; the same content
    /// gives the same bytes.
    ///
    /// # Errors
    /// [`ImageError::Inconsistent`] before a file is touched; [`ImageError::Io`].
    pub fn save(&self, path: &Path) -> Result<(), ImageError> {
        self.check()?;
        let channels = self.channels.iter().map(|(name, plane)| {
            let samples = match plane {
                Plane::F32(v) => PlaneRef::F32(v),
                Plane::U32(v) => PlaneRef::U32(v),
            };
            (name.clone(), samples)
        });
        let named =
            |(name, value): (&String, &String)| (Text::from(format!("{PREFIX}{name}").as_str()), exr_file::text(value));
        let attributes = self.attributes.iter().map(named).collect();
        exr_file::save(path, (self.width, self.height), channels, attributes)
    }

    fn check(&self) -> Result<(), ImageError> {
        let wrong = |what: String| Err(ImageError::Inconsistent { what });
        let (w, h) = (self.width, self.height);
        let pixels = match w.checked_mul(h) {
            Some(n) if n > 0 && n as u64 <= MAX_PIXELS => n,
            _ => return wrong(format!("{w} x {h} pixels; 1 to {MAX_PIXELS} are held")),
        };
        if self.channels.is_empty() {
            return wrong("no channels".into());
        }
        for (name, plane) in &self.channels {
            let held = match plane {
                Plane::F32(v) => v.len(),
                Plane::U32(v) => v.len(),
            };
            if held != pixels {
                return wrong(format!("{held} samples in channel {name} of {w} x {h} pixels"));
            }
        }
        let names = self.channels.keys().map(|n| (n, 0)).chain(self.attributes.keys().map(|n| (n, PREFIX.len())));
        for (name, prefix) in names {
            let printable = name.bytes().all(|b| b.is_ascii_graphic() || b == b' ');
            if name.is_empty() || name.len() + prefix > MAX_NAME || !printable {
                return wrong(format!("the name {name:?}; 1 to {MAX_NAME} printable ASCII characters are written"));
            }
        }
        Ok(())
    }

    fn unsupported(&self, what: String) -> ImageError {
        ImageError::Unsupported { path: self.path.clone(), what }
    }

    fn missing(&self, name: String) -> ImageError {
        ImageError::Missing { path: self.path.clone(), name }
    }
}

impl Layers<'static> {
    /// Loads all channels of a flat OpenEXR file of one part, from any program: half, float and uint at full resolution.
    ///
    /// # Errors
    /// [`ImageError::Unsupported`] for deep files, several parts and subsampled channels; [`ImageError::Malformed`] for
    /// files cut short and strings that are not UTF-8; [`ImageError::TooLarge`]; [`ImageError::Io`].
    pub fn load(path: &Path) -> Result<Self, ImageError> {
        let (reader, file) = open(path)?;
        let mut checked = exr_file::open(reader, file)?;
        let mut layers = Self { path: path.into(), ..Layers::new(checked.width, checked.height) };
        for (name, value) in checked.attributes() {
            let name = name.to_string();
            if let (Some(own), AttributeValue::Text(value)) = (name.strip_prefix(PREFIX), value) {
                let value = std::str::from_utf8(value.as_slice())
                    .map_err(|_| file.malformed(format!("attribute {name} is not UTF-8")))?;
                layers.attributes.insert(own.to_owned(), value.to_owned());
            }
        }
        let planes = checked.read_channels(file)?.into_iter().map(|(name, samples)| {
            let plane = match samples {
                FlatSamples::F32(v) => Plane::F32(v.into()),
                FlatSamples::F16(v) => Plane::F32(v.into_iter().map(|h| h.to_f32()).collect()),
                FlatSamples::U32(v) => Plane::U32(v.into()),
            };
            (name, plane)
        });
        layers.channels = planes.collect();
        Ok(layers)
    }
}

#[cfg(test)]
mod tests;
