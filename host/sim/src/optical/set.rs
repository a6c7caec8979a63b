//! The optical effects and sets of them.

/// An optical effect that a picture can be made with or without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum OpticalEffect {
    /// Light is polarized before it meets the surface.
    IncidentPolarization,
    /// Facets spread the reflection; else every pixel is a mirror.
    Roughness,
    /// Facets hide each other.
    Masking,
    /// Light enters the body and comes out again.
    Diffuse,
    /// It leaves through the interface partly polarized.
    DiffusePolarization,
    /// Metals shift phase between the polarizations.
    Retardance,
    /// Normals differ from the mean of their surface.
    NormalVariation,
    /// The sun has a disk; else all of it comes from its center.
    SunDisk,
    /// The sky's polarization has four neutral points; else two.
    NeutralPoints,
}

impl OpticalEffect {
    /// All of them, in the order in which a planner leaves them out: a bound of one may use that those before it are gone.
    pub const ALL: [Self; 9] = [
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

    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::IncidentPolarization => "incident polarization",
            Self::Roughness => "roughness",
            Self::Masking => "masking",
            Self::Diffuse => "diffuse",
            Self::DiffusePolarization => "diffuse polarization",
            Self::Retardance => "metal retardance",
            Self::NormalVariation => "normal variation",
            Self::SunDisk => "sun disk",
            Self::NeutralPoints => "neutral points",
        }
    }

    const fn bit(self) -> u16 {
        1 << self as u16
    }
}

/// A set of effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet(u16);

impl EffectSet {
    /// Everything.
    pub const ALL: Self = Self((1 << OpticalEffect::ALL.len()) - 1);

    /// Whether an effect is in it.
    #[must_use]
    pub const fn contains(self, effect: OpticalEffect) -> bool {
        self.0 & effect.bit() != 0
    }

    /// The set without an effect.
    #[must_use]
    pub const fn without(self, effect: OpticalEffect) -> Self {
        Self(self.0 & !effect.bit())
    }
}
