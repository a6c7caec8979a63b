//! Frames out, frames in: sequence numbers, the session filter, and what is read off the transport.

use super::{Counters, Options};
use crate::{LinkError, Transport};
use protocol_wire::{
    Deframer, Event, FromDevice, FromHost, HEADER_BYTES, Header, Log, MAX_PAYLOAD, Name, Refusal, Refused, StripHeader,
    VERSION,
};
use std::time::{Duration, Instant};

/// A message to the camera is at most a request for a capture of all frames.
const LARGEST_REQUEST: usize = 1024;
/// Room behind the largest frame, so that a read at its end is not short.
const READ_AHEAD: usize = 64 * 1024;

/// Longest time that one frame may take beyond the limit, while its bytes come in: the largest at 10 kB/s.
const FRAME_PATIENCE: Duration = Duration::from_secs(60);

type LogReader = Box<dyn FnMut(&Log) + Send>;

pub(super) struct Line<T> {
    pub(super) transport: T,
    pub(super) options: Options,
    /// 0 before identification.
    pub(super) session: u32,
    pub(super) counts: Counters,
    pub(super) on_log: Option<LogReader>,
    /// Payload of the strip that [`Incoming::Strip`] announced.
    pub(super) payload: Vec<u8>,
    sequence: u16,
    deframer: Deframer<Vec<u8>>,
}

/// What came.
#[expect(clippy::large_enum_variant, reason = "read one at a time, on the stack")]
pub(super) enum Incoming {
    Message(Header, FromDevice),
    /// A strip; its payload stands in [`Line::payload`].
    Strip(Header),
    /// A frame of this session whose payload was damaged.
    Damaged(Header),
    /// A frame of this session that this build has no message for.
    Unknown(Header),
    /// Nothing until the limit.
    Silence,
}

impl<T: Transport> Line<T> {
    pub(super) fn new(transport: T, options: Options) -> Self {
        Self {
            transport,
            options,
            session: 0,
            counts: Counters::default(),
            on_log: None,
            payload: Vec::new(),
            sequence: options.first_sequence,
            deframer: Deframer::new(vec![0; HEADER_BYTES + MAX_PAYLOAD + READ_AHEAD]),
        }
    }

    pub(super) fn counters(&self) -> Counters {
        Counters { skipped_bytes: self.deframer.skipped(), ..self.counts }
    }

    /// Sends a request under the next sequence number, which it returns.
    pub(super) fn send(&mut self, message: &FromHost) -> Result<u16, LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.send_as(self.sequence, message)?;
        Ok(self.sequence)
    }

    /// Sends a message that belongs to an earlier request.
    pub(super) fn send_as(&mut self, sequence: u16, message: &FromHost) -> Result<(), LinkError> {
        let mut frame = [0; LARGEST_REQUEST];
        let written = message.encode(sequence, self.session, &mut frame);
        let frame = written.ok().and_then(|n| frame.get(..n)).ok_or(LinkError::Malformed { path: message.path() })?;
        self.transport.write_all(frame, self.options.reply)
    }

    /// The next frame of this session, or silence: nothing until `limit`, and no frame under way. Log lines go to their reader.
    ///
    /// # Errors
    /// The transport's; [`LinkError::Version`]; [`LinkError::Malformed`] for a frame of this session that is not what its
    /// key says.
    pub(super) fn receive(&mut self, mut limit: Instant) -> Result<Incoming, LinkError> {
        let mut heard = None;
        let end = limit + FRAME_PATIENCE;
        loop {
            let session = self.session;
            match self.deframer.next_event() {
                Some(Event::ForeignVersion(header)) => {
                    return Err(LinkError::Version { theirs: header.version, ours: VERSION });
                }
                Some(Event::Damaged(header)) => {
                    self.counts.damaged += 1;
                    if header.session == session {
                        return Ok(Incoming::Damaged(header));
                    }
                }
                Some(Event::Frame(header, payload)) => {
                    // Before identification only answers count, and their sequence number tells whose they are.
                    let ours = if session == 0 { header.sequence == self.sequence } else { header.session == session };
                    if !ours {
                        // A camera that was restarted says in its own session that ours is closed.
                        let closed = FromDevice::Refused(Refused { refusal: Refusal::WrongSession });
                        if header.sequence == self.sequence
                            && FromDevice::decode(header.key, payload).as_ref() == Ok(&Some(closed.clone()))
                        {
                            return Ok(Incoming::Message(header, closed));
                        }
                        self.counts.wrong_session += 1;
                    } else if header.key == StripHeader::KEY.to_bytes() {
                        self.payload.clear();
                        self.payload.extend_from_slice(payload);
                        return Ok(Incoming::Strip(header));
                    } else {
                        match FromDevice::decode(header.key, payload) {
                            Ok(Some(FromDevice::Log(log))) => {
                                if let Some(reader) = &mut self.on_log {
                                    reader(&log);
                                }
                            }
                            Ok(Some(message)) => return Ok(Incoming::Message(header, message)),
                            Ok(None) => return Ok(Incoming::Unknown(header)),
                            Err(_) => return Err(LinkError::Malformed { path: path_of(header.key) }),
                        }
                    }
                }
                None => {
                    let left = limit.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        // After so long a pause the rest of a frame cut short will not come; whole frames may stand
                        // behind its header. While bytes still trickle in, it may.
                        let quiet = heard.is_none_or(|at: Instant| at.elapsed() >= self.options.reply / 2);
                        if quiet && self.deframer.give_up() {
                            continue;
                        }
                        return Ok(Incoming::Silence);
                    }
                    let n = self.transport.read(self.deframer.space(), left)?;
                    self.deframer.commit(n);
                    if n > 0 {
                        heard = Some(Instant::now());
                        // A slow line is not a silent one: a frame that is on its way gets the time it takes.
                        if self.deframer.mid_frame() {
                            limit = limit.max(Instant::now() + self.options.reply).min(end);
                        }
                    }
                }
            }
        }
    }
}

impl<T: std::fmt::Debug> std::fmt::Debug for Line<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut line = f.debug_struct("Line");
        line.field("transport", &self.transport).field("session", &self.session).field("counts", &self.counts);
        line.finish_non_exhaustive()
    }
}

/// The error that a refusal of request `path` is.
pub(super) fn refusal(refusal: Refusal, path: &'static str) -> LinkError {
    match refusal {
        Refusal::Unsupported { key } => LinkError::Unsupported { path, key },
        other => LinkError::Refused(other),
    }
}

fn path_of(key: [u8; 8]) -> &'static str {
    FromDevice::KEYS.iter().find(|(_, known)| known.to_bytes() == key).map_or("strip", |(path, _)| *path)
}
