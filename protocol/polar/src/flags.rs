//! One byte per photosite: what happened to its samples.

/// Flag byte of one photosite. Several may be set; 0 is a photosite with nothing to report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u8);

impl Flags {
    /// At least one sample was saturated and left out; the others were used.
    pub const SATURATED: Self = Self(1 << 0);
    /// At least one used sample lay below the black level (it was kept, with its sign).
    pub const BELOW_BLACK: Self = Self(1 << 1);
    /// Too few valid samples for three Stokes components: the planes hold 0 there.
    pub const TOO_FEW: Self = Self(1 << 2);
    /// The samples do not follow the Stokes model within the noise (motion, a slipping wheel, changing light).
    pub const MISFIT: Self = Self(1 << 3);
    /// A Stokes component did not fit its word and was clamped.
    pub const OUT_OF_RANGE: Self = Self(1 << 4);

    /// Every flag with the word people read, in bit order.
    pub const NAMES: [(Self, &'static str); 5] = [
        (Self::SATURATED, "saturated"),
        (Self::BELOW_BLACK, "below black"),
        (Self::TOO_FEW, "too few samples"),
        (Self::MISFIT, "misfit"),
        (Self::OUT_OF_RANGE, "out of range"),
    ];

    /// Whether all of `other`'s flags are set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Both sets of flags.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
