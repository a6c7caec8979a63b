//! The session with one host: commands in, answers and strips out, never more than was granted.

use super::{Activity, Device, Work};
use crate::hardware::{ByteLink, CaptureStore, FrameSource, Micros, StoreError, Wheel};
use heapless::Deque;
use protocol_wire::{
    Accepted, CaptureId, CaptureList, Coding, Deframer, Event, Fetch, FrameError, FromDevice, FromHost, HEADER_BYTES,
    Header, Identify, Identity, Name, PlaneInfo, Progress, Refusal, Refused, Released, Status, StripHeader,
};

/// Largest command a host can send, header included.
const INCOMING_BYTES: usize = 2048;
/// Silence after which a half-read command is given up: its rest will not come.
const SILENCE_US: u64 = 500_000;
/// Answers that may wait for the link.
const WAITING: usize = 8;

/// One host's session.
#[derive(Debug)]
pub(super) struct Session {
    /// 0: closed.
    id: u32,
    next_id: u32,
    incoming: Deframer<[u8; INCOMING_BYTES]>,
    answers: Deque<(u16, FromDevice), WAITING>,
    fetch: Option<Sending>,
    /// What of the outgoing frame has not been sent: begin and end.
    unsent: (usize, usize),
    /// The session that started the running work: only it gets news of it, under a number of its own.
    at_work_for: u32,
    last_received: Micros,
}

/// Strips being sent.
#[derive(Clone, Copy, Debug)]
struct Sending {
    sequence: u16,
    request: Fetch,
    plane: PlaneInfo,
    sent: u16,
    credit: u16,
}

impl Session {
    pub(super) fn new(boot: u32) -> Self {
        Self {
            id: 0,
            next_id: boot.max(1),
            incoming: Deframer::new([0; INCOMING_BYTES]),
            answers: Deque::new(),
            fetch: None,
            unsent: (0, 0),
            at_work_for: 0,
            last_received: Micros(0),
        }
    }

    /// Queues an answer. When the host does not read, reports give way to it, and at last the oldest answer does.
    pub(super) fn answer(&mut self, sequence: u16, message: FromDevice) {
        if self.id == 0 {
            return;
        }
        if self.answers.is_full() {
            self.answers.pop_front();
        }
        self.answers.push_back((sequence, message)).ok(); // there is room now
    }

    /// Queues news of the running work for the session that started it. In any other the sequence number means something
    /// else, or nothing.
    pub(super) fn tell(&mut self, sequence: u16, news: FromDevice) {
        if self.id == self.at_work_for {
            self.answer(sequence, news);
        }
    }

    /// Queues a progress report if the host keeps up.
    pub(super) fn report(&mut self, sequence: u16, progress: Progress) {
        if self.answers.len() < WAITING / 2 {
            self.tell(sequence, FromDevice::Progress(progress));
        }
    }

    pub(super) fn fetching(&self) -> Option<CaptureId> {
        self.fetch.map(|fetch| fetch.request.id)
    }

    /// The host is gone: nothing of the session is left, captures stay.
    pub(super) fn close(&mut self) {
        self.id = 0;
        self.incoming.clear();
        self.answers.clear();
        self.fetch = None;
        self.unsent = (0, 0);
    }
}

impl<W: Wheel, C: FrameSource, S: CaptureStore> Device<'_, W, C, S> {
    pub(super) fn serve(&mut self, now: Micros, link: &mut impl ByteLink) -> Activity {
        let room = self.session.incoming.space();
        // An empty read would look like a closed link to some.
        let received = if room.is_empty() { Ok(0) } else { link.read(room) };
        let Ok(received) = received else {
            self.session.close();
            return Activity::Idle;
        };
        self.session.incoming.commit(received);
        if received > 0 {
            self.session.last_received = now;
        }
        // A host that asks faster than it reads waits here: commands stay in the buffer while answers are queued.
        while self.session.answers.len() < WAITING / 2 {
            let Some((header, command)) = self.next_command(now) else { break };
            self.obey(now, header, command);
        }
        match self.send(link) {
            Ok(sent) if sent + received > 0 => Activity::Busy,
            Ok(_) => Activity::Idle,
            Err(()) => {
                self.session.close();
                Activity::Idle
            }
        }
    }

    /// The next whole frame, read as a command.
    fn next_command(&mut self, now: Micros) -> Option<(Header, Result<FromHost, Refusal>)> {
        loop {
            let Some(event) = self.session.incoming.next_event() else {
                let silent = now.0.saturating_sub(self.session.last_received.0) > SILENCE_US;
                if silent && self.session.incoming.give_up() {
                    continue;
                }
                return None;
            };
            return match event {
                Event::Frame(header, payload) => {
                    let command = match FromHost::decode(header.key, payload) {
                        Ok(Some(command)) => Ok(command),
                        Ok(None) => Err(Refusal::Unsupported { key: header.key }),
                        Err(_) => Err(Refusal::Malformed),
                    };
                    Some((header, command))
                }
                // The answer carries our version in its header: that is what tells the host.
                Event::ForeignVersion(header) => Some((header, Err(Refusal::Unsupported { key: header.key }))),
                Event::Damaged(_) => continue,
            };
        }
    }

    fn obey(&mut self, now: Micros, header: Header, command: Result<FromHost, Refusal>) {
        let sequence = header.sequence;
        let is_identify = header.key == Identify::KEY.to_bytes();
        let answer = match command {
            // Refusing needs no session: a host of another version gets its answer too.
            Err(refusal) => {
                if self.session.id == 0 {
                    self.open();
                }
                Err(refusal)
            }
            Ok(_) if !is_identify && (self.session.id == 0 || header.session != self.session.id) => {
                if self.session.id == 0 {
                    self.open();
                }
                Err(Refusal::WrongSession)
            }
            Ok(command) => self.carry_out(now, sequence, command),
        };
        match answer {
            Ok(Some(message)) => self.session.answer(sequence, message),
            Ok(None) => {}
            Err(refusal) => self.session.answer(sequence, FromDevice::Refused(Refused { refusal })),
        }
    }

    fn open(&mut self) {
        self.session.id = self.session.next_id;
        self.session.next_id = self.session.next_id.wrapping_add(1).max(1);
    }

    fn carry_out(&mut self, now: Micros, sequence: u16, command: FromHost) -> Result<Option<FromDevice>, Refusal> {
        Ok(match command {
            FromHost::Identify(_) => {
                // A new host, or the same one anew: what the last one had asked for is not for it.
                self.session.answers.clear();
                self.session.fetch = None;
                self.open();
                Some(FromDevice::Identity(self.identity()))
            }
            FromHost::GetStatus(_) => Some(FromDevice::Status(self.status(now))),
            FromHost::StartCapture(start) => {
                self.must_be_idle()?;
                let job = self.start_capture(sequence, start.request)?;
                let id = job.id();
                self.work = Work::Capture(job);
                self.session.at_work_for = self.session.id;
                Some(FromDevice::Accepted(Accepted { id }))
            }
            FromHost::Cancel(_) => {
                match core::mem::replace(&mut self.work, Work::Idle) {
                    Work::Capture(job) => {
                        self.store.remove(job.id()).ok(); // it may not have been written yet
                        let refused = Refused { refusal: Refusal::Cancelled };
                        self.session.tell(job.sequence(), FromDevice::Refused(refused));
                    }
                    Work::Calibration(job) => {
                        let refused = Refused { refusal: Refusal::Cancelled };
                        self.session.tell(job.sequence(), FromDevice::Refused(refused));
                    }
                    Work::Idle => {}
                }
                Some(FromDevice::Status(self.status(now)))
            }
            FromHost::Calibrate(what) => {
                self.must_be_idle()?;
                match self.start_calibration(sequence, what)? {
                    Some(job) => {
                        self.work = Work::Calibration(job);
                        self.session.at_work_for = self.session.id;
                        None
                    }
                    None => Some(FromDevice::Done(protocol_wire::Done { id: None })),
                }
            }
            FromHost::ListCaptures(_) => Some(FromDevice::CaptureList(CaptureList { captures: self.store.list() })),
            FromHost::Describe(describe) => {
                let unknown = Refusal::UnknownCapture(describe.id);
                let description = self.store.describe(describe.id).map_err(|error| known(error, unknown))?;
                Some(FromDevice::Description(description))
            }
            FromHost::Fetch(request) => {
                let unknown = Refusal::UnknownCapture(request.id);
                let description = self.store.describe(request.id).map_err(|error| known(error, unknown))?;
                let plane = description.planes.iter().find(|plane| plane.kind == request.plane).copied();
                let plane = plane.ok_or(Refusal::UnknownStrip)?;
                if u32::from(request.first) + u32::from(request.count) > u32::from(plane.strips) {
                    return Err(Refusal::UnknownStrip);
                }
                self.session.fetch = Some(Sending { sequence, request, plane, sent: 0, credit: request.credit });
                None
            }
            FromHost::Grant(grant) => {
                if let Some(fetch) = &mut self.session.fetch {
                    fetch.credit = fetch.credit.saturating_add(grant.credit);
                }
                None
            }
            FromHost::Release(release) => {
                let unknown = Refusal::UnknownCapture(release.id);
                self.store.remove(release.id).map_err(|error| known(error, unknown))?;
                if self.session.fetching() == Some(release.id) {
                    self.session.fetch = None;
                }
                Some(FromDevice::Released(Released { id: release.id }))
            }
        })
    }

    fn must_be_idle(&self) -> Result<(), Refusal> {
        if matches!(self.work, Work::Idle) { Ok(()) } else { Err(Refusal::Busy) }
    }

    fn identity(&self) -> Identity {
        Identity {
            session: self.session.id,
            serial: self.setup.serial.clone(),
            board: self.setup.board.clone(),
            firmware: self.setup.firmware.clone(),
            sensor: self.setup.sensor.clone(),
            default_frames: self.setup.default_frames.clone(),
            default_word: self.setup.default_word,
        }
    }

    fn status(&mut self, now: Micros) -> Status {
        Status {
            state: self.state(),
            uptime_us: now.0,
            captures: u8::try_from(self.store.list().len()).unwrap_or(u8::MAX),
            free_bytes: self.store.free_bytes(),
            skipped_bytes: self.session.incoming.skipped(),
        }
    }

    /// Sends what the link takes: the rest of a frame, else the next answer, else the next strip.
    fn send(&mut self, link: &mut impl ByteLink) -> Result<usize, ()> {
        let mut sent = 0;
        loop {
            let (begin, end) = self.session.unsent;
            let rest = self.memory.outgoing.get(begin..end).unwrap_or_default();
            if !rest.is_empty() {
                let taken = link.write(rest).map_err(|_| ())?;
                if taken == 0 {
                    return Ok(sent);
                }
                sent += taken;
                self.session.unsent.0 += taken;
                continue;
            }
            match self.next_frame() {
                Some(length) => self.session.unsent = (0, length),
                None => return Ok(sent),
            }
        }
    }

    fn next_frame(&mut self) -> Option<usize> {
        let session = self.session.id;
        while let Some((sequence, message)) = self.session.answers.pop_front() {
            // Every message fits: the outgoing frame has room for the largest.
            if let Ok(length) = message.encode(sequence, session, self.memory.outgoing) {
                return Some(length);
            }
        }
        let mut fetch = self.session.fetch.take()?;
        if fetch.sent == fetch.request.count {
            return None;
        }
        if fetch.credit == 0 {
            self.session.fetch = Some(fetch);
            return None;
        }
        let strip = fetch.request.first + fetch.sent;
        match self.strip_frame(&fetch, strip) {
            Ok(length) => {
                fetch.sent += 1;
                fetch.credit -= 1;
                self.session.fetch = Some(fetch);
                Some(length)
            }
            Err(error) => {
                let refusal = known(error, Refusal::UnknownStrip);
                self.session.answer(fetch.sequence, FromDevice::Refused(Refused { refusal }));
                self.next_frame()
            }
        }
    }

    fn strip_frame(&mut self, fetch: &Sending, strip: u16) -> Result<usize, StoreError> {
        let Fetch { id, plane, .. } = fetch.request;
        // The values are read once into the room of a strip, then framed: the header needs their CRC first.
        let (length, values_crc) = self.store.read(id, plane, strip, self.memory.bytes)?;
        let values = self.memory.bytes.get(..length).ok_or(StoreError::Missing)?;
        let rows_above = u32::from(strip) * u32::from(fetch.plane.strip_rows);
        let rows = fetch.plane.height.saturating_sub(rows_above).min(fetch.plane.strip_rows.into());
        let rows = u16::try_from(rows).unwrap_or(fetch.plane.strip_rows);
        let header = StripHeader { id, plane, index: strip, rows, coding: Coding::Raw, values_crc };
        let framed: Result<usize, FrameError> =
            header.encode(fetch.sequence, self.session.id, self.memory.outgoing, |room| {
                let too_long = FrameError::TooLong { needed: length + HEADER_BYTES, available: room.len() };
                room.get_mut(..length).ok_or(too_long)?.copy_from_slice(values);
                Ok(length)
            });
        framed.map_err(|_| StoreError::Failed(crate::hardware::text("a strip is larger than a frame")))
    }
}

/// What to tell the host about a store error, where a missing thing means `missing`.
fn known(error: StoreError, missing: Refusal) -> Refusal {
    match error {
        StoreError::Missing => missing,
        other => other.into(),
    }
}
