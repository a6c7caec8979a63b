//! What a result depends on, as one number: tiles of another session or of other settings are never mixed up.

use std::fmt::Write;

use glam::DVec3;
use host_image::Samples;

use super::{BodyChoice, FitOptions, Mode};
use crate::forward::Body;
use crate::light::KnownLight;
use crate::session::{Session, ViewData};
use crate::tiles::SettingsHash;

/// Directions in which the light is asked.
const DIRECTIONS: u32 = 997;

/// Of a calibrated session, the options, and the body that was chosen.
pub(super) fn of(session: &Session, options: &FitOptions, light: &KnownLight, body: Body) -> SettingsHash {
    let mut text = String::new();
    // What is shared by regions comes after the tiles.
    let mode = if options.mode == Mode::JointShared { Mode::Joint } else { options.mode };
    let told = FitOptions {
        mode,
        body: BodyChoice::default(),
        regions: super::Regions::default(),
        resolution: None,
        ..options.clone()
    };
    // Writing to a string cannot fail.
    let _ = write!(text, "{} {told:?} {body:?} {:?}", env!("CARGO_PKG_VERSION"), session.sample);
    let _ = write!(text, "{:?} {:?}", session.light.sun, light.scale_uncertainty());
    let mut hash = SettingsHash::EMPTY;
    for view in &session.views {
        let _ = write!(text, "{:?} {:?} {:?}", view.name, view.camera, view.reference);
        match &view.data {
            ViewData::Frames(frames) => {
                let _ = write!(text, "{:?} {:?} {:?}", frames.analyzers, frames.black_dn, frames.white_dn);
                let _ = write!(text, "{:?} {:?} {:?}", frames.noise, frames.radiance_per_dn, frames.bayer);
                hash = frames.pictures.iter().fold(hash, |hash, picture| hash.with(&check(&picture.samples)));
            }
            ViewData::Stokes(source) => {
                let _ = write!(text, "{:?} {:?}", source.noise, source.radiance_per_unit);
                for color in &source.image.colors {
                    hash = [&color.s0, &color.s1, &color.s2].into_iter().fold(hash, |h, plane| h.with(&floats(plane)));
                }
            }
        }
    }
    for k in 0..DIRECTIONS {
        let z = (f64::from(k) + 0.5) / f64::from(DIRECTIONS);
        let (sin, cos) = (2.399_963 * f64::from(k)).sin_cos();
        let side = (1.0 - z * z).sqrt();
        for x in light.stokes(DVec3::new(side * cos, side * sin, z)).as_flattened() {
            hash = hash.with(&x.to_le_bytes());
        }
    }
    hash.with(text.as_bytes())
}

fn check(samples: &Samples) -> [u8; 4] {
    match samples {
        Samples::U8(v) => crc32fast::hash(v).to_le_bytes(),
        Samples::U16(v) => crc(v.iter().flat_map(|x| x.to_le_bytes())),
        Samples::F32(v) => floats(v),
    }
}

fn floats(plane: &[f32]) -> [u8; 4] {
    crc(plane.iter().flat_map(|x| x.to_le_bytes()))
}

fn crc(bytes: impl Iterator<Item = u8>) -> [u8; 4] {
    let all: Vec<u8> = bytes.collect();
    crc32fast::hash(&all).to_le_bytes()
}
