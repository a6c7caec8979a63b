//! Effects of the sensor, one row of photosites at a time. Each that is simulated is one stage of a row; one that is not is not
//! there.

pub(crate) mod bayer;
pub(crate) mod dark;
pub(crate) mod prnu;
pub(crate) mod quantization;
pub(crate) mod read;
pub(crate) mod saturation;
pub(crate) mod shot;
