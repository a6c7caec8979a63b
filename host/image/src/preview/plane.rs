//! Previews of planes that are not Stokes vectors: one number per pixel, a reflectance, a normal, or a set of reasons.
//!
//! A larger plane is averaged over blocks; a sample that is not finite is no value and does not count, a block of
//! nothing else is grey.

use super::color::{self, NO_FLAG, NO_VALUE, Rgb};
use super::legend::{Legend, Scale, number};
use super::share;
use crate::{ImageError, Picture};

/// A plane to show, and how.
#[derive(Clone, Debug)]
pub struct PlanePreview<'a> {
    /// At most 29 characters.
    pub title: &'a str,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Most columns of the picture, its legend not counted.
    pub max_width: usize,
    /// What the colors say.
    pub colors: Colors<'a>,
    /// More lines for the legend.
    pub notes: Vec<String>,
}

/// Planes, row-major height × width, and how their numbers become colors.
#[derive(Clone, Debug)]
pub enum Colors<'a> {
    /// Viridis from `min` to `max`, clamped.
    Scalar {
        /// One number per pixel.
        values: &'a [f32],
        /// Lower end of the scale.
        min: f64,
        /// Upper end, above `min`.
        max: f64,
        /// Stands above the scale.
        unit: &'a str,
    },
    /// Blue to red through white from −`max` to `max`, clamped.
    Signed {
        /// One number per pixel.
        values: &'a [f32],
        /// End of the scale, > 0.
        max: f64,
        /// Stands above the scale.
        unit: &'a str,
    },
    /// Linear R, G, B; `white` is the brightest that is shown, > 0. sRGB coded.
    Reflectance {
        /// R, G, B.
        values: [&'a [f32]; 3],
        /// What is shown as 255.
        white: f64,
    },
    /// Unit normals x, y, z as (n + 1)/2.
    Normal {
        /// X, Y, Z.
        values: [&'a [f32]; 3],
    },
    /// Bit sets; the color is that of the lowest bit set.
    Categories {
        /// One set per pixel.
        sets: &'a [u32],
        /// Names of the bits, from bit 0; at most 32.
        names: &'a [String],
    },
}

/// Draws a plane with its legend: 8-bit RGB, sRGB coded; the picture's top left pixel is at (12, 34).
///
/// # Errors
/// [`ImageError::Inconsistent`] for sizes that do not agree, and for a scale without an extent.
pub fn plane_preview(plane: &PlanePreview<'_>) -> Result<Picture, ImageError> {
    plane.check()?;
    let blocks = Blocks::new(plane.width, plane.height, plane.max_width);
    let (scale, mut notes, colors) = match &plane.colors {
        Colors::Scalar { values, min, max, unit } => {
            let (min, max) = (*min, *max);
            let show = |[v]: [f64; 1]| color::dolp_color((v - min) / (max - min));
            let bar = Scale::Bar { min, max, unit: (*unit).to_owned(), color: color::dolp_color };
            (bar, ends(min, max), blocks.colors([values], show))
        }
        Colors::Signed { values, max, unit } => {
            let show = |[v]: [f64; 1]| color::signed_color(0.5 + 0.5 * v / max);
            let bar = Scale::Bar { min: -max, max: *max, unit: (*unit).to_owned(), color: color::signed_color };
            (bar, ends(-max, *max), blocks.colors([values], show))
        }
        Colors::Reflectance { values, white } => {
            let note = format!("white = {}, sRGB coded from linear", number(*white, white / 100.0));
            let show = |rgb: [f64; 3]| color::linear_color(rgb.map(|v| v / white));
            (Scale::Categories, vec![(None, note)], blocks.colors(*values, show))
        }
        Colors::Normal { values } => {
            let notes = ["middle: z, rim: horizon", "angle: azimuth, x right, y up"].map(|n| (None, n.to_owned()));
            (Scale::Wheel { color: wheel_color }, notes.to_vec(), blocks.colors(*values, normal_color))
        }
        Colors::Categories { sets, names } => {
            let notes = categories(sets, names);
            let show = |set: u32| match set.trailing_zeros() {
                32 => NO_FLAG,
                bit => color::category_color(bit as usize),
            };
            (Scale::Categories, notes, blocks.sets(sets).into_iter().map(show).collect())
        }
    };
    if !matches!(plane.colors, Colors::Categories { .. }) {
        notes.push((Some(NO_VALUE), "no value".into()));
    }
    notes.extend(plane.notes.iter().map(|n| (None, n.clone())));
    let legend = Legend { title: plane.title, scale, notes };
    Ok(legend.draw((blocks.columns, blocks.rows), colors.into_iter()).into_picture())
}

impl PlanePreview<'_> {
    fn check(&self) -> Result<(), ImageError> {
        let wrong = |what: String| Err(ImageError::Inconsistent { what });
        let pixels = self.width.checked_mul(self.height).filter(|n| *n > 0);
        let (lengths, min, max): (Vec<usize>, f64, f64) = match &self.colors {
            Colors::Scalar { values, min, max, .. } => (vec![values.len()], *min, *max),
            Colors::Signed { values, max, .. } => (vec![values.len()], 0.0, *max),
            Colors::Reflectance { values, white } => (values.iter().map(|v| v.len()).collect(), 0.0, *white),
            Colors::Normal { values } => (values.iter().map(|v| v.len()).collect(), 0.0, 1.0),
            Colors::Categories { sets, names } if names.len() <= 32 => (vec![sets.len()], 0.0, 1.0),
            Colors::Categories { names, .. } => return wrong(format!("{} names of 32 bits", names.len())),
        };
        if let Some(held) = lengths.into_iter().find(|n| Some(*n) != pixels) {
            return wrong(format!("{held} samples for {} x {} pixels", self.width, self.height));
        }
        if self.max_width == 0 || !(min.is_finite() && max.is_finite() && min < max) {
            return wrong(format!("a preview of {} columns with a scale from {min} to {max}", self.max_width));
        }
        Ok(())
    }
}

/// Blocks of equal size, smaller at the right and lower edge, so that at most so many columns remain.
struct Blocks {
    width: usize,
    block: usize,
    columns: usize,
    rows: usize,
}

impl Blocks {
    fn new(width: usize, height: usize, max_width: usize) -> Self {
        let block = width.div_ceil(max_width);
        Self { width, block, columns: width.div_ceil(block), rows: height.div_ceil(block) }
    }

    /// The color of each block's mean over the pixels all of whose components are finite.
    fn colors<const N: usize>(&self, planes: [&[f32]; N], color: impl Fn([f64; N]) -> Rgb) -> Vec<Rgb> {
        let mut sums = vec![([0.0; N], 0_u32); self.columns * self.rows];
        for i in 0..planes.first().map_or(0, |p| p.len()) {
            let values = planes.map(|p| p.get(i).map_or(f64::NAN, |v| f64::from(*v)));
            if let Some((sum, count)) = sums.get_mut(self.at(i)).filter(|_| values.iter().all(|v| v.is_finite())) {
                sum.iter_mut().zip(values).for_each(|(s, v)| *s += v);
                *count += 1;
            }
        }
        let mean = |(sum, count): ([f64; N], u32)| {
            if count == 0 { NO_VALUE } else { color(sum.map(|s| s / f64::from(count))) }
        };
        sums.into_iter().map(mean).collect()
    }

    /// All bits that are set in each block.
    fn sets(&self, sets: &[u32]) -> Vec<u32> {
        let mut all = vec![0; self.columns * self.rows];
        for (i, set) in sets.iter().enumerate() {
            if let Some(sum) = all.get_mut(self.at(i)) {
                *sum |= set;
            }
        }
        all
    }

    /// The block of sample `i`.
    fn at(&self, i: usize) -> usize {
        i / self.width / self.block * self.columns + i % self.width / self.block
    }
}

fn ends(min: f64, max: f64) -> Vec<(Option<Rgb>, String)> {
    let step = (max - min) / 1000.0;
    vec![(None, format!("ends: {} and below, {} and above", number(min, step), number(max, step)))]
}

/// The mean of a block's normals, made a unit vector again.
fn normal_color(sum: [f64; 3]) -> Rgb {
    let length = sum.iter().map(|n| n * n).sum::<f64>().sqrt();
    if length > 0.0 { color::normal_color(sum.map(|n| n / length)) } else { NO_VALUE }
}

fn wheel_color(azimuth: f64, tilt: f64) -> Option<Rgb> {
    let tilt = tilt.min(1.0);
    Some(color::normal_color([tilt * azimuth.cos(), tilt * azimuth.sin(), (1.0 - tilt * tilt).sqrt()]))
}

/// Counts are of the plane at full size. Names may be long: the share stands first, and lines break after it.
fn categories(sets: &[u32], names: &[String]) -> Vec<(Option<Rgb>, String)> {
    let line = |color: Rgb, name: &str, count: usize| (Some(color), format!("{} {name}", share(count, sets.len())));
    let bit_count = |bit: usize| sets.iter().filter(|s| **s >> bit & 1 == 1).count();
    let named = names.iter().enumerate().map(|(bit, name)| line(color::category_color(bit), name, bit_count(bit)));
    let mut notes: Vec<_> = named.collect();
    notes.push(line(NO_FLAG, "none", sets.iter().filter(|s| **s == 0).count()));
    notes.push((None, "a pixel with several has the color of the first in this list".into()));
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Samples;

    fn show(width: usize, max_width: usize, colors: Colors<'_>) -> Picture {
        let height = match &colors {
            Colors::Categories { sets, .. } => sets.len() / width,
            Colors::Scalar { values, .. } | Colors::Signed { values, .. } => values.len() / width,
            Colors::Reflectance { values, .. } | Colors::Normal { values } => values[0].len() / width,
        };
        let notes = vec!["a note".into()];
        plane_preview(&PlanePreview { title: "a plane", width, height, max_width, colors, notes }).unwrap()
    }

    fn pixel(picture: &Picture, column: usize, row: usize) -> Rgb {
        let Samples::U8(rgb) = &picture.samples else { panic!("8 bit") };
        let at = 3 * ((34 + row) * picture.width + 12 + column);
        [rgb[at], rgb[at + 1], rgb[at + 2]]
    }

    #[test]
    fn numbers_have_the_colors_of_the_bar_beside_them() {
        let values = [1.3, 1.5, 1.7, f32::NAN, 9.0, -9.0];
        let shown = show(3, 3, Colors::Scalar { values: &values, min: 1.3, max: 1.7, unit: "eta" });
        for (i, at) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            assert_eq!(pixel(&shown, i, 0), color::dolp_color(at));
        }
        assert_eq!(pixel(&shown, 0, 1), NO_VALUE);
        assert_eq!((pixel(&shown, 1, 1), pixel(&shown, 2, 1)), (color::dolp_color(1.0), color::dolp_color(0.0)));
        // The bar starts 24 pixels below the picture's top, 3 + 12 to the right of it, and is 200 high.
        assert_eq!(pixel(&shown, 20, 24), color::dolp_color(1.0));
        assert_eq!(pixel(&shown, 20, 24 + 199), color::dolp_color(0.0));
    }

    #[test]
    fn signs_are_told_apart_and_zero_is_light() {
        let shown = show(3, 3, Colors::Signed { values: &[-2.0, 0.0, 2.0], max: 2.0, unit: "" });
        let [below, zero, above] = [0, 1, 2].map(|x| pixel(&shown, x, 0));
        assert!(below[2] > below[0] && above[0] > above[2], "blue {below:?}, red {above:?}");
        assert!(zero.iter().all(|v| *v > 235), "{zero:?}");
    }

    #[test]
    fn normals_have_the_usual_colors_with_y_up() {
        let (x, y, z) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let shown = show(3, 3, Colors::Normal { values: [&x, &y, &z] });
        let expected: [Rgb; 3] = [[128, 128, 255], [255, 128, 128], [128, 255, 128]];
        assert_eq!([0, 1, 2].map(|i| pixel(&shown, i, 0)), expected);
        // The wheel's center is z; at its top, y up, is y.
        let (middle, radius) = (3 + 12 + 120, 62);
        let center = pixel(&shown, middle, radius + 16);
        assert!(center.iter().zip(expected[0]).all(|(a, b)| a.abs_diff(b) <= 1), "{center:?}");
        let top = pixel(&shown, middle, 16 + 2);
        assert!(top[1] > 250 && top[0].abs_diff(128) < 4, "{top:?}");
        // A block is averaged as vectors: two tilts of opposite sense are flat.
        let shown = show(2, 1, Colors::Normal { values: [&[0.6, -0.6], &[0.0; 2], &[0.8; 2]] });
        assert_eq!(pixel(&shown, 0, 0), expected[0]);
    }

    #[test]
    fn a_block_is_the_mean_of_its_values_and_has_all_its_bits() {
        let values = [1.0, f32::NAN, 3.0, f32::NAN, 5.0, f32::NAN];
        let shown = show(3, 2, Colors::Scalar { values: &values, min: 0.0, max: 10.0, unit: "" });
        assert_eq!((pixel(&shown, 0, 0), pixel(&shown, 1, 0)), (color::dolp_color(0.3), color::dolp_color(0.3)));
        let names = ["one", "two", "four"].map(String::from);
        let shown = show(2, 1, Colors::Categories { sets: &[4, 2, 0, 0, 0, 0, 0, 0], names: &names });
        assert_eq!((pixel(&shown, 0, 0), pixel(&shown, 0, 1)), (color::category_color(1), NO_FLAG));
    }

    #[test]
    fn reflectance_is_coded_for_the_screen() {
        let shown = show(1, 1, Colors::Reflectance { values: [&[0.25], &[0.5], &[0.0]], white: 0.5 });
        // IEC 61966-2-1: linear 0.5 is 188 of 255.
        assert_eq!(pixel(&shown, 0, 0), [188, 255, 0]);
    }

    #[test]
    fn categories_have_colors_of_their_own() {
        let all: Vec<Rgb> = (0..32).map(color::category_color).chain([NO_FLAG]).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| b != a), "{i}: {a:?}");
        }
    }

    #[test]
    fn what_contradicts_itself_is_refused() {
        let names = vec![String::new(); 33];
        for (max_width, colors) in [
            (2, Colors::Scalar { values: &[0.0; 3], min: 0.0, max: 1.0, unit: "" }),
            (0, Colors::Scalar { values: &[0.0; 4], min: 0.0, max: 1.0, unit: "" }),
            (2, Colors::Scalar { values: &[0.0; 4], min: 1.0, max: 1.0, unit: "" }),
            (2, Colors::Signed { values: &[0.0; 4], max: f64::NAN, unit: "" }),
            (2, Colors::Normal { values: [&[0.0; 4], &[0.0; 4], &[0.0; 5]] }),
            (2, Colors::Categories { sets: &[0; 4], names: &names }),
        ] {
            let plane = PlanePreview { title: "", width: 2, height: 2, max_width, colors, notes: Vec::new() };
            assert!(matches!(plane_preview(&plane), Err(ImageError::Inconsistent { .. })), "{plane:?}");
        }
    }
}
