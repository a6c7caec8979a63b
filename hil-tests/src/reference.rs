//! Numbers from elsewhere: least squares by another way than the camera's, and the statistics of a plane.

use protocol_polar::Analyzer;

/// Least squares by normal equations and Cramer's rule, in f64: shares no code with the camera's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeastSquaresByCramer {
    normal: [[f64; 3]; 3],
}

/// Mean and variance of a plane.
#[derive(Clone, Copy, Debug)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Unbiased variance.
    pub variance: f64,
}

impl LeastSquaresByCramer {
    /// For frames of equal weight.
    #[must_use]
    pub(crate) fn new<'a>(frames: impl Iterator<Item = &'a Analyzer>) -> Self {
        let mut normal = [[0.0; 3]; 3];
        for frame in frames {
            let row = frame.row();
            for (i, line) in normal.iter_mut().enumerate() {
                for (j, x) in line.iter_mut().enumerate() {
                    *x += row[i] * row[j];
                }
            }
        }
        Self { normal }
    }

    /// (s0, s1, s2) from the signals of the same frames.
    #[must_use]
    pub(crate) fn solve<'a>(&self, samples: impl Iterator<Item = (&'a Analyzer, f64)>) -> [f64; 3] {
        let mut right = [0.0; 3];
        for (frame, signal) in samples {
            for (to, x) in right.iter_mut().zip(frame.row()) {
                *to += x * signal;
            }
        }
        let all = determinant(&self.normal);
        [0, 1, 2].map(|column| {
            let mut replaced = self.normal;
            for (line, x) in replaced.iter_mut().zip(right) {
                line[column] = x;
            }
            determinant(&replaced) / all
        })
    }
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// Mean and variance of `values`.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts of photosites are exact")]
pub fn statistics(values: &[f64]) -> Statistics {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    Statistics { mean, variance }
}
