//! Boards are data: one TOML file per device, and the schema that checks it.
//!
//! Conventions: the file says `schema = 1`; every number carries its unit in its key (`pulse_min_us`,
//! `pixel_pitch_um`); unknown keys are errors; angles are degrees in the camera frame (x right, y up,
//! counter-clockwise), servo angles are degrees at the servo's own shaft. [`Board::parse`] returns a board only if every
//! value lies in its allowed range, so whoever wires a device need not check again.
#![warn(clippy::indexing_slicing, clippy::expect_used, clippy::panic)]

mod check;
mod error;
pub mod locate;
mod schema;

use std::path::Path;

use locate::Fault;

pub use error::BoardError;
pub use locate::Place;
pub use schema::{
    Approach, Bayer, Board, BoardKind, Emulation, Encoder, EncoderChip, Identity, Memory, Polarizer, Sensor, Servo,
    Stokes, StokesWord, Usb, Wheel,
};

/// The schema number this crate reads.
pub const SCHEMA: i64 = 1;

/// The text of `boards/emulated.toml`, so that an installed program has a board without a file.
pub const EMULATED_TOML: &str = include_str!("../emulated.toml");

/// All a first look at a file needs: which schema the rest follows. Other keys are not judged yet.
#[derive(serde::Deserialize)]
struct SchemaOnly {
    schema: i64,
}

impl Board {
    /// Reads and checks one board file.
    ///
    /// # Errors
    /// [`BoardError::Io`] where the file cannot be read as UTF-8 text; else as [`Board::parse`].
    pub fn read(file: &Path) -> Result<Self, BoardError> {
        let text =
            std::fs::read_to_string(file).map_err(|source| BoardError::Io { file: file.to_path_buf(), source })?;
        Self::parse(&text, file)
    }

    /// Parses and checks the text of a board file; `file` only names it in errors.
    ///
    /// # Errors
    /// [`BoardError::UnknownSchema`] before anything else is judged, then [`BoardError::Parse`],
    /// [`BoardError::UnknownKey`] or [`BoardError::UnknownValue`] for what does not fit the schema, then
    /// [`BoardError::OutOfRange`] for the first value outside its range.
    pub fn parse(text: &str, file: &Path) -> Result<Self, BoardError> {
        let located = |e: toml::de::Error| BoardError::from(Fault::new(file, text, &e));
        let SchemaOnly { schema } = toml::from_str(text).map_err(located)?;
        if schema != SCHEMA {
            let place = locate::place_of_key(file, text, "schema");
            return Err(BoardError::UnknownSchema { place, found: schema, supported: SCHEMA });
        }
        let board: Self = toml::from_str(text).map_err(located)?;
        match check::first_violation(&board) {
            None => Ok(board),
            Some(v) => Err(BoardError::OutOfRange {
                place: locate::place_of_key(file, text, v.key),
                value: v.value,
                allowed: v.allowed,
            }),
        }
    }

    /// The board as TOML text: what [`Board::parse`] reads back to the same board. Comments are not kept.
    ///
    /// # Errors
    /// The encoder's own error; no board that [`Board::parse`] returned causes one.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }
}
