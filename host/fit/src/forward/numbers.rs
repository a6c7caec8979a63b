//! The few numeric casts of the tables, each with its reason.

/// A count or an index as a real number.
#[expect(clippy::cast_precision_loss, reason = "nodes of a table are far below 2^52")]
pub(super) fn real(count: usize) -> f64 {
    count as f64
}

/// Rounded to single precision: tables are f32.
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is meant")]
pub(super) fn single(value: f64) -> f32 {
    value as f32
}

/// The smallest count not below a real number, at least 1.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates; callers cap the count"
)]
pub(super) fn count_above(value: f64) -> usize {
    (value.ceil() as usize).max(1)
}

/// The integer nearest to a coordinate, within [low, high], and what is left of it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped into the range of an index before the cast"
)]
pub(super) fn nearest(coordinate: f64, low: usize, high: usize) -> (usize, f64) {
    let clamped = coordinate.clamp(real(low) - 0.5, real(high) + 0.5);
    // Not negative but for the half below 0, which the cast takes to 0.
    let node = ((clamped + 0.5) as usize).clamp(low, high);
    (node, clamped - real(node))
}
