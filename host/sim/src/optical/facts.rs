//! What the effects' bounds may know of a scene before anything is simulated.

use super::bounds::{Body, Cells, Emitted, Fresnel, Interval, Lobe, Profile, Slice, Sums};
use super::{LightBounds, PixelMap, SceneLight, Surface, SurfaceExtent, Survey};
use super::{effects, numbers};
use crate::{Assessment, Effect, EffectSet};
use std::sync::OnceLock;

/// A scene's light, surfaces and where its views look.
#[derive(Clone, Debug)]
pub struct OpticalFacts<'a> {
    pub(crate) light: &'a SceneLight,
    pub(crate) bounds: LightBounds,
    profiles: [Profile; 3],
    pub(crate) surfaces: &'a [Surface],
    views: Vec<Survey>,
    /// Made when first asked for.
    enclosures: OnceLock<Vec<Option<Enclosure>>>,
}

/// Width of a slice of θ_o, radians.
const SLICE: f64 = 0.04;

/// Largest ratio of the brightest to the dimmest of the sky at which enclosures are tried.
const WIDEST_RANGE: f64 = 100.0;

/// Slices of a surface at most.
const MOST_SLICES: usize = 8;

/// What is known of all pixels of a surface whose θ_o is in a slice, in one band, under the sky alone.
#[derive(Clone, Debug)]
pub(crate) struct Enclosure {
    pub(crate) lobe: Sums,
    pub(crate) body: Emitted,
    /// s0 of a mirror, and its s1 in light without polarization.
    pub(crate) mirror: [Interval; 2],
    /// Normals differ from their mean by up to so many radians.
    pub(crate) moved: f64,
}

impl Enclosure {
    /// A change of this radiance, relative to s0.
    pub(crate) fn share(&self, change: f64) -> f64 {
        change / (self.lobe.least + self.body.least)
    }
}

/// Of a chord between unit vectors.
pub(crate) fn angle(chord: f64) -> f64 {
    2.0 * (0.5 * chord).min(1.0).asin()
}

/// Every bound is inflated by this against rounding in its proof.
pub(crate) const ROUNDING: f64 = 1.0 + 1e-6;

impl<'a> OpticalFacts<'a> {
    /// One pass over the light and one over each view.
    #[must_use]
    pub fn new(light: &'a SceneLight, surfaces: &'a [Surface], views: &[PixelMap<'_>]) -> Self {
        let views = views.iter().map(|view| Survey::new(view, surfaces.len())).collect();
        let profiles = light.radiance.each_ref().map(Profile::new);
        Self { light, bounds: light.bounds(), profiles, surfaces, views, enclosures: OnceLock::new() }
    }

    /// The views' surveys, in the order they were given.
    #[must_use]
    pub fn surveys(&self) -> &[Survey] {
        &self.views
    }

    /// What leaving `effect` out of `on` changes, as a share of the s0 that the picture has with it, pixel by pixel, worst of
    /// s0, s1 and s2. For [`Effect::NormalVariation`] it depends on what else is `on`; for the others it holds whatever
    /// else is. `None` for an effect of capture or sensor.
    #[must_use]
    pub fn assess(&self, effect: Effect, on: EffectSet) -> Option<Assessment> {
        Some(match effect {
            Effect::IncidentPolarization => effects::incident_polarization::assess(self),
            Effect::Roughness => effects::roughness::assess(self),
            Effect::Masking => effects::masking::assess(self),
            Effect::Diffuse => effects::diffuse::assess(self),
            Effect::DiffusePolarization => effects::diffuse_polarization::assess(self),
            Effect::Retardance => effects::retardance::assess(self),
            Effect::NormalVariation => effects::normal_variation::assess(self, on),
            Effect::SunDisk => effects::sun_disk::assess(self),
            Effect::NeutralPoints => effects::neutral_points::assess(self),
            _ => return None,
        })
    }

    /// Every surface some view shows.
    pub(crate) fn shown(&self) -> impl Iterator<Item = (&'a Surface, &SurfaceExtent)> {
        let pairs = self.views.iter().flat_map(|v| self.surfaces.iter().zip(&v.surfaces));
        pairs.filter(|(_, e)| e.pixels > 0)
    }

    /// The worst over surfaces that are not mirrors, their bands and slices of θ_o. Infinite where a slice has no enclosure.
    pub(crate) fn enclosed(&self, bound: impl Fn(&Enclosure) -> f64) -> f64 {
        let all = self.enclosures.get_or_init(|| self.enclosures());
        let each = all.iter().map(|e| e.as_ref().map_or(f64::INFINITY, &bound));
        each.fold(0.0, |worst, b| if b.is_nan() { f64::INFINITY } else { worst.max(b) }) * ROUNDING
    }

    fn enclosures(&self) -> Vec<Option<Enclosure>> {
        let mut out = Vec::new();
        for (surface, extent) in self.shown().filter(|(s, _)| !s.is_mirror()) {
            let cells = Cells::new(surface.ggx);
            let radius = angle(extent.normal_radius);
            let moved = if radius > 1e-6 { radius + 1e-6 } else { 0.0 };
            let tilt = extent.mean_normal.z.clamp(-1.0, 1.0).acos() + radius + 1e-6;
            let [low, high] = [extent.cosine[1], extent.cosine[0]].map(|c| c.clamp(-1.0, 1.0).acos());
            // f32 pixels: 1e-4 rad covers the rounding of a small angle's cosine.
            let (low, high) = ((low - 1e-4).max(0.0), high + 1e-4);
            let slices = numbers::count_above((high - low) / SLICE).min(MOST_SLICES);
            for k in self.different_bands(surface) {
                let fresnel = Fresnel::new(surface.ior[k]);
                let (light, dolp) = (&self.profiles[k], self.bounds.max_dolp);
                // Ranges this wide prove nothing; most maps with a sun in them are.
                let sky = light.range(Interval::new(0.0, core::f64::consts::FRAC_PI_2));
                if sky.high > WIDEST_RANGE * sky.low {
                    return vec![None];
                }
                let body = self.body(surface, extent, k, tilt);
                for slice in 0..slices {
                    let end = |j: usize| low + (high - low) * numbers::real(j) / numbers::real(slices);
                    let theta = [end(slice), end(slice + 1)];
                    let asked = Slice { theta, tilt, fresnel: &fresnel, light, dolp, moved };
                    let mirror = asked.mirror();
                    let body = body.map_or_else(Emitted::default, |b| b.emitted(theta, extent.albedo, moved));
                    out.push(cells.sum(&asked).map(|lobe| Enclosure { lobe, body, mirror, moved }));
                }
            }
        }
        out
    }

    /// Bands of which no other says the same.
    fn different_bands(&self, surface: &Surface) -> core::ops::Range<usize> {
        let [r, g, b] = &self.light.radiance;
        let gray = surface.ior[0] == surface.ior[1] && surface.ior[1] == surface.ior[2];
        if gray && r.proportional(g) && r.proportional(b) { 0..1 } else { 0..3 }
    }

    fn body(&self, surface: &Surface, extent: &SurfaceExtent, k: usize, tilt: f64) -> Option<Body> {
        let round = !matches!(self.light.radiance[k], super::Radiance::Clear(_) | super::Radiance::Map(_));
        let dolp = self.bounds.max_dolp;
        let interface = match (surface.body, surface.ior[k]) {
            (super::Body::Lambert, _) => None,
            (super::Body::Interface, host_optics::Ior::Dielectric(d)) => Some(d),
            (super::Body::Interface, host_optics::Ior::Conductor(_)) => return None,
        };
        (extent.albedo[1] > 0.0).then(|| Body::new(interface, &self.profiles[k], dolp, tilt, round))
    }

    /// The worst of every surface shown, with its lobe.
    pub(crate) fn worst(&self, bound: impl Fn(&Surface, &SurfaceExtent, &Lobe<'_>) -> f64) -> f64 {
        let each = self.shown().map(|(s, e)| bound(s, e, &Lobe::new(s, e, &self.bounds)));
        // A bound that is not a number is none.
        each.fold(0.0, |worst, b| if b.is_nan() { f64::INFINITY } else { worst.max(b) }) * ROUNDING
    }
}
