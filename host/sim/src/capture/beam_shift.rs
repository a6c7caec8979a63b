//! The polarizer's wedge turns every ray aside, and turns with the wheel: at angle φ the picture lies
//! f tan(deviation) (cos φ, sin φ) beside its place (x right, y up). Light is looked up between pixels bilinearly, with the
//! picture's edge going on outside it.
//!
//! Bound: the light of a photosite becomes a weighted mean over its neighbors up to ⌈shift⌉ away, in which it keeps the
//! weight w >= (1 − |Δx|)(1 − |Δy|) (none for a shift of a pixel or more). With u the largest difference between it and one
//! of those neighbors, each component changes by at most (1 − w) u s0 and the frame by ½ t (1 + √2) (1 − w) u s0.

use std::f64::consts::SQRT_2;

use glam::DVec2;
use protocol_polar::Radians;

use crate::scene::Scene;
use crate::signal::{Signal, single};
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 3.3;

/// How far the wedge moves the picture, in pixels.
fn length_px(scene: &Scene, view: usize) -> f64 {
    let deviation = (scene.polarizer.beam_deviation_arcmin / 60.0).to_radians();
    scene.views.get(view).map_or(0.0, |camera| camera.focal_px * deviation.tan())
}

/// Where the picture lies with the polarizer at `angle`, in pixels, x right and y **down**.
pub(crate) fn shift(scene: &Scene, view: usize, angle: Radians) -> DVec2 {
    let (s, c) = angle.0.sin_cos();
    DVec2::new(c, -s) * length_px(scene, view)
}

/// One row of photosites of the moved picture, each column behind the analyzer row `weights` gives: electrons.
pub(crate) fn fill_row(
    signal: &Signal,
    shift: DVec2,
    weights: impl Fn(usize) -> [f32; 3],
    row: usize,
    out: &mut [f32],
) {
    // The light that arrives at a photosite left its own place `shift` before it.
    let (dx, fx) = whole(-shift.x);
    let (dy, fy) = whole(-shift.y);
    let (above, below) = (clamped(row, dy, signal.height), clamped(row, dy + 1, signal.height));
    for (column, electrons) in out.iter_mut().enumerate() {
        let (left, right) = (clamped(column, dx, signal.width), clamped(column, dx + 1, signal.width));
        let band = &signal.bands[signal.band(row, column)];
        let mut sum = 0.0;
        for (plane, weight) in band.iter().zip(weights(column)) {
            let at = |r: usize, c: usize| plane[r * signal.width + c];
            let upper = at(above, left) + fx * (at(above, right) - at(above, left));
            let lower = at(below, left) + fx * (at(below, right) - at(below, left));
            sum += weight * (upper + fy * (lower - upper));
        }
        *electrons = sum;
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let length = length_px(facts.scene, facts.view);
    if length <= 0.0 {
        return Assessment::new(0.0, COST_NS, "the polarizer has no wedge".to_owned());
    }
    // Wheel errors turn the wedge as well, so the worst direction is taken: the weight w is least on the diagonal.
    let kept = (1.0 - length / SQRT_2).max(0.0).powi(2);
    let moved = if length < 1.0 { 1.0 - kept } else { 1.0 };
    let unevenness = facts.unevenness(whole_pixels(length));
    let bound = facts.deterministic(|_| 0.5 * (1.0 + SQRT_2) * moved * unevenness);
    Assessment::new(bound, COST_NS, format!("shift {length:.3} px, neighbors differ by up to {unevenness:.3}"))
}

/// Whole part (downwards) and rest.
#[expect(clippy::cast_possible_truncation, reason = "a shift is a few pixels")]
fn whole(x: f64) -> (i64, f32) {
    (x.floor() as i64, single(x - x.floor()))
}

/// ⌈x⌉.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a shift is a few pixels, and not negative"
)]
fn whole_pixels(x: f64) -> usize {
    x.ceil() as usize
}

fn clamped(at: usize, step: i64, size: usize) -> usize {
    let moved = i64::try_from(at).unwrap_or(i64::MAX).saturating_add(step);
    usize::try_from(moved).unwrap_or(0).min(size - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::testing::picture;
    use crate::frames::testing::{check_bound, studio};
    use crate::{Effect, EffectSet};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_bound_holds(arcmin in 0.01..15.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.polarizer.beam_deviation_arcmin = arcmin;
            check_bound(&scene, Effect::BeamShift)?;
        }
    }

    /// A shift of whole pixels moves the picture to the right (x) and down (y) and changes no value.
    #[test]
    fn whole_pixels_are_moved_exactly() {
        let scene = studio(3);
        let signal = Signal::new(&scene.camera, &picture(&scene), EffectSet::NONE);
        let mut moved = vec![0.0; signal.width];
        fill_row(&signal, DVec2::new(2.0, 1.0), |_| [1.0, 0.0, 0.0], 4, &mut moved);
        let source = &signal.bands[0][0][3 * signal.width..][..signal.width];
        assert_eq!(&moved[2..], &source[..signal.width - 2]);
        assert_eq!(moved[..2], [source[0], source[0]]);
    }
}
