//! A capture, step by step: one wheel move and exposure, or one strip, at a time.

use super::{Device, Step};
use crate::compute::{Area, Contents, Recipe, compute_strip, planes, preview_step, total_bytes};
use crate::exposure::{ExposureSearch, Histogram, Level};
use crate::hardware::{CaptureStore, FrameSource, Micros, Wheel, WheelAxis, text};
use crate::sequence::{Action, Sequence};
use heapless::Vec;
use protocol_polar::fixed::{FixedError, Noise, SensorRange, StokesPlan};
use protocol_polar::{Analyzer, Degrees, MAX_FRAMES, SolveError, distinct_axes};
use protocol_wire::{
    CaptureDescription, CaptureId, CaptureRequest, CaptureState, Exposure, FrameInfo, FrameRequest, Progress, Refusal,
};

/// Two axes closer than this are one to a wheel with a hobby servo.
const SAME_AXIS: Degrees = Degrees(0.1);

/// One photosite in so many may be a misfit before the capture as a whole is suspect.
const MANY_MISFITS: u32 = 100;

/// A capture under way.
#[derive(Debug)]
pub(super) struct CaptureJob {
    id: CaptureId,
    sequence: u16,
    request: CaptureRequest,
    course: Sequence,
    frames: Vec<FrameInfo, MAX_FRAMES>,
    plan: Option<StokesPlan>,
    misfits: u32,
}

impl CaptureJob {
    pub(super) fn id(&self) -> CaptureId {
        self.id
    }

    pub(super) fn sequence(&self) -> u16 {
        self.sequence
    }

    pub(super) fn progress(&self) -> Progress {
        self.course.progress()
    }
}

impl<W: Wheel, C: FrameSource, S: CaptureStore> Device<'_, W, C, S> {
    /// Checks all that can be checked before anything moves, and makes room.
    pub(super) fn start_capture(&mut self, sequence: u16, request: CaptureRequest) -> Result<CaptureJob, Refusal> {
        let (shortest, longest) = self.setup.exposure_limits_us;
        for frame in &request.frames {
            if !frame.angle_deg.is_finite() || frame.angle_deg.abs() > 3600.0 {
                return Err(Refusal::OutOfRange(text("angle_deg")));
            }
            if !(frame.exposure_ratio > 0.0 && frame.exposure_ratio <= 1.0) {
                return Err(Refusal::OutOfRange(text("exposure_ratio (0 to 1)")));
            }
        }
        if let Exposure::Fixed(us) = request.exposure
            && !(shortest..=longest).contains(&us)
        {
            return Err(Refusal::OutOfRange(text("exposure_us")));
        }
        let mut asked: Vec<Analyzer, MAX_FRAMES> = Vec::new();
        for frame in &request.frames {
            let angle = Degrees(frame.angle_deg).to_radians();
            let efficiency = self.setup.polarizer_efficiency;
            asked.push(Analyzer { angle, throughput: frame.exposure_ratio, efficiency }).ok(); // same length
        }
        self.plan(&asked, &request)?;
        let sensor = &self.setup.sensor;
        let rows = self.setup.strip_rows;
        let planes = planes(sensor, rows, self.contents(&request));
        let frames = u8::try_from(request.frames.len()).unwrap_or(0);
        let strips = planes.first().map_or(0, |plane| plane.strips);
        let course = match request.exposure {
            Exposure::Fixed(us) => Sequence::fixed(frames, strips, us),
            Exposure::Auto => {
                let range = (sensor.black_level_dn, sensor.white_level_dn);
                let search = ExposureSearch::new(self.last_exposure_us, self.setup.exposure_limits_us, range);
                Sequence::metered(frames, strips, search)
            }
        };
        let id = self.next_id;
        self.store.begin(id, total_bytes(&planes))?;
        self.next_id = CaptureId(id.0.wrapping_add(1));
        self.memory.weights.clear();
        Ok(CaptureJob { id, sequence, request, course, frames: Vec::new(), plan: None, misfits: 0 })
    }

    fn contents(&self, request: &CaptureRequest) -> Contents {
        Contents {
            word: request.word.into(),
            frames: request.frames.len(),
            keep_raw: request.keep_raw,
            calibration: self.calibration,
        }
    }

    /// The recipe for these frames, or why they are no use.
    fn plan(&self, frames: &[Analyzer], request: &CaptureRequest) -> Result<StokesPlan, Refusal> {
        let mut axes: Vec<_, MAX_FRAMES> = Vec::new();
        axes.extend(frames.iter().take(MAX_FRAMES).map(|frame| frame.angle));
        let distinct = distinct_axes(&axes, SAME_AXIS.to_radians());
        let too_few = Refusal::TooFewAxes { distinct: u8::try_from(distinct).unwrap_or(u8::MAX) };
        if distinct < 3 {
            return Err(too_few);
        }
        let sensor = &self.setup.sensor;
        let range = SensorRange { bit_depth: sensor.bit_depth, white_level: sensor.white_level_dn };
        let noise = Noise {
            read_dn: sensor.read_noise_e / sensor.gain_e_per_dn,
            electrons_per_dn: sensor.gain_e_per_dn,
            misfit_sigma: self.setup.misfit_sigma,
        };
        StokesPlan::new(frames, request.word.into(), range, noise).map_err(|error| match error {
            FixedError::Solve(SolveError::FrameCount { .. }) => Refusal::OutOfRange(text("frames (3 to 16)")),
            FixedError::Solve(SolveError::BadFrame { .. }) => Refusal::OutOfRange(text("frame")),
            FixedError::Solve(_) => too_few,
            FixedError::IllConditioned { condition } => Refusal::IllConditioned { condition },
            FixedError::Unsupported { .. } => Refusal::WordTooNarrow,
            FixedError::WhiteLevel { .. } => Refusal::OutOfRange(text("white_level_dn")),
            _ => Refusal::OutOfRange(text("exposure_ratio")),
        })
    }

    pub(super) fn capture_step(&mut self, job: &mut CaptureJob, now: Micros) -> Result<Step, Refusal> {
        match job.course.next() {
            Action::Meter { frame, reference_us } => {
                let Some(request) = job.request.frames.get(usize::from(frame)).copied() else { return Ok(Step::More) };
                self.take(request, reference_us, frame, now)?;
                let level = self.level(frame)?;
                job.course.metered_at(level);
            }
            Action::Take { frame, reference_us } => {
                let Some(request) = job.request.frames.get(usize::from(frame)).copied() else { return Ok(Step::More) };
                let info = self.take(request, reference_us, frame, now)?;
                job.frames.push(info).ok(); // as many as were asked for
                self.last_exposure_us = reference_us;
                job.course.taken();
            }
            Action::Compute { strip } => {
                if job.plan.is_none() {
                    job.plan = Some(self.plan_of(job)?);
                }
                let Some(plan) = &job.plan else { return Ok(Step::More) };
                let recipe = Recipe {
                    id: job.id,
                    plan,
                    keep_raw: job.request.keep_raw,
                    black_level: self.setup.sensor.black_level_dn,
                    calibration: self.calibration,
                    preview_step: preview_step(&self.setup.sensor),
                };
                let area = Area::new(&self.setup.sensor, self.setup.strip_rows, strip);
                let misfits = compute_strip(&recipe, area, &mut self.camera, &mut self.store, &mut self.memory)?;
                job.misfits = job.misfits.saturating_add(misfits);
                job.course.computed();
            }
            Action::Finish => {
                if job.course.clips() {
                    self.warn(job.sequence, "highlights clip at the shortest exposure; their samples were dropped");
                }
                let photosites = self.setup.sensor.width.saturating_mul(self.setup.sensor.height);
                if job.misfits > photosites / MANY_MISFITS {
                    self.warn(
                        job.sequence,
                        "the frames do not fit together: the wheel slips, something moved, or the light changed",
                    );
                }
                let description = self.describe(job)?;
                self.store.finish(&description)?;
                return Ok(Step::Done(Some(job.id)));
            }
            Action::GiveUpTooBright => return Err(Refusal::TooBright),
        }
        Ok(Step::More)
    }

    /// Turns the wheel, exposes into the slot of the frame's number, and says how it was.
    fn take(&mut self, request: FrameRequest, reference_us: u32, slot: u8, now: Micros) -> Result<FrameInfo, Refusal> {
        let WheelAxis { angle, measured } = self.wheel.move_to(Degrees(request.angle_deg))?;
        let (shortest, longest) = self.setup.exposure_limits_us;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float-to-int cast saturates")]
        let wanted = libm::rint(f64::from(reference_us) * request.exposure_ratio) as u32;
        let exposure_us = wanted.clamp(shortest, longest);
        let began = self.camera.expose(slot, exposure_us, now).map_err(|error| Refusal::CameraFailed(error.0))?;
        Ok(FrameInfo {
            asked_deg: request.angle_deg,
            angle_deg: angle.0,
            measured,
            throughput: f64::from(exposure_us) / f64::from(reference_us),
            efficiency: self.setup.polarizer_efficiency,
            exposure_us,
            timestamp_us: began.0,
        })
    }

    /// How bright the picture in `slot` is, from one row in eight.
    pub(super) fn level(&mut self, slot: u8) -> Result<Level, Refusal> {
        let sensor = &self.setup.sensor;
        let mut histogram = Histogram::new(sensor.bit_depth, sensor.white_level_dn);
        let width = usize::try_from(sensor.width).unwrap_or(0);
        for row in (0..sensor.height).step_by(8) {
            let Some(samples) = self.memory.samples.get_mut(..width) else { break };
            self.camera.read_rows(slot, row, samples).map_err(|error| Refusal::CameraFailed(error.0))?;
            histogram.add(samples);
        }
        Ok(histogram.level())
    }

    fn plan_of(&self, job: &CaptureJob) -> Result<StokesPlan, Refusal> {
        let mut analyzers: Vec<Analyzer, MAX_FRAMES> = Vec::new();
        for frame in &job.frames {
            let angle = Degrees(frame.angle_deg).to_radians();
            analyzers.push(Analyzer { angle, throughput: frame.throughput, efficiency: frame.efficiency }).ok();
        }
        self.plan(&analyzers, &job.request)
    }

    fn describe(&self, job: &CaptureJob) -> Result<CaptureDescription, Refusal> {
        let sensor = &self.setup.sensor;
        let word = job.request.word;
        let plan = match &job.plan {
            Some(plan) => plan.clone(),
            None => self.plan_of(job)?,
        };
        let bound_dn = plan.weights(0).map(|weights| weights.bound_dn()).unwrap_or_default();
        Ok(CaptureDescription {
            id: job.id,
            boot: self.setup.boot,
            state: CaptureState::Complete,
            sensor: sensor.clone(),
            frames: job.frames.clone(),
            word,
            frac_bits: plan.format().frac_bits,
            bound_dn,
            misfit_sigma: self.setup.misfit_sigma,
            calibration: self.calibration,
            planes: planes(sensor, self.setup.strip_rows, self.contents(&job.request)),
        })
    }
}
