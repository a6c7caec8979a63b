//! Frames on a byte stream, and finding them again after any loss.
//!
//! | offset | bytes | field |
//! |---|---|---|
//! | 0 | 4 | magic C5 42 52 57 |
//! | 4 | 1 | protocol version |
//! | 5 | 1 | 0 |
//! | 6 | 2 | sequence number; a reply repeats its request's |
//! | 8 | 4 | session, given by the camera; 0 before identification |
//! | 12 | 8 | schema key |
//! | 20 | 4 | payload length |
//! | 24 | 4 | CRC-32 of the payload |
//! | 28 | 4 | CRC-32 of bytes 0..28 |
//!
//! The reader believes a length only under a good header CRC, and rescans the bytes of any frame whose payload CRC fails:
//! a whole frame that follows a torn one is never lost.

use crc32fast::hash as crc32;

/// First bytes of every frame; not valid UTF-8, so no text contains it.
pub const MAGIC: [u8; 4] = [0xC5, b'B', b'R', b'W'];
/// Version of framing and messages together.
pub const VERSION: u8 = 1;
/// Bytes before the payload.
pub const HEADER_BYTES: usize = 32;
/// Largest payload: one strip and its header.
pub const MAX_PAYLOAD: usize = 640 * 1024;

/// Header fields that carry meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Protocol version of the sender.
    pub version: u8,
    /// Sequence number; a reply repeats its request's.
    pub sequence: u16,
    /// Session the frame belongs to.
    pub session: u32,
    /// Schema key of the message.
    pub key: [u8; 8],
    /// Payload length in bytes.
    pub length: u32,
}

/// What the reader found.
#[derive(Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// A whole, verified frame.
    Frame(Header, &'a [u8]),
    /// A verified header of another protocol version. The bytes behind it are searched for frames.
    ForeignVersion(Header),
    /// A verified header whose payload does not fit the reader or was damaged. The bytes behind it are searched for frames.
    Damaged(Header),
}

/// Why a frame cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// The buffer is too small, or the payload is larger than [`MAX_PAYLOAD`].
    TooLong {
        /// Bytes that were needed.
        needed: usize,
        /// Bytes there were.
        available: usize,
    },
    /// The message could not be encoded or decoded: not what its key says.
    Malformed,
}

/// Seals a frame in place: the payload already stands at `buffer[HEADER_BYTES..HEADER_BYTES + length]`.
///
/// Returns the length of the whole frame.
///
/// # Errors
/// [`FrameError::TooLong`].
pub fn seal(buffer: &mut [u8], header: Header) -> Result<usize, FrameError> {
    let length = usize::try_from(header.length).unwrap_or(usize::MAX);
    let needed = HEADER_BYTES.saturating_add(length);
    let available = buffer.len();
    let too_long = FrameError::TooLong { needed, available };
    if length > MAX_PAYLOAD {
        return Err(too_long);
    }
    let frame = buffer.get_mut(..needed).ok_or(too_long)?;
    let (head, payload) = frame.split_first_chunk_mut::<HEADER_BYTES>().ok_or(too_long)?;
    *head = header.to_bytes(crc32(payload));
    Ok(needed)
}

impl Header {
    fn to_bytes(self, payload_crc: u32) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        let fields: [&[u8]; 8] = [
            &MAGIC,
            &[self.version, 0],
            &self.sequence.to_le_bytes(),
            &self.session.to_le_bytes(),
            &self.key,
            &self.length.to_le_bytes(),
            &payload_crc.to_le_bytes(),
            &[0; 4],
        ];
        for (to, from) in bytes.iter_mut().zip(fields.into_iter().flatten()) {
            *to = *from;
        }
        let (body, crc) = bytes.split_at_mut(HEADER_BYTES - 4);
        crc.copy_from_slice(&crc32(body).to_le_bytes());
        bytes
    }

    /// The header at the start of `bytes` with the payload's CRC, if its magic and own CRC are right.
    fn parse(bytes: &[u8; HEADER_BYTES]) -> Option<(Self, u32)> {
        let mut rest: &[u8] = bytes;
        let magic: [u8; 4] = take(&mut rest)?;
        let [version, _] = take(&mut rest)?;
        let sequence = u16::from_le_bytes(take(&mut rest)?);
        let session = u32::from_le_bytes(take(&mut rest)?);
        let key = take(&mut rest)?;
        let length = u32::from_le_bytes(take(&mut rest)?);
        let payload_crc = u32::from_le_bytes(take(&mut rest)?);
        let header_crc = u32::from_le_bytes(take(&mut rest)?);
        let body = bytes.first_chunk::<{ HEADER_BYTES - 4 }>()?;
        (magic == MAGIC && header_crc == crc32(body))
            .then_some((Self { version, sequence, session, key, length }, payload_crc))
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

/// Reads frames out of a stream of bytes into a buffer it owns (an array on the device, a `Vec` on the host).
///
/// The buffer bounds the largest frame that can be read: [`HEADER_BYTES`] + payload.
#[derive(Debug)]
pub struct Deframer<B> {
    buffer: B,
    start: usize,
    end: usize,
    skipped: u64,
}

impl<B: AsRef<[u8]> + AsMut<[u8]>> Deframer<B> {
    /// A reader over `buffer`.
    pub fn new(buffer: B) -> Self {
        Self { buffer, start: 0, end: 0, skipped: 0 }
    }

    /// Free room to read into; follow with [`Self::commit`]. Never empty after [`Self::next_event`] returned `None`.
    pub fn space(&mut self) -> &mut [u8] {
        if self.start > 0 {
            self.buffer.as_mut().copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        self.buffer.as_mut().get_mut(self.end..).unwrap_or_default()
    }

    /// Takes the first `bytes` of [`Self::space`] as received.
    pub fn commit(&mut self, bytes: usize) {
        self.end = self.end.saturating_add(bytes).min(self.buffer.as_ref().len());
    }

    /// Bytes that belonged to no good frame so far.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Forgets what is buffered, as after a reconnect.
    pub fn clear(&mut self) {
        self.start = 0;
        self.end = 0;
    }

    /// Stops waiting for the rest of a frame, when the line has been silent too long for it to come: the bytes behind its
    /// header are searched. Returns whether there was anything to give up.
    pub fn give_up(&mut self) -> bool {
        let pending = self.start < self.end;
        if pending {
            self.skip(1);
        }
        pending
    }

    /// Whether a frame has begun whose rest is still to come (after [`Self::next_event`] has returned `None`).
    pub fn mid_frame(&self) -> bool {
        self.end - self.start >= HEADER_BYTES
    }

    /// The next thing found, or `None` until more bytes are committed.
    pub fn next_event(&mut self) -> Option<Event<'_>> {
        loop {
            self.skip_to_magic();
            let pending = self.buffer.as_ref().get(self.start..self.end)?;
            let head = pending.first_chunk::<HEADER_BYTES>()?;
            let Some((header, payload_crc)) = Header::parse(head) else {
                self.skip(1);
                continue;
            };
            if header.version != VERSION {
                self.skip(HEADER_BYTES);
                return Some(Event::ForeignVersion(header));
            }
            let total = HEADER_BYTES.saturating_add(usize::try_from(header.length).unwrap_or(usize::MAX));
            if total > self.buffer.as_ref().len() {
                self.skip(1);
                return Some(Event::Damaged(header));
            }
            let payload = pending.get(HEADER_BYTES..total)?;
            if crc32(payload) != payload_crc {
                self.skip(1);
                return Some(Event::Damaged(header));
            }
            let begin = self.start + HEADER_BYTES;
            let end = self.start + total;
            self.start = end;
            return self.buffer.as_ref().get(begin..end).map(|payload| Event::Frame(header, payload));
        }
    }

    fn skip_to_magic(&mut self) {
        let pending = self.buffer.as_ref().get(self.start..self.end).unwrap_or_default();
        // A tail shorter than the magic may be its beginning.
        let found = (0..pending.len())
            .find(|at| pending.iter().skip(*at).zip(MAGIC).all(|(a, b)| *a == b))
            .unwrap_or(pending.len());
        self.skip(found);
    }

    fn skip(&mut self, bytes: usize) {
        self.start += bytes;
        self.skipped += bytes as u64;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    fn frame(sequence: u16, payload: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0; HEADER_BYTES];
        bytes.extend_from_slice(payload);
        let header = Header { version: VERSION, sequence, session: 7, key: *b"keykeyke", length: payload.len() as u32 };
        let n = seal(&mut bytes, header).unwrap();
        assert_eq!(n, bytes.len());
        bytes
    }

    /// Feeds `bytes` in pieces of `step` and collects the sequence numbers of good frames.
    fn read(bytes: &[u8], step: usize) -> Vec<u16> {
        let mut deframer = Deframer::new(vec![0; 4096]);
        let mut seen = Vec::new();
        for piece in bytes.chunks(step) {
            let mut rest = piece;
            while !rest.is_empty() {
                let space = deframer.space();
                let n = space.len().min(rest.len());
                space[..n].copy_from_slice(&rest[..n]);
                deframer.commit(n);
                rest = &rest[n..];
                while let Some(event) = deframer.next_event() {
                    if let Event::Frame(header, _) = event {
                        seen.push(header.sequence);
                    }
                }
            }
        }
        seen
    }

    #[test]
    fn golden_header() {
        let bytes = frame(0x0201, b"abc");
        let want = [
            0xC5, 0x42, 0x52, 0x57, 1, 0, 0x01, 0x02, 7, 0, 0, 0, b'k', b'e', b'y', b'k', b'e', b'y', b'k', b'e', 3, 0,
            0, 0, 0xC2, 0x41, 0x24, 0x35,
        ];
        assert_eq!(bytes[..28], want, "CRC-32 of \"abc\" is 352441C2 (the check value of IEEE 802.3's polynomial)");
        assert_eq!(bytes[28..32], crc32(&want).to_le_bytes());
    }

    #[test]
    fn another_version_is_told_apart_from_noise() {
        let mut bytes = frame(1, b"abc");
        let header = Header { version: 9, sequence: 1, session: 7, key: [0; 8], length: 3 };
        seal(&mut bytes, header).unwrap();
        let mut deframer = Deframer::new([0; 256]);
        deframer.space()[..bytes.len()].copy_from_slice(&bytes);
        deframer.commit(bytes.len());
        assert_eq!(deframer.next_event(), Some(Event::ForeignVersion(header)));
    }

    #[test]
    fn another_version_is_told_whatever_its_length() {
        let mut bytes = frame(1, &[0; 300]);
        let header = Header { version: 9, sequence: 1, session: 7, key: [0; 8], length: 300 };
        seal(&mut bytes, header).unwrap();
        let mut deframer = Deframer::new([0; 256]);
        deframer.space()[..HEADER_BYTES].copy_from_slice(&bytes[..HEADER_BYTES]);
        deframer.commit(HEADER_BYTES);
        assert_eq!(deframer.next_event(), Some(Event::ForeignVersion(header)));
    }

    #[test]
    fn a_frame_behind_one_that_was_cut_short_is_found_when_the_line_falls_silent() {
        let cut = &frame(1, &[0; 200])[..120];
        let bytes = [cut, &frame(2, b"abc")].concat();
        let mut deframer = Deframer::new([0; 256]);
        deframer.space()[..bytes.len()].copy_from_slice(&bytes);
        deframer.commit(bytes.len());
        assert_eq!(deframer.next_event(), None, "the first frame's rest may still come");
        assert!(deframer.give_up());
        assert!(matches!(deframer.next_event(), Some(Event::Frame(Header { sequence: 2, .. }, b"abc"))));
        assert!(!deframer.give_up());
    }

    #[test]
    fn a_frame_larger_than_the_reader_is_damage_not_a_stall() {
        let bytes = frame(1, &[0; 300]);
        let mut deframer = Deframer::new([0; 256]);
        deframer.space().copy_from_slice(&bytes[..256]);
        deframer.commit(256);
        assert!(matches!(deframer.next_event(), Some(Event::Damaged(h)) if h.length == 300));
        assert_eq!(deframer.next_event(), None);
        assert!(!deframer.space().is_empty());
    }

    proptest! {
        #[test]
        fn whole_frames_survive_any_cutting(payloads in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..200), 1..8), step in 1..300_usize) {
            let bytes: Vec<u8> = payloads.iter().enumerate().flat_map(|(i, p)| frame(i as u16, p)).collect();
            let all: Vec<u16> = (0..payloads.len() as u16).collect();
            prop_assert_eq!(read(&bytes, step), all);
        }

        /// Garbage before, lost bytes inside one frame: all the other frames arrive. (A flush of further frames lets the
        /// reader see that the torn one will not come.)
        #[test]
        fn a_torn_frame_costs_only_itself(
            garbage in prop::collection::vec(any::<u8>(), 0..100),
            torn in 0..5_usize,
            (from, lost) in (0..100_usize, 1..60_usize),
            step in 1..300_usize,
        ) {
            let mut bytes = garbage;
            for i in 0..5 {
                let mut f = frame(i as u16, &[i as u8; 120]);
                if i == torn {
                    f.drain(from..(from + lost).min(f.len()));
                }
                bytes.extend(f);
            }
            for i in 100..105 {
                bytes.extend(frame(i, &[0; 120]));
            }
            let seen = read(&bytes, step);
            for i in (0..5_u16).filter(|i| usize::from(*i) != torn) {
                prop_assert!(seen.contains(&i), "{seen:?} lacks {i}");
            }
        }

        #[test]
        fn noise_never_panics_and_never_passes(noise in prop::collection::vec(any::<u8>(), 0..2000), step in 1..100_usize) {
            prop_assert!(read(&noise, step).is_empty());
        }
    }
}
