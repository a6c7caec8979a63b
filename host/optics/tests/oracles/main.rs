//! Values made without any of this code: 20-digit tables of every pointwise family, integrals of eq. 6 by other methods, and
//! Mitsuba's matrices. They live beside the checkout (`BREWSTER_SHARED`, or ../shared); without them the tests say so.
#![expect(clippy::unwrap_used, reason = "a table that does not read is a failed test")]
#![expect(clippy::needless_range_loop, reason = "matrices are compared by their indices")]

mod data;
mod fresnel;
mod ggx;
mod integrals;
mod mitsuba;
mod mueller;
mod sky;
