//! Small dense symmetric systems: the normal equations of a pose, a homography, a warp, or the errors of a wheel.
//!
//! Matrices are row-major, n × n, n at most some dozens; f64.

/// L Lᵀ of a symmetric positive definite matrix.
pub(crate) struct Cholesky {
    n: usize,
    /// Row-major; zero above the diagonal.
    lower: Vec<f64>,
}

impl Cholesky {
    /// Factors `matrix`, of which the lower triangle is read. `None` if it is not positive definite to rounding.
    pub(crate) fn new(matrix: &[f64], n: usize) -> Option<Self> {
        let mut lower = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
                let rest = matrix[i * n + j] - dot;
                if i == j {
                    // Less than n roundings of the diagonal is no pivot.
                    let least = matrix[i * n + i].abs() * f64::EPSILON * n as f64;
                    if rest <= least || rest.is_nan() {
                        return None;
                    }
                    lower[i * n + i] = rest.sqrt();
                } else {
                    lower[i * n + j] = rest / lower[j * n + j];
                }
            }
        }
        Some(Self { n, lower })
    }

    /// The solution of A x = b.
    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let (n, l) = (self.n, &self.lower);
        let mut x = b.to_vec();
        for i in 0..n {
            let dot: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
            x[i] = (x[i] - dot) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
            x[i] = (x[i] - dot) / l[i * n + i];
        }
        x
    }

    /// A⁻¹, row-major.
    pub(crate) fn inverse(&self) -> Vec<f64> {
        let unit = |k: usize| (0..self.n).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        (0..self.n).flat_map(|k| self.solve(&unit(k))).collect()
    }
}

/// Normal equations JᵀJ x = Jᵀr, summed row by row.
pub(crate) struct NormalEquations<const N: usize> {
    matrix: [[f64; N]; N],
    right: [f64; N],
}

impl<const N: usize> NormalEquations<N> {
    /// Of no rows.
    pub(crate) const fn new() -> Self {
        Self { matrix: [[0.0; N]; N], right: [0.0; N] }
    }

    /// One row of J with its residual.
    pub(crate) fn add(&mut self, row: &[f64; N], residual: f64) {
        for (i, a) in row.iter().enumerate() {
            self.right[i] += a * residual;
            for (sum, b) in self.matrix[i].iter_mut().zip(row) {
                *sum += a * b;
            }
        }
    }

    /// The least-squares solution; `None` if the rows do not determine it.
    pub(crate) fn solve(&self) -> Option<[f64; N]> {
        Cholesky::new(self.matrix.as_flattened(), N)?.solve(&self.right).try_into().ok()
    }
}

/// Eigenvalues of a symmetric matrix, ascending, by cyclic Jacobi rotations.
pub(crate) fn symmetric_eigenvalues(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut a = matrix.to_vec();
    for _sweep in 0..30 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i * n + j].powi(2)).sum();
        let all: f64 = a.iter().map(|x| x * x).sum();
        if off <= 1e-30 * all {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut a, n, p, q);
            }
        }
    }
    let mut values: Vec<f64> = (0..n).map(|i| a[i * n + i]).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// One rotation that makes element (p, q) zero.
fn rotate(a: &mut [f64], n: usize, p: usize, q: usize) {
    let apq = a[p * n + q];
    if apq == 0.0 {
        return;
    }
    let zeta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
    let t = 1.0_f64.copysign(zeta) / (zeta.abs() + 1.0_f64.hypot(zeta));
    let c = 1.0 / 1.0_f64.hypot(t);
    let s = c * t;
    for k in 0..n {
        let (x, y) = (a[k * n + p], a[k * n + q]);
        (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..n {
        let (x, y) = (a[p * n + k], a[q * n + k]);
        (a[p * n + k], a[q * n + k]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second-difference matrix: eigenvalues 2 − 2 cos(πk/(n+1)), inverse min(i, j)(n + 1 − max(i, j))/(n + 1).
    #[test]
    fn the_second_difference_has_its_known_inverse_and_eigenvalues() {
        let n = 7;
        let at = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        };
        let matrix: Vec<f64> = (0..n * n).map(|k| at(k / n, k % n)).collect();
        for (k, found) in symmetric_eigenvalues(&matrix, n).into_iter().enumerate() {
            let exact = 2.0 - 2.0 * (std::f64::consts::PI * (k + 1) as f64 / (n + 1) as f64).cos();
            assert!((found - exact).abs() < 1e-13);
        }
        for (k, found) in Cholesky::new(&matrix, n).unwrap().inverse().into_iter().enumerate() {
            let (i, j) = (k / n + 1, k % n + 1);
            let exact = (i.min(j) * (n + 1 - i.max(j))) as f64 / (n + 1) as f64;
            assert!((found - exact).abs() < 1e-13);
        }
        assert!(Cholesky::new(&[1.0, 1.0, 1.0, 1.0], 2).is_none());
    }
}
