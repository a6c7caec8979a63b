//! Lights to choose from: an environment map, an analytic sky, a sun.

use std::path::Path;

use glam::DVec3;
use host_image::Layers;
use host_optics::sky::{ClearSky, MoonSpencer, Rayleigh, StokesMap, SunDisk, Uniform};

use super::RelightError;
use crate::session::{BandLight, LightSpec, Polarization, Radiance};

/// An analytic sky of radiance `l` (for a clear sky that of a green zenith far from the sun, for an overcast one that of the
/// zenith).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sky {
    /// None: the sun alone.
    Black,
    /// The same everywhere.
    Uniform(f64),
    /// CIE overcast.
    Overcast(f64),
    /// Clear: blue, brighter towards the horizon and around the sun, which it needs.
    Clear(f64),
}

/// Where the sun is, and how bright.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// From +x towards +y, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
    /// Irradiance of its disk on a plane that faces it, in the mean of R, G and B; `None`: five times that of the sky on the
    /// ground, as on a clear day, or π under a black sky. 0: no disk, only the place of the sun in the sky.
    pub irradiance: Option<f64>,
}

/// R, G, B of a clear sky against its green zenith: away from the sun, more at the horizon, more around the sun.
const CLEAR: [[f64; 3]; 3] = [[0.55, 1.0, 1.75], [0.9, 1.0, 1.1], [4.0, 3.8, 3.4]];
/// Width of its aureole as a chord (about radians).
const AUREOLE_WIDTH: f64 = 0.25;
/// R, G, B of sunlight against its mean.
const SUNLIGHT: [f64; 3] = [1.07, 1.02, 0.91];
/// Irradiance of the sun's disk over that of the clear sky on the ground.
const SUN_OVER_SKY: f64 = 5.0;

impl Sun {
    /// Unit direction.
    fn direction(&self) -> Result<DVec3, RelightError> {
        let elevation_deg = self.elevation_deg;
        if !(elevation_deg > 0.0 && elevation_deg <= 90.0) {
            return Err(RelightError::SunBelowHorizon { elevation_deg });
        }
        finite("the azimuth of the sun", self.azimuth_deg, "a finite angle is needed")?;
        let ((sa, ca), (se, ce)) = (self.azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
        Ok(DVec3::new(ce * ca, ce * sa, se))
    }
}

impl Sky {
    /// The sky with a `sun` beside it; `rayleigh` puts the polarization of single scattering of this largest DoLP on it.
    ///
    /// # Errors
    /// [`RelightError::SunBelowHorizon`]; [`RelightError::NoSun`] for a clear or polarized sky without one;
    /// [`RelightError::Number`] for a radiance or irradiance that makes no sense; [`RelightError::Optics`] for a DoLP outside \[0, 1\].
    pub fn light(self, sun: Option<Sun>, rayleigh: Option<f64>) -> Result<LightSpec, RelightError> {
        let direction = sun.map(|s| s.direction()).transpose()?;
        let radiance = match self {
            Self::Black => [0.0; 3].map(|radiance| Radiance::Uniform(Uniform { radiance })),
            Self::Uniform(l) => [l; 3].map(|radiance| Radiance::Uniform(Uniform { radiance })),
            Self::Overcast(l) => [l; 3].map(|zenith| Radiance::Overcast(MoonSpencer { zenith })),
            Self::Clear(l) => {
                let sun = direction.ok_or(RelightError::NoSun { what: "a clear sky" })?;
                [0, 1, 2].map(|k| {
                    let [base, horizon, aureole] = CLEAR.map(|part| l * part[k]);
                    Radiance::Clear(ClearSky { base, horizon, aureole, width: AUREOLE_WIDTH, sun })
                })
            }
        };
        if let Self::Uniform(l) | Self::Overcast(l) | Self::Clear(l) = self
            && !(l >= 0.0 && l.is_finite())
        {
            return Err(RelightError::Number {
                name: "the sky's radiance",
                value: l,
                expected: "at least 0 is needed",
            });
        }
        let polarization = match rayleigh {
            None => None,
            Some(max_dolp) => {
                let sun = direction.ok_or(RelightError::NoSun { what: "a polarized sky" })?;
                Some(Polarization::Rayleigh(Rayleigh::new(sun, max_dolp)?))
            }
        };
        let sky = LightSpec {
            bands: radiance.map(|radiance| BandLight { radiance, polarization }),
            sun: None,
            photograph_sigma: None,
        };
        match sun {
            None => Ok(sky),
            Some(sun) => sky.with_sun(&sun),
        }
    }
}

impl LightSpec {
    /// With the disk of a sun beside the sky, instead of the one it had.
    ///
    /// # Errors
    /// [`RelightError::SunBelowHorizon`], [`RelightError::Number`].
    pub fn with_sun(self, sun: &Sun) -> Result<Self, RelightError> {
        let direction = sun.direction()?;
        let irradiance = match sun.irradiance {
            Some(e) => e,
            None => {
                let ground = Self { sun: None, ..self.clone() }.known()?.irradiance(DVec3::Z);
                let mean = ground.iter().sum::<f64>() / 3.0;
                if mean > 0.0 { SUN_OVER_SKY * mean } else { std::f64::consts::PI }
            }
        };
        if !(irradiance >= 0.0 && irradiance.is_finite()) {
            let name = "the sun's irradiance";
            return Err(RelightError::Number { name, value: irradiance, expected: "at least 0 is needed" });
        }
        let disk = SunDisk::new(direction, SunDisk::SOLAR_RADIUS_RAD, 1.0)?;
        let radiance = SUNLIGHT.map(|share| share * irradiance / disk.irradiance(direction));
        Ok(Self { sun: (irradiance > 0.0).then_some((disk, radiance)), ..self })
    }
}

/// The light of an equirectangular OpenEXR map, zenith up, `scale` radiance per number.
///
/// Channels R, G, B: a panorama as seen from inside, azimuth falling to the right, `center_azimuth_deg` in its middle;
/// unpolarized. Channels `s0.R` ... `s2.B`: azimuth from +x towards +y from the left edge, (Q, U) in
/// [`host_optics::Frame::sky`]; its middle has azimuth 180°, and the map is turned so that it has `center_azimuth_deg`.
///
/// # Errors
/// [`RelightError::Image`] for a file that cannot be read or misses a channel; [`RelightError::Number`] for light that is
/// negative or not finite; [`RelightError::Optics`] for an odd number of columns.
pub fn environment(path: &Path, center_azimuth_deg: f64, scale: f64) -> Result<LightSpec, RelightError> {
    finite("the azimuth of the map's middle", center_azimuth_deg, "a finite angle is needed")?;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(RelightError::Number { name: "the scale of the map", value: scale, expected: "above 0 is needed" });
    }
    let mut layers = Layers::load(path)?;
    let polarized = layers.channels.contains_key("s0.R");
    let turn = (center_azimuth_deg - 180.0).to_radians();
    let mut band = |name: &str| -> Result<BandLight, RelightError> {
        let mut pixels: Vec<[f32; 3]> = if polarized {
            let [l, q, u] = [0, 1, 2].map(|k: u8| layers.take_f32(&format!("s{k}.{name}")));
            l?.iter().zip(&q?).zip(&u?).map(|((l, q), u)| [*l, *q, *u]).collect()
        } else {
            let mut pixels: Vec<[f32; 3]> = layers.take_f32(name)?.into_iter().map(|l| [l, 0.0, 0.0]).collect();
            pixels.chunks_exact_mut(layers.width).for_each(<[_]>::reverse);
            pixels
        };
        if let Some([l, ..]) = pixels.iter().find(|p| !(p[0] >= 0.0 && p.iter().all(|s| s.is_finite()))) {
            let (name, value) = ("a pixel of the map", f64::from(*l));
            return Err(RelightError::Number { name, value, expected: "light is finite and at least 0" });
        }
        #[expect(clippy::cast_possible_truncation, reason = "maps are f32")]
        let scaled = |s: f32| (f64::from(s) * scale) as f32;
        pixels.iter_mut().flatten().for_each(|s| *s = scaled(*s));
        ground_as_horizon(&mut pixels, layers.width, layers.height);
        let map = StokesMap::new(layers.width, layers.height, pixels)?;
        Ok(BandLight { radiance: Radiance::Map { map, turn }, polarization: None })
    };
    Ok(LightSpec { bands: [band("R")?, band("G")?, band("B")?], sun: None, photograph_sigma: None })
}

/// Puts the lowest row above the horizon in place of all below, which light nothing: a look-up between rows at the horizon
/// must not see the ground.
fn ground_as_horizon(pixels: &mut [[f32; 3]], width: usize, height: usize) {
    let below = height.div_ceil(2) * width;
    for i in below..pixels.len() {
        pixels[i] = pixels[i - width];
    }
}

fn finite(name: &'static str, value: f64, expected: &'static str) -> Result<(), RelightError> {
    if value.is_finite() { Ok(()) } else { Err(RelightError::Number { name, value, expected }) }
}
