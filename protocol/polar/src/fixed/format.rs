//! Words and binary points of the Stokes planes.

/// The integer a Stokes component is stored in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Word {
    /// 16 bits: half the bytes; the sensor may have up to 14 bits.
    I16,
    /// 32 bits: rounding far below any noise, for 8- to 16-bit sensors.
    I32,
}

/// Q format of a plane: value in DN = integer × 2^−`frac_bits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaneFormat {
    /// Storage word.
    pub word: Word,
    /// Number of fractional bits F.
    pub frac_bits: u8,
}

impl PlaneFormat {
    /// The format for signals of up to `bits` bits: one bit more for the sign, one because s0 is a sum of two orthogonal
    /// powers, the rest below the binary point (12 bits: Q13.2 in i16, Q15.16 in i32). `None` where it does not fit.
    ///
    /// `bits` is the sensor's bit depth; frames of lower throughput than the reference add what the brightest light they
    /// can hold is above it (a quarter of the exposure: two bits).
    #[must_use]
    pub const fn for_bits(word: Word, bits: u8) -> Option<Self> {
        match (word, bits) {
            (Word::I16, 8..=14) => Some(Self { word, frac_bits: 14 - bits }),
            (Word::I32, 8..=28) => Some(Self { word, frac_bits: 28 - bits }),
            _ => None,
        }
    }

    /// One unit in the last place, in DN.
    #[must_use]
    pub fn lsb_dn(self) -> f64 {
        libm::ldexp(1.0, -i32::from(self.frac_bits))
    }

    /// Smallest and largest storable integer.
    #[must_use]
    pub const fn limits(self) -> (i32, i32) {
        match self.word {
            Word::I16 => (i16::MIN as i32, i16::MAX as i32),
            Word::I32 => (i32::MIN, i32::MAX),
        }
    }

    /// Largest storable residual (the residual is unsigned, of the same width).
    #[must_use]
    pub const fn residual_limit(self) -> u32 {
        match self.word {
            Word::I16 => u16::MAX as u32,
            Word::I32 => u32::MAX,
        }
    }

    /// Bytes of one value.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self.word {
            Word::I16 => 2,
            Word::I32 => 4,
        }
    }
}

/// Flat-field gain of one photosite, unsigned Q1.15: 32768 is 1.0, the largest is just under 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GainQ15(pub u16);

impl GainQ15 {
    /// Gain 1: the photosite is left as it is.
    pub const ONE: Self = Self(1 << 15);

    /// The nearest representable gain; clamps to [0, 65535/32768], NaN gives 1.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the word just before")]
    pub fn saturating_from(gain: f64) -> Self {
        if gain.is_nan() {
            return Self::ONE;
        }
        Self(libm::rint((gain * 32768.0).clamp(0.0, 65535.0)) as u16)
    }

    /// The gain as a number.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / 32768.0
    }
}
