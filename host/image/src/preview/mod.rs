//! Previews: PNG pictures of a Stokes image for people, each with a legend that says what its colors mean.
//!
//! Small previews are means of Stokes vectors, of which DoLP and AoLP are then taken; a raw mosaic is averaged over its
//! 2 × 2 cells. A photosite that has no value (flag `TOO_FEW`; for DoLP and AoLP also no light, s0 <= 0; for AoLP also
//! s1 = s2 = 0) is grey, in the grey picture of s0 dull purple.

mod canvas;
mod color;
mod field;
mod legend;
mod plane;

use protocol_polar::{Flags, Radians, Stokes};

pub use color::{aolp_color, dolp_color};
pub use plane::{Colors, PlanePreview, plane_preview};

use crate::{ImageError, Picture, StokesImage};
use color::{FLAG_COLORS, NO_FLAG, NO_VALUE, NO_VALUE_AMONG_GREYS, Rgb};
use field::{Field, Pixel};
use legend::{Legend, Scale, number};

/// White of s0 and the end of the residual's bar is the value that this share of the pixels does not exceed.
const WHITE_PERCENTILE: f64 = 0.995;

/// What to look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PreviewKind {
    /// s0 in grey.
    Intensity,
    /// Degree of linear polarization, viridis.
    Dolp,
    /// Angle of linear polarization, a cyclic hue.
    Aolp,
    /// The angle as hue, the degree as value.
    AolpDolp,
    /// What happened to the samples of each photosite.
    Flags,
    /// Misfit of the Stokes model.
    Residual,
}

/// How to show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreviewOptions {
    /// Most columns of the picture, its legend not counted; a larger image is averaged over blocks.
    pub max_width: usize,
    /// DoLP at the end of the scale, in (0, 1].
    pub dolp_max: f64,
}

impl Default for PreviewOptions {
    fn default() -> Self {
        Self { max_width: 1024, dolp_max: 1.0 }
    }
}

impl PreviewKind {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Intensity, Self::Dolp, Self::Aolp, Self::AolpDolp, Self::Flags, Self::Residual];

    /// A short name for files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Intensity => "s0",
            Self::Dolp => "dolp",
            Self::Aolp => "aolp",
            Self::AolpDolp => "aolp-dolp",
            Self::Flags => "flags",
            Self::Residual => "residual",
        }
    }
}

/// Draws a preview with its legend: 8-bit RGB, sRGB coded. The picture's top left pixel is at
/// (12, 34), the legend to its right.
///
/// # Errors
/// [`ImageError::Inconsistent`] for an image or options that contradict themselves, [`ImageError::NoPlane`] for flags or
/// a residual that the image does not have.
pub fn preview(image: &StokesImage, kind: PreviewKind, options: PreviewOptions) -> Result<Picture, ImageError> {
    image.check()?;
    let PreviewOptions { max_width, dolp_max } = options;
    if max_width == 0 || !(dolp_max > 0.0 && dolp_max <= 1.0) {
        return Err(ImageError::Inconsistent { what: format!("preview options {options:?}") });
    }
    if kind == PreviewKind::Flags && image.colors.iter().any(|c| c.flags.is_none()) {
        return Err(ImageError::NoPlane { plane: "flags" });
    }
    if kind == PreviewKind::Residual && image.colors.iter().any(|c| c.residual.is_none()) {
        return Err(ImageError::NoPlane { plane: "residual" });
    }
    let field = Field::new(image, max_width);
    let size = (field.width, field.height);
    let pixels = field.pixels.iter();
    let canvas = match kind {
        PreviewKind::Intensity => {
            let white = percentile(pixels.clone().filter_map(|p| p.stokes.map(|s| s[0])));
            let color = |p: &Pixel| p.stokes.map_or(NO_VALUE_AMONG_GREYS, |s| color::grey(s[0] / white));
            intensity_legend(image, white).draw(size, pixels.map(color))
        }
        PreviewKind::Dolp => {
            let color = |p: &Pixel| lit(p).map_or(NO_VALUE, |s| dolp_color(s.dolp() / dolp_max));
            dolp_legend(dolp_max).draw(size, pixels.map(color))
        }
        PreviewKind::Aolp => {
            let color = |p: &Pixel| polarized(p).map_or(NO_VALUE, |s| aolp_color(s.aolp()));
            aolp_legend().draw(size, pixels.map(color))
        }
        PreviewKind::AolpDolp => {
            let color = |s: Stokes| color::aolp_dolp_color(s.aolp(), s.dolp() / dolp_max);
            aolp_dolp_legend(dolp_max).draw(size, pixels.map(|p| lit(p).map_or(NO_VALUE, color)))
        }
        PreviewKind::Flags => flags_legend(image).draw(size, pixels.map(|p| color::flag_color(p.flags))),
        PreviewKind::Residual => {
            let max = percentile(pixels.clone().filter_map(|p| p.residual));
            let color = |p: &Pixel| p.residual.map_or(NO_VALUE, |r| color::residual_color(r / max));
            residual_legend(image, max).draw(size, pixels.map(color))
        }
    };
    Ok(canvas.into_picture())
}

/// The pixel's light, if there is any.
fn lit(pixel: &Pixel) -> Option<Stokes> {
    let [s0, s1, s2] = pixel.stokes?;
    (s0 > 0.0).then_some(Stokes([s0, s1, s2, 0.0]))
}

/// The pixel's light, if it has an angle of polarization.
fn polarized(pixel: &Pixel) -> Option<Stokes> {
    lit(pixel).filter(|s| s.0[1] != 0.0 || s.0[2] != 0.0)
}

/// The value that [`WHITE_PERCENTILE`] of `values` do not exceed; 1 where that is not positive.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of the length, between 0 and the length"
)]
fn percentile(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let index = (WHITE_PERCENTILE * values.len().saturating_sub(1) as f64).round() as usize;
    if index >= values.len() {
        return 1.0;
    }
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    if *value > 0.0 { *value } else { 1.0 }
}

fn intensity_legend(image: &StokesImage, white: f64) -> Legend<'static> {
    let unit = &image.metadata.unit;
    Legend {
        title: "s0, power of the light",
        scale: Scale::Bar { min: 0.0, max: white, unit: unit.clone(), color: color::grey },
        notes: vec![
            (None, format!("white = {} {unit} (99.5th percentile)", number(white, white / 1000.0))),
            (None, "sRGB coded from linear".into()),
            (Some(NO_VALUE_AMONG_GREYS), "no value".into()),
        ],
    }
}

fn dolp_legend(max: f64) -> Legend<'static> {
    let above = format!("{max} and above");
    Legend {
        title: "Degree of linear polarization",
        scale: Scale::Bar { min: 0.0, max, unit: "DoLP".into(), color: dolp_color },
        notes: vec![(Some(dolp_color(1.0)), above), (Some(NO_VALUE), "no light or no value".into())],
    }
}

fn aolp_legend() -> Legend<'static> {
    Legend {
        title: "Angle of linear polarization",
        scale: Scale::Wheel { color: |angle, distance| (distance > 0.45).then(|| aolp_color(Radians(angle))) },
        notes: vec![
            (None, "AoLP counter-clockwise from x right, y up; 180° is 0°".into()),
            (Some(NO_VALUE), "no light or no angle".into()),
        ],
    }
}

fn aolp_dolp_legend(max: f64) -> Legend<'static> {
    Legend {
        title: "AoLP (hue) and DoLP (value)",
        scale: Scale::Wheel { color: |angle, distance| Some(color::aolp_dolp_color(Radians(angle), distance)) },
        notes: vec![
            (None, "AoLP counter-clockwise from x right, y up".into()),
            (None, format!("DoLP: center 0, rim {max} and above")),
            (Some(NO_VALUE), "no light or no value".into()),
        ],
    }
}

fn residual_legend(image: &StokesImage, max: f64) -> Legend<'static> {
    let unit = &image.metadata.unit;
    Legend {
        title: "Residual of the model",
        scale: Scale::Bar { min: 0.0, max, unit: unit.clone(), color: color::residual_color },
        notes: vec![
            (None, format!("end = {} {unit} (99.5th percentile)", number(max, max / 1000.0))),
            (Some(NO_VALUE), "no value".into()),
        ],
    }
}

/// Counts are of the image at full size; a pixel of several colors has every flag that one of them has.
fn flags_legend(image: &StokesImage) -> Legend<'static> {
    let total = image.width * image.height;
    let mut all = vec![0_u8; total];
    for flags in image.colors.iter().filter_map(|c| c.flags.as_deref()) {
        all.iter_mut().zip(flags).for_each(|(sum, f)| *sum |= f);
    }
    let line = |name: &str, count: usize| format!("{name:<15} {:>8}", share(count, total)).replace(' ', "\u{a0}");
    let mut notes: Vec<(Option<Rgb>, String)> = FLAG_COLORS
        .iter()
        .map(|(flag, color)| {
            let name = Flags::NAMES.iter().find(|(f, _)| f == flag).map_or("", |(_, name)| *name);
            (Some(*color), line(name, all.iter().filter(|f| Flags(**f).contains(*flag)).count()))
        })
        .collect();
    notes.push((Some(NO_FLAG), line("none", all.iter().filter(|f| **f == 0).count())));
    notes.push((None, "a pixel with several flags has the color of the first in this list".into()));
    Legend { title: "Flags", scale: Scale::Categories, notes }
}

/// A share of `total` pixels, in percent.
fn share(count: usize, total: usize) -> String {
    let percent = 100.0 * count as f64 / total as f64;
    // "0.00 %" is for none: a single bad photosite among millions must not read as none.
    if count > 0 && percent < 0.01 { "<0.01 %".to_owned() } else { format!("{percent:.2} %") }
}

#[cfg(test)]
mod tests;
