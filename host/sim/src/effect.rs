//! The effects between a scene and a camera's frames, and what is said of each before it is simulated.
//!
//! Two halves: optical effects decide which Stokes image the scene sends into the camera ([`crate::optical::OpticalFacts`]
//! assesses them), effects of capture and sensor what frames the camera makes of it ([`crate::Facts`] does).

/// Something that a simulation can be made with or without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Effect {
    /// The sky's polarization has four neutral points; else two.
    NeutralPoints,
    /// Light is polarized before it meets the surface.
    IncidentPolarization,
    /// Metals shift phase between the polarizations.
    Retardance,
    /// The sun has a disk; else all of it comes from its center.
    SunDisk,
    /// Facets hide each other.
    Masking,
    /// Facets spread the reflection; else every pixel is a mirror.
    Roughness,
    /// Normals differ from the mean of their surface.
    NormalVariation,
    /// The body's light leaves through the interface partly polarized.
    DiffusePolarization,
    /// Light enters the body and comes out again.
    Diffuse,
    /// The light changes while the wheel turns.
    LightDrift,
    /// The wheel rests beside where it was sent.
    WheelError,
    /// Play of the wheel.
    Backlash,
    /// The polarizer passes some of what it should stop.
    Extinction,
    /// A sheet polarizer's axis turns with the angle of a ray off the optical axis.
    SheetAxis,
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
    /// Most that any Stokes component changes when the effect is left out, relative to the s0 the pixel has with it; of capture
    /// and sensor for Stokes got from the frames with the commanded angles and an ideal polarizer. Over all pixels that count
    /// ([`crate::Facts`]), for the effect by itself: two together may add a term of second order. For noise it is exceeded at a
    /// photosite with a probability below 1e-6 per component.
    pub bound: f64,
    /// Estimated time to simulate it, per pixel (of each frame), on one core of the machine it was measured on (2-core x86-64
    /// virtual machine): good for comparing effects, not for promising times.
    pub cost_ns_per_pixel: f64,
    /// The numbers behind it, for people.
    pub reason: String,
}

/// Which effects are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet(u32);

impl Effect {
    /// Those between a scene and its noise-free Stokes image, in the order in which a planner leaves them out: a bound of one may
    /// use that those before it are gone.
    pub const OPTICAL: [Self; 9] = [
        Self::NeutralPoints,
        Self::IncidentPolarization,
        Self::Retardance,
        Self::SunDisk,
        Self::Masking,
        Self::Roughness,
        Self::NormalVariation,
        Self::DiffusePolarization,
        Self::Diffuse,
    ];

    /// Those between a Stokes image and frames, in the order the light meets them.
    pub const CAPTURE: [Self; 15] = [
        Self::LightDrift,
        Self::WheelError,
        Self::Backlash,
        Self::Extinction,
        Self::SheetAxis,
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
            Self::NeutralPoints => "neutral-points",
            Self::IncidentPolarization => "incident-polarization",
            Self::Retardance => "retardance",
            Self::SunDisk => "sun-disk",
            Self::Masking => "masking",
            Self::Roughness => "roughness",
            Self::NormalVariation => "normal-variation",
            Self::DiffusePolarization => "diffuse-polarization",
            Self::Diffuse => "diffuse",
            Self::LightDrift => "light-drift",
            Self::WheelError => "wheel-error",
            Self::Backlash => "backlash",
            Self::Extinction => "extinction",
            Self::SheetAxis => "sheet-axis",
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

    /// Every effect, of both halves.
    pub const ALL: Self = Self((1 << (Effect::OPTICAL.len() + Effect::CAPTURE.len())) - 1);

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
        let every = || Effect::OPTICAL.into_iter().chain(Effect::CAPTURE);
        for effect in every() {
            let alone = EffectSet::NONE.with(effect);
            assert_eq!(every().filter(|e| alone.contains(*e)).collect::<Vec<_>>(), [effect]);
            assert_eq!(alone.without(effect), EffectSet::NONE);
            assert_eq!(every().filter(|e| e.name() == effect.name()).count(), 1);
        }
        assert_eq!(every().fold(EffectSet::ALL, EffectSet::without), EffectSet::NONE);
        assert_eq!(every().fold(EffectSet::NONE, EffectSet::with), EffectSet::ALL);
    }
}
