//! The instrument: camera, polarizer, wheel and the plan of a capture.
//!
//! DN are raw digital numbers, e are photoelectrons. Polarizer angles are in the camera frame (x right, y up,
//! counter-clockwise).

use host_image::BayerPattern;
use protocol_polar::{Degrees, MAX_FRAMES, Radians, distinct_axes};
use serde::Deserialize;

use super::locate::At;
use super::value::{degrees, many_degrees, mosaic};
use crate::SimError;

/// `[camera]`: the sensor and its lens. What is left out is ideal (0).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Photosites in a row.
    pub width_px: u16,
    /// Rows.
    pub height_px: u16,
    /// Distance of neighboring photosites.
    pub pixel_pitch_um: f64,
    /// Bits of a raw sample, 8 to 16.
    pub bit_depth: u8,
    /// Raw value of a dark photosite.
    pub black_level_dn: u16,
    /// Photoelectrons a photosite holds.
    pub full_well_e: f64,
    /// Photoelectrons per raw DN.
    pub gain_e_per_dn: f64,
    /// Photoelectrons per ms and unit radiance s0, without a polarizer, behind the R, G and B filter.
    pub response_e_per_ms: [f64; 3],
    /// Color filters; `None` (`mono`) is a grey sensor that takes the mean of the three bands.
    #[serde(default, deserialize_with = "mosaic")]
    pub bayer: Option<BayerPattern>,
    /// Noise of reading one sample, rms.
    #[serde(default)]
    pub read_noise_e: f64,
    /// Dark current per photosite.
    #[serde(default)]
    pub dark_current_e_per_s: f64,
    /// Standard deviation of the photosites' sensitivity.
    #[serde(default)]
    pub prnu_percent: f64,
    /// Illumination of the sensor falls off as cos^n of the angle off the axis: 4 for a simple lens, 0 for none.
    #[serde(default)]
    pub vignetting_exponent: f64,
    /// Standard deviation of the Gaussian point spread function.
    #[serde(default)]
    pub psf_sigma_px: f64,
}

/// `[polarizer]`: the filter itself.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polarizer {
    /// k₁/k₂, power along the axis over power across it.
    pub extinction_ratio: f64,
    /// Share of unpolarized light that passes, at most ½.
    pub transmission: f64,
    /// How far its wedge turns a ray aside, about the axis together with the filter.
    #[serde(default)]
    pub beam_deviation_arcmin: f64,
}

/// `[wheel]`: what turns the polarizer. Angles at the polarizer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheel {
    /// Standard deviation of where it comes to rest.
    #[serde(default, rename = "angle_sigma_deg", deserialize_with = "degrees")]
    pub angle_sigma: Radians,
    /// Play: a position reached clockwise (towards smaller angles) is missed by this much.
    #[serde(default, rename = "backlash_deg", deserialize_with = "degrees")]
    pub backlash: Radians,
    /// How positions are approached.
    pub approach: Approach,
    /// Speed of a turn.
    pub slew_deg_per_s: f64,
    /// Rest after every turn.
    pub settle_ms: f64,
}

/// How a wheel goes to a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Approach {
    /// Always counter-clockwise at last, so that play has no effect.
    OneSided,
    /// Straight from the last position.
    Direct,
}

/// `[plan]`: the frames of one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Polarizer angles, in order.
    pub angles: Vec<Radians>,
    /// How long.
    pub exposure: Exposure,
    /// Frames at every angle and exposure.
    pub repeats: u16,
    /// Change of the light's power, relative to the start of the capture.
    pub light_drift_percent_per_s: f64,
}

/// Exposure of a capture.
#[derive(Clone, Debug, PartialEq)]
pub enum Exposure {
    /// One frame for each of these at every angle, in µs.
    Fixed(Vec<f64>),
    /// One exposure per view, at which the brightest photosite of the brightest frame reaches this share of saturation.
    Fill(f64),
}

/// `[plan]` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPlan {
    #[serde(deserialize_with = "many_degrees")]
    angles_deg: Vec<Radians>,
    exposures_us: Option<Vec<f64>>,
    fill: Option<f64>,
    #[serde(default = "once")]
    frames: u16,
    #[serde(default)]
    light_drift_percent_per_s: f64,
}

impl Camera {
    /// Largest raw value, 2^bits − 1.
    #[must_use]
    pub fn white_level_dn(&self) -> f64 {
        f64::from(self.bit_depth).exp2() - 1.0
    }

    /// Photoelectrons from which a sample no longer follows the light: the well or the converter, whichever is first.
    #[must_use]
    pub fn saturation_e(&self) -> f64 {
        self.full_well_e.min((self.white_level_dn() - f64::from(self.black_level_dn)) * self.gain_e_per_dn)
    }

    pub(super) fn check(&self, at: &At<'_>) -> Result<(), SimError> {
        at.within("width_px", self.width_px, 1.0..=16384.0)?;
        at.within("height_px", self.height_px, 1.0..=16384.0)?;
        at.within("pixel_pitch_um", self.pixel_pitch_um, 0.5..=100.0)?;
        at.within("bit_depth", self.bit_depth, 8.0..=16.0)?;
        at.within("black_level_dn", self.black_level_dn, 0.0..=self.white_level_dn() - 1.0)?;
        at.within("full_well_e", self.full_well_e, 100.0..=1e7)?;
        at.within("gain_e_per_dn", self.gain_e_per_dn, 1e-3..=1e4)?;
        for response in self.response_e_per_ms {
            at.within("response_e_per_ms", response, 1e-6..=1e9)?;
        }
        at.within("read_noise_e", self.read_noise_e, 0.0..=1000.0)?;
        at.within("dark_current_e_per_s", self.dark_current_e_per_s, 0.0..=1e6)?;
        at.within("prnu_percent", self.prnu_percent, 0.0..=10.0)?;
        at.within("vignetting_exponent", self.vignetting_exponent, 0.0..=8.0)?;
        at.within("psf_sigma_px", self.psf_sigma_px, 0.0..=10.0)
    }
}

impl Polarizer {
    /// Throughput t of the analyzer row: 1 for an ideal polarizer, which passes half of unpolarized light.
    #[must_use]
    pub fn throughput(&self) -> f64 {
        2.0 * self.transmission
    }

    pub(super) fn check(&self, at: &At<'_>) -> Result<(), SimError> {
        at.within("extinction_ratio", self.extinction_ratio, 1.5..=1e10)?;
        at.within("transmission", self.transmission, 0.01..=0.5)?;
        at.within("beam_deviation_arcmin", self.beam_deviation_arcmin, 0.0..=60.0)
    }
}

impl Wheel {
    pub(super) fn check(&self, at: &At<'_>) -> Result<(), SimError> {
        at.within("angle_sigma_deg", self.angle_sigma.to_degrees().0, 0.0..=20.0)?;
        at.within("backlash_deg", self.backlash.to_degrees().0, 0.0..=30.0)?;
        at.within("slew_deg_per_s", self.slew_deg_per_s, 1.0..=1e5)?;
        at.within("settle_ms", self.settle_ms, 0.0..=10_000.0)
    }
}

impl RawPlan {
    pub(super) fn check(self, at: &At<'_>) -> Result<Plan, SimError> {
        let listed = || format!("{:?}", self.angles_deg.iter().map(|a| a.to_degrees().0).collect::<Vec<_>>());
        let finite = self.angles_deg.iter().all(|a| a.0.abs() <= 10.0 * std::f64::consts::PI);
        at.check(finite, "angles_deg", listed(), || "each from -1800 to 1800".to_owned())?;
        let axes = distinct_axes(&self.angles_deg, Degrees(1.0).to_radians());
        let enough = axes >= 3 && self.angles_deg.len() <= MAX_FRAMES;
        at.check(enough, "angles_deg", listed(), || {
            format!("3 to {MAX_FRAMES} angles, with 3 axes more than 1° apart (0° and 180° are one axis)")
        })?;
        let exposure = match (self.exposures_us, self.fill) {
            (Some(exposures), None) => {
                at.within("exposures_us", u32::try_from(exposures.len()).unwrap_or(u32::MAX), 1.0..=16.0)?;
                for exposure in &exposures {
                    at.within("exposures_us", *exposure, 1.0..=600e6)?;
                }
                Exposure::Fixed(exposures)
            }
            (None, Some(fill)) => {
                at.within("fill", fill, 0.01..=10.0)?;
                Exposure::Fill(fill)
            }
            _ => return Err(at.malformed("", "exactly one of `exposures_us` and `fill` is needed")),
        };
        at.within("frames", self.frames, 1.0..=1000.0)?;
        at.within("light_drift_percent_per_s", self.light_drift_percent_per_s, -50.0..=50.0)?;
        Ok(Plan {
            angles: self.angles_deg,
            exposure,
            repeats: self.frames,
            light_drift_percent_per_s: self.light_drift_percent_per_s,
        })
    }
}

fn once() -> u16 {
    1
}
