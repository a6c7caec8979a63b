//! The light of a scene in three bands, and what is known of it in advance (for the effects' bounds).
//!
//! Radiance and polarization pattern are kept apart, so that an effect can be left out: light without its polarization,
//! a sky without its neutral points, a sun without its disk. (L, Q, U) are in [`host_optics::Frame::sky`].

use crate::{Effect, EffectSet};
use glam::DVec3;
use host_optics::prefilter::{Pyramid, Sources};
use host_optics::sky::{Berry, ClearSky, MoonSpencer, Pattern, Rayleigh, StokesMap, SunDisk, Uniform};
use host_optics::{Light, OpticsError};

/// Radiance of one band by direction, with the polarization of its own that a map may have.
#[derive(Clone, Debug, PartialEq)]
pub enum Radiance {
    /// The same from everywhere.
    Uniform(Uniform),
    /// The standard overcast sky.
    Overcast(MoonSpencer),
    /// A clear sky in five numbers.
    Clear(ClearSky),
    /// An environment map.
    Map(StokesMap),
}

/// Polarization put on the radiance. `max_dolp` in [0, 1]; the sun's direction may have any length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SkyPattern {
    /// Single scattering.
    Rayleigh {
        /// Direction of the sun.
        sun: DVec3,
        /// Largest degree of polarization.
        max_dolp: f64,
    },
    /// Berry, Dennis and Lee: Rayleigh with four neutral points.
    Berry {
        /// Direction of the sun.
        sun: DVec3,
        /// Degrees between the two neutral points by the sun.
        splitting_deg: f64,
        /// Largest degree of polarization.
        max_dolp: f64,
    },
}

/// The sun, unpolarized, of one angular radius and a radiance per band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Direction, of any length.
    pub direction: DVec3,
    /// Angular radius in radians.
    pub angular_radius_rad: f64,
    /// Radiance of the disk, R, G, B.
    pub radiance: [f64; 3],
}

/// The light of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// Radiance, R, G, B.
    pub radiance: [Radiance; 3],
    /// Polarization that replaces the map's own, if any.
    pub pattern: Option<SkyPattern>,
    /// The sun's disk, if it is not part of the radiance.
    pub sun: Option<Sun>,
}

/// What is known of the light over the upper hemisphere, the sun apart. Worst band; proved by the formulas' own terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Infimum and supremum of L, R, G, B.
    pub range: [[f64; 2]; 3],
    /// Supremum of the degree of polarization.
    pub max_dolp: f64,
}

/// One band of the light, with what a set of effects leaves of its polarization.
#[derive(Clone, Debug)]
pub(crate) struct BandLight<'a> {
    radiance: &'a Radiance,
    pattern: BandPattern,
}

#[derive(Clone, Copy, Debug)]
enum BandPattern {
    None,
    Own,
    Rayleigh(Rayleigh),
    Berry(Berry),
}

/// The sun as points over its disk, and as a disk.
#[derive(Clone, Debug, Default)]
pub(crate) struct SunPoints {
    pub(crate) sources: Sources,
    pub(crate) disk: Option<SunDisk>,
    /// Unit direction of the disk's center.
    pub(crate) center: DVec3,
    /// Radians.
    pub(crate) angular_radius: f64,
}

impl SceneLight {
    /// Light without sun or pattern.
    #[must_use]
    pub fn unpolarized(radiance: [Radiance; 3]) -> Self {
        Self { radiance, pattern: None, sun: None }
    }

    /// The three bands under a set of effects.
    pub(crate) fn bands(&self, effects: EffectSet) -> Result<[BandLight<'_>; 3], OpticsError> {
        let pattern = super::effects::neutral_points::pattern(self.pattern, effects);
        let pattern = match pattern {
            _ if !effects.contains(Effect::IncidentPolarization) => BandPattern::None,
            None => BandPattern::Own,
            Some(SkyPattern::Rayleigh { sun, max_dolp }) => BandPattern::Rayleigh(Rayleigh::new(sun, max_dolp)?),
            Some(SkyPattern::Berry { sun, splitting_deg, max_dolp }) => {
                BandPattern::Berry(Berry::new(sun, splitting_deg, max_dolp)?)
            }
        };
        let [r, g, b] = &self.radiance;
        Ok([r, g, b].map(|radiance| BandLight { radiance, pattern }))
    }

    /// Whether any light but the sun's disk may be polarized.
    #[must_use]
    pub fn polarized(&self) -> bool {
        self.bounds().max_dolp > 0.0
    }

    /// Whether the radiance is a smooth formula, for which quadrature with few points converges.
    #[must_use]
    pub fn smooth(&self) -> bool {
        self.radiance.iter().all(|r| !matches!(r, Radiance::Map(_)))
    }

    /// What is known in advance. One pass over the texels of a map.
    #[must_use]
    pub fn bounds(&self) -> LightBounds {
        let bands = self.radiance.each_ref().map(Radiance::bounds);
        let own = bands.iter().map(|b| b.1).fold(0.0, f64::max);
        let max_dolp = match self.pattern {
            None => own,
            Some(SkyPattern::Rayleigh { max_dolp, .. } | SkyPattern::Berry { max_dolp, .. }) => max_dolp,
        };
        LightBounds { range: bands.map(|b| b.0), max_dolp }
    }
}

impl Radiance {
    /// Whether it is a multiple of another: then whatever is relative to s0 is the same for both.
    pub(crate) fn proportional(&self, other: &Self) -> bool {
        let multiple =
            |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] * b[0] - a[0] * b[k]).abs() <= 1e-12 * a[0] * b[0]);
        match (self, other) {
            (Self::Uniform(_), Self::Uniform(_)) | (Self::Overcast(_), Self::Overcast(_)) => true,
            (Self::Clear(a), Self::Clear(b)) => {
                let shape = |c: &ClearSky| (c.width, c.sun);
                shape(a) == shape(b) && multiple([a.base, a.horizon, a.aureole], [b.base, b.horizon, b.aureole])
            }
            _ => false,
        }
    }

    /// Range over the upper hemisphere and largest DoLP of its own.
    fn bounds(&self) -> ([f64; 2], f64) {
        match self {
            Self::Uniform(u) => ([u.radiance; 2], 0.0),
            Self::Overcast(o) => ([o.zenith / 3.0, o.zenith], 0.0),
            Self::Clear(c) => ([c.base, c.base + c.horizon + c.aureole], 0.0),
            Self::Map(map) => {
                let (width, height) = map.size();
                // Bilinear look-ups of directions above the horizon reach half a row below it.
                let seen = map.pixels().iter().take(width * (height / 2 + 1));
                let mut range = [f64::INFINITY, 0.0_f64];
                let mut dolp = 0.0_f64;
                for [l, q, u] in seen.map(|p| p.map(f64::from)) {
                    range = [range[0].min(l), range[1].max(l)];
                    if l > 0.0 {
                        dolp = dolp.max(q.hypot(u) / l);
                    }
                }
                (range, dolp)
            }
        }
    }
}

impl BandLight<'_> {
    /// L alone.
    pub(crate) fn radiance(&self, direction: DVec3) -> f64 {
        match self.radiance {
            Radiance::Uniform(u) => u.radiance,
            Radiance::Overcast(l) => l.stokes(direction)[0],
            Radiance::Clear(l) => l.stokes(direction)[0],
            Radiance::Map(l) => l.stokes(direction)[0],
        }
    }

    /// The texels behind a map.
    pub(crate) fn map(&self) -> Option<&StokesMap> {
        if let Radiance::Map(map) = self.radiance { Some(map) } else { None }
    }

    /// The texel of a map of that size at a row and a column.
    pub(crate) fn texel(&self, row: usize, column: usize, width: usize, height: usize) -> Option<[f64; 3]> {
        let map = self.map().filter(|m| m.size() == (width, height))?;
        map.pixels().get(row * width + column).map(|p| p.map(f64::from))
    }

    /// Whether Q and U can differ from zero.
    pub(crate) fn polarized(&self) -> bool {
        match self.pattern {
            BandPattern::None => false,
            BandPattern::Own => self.map().is_some_and(|m| m.pixels().iter().any(|[_, q, u]| *q != 0.0 || *u != 0.0)),
            BandPattern::Rayleigh(_) | BandPattern::Berry(_) => true,
        }
    }

    /// (L, Q, U) given that the radiance there is known.
    pub(crate) fn with_radiance(&self, own: [f64; 3], direction: DVec3) -> [f64; 3] {
        let [l, ..] = own;
        let [q, u] = match self.pattern {
            BandPattern::None => return [l, 0.0, 0.0],
            BandPattern::Own => return own,
            BandPattern::Rayleigh(p) => p.fraction(direction),
            BandPattern::Berry(p) => p.fraction(direction),
        };
        [l, l * q, l * u]
    }
}

impl Light for BandLight<'_> {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        match self.radiance {
            Radiance::Map(map) => self.with_radiance(map.stokes(direction), direction),
            _ => self.with_radiance([self.radiance(direction), 0.0, 0.0], direction),
        }
    }
}

impl SunPoints {
    /// What a mirror sees of the sun, whose disk no mirror can do without.
    pub(crate) fn radiance_towards(&self, direction: DVec3) -> [f64; 3] {
        match self.disk {
            Some(disk) if disk.stokes(direction)[0] > 0.0 => self.sources.radiance,
            _ => [0.0; 3],
        }
    }
}

impl Sun {
    pub(crate) fn disk(&self) -> Result<SunDisk, OpticsError> {
        SunDisk::new(self.direction, self.angular_radius_rad, 1.0)
    }
}

/// The prefiltered sky of three bands: a map by its own texels, a formula sampled.
pub(crate) fn pyramid(bands: &[BandLight<'_>; 3]) -> Result<Pyramid, OpticsError> {
    let maps = || bands.iter().filter_map(BandLight::map).map(StokesMap::size);
    let larger = |[width, height]: [usize; 2], (w, h): (usize, usize)| [width.max(w), height.max(h)];
    let formula = bands.iter().any(|b| b.map().is_none());
    let [width, height] = maps().fold(if formula { Pyramid::FORMULA_SIZE } else { [0, 0] }, larger);
    Pyramid::new([width, height], |row, column, direction| {
        bands.each_ref().map(|b| {
            let texel = b.texel(row, column, width, height);
            texel.map_or_else(|| b.stokes(direction), |own| b.with_radiance(own, direction))
        })
    })
}
