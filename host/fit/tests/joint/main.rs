//! The joint fit and its quadrature, against closed forms, an adaptive rule and independent tables.

#![expect(clippy::unwrap_used, reason = "a test stops where a scene is none")]

mod direct;
mod hard;
mod nuisance;
mod recovery;
mod region;
mod shared;
