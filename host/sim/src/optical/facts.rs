//! What the effects' bounds may know of a scene before anything is simulated.

use super::bounds::Lobe;
use super::effects;
use super::{EffectSet, LightBounds, OpticalEffect, PixelMap, SceneLight, Surface, SurfaceExtent, Survey};
use crate::Assessment;

/// A scene's light, surfaces and where its views look.
#[derive(Clone, Debug)]
pub struct OpticalFacts<'a> {
    pub(crate) light: &'a SceneLight,
    pub(crate) bounds: LightBounds,
    pub(crate) surfaces: &'a [Surface],
    views: Vec<Survey>,
}

/// Every bound is inflated by this against rounding in its proof.
pub(crate) const ROUNDING: f64 = 1.0 + 1e-6;

impl<'a> OpticalFacts<'a> {
    /// One pass over the light and one over each view.
    #[must_use]
    pub fn new(light: &'a SceneLight, surfaces: &'a [Surface], views: &[PixelMap<'_>]) -> Self {
        let views = views.iter().map(|view| Survey::new(view, surfaces.len())).collect();
        Self { light, bounds: light.bounds(), surfaces, views }
    }

    /// The views' surveys, in the order they were given.
    #[must_use]
    pub fn surveys(&self) -> &[Survey] {
        &self.views
    }

    /// What leaving `effect` out of `on` changes, as a share of the s0 that the picture has with it, pixel by pixel, worst of
    /// s0, s1 and s2. For [`OpticalEffect::NormalVariation`] it depends on what else is `on`; for the others it holds whatever
    /// else is.
    #[must_use]
    pub fn assess(&self, effect: OpticalEffect, on: EffectSet) -> Assessment {
        match effect {
            OpticalEffect::IncidentPolarization => effects::incident_polarization::assess(self),
            OpticalEffect::Roughness => effects::roughness::assess(self),
            OpticalEffect::Masking => effects::masking::assess(self),
            OpticalEffect::Diffuse => effects::diffuse::assess(self),
            OpticalEffect::DiffusePolarization => effects::diffuse_polarization::assess(self),
            OpticalEffect::Retardance => effects::retardance::assess(self),
            OpticalEffect::NormalVariation => effects::normal_variation::assess(self, on),
            OpticalEffect::SunDisk => effects::sun_disk::assess(self),
            OpticalEffect::NeutralPoints => effects::neutral_points::assess(self),
        }
    }

    /// Every surface some view shows.
    pub(crate) fn shown(&self) -> impl Iterator<Item = (&'a Surface, &SurfaceExtent)> {
        let pairs = self.views.iter().flat_map(|v| self.surfaces.iter().zip(&v.surfaces));
        pairs.filter(|(_, e)| e.pixels > 0)
    }

    /// The worst of every surface shown, with its lobe.
    pub(crate) fn worst(&self, bound: impl Fn(&Surface, &SurfaceExtent, &Lobe<'_>) -> f64) -> f64 {
        let each = self.shown().map(|(s, e)| bound(s, e, &Lobe::new(s, e, &self.bounds)));
        // A bound that is not a number is none.
        each.fold(0.0, |worst, b| if b.is_nan() { f64::INFINITY } else { worst.max(b) }) * ROUNDING
    }
}
