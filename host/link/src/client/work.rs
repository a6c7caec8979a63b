//! Long work on the camera: captures and calibrations, with news of how far they are.

use super::line::{Incoming, refusal};
use super::{Client, LinkError, Transport};
use protocol_wire::{
    Calibrate, Cancel, CaptureId, CaptureRequest, CaptureState, Describe, Exposure, FromDevice, FromHost, GetStatus,
    Progress, StartCapture, State,
};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

impl<T: Transport> Client<T> {
    /// Takes a capture and waits until the camera holds it whole.
    ///
    /// `on_news` gets each report, and `None` whenever [`super::Options::reply`] passes without one; if it breaks, the
    /// capture is cancelled, which comes back as [`LinkError::Refused`] with [`protocol_wire::Refusal::Cancelled`].
    ///
    /// # Errors
    /// [`LinkError::Refused`] with the camera's reason; [`LinkError::Timeout`] after [`super::Options::work`] (and the
    /// exposure, where it is fixed) without news; the transport's.
    pub fn capture(
        &mut self,
        request: CaptureRequest,
        on_news: impl FnMut(Option<Progress>) -> ControlFlow<()>,
    ) -> Result<CaptureId, LinkError> {
        let exposure = match request.exposure {
            Exposure::Fixed(us) => Duration::from_micros(us.into()),
            Exposure::Auto => Duration::ZERO,
        };
        let patience = self.line.options.work + exposure;
        let done = self.work(&FromHost::StartCapture(StartCapture { request }), patience, on_news)?;
        done.ok_or(LinkError::Malformed { path: "capture/done" })
    }

    /// Takes a dark map or a flat field, or forgets both, and waits for it. `on_news` as in [`Self::capture`].
    ///
    /// # Errors
    /// As [`Self::capture`].
    pub fn calibrate(
        &mut self,
        what: Calibrate,
        on_news: impl FnMut(Option<Progress>) -> ControlFlow<()>,
    ) -> Result<(), LinkError> {
        self.work(&FromHost::Calibrate(what), self.line.options.work, on_news).map(|_| ())
    }

    /// Starts work and waits for its end. Not repeated when unanswered: it might be done twice.
    fn work(
        &mut self,
        start: &FromHost,
        patience: Duration,
        mut on_news: impl FnMut(Option<Progress>) -> ControlFlow<()>,
    ) -> Result<Option<CaptureId>, LinkError> {
        let line = &mut self.line;
        let sequence = line.send(start)?;
        let mut news = Instant::now();
        let mut capture = None;
        let mut cancelled = false;
        // A question asked meanwhile: whether the end was reached and only its report was lost.
        let mut question = sequence;
        loop {
            let incoming = line.receive(Instant::now() + line.options.reply)?;
            let report = match incoming {
                Incoming::Message(header, message) if header.sequence == sequence || header.sequence == question => {
                    match message {
                        FromDevice::Accepted(accepted) => {
                            capture = Some(accepted.id);
                            news = Instant::now();
                            continue;
                        }
                        FromDevice::Done(done) => return Ok(done.id),
                        FromDevice::Refused(refused) => return Err(refusal(refused.refusal, start.path())),
                        FromDevice::Status(status) => {
                            if let Some(id) = capture.filter(|id| status.state != State::Capturing(*id)) {
                                question = line.send(&FromHost::Describe(Describe { id }))?;
                            }
                            continue;
                        }
                        FromDevice::Description(held) if held.state == CaptureState::Complete => {
                            return Ok(Some(held.id));
                        }
                        FromDevice::Progress(progress) => Some(progress),
                        _ => continue,
                    }
                }
                Incoming::Unknown(header) if header.sequence == sequence => {
                    return Err(LinkError::Unsupported { path: start.path(), key: header.key });
                }
                Incoming::Silence => None,
                _ => {
                    line.counts.stray += 1;
                    continue;
                }
            };
            if report.is_some() {
                news = Instant::now();
            } else {
                // A capture is accepted at once, in the time any request gets; its work takes longer.
                let (limit, waiting_for) = match (start, capture) {
                    (FromHost::StartCapture(_), None) => {
                        (line.options.reply * line.options.attempts.into(), "capture/accepted")
                    }
                    _ => (patience, "capture/done"),
                };
                if news.elapsed() > limit {
                    return Err(LinkError::Timeout { waiting_for });
                }
                if capture.is_some() {
                    question = line.send(&FromHost::GetStatus(GetStatus))?;
                }
            }
            if on_news(report).is_break() && !cancelled {
                cancelled = true;
                question = line.send(&FromHost::Cancel(Cancel))?;
            }
        }
    }
}
