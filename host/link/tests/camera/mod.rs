//! A camera for tests: it speaks real frames as docs/PROTOCOL.md has them, holds one capture, and misbehaves as told.
#![allow(dead_code, reason = "each test binary uses what it needs")]
#![allow(clippy::unwrap_used, clippy::cast_possible_truncation, reason = "a test's camera")]

use host_link::in_process::{DeviceEnd, HostEnd, pair};
use host_link::{Client, LinkError, Options};
use protocol_wire::*;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::thread::JoinHandle;
use std::time::Duration;

/// Name of the capture it holds.
pub(crate) const HELD: CaptureId = CaptureId(77);
/// Name of the capture it takes when asked.
pub(crate) const TAKEN: CaptureId = CaptureId(78);

/// For tests in which nothing has to time out: a busy machine does not make it repeat anything.
pub(crate) fn patient() -> Options {
    Options { reply: Duration::from_secs(10), stall: Duration::from_secs(20), ..quick() }
}

/// For tests that wait for silence.
pub(crate) fn quick() -> Options {
    Options {
        reply: Duration::from_millis(150),
        attempts: 4,
        work: Duration::from_millis(400),
        stall: Duration::from_millis(1500),
        first_sequence: 65_530,
        ..Options::default()
    }
}

/// The camera's end of a byte pipe, never blocking. `None`: the host has left.
pub(crate) trait Pipe: Send {
    fn take(&mut self, buf: &mut [u8]) -> Option<usize>;
    fn give(&mut self, bytes: &[u8]) -> Option<usize>;
}

impl Pipe for DeviceEnd {
    fn take(&mut self, buf: &mut [u8]) -> Option<usize> {
        self.read(buf).ok()
    }

    fn give(&mut self, bytes: &[u8]) -> Option<usize> {
        self.write(bytes).ok()
    }
}

/// A socket set to non-blocking.
pub(crate) struct Socket<S>(pub(crate) S);

impl<S: Read + Write + Send> Pipe for Socket<S> {
    fn take(&mut self, buf: &mut [u8]) -> Option<usize> {
        match self.0.read(buf) {
            Ok(0) => None,
            Ok(n) => Some(n),
            Err(error) => (error.kind() == ErrorKind::WouldBlock).then_some(0),
        }
    }

    fn give(&mut self, bytes: &[u8]) -> Option<usize> {
        match self.0.write(bytes) {
            Ok(n) => Some(n),
            Err(error) => (error.kind() == ErrorKind::WouldBlock).then_some(0),
        }
    }
}

pub(crate) fn tcp(stream: TcpStream) -> Socket<TcpStream> {
    stream.set_nonblocking(true).unwrap();
    Socket(stream)
}

/// How a capture that is asked for ends.
pub(crate) enum Ending {
    Done,
    Refused(Refusal),
    /// The report of its end is lost.
    Unreported,
    /// It runs until it is cancelled.
    Never,
}

/// Changes a frame on its way out, given its number; `false` unplugs the cable instead of sending it.
pub(crate) type Fault = Box<dyn FnMut(usize, &mut Vec<u8>) -> bool + Send>;

pub(crate) struct Camera {
    pub(crate) description: CaptureDescription,
    /// Bytes of each plane.
    pub(crate) planes: Vec<Vec<u8>>,
    pub(crate) session: u32,
    pub(crate) ending: Ending,
    pub(crate) fault: Fault,
    /// Strips whose next so many copies come from storage with a wrong byte.
    pub(crate) rotten: BTreeMap<u16, u8>,
    /// Messages it does not know.
    pub(crate) unknown: Vec<Key>,
}

/// What the camera has seen by the time the host left.
#[derive(Debug, Default)]
pub(crate) struct Report {
    pub(crate) heard: Vec<u8>,
    pub(crate) said: Vec<u8>,
    pub(crate) messages: Vec<FromHost>,
    pub(crate) strips_sent: Vec<u16>,
    /// The most strips it was ever allowed to send at once.
    pub(crate) most_credit: u16,
}

/// A camera that holds a capture of planes of `width` × `height` in strips of `rows`.
pub(crate) fn camera(width: u32, height: u32, rows: u16) -> Camera {
    let sensor = SensorInfo {
        model: "T".try_into().unwrap(),
        width,
        height,
        bit_depth: 12,
        bayer: Bayer::Rggb,
        black_level_dn: 256,
        white_level_dn: 4095,
        gain_e_per_dn: 2.5,
        read_noise_e: 3.0,
        pixel_pitch_um: 1.5,
    };
    let kinds = [(PlaneKind::S0, 2), (PlaneKind::Flags, 1)];
    let strips = u16::try_from(height.div_ceil(rows.into())).unwrap();
    let infos =
        kinds.map(|(kind, value_bytes)| PlaneInfo { kind, value_bytes, width, height, strip_rows: rows, strips });
    let bytes = |info: &PlaneInfo| {
        let n = width * height * u32::from(info.value_bytes);
        (0..n).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
    };
    Camera {
        planes: infos.iter().map(bytes).collect(),
        description: CaptureDescription {
            id: HELD,
            boot: 1,
            state: CaptureState::Complete,
            sensor,
            frames: [].into_iter().collect(),
            word: Word::I16,
            frac_bits: 2,
            bound_dn: [0.25; 3],
            misfit_sigma: 5.0,
            calibration: Calibration { dark_map: false, flat_map: false },
            planes: infos.into_iter().collect(),
        },
        session: 1001,
        ending: Ending::Done,
        fault: Box::new(|_, _| true),
        rotten: BTreeMap::new(),
        unknown: Vec::new(),
    }
}

/// The running camera and the host's end of its cable.
pub(crate) fn plug(camera: Camera) -> (HostEnd, JoinHandle<Report>) {
    let (host, device) = pair(1 << 16);
    (host, std::thread::spawn(move || camera.run(device)))
}

/// A client of that camera.
pub(crate) fn connect(camera: Camera, options: Options) -> (Result<Client<HostEnd>, LinkError>, JoinHandle<Report>) {
    let (host, running) = plug(camera);
    (Client::connect_with(host, "test", options), running)
}

struct Sending {
    fetch: Fetch,
    sequence: u16,
    next: u16,
    credit: u16,
}

impl Camera {
    /// Serves until the host leaves or the cable is unplugged.
    pub(crate) fn run(mut self, mut pipe: impl Pipe) -> Report {
        let mut report = Report::default();
        let mut deframer = Deframer::new(vec![0; 4096]);
        let mut frames = 0;
        let mut sending: Option<Sending> = None;
        let mut started = None;
        loop {
            let space = deframer.space();
            let Some(n) = pipe.take(space) else { return report };
            report.heard.extend_from_slice(&space[..n]);
            deframer.commit(n);
            let mut answers = Vec::new();
            while let Some(event) = deframer.next_event() {
                let Event::Frame(header, payload) = event else { continue };
                let known = !self.unknown.iter().any(|key| key.to_bytes() == header.key);
                let message = FromHost::decode(header.key, payload).unwrap().filter(|_| known);
                let Some(message) = message else {
                    let refusal = Refusal::Unsupported { key: header.key };
                    answers.push((header.sequence, FromDevice::Refused(Refused { refusal })));
                    continue;
                };
                report.messages.push(message.clone());
                match message {
                    FromHost::Fetch(fetch) => {
                        sending =
                            Some(Sending { fetch, sequence: header.sequence, next: fetch.first, credit: fetch.credit });
                    }
                    FromHost::Grant(grant) => {
                        if let Some(sending) = &mut sending {
                            sending.credit += grant.credit;
                            report.most_credit = report.most_credit.max(sending.credit);
                        }
                    }
                    FromHost::StartCapture(_) => {
                        started = matches!(self.ending, Ending::Never).then_some(header.sequence);
                        self.start(header.sequence, &mut answers);
                    }
                    FromHost::Cancel(_) => {
                        answers.extend(started.take().map(|s| (s, refused(Refusal::Cancelled))));
                        answers.push((header.sequence, self.status(None)));
                    }
                    other => answers.push((header.sequence, self.answer(&other, started))),
                }
            }
            for (sequence, answer) in answers {
                let mut frame = vec![0; 8192];
                let n = answer.encode(sequence, self.session, &mut frame).unwrap();
                frame.truncate(n);
                if !self.say(&mut frames, frame, &mut pipe, &mut report) {
                    return report;
                }
            }
            if let Some((sequence, index)) = sending.as_mut().and_then(Sending::step) {
                let kind = sending.as_ref().map(|s| s.fetch.plane).unwrap();
                report.strips_sent.push(index);
                let frame = self.strip(kind, index, sequence);
                if !self.say(&mut frames, frame, &mut pipe, &mut report) {
                    return report;
                }
            } else if n == 0 {
                std::thread::sleep(Duration::from_micros(100));
            }
        }
    }

    fn start(&mut self, sequence: u16, answers: &mut Vec<(u16, FromDevice)>) {
        answers.push((sequence, FromDevice::Accepted(Accepted { id: TAKEN })));
        let log = Log { level: LogLevel::Info, text: "wheel homed".try_into().unwrap() };
        answers.push((0, FromDevice::Log(log)));
        for done in 1..=3 {
            let progress = Progress { stage: Stage::Exposing, done, total: 3 };
            answers.push((sequence, FromDevice::Progress(progress)));
        }
        match &self.ending {
            Ending::Done => answers.push((sequence, FromDevice::Done(Done { id: Some(TAKEN) }))),
            Ending::Refused(refusal) => answers.push((sequence, refused(refusal.clone()))),
            Ending::Unreported | Ending::Never => {}
        }
    }

    fn answer(&self, message: &FromHost, started: Option<u16>) -> FromDevice {
        match message {
            FromHost::Identify(_) => FromDevice::Identity(Identity {
                session: self.session,
                serial: "BW-0007".try_into().unwrap(),
                board: "test".try_into().unwrap(),
                firmware: "0.0".try_into().unwrap(),
                sensor: self.description.sensor.clone(),
                default_frames: [].into_iter().collect(),
                default_word: Word::I16,
            }),
            FromHost::GetStatus(_) => self.status(started),
            FromHost::Calibrate(_) => FromDevice::Done(Done { id: None }),
            FromHost::ListCaptures(_) => {
                let bytes = self.planes.iter().map(|plane| plane.len() as u64).sum();
                let held = CaptureSummary { id: HELD, state: CaptureState::Complete, frames: 3, bytes };
                FromDevice::CaptureList(CaptureList { captures: [held].into_iter().collect() })
            }
            FromHost::Describe(Describe { id: HELD }) => FromDevice::Description(self.description.clone()),
            FromHost::Describe(Describe { id: TAKEN }) => {
                FromDevice::Description(CaptureDescription { id: TAKEN, ..self.description.clone() })
            }
            FromHost::Release(Release { id: HELD }) => FromDevice::Released(Released { id: HELD }),
            FromHost::Describe(Describe { id }) | FromHost::Release(Release { id }) => {
                refused(Refusal::UnknownCapture(*id))
            }
            other => panic!("{other:?} is answered elsewhere"),
        }
    }

    fn status(&self, started: Option<u16>) -> FromDevice {
        let state = if started.is_some() { State::Capturing(TAKEN) } else { State::Idle };
        FromDevice::Status(Status { state, uptime_us: 5_000_000, captures: 1, free_bytes: 9, skipped_bytes: 0 })
    }

    fn strip(&mut self, kind: PlaneKind, index: u16, sequence: u16) -> Vec<u8> {
        let at = self.description.planes.iter().position(|info| info.kind == kind).unwrap();
        let info = self.description.planes[at];
        let row = info.width as usize * usize::from(info.value_bytes);
        let first = usize::from(index) * usize::from(info.strip_rows);
        let rows = usize::from(info.strip_rows).min(info.height as usize - first);
        let mut values = self.planes[at][first * row..(first + rows) * row].to_vec();
        let values_crc = crc32fast::hash(&values);
        if let Some(left) = self.rotten.get_mut(&index).filter(|left| **left > 0) {
            *left -= 1;
            values[0] ^= 0x10;
        }
        let header = StripHeader { id: HELD, plane: kind, index, rows: rows as u16, coding: Coding::Raw, values_crc };
        let mut frame = vec![0; values.len() + 128];
        let n = header
            .encode(sequence, self.session, &mut frame, |room| {
                room[..values.len()].copy_from_slice(&values);
                Ok::<_, FrameError>(values.len())
            })
            .unwrap();
        frame.truncate(n);
        frame
    }

    /// Sends a frame through the fault; `false` where the cable is out.
    fn say(&mut self, frames: &mut usize, mut frame: Vec<u8>, pipe: &mut impl Pipe, report: &mut Report) -> bool {
        let goes_on = (self.fault)(*frames, &mut frame);
        *frames += 1;
        report.said.extend_from_slice(&frame);
        let mut rest = &frame[..];
        while !rest.is_empty() {
            match pipe.give(rest) {
                Some(0) => std::thread::sleep(Duration::from_micros(100)),
                Some(n) => rest = &rest[n..],
                None => return false,
            }
        }
        goes_on
    }
}

impl Sending {
    /// The next strip, if one is asked for and granted.
    fn step(&mut self) -> Option<(u16, u16)> {
        let end = self.fetch.first + self.fetch.count;
        if self.credit == 0 || self.next >= end {
            return None;
        }
        self.credit -= 1;
        self.next += 1;
        Some((self.sequence, self.next - 1))
    }
}

fn refused(refusal: Refusal) -> FromDevice {
    FromDevice::Refused(Refused { refusal })
}
