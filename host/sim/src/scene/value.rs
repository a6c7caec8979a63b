//! Values as scene files write them: degrees, numbers per color band, mosaics.

use std::fmt;

use host_image::BayerPattern;
use protocol_polar::{Degrees, Radians};
use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};

/// One number for all bands, or `[R, G, B]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bands(pub(super) [f64; 3]);

impl<'de> Deserialize<'de> for Bands {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrThree;
        impl<'de> Visitor<'de> for NumberOrThree {
            type Value = Bands;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or [R, G, B]")
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Bands, E> {
                Ok(Bands([value; 3]))
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Bands, E> {
                // TOML writes 1 and 1.0; every integer a scene can mean here is small.
                i32::try_from(value).map(|v| Bands([f64::from(v); 3])).map_err(E::custom)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Bands, A::Error> {
                let mut bands = [0.0; 3];
                for (index, band) in bands.iter_mut().enumerate() {
                    *band = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
                }
                match seq.next_element::<f64>()? {
                    None => Ok(Bands(bands)),
                    Some(_) => Err(A::Error::invalid_length(4, &self)),
                }
            }
        }
        deserializer.deserialize_any(NumberOrThree)
    }
}

/// One angle in degrees.
pub(super) fn degrees<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Radians, D::Error> {
    Degrees::deserialize(deserializer).map(Degrees::to_radians)
}

/// A list of angles in degrees.
pub(super) fn many_degrees<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Radians>, D::Error> {
    Ok(Vec::<Degrees>::deserialize(deserializer)?.into_iter().map(Degrees::to_radians).collect())
}

/// `mono`, or the first 2 × 2 filters of a mosaic in lower case, as in board files.
pub(super) fn mosaic<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<BayerPattern>, D::Error> {
    let name = String::deserialize(deserializer)?;
    if name == "mono" {
        return Ok(None);
    }
    let found = BayerPattern::ALL.into_iter().find(|p| p.name().to_ascii_lowercase() == name);
    found.map(Some).ok_or_else(|| D::Error::unknown_variant(&name, &["mono", "rggb", "bggr", "grbg", "gbrg"]))
}
