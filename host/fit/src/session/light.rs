//! The light of a session: what arrives at the sample from each direction, band by band.
//!
//! | `type` | keys |
//! |---|---|
//! | `map`, `probe` | `file`: OpenEXR with R, G, B or s0, s1, s2 of each; `layout`; `scale`: radiance per number, or 1 |
//! | `constant`, `uniform` | `radiance` |
//! | `overcast` | `zenith_radiance` |
//! | `clear` | `base_radiance`, `horizon_radiance`, `aureole_radiance`, `aureole_width_deg` |
//! | `mirror_ball` | `file`, `ball` |
//!
//! Radiances are [R, G, B]. For every type `polarization` is `none`, or `{"type": "rayleigh", "max_dolp"}` or `{"type":
//! "berry", "max_dolp", "splitting_deg"}`, which put an analytic polarization on the radiance; `sun_azimuth_deg` and
//! `sun_elevation_deg` say where the sun is, `sun_disk` (`radiance`, `angular_radius_deg`) that its disk lights the
//! sample beside the sky. Layouts of maps: azimuth from +x towards +y from the left edge (the default; (Q, U) in
//! [`host_optics::Frame::sky`]); or a panorama as seen from inside, azimuth falling to the right, `center_azimuth_deg`
//! in its middle (unpolarized).

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use host_image::{Layers, Picture};
use host_optics::sky::{Berry, ClearSky, MoonSpencer, Pattern, Rayleigh, StokesMap, SunDisk, Uniform};
use host_optics::{Light, OpticsError};

use super::SessionError;
use super::ball::MirrorBall;
use super::document::{LightDocument, PolarizationDocument};
use super::pose::matrix;
use crate::light::KnownLight;

/// Light on the sample.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSpec {
    /// R, G, B.
    pub bands: [BandLight; 3],
    /// The disk of the sun beside the sky, of radiance 1, and its radiance in R, G, B; unpolarized.
    pub sun: Option<(SunDisk, [f64; 3])>,
    /// For light out of a photograph: (standard deviation of all radiances together, relative; that of the direction in
    /// the middle of the ball, radians).
    pub photograph_sigma: Option<(f64, f64)>,
}

/// The sky at one band.
#[derive(Clone, Debug, PartialEq)]
pub struct BandLight {
    /// L, and (Q, U) if no pattern is given.
    pub radiance: Radiance,
    /// (Q, U)/L by direction, instead of the radiance's own.
    pub polarization: Option<Polarization>,
}

/// Radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub enum Radiance {
    /// Equirectangular, with its own polarization.
    Map {
        /// In its own azimuth.
        map: StokesMap,
        /// Azimuth at which the map's azimuth 0 lies, radians.
        turn: f64,
    },
    /// The same everywhere.
    Uniform(Uniform),
    /// CIE overcast.
    Overcast(MoonSpencer),
    /// Clear, without the disk.
    Clear(ClearSky),
}

/// An analytic polarization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Polarization {
    /// Single scattering.
    Rayleigh(Rayleigh),
    /// With neutral points.
    Berry(Berry),
}

impl Light for BandLight {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let own = match &self.radiance {
            // The sky frame turns about the vertical with the direction, so (Q, U) stay as they are.
            Radiance::Map { map, turn } => map.stokes(DMat3::from_rotation_z(-turn) * direction),
            Radiance::Uniform(sky) => sky.stokes(direction),
            Radiance::Overcast(sky) => sky.stokes(direction),
            Radiance::Clear(sky) => sky.stokes(direction),
        };
        let [q, u] = match &self.polarization {
            None => return own,
            Some(Polarization::Rayleigh(pattern)) => pattern.fraction(direction),
            Some(Polarization::Berry(pattern)) => pattern.fraction(direction),
        };
        [own[0], own[0] * q, own[0] * u]
    }
}

impl LightSpec {
    /// The light as the fit takes it: maps by their texels, formulas and turned maps sampled.
    ///
    /// # Errors
    /// [`OpticsError::MapSize`] for a map it cannot prefilter.
    pub fn known(&self) -> Result<KnownLight, OpticsError> {
        let straight = |band: &BandLight| match (&band.radiance, &band.polarization) {
            (Radiance::Map { map, turn }, None) if *turn == 0.0 => Some(map.clone()),
            _ => None,
        };
        let known = match self.bands.each_ref().map(straight) {
            [Some(r), Some(g), Some(b)] => KnownLight::of_maps([r, g, b])?,
            _ => KnownLight::sampled(KnownLight::FORMULA_SIZE, self.bands.clone())?,
        };
        let known = known.with_scale_uncertainty(self.photograph_sigma.map_or(0.0, |(scale, _)| scale));
        Ok(match self.sun {
            None => known,
            Some((disk, radiance)) => known.with_sun(disk, radiance),
        })
    }
}

/// The layouts of maps that are read; the first is that of [`StokesMap`].
const LAYOUTS: &str = "\"equirectangular, ... azimuth ... from +x towards +y\" and \"equirectangular, ... seen from \
                       inside: azimuth falls to the right\" are";

/// Rows of the map a mirror ball is unwrapped into.
const BALL_ROWS: usize = 256;

/// Reads the light whose keys stand in a file in `folder`.
pub(super) fn read(document: &LightDocument, folder: &Path, place: &str) -> Result<LightSpec, SessionError> {
    let reading = Reading { document, folder, place };
    let mut photograph_sigma = None;
    let radiance = match document.r#type.as_str() {
        "map" | "probe" => {
            let (maps, turn) = reading.map()?;
            maps.map(|map| Radiance::Map { map, turn })
        }
        "constant" | "uniform" => {
            reading.bands("radiance", document.radiance)?.map(|radiance| Radiance::Uniform(Uniform { radiance }))
        }
        "overcast" => {
            let zenith = reading.bands("zenith_radiance", document.zenith_radiance)?;
            zenith.map(|zenith| Radiance::Overcast(MoonSpencer { zenith }))
        }
        "clear" => reading.clear()?,
        "mirror_ball" => {
            let (bands, sigma) = reading.ball()?;
            photograph_sigma = Some(sigma);
            bands.map(|map| Radiance::Map { map, turn: 0.0 })
        }
        other => {
            return Err(reading.unsupported(
                "light.type",
                other,
                "map, probe, constant, uniform, overcast, clear and mirror_ball are",
            ));
        }
    };
    let polarization = reading.polarization()?;
    let bands = radiance.map(|radiance| BandLight { radiance, polarization });
    Ok(LightSpec { bands, sun: reading.disk()?, photograph_sigma })
}

struct Reading<'a> {
    document: &'a LightDocument,
    folder: &'a Path,
    place: &'a str,
}

impl Reading<'_> {
    /// The bands, and the azimuth at which theirs begins.
    fn map(&self) -> Result<([StokesMap; 3], f64), SessionError> {
        let path = self.file()?;
        let from_inside = match self.document.layout.as_deref() {
            None => false,
            Some(layout) if layout.starts_with("equirectangular") && layout.contains("from +x towards +y") => false,
            Some(layout) if layout.starts_with("equirectangular") && layout.contains("azimuth falls to the right") => {
                true
            }
            Some(other) => return Err(self.unsupported("light.layout", other, LAYOUTS)),
        };
        let scale = self.document.scale.unwrap_or(1.0);
        let mut layers = Layers::load(&path)?;
        let polarized = layers.channels.contains_key("s0.R") || layers.channels.contains_key("S0.R");
        if polarized && from_inside {
            return Err(self.unsupported("light.layout", "a polarized map seen from inside", LAYOUTS));
        }
        let (width, height) = (layers.width, layers.height);
        let mut band = |name: &str| {
            let mut plane = |k: usize| {
                let lower = format!("s{k}.{name}");
                let channel = if layers.channels.contains_key(&lower) { lower } else { format!("S{k}.{name}") };
                layers.take_f32(&channel)
            };
            let pixels: Vec<[f32; 3]> = if polarized {
                let (s0, s1, s2) = (plane(0)?, plane(1)?, plane(2)?);
                s0.iter().zip(&s1).zip(&s2).map(|((a, b), c)| [*a, *b, *c]).collect()
            } else {
                layers.take_f32(name)?.iter().map(|l| [*l, 0.0, 0.0]).collect()
            };
            self.physical(&pixels)?;
            let mut pixels: Vec<[f32; 3]> = pixels.into_iter().map(|p| p.map(|x| scaled(x, scale))).collect();
            if from_inside {
                pixels.chunks_exact_mut(width).for_each(<[_]>::reverse);
            }
            StokesMap::new(width, height, pixels).map_err(|e| self.optics("light.file", e))
        };
        let bands = [band("R")?, band("G")?, band("B")?];
        // The middle of the reversed picture is at the map's own azimuth π.
        let center =
            if from_inside { self.number("center_azimuth_deg", self.document.center_azimuth_deg)? } else { 180.0 };
        Ok((bands, (center - 180.0).to_radians()))
    }

    /// Light that is finite, not negative, and not more polarized than it is bright (to the rounding of half floats).
    fn physical(&self, pixels: &[[f32; 3]]) -> Result<(), SessionError> {
        let wrong = |[l, q, u]: &[f32; 3]| !(*l >= 0.0 && l.is_finite() && q.hypot(*u) <= 1.01 * l + 1e-6);
        match pixels.iter().position(wrong) {
            None => Ok(()),
            Some(i) => Err(self.malformed(
                "light.file",
                format!("(L, Q, U) = {:?} at pixel {i} (row-major)", pixels[i]),
                "light is finite, L >= 0 and Q² + U² <= L²",
            )),
        }
    }

    fn clear(&self) -> Result<[Radiance; 3], SessionError> {
        let d = self.document;
        let [base, horizon, aureole] = [
            self.bands("base_radiance", d.base_radiance)?,
            self.bands("horizon_radiance", d.horizon_radiance)?,
            self.bands("aureole_radiance", d.aureole_radiance)?,
        ];
        let width = self.number("aureole_width_deg", d.aureole_width_deg)?.to_radians();
        let sun = self.sun()?;
        Ok([0, 1, 2]
            .map(|k| Radiance::Clear(ClearSky { base: base[k], horizon: horizon[k], aureole: aureole[k], width, sun })))
    }

    fn ball(&self) -> Result<([StokesMap; 3], (f64, f64)), SessionError> {
        let Some(ball) = &self.document.ball else { return Err(self.missing("ball")) };
        let path = self.file()?;
        let picture = Picture::read(&path)?;
        super::frames::require_linear(&picture, &path)?;
        let known = MirrorBall {
            center: DVec2::from_array(ball.center_px),
            radius_px: ball.radius_px,
            circle_sigma_px: ball.circle_sigma_px.unwrap_or(0.5),
            intrinsics: matrix(&ball.K),
            rotation: matrix(&ball.R_world_to_camera),
            reflectance: ball.reflectance,
            reflectance_sigma: ball.reflectance_sigma.unwrap_or(0.0),
            black_dn: ball.black_level_dn.unwrap_or(0.0),
            radiance_per_dn: ball.radiance_per_dn.unwrap_or(1.0),
        };
        let found = known.unwrap(&picture, BALL_ROWS).map_err(|e| self.optics("light.ball", e))?;
        let direction = 2.0 * known.circle_sigma_px / known.radius_px;
        Ok((found.bands, (found.scale_sigma, direction)))
    }

    fn polarization(&self) -> Result<Option<Polarization>, SessionError> {
        const KNOWN: &str = "none, in the map, and formulas of type rayleigh and berry are";
        match &self.document.polarization {
            None => Ok(None),
            Some(PolarizationDocument::Words(text)) if text.starts_with("none") || text.starts_with("in the map") => {
                Ok(None)
            }
            Some(PolarizationDocument::Words(other)) => Err(self.unsupported("light.polarization", other, KNOWN)),
            Some(PolarizationDocument::Formula { r#type, max_dolp, splitting_deg }) => match r#type.as_str() {
                "rayleigh" => {
                    let pattern = Rayleigh::new(self.sun()?, *max_dolp);
                    pattern.map(|p| Some(Polarization::Rayleigh(p))).map_err(|e| self.optics("light.polarization", e))
                }
                "berry" => {
                    let splitting = self.number("polarization.splitting_deg", *splitting_deg)?;
                    let pattern = Berry::new(self.sun()?, splitting, *max_dolp);
                    pattern.map(|p| Some(Polarization::Berry(p))).map_err(|e| self.optics("light.polarization", e))
                }
                other => Err(self.unsupported("light.polarization.type", other, KNOWN)),
            },
        }
    }

    fn disk(&self) -> Result<Option<(SunDisk, [f64; 3])>, SessionError> {
        let Some(disk) = &self.document.sun_disk else { return Ok(None) };
        let made = SunDisk::new(self.sun()?, disk.angular_radius_deg.to_radians(), 1.0);
        let made = made.map_err(|e| self.optics("light.sun_disk", e))?;
        Ok(Some((made, self.bands("sun_disk.radiance", Some(disk.radiance))?)))
    }

    fn sun(&self) -> Result<DVec3, SessionError> {
        let azimuth = self.number("sun_azimuth_deg", self.document.sun_azimuth_deg)?.to_radians();
        let elevation = self.number("sun_elevation_deg", self.document.sun_elevation_deg)?.to_radians();
        let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
        Ok(DVec3::new(ce * ca, ce * sa, se))
    }

    fn file(&self) -> Result<std::path::PathBuf, SessionError> {
        self.document.file.as_ref().map(|file| self.folder.join(file)).ok_or_else(|| self.missing("file"))
    }

    fn bands(&self, key: &str, value: Option<[f64; 3]>) -> Result<[f64; 3], SessionError> {
        let bands = value.ok_or_else(|| self.missing(key))?;
        if bands.iter().all(|l| *l >= 0.0 && l.is_finite()) {
            return Ok(bands);
        }
        Err(self.malformed(&format!("light.{key}"), format!("{bands:?}"), "radiance is finite and not negative"))
    }

    fn number(&self, key: &str, value: Option<f64>) -> Result<f64, SessionError> {
        let number = value.ok_or_else(|| self.missing(key))?;
        if number.is_finite() {
            return Ok(number);
        }
        Err(self.malformed(&format!("light.{key}"), number.to_string(), "a finite number is needed"))
    }

    fn missing(&self, key: &str) -> SessionError {
        let what = format!("light.{key} (of type {:?})", self.document.r#type);
        SessionError::Missing { place: self.place.to_owned(), what, remedy: "the fit must know the light: add it" }
    }

    fn malformed(&self, key: &str, found: String, expected: &str) -> SessionError {
        let (place, key, expected) = (self.place.to_owned(), key.to_owned(), expected.to_owned());
        SessionError::Malformed { place, key, found, expected }
    }

    fn unsupported(&self, key: &str, found: &str, known: &str) -> SessionError {
        let (place, key, found, known) = (self.place.to_owned(), key.to_owned(), found.to_owned(), known.to_owned());
        SessionError::Unsupported { place, key, found, known }
    }

    fn optics(&self, key: &str, source: OpticsError) -> SessionError {
        SessionError::Optics { place: format!("{}, {key}", self.place), source }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "radiance maps are f32; rounding to nearest is meant")]
fn scaled(radiance: f32, scale: f64) -> f32 {
    (f64::from(radiance) * scale) as f32
}
