//! RGB pixels that the `embedded-graphics` fonts can be drawn on.

use std::convert::Infallible;

use embedded_graphics::Drawable;
use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::iso_8859_1::{FONT_8X13, FONT_9X15_BOLD};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};

use super::color::Rgb;
use crate::{Encoding, Picture, Samples};

/// Width of one character of [`Canvas::text`], in pixels.
pub(super) const CHARACTER_WIDTH: usize = 8;
/// Lines of text are this far apart, in pixels.
pub(super) const LINE_HEIGHT: usize = 16;

const BACKGROUND: Rgb = [22, 22, 24];
const TEXT: Rgb = [235, 235, 235];

/// height × width RGB pixels, row-major; (0, 0) is the top left, y runs down.
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<u8>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, rgb: BACKGROUND.repeat(width * height) }
    }

    /// 8-bit RGB, sRGB coded.
    pub(super) fn into_picture(self) -> Picture {
        let (width, height) = (self.width, self.height);
        Picture { width, height, channels: 3, samples: Samples::U8(self.rgb), encoding: Encoding::Srgb }
    }

    /// Sets one pixel; outside the canvas nothing happens.
    pub(super) fn set(&mut self, x: usize, y: usize, color: Rgb) {
        if x < self.width
            && let Some(pixel) = self.rgb.as_chunks_mut::<3>().0.get_mut(y * self.width + x)
        {
            *pixel = color;
        }
    }

    pub(super) fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, color: Rgb) {
        for row in y..y + height {
            for column in x..x + width {
                self.set(column, row, color);
            }
        }
    }

    /// Draws `text` with its vertical middle at `y`; `x` is its left end, middle or right end.
    pub(super) fn text(&mut self, x: usize, y: usize, text: &str, alignment: Alignment) {
        self.write(x, y, text, alignment, &FONT_8X13);
    }

    /// Draws a heading, left-aligned at `x`, with its vertical middle at `y`.
    pub(super) fn heading(&mut self, x: usize, y: usize, text: &str) {
        self.write(x, y, text, Alignment::Left, &FONT_9X15_BOLD);
    }

    fn write(&mut self, x: usize, y: usize, text: &str, alignment: Alignment, font: &MonoFont<'_>) {
        let (Ok(x), Ok(y)) = (i32::try_from(x), i32::try_from(y)) else { return };
        let character = MonoTextStyle::new(font, Rgb888::new(TEXT[0], TEXT[1], TEXT[2]));
        let style = TextStyleBuilder::new().alignment(alignment).baseline(Baseline::Middle).build();
        let Ok(_) = Text::with_text_style(text, Point::new(x, y), character, style).draw(self);
    }

    /// Draws a disc or ring around (`x`, `y`) with smooth edges. `color` is asked with (angle in radians
    /// counter-clockwise from x right, y **up**; distance from the middle over `radius`, in [0, 1]); `None` leaves the
    /// background.
    pub(super) fn wheel(&mut self, x: usize, y: usize, radius: usize, color: impl Fn(f64, f64) -> Option<Rgb>) {
        const SUBSAMPLES: usize = 3;
        let r = radius as f64;
        for row in 0..=2 * radius {
            for column in 0..=2 * radius {
                let mut sum = [0_usize; 3];
                for i in 0..SUBSAMPLES * SUBSAMPLES {
                    let within = |i: usize| (i as f64 + 0.5) / SUBSAMPLES as f64 - 0.5;
                    let dx = column as f64 - r + within(i % SUBSAMPLES);
                    // Canvas rows run down, the picture's y runs up.
                    let dy = r - row as f64 - within(i / SUBSAMPLES);
                    let distance = dx.hypot(dy) / r;
                    let inside = if distance <= 1.0 { color(dy.atan2(dx), distance) } else { None };
                    for (s, c) in sum.iter_mut().zip(inside.unwrap_or(BACKGROUND)) {
                        *s += usize::from(c);
                    }
                }
                let mean = sum.map(|s| u8::try_from(s / (SUBSAMPLES * SUBSAMPLES)).unwrap_or(u8::MAX));
                self.set((x + column).wrapping_sub(radius), (y + row).wrapping_sub(radius), mean);
            }
        }
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(u32::try_from(self.width).unwrap_or(u32::MAX), u32::try_from(self.height).unwrap_or(u32::MAX))
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, color) in pixels {
            if let (Ok(x), Ok(y)) = (usize::try_from(at.x), usize::try_from(at.y)) {
                self.set(x, y, [color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}
