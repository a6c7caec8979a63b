//! Small symmetric systems.

/// Lower triangle L of A = LLᵀ, with the reciprocals of its diagonal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cholesky<const N: usize>([[f64; N]; N]);

impl<const N: usize> Cholesky<N> {
    /// `None` unless `a` (of which the lower triangle is read) is positive definite to rounding.
    pub(super) fn new(a: &[[f64; N]; N]) -> Option<Self> {
        let mut l = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let mut sum = a[i][j];
                for k in 0..j {
                    sum -= l[i][k] * l[j][k];
                }
                if i != j {
                    l[i][j] = sum * l[j][j];
                } else if sum > 1e-15 * a[i][i] && sum.is_finite() {
                    l[i][i] = 1.0 / sum.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self(l))
    }

    /// L⁻¹b.
    pub(super) fn forward(&self, b: &[f64; N]) -> [f64; N] {
        let mut x = *b;
        for i in 0..N {
            for k in 0..i {
                x[i] -= self.0[i][k] * x[k];
            }
            x[i] *= self.0[i][i];
        }
        x
    }

    /// A⁻¹b.
    pub(super) fn solve(&self, b: &[f64; N]) -> [f64; N] {
        let mut x = self.forward(b);
        for i in (0..N).rev() {
            for k in i + 1..N {
                x[i] -= self.0[k][i] * x[k];
            }
            x[i] *= self.0[i][i];
        }
        x
    }

    /// A⁻¹.
    pub(super) fn inverse(&self) -> [[f64; N]; N] {
        let mut out = [[0.0; N]; N];
        for (k, column) in out.iter_mut().enumerate() {
            let mut unit = [0.0; N];
            unit[k] = 1.0;
            *column = self.solve(&unit);
        }
        out
    }
}

/// `a` with the rows and columns that are not in `keep` replaced by those of the identity.
pub(super) fn restricted<const N: usize>(a: &[[f64; N]; N], keep: &[bool; N]) -> [[f64; N]; N] {
    let mut out = *a;
    for i in 0..N {
        for j in 0..N {
            if !(keep[i] && keep[j]) {
                out[i][j] = if i == j { 1.0 } else { 0.0 };
            }
        }
    }
    out
}

/// The x ≥ 0 that minimizes xᵀAx − 2bᵀx, and which components are free (> 0 or undecided at 0). Components without weight
/// (A_ii = 0) are 0 and not free.
pub(super) fn non_negative(a: &[[f64; 3]; 3], b: &[f64; 3]) -> ([f64; 3], [bool; 3]) {
    let mut free = [0, 1, 2].map(|k| a[k][k] > 0.0);
    let mut best = ([0.0; 3], [false; 3]);
    // Each round drops what is negative; three rounds empty the set. For blocks coupled as weakly as bands are by a common
    // scale of the light what was dropped stays dropped; the result is feasible in any case.
    for _ in 0..4 {
        let right = [0, 1, 2].map(|k| if free[k] { b[k] } else { 0.0 });
        let Some(factor) = Cholesky::new(&restricted(a, &free)) else { return best };
        let x = factor.solve(&right);
        best = (x.map(|x| x.max(0.0)), free);
        if x.iter().all(|x| *x >= 0.0) {
            break;
        }
        for (free, x) in free.iter_mut().zip(x) {
            *free &= x >= 0.0;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_inverts_and_refuses_what_is_not_positive() {
        let a = [[4.0, 1.0, -1.0], [1.0, 3.0, 0.5], [-1.0, 0.5, 2.0]];
        let inverse = Cholesky::new(&a).unwrap().inverse();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| a[i][k] * inverse[k][j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        assert!(Cholesky::new(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(Cholesky::new(&[[f64::NAN, 0.0], [0.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[f64::INFINITY]]).is_none());
    }

    #[test]
    fn negative_components_are_left_at_zero() {
        let a = [[2.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 0.0]];
        let (x, free) = non_negative(&a, &[1.0, -1.0, 5.0]);
        assert!((x[0] - 0.5).abs() < 1e-15 && x[1..] == [0.0, 0.0] && free == [true, false, false], "{x:?} {free:?}");
    }
}
