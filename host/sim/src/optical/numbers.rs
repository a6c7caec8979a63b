//! The few numeric casts of the renderer, each with its reason.

/// A count or an index as a real number.
#[expect(clippy::cast_precision_loss, reason = "pixels, nodes and texels are far below 2^52")]
pub(crate) fn real(count: usize) -> f64 {
    count as f64
}

/// Rounded to single precision: pictures and interpolation tables are f32.
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is meant")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// A direction in single precision.
pub(crate) fn single3(v: glam::DVec3) -> glam::Vec3 {
    glam::Vec3::new(single(v.x), single(v.y), single(v.z))
}

/// Integer part of a coordinate, at least 0 and at most `last`, and what is left of it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "the float-to-integer cast saturates, is clamped, and grids are far below 2^24"
)]
pub(crate) fn cell(coordinate: f32, last: usize) -> (usize, f32) {
    let whole = (coordinate.max(0.0) as usize).min(last);
    (whole, coordinate - whole as f32)
}

/// The smallest count not below a real number, at least 1.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates; callers cap the count"
)]
pub(crate) fn count_above(value: f64) -> usize {
    (value.ceil() as usize).max(1)
}
