//! How values at a few rays of a view stand for all of its rays: a polynomial in two coordinates over [−1, 1]².

/// Most terms: 1, a, b, a², ab, b².
pub(super) const MOST: usize = 6;

/// A polynomial of 1, 3 or 6 terms and the places that determine it.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) places: Vec<[f64; 2]>,
    /// Coefficient of term t from the value at place k: `inverse[t][k]`.
    inverse: Vec<Vec<f64>>,
}

/// 1, a, b, a², ab, b².
pub(super) fn terms([a, b]: [f64; 2]) -> [f64; MOST] {
    [1.0, a, b, a * a, a * b, b * b]
}

impl Design {
    /// The middle alone; a triangle for a plane; or the middle and a pentagon, on which no conic vanishes: a parabola.
    pub(super) fn of(count: usize) -> Self {
        let ring = |corners: u8, radius: f64| {
            (0..corners).map(move |k| {
                let (s, c) = (core::f64::consts::TAU * (f64::from(k) + 0.25) / f64::from(corners)).sin_cos();
                [radius * c, radius * s]
            })
        };
        let places: Vec<[f64; 2]> = match count {
            1 => vec![[0.0; 2]],
            3 => ring(3, 1.0).collect(),
            _ => core::iter::once([0.0; 2]).chain(ring(5, 1.15)).collect(),
        };
        let n = places.len();
        // Gauss-Jordan on (terms | identity), with pivots.
        let mut rows: Vec<Vec<f64>> = places
            .iter()
            .enumerate()
            .map(|(k, p)| {
                let mut row: Vec<f64> = terms(*p).iter().take(n).copied().collect();
                row.extend((0..n).map(|j| if j == k { 1.0 } else { 0.0 }));
                row
            })
            .collect();
        for column in 0..n {
            let best = (column..n).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()));
            rows.swap(column, best.unwrap_or(column));
            let pivot = rows[column][column];
            rows[column].iter_mut().for_each(|x| *x /= pivot);
            let own = rows[column].clone();
            for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != column) {
                let factor = row[column];
                row.iter_mut().zip(&own).for_each(|(x, y)| *x -= factor * y);
            }
        }
        Self { places, inverse: rows.into_iter().map(|row| row[n..].to_vec()).collect() }
    }

    /// Coefficients from values at the places, both `width` numbers each.
    pub(super) fn coefficients(&self, values: &[f32], width: usize, out: &mut [f32]) {
        for (row, out) in self.inverse.iter().zip(out.chunks_exact_mut(width)) {
            out.fill(0.0);
            for (w, value) in row.iter().zip(values.chunks_exact(width)) {
                let w = super::numbers::single(*w);
                out.iter_mut().zip(value).for_each(|(o, v)| *o += w * v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_comes_back() {
        for count in [1, 3, 6] {
            let design = Design::of(count);
            assert_eq!(design.places.len(), count);
            let truth = [0.3_f64, -1.0, 2.0, 0.7, -0.4, 1.1];
            let f = |p: [f64; 2]| -> f64 { terms(p).iter().zip(truth).take(count).map(|(t, c)| t * c).sum() };
            let values: Vec<f32> = design.places.iter().map(|p| crate::forward::numbers::single(f(*p))).collect();
            let mut found = vec![0.0; count];
            design.coefficients(&values, 1, &mut found);
            for (c, exact) in found.iter().zip(truth) {
                assert!((f64::from(*c) - exact).abs() < 1e-5, "{found:?}");
            }
        }
    }
}
