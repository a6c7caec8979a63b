//! The index of refraction as a coordinate of a table: values at a few indices, and how to combine them for any other.
//!
//! The response is a weighted mean of Fresnel terms over angles of incidence, linear in them. So if
//! R(η, θ) = Σ_j C_j(η) R(η_j, θ) holds for (R⊥ + R∥)/2, (R⊥ − R∥)/2 and √(R⊥R∥) cos δ at every θ within ε of the mean
//! reflectance, it holds for every response within ε of s0, whatever the lobe and the light. C_j(η) are least squares over
//! angles to 85°. Worst ε over η in [1.3, 1.8]: three indices 4e-3, four 2e-4; in [1.2, 2.2]: four 3e-3, five 4e-4.

use super::numbers::{nearest, real, single};
use host_optics::{Dielectric, Incidence, OpticsError};
use protocol_polar::Radians;

/// Most nodes.
pub(super) const MOST: usize = 6;
/// Cells of the table of C_j.
const CELLS: usize = 128;
/// Angles of the fit, up to 85°.
const ANGLES: usize = 48;

/// Values or slopes of C_j.
pub(super) type Weights = [f32; MOST];

#[derive(Clone, Debug)]
pub(super) struct IndexBasis {
    low: f64,
    high: f64,
    pub(super) nodes: Vec<Dielectric>,
    /// C_j and dC_j/dη at the ends of the cells.
    table: Vec<[[f64; MOST]; 2]>,
    error: f64,
}

impl IndexBasis {
    /// Over [low, high] ⊂ [1, 1000] to `tolerance` of s0, if [`MOST`] nodes reach it.
    pub(super) fn new([low, high]: [f64; 2], tolerance: f64) -> Result<Self, OpticsError> {
        let mut basis = Self::of(low, high, if low < high { 2 } else { 1 })?;
        while basis.error > tolerance && basis.nodes.len() < MOST {
            basis = Self::of(low, high, basis.nodes.len() + 1)?;
        }
        Ok(basis)
    }

    /// C_j and dC_j/dη; η is held within the range.
    pub(super) fn at(&self, eta: f64) -> [Weights; 2] {
        let width = (self.high - self.low) / real(CELLS);
        if width <= 0.0 {
            let mut one = [0.0; MOST];
            one[0] = 1.0;
            return [one, [0.0; MOST]];
        }
        let x = ((eta - self.low) / width).clamp(0.0, real(CELLS));
        let (cell, rest) = nearest(x - 0.5, 0, CELLS - 1);
        let t = rest + 0.5;
        let ([a, da], [b, db]) = (&self.table[cell], &self.table[cell + 1]);
        // Cubic Hermite: the slope is continuous.
        let mut out = [[0.0; MOST]; 2];
        for j in 0..self.nodes.len() {
            let (p, q) = (da[j] * width, db[j] * width);
            let rise = b[j] - a[j];
            let (c2, c3) = (3.0 * rise - 2.0 * p - q, p + q - 2.0 * rise);
            out[0][j] = single(a[j] + t * (p + t * (c2 + t * c3)));
            out[1][j] = single((p + t * (2.0 * c2 + t * 3.0 * c3)) / width);
        }
        out
    }

    fn of(low: f64, high: f64, count: usize) -> Result<Self, OpticsError> {
        // Chebyshev places in 1/η, which Fresnel terms follow more evenly than η.
        let (a, b) = (1.0 / high, 1.0 / low);
        let place = |j: usize| {
            let x = (core::f64::consts::PI * (real(j) + 0.5) / real(count)).cos();
            1.0 / (0.5 * (a + b) + 0.5 * (b - a) * x)
        };
        let nodes: Vec<Dielectric> = (0..count).map(|j| Dielectric::new(place(j))).collect::<Result<_, _>>()?;
        let columns: Vec<Vec<f64>> = nodes.iter().map(|n| terms(*n)).collect();
        let fit = |eta: f64| -> Result<([f64; MOST], f64), OpticsError> {
            let wanted = terms(Dielectric::new(eta)?);
            Ok(least_squares(&columns, &wanted))
        };
        let step = (high - low) / real(CELLS);
        let mut table = Vec::with_capacity(CELLS + 1);
        let mut error = 0.0_f64;
        if step > 0.0 {
            for k in 0..=CELLS {
                let eta = low + real(k) * step;
                let (value, miss) = fit(eta)?;
                error = error.max(miss);
                // The fit is smooth in η beyond the ends of the range, but not below an index of 1.
                let h = 1e-3 * step;
                let (up, down) = (fit(eta + h)?.0, fit((eta - h).max(1.0))?.0);
                let span = eta + h - (eta - h).max(1.0);
                table.push([value, core::array::from_fn(|j| (up[j] - down[j]) / span)]);
            }
        }
        Ok(Self { low, high, nodes, table, error })
    }
}

/// The three Fresnel terms at every angle of the fit.
fn terms(ior: Dielectric) -> Vec<f64> {
    let at = |k: usize| Incidence::from_angle(Radians(1.484 * (real(k) + 0.25) / real(ANGLES)));
    let all = (0..ANGLES).map(|k| ior.reflectance(at(k)));
    all.flat_map(|r| [0.5 * (r.perpendicular + r.parallel), 0.5 * (r.perpendicular - r.parallel), r.rr_cos_delta])
        .collect()
}

/// Coefficients of `wanted` in `columns`, every angle in units of its mean reflectance, and the largest miss in these units.
fn least_squares(columns: &[Vec<f64>], wanted: &[f64]) -> ([f64; MOST], f64) {
    let scaled = |v: &[f64]| -> Vec<f64> {
        v.iter().zip(wanted.chunks_exact(3).flat_map(|w| [w[0]; 3])).map(|(x, r)| x / r.max(1e-12)).collect()
    };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    // Gram-Schmidt, twice for full accuracy; the coefficients follow by back substitution.
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut triangle = [[0.0; MOST]; MOST];
    for (j, column) in columns.iter().enumerate() {
        let mut v = scaled(column);
        for _ in 0..2 {
            for (i, b) in basis.iter().enumerate() {
                let along = dot(&v, b);
                triangle[i][j] += along;
                v.iter_mut().zip(b).for_each(|(x, y)| *x -= along * y);
            }
        }
        let length = dot(&v, &v).sqrt().max(1e-300);
        triangle[j][j] = length;
        basis.push(v.iter().map(|x| x / length).collect());
    }
    let mut rest = scaled(wanted);
    let mut coefficients = [0.0; MOST];
    for (j, b) in basis.iter().enumerate() {
        coefficients[j] = dot(&rest, b);
        rest.iter_mut().zip(b).for_each(|(x, y)| *x -= coefficients[j] * y);
    }
    for j in (0..columns.len()).rev() {
        let above: f64 = (j + 1..columns.len()).map(|k| triangle[j][k] * coefficients[k]).sum();
        coefficients[j] = (coefficients[j] - above) / triangle[j][j];
    }
    (coefficients, rest.iter().fold(0.0, |worst: f64, x| worst.max(x.abs())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_indices_stand_for_all() {
        let basis = IndexBasis::new([1.2, 2.2], 1e-3).unwrap();
        assert!(basis.nodes.len() <= 5 && basis.error <= 1e-3, "{} {}", basis.nodes.len(), basis.error);
        for eta in [1.2, 1.33, 1.5, 1.777, 2.2] {
            let [c, slope] = basis.at(eta);
            for theta in [0.0, 0.3, 0.7, 0.98, 1.2, 1.4] {
                let at = Incidence::from_angle(Radians(theta));
                let sum = |w: Weights| -> f64 {
                    basis.nodes.iter().zip(w).map(|(n, w)| f64::from(w) * n.reflectance(at).parallel).sum()
                };
                let exact = Dielectric::new(eta).unwrap();
                let mean = 0.5 * (exact.reflectance(at).perpendicular + exact.reflectance(at).parallel);
                assert!((sum(c) - exact.reflectance(at).parallel).abs() < 2e-3 * mean);
                let h = 1e-5;
                let [high, low] = [eta + h, eta - h].map(|e| Dielectric::new(e).unwrap().reflectance(at).parallel);
                assert!((sum(slope) - (high - low) / (2.0 * h)).abs() < 0.05 * mean, "{eta} {theta}");
            }
        }
        let fixed = IndexBasis::new([1.5, 1.5], 1e-3).unwrap();
        assert!(fixed.nodes.len() == 1 && fixed.at(1.5)[0][0] > 0.999_999);
    }
}
