//! The 16-bit twins of x86-64, one text for two instruction sets.
//!
//! A macro, because a function may only use the instructions of its own `target_feature`, and a trait's methods cannot take
//! them from the caller.

pub(super) mod avx2;
pub(super) mod avx512;
mod blocks;
mod memory;
mod rows;
