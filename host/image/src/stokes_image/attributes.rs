//! [`StokesMetadata`] as OpenEXR attributes, all named `brewster:...`.
//!
//! | attribute | type | |
//! |---|---|---|
//! | `schema` | int | 1 |
//! | `frame` | string | [`FRAME_CONVENTION`], refused if it differs |
//! | `unit`, `source`, `software_version` | string | UTF-8 |
//! | `camera_serial`, `capture_id` | string | optional |
//! | `angles_deg`, `exposure_us` | string | numbers with spaces between, shortest decimals that read back exactly |
//! | `gain`, `black_level_dn`, `white_level_dn` | double | optional |
//! | `bit_depth` | int | optional |
//! | `word_bits`, `fractional_bits` (int), `error_bound_dn` (string, 3 numbers) | | optional, all or none |
//! | `bayer` | string | optional; RGGB, BGGR, GRBG or GBRG |

use std::collections::HashMap;

use exr::meta::attribute::{AttributeValue, Text};

use super::{BayerPattern, FRAME_CONVENTION, FixedPointFormat, StokesMetadata};
use crate::ImageError;
use crate::error::FileContext;
use crate::exr_file::text;

const PREFIX: &str = "brewster:";
const SCHEMA: i32 = 1;

pub(super) fn from_metadata(m: &StokesMetadata) -> HashMap<Text, AttributeValue> {
    let optional = [
        m.camera_serial.as_ref().map(|v| ("camera_serial", text(v))),
        m.capture_id.as_ref().map(|v| ("capture_id", text(v))),
        m.gain.map(|v| ("gain", AttributeValue::F64(v))),
        m.black_level_dn.map(|v| ("black_level_dn", AttributeValue::F64(v))),
        m.white_level_dn.map(|v| ("white_level_dn", AttributeValue::F64(v))),
        m.bit_depth.map(|v| ("bit_depth", AttributeValue::I32(v.into()))),
        m.fixed_point.map(|f| ("word_bits", AttributeValue::I32(f.word_bits.into()))),
        m.fixed_point.map(|f| ("fractional_bits", AttributeValue::I32(f.fractional_bits.into()))),
        m.fixed_point.map(|f| ("error_bound_dn", numbers(&f.error_bound_dn))),
        m.bayer.map(|b| ("bayer", text(b.name()))),
    ];
    let always = [
        ("schema", AttributeValue::I32(SCHEMA)),
        ("frame", text(FRAME_CONVENTION)),
        ("unit", text(&m.unit)),
        ("source", text(&m.source)),
        ("software_version", text(&m.software_version)),
        ("angles_deg", numbers(&m.angles_deg)),
        ("exposure_us", numbers(&m.exposure_us)),
    ];
    let all = always.into_iter().chain(optional.into_iter().flatten());
    all.map(|(name, value)| (Text::from(format!("{PREFIX}{name}").as_str()), value)).collect()
}

fn numbers(values: &[f64]) -> AttributeValue {
    text(&values.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
}

/// Attributes by name, as the file has them.
pub(super) struct Attributes<'a, F: Fn(&str) -> Option<&'a AttributeValue>> {
    pub(super) file: FileContext<'a>,
    pub(super) find: F,
}

impl<'a, F: Fn(&str) -> Option<&'a AttributeValue>> Attributes<'a, F> {
    pub(super) fn metadata(&self) -> Result<StokesMetadata, ImageError> {
        let frame = self.required("frame", self.text("frame")?)?;
        let schema = self.required("schema", self.integer("schema")?)?;
        if schema != SCHEMA {
            return Err(self.file.unsupported(format!("brewster:schema {schema}; {SCHEMA} is read")));
        }
        if frame != FRAME_CONVENTION {
            return Err(self.file.unsupported(format!("frame convention {frame:?}; {FRAME_CONVENTION:?} is read")));
        }
        let metadata = StokesMetadata {
            unit: self.required("unit", self.text("unit")?)?,
            angles_deg: self.required("angles_deg", self.numbers("angles_deg")?)?,
            exposure_us: self.required("exposure_us", self.numbers("exposure_us")?)?,
            gain: self.double("gain")?,
            black_level_dn: self.double("black_level_dn")?,
            white_level_dn: self.double("white_level_dn")?,
            bit_depth: self.narrow("bit_depth")?,
            fixed_point: self.fixed_point()?,
            bayer: self.bayer()?,
            source: self.required("source", self.text("source")?)?,
            camera_serial: self.text("camera_serial")?,
            capture_id: self.text("capture_id")?,
            software_version: self.required("software_version", self.text("software_version")?)?,
        };
        metadata.check().map_err(|what| self.file.malformed(what))?;
        Ok(metadata)
    }

    fn fixed_point(&self) -> Result<Option<FixedPointFormat>, ImageError> {
        let (word, fraction) = (self.narrow("word_bits")?, self.narrow("fractional_bits")?);
        let bound = self.numbers("error_bound_dn")?;
        if word.is_none() && fraction.is_none() && bound.is_none() {
            return Ok(None);
        }
        let bound = self.required("error_bound_dn", bound)?;
        Ok(Some(FixedPointFormat {
            word_bits: self.required("word_bits", word)?,
            fractional_bits: self.required("fractional_bits", fraction)?,
            error_bound_dn: bound.try_into().map_err(|v| self.bad("error_bound_dn", format!("{v:?}")))?,
        }))
    }

    fn bayer(&self) -> Result<Option<BayerPattern>, ImageError> {
        let Some(name) = self.text("bayer")? else { return Ok(None) };
        match BayerPattern::ALL.into_iter().find(|b| b.name() == name) {
            Some(pattern) => Ok(Some(pattern)),
            None => Err(self.file.unsupported(format!("brewster:bayer {name:?}"))),
        }
    }

    fn value(&self, name: &str) -> Option<&'a AttributeValue> {
        (self.find)(&format!("{PREFIX}{name}"))
    }

    fn required<T>(&self, name: &str, value: Option<T>) -> Result<T, ImageError> {
        value.ok_or_else(|| self.file.missing(format!("attribute {PREFIX}{name}")))
    }

    fn bad(&self, name: &str, seen: impl std::fmt::Display) -> ImageError {
        self.file.malformed(format!("attribute {PREFIX}{name} is {seen}"))
    }

    fn text(&self, name: &str) -> Result<Option<String>, ImageError> {
        match self.value(name) {
            None => Ok(None),
            Some(AttributeValue::Text(v)) => match std::str::from_utf8(v.as_slice()) {
                Ok(v) => Ok(Some(v.to_owned())),
                Err(_) => Err(self.bad(name, "not UTF-8")),
            },
            Some(other) => Err(self.bad(name, format!("{other:?}, not a string"))),
        }
    }

    fn integer(&self, name: &str) -> Result<Option<i32>, ImageError> {
        match self.value(name) {
            None => Ok(None),
            Some(AttributeValue::I32(v)) => Ok(Some(*v)),
            Some(other) => Err(self.bad(name, format!("{other:?}, not an int"))),
        }
    }

    fn narrow<T: TryFrom<i32>>(&self, name: &str) -> Result<Option<T>, ImageError> {
        let Some(wide) = self.integer(name)? else { return Ok(None) };
        T::try_from(wide).map(Some).map_err(|_| self.bad(name, wide))
    }

    fn double(&self, name: &str) -> Result<Option<f64>, ImageError> {
        match self.value(name) {
            None => Ok(None),
            Some(AttributeValue::F64(v)) => Ok(Some(*v)),
            Some(other) => Err(self.bad(name, format!("{other:?}, not a double"))),
        }
    }

    fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, ImageError> {
        let Some(list) = self.text(name)? else { return Ok(None) };
        let values: Result<Vec<f64>, _> = list.split_ascii_whitespace().map(str::parse).collect();
        values.map(Some).map_err(|_| self.bad(name, format!("{list:?}, not numbers")))
    }
}
