//! A rendering as a picture for people: linear radiance times an exposure, clipped, sRGB coded.

use host_image::{Encoding, ImageError, Picture, Samples};

use super::{Relit, Sight};
use crate::maps::quantile;

/// Share of the pixels that automatic exposure does not clip.
const WITHIN: f64 = 0.995;
/// sRGB codes of what is not the sample, and of the two stripes of the hatch.
const BEYOND: u8 = 40;
const HATCH: [[u8; 3]; 2] = [[150, 90, 150], [95, 60, 95]];
/// Width of a stripe across, pixels.
const STRIPE: usize = 4;

/// Which radiance is white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// That which 99.5 % of the pixels stay below in their brightest band, times 2 to this power less.
    Auto {
        /// Stops: +1 is twice as bright.
        stops: f64,
    },
    /// This.
    White(f64),
}

/// 8-bit RGB, and the radiance that is white in it. Pixels that do not see the sample are dark grey, those without an answer
/// hatched in purple, which no clipped color is.
///
/// # Errors
/// [`ImageError::Inconsistent`] for a white that is not positive.
pub fn display(relit: &Relit, exposure: Exposure) -> Result<(Picture, f64), ImageError> {
    let bands: Vec<&[f32]> = relit.image.colors.iter().map(|c| c.s0.as_slice()).collect();
    let white = match exposure {
        Exposure::White(white) => white,
        Exposure::Auto { stops } => automatic(relit, &bands) * (-stops).exp2(),
    };
    if !(white > 0.0 && white.is_finite()) {
        return Err(ImageError::Inconsistent { what: format!("a picture in which radiance {white} is white") });
    }
    let width = relit.image.width;
    let mut rgb = Vec::with_capacity(3 * relit.sight.len());
    for (i, sight) in relit.sight.iter().enumerate() {
        match sight {
            Sight::Material => rgb.extend(bands.iter().map(|band| coded(f64::from(band[i]) / white))),
            Sight::Unanswered => rgb.extend(HATCH[(i % width + i / width) / STRIPE % 2]),
            Sight::Beyond => rgb.extend([BEYOND; 3]),
        }
    }
    let samples = Samples::U8(rgb);
    let (height, encoding) = (relit.image.height, Encoding::Srgb);
    Ok((Picture { width, height, channels: 3, samples, encoding }, white))
}

/// 1 for a black picture.
fn automatic(relit: &Relit, bands: &[&[f32]]) -> f64 {
    let seen = relit.sight.iter().enumerate().filter(|(_, s)| **s == Sight::Material);
    let mut brightest: Vec<f32> = seen.map(|(i, _)| bands.iter().map(|b| b[i]).fold(0.0, f32::max)).collect();
    quantile(&mut brightest, WITHIN).map(f64::from).filter(|w| *w > 0.0).unwrap_or(1.0)
}

/// IEC 61966-2-1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
fn coded(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let value = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * value).round() as u8
}
