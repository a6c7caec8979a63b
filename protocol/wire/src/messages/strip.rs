//! Strips: the bulk of what is sent. A header message, and the coded values behind it in the same frame.

use super::Name;
use super::capture::{CaptureId, PlaneKind};
use crate::frame::{FrameError, HEADER_BYTES, Header, VERSION, seal};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// How the values of a strip are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Coding {
    /// As they are, little-endian.
    Raw,
}

/// What stands before the values of a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StripHeader {
    /// The capture.
    pub id: CaptureId,
    /// The plane.
    pub plane: PlaneKind,
    /// Number of the strip in its plane.
    pub index: u16,
    /// Rows in it.
    pub rows: u16,
    /// Coding of the values.
    pub coding: Coding,
    /// CRC-32 of the decoded values, computed when they were: it also guards the camera's storage.
    pub values_crc: u32,
}

/// A strip as received: the header and the coded values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strip<'a> {
    /// The header.
    pub header: StripHeader,
    /// The coded values.
    pub coded: &'a [u8],
}

impl Name for StripHeader {
    const PATH: &'static str = "strip";
}

impl StripHeader {
    /// Writes the whole frame into `buffer`: `fill` puts the coded values into the room it is given and says how many
    /// bytes they are. Returns the length of the frame.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] where the buffer is too small; whatever `fill` returns.
    pub fn encode<E: From<FrameError>>(
        &self,
        sequence: u16,
        session: u32,
        buffer: &mut [u8],
        fill: impl FnOnce(&mut [u8]) -> Result<usize, E>,
    ) -> Result<usize, E> {
        let available = buffer.len();
        let too_long = FrameError::TooLong { needed: available + 1, available };
        let room = buffer.get_mut(HEADER_BYTES..).ok_or(too_long)?;
        let head = postcard::to_slice(self, room).map_err(|_| too_long)?.len();
        let values = fill(room.get_mut(head..).ok_or(too_long)?)?;
        let length = u32::try_from(head + values).map_err(|_| too_long)?;
        Ok(seal(buffer, Header { version: VERSION, sequence, session, key: Self::KEY.to_bytes(), length })?)
    }
}

impl<'a> Strip<'a> {
    /// Reads a strip if `key` is a strip's.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] where the payload is not one.
    pub fn decode(key: [u8; 8], payload: &'a [u8]) -> Result<Option<Self>, FrameError> {
        if key != StripHeader::KEY.to_bytes() {
            return Ok(None);
        }
        let (header, coded) = postcard::take_from_bytes(payload).map_err(|_| FrameError::Malformed)?;
        Ok(Some(Self { header, coded }))
    }
}
