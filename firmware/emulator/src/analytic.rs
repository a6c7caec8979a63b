//! A camera that looks at a Stokes field through the polarizer as it really stands.
//!
//! Signal of a photosite: the first row of the polarizer's Mueller matrix (paper eq. 4, with the board's extinction ratio)
//! at the wheel's *true* axis, times the light's Stokes vector, times the exposure. Then what a sensor does, in
//! photoelectrons: unequal photosites, shot noise (normal with the variance of the signal), the full well, read noise;
//! and in DN: gain, black level, rounding, and the end of the range.
//!
//! Unit of light: the s0, in DN, that this camera measures at [`REFERENCE_EXPOSURE_US`]; the polarizer's transmission is
//! contained in it.

use crate::light::View;
use crate::noise::Draws;
use crate::{Light, World};
use boards::{Board, Sensor};
use firmware_core::{CameraError, FrameSource, Micros, text};
use protocol_polar::{Analyzer, MAX_FRAMES, efficiency_from_extinction_ratio};
use std::num::NonZero;
use std::time::Duration;

/// Exposure at which light has the DN it is described with.
pub const REFERENCE_EXPOSURE_US: u32 = 10_000;

/// How the photosites differ; both row-major, one value per photosite.
#[derive(Clone, Debug)]
pub struct FixedPattern {
    /// Sensitivity relative to the mean photosite.
    pub gain: Vec<f32>,
    /// DN above the black level without light.
    pub dark_dn: Vec<f32>,
}

/// The camera; see the module.
#[derive(Debug)]
pub struct AnalyticCamera {
    sensor: Sensor,
    efficiency: f64,
    world: World,
    light: Light,
    field: Vec<[f32; 3]>,
    pattern: Option<FixedPattern>,
    /// Seed of the noise, if there is any.
    seed: Option<u64>,
    taken: u64,
    slots: [Vec<u16>; MAX_FRAMES],
}

impl AnalyticCamera {
    /// The board's camera behind this world's wheel, looking at `field` (height × width, row-major, `[s0, s1, s2]`; what
    /// is missing is dark).
    #[must_use]
    pub fn new(board: &Board, world: World, field: Vec<[f32; 3]>) -> Self {
        let emulation = board.emulation.as_ref();
        Self {
            efficiency: efficiency_from_extinction_ratio(board.wheel.polarizer.extinction_ratio),
            world,
            light: Light::default(),
            field,
            pattern: None,
            seed: emulation.filter(|e| e.sensor_noise).map(|e| e.seed),
            taken: 0,
            slots: Default::default(),
            sensor: board.sensor.clone(),
        }
    }

    /// The same camera with photosites that differ.
    #[must_use]
    pub fn with_pattern(self, pattern: FixedPattern) -> Self {
        Self { pattern: Some(pattern), ..self }
    }

    /// What stands before the lens.
    #[must_use]
    pub fn light(&self) -> Light {
        self.light.clone()
    }

    fn picture(&self, exposure_us: u32) -> Vec<u16> {
        let (width, height) = (self.sensor.width_px as usize, self.sensor.height_px as usize);
        let mut picture = vec![0; width * height];
        let throughput = f64::from(exposure_us) / f64::from(REFERENCE_EXPOSURE_US);
        let analyzer = Analyzer { angle: self.world.axis_radians(), throughput, efficiency: self.efficiency };
        let exposed = Exposed::new(self, &analyzer);
        let threads = std::thread::available_parallelism().map_or(1, NonZero::get).min(8);
        let band = height.div_ceil(threads).max(1) * width;
        std::thread::scope(|scope| {
            for (number, rows) in picture.chunks_mut(band.max(1)).enumerate() {
                let exposed = &exposed;
                scope.spawn(move || exposed.fill(number * band, rows));
            }
        });
        picture
    }
}

impl FrameSource for AnalyticCamera {
    fn expose(&mut self, slot: u8, exposure_us: u32, _: Micros) -> Result<Micros, CameraError> {
        let began = self.world.clock().now();
        let picture = self.picture(exposure_us);
        self.taken += 1;
        let Some(room) = self.slots.get_mut(usize::from(slot)) else {
            return Err(CameraError(text("no such slot")));
        };
        *room = picture;
        self.world.clock().wait(Duration::from_micros(exposure_us.into()));
        Ok(began)
    }

    fn read_rows(&mut self, slot: u8, first_row: u32, rows: &mut [u16]) -> Result<(), CameraError> {
        let start = first_row as usize * self.sensor.width_px as usize;
        let picture = self.slots.get(usize::from(slot)).and_then(|picture| picture.get(start..start + rows.len()));
        rows.copy_from_slice(picture.ok_or_else(|| CameraError(text("the slot is empty")))?);
        Ok(())
    }
}

/// What is the same for all photosites of one exposure. Signals are photoelectrons.
struct Exposed<'a> {
    field: &'a [[f32; 3]],
    view: View,
    pattern: Option<&'a FixedPattern>,
    /// Electrons per DN of Stokes component.
    row_e: [f32; 3],
    full_well_e: f32,
    read_variance_e2: f32,
    dn_per_e: f32,
    black_dn: f32,
    top_dn: f32,
    noise: Option<Draws>,
}

impl<'a> Exposed<'a> {
    #[expect(clippy::cast_possible_truncation, reason = "f32 holds every quantity of a sensor")]
    fn new(camera: &'a AnalyticCamera, analyzer: &Analyzer) -> Self {
        let sensor = &camera.sensor;
        Self {
            field: &camera.field,
            view: *camera.light.view(),
            pattern: camera.pattern.as_ref(),
            row_e: analyzer.row().map(|x| (x * sensor.gain_e_per_dn) as f32),
            full_well_e: sensor.full_well_e as f32,
            read_variance_e2: (sensor.read_noise_e * sensor.read_noise_e) as f32,
            dn_per_e: (1.0 / sensor.gain_e_per_dn) as f32,
            black_dn: sensor.black_level_dn.into(),
            top_dn: f32::from(u16::MAX >> 16_u8.saturating_sub(sensor.bit_depth)),
            // One stream per picture, apart from those of the wheel.
            noise: camera.seed.map(|seed| Draws::new(seed, (1 << 32) + camera.taken)),
        }
    }

    fn fill(&self, first: usize, rows: &mut [u16]) {
        for (i, to) in (first..).zip(rows) {
            *to = self.sample(i);
        }
    }

    fn stokes(&self, i: usize) -> [f32; 3] {
        match self.view {
            View::Scene(factor) => self.field.get(i).map_or([0.0; 3], |stokes| stokes.map(|s| s * factor)),
            View::Capped => [0.0; 3],
            View::Flat(s0) => [s0, 0.0, 0.0],
        }
    }

    #[inline]
    fn sample(&self, i: usize) -> u16 {
        let [s0, s1, s2] = self.stokes(i);
        let [a, b, c] = self.row_e;
        let mut signal_e = (a * s0 + b * s1 + c * s2).max(0.0);
        let mut dark_dn = self.black_dn;
        if let Some(pattern) = self.pattern {
            signal_e *= pattern.gain.get(i).copied().unwrap_or(1.0);
            dark_dn += pattern.dark_dn.get(i).copied().unwrap_or(0.0);
        }
        let electrons = match self.noise {
            // One draw of the summed variance stands for two draws; the well takes signal and shot noise together.
            Some(draws) => {
                let noise_e = (signal_e + self.read_variance_e2).sqrt() * draws.normal(i as u64);
                (signal_e + noise_e).min(self.full_well_e)
            }
            None => signal_e.min(self.full_well_e),
        };
        let dn = (dark_dn + electrons * self.dn_per_e).round().clamp(0.0, self.top_dn);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole, 0 to 65535")]
        let sample = dn as u16;
        sample
    }
}
