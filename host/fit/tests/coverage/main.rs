//! Whether the joint fit's answers are what their σ say, over materials at random; and what it mends of the closed forms.
//!
//! Pixels are made by `host_optics::integral::FixedPoints` from the formula of the sky, and fitted with tables that know the
//! same sky as a map, or with `Direct`, which has points and derivatives of its own: no code path is shared between the data
//! and the fit.
#![expect(clippy::unwrap_used, reason = "inputs are inside the model by construction")]

mod azimuth;
mod intervals;
mod pixels;
mod separation;
