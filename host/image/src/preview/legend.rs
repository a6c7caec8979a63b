//! The legend beside a preview: title, bar or wheel, notes.

use embedded_graphics::text::Alignment;

use super::canvas::{CHARACTER_WIDTH, Canvas, LINE_HEIGHT};
use super::color::Rgb;

const MARGIN: usize = 12;
const TITLE_HEIGHT: usize = 34;
const PANEL_WIDTH: usize = 240;
const BAR_WIDTH: usize = 26;
/// The unit stands above the bar, clear of the topmost tick label.
const BAR_TOP: usize = LINE_HEIGHT + 8;
const NOTE_GAP: usize = 4;
const BAR_HEIGHT: usize = 200;
const WHEEL_RADIUS: usize = 62;
const SWATCH: usize = 11;
const CHARACTERS: usize = PANEL_WIDTH / CHARACTER_WIDTH;

/// What a legend says.
pub(super) struct Legend<'a> {
    /// At most 29 characters: it must fit over the narrowest picture and its legend.
    pub(super) title: &'a str,
    pub(super) scale: Scale,
    /// Lines below the scale, each with the color it speaks of.
    pub(super) notes: Vec<(Option<Rgb>, String)>,
}

/// How numbers become colors.
pub(super) enum Scale {
    /// A bar from `min` to `max`, bottom to top; `color` is asked with [0, 1].
    Bar { min: f64, max: f64, unit: String, color: fn(f64) -> Rgb },
    /// A wheel in the picture's direction; `color` is asked with (angle in radians, distance in [0, 1]).
    Wheel { color: fn(f64, f64) -> Option<Rgb> },
    /// The notes are the scale.
    Categories,
}

impl Legend<'_> {
    /// The picture, `columns` × `rows`, with its legend to the right. `colors` gives its pixels, row-major.
    pub(super) fn draw(&self, (columns, rows): (usize, usize), colors: impl Iterator<Item = Rgb>) -> Canvas {
        let lines: Vec<(Option<Rgb>, Vec<String>)> =
            self.notes.iter().map(|(swatch, text)| (*swatch, wrapped(text, self.room(*swatch)))).collect();
        let text_height = lines.iter().map(|(_, l)| NOTE_GAP + LINE_HEIGHT * l.len()).sum::<usize>();
        let legend_height = self.scale.height() + text_height;
        let panel = 2 * MARGIN + columns;
        let width = panel + PANEL_WIDTH + MARGIN;
        let height = TITLE_HEIGHT + rows.max(legend_height) + MARGIN;
        let mut canvas = Canvas::new(width, height);
        canvas.heading(MARGIN, TITLE_HEIGHT / 2, self.title);
        for (i, color) in colors.enumerate() {
            canvas.set(MARGIN + i % columns, TITLE_HEIGHT + i / columns, color);
        }
        self.scale.draw(&mut canvas, panel, TITLE_HEIGHT);
        let mut y = TITLE_HEIGHT + self.scale.height() + LINE_HEIGHT / 2;
        for (swatch, lines) in lines {
            let mut x = panel;
            if let Some(color) = swatch {
                canvas.fill(x, y - SWATCH / 2, SWATCH, SWATCH, color);
                x += 2 * CHARACTER_WIDTH;
            }
            for line in lines {
                canvas.text(x, y, &line, Alignment::Left);
                y += LINE_HEIGHT;
            }
            y += NOTE_GAP;
        }
        canvas
    }

    fn room(&self, swatch: Option<Rgb>) -> usize {
        if swatch.is_some() { CHARACTERS - 2 } else { CHARACTERS }
    }
}

impl Scale {
    /// Pixels from the top of the legend to its first note.
    fn height(&self) -> usize {
        match self {
            Self::Bar { .. } => BAR_TOP + BAR_HEIGHT + LINE_HEIGHT,
            Self::Wheel { .. } => 2 * (WHEEL_RADIUS + LINE_HEIGHT),
            Self::Categories => 0,
        }
    }

    fn draw(&self, canvas: &mut Canvas, x: usize, y: usize) {
        match self {
            Self::Bar { min, max, unit, color } => draw_bar(canvas, x, y, (*min, *max, unit), *color),
            Self::Wheel { color } => draw_wheel(canvas, x + PANEL_WIDTH / 2, y + WHEEL_RADIUS + LINE_HEIGHT, *color),
            Self::Categories => {}
        }
    }
}

fn draw_bar(canvas: &mut Canvas, x: usize, y: usize, (min, max, unit): (f64, f64, &str), color: fn(f64) -> Rgb) {
    canvas.text(x, y + LINE_HEIGHT / 2, unit, Alignment::Left);
    let top = y + BAR_TOP;
    let last = BAR_HEIGHT - 1;
    for row in 0..BAR_HEIGHT {
        canvas.fill(x, top + last - row, BAR_WIDTH, 1, color(row as f64 / last as f64));
    }
    for (value, label) in ticks(min, max) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "value is in [min, max]")]
        let row = ((value - min) / (max - min) * last as f64).round() as usize;
        let at = top + last.saturating_sub(row);
        canvas.fill(x + BAR_WIDTH, at, 5, 1, [200; 3]);
        canvas.text(x + BAR_WIDTH + 10, at, &label, Alignment::Left);
    }
}

/// Labels stand at the directions they name: 90° above, as the picture's y runs up.
fn draw_wheel(canvas: &mut Canvas, x: usize, y: usize, color: fn(f64, f64) -> Option<Rgb>) {
    canvas.wheel(x, y, WHEEL_RADIUS, color);
    let r = WHEEL_RADIUS;
    let diagonal = r * 71 / 100;
    canvas.text(x + r + 6, y, "0°", Alignment::Left);
    canvas.text(x + diagonal + 6, y - diagonal - 4, "45°", Alignment::Left);
    canvas.text(x, y - r - LINE_HEIGHT / 2, "90°", Alignment::Center);
    canvas.text(x - diagonal - 6, y - diagonal - 4, "135°", Alignment::Right);
    canvas.text(x - r - 6, y, "180°", Alignment::Right);
}

/// Multiples of a round step from `min` to `max`, at most 6 of them, with their labels.
fn ticks(min: f64, max: f64) -> Vec<(f64, String)> {
    let range = max - min;
    let power = 10_f64.powf((range / 5.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| range / s <= 5.0 + 1e-9).unwrap_or(range);
    let first = (min / step - 1e-9).ceil();
    // Adding 0 makes the label of −0 that of 0.
    let values = (0..6).map(|i| (first + f64::from(i)) * step + 0.0).take_while(|v| *v <= max + 1e-9 * range);
    values.map(|v| (v, number(v, step))).collect()
}

/// A number to the precision of `step`.
pub(super) fn number(value: f64, step: f64) -> String {
    let digits = -step.abs().log10().floor();
    if value.abs() >= 1e6 || (digits > 4.0 && value != 0.0) {
        format!("{value:.2e}")
    } else {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 4")]
        let decimals = digits.clamp(0.0, 4.0) as usize;
        format!("{value:.decimals$}")
    }
}

/// Lines of at most `room` characters, broken at spaces; a longer word is cut.
fn wrapped(text: &str, room: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        let word: String = word.chars().take(room).collect();
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= room => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_few_and_within_the_bar() {
        let labels = |max| ticks(0.0, max).into_iter().map(|(_, l)| l).collect::<Vec<_>>();
        assert_eq!(labels(1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(3187.0), ["0", "1000", "2000", "3000"]);
        assert_eq!(labels(0.05), ["0.00", "0.01", "0.02", "0.03", "0.04", "0.05"]);
        let between = |min, max| ticks(min, max).into_iter().map(|(_, l)| l).collect::<Vec<_>>();
        assert_eq!(between(1.33, 1.72), ["1.4", "1.5", "1.6", "1.7"]);
        assert_eq!(between(-3.0, 3.0), ["-2", "0", "2"]);
        assert_eq!(between(-0.1, 0.1), ["-0.10", "-0.05", "0.00", "0.05", "0.10"]);
        for max in [1e-9, 3.3e-5, 0.7, 9.99, 65535.0, 4.2e9] {
            let t = ticks(0.0, max);
            assert!((3..=6).contains(&t.len()), "{max}: {t:?}");
            assert!(t.iter().all(|(v, label)| *v <= max * 1.000_001 && label.len() <= 9), "{max}: {t:?}");
        }
    }

    #[test]
    fn long_notes_are_broken_between_words() {
        assert_eq!(wrapped("white = 99.5th percentile", 12), ["white =", "99.5th", "percentile"]);
        assert_eq!(wrapped("abcdefgh", 5), ["abcde"]);
    }
}
