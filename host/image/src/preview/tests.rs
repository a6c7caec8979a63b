//! The right color at the right place, and none where there is no value.

use super::*;
use crate::{BayerPattern, Color, ColorPlanes, Samples, StokesMetadata};
use protocol_polar::Degrees;

/// The picture's top left pixel in a preview.
const ORIGIN: (usize, usize) = (12, 34);

fn metadata() -> StokesMetadata {
    StokesMetadata {
        unit: "DN".into(),
        angles_deg: vec![0.0, 60.0, 120.0],
        exposure_us: Vec::new(),
        gain: None,
        black_level_dn: None,
        white_level_dn: None,
        bit_depth: None,
        fixed_point: None,
        bayer: None,
        source: "test".into(),
        camera_serial: None,
        capture_id: None,
        software_version: "0".into(),
    }
}

/// A mono image of which `light` gives each photosite by (column, row).
fn image(width: usize, height: usize, light: impl Fn(usize, usize) -> Stokes) -> StokesImage {
    let all: Vec<[f64; 4]> = (0..width * height).map(|i| light(i % width, i / width).0).collect();
    #[expect(clippy::cast_possible_truncation, reason = "the planes of an image are f32")]
    let narrow = |v: f64| v as f32;
    let plane = |k: usize| all.iter().map(|s| narrow(s[k])).collect();
    let planes = ColorPlanes { color: Color::Y, s0: plane(0), s1: plane(1), s2: plane(2), flags: None, residual: None };
    StokesImage { width, height, colors: vec![planes], metadata: metadata() }
}

fn pixel(picture: &Picture, column: usize, row: usize) -> Rgb {
    let Samples::U8(rgb) = &picture.samples else { panic!("8 bit") };
    let at = 3 * ((ORIGIN.1 + row) * picture.width + ORIGIN.0 + column);
    [rgb[at], rgb[at + 1], rgb[at + 2]]
}

fn draw(image: &StokesImage, kind: PreviewKind) -> Picture {
    preview(image, kind, PreviewOptions::default()).unwrap()
}

/// Light polarized radially around the middle: AoLP is the direction from the middle, with y up.
fn radial(size: usize) -> StokesImage {
    let middle = (size as f64 - 1.0) / 2.0;
    image(size, size, |x, y| {
        let direction = Radians((middle - y as f64).atan2(x as f64 - middle));
        Stokes::linear(1000.0, 0.5, direction)
    })
}

#[test]
fn angles_have_their_colors_at_their_places() {
    let size = 101;
    let shown = draw(&radial(size), PreviewKind::Aolp);
    let color = |d: f64| aolp_color(Degrees(d).to_radians());
    let middle = size / 2;
    // Right and left of the middle 0°, above and below 90°; the upper right, where rows are small, 45°.
    assert_eq!(pixel(&shown, size - 1, middle), color(0.0));
    assert_eq!(pixel(&shown, 0, middle), color(0.0));
    assert_eq!(pixel(&shown, middle, 0), color(90.0));
    assert_eq!(pixel(&shown, size - 1, 0), color(45.0));
    assert_eq!(pixel(&shown, 0, size - 1), color(45.0));
    assert_eq!(pixel(&shown, 0, 0), color(135.0));
    assert_eq!(pixel(&shown, size - 1, size - 1), color(135.0));
}

#[test]
fn the_wheel_of_the_legend_agrees_with_the_picture() {
    let size = 201;
    let shown = draw(&radial(size), PreviewKind::Aolp);
    // Middle of the wheel: see the layout in legend.rs.
    let (x, y): (usize, usize) = (size + 12 + 120, 62 + 16);
    let middle = size / 2;
    for (dx, dy) in [(50_isize, 0_isize), (0, -50), (35, -35), (-35, -35), (20, -45), (-48, 10), (30, 38)] {
        let wheel = pixel(&shown, x.strict_add_signed(dx), y.strict_add_signed(dy));
        let picture = pixel(&shown, middle.strict_add_signed(dx), middle.strict_add_signed(dy));
        let far = wheel.iter().zip(picture).map(|(a, b)| a.abs_diff(b)).max().unwrap();
        assert!(far <= 3, "({dx}, {dy}): wheel {wheel:?}, picture {picture:?}");
    }
}

#[test]
fn photosites_without_value_are_grey_and_never_a_color() {
    let mut dark = image(4, 1, |x, _| match x {
        0 => Stokes::linear(100.0, 0.5, Radians(1.0)),
        1 => Stokes([0.0, 0.0, 0.0, 0.0]),
        2 => Stokes([-3.0, 1.0, 1.0, 0.0]),
        _ => Stokes([50.0, 10.0, 0.0, 0.0]),
    });
    dark.colors[0].flags = Some(vec![0, 0, 0, Flags::TOO_FEW.0]);
    for kind in [PreviewKind::Dolp, PreviewKind::Aolp, PreviewKind::AolpDolp] {
        let shown = draw(&dark, kind);
        assert_ne!(pixel(&shown, 0, 0), NO_VALUE);
        for x in 1..4 {
            assert_eq!(pixel(&shown, x, 0), NO_VALUE, "{kind:?} at {x}");
        }
    }
    let shown = draw(&dark, PreviewKind::Intensity);
    assert_eq!([0, 1, 2, 3].map(|x| pixel(&shown, x, 0)), [[255; 3], [0; 3], [0; 3], NO_VALUE_AMONG_GREYS]);
    // Unpolarized light has a DoLP, 0, but no angle.
    let plain = image(1, 1, |_, _| Stokes::UNPOLARIZED);
    assert_eq!(pixel(&draw(&plain, PreviewKind::Aolp), 0, 0), NO_VALUE);
    assert_eq!(pixel(&draw(&plain, PreviewKind::Dolp), 0, 0), dolp_color(0.0));
}

#[test]
fn small_previews_average_stokes_and_not_angles() {
    // 10° and 170°: the mean of the angles is 90°, the mean of the light is horizontal.
    let degrees = |d: f64| Stokes::linear(100.0, 1.0, Degrees(d).to_radians());
    let pair = image(8, 1, |x, _| degrees(if x % 2 == 0 { 10.0 } else { 170.0 }));
    let options = PreviewOptions { max_width: 4, ..PreviewOptions::default() };
    let shown = preview(&pair, PreviewKind::Aolp, options).unwrap();
    assert_eq!(pixel(&shown, 0, 0), aolp_color(Radians(0.0)));
    let dolp = preview(&pair, PreviewKind::Dolp, options).unwrap();
    let expected = Degrees(20.0).to_radians().0.cos();
    assert_eq!(pixel(&dolp, 3, 0), dolp_color(expected));
    // A mosaic of the same photosites is averaged over its cells at any size.
    let mut mosaic = image(4, 3, |x, _| degrees(if x % 2 == 0 { 10.0 } else { 170.0 }));
    mosaic.metadata.bayer = Some(BayerPattern::Rggb);
    let shown = draw(&mosaic, PreviewKind::Aolp);
    for (x, y) in [(0, 0), (1, 1)] {
        assert_eq!(pixel(&shown, x, y), aolp_color(Radians(0.0)));
    }
}

#[test]
fn a_flagged_photosite_does_not_pull_the_mean() {
    let mut pair =
        image(2, 1, |x, _| if x == 0 { Stokes::linear(100.0, 1.0, Radians(0.0)) } else { Stokes::default() });
    pair.colors[0].flags = Some(vec![0, Flags::TOO_FEW.0]);
    let field = Field::new(&pair, 1);
    assert_eq!(field.pixels[0].stokes, Some([100.0, 100.0, 0.0]));
    assert_eq!(field.pixels[0].flags, Flags::TOO_FEW);
}

#[test]
fn previews_need_their_planes_and_sound_options() {
    let plain = image(2, 2, |_, _| Stokes::UNPOLARIZED);
    let flags = preview(&plain, PreviewKind::Flags, PreviewOptions::default());
    assert!(matches!(flags, Err(ImageError::NoPlane { plane: "flags" })));
    let residual = preview(&plain, PreviewKind::Residual, PreviewOptions::default());
    assert!(matches!(residual, Err(ImageError::NoPlane { plane: "residual" })));
    for options in [
        PreviewOptions { max_width: 0, dolp_max: 1.0 },
        PreviewOptions { max_width: 9, dolp_max: 0.0 },
        PreviewOptions { max_width: 9, dolp_max: f64::NAN },
    ] {
        let refused = preview(&plain, PreviewKind::Dolp, options);
        assert!(matches!(refused, Err(ImageError::Inconsistent { .. })), "{options:?}");
    }
}

#[test]
fn the_most_telling_flag_is_shown() {
    let mut flagged = image(3, 1, |_, _| Stokes::UNPOLARIZED);
    let both = Flags::SATURATED.with(Flags::MISFIT);
    flagged.colors[0].flags = Some(vec![0, both.0, Flags::SATURATED.0]);
    let shown = draw(&flagged, PreviewKind::Flags);
    let color = |flag| FLAG_COLORS.iter().find(|(f, _)| *f == flag).unwrap().1;
    assert_eq!(pixel(&shown, 0, 0), NO_FLAG);
    assert_eq!(pixel(&shown, 1, 0), color(Flags::MISFIT));
    assert_eq!(pixel(&shown, 2, 0), color(Flags::SATURATED));
    // Every flag the protocol knows has a color.
    for (flag, name) in Flags::NAMES {
        assert!(FLAG_COLORS.iter().any(|(f, _)| *f == flag), "{name}");
    }
}
