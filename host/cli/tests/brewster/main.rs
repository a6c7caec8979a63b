//! The program as its users meet it: files in, folders and exit codes out.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail by panicking, as tests do")]

mod bad_input;
mod broken_line;
mod camera;
mod fit;
mod good_input;
mod output;
mod real_data;
mod relight;
mod simulate;
mod world;
