//! A plane being received: its bytes, and which strips of them are there. It outlives connections, so that a fetch can be
//! resumed on a new one.

use crate::LinkError;
use protocol_wire::{CaptureDescription, CaptureId, Coding, MAX_PAYLOAD, PlaneInfo, PlaneKind, Strip};
use std::ops::Range;

/// Largest plane taken, bytes: four times the largest sensor of the board files, in 32-bit words.
pub const MAX_PLANE_BYTES: u64 = 1 << 29;

/// A plane of one capture, partly or wholly received.
#[derive(Clone, Debug)]
pub struct PlaneBuffer {
    description: Box<CaptureDescription>,
    info: PlaneInfo,
    /// Row-major, little-endian values; zero where not received.
    bytes: Vec<u8>,
    received: Vec<bool>,
    missing: u16,
}

/// What became of a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    New,
    Duplicate,
    /// Its values do not have their CRC.
    Corrupt,
    /// Of another capture or plane.
    Stray,
}

impl PlaneBuffer {
    /// An empty buffer for plane `kind` of the capture described.
    ///
    /// # Errors
    /// [`LinkError::NoPlane`] where there is none; [`LinkError::BadPlane`] where its description contradicts itself or it
    /// is larger than [`MAX_PLANE_BYTES`].
    pub fn new(description: &CaptureDescription, kind: PlaneKind) -> Result<Self, LinkError> {
        let info = description.planes.iter().find(|info| info.kind == kind);
        let info = *info.ok_or(LinkError::NoPlane { id: description.id, plane: kind })?;
        let size = checked_size(&info).map_err(|what| LinkError::BadPlane { plane: kind, what })?;
        Ok(Self {
            description: Box::new(description.clone()),
            info,
            bytes: vec![0; size],
            received: vec![false; usize::from(info.strips)],
            missing: info.strips,
        })
    }

    /// The plane's shape.
    #[must_use]
    pub fn info(&self) -> &PlaneInfo {
        &self.info
    }

    /// The capture it belongs to.
    #[must_use]
    pub fn capture(&self) -> CaptureId {
        self.description.id
    }

    /// Number of strips not received yet.
    #[must_use]
    pub fn missing(&self) -> u16 {
        self.missing
    }

    /// The values when all are there: height × width, row-major, little-endian, [`PlaneInfo::value_bytes`] each.
    #[must_use]
    pub fn bytes(&self) -> Option<&[u8]> {
        (self.missing == 0).then_some(&self.bytes)
    }

    /// As [`Self::bytes`], without a copy.
    #[must_use]
    pub fn into_bytes(self) -> Option<Vec<u8>> {
        (self.missing == 0).then_some(self.bytes)
    }

    /// Whether the buffer was begun from this very capture.
    pub(crate) fn belongs_to(&self, description: &CaptureDescription) -> bool {
        *self.description == *description
    }

    /// The first run of missing strips at or after `from`, else the first of all.
    pub(crate) fn missing_run(&self, from: u16) -> Option<Range<u16>> {
        let absent = |at: &u16| self.received.get(usize::from(*at)) == Some(&false);
        let start = (from..self.info.strips).find(absent).or_else(|| (0..self.info.strips).find(absent))?;
        let end = (start..self.info.strips).find(|at| !absent(at)).unwrap_or(self.info.strips);
        Some(start..end)
    }

    /// Stores a strip if it is sound and new.
    ///
    /// # Errors
    /// [`LinkError::Malformed`] where it contradicts the plane's description.
    pub(crate) fn take(&mut self, strip: &Strip<'_>) -> Result<Taken, LinkError> {
        let header = strip.header;
        if (header.id, header.plane) != (self.description.id, self.info.kind) {
            return Ok(Taken::Stray);
        }
        let malformed = LinkError::Malformed { path: "strip" };
        let Some(received) = self.received.get_mut(usize::from(header.index)) else { return Err(malformed) };
        let (rows, range) = extent(&self.info, header.index);
        let Some(room) = self.bytes.get_mut(range) else { return Err(malformed) };
        if u64::from(header.rows) != rows {
            return Err(malformed);
        }
        let values = match header.coding {
            Coding::Raw if strip.coded.len() == room.len() => strip.coded,
            Coding::Raw => return Err(malformed),
        };
        if *received {
            return Ok(Taken::Duplicate);
        }
        if crc32fast::hash(values) != header.values_crc {
            return Ok(Taken::Corrupt);
        }
        room.copy_from_slice(values);
        *received = true;
        self.missing -= 1;
        Ok(Taken::New)
    }
}

/// Size of the plane in bytes, if the description of it makes sense. Everything is bounded here, before any allocation.
fn checked_size(info: &PlaneInfo) -> Result<usize, &'static str> {
    if !matches!(info.value_bytes, 1 | 2 | 4) {
        return Err("its values are not of 1, 2 or 4 bytes");
    }
    if info.width == 0 || info.height == 0 || info.strip_rows == 0 {
        return Err("it is empty");
    }
    if info.height.div_ceil(u32::from(info.strip_rows)) != u32::from(info.strips) {
        return Err("its strips are not its rows");
    }
    let row = u64::from(info.width) * u64::from(info.value_bytes);
    let longest = row * u64::from(info.strip_rows).min(u64::from(info.height));
    if longest > MAX_PAYLOAD as u64 {
        return Err("its strips are longer than a frame");
    }
    let size = row.saturating_mul(u64::from(info.height));
    usize::try_from(size).ok().filter(|_| size <= MAX_PLANE_BYTES).ok_or("it is too large")
}

/// Rows and byte range of strip `index` of a plane that passed [`checked_size`].
fn extent(info: &PlaneInfo, index: u16) -> (u64, Range<usize>) {
    let first = u64::from(index) * u64::from(info.strip_rows);
    let rows = u64::from(info.strip_rows).min(u64::from(info.height).saturating_sub(first));
    let row = u64::from(info.width) * u64::from(info.value_bytes);
    let at = |bytes: u64| usize::try_from(bytes).unwrap_or(usize::MAX);
    (rows, at(first * row)..at((first + rows) * row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_wire::StripHeader;

    const GOOD: PlaneInfo =
        PlaneInfo { kind: PlaneKind::S0, value_bytes: 2, width: 10, height: 7, strip_rows: 3, strips: 3 };

    #[test]
    fn strips_tile_the_plane() {
        assert_eq!(checked_size(&GOOD), Ok(140));
        assert_eq!([0, 1, 2].map(|i| extent(&GOOD, i)), [(3, 0..60), (3, 60..120), (1, 120..140)]);
    }

    fn description() -> CaptureDescription {
        use protocol_wire::{Bayer, Calibration, CaptureState, SensorInfo, Word};
        let sensor = SensorInfo {
            model: "T".try_into().unwrap(),
            width: 10,
            height: 7,
            bit_depth: 12,
            bayer: Bayer::Mono,
            black_level_dn: 256,
            white_level_dn: 4095,
            gain_e_per_dn: 2.5,
            read_noise_e: 3.0,
            pixel_pitch_um: 1.5,
        };
        CaptureDescription {
            id: CaptureId(5),
            boot: 1,
            state: CaptureState::Complete,
            sensor,
            frames: [].into_iter().collect(),
            word: Word::I16,
            frac_bits: 2,
            bound_dn: [0.25; 3],
            misfit_sigma: 5.0,
            calibration: Calibration { dark_map: false, flat_map: false },
            planes: [GOOD].into_iter().collect(),
        }
    }

    #[test]
    fn only_strips_of_this_plane_and_shape_are_taken() {
        let values = [7; 60];
        let good = StripHeader {
            id: CaptureId(5),
            plane: PlaneKind::S0,
            index: 1,
            rows: 3,
            coding: Coding::Raw,
            values_crc: crc32fast::hash(&values),
        };
        let mut plane = PlaneBuffer::new(&description(), PlaneKind::S0).unwrap();
        let mut take = |header, coded: &[u8]| plane.take(&Strip { header, coded });
        let id = CaptureId(6);
        assert_eq!(take(StripHeader { id, ..good }, &values).unwrap(), Taken::Stray);
        assert_eq!(take(StripHeader { plane: PlaneKind::S1, ..good }, &values).unwrap(), Taken::Stray);
        for bad in [StripHeader { rows: 2, ..good }, StripHeader { index: 3, ..good }, StripHeader { index: 2, ..good }]
        {
            assert!(matches!(take(bad, &values), Err(LinkError::Malformed { path: "strip" })), "{bad:?}");
        }
        for wrong in [&values[..59], &[7; 61][..], &[]] {
            assert!(matches!(take(good, wrong), Err(LinkError::Malformed { path: "strip" })));
        }
        assert_eq!(take(StripHeader { values_crc: 1, ..good }, &values).unwrap(), Taken::Corrupt);
        assert_eq!(take(good, &values).unwrap(), Taken::New);
        assert_eq!(take(good, &values).unwrap(), Taken::Duplicate);
        assert_eq!((plane.missing(), plane.missing_run(0), plane.missing_run(1)), (2, Some(0..1), Some(2..3)));
        assert_eq!(plane.bytes[60..120], values);
    }

    #[test]
    fn a_description_that_cannot_be_is_refused_before_anything_is_allocated() {
        let huge = PlaneInfo { width: 16384, height: 524_280, strip_rows: 8, strips: 65535, ..GOOD };
        for (info, what) in [
            (PlaneInfo { value_bytes: 3, ..GOOD }, "1, 2 or 4"),
            (PlaneInfo { width: 0, ..GOOD }, "empty"),
            (PlaneInfo { strip_rows: 0, ..GOOD }, "empty"),
            (PlaneInfo { strips: 2, ..GOOD }, "strips are not"),
            (PlaneInfo { strips: 4, ..GOOD }, "strips are not"),
            (PlaneInfo { width: u32::MAX, height: u32::MAX, ..GOOD }, "strips are not"),
            (PlaneInfo { width: u32::MAX, ..GOOD }, "longer than a frame"),
            (huge, "too large"),
        ] {
            let said = checked_size(&info).unwrap_err();
            assert!(said.contains(what), "{info:?}: {said}");
        }
    }
}
