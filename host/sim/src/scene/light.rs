//! The light: a sky, its polarization, and the disk of the sun.
//!
//! Azimuths are counter-clockwise from +x (towards +y) seen from above, elevations above the horizon. Radiance has the
//! scene's own unit.

use std::path::PathBuf;

use glam::DVec3;
use host_image::{ImageError, Picture, Samples};
use host_optics::sky::{Berry, ClearSky, MoonSpencer, Pattern, Rayleigh, StokesMap, SunDisk, Uniform};
use protocol_polar::{Degrees, Radians};
use serde::Deserialize;

use super::locate::At;
use super::radiance;
use super::value::{Bands, degrees};
use crate::{SimError, optical};

/// Light on the sample; one [`SkyBand`] per color band, and one disk at most.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// R, G, B.
    pub bands: [SkyBand; 3],
    /// The polarization of the bands in numbers.
    pub pattern: Option<optical::SkyPattern>,
    /// Direction of the sun, if the scene says where it is.
    pub sun: Option<DVec3>,
    /// The sun's disk; unpolarized, beside the sky.
    pub disk: Option<optical::Sun>,
}

/// The sky at one band.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyBand {
    /// L by direction.
    pub radiance: SkyRadiance,
    /// (Q, U)/L by direction; `None` is unpolarized.
    pub polarization: Option<SkyPattern>,
}

/// Radiance of a sky.
#[derive(Clone, Debug, PartialEq)]
pub enum SkyRadiance {
    /// The same everywhere.
    Uniform(Uniform),
    /// CIE overcast.
    Overcast(MoonSpencer),
    /// Clear, without the disk.
    Clear(ClearSky),
    /// A picture.
    Map(TurnedMap),
}

/// Polarization of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyPattern {
    /// Single scattering.
    Rayleigh(Rayleigh),
    /// With neutral points.
    Berry(Berry),
}

/// An environment map turned about the vertical.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnedMap {
    map: StokesMap,
    /// (cos, sin) of the azimuth at which the map's own azimuth 0 lies.
    turn: (f64, f64),
    /// Where it comes from.
    source: MapSource,
}

/// The file of an environment map and how it is used.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSource {
    /// As found from the scene's folder.
    pub file: PathBuf,
    /// Azimuth shown in the middle of the picture.
    pub center_azimuth: Radians,
    /// Radiance of the scene per number of the file.
    pub scale: f64,
}

/// `[light]` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLight {
    uniform: Option<RawUniform>,
    overcast: Option<RawOvercast>,
    clear: Option<RawClear>,
    map: Option<RawSkyMap>,
    sun: Option<RawSun>,
    rayleigh: Option<RawRayleigh>,
    berry: Option<RawBerry>,
    sun_disk: Option<RawDisk>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawUniform {
    radiance: Bands,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawOvercast {
    zenith_radiance: Bands,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawClear {
    base_radiance: Bands,
    horizon_radiance: Bands,
    aureole_radiance: Bands,
    #[serde(rename = "aureole_width_deg", deserialize_with = "degrees")]
    aureole_width: Radians,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSkyMap {
    file: PathBuf,
    /// Azimuth shown in the middle of the picture.
    #[serde(rename = "center_azimuth_deg", deserialize_with = "degrees")]
    center_azimuth: Radians,
    /// Radiance of the scene per number of the file.
    scale: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSun {
    #[serde(rename = "azimuth_deg", deserialize_with = "degrees")]
    azimuth: Radians,
    #[serde(rename = "elevation_deg", deserialize_with = "degrees")]
    elevation: Radians,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRayleigh {
    max_dolp: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBerry {
    max_dolp: f64,
    splitting_deg: Degrees,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDisk {
    radiance: Bands,
    #[serde(default, rename = "angular_radius_deg")]
    angular_radius: Option<Degrees>,
}

impl TurnedMap {
    /// Where it comes from.
    #[must_use]
    pub fn source(&self) -> &MapSource {
        &self.source
    }

    /// The map as it is in the file, in its own azimuth.
    pub(crate) fn map(&self) -> &StokesMap {
        &self.map
    }

    /// A direction of the world in the map's own azimuth.
    pub(crate) fn to_map(&self, DVec3 { x, y, z }: DVec3) -> DVec3 {
        let (c, s) = self.turn;
        DVec3::new(c * x + s * y, c * y - s * x, z)
    }
}

impl host_optics::Light for SkyBand {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let [l, ..] = self.radiance.stokes(direction);
        match &self.polarization {
            None => [l, 0.0, 0.0],
            Some(pattern) => {
                let [q, u] = pattern.fraction(direction);
                [l, l * q, l * u]
            }
        }
    }
}

impl host_optics::Light for SkyRadiance {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        match self {
            Self::Uniform(sky) => sky.stokes(direction),
            Self::Overcast(sky) => sky.stokes(direction),
            Self::Clear(sky) => sky.stokes(direction),
            Self::Map(map) => map.stokes(direction),
        }
    }
}

impl host_optics::Light for TurnedMap {
    /// The sky frame turns about the vertical with the direction, so (Q, U) stay as they are.
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        self.map.stokes(self.to_map(direction))
    }
}

impl Pattern for SkyPattern {
    fn fraction(&self, direction: DVec3) -> [f64; 2] {
        match self {
            Self::Rayleigh(pattern) => pattern.fraction(direction),
            Self::Berry(pattern) => pattern.fraction(direction),
        }
    }
}

impl RawLight {
    pub(super) fn check(self, at: &At<'_>) -> Result<Light, SimError> {
        let sun = self.sun.as_ref().map(|sun| sun.check(&at.table("sun"))).transpose()?;
        let placed =
            |key: &str| sun.ok_or_else(|| at.malformed(key, "a place of the sun is needed: table `light.sun`"));
        let (polarization, pattern) = match (&self.rayleigh, &self.berry) {
            (None, None) => (None, None),
            (Some(RawRayleigh { max_dolp }), None) => {
                let (sun, max_dolp) = (placed("rayleigh")?, *max_dolp);
                let pattern = at.optics("rayleigh.max_dolp", Rayleigh::new(sun, max_dolp))?;
                (Some(SkyPattern::Rayleigh(pattern)), Some(optical::SkyPattern::Rayleigh { sun, max_dolp }))
            }
            (None, Some(RawBerry { max_dolp, splitting_deg: Degrees(splitting_deg) })) => {
                let (sun, max_dolp, splitting_deg) = (placed("berry")?, *max_dolp, *splitting_deg);
                let pattern = at.optics("berry", Berry::new(sun, splitting_deg, max_dolp))?;
                (Some(SkyPattern::Berry(pattern)), Some(optical::SkyPattern::Berry { sun, splitting_deg, max_dolp }))
            }
            _ => return Err(at.malformed("rayleigh", "at most one of `rayleigh` and `berry` may stand here")),
        };
        let disk = self.sun_disk.as_ref().map(|disk| disk.check(at, placed("sun_disk")?)).transpose()?;
        let bands = self.radiance(at, sun)?.map(|radiance| SkyBand { radiance, polarization });
        Ok(Light { bands, pattern, sun, disk })
    }

    fn radiance(&self, at: &At<'_>, sun: Option<DVec3>) -> Result<[SkyRadiance; 3], SimError> {
        match (&self.uniform, &self.overcast, &self.clear, &self.map) {
            (Some(raw), None, None, None) => {
                let radiance = positive(&at.table("uniform"), "radiance", raw.radiance)?;
                Ok(radiance.map(|radiance| SkyRadiance::Uniform(Uniform { radiance })))
            }
            (None, Some(raw), None, None) => {
                let zenith = positive(&at.table("overcast"), "zenith_radiance", raw.zenith_radiance)?;
                Ok(zenith.map(|zenith| SkyRadiance::Overcast(MoonSpencer { zenith })))
            }
            (None, None, Some(raw), None) => {
                let sun =
                    sun.ok_or_else(|| at.malformed("clear", "a place of the sun is needed: table `light.sun`"))?;
                raw.check(&at.table("clear"), sun)
            }
            (None, None, None, Some(raw)) => raw.check(&at.table("map")),
            _ => Err(at.malformed("", "exactly one of `uniform`, `overcast`, `clear` and `map` is needed: the sky")),
        }
    }
}

impl RawClear {
    fn check(&self, at: &At<'_>, sun: DVec3) -> Result<[SkyRadiance; 3], SimError> {
        at.within("aureole_width_deg", self.aureole_width.to_degrees().0, 0.5..=90.0)?;
        let base = positive(at, "base_radiance", self.base_radiance)?;
        let horizon = positive(at, "horizon_radiance", self.horizon_radiance)?;
        let aureole = positive(at, "aureole_radiance", self.aureole_radiance)?;
        Ok([0, 1, 2].map(|band| {
            SkyRadiance::Clear(ClearSky {
                base: base[band],
                horizon: horizon[band],
                aureole: aureole[band],
                width: self.aureole_width.0,
                sun,
            })
        }))
    }
}

impl RawSun {
    fn check(&self, at: &At<'_>) -> Result<DVec3, SimError> {
        at.within("azimuth_deg", self.azimuth.to_degrees().0, -360.0..=360.0)?;
        // Below −18° (astronomical twilight) there is no skylight to polarize.
        at.within("elevation_deg", self.elevation.to_degrees().0, -18.0..=90.0)?;
        let ((sa, ca), (se, ce)) = (self.azimuth.0.sin_cos(), self.elevation.0.sin_cos());
        Ok(DVec3::new(ce * ca, ce * sa, se))
    }
}

impl RawDisk {
    fn check(&self, light: &At<'_>, sun: DVec3) -> Result<optical::Sun, SimError> {
        // Free of the rounding of the way to a direction and back.
        let elevation = (sun.z.asin().to_degrees() * 1e9).round() / 1e9;
        light.table("sun").check(elevation > 0.0, "elevation_deg", elevation, || {
            "above 0 while there is a `light.sun_disk`: below the horizon no disk is seen".to_owned()
        })?;
        let at = light.table("sun_disk");
        let radius = match self.angular_radius {
            None => SunDisk::SOLAR_RADIUS_RAD,
            Some(radius) => {
                at.within("angular_radius_deg", radius.0, 0.01..=30.0)?;
                radius.to_radians().0
            }
        };
        let radiance = positive(&at, "radiance", self.radiance)?;
        at.optics("angular_radius_deg", SunDisk::new(sun, radius, 1.0))?;
        Ok(optical::Sun { direction: sun, angular_radius_rad: radius, radiance })
    }
}

impl RawSkyMap {
    fn check(&self, at: &At<'_>) -> Result<[SkyRadiance; 3], SimError> {
        at.within("center_azimuth_deg", self.center_azimuth.to_degrees().0, -360.0..=360.0)?;
        at.within("scale", self.scale, 1e-9..=1e9)?;
        let picture = read_environment(at, &self.file)?;
        let Samples::F32(file) = &picture.samples else {
            let found = "integers, whose radiance is not known".to_owned();
            return Err(SimError::OutOfRange {
                place: at.place("file"),
                value: found,
                allowed: "a Radiance .hdr or an OpenEXR file".to_owned(),
            });
        };
        let dark = file.iter().copied().fold(f32::INFINITY, f32::min);
        at.check(dark >= 0.0, "file", format!("a radiance of {dark}"), || "radiance >= 0".to_owned())?;
        let scale = self.scale;
        let [r, g, b] = mirrored(&picture, file).map(|pixels| -> Result<SkyRadiance, SimError> {
            let pixels = pixels.into_iter().map(|l| [scaled(l, scale), 0.0, 0.0]).collect();
            let map = at.optics("file", StokesMap::new(picture.width, picture.height, pixels))?;
            // Column centers at azimuth 2π(c + ½)/width: the middle of the (mirrored) picture is at azimuth π.
            let (s, c) = (self.center_azimuth.0 - std::f64::consts::PI).sin_cos();
            let file = at.resolve(&self.file);
            let source = MapSource { file, center_azimuth: self.center_azimuth, scale };
            Ok(SkyRadiance::Map(TurnedMap { map, turn: (c, s), source }))
        });
        Ok([r?, g?, b?])
    }
}

/// A Radiance picture by its first bytes, else whatever the image crate reads.
fn read_environment(at: &At<'_>, file: &std::path::Path) -> Result<Picture, SimError> {
    let path = at.resolve(file);
    let read = || -> Result<Picture, ImageError> {
        let bytes = std::fs::read(&path).map_err(|source| ImageError::Io { path: path.clone(), source })?;
        if bytes.starts_with(radiance::MAGIC) { radiance::decode(&bytes, &path) } else { Picture::read(&path) }
    };
    read().map_err(|source| SimError::Map { place: at.place("file"), source: Box::new(source) })
}

/// The three bands with their columns from right to left: a panorama shows what is to the right, clockwise from above, to
/// the right; [`StokesMap`] counts azimuth counter-clockwise.
fn mirrored(picture: &Picture, samples: &[f32]) -> [Vec<f32>; 3] {
    let channels = picture.channels;
    [0, 1, 2].map(|band: usize| {
        let rows = samples.chunks_exact(picture.width * channels);
        rows.flat_map(|row| row.chunks_exact(channels).rev().map(|p| p[band.min(channels - 1)])).collect()
    })
}

fn positive(at: &At<'_>, key: &str, Bands(radiance): Bands) -> Result<[f64; 3], SimError> {
    radiance.iter().try_for_each(|l| at.within(key, *l, 0.0..=1e12))?;
    Ok(radiance)
}

#[expect(clippy::cast_possible_truncation, reason = "radiance maps are f32; rounding to nearest is meant")]
fn scaled(radiance: f32, scale: f64) -> f32 {
    (f64::from(radiance) * scale) as f32
}
