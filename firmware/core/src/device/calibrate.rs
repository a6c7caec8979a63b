//! Dark map and flat field from pictures the operator sets up: a capped lens, a uniform bright field.

use super::{Device, Step};
use crate::compute::Area;
use crate::exposure::{ExposureSearch, Verdict};
use crate::hardware::{CaptureStore, FrameSource, Micros, Wheel, text};
use protocol_polar::Degrees;
use protocol_polar::fixed::GainQ15;
use protocol_wire::{Calibrate, Calibration, Progress, Refusal, Stage};

/// A calibration under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct CalibrationJob {
    sequence: u16,
    flat: bool,
    frames: u8,
    taken: u8,
    /// The exposure of the flat field is metered first; the dark map is taken at that of the last capture.
    search: Option<ExposureSearch>,
    exposure_us: u32,
}

impl CalibrationJob {
    pub(super) fn sequence(&self) -> u16 {
        self.sequence
    }

    pub(super) fn progress(&self) -> Progress {
        Progress { stage: Stage::Calibrating, done: self.taken.into(), total: u16::from(self.frames) + 1 }
    }
}

impl<W: Wheel, C: FrameSource, S: CaptureStore> Device<'_, W, C, S> {
    /// `None`: nothing left to do.
    pub(super) fn start_calibration(
        &mut self,
        sequence: u16,
        what: Calibrate,
    ) -> Result<Option<CalibrationJob>, Refusal> {
        let (flat, frames) = match what {
            Calibrate::Clear => {
                self.calibration = Calibration { dark_map: false, flat_map: false };
                return Ok(None);
            }
            Calibrate::Dark { frames } => (false, frames),
            Calibrate::Flat { frames } => (true, frames),
        };
        if !(1..=16).contains(&frames) {
            return Err(Refusal::OutOfRange(text("frames (1 to 16)")));
        }
        let sensor = &self.setup.sensor;
        let range = (sensor.black_level_dn, sensor.white_level_dn);
        let exposure_us = self.last_exposure_us;
        let search = flat.then(|| ExposureSearch::new(exposure_us, self.setup.exposure_limits_us, range));
        Ok(Some(CalibrationJob { sequence, flat, frames, taken: 0, search, exposure_us }))
    }

    /// Takes one picture, or makes the map.
    pub(super) fn calibration_step(&mut self, job: &mut CalibrationJob, now: Micros) -> Result<Step, Refusal> {
        if let Some(search) = &mut job.search {
            self.wheel.move_to(Degrees(0.0))?;
            self.camera.expose(0, search.exposure_us(), now).map_err(|error| Refusal::CameraFailed(error.0))?;
            search.observe(self.level(0)?);
            match search.decide() {
                Verdict::Again(_) => {}
                Verdict::Locked { exposure_us, .. } => {
                    job.exposure_us = exposure_us;
                    job.search = None;
                }
                Verdict::TooBright => return Err(Refusal::TooBright),
            }
            return Ok(Step::More);
        }
        if job.taken < job.frames {
            if job.flat {
                // Around the half turn, so that polarization of the field averages out.
                let axis = Degrees(180.0 * f64::from(job.taken) / f64::from(job.frames));
                self.wheel.move_to(axis)?;
            }
            self.camera.expose(job.taken, job.exposure_us, now).map_err(|error| Refusal::CameraFailed(error.0))?;
            job.taken += 1;
            return Ok(Step::More);
        }
        if job.flat {
            self.make_flat(job.frames)?;
        } else {
            self.make_dark(job.frames)?;
        }
        Ok(Step::Done(None))
    }

    fn make_dark(&mut self, frames: u8) -> Result<(), Refusal> {
        self.calibration.dark_map = false;
        let white = self.setup.sensor.white_level_dn;
        let mut sum = 0_u64;
        self.each_strip(frames, |area, mean, dark, _| {
            for (to, level) in dark.get_mut(area.range()).into_iter().flatten().zip(mean) {
                *to = *level;
                sum += u64::from(*level);
            }
        })?;
        let count = u64::from(self.setup.sensor.width) * u64::from(self.setup.sensor.height);
        let mean = sum / count.max(1);
        if mean > u64::from(white) / 4 {
            return Err(Refusal::BadCalibration(text("the dark picture is bright: cap the lens")));
        }
        self.calibration.dark_map = true;
        Ok(())
    }

    fn make_flat(&mut self, frames: u8) -> Result<(), Refusal> {
        self.calibration.flat_map = false;
        let (black, white) = (self.setup.sensor.black_level_dn, self.setup.sensor.white_level_dn);
        let with_map = self.calibration.dark_map;
        let dark_at = |dark: &[u16], i: usize| if with_map { dark.get(i).copied().unwrap_or(black) } else { black };
        // Each colour of a Bayer cell has its own mean: the flat evens the lens, not the filter.
        let mut sums = [0_u64; 4];
        let mut counts = [0_u64; 4];
        let mut clipped = 0_u64;
        let phase = |area: &Area, i: usize| (i / area.width % 2) * 2 + i % area.width % 2;
        self.each_strip(frames, |area, mean, dark, _| {
            for (i, level) in mean.iter().enumerate() {
                let signal = level.saturating_sub(dark_at(dark, area.range().start + i));
                if let (Some(sum), Some(count)) = (sums.get_mut(phase(&area, i)), counts.get_mut(phase(&area, i))) {
                    *sum += u64::from(signal);
                    *count += 1;
                }
                clipped += u64::from(*level >= white);
            }
        })?;
        let total: u64 = counts.iter().sum();
        let mut means = [0_u64; 4];
        for ((mean, sum), count) in means.iter_mut().zip(sums).zip(counts) {
            *mean = sum / count.max(1);
        }
        if clipped * 100 > total {
            return Err(Refusal::BadCalibration(text("the flat field clips: less light")));
        }
        if means.iter().any(|mean| *mean < u64::from(white - black) / 10) {
            return Err(Refusal::BadCalibration(text("the flat field is too dark: more light")));
        }
        self.each_strip(frames, |area, mean, dark, flat| {
            let start = area.range().start;
            for (i, (to, level)) in flat.get_mut(area.range()).into_iter().flatten().zip(mean).enumerate() {
                let signal = u64::from(level.saturating_sub(dark_at(dark, start + i)));
                let wanted = means.get(phase(&area, i)).copied().unwrap_or(0);
                // A dead photosite keeps gain 1: no gain makes a signal of none.
                let gain = ((wanted << 15) + signal / 2).checked_div(signal);
                *to = gain.map_or(GainQ15::ONE.0, |gain| u16::try_from(gain).unwrap_or(u16::MAX));
            }
        })?;
        self.calibration.flat_map = true;
        Ok(())
    }

    /// Hands each strip's mean over `frames` slots to `work`, with the dark and flat maps of the whole sensor.
    fn each_strip(
        &mut self,
        frames: u8,
        mut work: impl FnMut(Area, &[u16], &mut [u16], &mut [u16]),
    ) -> Result<(), Refusal> {
        let sensor = &self.setup.sensor;
        let rows = self.setup.strip_rows;
        let strips = u16::try_from(sensor.height.div_ceil(rows.max(1).into())).unwrap_or(0);
        for strip in 0..strips {
            let area = Area::new(sensor, rows, strip);
            let n = area.photosites();
            let mut pictures = self.memory.samples.chunks_exact_mut(n).take(frames.into());
            for (slot, samples) in (0_u8..).zip(&mut pictures) {
                self.camera.read_rows(slot, area.first_row, samples).map_err(|error| Refusal::CameraFailed(error.0))?;
            }
            // The mean goes into the first picture's place.
            for i in 0..n {
                let column = (0..usize::from(frames)).map(|k| self.memory.samples.get(k * n + i).copied().unwrap_or(0));
                let sum: u32 = column.map(u32::from).sum();
                let mean = (sum + u32::from(frames) / 2) / u32::from(frames);
                if let Some(to) = self.memory.samples.get_mut(i) {
                    *to = u16::try_from(mean).unwrap_or(u16::MAX);
                }
            }
            let mean = self.memory.samples.get(..n).unwrap_or_default();
            work(area, mean, self.memory.dark, self.memory.flat);
        }
        Ok(())
    }
}
