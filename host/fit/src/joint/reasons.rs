//! Why a pixel's answer is not to be trusted, or not in every parameter.

use core::fmt;
use core::ops::{BitOr, BitOrAssign};

/// A set of reasons; empty is a sound answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Reasons(pub u32);

/// Bit, name, explanation.
const TABLE: [(Reasons, &str, &str); 17] = [
    (Reasons::BAD_INPUT, "bad input", "a Stokes value, covariance or direction is not a number or makes no sense"),
    (Reasons::TOO_DARK, "too dark", "no band of any view stands out of its noise"),
    (Reasons::CLIPPED, "clipped", "a band of a view has no answer: saturated, or lost otherwise"),
    (Reasons::ONE_VIEW, "one view only", "a single view leaves normal, index and roughness to chance"),
    (
        Reasons::VIEWS_TOO_PARALLEL,
        "views too parallel",
        "the views are too close to each other to tell parameters apart",
    ),
    (Reasons::TOO_FEW_DATA, "too few data", "fewer measurements than parameters"),
    (Reasons::NO_MIRRORED_LIGHT, "no light in mirror direction", "the specular part is lost in the noise"),
    (Reasons::ALBEDO, "albedo not identifiable", "sigma of the diffuse albedo is too large"),
    (Reasons::INDEX, "index not identifiable", "sigma of the index of refraction is too large"),
    (Reasons::ROUGHNESS, "roughness not identifiable", "sigma of alpha is too large, or a mirror fits as well"),
    (Reasons::NORMAL, "normal not identifiable", "sigma of the normal is too large"),
    (Reasons::SECOND_MINIMUM, "second minimum", "other parameters explain the data nearly as well"),
    (Reasons::AMBIGUOUS_AZIMUTH, "ambiguous azimuth", "a normal turned by about 90 or 180 degrees fits nearly as well"),
    (
        Reasons::OUTSIDE_MODEL,
        "outside the model",
        "chi-squared is too large: not planar, not a dielectric, not this light",
    ),
    (Reasons::NOT_CONVERGED, "did not converge", "the limit of iterations was reached"),
    (Reasons::AT_BOUND, "at bound", "a parameter lies at the end of its range"),
    (Reasons::NO_MODEL, "no model", "the forward model has no finite value at any start"),
];

impl Reasons {
    /// Nothing to say against it.
    pub const NONE: Self = Self(0);
    /// Input that is not finite or makes no sense; it was left out.
    pub const BAD_INPUT: Self = Self(1);
    /// No band stands out of its noise.
    pub const TOO_DARK: Self = Self(1 << 1);
    /// A band of a view is missing.
    pub const CLIPPED: Self = Self(1 << 2);
    /// One usable view.
    pub const ONE_VIEW: Self = Self(1 << 3);
    /// No two usable views are far enough apart.
    pub const VIEWS_TOO_PARALLEL: Self = Self(1 << 4);
    /// Fewer measurements than parameters.
    pub const TOO_FEW_DATA: Self = Self(1 << 5);
    /// The specular part is within its noise.
    pub const NO_MIRRORED_LIGHT: Self = Self(1 << 6);
    /// ρ_d is not identifiable.
    pub const ALBEDO: Self = Self(1 << 7);
    /// η is not identifiable.
    pub const INDEX: Self = Self(1 << 8);
    /// α is not identifiable.
    pub const ROUGHNESS: Self = Self(1 << 9);
    /// The normal is not identifiable.
    pub const NORMAL: Self = Self(1 << 10);
    /// Another minimum is nearly as good.
    pub const SECOND_MINIMUM: Self = Self(1 << 11);
    /// The other minimum has its normal turned by about 90° or 180° about a view.
    pub const AMBIGUOUS_AZIMUTH: Self = Self(1 << 12);
    /// χ² is too large.
    pub const OUTSIDE_MODEL: Self = Self(1 << 13);
    /// The limit of iterations was reached.
    pub const NOT_CONVERGED: Self = Self(1 << 14);
    /// A parameter is at a bound: ρ_d = 0, or an end of the ranges of η, α or slope.
    pub const AT_BOUND: Self = Self(1 << 15);
    /// No start had a finite χ².
    pub const NO_MODEL: Self = Self(1 << 16);

    /// Whether all of `other` are in it.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Name and explanation of each, in the order of the bits' meaning from input to result.
    pub fn explain(self) -> impl Iterator<Item = (&'static str, &'static str)> {
        TABLE.iter().filter(move |(bit, ..)| self.contains(*bit)).map(|(_, name, why)| (*name, *why))
    }

    /// `self` with `other` where `so`.
    pub(super) fn note(&mut self, other: Self, so: bool) {
        if so {
            *self |= other;
        }
    }
}

impl BitOr for Reasons {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Reasons {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl fmt::Display for Reasons {
    /// The names, separated by commas.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (name, _)) in self.explain().enumerate() {
            write!(f, "{}{name}", if k == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_has_one_name() {
        let mut all = Reasons::NONE;
        for (bit, name, why) in TABLE {
            assert!(bit.0.is_power_of_two() && !all.contains(bit) && !name.is_empty() && !why.is_empty());
            all |= bit;
        }
        assert_eq!(all.explain().count(), TABLE.len());
        assert_eq!((Reasons::CLIPPED | Reasons::TOO_DARK).to_string(), "too dark, clipped");
    }
}
