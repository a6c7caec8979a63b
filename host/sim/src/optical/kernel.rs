//! The specular part of eq. 6 for three bands at one normal and one view: the geometry of a direction is shared by the
//! bands, the Fresnel terms too where their indices agree.

use super::effects::{masking, retardance};
use super::light::{BandLight, SunPoints};
use super::prefilter::Pyramid;
use super::{EffectSet, OpticalEffect, Surface};
use glam::DVec3;
use host_optics::integral::View;
use host_optics::{Frame, Incidence, Ior};
use protocol_polar::Reflectance;

/// [band][s0, s1, s2].
pub(crate) type Rgb = [[f64; 3]; 3];

/// A surface as the effects leave it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facets {
    ior: [Ior; 3],
    gray: bool,
    alpha: f64,
    masking: masking::Kind,
    retardance: bool,
}

/// How fine a sum over the pyramid is: a cell is used when its radius is below this share of the lobe's width there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fineness(pub(crate) f64);

impl Facets {
    pub(crate) fn new(surface: &Surface, effects: EffectSet) -> Self {
        let [r, g, b] = surface.ior;
        Self {
            ior: surface.ior,
            gray: r == g && g == b,
            alpha: surface.ggx.alpha(),
            masking: masking::kind(surface.ggx.masking(), effects),
            retardance: effects.contains(OpticalEffect::Retardance),
        }
    }

    fn reflectance(&self, at: Incidence) -> [Reflectance; 3] {
        let one = |ior: Ior| {
            let r = ior.reflectance(at);
            if self.retardance || matches!(ior, Ior::Dielectric(_)) { r } else { retardance::left_out(r) }
        };
        let [r, g, b] = self.ior;
        if self.gray { [one(r); 3] } else { [one(r), one(g), one(b)] }
    }

    /// The limit α → 0 (paper eq. 8) at a pixel.
    pub(crate) fn mirror<const POLARIZED: bool>(
        &self,
        light: &[BandLight<'_>; 3],
        sun: &SunPoints,
        normal: DVec3,
        view: &View,
    ) -> Rgb {
        let wo = view.direction;
        let cosine = normal.dot(wo);
        let wi = normal * (2.0 * cosine) - wo;
        if cosine <= 0.0 || wi.z <= 0.0 {
            return [[0.0; 3]; 3];
        }
        let reflectance = self.reflectance(Incidence::between(normal, wo));
        let across = normal.cross(wo);
        let mut out = [[0.0; 3]; 3];
        let disk = sun.radiance_towards(wi);
        if POLARIZED {
            let turns = Turns::new(across, &Frame::sky(wi), &view.frame);
            for (k, (s, r)) in out.iter_mut().zip(&reflectance).enumerate() {
                let [l, q, u] = host_optics::Light::stokes(&light[k], wi);
                *s = turns.apply(r, [l + disk[k], q, u]);
            }
        } else {
            let turns = Turns::outgoing(across, &view.frame);
            for (k, (s, r)) in out.iter_mut().zip(&reflectance).enumerate() {
                *s = turns.apply_unpolarized(r, light[k].radiance(wi) + disk[k]);
            }
        }
        out
    }

    /// The rough lobe against the prefiltered sky.
    pub(crate) fn prefiltered<const POLARIZED: bool>(
        &self,
        sky: &Pyramid,
        fineness: Fineness,
        normal: DVec3,
        view: &View,
    ) -> Rgb {
        let mut out = [[0.0; 3]; 3];
        let wo = view.direction;
        let o = Incidence::between(normal, wo);
        if o.cosine <= 0.0 {
            return out;
        }
        sky.walk(|found| {
            let wi = found.cell.direction.as_dvec3();
            let radius = f64::from(found.cell.radius);
            let lobe = Lobe::at(self, wi, wo, normal);
            // In front of the lobe, at its own width; far from it as far as it is; never coarser than the horizon's cosine.
            if radius > fineness.0 * lobe.width.min(MAX_CELL) {
                return lobe.cosine < -radius;
            }
            if lobe.cosine <= 0.0 {
                return true;
            }
            let weight = lobe.weight(self, o);
            let across = wi.cross(wo);
            let reflectance = self.reflectance(lobe.incidence);
            let power = found.cell.power.map(|p| weight * f64::from(p));
            if POLARIZED {
                let turns = Turns::new(across, &Frame::sky(wi), &view.frame);
                for (k, (s, r)) in out.iter_mut().zip(&reflectance).enumerate() {
                    let [q, u] = found.polarization[k].map(f64::from);
                    add(s, turns.apply(r, [power[k], weight * q, weight * u]));
                }
            } else {
                let turns = Turns::outgoing(across, &view.frame);
                for ((s, r), p) in out.iter_mut().zip(&reflectance).zip(power) {
                    add(s, turns.apply_unpolarized(r, p));
                }
            }
            true
        });
        out
    }

    /// The rough lobe against the points of the sun, which is unpolarized.
    pub(crate) fn sun(&self, sun: &SunPoints, normal: DVec3, view: &View) -> Rgb {
        let mut out = [[0.0; 3]; 3];
        let wo = view.direction;
        let o = Incidence::between(normal, wo);
        for (wi, solid_angle) in &sun.points {
            let lobe = Lobe::at(self, *wi, wo, normal);
            if o.cosine <= 0.0 || lobe.cosine <= 0.0 || wi.z <= 0.0 {
                continue;
            }
            let weight = lobe.weight(self, o) * solid_angle;
            let turns = Turns::outgoing(wi.cross(wo), &view.frame);
            let reflectance = self.reflectance(lobe.incidence);
            for ((s, r), radiance) in out.iter_mut().zip(&reflectance).zip(sun.radiance) {
                add(s, turns.apply_unpolarized(r, weight * radiance));
            }
        }
        out
    }
}

/// Largest cell of the sky, in units of [`Fineness`]: what Fresnel terms and cosines change over.
const MAX_CELL: f64 = 1.0;

/// Geometry of one direction of light.
struct Lobe {
    incidence: Incidence,
    half: Incidence,
    light: Incidence,
    cosine: f64,
    /// Scale on which the distribution changes with ω_i: 2 cos θ_d √(α²c_h² + s_h²), radians.
    width: f64,
}

impl Lobe {
    fn at(facets: &Facets, wi: DVec3, wo: DVec3, normal: DVec3) -> Self {
        let sum = wi + wo;
        let length = sum.length().max(1e-12);
        let half = Incidence::between(normal, sum / length);
        let incidence = Incidence { cosine: 0.5 * length, sine_squared: 0.25 * (wi - wo).length_squared() };
        let spread = (facets.alpha * half.cosine).powi(2) + half.sine_squared;
        let light = Incidence::between(normal, wi);
        Self { incidence, half, light, cosine: light.cosine, width: length * spread.sqrt() }
    }

    /// f_r (n·ω_i) without Fresnel.
    fn weight(&self, facets: &Facets, o: Incidence) -> f64 {
        if self.half.cosine <= 0.0 {
            return 0.0;
        }
        let a2 = facets.alpha * facets.alpha;
        let spread = a2 * self.half.cosine * self.half.cosine + self.half.sine_squared;
        let d = core::f64::consts::FRAC_1_PI * a2 / (spread * spread);
        d * self.light.cosine * facets.masking.visibility(facets.alpha, self.light, o)
    }
}

/// cos and sin of twice the angles of the s axis, in the incident frame and in the camera's.
struct Turns {
    into: [f64; 2],
    out: [f64; 2],
}

impl Turns {
    fn new(across: DVec3, incident: &Frame, outgoing: &Frame) -> Self {
        Self { into: double_angle(across, incident), out: double_angle(across, outgoing) }
    }

    fn outgoing(across: DVec3, outgoing: &Frame) -> Self {
        Self { into: [1.0, 0.0], out: double_angle(across, outgoing) }
    }

    /// M_rot(φ) M_ref M_rot(−ψ) on (L, Q, U).
    fn apply(&self, r: &Reflectance, [l, q, u]: [f64; 3]) -> [f64; 3] {
        let (mean, half) = (0.5 * (r.perpendicular + r.parallel), 0.5 * (r.perpendicular - r.parallel));
        let [c, s] = self.into;
        let (along, diagonal) = (c * q + s * u, c * u - s * q);
        let (s1, s2) = (half * l + mean * along, r.rr_cos_delta * diagonal);
        let [c, s] = self.out;
        [mean * l + half * along, c * s1 - s * s2, s * s1 + c * s2]
    }

    fn apply_unpolarized(&self, r: &Reflectance, l: f64) -> [f64; 3] {
        let half = 0.5 * (r.perpendicular - r.parallel) * l;
        [0.5 * (r.perpendicular + r.parallel) * l, half * self.out[0], half * self.out[1]]
    }
}

/// (cos 2α, sin 2α) of a vector across the beam. Of the zero vector, at retro-reflection, any axis serves.
fn double_angle(axis: DVec3, frame: &Frame) -> [f64; 2] {
    let (a, b) = (axis.dot(frame.x), axis.dot(frame.y));
    let square = a * a + b * b;
    if square < 1e-30 { [1.0, 0.0] } else { [(a - b) * (a + b) / square, 2.0 * a * b / square] }
}

fn add(sum: &mut [f64; 3], more: [f64; 3]) {
    for (s, m) in sum.iter_mut().zip(more) {
        *s += m;
    }
}
