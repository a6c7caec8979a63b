//! The wheel and the camera that serve photographs.

use super::album::{Album, Picture, apart};
use crate::Clock;
use firmware_core::{CameraError, FrameSource, Micros, Setup, Wheel, WheelAxis, WheelError, text};
use protocol_polar::fixed::PlaneFormat;
use protocol_polar::{Degrees, MAX_FRAMES};
use protocol_wire::{Bayer, FrameRequest, SensorInfo, Word};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Farthest a picture may be from the axis asked for.
const NEAR_DEG: f64 = 1.0;
/// The one exposure there is, as far as the camera's decisions are concerned.
const EXPOSURE_US: u32 = 10_000;
/// Charge at the white level of a typical sensor; who replays photographs does not know better.
const WHITE_E: f64 = 10_000.0;

/// Values of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub(super) bit_depth: u8,
    pub(super) black_level_dn: u16,
    pub(super) white_level_dn: u16,
}

/// Chooses the picture taken nearest to an axis.
#[derive(Debug)]
pub struct ReplayWheel {
    album: Arc<Album>,
    chosen: Arc<AtomicUsize>,
}

/// Serves the picture that is chosen, whatever the exposure.
#[derive(Debug)]
pub struct ReplayCamera {
    album: Arc<Album>,
    chosen: Arc<AtomicUsize>,
    clock: Clock,
    range: Range,
    /// Number of the picture in each slot.
    slots: [Option<usize>; MAX_FRAMES],
}

pub(super) fn replay(album: Album, range: Range, clock: Clock) -> (ReplayWheel, ReplayCamera) {
    let (album, chosen) = (Arc::new(album), Arc::new(AtomicUsize::new(0)));
    let wheel = ReplayWheel { album: Arc::clone(&album), chosen: Arc::clone(&chosen) };
    (wheel, ReplayCamera { album, chosen, clock, range, slots: [None; MAX_FRAMES] })
}

impl Wheel for ReplayWheel {
    fn move_to(&mut self, axis: Degrees) -> Result<WheelAxis, WheelError> {
        let distances = self.album.pictures.iter().map(|picture| apart(picture.axis, axis));
        let (number, distance_deg) = distances
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .ok_or_else(|| WheelError::Failed(text("no pictures")))?;
        let angle = self.album.pictures.get(number).map_or(axis, |picture| picture.axis);
        if distance_deg > NEAR_DEG {
            let there: Vec<String> = self.album.pictures.iter().map(|picture| picture.axis.0.to_string()).collect();
            return Err(WheelError::Failed(text(&format!("no picture at {}°, but at {}", axis.0, there.join(", ")))));
        }
        self.chosen.store(number, Ordering::SeqCst);
        Ok(WheelAxis { angle, measured: true })
    }
}

impl ReplayCamera {
    /// Puts what the pictures say in the place of what the board says: size, range, axes. Their one exposure becomes the
    /// only one the camera has, so that no ratio of exposures is believed that never was.
    pub(crate) fn describe(&self, setup: &mut Setup) {
        let Range { bit_depth, black_level_dn, white_level_dn } = self.range;
        let gain_e_per_dn = WHITE_E / f64::from(white_level_dn - black_level_dn);
        setup.sensor = SensorInfo {
            model: text("photographs"),
            width: self.album.width,
            height: self.album.height,
            bit_depth,
            bayer: Bayer::Mono,
            black_level_dn,
            white_level_dn,
            gain_e_per_dn,
            read_noise_e: gain_e_per_dn,
            pixel_pitch_um: setup.sensor.pixel_pitch_um,
        };
        setup.exposure_limits_us = (EXPOSURE_US, EXPOSURE_US);
        setup.polarizer_efficiency = 1.0;
        let axes = self.album.pictures.iter().take(MAX_FRAMES).map(|picture| picture.axis.0);
        setup.default_frames = axes.map(|angle_deg| FrameRequest { angle_deg, exposure_ratio: 1.0 }).collect();
        if PlaneFormat::for_bits(setup.default_word.into(), bit_depth).is_none() {
            setup.default_word = Word::I32;
        }
    }

    fn picture(&self, slot: u8) -> Option<&Picture> {
        let number = (*self.slots.get(usize::from(slot))?)?;
        self.album.pictures.get(number)
    }
}

impl FrameSource for ReplayCamera {
    fn expose(&mut self, slot: u8, _: u32, _: Micros) -> Result<Micros, CameraError> {
        let room = self.slots.get_mut(usize::from(slot)).ok_or_else(|| CameraError(text("no such slot")))?;
        *room = Some(self.chosen.load(Ordering::SeqCst));
        let began = self.clock.now();
        self.clock.wait(Duration::from_micros(EXPOSURE_US.into()));
        Ok(began)
    }

    fn read_rows(&mut self, slot: u8, first_row: u32, rows: &mut [u16]) -> Result<(), CameraError> {
        let start = first_row as usize * self.album.width as usize;
        let samples = self.picture(slot).and_then(|picture| picture.samples.get(start..start + rows.len()));
        rows.copy_from_slice(samples.ok_or_else(|| CameraError(text("the slot is empty")))?);
        Ok(())
    }
}
