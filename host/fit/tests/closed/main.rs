//! The closed forms against host_optics: mirror facets are met exactly, bias and uncertainty are what they are said to be.
#![expect(clippy::unwrap_used, reason = "inputs are inside the model by construction")]

mod hard;
mod image;
mod mirror;
mod spread;

use glam::DVec3;
use host_fit::closed::SkyTable;
use host_fit::material::Observation;
use host_optics::integral::{self, FixedPoints, View};
use host_optics::sky::{ClearSky, Polarized, Rayleigh, Uniform};
use host_optics::{Ior, Light};

/// A camera's x axis for a view along `direction`: level with the horizon.
pub(crate) fn level(direction: DVec3) -> DVec3 {
    DVec3::new(-direction.y, direction.x, 0.0).normalize()
}

/// ω_o at angles from the zenith and azimuth, degrees.
pub(crate) fn towards(theta: f64, azimuth: f64) -> DVec3 {
    let ((s, c), (sp, cp)) = (theta.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
    DVec3::new(s * cp, s * sp, c)
}

/// What views see of a facet under three lights: `stokes(view)` of a band.
pub(crate) fn observed(
    directions: &[DVec3],
    stokes: impl Fn(usize, &View) -> [f64; 3],
) -> (Vec<Observation>, Vec<DVec3>) {
    let axes: Vec<DVec3> = directions.iter().map(|w| level(*w)).collect();
    let observations = directions.iter().zip(&axes).enumerate().map(|(number, (direction, axis))| {
        let view = View::new(*direction, *axis).unwrap();
        Observation {
            view: number,
            direction: *direction,
            stokes: [0, 1, 2].map(|b| stokes(b, &view).map(single)),
            covariance: [[1e-12, 0.0, 0.0, 1e-12, 0.0, 1e-12]; 3],
        }
    });
    (observations.collect(), axes)
}

/// A mirror facet on Lambert's ground.
pub(crate) fn facet(light: &impl Light, eta: f64, normal: DVec3, albedo: f64, view: &View) -> [f64; 3] {
    let [l, q, u] = integral::mirror(light, Ior::new(eta, 0.0).unwrap(), normal, view);
    let [d, ..] = integral::lambert(albedo, FixedPoints::new(24).irradiance(light, normal));
    [l + d, q, u]
}

pub(crate) const WHITE: Uniform = Uniform { radiance: 1.0 };

/// A clear sky with the sun well up, three bands.
pub(crate) fn clear(dolp: f64) -> [Polarized<ClearSky, Rayleigh>; 3] {
    let sun = DVec3::new(0.5, 0.6, 0.6).normalize();
    [1.0, 0.9, 1.2].map(|base| Polarized {
        light: ClearSky { base, horizon: 0.5, aureole: 0.5, width: 0.5, sun },
        pattern: Rayleigh::new(sun, dolp).unwrap(),
    })
}

pub(crate) fn table<L: Light>(lights: &[L; 3]) -> SkyTable {
    let rule = FixedPoints::new(24);
    SkyTable::sample(
        |w| lights.each_ref().map(|light| light.stokes(w)),
        |n| lights.each_ref().map(|light| rule.irradiance(light, n)),
        256,
    )
}

#[expect(clippy::cast_possible_truncation, reason = "images are f32")]
pub(crate) fn single(x: f64) -> f32 {
    x as f32
}

/// Standard normal numbers, always the same.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn uniform(&mut self) -> f64 {
        // splitmix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        f64::from(u32::try_from((z ^ (z >> 31)) >> 32).unwrap()) / f64::from(u32::MAX)
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().max(1e-12).ln()).sqrt();
        radius * (core::f64::consts::TAU * self.uniform()).cos()
    }
}
