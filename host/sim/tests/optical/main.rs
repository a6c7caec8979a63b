//! The optical renderer against independent references: tabulated integrals of eq. 6 and pictures by Mitsuba 3.
#![expect(clippy::unwrap_used, clippy::cast_possible_truncation, reason = "a panic is a failed test; pictures are f32")]

mod captures;
mod laws;
mod oracles;
mod shared;
mod sun;
