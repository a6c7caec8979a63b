//! What one region of the sample is made of.

use glam::{DVec2, DVec3};
use host_optics::ggx::MIN_ALPHA;
use host_optics::{Ior, materials};
use serde::Deserialize;

use super::bumps::{Bumps, RawBumps};
use super::locate::At;
use super::texture::{RawMap, Texture};
use super::value::Bands;
use crate::{Place, SimError};

/// A number (or one per band) that is the same everywhere, or a map over the sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Field<T> {
    /// Everywhere the same.
    Constant(T),
    /// By place.
    Map(Texture),
}

/// Refractive index of a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Index {
    /// Everywhere the same, at R, G, B.
    Constant([Ior; 3]),
    /// By place, dielectric.
    Map {
        /// Real η in [1, 10].
        eta: Texture,
        /// The index of its smallest sample.
        least: Ior,
    },
}

/// Normals of a surface, in the frame of the sample (x right, y up, z out of it).
#[derive(Clone, Debug, PartialEq)]
pub enum Normals {
    /// Everywhere the same unit vector.
    Constant(DVec3),
    /// A map of vectors, +y up; not of unit length.
    Map(Texture),
    /// Waves.
    Bumps(Bumps),
}

/// One material with its finish.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Its name in the scene.
    pub name: String,
    /// ρ_d at R, G, B, in [0, 1].
    pub albedo: Field<[f64; 3]>,
    /// Refractive index.
    pub ior: Index,
    /// GGX α in [0, 1]; 0 is a mirror.
    pub alpha: Field<f64>,
    /// Which way it faces.
    pub normals: Normals,
    /// Where its map of α or η stands; without one, the surface itself.
    pub map_place: Place,
}

/// What the renderer needs to know of one point of the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of its surface in [`super::Sample::surfaces`].
    pub surface: usize,
    /// ρ_d at R, G, B.
    pub albedo: [f64; 3],
    /// Refractive index at R, G, B.
    pub ior: [Ior; 3],
    /// GGX α: 0 (a mirror) or in [1e-6, 1].
    pub alpha: f64,
    /// Unit normal.
    pub normal: DVec3,
}

/// `[surface.NAME]` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSurface {
    albedo: Option<Bands>,
    albedo_map: Option<RawMap>,
    /// A name of the table of refractive indices.
    material: Option<String>,
    eta: Option<Bands>,
    eta_map: Option<RawMap>,
    n: Option<Bands>,
    k: Option<Bands>,
    alpha: Option<f64>,
    alpha_map: Option<RawMap>,
    normal: Option<[f64; 3]>,
    normal_map: Option<RawMap>,
    bumps: Option<RawBumps>,
}

impl Surface {
    /// The surface at `point` (m) with map coordinates (u, v); `index` is its own number.
    pub(super) fn at(&self, index: usize, point: DVec2, [u, v]: [f64; 2]) -> SurfacePoint {
        let alpha = match &self.alpha {
            Field::Constant(alpha) => *alpha,
            Field::Map(map) => map.at(u, v)[0],
        };
        SurfacePoint {
            surface: index,
            albedo: match &self.albedo {
                Field::Constant(albedo) => *albedo,
                Field::Map(map) => map.at(u, v),
            },
            ior: match &self.ior {
                Index::Constant(ior) => *ior,
                // A mix of checked values lies within their range but for rounding at its end.
                Index::Map { eta, least } => eta.at(u, v).map(|eta| Ior::new(eta, 0.0).unwrap_or(*least)),
            },
            alpha: if alpha < MIN_ALPHA { 0.0 } else { alpha.min(1.0) },
            normal: match &self.normals {
                Normals::Constant(normal) => *normal,
                Normals::Map(map) => DVec3::from_array(map.at(u, v)).try_normalize().unwrap_or(DVec3::Z),
                Normals::Bumps(bumps) => bumps.normal(point),
            },
        }
    }
}

impl RawSurface {
    pub(super) fn check(self, name: &str, at: &At<'_>, seed: u64, which: u64) -> Result<Surface, SimError> {
        let one = |given: &[bool], keys: &str| {
            if given.iter().filter(|g| **g).count() == 1 {
                Ok(())
            } else {
                Err(at.malformed("", format!("exactly one of {keys} is needed")))
            }
        };
        one(&[self.albedo.is_some(), self.albedo_map.is_some()], "`albedo` and `albedo_map`")?;
        one(&[self.alpha.is_some(), self.alpha_map.is_some()], "`alpha` and `alpha_map`")?;
        let index_given =
            [self.material.is_some(), self.eta.is_some(), self.eta_map.is_some(), self.n.is_some() || self.k.is_some()];
        one(&index_given, "`material`, `eta`, `eta_map` and `n` with `k`")?;
        Ok(Surface {
            name: name.to_owned(),
            albedo: self.albedo(at)?,
            ior: self.ior(at)?,
            alpha: self.alpha(at)?,
            normals: self.normals(at, seed, which)?,
            map_place: at.place(match (&self.alpha_map, &self.eta_map) {
                (Some(_), _) => "alpha_map",
                (None, Some(_)) => "eta_map",
                (None, None) => "",
            }),
        })
    }

    fn albedo(&self, at: &At<'_>) -> Result<Field<[f64; 3]>, SimError> {
        if let Some(map) = &self.albedo_map {
            return bounded(map, at, "albedo_map", 3, 0.0, 1.0).map(Field::Map);
        }
        let Bands(albedo) = self.albedo.unwrap_or(Bands([0.0; 3]));
        albedo.iter().try_for_each(|a| at.within("albedo", *a, 0.0..=1.0))?;
        Ok(Field::Constant(albedo))
    }

    fn alpha(&self, at: &At<'_>) -> Result<Field<f64>, SimError> {
        if let Some(map) = &self.alpha_map {
            return bounded(map, at, "alpha_map", 1, 0.0, 1.0).map(Field::Map);
        }
        let alpha = self.alpha.unwrap_or(0.0);
        at.within("alpha", alpha, 0.0..=1.0)?;
        Ok(Field::Constant(alpha))
    }

    fn ior(&self, at: &At<'_>) -> Result<Index, SimError> {
        if let Some(map) = &self.eta_map {
            let eta = bounded(map, at, "eta_map", 3, 1.0, 10.0)?;
            let least = at.optics("eta_map", Ior::new(eta.range().0, 0.0))?;
            return Ok(Index::Map { eta, least });
        }
        let bands = |n: [f64; 3], k: [f64; 3], key: &str| -> Result<_, SimError> {
            let ior = |band: usize| at.optics(key, Ior::new(n[band], k[band]));
            Ok(Index::Constant([ior(0)?, ior(1)?, ior(2)?]))
        };
        if let Some(name) = &self.material {
            let known: Vec<&str> = materials::ALL.iter().map(|m| m.name).collect();
            let material = materials::named(name).ok_or_else(|| at.unknown("material", name, &known))?;
            return at.optics("material", material.iors()).map(Index::Constant);
        }
        match (self.eta, self.n, self.k) {
            (Some(Bands(eta)), ..) => bands(eta, [0.0; 3], "eta"),
            (None, Some(Bands(n)), Some(Bands(k))) => bands(n, k, "n"),
            _ => Err(at.malformed("", "`n` and `k` are needed together; a dielectric is written as `eta`")),
        }
    }

    fn normals(&self, at: &At<'_>, seed: u64, which: u64) -> Result<Normals, SimError> {
        match (self.normal, &self.normal_map, &self.bumps) {
            (None, None, None) => Ok(Normals::Constant(DVec3::Z)),
            (Some(normal), None, None) => {
                let up = DVec3::from_array(normal);
                at.check(up.z > 0.0 && up.is_finite(), "normal", format!("{normal:?}"), || "z > 0".to_owned())?;
                at.optics("normal", host_optics::frames::direction(up)).map(Normals::Constant)
            }
            (None, Some(map), None) => map.load_vectors(&at.table("normal_map")).map(Normals::Map),
            (None, None, Some(bumps)) => bumps.check(&at.table("bumps"), seed, which).map(Normals::Bumps),
            _ => Err(at.malformed("", "at most one of `normal`, `normal_map` and `bumps` may stand here")),
        }
    }
}

/// A map whose every value must lie in [low, high].
fn bounded(map: &RawMap, at: &At<'_>, key: &str, channels: usize, low: f64, high: f64) -> Result<Texture, SimError> {
    let at = at.table(key);
    let texture = map.load(&at, channels)?;
    let (least, most) = texture.range();
    at.within("file", least, low..=high)?;
    at.within("file", most, low..=high)?;
    Ok(texture)
}
