//! What one frame behind the wheel measures: the analyzer row.

use crate::Radians;

/// Most frames one capture may have. Repeated angles are frames of their own.
pub const MAX_FRAMES: usize = 16;

/// The polarizer as one frame saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Analyzer {
    /// Transmission axis in the camera frame (x right, y up, counter-clockwise).
    pub angle: Radians,
    /// Relative throughput t > 0: exposure × transmission, against a reference frame of 1.
    pub throughput: f64,
    /// Efficiency ε in (0, 1]; 1 is an ideal polarizer. See [`efficiency_from_extinction_ratio`].
    pub efficiency: f64,
}

impl Analyzer {
    /// An ideal polarizer at `angle` with throughput 1.
    #[must_use]
    pub const fn ideal(angle: Radians) -> Self {
        Self { angle, throughput: 1.0, efficiency: 1.0 }
    }

    /// ½ t [1, ε cos 2φ, ε sin 2φ]: its product with (s0, s1, s2) is the signal of the frame (paper eq. 4, first row).
    #[must_use]
    pub fn row(&self) -> [f64; 3] {
        let (c, s) = self.angle.cos_sin_double();
        let h = 0.5 * self.throughput;
        [h, h * self.efficiency * c, h * self.efficiency * s]
    }
}

/// Efficiency (ER − 1)/(ER + 1) of a polarizer with extinction ratio ER = k₁/k₂ >= 1; infinite ER is 1.
#[must_use]
pub fn efficiency_from_extinction_ratio(extinction_ratio: f64) -> f64 {
    if extinction_ratio.is_infinite() { 1.0 } else { (extinction_ratio - 1.0) / (extinction_ratio + 1.0) }
}

/// Extinction ratio (1 + ε)/(1 − ε) of a polarizer with efficiency ε in [0, 1]; infinite at ε = 1.
#[must_use]
pub fn extinction_ratio_from_efficiency(efficiency: f64) -> f64 {
    (1.0 + efficiency) / (1.0 - efficiency)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mueller, Stokes};

    #[test]
    fn row_is_the_first_row_of_the_mueller_matrix() {
        let a = Analyzer { angle: Radians(0.7), throughput: 1.0, efficiency: 0.93 };
        let m = Mueller::linear_polarizer(a.angle, a.efficiency);
        for (x, y) in a.row().iter().zip(m.0[0]) {
            assert!((x - y).abs() < 1e-16);
        }
        let s = Stokes::linear(2.0, 0.4, Radians(0.2));
        let by_row: f64 = a.row().iter().zip(s.0).map(|(r, x)| r * x).sum();
        assert!((by_row - m.apply(s).0[0]).abs() < 1e-15);
    }

    #[test]
    fn extinction_ratio_round_trips() {
        for er in [1.0, 9.0, 1e3, 1e5] {
            let back = extinction_ratio_from_efficiency(efficiency_from_extinction_ratio(er));
            assert!((back / er - 1.0).abs() < 1e-10, "{er} -> {back}");
        }
        assert!(extinction_ratio_from_efficiency(efficiency_from_extinction_ratio(f64::INFINITY)).is_infinite());
    }
}
