//! The typed client: one camera, one session, one request at a time.
//!
//! Requests that change nothing are repeated when no answer comes. A lost connection is [`LinkError::Gone`]: connect
//! again, describe the capture again and go on with the same [`crate::PlaneBuffer`].

mod fetch;
mod line;
mod work;

use crate::{LinkError, Transport};
use line::{Incoming, Line};
use protocol_wire::{
    Cancel, CaptureDescription, CaptureId, CaptureSummary, Describe, FromDevice, FromHost, GetStatus, Identify,
    Identity, ListCaptures, Log, Refusal, Release, Status,
};
use std::hash::{BuildHasher, Hasher};
use std::time::{Duration, Instant};

/// How long to wait, and how much to ask for at once.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Silence after which a request is repeated, or missing strips are asked for again.
    pub reply: Duration,
    /// How often a request is sent before giving up, and a strip with wrong values is asked for.
    pub attempts: u8,
    /// Longest time without news of a running capture or calibration, beyond its exposure.
    pub work: Duration,
    /// Longest time of a fetch without a new strip.
    pub stall: Duration,
    /// Strips on their way at once.
    pub window: u16,
    /// Sequence number before the first. It should differ between connections, so that what is left of an old one is told
    /// apart.
    pub first_sequence: u16,
}

impl Default for Options {
    fn default() -> Self {
        let seed = std::hash::RandomState::new().build_hasher().finish();
        let [a, b, ..] = seed.to_le_bytes();
        Self {
            reply: Duration::from_secs(1),
            attempts: 5,
            work: Duration::from_secs(60),
            stall: Duration::from_secs(10),
            window: 8,
            first_sequence: u16::from_le_bytes([a, b]),
        }
    }
}

/// What happened on the line besides what was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Bytes that belonged to no good frame.
    pub skipped_bytes: u64,
    /// Frames whose payload was damaged.
    pub damaged: u64,
    /// Frames of another session, ignored.
    pub wrong_session: u64,
    /// Frames nobody waited for, ignored.
    pub stray: u64,
    /// Requests sent again.
    pub repeated: u64,
    /// Strips that came twice.
    pub duplicate_strips: u64,
    /// Strips whose values did not have their CRC.
    pub corrupt_strips: u64,
}

/// A camera that has said who it is.
#[derive(Debug)]
pub struct Client<T> {
    line: Line<T>,
    identity: Box<Identity>,
}

impl<T: Transport> Client<T> {
    /// Opens a session: asks the camera who it is. `host_name` is for its log (cut to 32 bytes).
    ///
    /// # Errors
    /// [`LinkError::Timeout`] where nobody answers, [`LinkError::Version`] where the answer is of another version,
    /// [`LinkError::Unsupported`] where the builds differ; the transport's.
    pub fn connect(transport: T, host_name: &str) -> Result<Self, LinkError> {
        Self::connect_with(transport, host_name, Options::default())
    }

    /// As [`Self::connect`], with other times and window.
    ///
    /// # Errors
    /// As [`Self::connect`].
    pub fn connect_with(transport: T, host_name: &str, options: Options) -> Result<Self, LinkError> {
        let mut line = Line::new(transport, options);
        let end = (0..=32).rev().find(|end| host_name.is_char_boundary(*end)).unwrap_or_default();
        let host = host_name.get(..end).unwrap_or(host_name).try_into().unwrap_or_default();
        let identify = FromHost::Identify(Identify { host });
        let identity = request(&mut line, &identify, |header, message| match message {
            // The session stands twice; a camera that contradicts itself is not believed.
            FromDevice::Identity(identity) if identity.session == header.session && header.session != 0 => {
                Some(Box::new(identity))
            }
            _ => None,
        })?;
        line.session = identity.session;
        Ok(Self { line, identity })
    }

    /// Who the camera is.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Where the camera is, for people.
    #[must_use]
    pub fn describe_transport(&self) -> String {
        self.line.transport.describe()
    }

    /// What happened on the line so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.line.counters()
    }

    /// Hands every line of the camera's log to `reader`, as they come in while something else is waited for.
    pub fn on_log(&mut self, reader: impl FnMut(&Log) + Send + 'static) {
        self.line.on_log = Some(Box::new(reader));
    }

    /// What the camera is doing.
    ///
    /// # Errors
    /// As [`Self::connect`].
    pub fn status(&mut self) -> Result<Status, LinkError> {
        self.request(&FromHost::GetStatus(GetStatus), |message| match message {
            FromDevice::Status(status) => Some(status),
            _ => None,
        })
    }

    /// Stops a running capture or calibration, whoever started it. (One that [`Self::capture`] waits for is stopped from
    /// its callback.)
    ///
    /// # Errors
    /// As [`Self::connect`].
    pub fn cancel(&mut self) -> Result<Status, LinkError> {
        self.request(&FromHost::Cancel(Cancel), |message| match message {
            FromDevice::Status(status) => Some(status),
            _ => None,
        })
    }

    /// The captures the camera holds, oldest first.
    ///
    /// # Errors
    /// As [`Self::connect`].
    pub fn list(&mut self) -> Result<Vec<CaptureSummary>, LinkError> {
        self.request(&FromHost::ListCaptures(ListCaptures), |message| match message {
            FromDevice::CaptureList(list) => Some(list.captures.to_vec()),
            _ => None,
        })
    }

    /// All there is to know about a capture.
    ///
    /// # Errors
    /// [`LinkError::Refused`] with [`Refusal::UnknownCapture`]; as [`Self::connect`].
    pub fn describe(&mut self, id: CaptureId) -> Result<CaptureDescription, LinkError> {
        self.request(&FromHost::Describe(Describe { id }), |message| match message {
            FromDevice::Description(description) if description.id == id => Some(description),
            _ => None,
        })
    }

    /// Lets the camera forget a capture: only after all of it is stored safely.
    ///
    /// # Errors
    /// [`LinkError::Refused`] with [`Refusal::UnknownCapture`]; as [`Self::connect`].
    pub fn release(&mut self, id: CaptureId) -> Result<(), LinkError> {
        let repeated = self.line.counts.repeated;
        let released = self.request(&FromHost::Release(Release { id }), |message| match message {
            FromDevice::Released(released) if released.id == id => Some(()),
            _ => None,
        });
        match released {
            // The answer was lost, not the request: the capture is as released as it can be.
            Err(LinkError::Refused(Refusal::UnknownCapture(_))) if self.line.counts.repeated > repeated => Ok(()),
            other => other,
        }
    }

    fn request<R>(&mut self, message: &FromHost, pick: impl Fn(FromDevice) -> Option<R>) -> Result<R, LinkError> {
        request(&mut self.line, message, |_, answer| pick(answer))
    }
}

/// Sends a request that may safely be repeated and waits for the answer that `pick` takes.
fn request<T: Transport, R>(
    line: &mut Line<T>,
    message: &FromHost,
    pick: impl Fn(protocol_wire::Header, FromDevice) -> Option<R>,
) -> Result<R, LinkError> {
    let path = message.path();
    for attempt in 0..line.options.attempts.max(1) {
        line.counts.repeated += u64::from(attempt > 0);
        // A new number each time: an answer to an earlier attempt may name a session that the later one has closed.
        let sequence = line.send(message)?;
        let limit = Instant::now() + line.options.reply;
        loop {
            match line.receive(limit)? {
                Incoming::Message(header, FromDevice::Refused(refused)) if header.sequence == sequence => {
                    return Err(line::refusal(refused.refusal, path));
                }
                Incoming::Message(header, answer) if header.sequence == sequence => {
                    return pick(header, answer).ok_or(LinkError::Malformed { path });
                }
                Incoming::Unknown(header) if header.sequence == sequence => {
                    return Err(LinkError::Unsupported { path, key: header.key });
                }
                Incoming::Silence => break,
                _ => line.counts.stray += 1,
            }
        }
    }
    Err(LinkError::Timeout { waiting_for: answer_to(message) })
}

/// Path of the answer to a request.
fn answer_to(message: &FromHost) -> &'static str {
    match message {
        FromHost::Identify(_) => "identity",
        FromHost::GetStatus(_) | FromHost::Cancel(_) => "status",
        FromHost::StartCapture(_) => "capture/accepted",
        FromHost::Calibrate(_) => "capture/done",
        FromHost::ListCaptures(_) => "captures",
        FromHost::Describe(_) => "captures/description",
        FromHost::Fetch(_) | FromHost::Grant(_) => "strip",
        FromHost::Release(_) => "captures/released",
    }
}
