//! The diffuse part of a view: irradiance tabulated over normals, and what leaves towards the camera tabulated over n·ω_o.

use super::chart::{Extent, Field};
use super::effects::{diffuse_polarization, normal_variation};
use super::light::SunPoints;
use super::numbers::single;
use super::survey::Pixels;
use super::{Body, Surface};
use crate::{Effect, EffectSet};
use core::f32::consts::FRAC_1_PI;
use glam::{DVec3, Vec3};
use host_optics::Ior;
use host_optics::prefilter::{Pyramid, irradiance};

/// Step of the grid over normals, radians: irradiance changes no faster than a cosine but at its own terminator.
const NORMAL_STEP: f64 = 0.12;

/// The diffuse part of one surface in one view.
#[derive(Debug)]
pub(crate) enum Diffuse {
    None,
    Lambert(Irradiance),
    Interface(Irradiance, Emission),
}

#[derive(Debug)]
pub(crate) enum Irradiance {
    Constant([f32; 4]),
    Field(Field<4>),
}

/// Unpolarized part and polarized part per sin² θ of what leaves the interface, against cos θ_o; linear between nodes.
#[derive(Debug)]
pub(crate) struct Emission {
    nodes: Vec<[f32; 8]>,
}

impl Diffuse {
    pub(crate) fn plan(
        pixels: &Pixels<'_>,
        surface: &Surface,
        sky: Option<&Pyramid>,
        sun: &SunPoints,
        effects: EffectSet,
    ) -> Self {
        let Some(sky) = sky.filter(|_| effects.contains(Effect::Diffuse) && pixels.extent.albedo[1] > 0.0) else {
            return Self::None;
        };
        let dielectrics = surface.ior.map(|ior| if let Ior::Dielectric(d) = ior { Some(d) } else { None });
        let body = match (surface.body, dielectrics) {
            (Body::Interface, [Some(r), Some(g), Some(b)]) => Some([r, g, b]),
            (Body::Interface, _) => return Self::None,
            (Body::Lambert, _) => None,
        };
        let value = |normal: DVec3| {
            let [r, g, b] = irradiance(sky, &sun.sources, body, normal).map(single);
            [r, g, b, 0.0]
        };
        let flat = !effects.contains(Effect::NormalVariation) || pixels.extent.normal_radius < 1e-6;
        let irradiance = if flat {
            Irradiance::Constant(value(normal_variation::mean(pixels.extent)))
        } else {
            let half = single(1.05 * pixels.extent.normal_radius);
            let extent = Extent { low: [-half; 2], high: [half; 2] };
            Irradiance::Field(Field::build(pixels.extent.normal_chart, &extent, NORMAL_STEP, value))
        };
        match body {
            None => Self::Lambert(irradiance),
            Some(body) => Self::Interface(irradiance, Emission::new(body)),
        }
    }

    /// Adds this part to nine numbers (band-major s0, s1, s2).
    #[inline]
    pub(crate) fn add<const POLARIZED: bool>(
        &self,
        out: &mut [f32],
        normal: Vec3,
        wo: Vec3,
        camera_x: Vec3,
        albedo: [f32; 3],
    ) {
        match self {
            Self::None => {}
            Self::Lambert(irradiance) => {
                let e = irradiance.at(normal);
                for k in 0..3 {
                    out[3 * k] += FRAC_1_PI * albedo[k] * e[k];
                }
            }
            Self::Interface(irradiance, emission) => {
                let e = irradiance.at(normal);
                let t = emission.at(normal.dot(wo));
                let [c, s] = if POLARIZED { diffuse_polarization::double_axis(normal, wo, camera_x) } else { [0.0; 2] };
                for k in 0..3 {
                    let scale = FRAC_1_PI * albedo[k] * e[k];
                    out[3 * k] += scale * t[k];
                    if POLARIZED {
                        out[3 * k + 1] += scale * t[k + 4] * c;
                        out[3 * k + 2] += scale * t[k + 4] * s;
                    }
                }
            }
        }
    }
}

impl Irradiance {
    fn at(&self, normal: Vec3) -> [f32; 4] {
        match self {
            Self::Constant(e) => *e,
            Self::Field(field) => field.at(normal),
        }
    }
}

impl Emission {
    const CELLS: u16 = 1024;

    fn new(body: [host_optics::Dielectric; 3]) -> Self {
        let node = |k: u16| {
            let at = diffuse_polarization::transmission(body, f64::from(k) / f64::from(Self::CELLS));
            let mut out = [0.0; 8];
            for (k, [mean, half]) in at.into_iter().enumerate() {
                out[k] = single(mean);
                out[k + 4] = single(half);
            }
            out
        };
        Self { nodes: (0..=Self::CELLS).map(node).collect() }
    }

    fn at(&self, cosine: f32) -> [f32; 8] {
        let (k, t) = super::numbers::cell(cosine * f32::from(Self::CELLS), usize::from(Self::CELLS) - 1);
        let (a, b) = (&self.nodes[k], &self.nodes[k + 1]);
        core::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
    }
}
