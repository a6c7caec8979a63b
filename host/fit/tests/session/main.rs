//! From files to observations: captures of an independent renderer, sessions written by hand, and planes one can
//! compute.
#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    clippy::cast_possible_truncation,
    reason = "tests fail by panicking, compare exact numbers, and draw pictures of f32"
)]

mod captures;
mod drawn;
mod files;
mod planes;
mod shared;
mod zero;
