//! A map over the sample: pixels, how they are looked up, and how files become them.
//!
//! The map covers the whole sample; row 0 is its upper edge (+y), column 0 its left edge (−x).

use std::path::PathBuf;

use host_image::{Picture, Samples};
use serde::Deserialize;

use super::locate::At;
use crate::SimError;

/// A table that names a map, such as `albedo_map = { file = "albedo.png", coding = "srgb" }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMap {
    file: PathBuf,
    /// How the numbers of the file follow what they mean. Said by the scene, because files often do not.
    coding: Coding,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Coding {
    /// Proportional; integers are shares of their largest value.
    Linear,
    /// The sRGB curve (IEC 61966-2-1).
    Srgb,
    /// The square root of the value is stored, as in maps of "perceptual" roughness r with α = r².
    Root,
}

/// Samples over the unit square, bilinear between pixel centers, constant beyond the outermost.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    width: usize,
    height: usize,
    channels: usize,
    samples: Vec<f32>,
}

impl Texture {
    /// (width, height) in pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Whether all three bands are the same.
    pub(crate) fn is_grey(&self) -> bool {
        self.channels == 1
    }

    /// Smallest and largest sample.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        let fold = |(low, high): (f32, f32), v: &f32| (low.min(*v), high.max(*v));
        let (low, high) = self.samples.iter().fold((f32::INFINITY, f32::NEG_INFINITY), fold);
        (f64::from(low), f64::from(high))
    }

    /// The value at (u, v) in [0, 1]², u to the right and v **down** from the upper left corner. A grey map answers the same
    /// in all three.
    #[must_use]
    pub fn at(&self, u: f64, v: f64) -> [f64; 3] {
        let (left, right, fx) = between(u, self.width);
        let (above, below, fy) = between(v, self.height);
        let corners = [
            (above, left, (1.0 - fx) * (1.0 - fy)),
            (above, right, fx * (1.0 - fy)),
            (below, left, (1.0 - fx) * fy),
            (below, right, fx * fy),
        ];
        let mut sum = [0.0; 3];
        for (row, column, weight) in corners {
            let first = (row * self.width + column) * self.channels;
            for (k, total) in sum.iter_mut().enumerate() {
                *total += weight * f64::from(self.samples[first + k.min(self.channels - 1)]);
            }
        }
        sum
    }
}

impl RawMap {
    /// Reads the file; `at` is the table of the map, `channels` what the use calls for (1 or 3).
    pub(super) fn load(&self, at: &At<'_>, channels: usize) -> Result<Texture, SimError> {
        self.texture(at, channels, read_picture(at, "file", &self.file)?)
    }

    /// Reads a map of vectors: integers hold (n + 1)/2, floats the vector itself.
    pub(super) fn load_vectors(&self, at: &At<'_>) -> Result<Texture, SimError> {
        let picture = read_picture(at, "file", &self.file)?;
        let halved = !matches!(picture.samples, Samples::F32(_));
        let mut texture = self.texture(at, 3, picture)?;
        if halved {
            texture.samples.iter_mut().for_each(|v| *v = 2.0 * *v - 1.0);
        }
        Ok(texture)
    }

    fn texture(&self, at: &At<'_>, channels: usize, picture: Picture) -> Result<Texture, SimError> {
        let found = picture.channels;
        at.check(found == channels || found == 1 && channels == 3, "file", format!("{found} channels"), || {
            format!("{channels} channels")
        })?;
        let mut samples = match picture.samples {
            Samples::U8(v) => v.into_iter().map(|x| f32::from(x) / 255.0).collect(),
            Samples::U16(v) => v.into_iter().map(|x| f32::from(x) / 65535.0).collect(),
            Samples::F32(v) => v,
        };
        for sample in &mut samples {
            *sample = match self.coding {
                Coding::Linear => *sample,
                Coding::Srgb if *sample <= 0.040_45 => *sample / 12.92,
                Coding::Srgb => ((*sample + 0.055) / 1.055).powf(2.4),
                Coding::Root => *sample * *sample,
            };
        }
        Ok(Texture { width: picture.width, height: picture.height, channels: found, samples })
    }
}

/// A picture the scene names, relative to the scene's folder.
pub(super) fn read_picture(at: &At<'_>, key: &str, file: &std::path::Path) -> Result<Picture, SimError> {
    Picture::read(&at.resolve(file)).map_err(|source| SimError::Map { place: at.place(key), source: Box::new(source) })
}

/// The two pixels around coordinate `t` in [0, 1], and how far between their centers it lies.
fn between(t: f64, size: usize) -> (usize, usize, f64) {
    let x = (t * real(size) - 0.5).clamp(0.0, real(size - 1));
    let low = nearest(x.floor(), size);
    (low, (low + 1).min(size - 1), x - real(low))
}

/// The index in [0, `size`) of a coordinate that is not far outside.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the float-to-integer cast saturates at 0, and the result is bounded by the size"
)]
pub(super) fn nearest(x: f64, size: usize) -> usize {
    (x as usize).min(size - 1)
}

#[expect(clippy::cast_precision_loss, reason = "rows and columns of a picture are far below 2^52")]
pub(super) fn real(size: usize) -> f64 {
    size as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centers_are_exact_and_edges_hold() {
        let map = Texture { width: 2, height: 2, channels: 1, samples: vec![1.0, 2.0, 3.0, 5.0] };
        for (u, v, expected) in [(0.25, 0.25, 1.0), (0.75, 0.25, 2.0), (0.25, 0.75, 3.0), (0.5, 0.5, 2.75)] {
            assert!((map.at(u, v)[0] - expected).abs() < 1e-12, "{u} {v}");
        }
        assert!((map.at(1.0, 1.0)[2] - 5.0).abs() < 1e-12 && (map.at(0.0, 0.0)[1] - 1.0).abs() < 1e-12);
    }
}
