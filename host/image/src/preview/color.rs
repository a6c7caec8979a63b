//! Color maps: what a number looks like.
//!
//! - DoLP: viridis (Smith and van der Walt 2015), residual: magma (same authors); both perceptually uniform and CC0, as
//!   the 256-entry tables of the `colorous` crate.
//! - AoLP: a circle of constant lightness and chroma in OKLCh (Ottosson 2020, "A perceptual color space for image
//!   processing"), once around for 180°: equal steps of angle look equally different, and no angle looks brighter than
//!   another. Lightness 0.75 allows the largest chroma that stays inside sRGB at every hue (0.1275).
//! - Signed values: blue to red through white (Brewer 2003, RdBu), distinguishable with any color vision.
//! - Normals: (n + 1)/2 per component, as every program shows normal maps.
//! - A photosite without a value is never given one: [`NO_VALUE`], a grey that no map above contains.

use colorous::{Gradient, MAGMA, RED_BLUE, VIRIDIS};
use protocol_polar::{Flags, Radians};

/// 8-bit sRGB.
pub(super) type Rgb = [u8; 3];

/// Photosites without a value, in every map but grey: too few valid samples, or no light to be polarized.
pub(super) const NO_VALUE: Rgb = [128, 128, 128];
/// Photosites without a value in the grey map of s0: a dull purple, as grey would be a value there.
pub(super) const NO_VALUE_AMONG_GREYS: Rgb = [96, 48, 112];
/// Photosites with nothing to report, in the map of flags.
pub(super) const NO_FLAG: Rgb = [56, 56, 56];

/// Most telling first: the color of a photosite with several flags is that of the first here. Colors: Okabe and Ito
/// 2008, distinguishable with any color vision.
pub(super) const FLAG_COLORS: [(Flags, Rgb); 5] = [
    (Flags::TOO_FEW, [213, 94, 0]),
    (Flags::MISFIT, [204, 121, 167]),
    (Flags::OUT_OF_RANGE, [86, 180, 233]),
    (Flags::SATURATED, [240, 228, 66]),
    (Flags::BELOW_BLACK, [0, 158, 115]),
];

const AOLP_LIGHTNESS: f64 = 0.75;
const AOLP_CHROMA: f64 = 0.127;
/// OKLCh hue of AoLP 0°: red.
const AOLP_HUE: f64 = 0.5;

/// Color of an angle of polarization (8-bit sRGB): cyclic, 0° and 180° are the same color; lightness is constant.
#[must_use]
pub fn aolp_color(aolp: Radians) -> [u8; 3] {
    aolp_dolp_color(aolp, 1.0)
}

/// Color of a degree of polarization (8-bit sRGB): viridis over [0, 1], clamped.
#[must_use]
pub fn dolp_color(dolp: f64) -> [u8; 3] {
    gradient(&VIRIDIS, dolp)
}

/// Color of a residual relative to the largest shown: magma over [0, 1], clamped.
pub(super) fn residual_color(relative: f64) -> Rgb {
    gradient(&MAGMA, relative)
}

/// Color of a signed value, −1 as 0, 0 as ½ and +1 as 1: blue, white, red; clamped.
pub(super) fn signed_color(at: f64) -> Rgb {
    gradient(&RED_BLUE, 1.0 - at)
}

/// Color of a unit normal: (n + 1)/2 per component.
pub(super) fn normal_color(normal: [f64; 3]) -> Rgb {
    normal.map(|n| byte(0.5 * (n + 1.0)))
}

/// Linear reflectance in [0, 1], sRGB coded.
pub(super) fn linear_color(rgb: [f64; 3]) -> Rgb {
    rgb.map(srgb_byte)
}

/// Color of category `index`: the hues of Okabe and Ito 2008, darker each time around.
pub(super) fn category_color(index: usize) -> Rgb {
    const HUES: [Rgb; 7] =
        [[213, 94, 0], [86, 180, 233], [240, 228, 66], [0, 158, 115], [204, 121, 167], [230, 159, 0], [0, 114, 178]];
    let shade = 0.6_f64.powi(i32::try_from(index / HUES.len()).unwrap_or(i32::MAX));
    HUES[index % HUES.len()].map(|v| byte(f64::from(v) / 255.0 * shade))
}

/// The angle's hue, with lightness and chroma in proportion to `relative_dolp` (clamped to [0, 1]): black is
/// unpolarized.
pub(super) fn aolp_dolp_color(aolp: Radians, relative_dolp: f64) -> Rgb {
    let hue = AOLP_HUE + 2.0 * aolp.as_axis().0;
    // OKLab's cone responses are cube roots: scaling L and C by v scales linear light by v³, so no hue leaves the gamut.
    let scale = relative_dolp.clamp(0.0, 1.0).powi(3);
    oklch_to_linear_srgb(AOLP_LIGHTNESS, AOLP_CHROMA, hue).map(|x| srgb_byte(scale * x))
}

/// Linear light in [0, 1] as sRGB-coded grey.
pub(super) fn grey(linear: f64) -> Rgb {
    [srgb_byte(linear); 3]
}

/// Color of a flag byte.
pub(super) fn flag_color(flags: Flags) -> Rgb {
    let first = FLAG_COLORS.iter().find(|(flag, _)| flags.contains(*flag));
    first.map_or(NO_FLAG, |(_, color)| *color)
}

fn gradient(map: &Gradient, at: f64) -> Rgb {
    map.eval_continuous(at.clamp(0.0, 1.0)).as_array()
}

/// Ottosson 2020, "Converting from OKLab to linear sRGB"; hue in radians.
fn oklch_to_linear_srgb(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

/// IEC 61966-2-1 coding of linear light, clamped to [0, 1], to the nearest of 256 steps.
fn srgb_byte(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    byte(if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 })
}

/// [0, 1] to the nearest of 256 steps, clamped.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded and clamped to 0..=255")]
fn byte(value: f64) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_polar::Degrees;

    /// sRGB bytes to OKLab, Ottosson's forward direction: independent of the inverse above.
    fn oklab(rgb: Rgb) -> [f64; 3] {
        let [r, g, b] = rgb.map(|v| {
            let x = f64::from(v) / 255.0;
            if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        });
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        [
            0.210_454_255_3 * l + 0.793_617_785 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766 * s,
        ]
    }

    fn distance(x: [f64; 3], y: [f64; 3]) -> f64 {
        x.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    fn degrees(d: f64) -> Radians {
        Degrees(d).to_radians()
    }

    #[test]
    fn the_angle_map_is_cyclic() {
        assert_eq!(aolp_color(degrees(0.0)), aolp_color(degrees(180.0)));
        assert_eq!(aolp_color(degrees(-1e-13)), aolp_color(degrees(0.0)));
        let seam = distance(oklab(aolp_color(degrees(179.5))), oklab(aolp_color(degrees(0.5))));
        assert!(seam < 0.01, "{seam}");
        // Crossed polarizations are opposite hues: the farthest apart that the circle has.
        for d in 0..180 {
            let (here, there) = (degrees(d.into()), degrees(f64::from(d) + 90.0));
            let across = distance(oklab(aolp_color(here)), oklab(aolp_color(there)));
            assert!((across - 2.0 * AOLP_CHROMA).abs() < 0.01, "{d}: {across}");
        }
    }

    #[test]
    fn the_angle_map_is_perceptually_uniform_and_in_gamut() {
        // 8-bit coding moves a color by up to about 0.002.
        let quantization = 0.004;
        let step = 2.0 * AOLP_CHROMA * (5.0_f64.to_radians()).sin();
        for i in 0..36 {
            let d = f64::from(i) * 5.0;
            for x in oklch_to_linear_srgb(AOLP_LIGHTNESS, AOLP_CHROMA, AOLP_HUE + 2.0 * degrees(d).0) {
                assert!((0.0..=1.0).contains(&x), "{d} degrees leave sRGB: {x}");
            }
            let lab = oklab(aolp_color(degrees(d)));
            assert!((lab[0] - AOLP_LIGHTNESS).abs() < quantization, "lightness {} at {d}", lab[0]);
            let next = oklab(aolp_color(degrees(d + 5.0)));
            assert!((distance(lab, next) - step).abs() < quantization, "step {} at {d}", distance(lab, next));
        }
    }

    #[test]
    fn value_scales_lightness_linearly_and_keeps_the_hue() {
        for d in [0.0, 30.0, 77.0, 150.0] {
            for v in [0.3, 0.6, 0.9] {
                let lab = oklab(aolp_dolp_color(degrees(d), v));
                assert!((lab[0] - v * AOLP_LIGHTNESS).abs() < 0.01, "{d} {v}: {}", lab[0]);
                let hue = lab[2].atan2(lab[1]) - AOLP_HUE - 2.0 * degrees(d).0;
                assert!(hue.sin().abs() < 0.05, "{d} {v}");
            }
        }
        assert_eq!(aolp_dolp_color(degrees(40.0), 0.0), [0, 0, 0]);
    }

    #[test]
    fn no_value_is_never_the_color_of_a_value() {
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            let angle = Radians(x * std::f64::consts::PI);
            for color in [dolp_color(x), residual_color(x), aolp_color(angle), aolp_dolp_color(angle, 0.73)] {
                assert!(distance(oklab(color), oklab(NO_VALUE)) > 0.05, "{x}: {color:?}");
            }
            assert!(distance(oklab(grey(x)), oklab(NO_VALUE_AMONG_GREYS)) > 0.05, "{x}");
        }
    }

    #[test]
    fn viridis_is_monotone_in_lightness() {
        let lightness: Vec<f64> = (0..=32).map(|i| oklab(dolp_color(f64::from(i) / 32.0))[0]).collect();
        assert!(lightness.windows(2).all(|w| w[0] < w[1]), "{lightness:?}");
    }
}
