//! Planes, strip by strip: a window of strips on their way, each checked, the missing ones asked for again.

use super::line::{Incoming, refusal};
use super::{Client, LinkError, Transport};
use crate::PlaneBuffer;
use crate::plane::Taken;
use protocol_wire::{CaptureDescription, Fetch, FromDevice, FromHost, Grant, Name, Strip, StripHeader};
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Instant;

/// What a fetch carries from one run of strips to the next.
struct Course {
    last_new: Instant,
    /// How often each strip came with wrong values.
    corrupt: BTreeMap<u16, u8>,
}

impl<T: Transport> Client<T> {
    /// Fetches what `plane` still lacks. After an error it keeps what it has: connect again, describe the capture again,
    /// and go on.
    ///
    /// `on_strip` gets the number of strips held and of all strips, after each new one.
    ///
    /// # Errors
    /// [`LinkError::OtherCapture`] where `plane` was not begun from a capture so described; [`LinkError::CorruptStrip`];
    /// [`LinkError::Malformed`] for strips that contradict the description; [`LinkError::Timeout`] after
    /// [`super::Options::stall`] without a new strip; [`LinkError::Refused`]; the transport's.
    pub fn fetch_plane(
        &mut self,
        description: &CaptureDescription,
        plane: &mut PlaneBuffer,
        mut on_strip: impl FnMut(u16, u16),
    ) -> Result<(), LinkError> {
        if !plane.belongs_to(description) {
            return Err(LinkError::OtherCapture { id: description.id });
        }
        let mut course = Course { last_new: Instant::now(), corrupt: BTreeMap::new() };
        let mut from = 0;
        let mut first = true;
        while let Some(run) = plane.missing_run(from) {
            self.line.counts.repeated += u64::from(!first);
            first = false;
            from = self.fetch_run(run, plane, &mut course, &mut on_strip)?;
        }
        Ok(())
    }

    /// Asks for a run of strips and takes what comes. Returns where to look for missing strips next.
    fn fetch_run(
        &mut self,
        run: Range<u16>,
        plane: &mut PlaneBuffer,
        course: &mut Course,
        on_strip: &mut impl FnMut(u16, u16),
    ) -> Result<u16, LinkError> {
        let line = &mut self.line;
        let count = run.end - run.start;
        let window = line.options.window.max(1);
        let mut granted = window.min(count);
        let (id, kind) = (plane.capture(), plane.info().kind);
        let fetch = FromHost::Fetch(Fetch { id, plane: kind, first: run.start, count, credit: granted });
        let sequence = line.send(&fetch)?;
        // How far into the run the camera is known to be: strips come in order, so later ones tell that earlier ones were
        // lost.
        let mut sent = 0;
        while sent < count {
            if course.last_new.elapsed() > line.options.stall {
                return Err(LinkError::Timeout { waiting_for: StripHeader::PATH });
            }
            match line.receive(Instant::now() + line.options.reply)? {
                Incoming::Strip(header) => {
                    let Ok(Some(strip)) = Strip::decode(header.key, &line.payload) else {
                        return Err(LinkError::Malformed { path: StripHeader::PATH });
                    };
                    let index = strip.header.index;
                    match plane.take(&strip)? {
                        Taken::New => {
                            course.last_new = Instant::now();
                            let all = plane.info().strips;
                            on_strip(all - plane.missing(), all);
                        }
                        Taken::Duplicate => line.counts.duplicate_strips += 1,
                        Taken::Corrupt => {
                            line.counts.corrupt_strips += 1;
                            let times = course.corrupt.entry(index).or_default();
                            *times += 1;
                            if *times >= line.options.attempts {
                                return Err(LinkError::CorruptStrip { plane: kind, index });
                            }
                        }
                        Taken::Stray => {
                            line.counts.stray += 1;
                            continue;
                        }
                    }
                    if header.sequence == sequence && run.contains(&index) {
                        sent = sent.max(index - run.start + 1);
                    }
                }
                Incoming::Damaged(header) if header.sequence == sequence => sent += 1,
                Incoming::Message(header, FromDevice::Refused(refused)) if header.sequence == sequence => {
                    return Err(refusal(refused.refusal, fetch.path()));
                }
                Incoming::Silence => return Ok(run.start),
                _ => {
                    line.counts.stray += 1;
                    continue;
                }
            }
            // Half a window at a time: as few grants as keep the line busy.
            let ahead = granted.saturating_sub(sent);
            if granted < count && ahead <= window / 2 {
                let credit = (window - ahead).min(count - granted);
                granted += credit;
                match line.send_as(sequence, &FromHost::Grant(Grant { credit })) {
                    // What came before the camera left is still to be read; the next read past it says so again.
                    Ok(()) | Err(LinkError::Gone) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(run.end)
    }
}
