//! The effects between a perfect Stokes image and a camera's frames, and what is said of each before it is simulated.

use crate::Facts;
use crate::capture::{backlash, beam_shift, extinction, light_drift, psf, vignetting, wheel_error};
use crate::sensor::{bayer, dark, prnu, quantization, read, saturation, shot};

/// Something that makes a frame differ from ½ t (s0 + s1 cos 2φ + s2 sin 2φ).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Effect {
    /// The light changes while the wheel turns.
    LightDrift,
    /// The wheel rests beside where it was sent.
    WheelError,
    /// Play of the wheel.
    Backlash,
    /// The polarizer passes some of what it should stop.
    Extinction,
    /// The polarizer's wedge moves the picture about.
    BeamShift,
    /// The corners of the picture are darker.
    Vignetting,
    /// The lens blurs.
    Psf,
    /// Light comes in quanta.
    Shot,
    /// Noise of the amplifier.
    Read,
    /// Charge without light, and its noise.
    Dark,
    /// Photosites differ in sensitivity.
    Prnu,
    /// Samples are whole numbers.
    Quantization,
    /// Wells and converters have an end.
    Saturation,
    /// Each photosite sees one color.
    Bayer,
}

/// What is known of an effect before it is simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// Whether the scene has it at all.
    pub applies: bool,
    /// Most that any Stokes component, got from the frames with the commanded angles and an ideal polarizer, changes when the
    /// effect is left out, relative to s0 of its photosite. Over all photosites that count ([`Facts`]), for the effect by
    /// itself: two together may add a term of second order. For noise it is exceeded at a photosite with a probability below
    /// 1e-6 per component.
    pub bound: f64,
    /// Time to simulate it, per pixel of each frame, on one core of the machine it was measured on (2-core x86-64 virtual
    /// machine): good for comparing effects, not for promising times.
    pub cost_ns_per_pixel: f64,
    /// The numbers behind it, for people.
    pub reason: String,
}

/// Which effects are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet(u32);

impl Effect {
    /// All of them, in the order the light meets them.
    pub const ALL: [Self; 14] = [
        Self::LightDrift,
        Self::WheelError,
        Self::Backlash,
        Self::Extinction,
        Self::BeamShift,
        Self::Vignetting,
        Self::Psf,
        Self::Bayer,
        Self::Prnu,
        Self::Shot,
        Self::Dark,
        Self::Saturation,
        Self::Read,
        Self::Quantization,
    ];

    /// Its name on the command line and in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LightDrift => "light-drift",
            Self::WheelError => "wheel-error",
            Self::Backlash => "backlash",
            Self::Extinction => "extinction",
            Self::BeamShift => "beam-shift",
            Self::Vignetting => "vignetting",
            Self::Psf => "psf",
            Self::Shot => "shot",
            Self::Read => "read",
            Self::Dark => "dark",
            Self::Prnu => "prnu",
            Self::Quantization => "quantization",
            Self::Saturation => "saturation",
            Self::Bayer => "bayer",
        }
    }

    /// What leaving it out would change. The proof of each bound stands with the effect's own file.
    #[must_use]
    pub fn assess(self, facts: &Facts<'_>) -> Assessment {
        match self {
            Self::LightDrift => light_drift::assess(facts),
            Self::WheelError => wheel_error::assess(facts),
            Self::Backlash => backlash::assess(facts),
            Self::Extinction => extinction::assess(facts),
            Self::BeamShift => beam_shift::assess(facts),
            Self::Vignetting => vignetting::assess(facts),
            Self::Psf => psf::assess(facts),
            Self::Shot => shot::assess(facts),
            Self::Read => read::assess(facts),
            Self::Dark => dark::assess(facts),
            Self::Prnu => prnu::assess(facts),
            Self::Quantization => quantization::assess(facts),
            Self::Saturation => saturation::assess(facts),
            Self::Bayer => bayer::assess(facts),
        }
    }
}

impl Assessment {
    /// Of an effect whose bound says by itself whether there is one.
    pub(crate) fn new(bound: f64, cost_ns_per_pixel: f64, reason: String) -> Self {
        Self { applies: bound > 0.0, bound, cost_ns_per_pixel, reason }
    }
}

impl EffectSet {
    /// None.
    pub const NONE: Self = Self(0);

    /// Every effect.
    #[must_use]
    pub fn all() -> Self {
        Effect::ALL.into_iter().fold(Self::NONE, Self::with)
    }

    /// With `effect` as well.
    #[must_use]
    pub const fn with(self, effect: Effect) -> Self {
        Self(self.0 | 1 << effect as u32)
    }

    /// Without `effect`.
    #[must_use]
    pub const fn without(self, effect: Effect) -> Self {
        Self(self.0 & !(1 << effect as u32))
    }

    /// Whether `effect` is one of them.
    #[must_use]
    pub const fn contains(self, effect: Effect) -> bool {
        self.0 & 1 << effect as u32 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_has_its_own_place_and_name() {
        for effect in Effect::ALL {
            let alone = EffectSet::NONE.with(effect);
            assert_eq!(Effect::ALL.iter().filter(|e| alone.contains(**e)).collect::<Vec<_>>(), [&effect]);
            assert_eq!(alone.without(effect), EffectSet::NONE);
            assert_eq!(Effect::ALL.iter().filter(|e| e.name() == effect.name()).count(), 1);
        }
        assert!(Effect::ALL.into_iter().all(|e| EffectSet::all().contains(e)));
    }
}
