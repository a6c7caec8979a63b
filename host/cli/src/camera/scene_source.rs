//! An emulated camera before a simulated scene: the real firmware and wheel, and for every exposure a frame of the scene at the
//! angle where the polarizer really stands.
//!
//! Sensor and polarizer are the scene's, its planned angles the camera's own set; the wheel is the board's, so that of the
//! scene's effects its wheel errors and its play are left out.

use std::path::{Path, PathBuf};

use boards::{Bayer, Board};
use firmware_emulator::{Clock, Exposure, Eye, Port, Running, start_live};
use host_image::BayerPattern;
use host_sim::frames::{Exposer, FrameSpec};
use host_sim::{Effect, EffectSet, Scene, SimError, simulate};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::scenes::{Tolerance, refused};

const OPTIONS: &str = "expected `view=N`, `seed=N` or `tolerance=T|noise|noise/N`";

/// A view of a scene file.
#[derive(Clone, Debug)]
pub(crate) struct SceneSource {
    path: PathBuf,
    view: usize,
    /// Of noise and wheel; the scene's and the board's own where not given.
    seed: Option<u64>,
    tolerance: Tolerance,
}

impl SceneSource {
    /// `PATH.toml[?view=N&seed=N&tolerance=T]`; `None` for another kind of source.
    pub(crate) fn parse(spec: &str) -> Option<Result<Self, String>> {
        let (path, options) = spec.split_once('?').unwrap_or((spec, ""));
        let is_scene = Path::new(path).extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
        is_scene.then(|| Self::with_options(path, options))
    }

    fn with_options(path: &str, options: &str) -> Result<Self, String> {
        let tolerance = Tolerance::default();
        let mut source = Self { path: path.into(), view: 0, seed: None, tolerance };
        for option in options.split('&').filter(|option| !option.is_empty()) {
            let (key, value) = option.split_once('=').unwrap_or((option, ""));
            let number = |_| format!("`{option}` is no whole number from 0");
            match key {
                "view" => source.view = value.parse().map_err(number)?,
                "seed" => source.seed = Some(value.parse().map_err(number)?),
                "tolerance" => {
                    source.tolerance = value.parse().map_err(|expected| format!("`{option}`: {expected}"))?
                }
                _ => return Err(format!("option `{key}` is not known, {OPTIONS}")),
            }
        }
        Ok(source)
    }

    /// Simulates the view and starts `board`'s camera before it.
    pub(crate) fn start(&self, mut board: Board, port: impl Port + 'static) -> Result<Running, Failure> {
        let failed = |error: SimError| refused(&self.path, &error);
        let mut scene = Scene::read(&self.path).map_err(failed)?;
        if let Some(seed) = self.seed {
            scene.seed = seed;
            if let Some(emulation) = &mut board.emulation {
                emulation.seed = seed;
            }
        }
        let simulation = simulate(&scene, self.view, self.tolerance.of(&scene), false).map_err(failed)?;
        let effects = EffectSet::ALL.without(Effect::WheelError).without(Effect::Backlash);
        let exposer = Exposer::new(&scene, self.view, &simulation.image, effects).map_err(failed)?.into_owned();
        describe(&scene, &mut board);
        start_live(&board, eye(exposer), Clock::virtual_time(), port).map_err(|error| {
            Failure::new(Exit::BadInput, error.to_string(), "Check the camera of the scene, and the board file.")
        })
    }
}

/// Every exposure is a frame where wheel and clock are, with noise of its own.
fn eye(exposer: Exposer<'static>) -> Eye {
    Box::new(move |exposure: &Exposure| {
        let frame = FrameSpec {
            angle: 0,
            commanded: exposure.axis,
            exposure_us: 1e6 * exposure.duration.as_secs_f64(),
            start_s: exposure.began.as_secs_f64(),
        };
        exposer.raw_of(&frame, usize::try_from(exposure.number).unwrap_or(usize::MAX))
    })
}

/// Puts the scene's sensor, polarizer and angles in the place of the board's.
fn describe(scene: &Scene, board: &mut Board) {
    let (camera, sensor) = (&scene.camera, &mut board.sensor);
    "simulated".clone_into(&mut sensor.model);
    (sensor.width_px, sensor.height_px) = (camera.width_px.into(), camera.height_px.into());
    sensor.pixel_pitch_um = camera.pixel_pitch_um;
    sensor.bit_depth = camera.bit_depth;
    sensor.black_level_dn = camera.black_level_dn;
    sensor.white_level_dn = white_level_dn(scene);
    sensor.bayer = match camera.bayer {
        None => Bayer::Mono,
        Some(BayerPattern::Rggb) => Bayer::Rggb,
        Some(BayerPattern::Bggr) => Bayer::Bggr,
        Some(BayerPattern::Grbg) => Bayer::Grbg,
        Some(BayerPattern::Gbrg) => Bayer::Gbrg,
    };
    sensor.full_well_e = camera.full_well_e;
    sensor.read_noise_e = camera.read_noise_e;
    sensor.gain_e_per_dn = camera.gain_e_per_dn;
    board.wheel.polarizer.extinction_ratio = scene.polarizer.extinction_ratio;
    board.wheel.polarizer.transmission = scene.polarizer.transmission;
    board.stokes.angles_deg =
        scene.plan.angles.iter().map(|angle| (angle.to_degrees().0 * 1e9).round() / 1e9).collect();
}

/// The end of the converter, or where a well that ends before it is full but for 4σ of read noise.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a level within the converter's 16 bits")]
fn white_level_dn(scene: &Scene) -> u16 {
    let camera = &scene.camera;
    let full = (camera.full_well_e - 4.0 * camera.read_noise_e) / camera.gain_e_per_dn;
    let least = f64::from(camera.black_level_dn) + 1.0;
    (f64::from(camera.black_level_dn) + full).floor().clamp(least, camera.white_level_dn()) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_told_from_other_sources() {
        assert!(SceneSource::parse("wheel-chart").is_none() && SceneSource::parse("replay:a/b?black=3").is_none());
        let source = SceneSource::parse("a b/c.toml?view=1&seed=7&tolerance=noise/10").unwrap().unwrap();
        assert_eq!((source.path.as_path(), source.view, source.seed), (Path::new("a b/c.toml"), 1, Some(7)));
        assert!(matches!(source.tolerance, Tolerance::Noise(part) if (part - 10.0).abs() < 1e-12));
        for (spec, hint) in [
            ("c.toml?view=-1", "`view=-1`"),
            ("c.toml?seed=x", "whole number"),
            ("c.toml?tolerance=2", "at most 1"),
            ("c.toml?size=3", "`view=N`"),
        ] {
            let said = SceneSource::parse(spec).unwrap().unwrap_err();
            assert!(said.contains(hint), "{spec}: {said}");
        }
    }
}
