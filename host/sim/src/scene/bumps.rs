//! A bumpy surface without a file: a height field of a few sine waves.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use protocol_polar::Radians;
use rand::Rng;
use serde::Deserialize;

use super::locate::At;
use super::value::degrees;
use crate::SimError;
use crate::rng::{Draw, Stream};

/// How many waves: enough to look irregular.
const WAVES: u8 = 5;

/// `bumps = { amplitude_deg = .., wavelength_mm = .. }`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBumps {
    /// No normal is tilted by more than this.
    #[serde(rename = "amplitude_deg", deserialize_with = "degrees")]
    amplitude: Radians,
    /// Length of every wave.
    wavelength_mm: f64,
}

/// h(x, y) = Σ a sin(k·(x, y) + p): five waves of one length and equal amplitude, of random direction and phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Bumps {
    /// Slope |k| a, the same for every wave.
    slope: f64,
    /// (k per m, phase).
    waves: Vec<(DVec2, f64)>,
}

impl Bumps {
    /// No normal is tilted by more than `amplitude` (the slopes of the waves add up to its tangent; the rms slope is that
    /// tangent over √10). Directions and phases follow `seed` and `which` surface it is.
    #[must_use]
    pub fn new(amplitude: Radians, wavelength_m: f64, seed: u64, which: u64) -> Self {
        let mut random = Stream::new(seed, Draw::Bumps, which, 0).at(0);
        let waves = (0..WAVES).map(|_| {
            let (s, c) = (TAU * random.random::<f64>()).sin_cos();
            (DVec2::new(c, s) * (TAU / wavelength_m), TAU * random.random::<f64>())
        });
        Self { slope: amplitude.0.tan() / f64::from(WAVES), waves: waves.collect() }
    }

    /// Unit normal (−∂h/∂x, −∂h/∂y, 1) at `point`, in m.
    #[must_use]
    pub fn normal(&self, point: DVec2) -> DVec3 {
        let gradient: DVec2 = self.waves.iter().map(|(k, p)| k.normalize() * (k.dot(point) + p).cos()).sum();
        (-gradient * self.slope).extend(1.0).normalize()
    }
}

impl RawBumps {
    pub(super) fn check(&self, at: &At<'_>, seed: u64, which: u64) -> Result<Bumps, SimError> {
        at.within("amplitude_deg", self.amplitude.to_degrees().0, 0.0..=60.0)?;
        at.within("wavelength_mm", self.wavelength_mm, 1e-3..=1e5)?;
        Ok(Bumps::new(self.amplitude, 1e-3 * self.wavelength_mm, seed, which))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol_polar::Degrees;

    #[test]
    fn no_normal_is_tilted_by_more_than_the_amplitude_and_the_mean_slope_is_zero() {
        let bumps = Bumps::new(Degrees(12.0).to_radians(), 0.01, 3, 0);
        let normals: Vec<DVec3> = (0..10_000_u16)
            .map(|k| bumps.normal(DVec2::new(f64::from(k % 100) * 1.013e-2, f64::from(k / 100) * 1.37e-2)))
            .collect();
        let steepest = normals.iter().map(|n| n.truncate().length().atan2(n.z)).fold(0.0, f64::max).to_degrees();
        assert!((6.0..=12.0).contains(&steepest), "{steepest}");
        let mean: DVec2 = normals.iter().map(|n| n.truncate() / n.z).sum::<DVec2>() / 1e4;
        assert!(mean.length() < 5e-3, "{mean}");
    }

    #[test]
    fn seeds_and_surfaces_differ() {
        let at = |seed, which| {
            let bumps = Bumps::new(Degrees(5.0).to_radians(), 0.01, seed, which);
            bumps.normal(DVec2::new(0.003, 0.001)).to_array().map(f64::to_bits)
        };
        assert_eq!(at(1, 0), at(1, 0));
        assert_ne!(at(1, 0), at(2, 0));
        assert_ne!(at(1, 0), at(1, 1));
    }
}
