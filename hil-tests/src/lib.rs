//! The bench the stories are told on: real firmware on emulated chips, a real host client, and faults between them.
//!
//! Time is virtual: a story sleeps only where threads wait for each other. A fault is a wrapper around a chip, a link or a
//! camera, seeded or scripted ([`Faults`]); nothing in the program under test knows of it.
#![expect(clippy::unwrap_used, clippy::missing_panics_doc, reason = "a bench that cannot be set up is a failed story")]

mod bench;
mod faults;
mod fetched;
mod reference;
mod tap;

pub use bench::{Bench, Plugged, board, board_of, capture_request, options};
pub use faults::{Cut, Faults, Faulty, Jammed};
pub use fetched::Fetched;
pub use reference::{Statistics, statistics};
pub use tap::{Conversation, Tap};
