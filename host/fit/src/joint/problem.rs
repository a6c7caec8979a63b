//! The data of one pixel, whitened: each band of each view by the inverse Cholesky factor of its 3 × 3 covariance, so that
//! χ² is a sum of squares. What is missing has a whitening of zeros and contributes nothing.
//!
//! Nuisances (scale of the light, zero of each view's polarizer) are columns B of the noise, covariance I + BBᵀ: their most
//! likely values are part of every inner product (Woodbury). B has one dense column and one for each view, so that I + BᵀB is
//! an arrow and costs a handful of products.

use super::Reasons;
use super::settings::Settings;
use crate::material::{BANDS, Lanes, MAX_VIEWS, Observation};
use glam::DVec3;

/// A weight for each band of each view.
pub(super) type Weights = [[f64; BANDS]; MAX_VIEWS];

/// Every block counts in full.
pub(super) const FULL: Weights = [[1.0; BANDS]; MAX_VIEWS];

/// Lower triangle 00, 10, 11, 20, 21, 22 of L⁻¹.
type Whitening = [f64; 6];

/// One pixel's data.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub(super) views: usize,
    pub(super) number: [usize; MAX_VIEWS],
    pub(super) direction: [DVec3; MAX_VIEWS],
    whitening: [[Whitening; BANDS]; MAX_VIEWS],
    /// Whitened data.
    pub(super) data: [Lanes; MAX_VIEWS],
    /// Which bands of which views there are.
    pub(super) present: [[bool; BANDS]; MAX_VIEWS],
    nuisance: Option<Nuisance>,
    /// What was found on the way.
    pub(super) reasons: Reasons,
}

/// The columns of B: the light's scale (all views), the polarizer's zero (each view its own).
#[derive(Clone, Debug)]
struct Nuisance {
    light: [Lanes; MAX_VIEWS],
    rotation: [Lanes; MAX_VIEWS],
}

/// BᵀWa of a whitened vector a.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    pub(super) light: f64,
    pub(super) rotation: [f64; MAX_VIEWS],
}

/// I + BᵀWB: the light's entry, the views', and those between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrow {
    corner: f64,
    views: [f64; MAX_VIEWS],
    between: [f64; MAX_VIEWS],
}

impl Problem {
    pub(super) fn new(observations: &[Observation], settings: &Settings) -> Self {
        let mut problem = Self {
            views: 0,
            number: [0; MAX_VIEWS],
            direction: [DVec3::ZERO; MAX_VIEWS],
            whitening: [[[0.0; 6]; BANDS]; MAX_VIEWS],
            data: [[0.0; 9]; MAX_VIEWS],
            present: [[false; BANDS]; MAX_VIEWS],
            nuisance: (settings.light_sigma > 0.0 || settings.rotation_sigma_deg > 0.0)
                .then_some(Nuisance { light: [[0.0; 9]; MAX_VIEWS], rotation: [[0.0; 9]; MAX_VIEWS] }),
            reasons: Reasons::NONE,
        };
        problem.reasons.note(Reasons::BAD_INPUT, observations.len() > MAX_VIEWS);
        let mut brightest = 0.0_f64;
        for observation in observations.iter().take(MAX_VIEWS) {
            brightest = brightest.max(problem.add(observation, settings));
        }
        problem.reasons.note(Reasons::TOO_DARK, brightest < settings.limits.signal);
        problem.reasons.note(Reasons::ONE_VIEW, problem.views == 1);
        let within = settings.limits.separation_deg.to_radians().cos();
        let parallel = |a: &DVec3| problem.directions().iter().all(|b| a.dot(*b) > within);
        let parallel = problem.views > 1 && problem.directions().iter().all(parallel);
        problem.reasons.note(Reasons::VIEWS_TOO_PARALLEL, parallel);
        problem
    }

    /// Takes a view in unless nothing of it is of use; s0 over its σ of the brightest band.
    fn add(&mut self, observation: &Observation, settings: &Settings) -> f64 {
        let length = observation.direction.length_squared();
        if (length - 1.0).abs().is_nan() || (length - 1.0).abs() > 1e-3 {
            self.reasons |= Reasons::BAD_INPUT;
            return 0.0;
        }
        let at = self.views;
        let mut brightest = 0.0_f64;
        let bands = observation.stokes.iter().zip(&observation.covariance).enumerate();
        for (band, (stokes, covariance)) in bands {
            if covariance[0] == f32::INFINITY {
                self.reasons |= Reasons::CLIPPED;
                continue;
            }
            let whitening =
                stokes.iter().all(|s| s.is_finite()).then(|| whitening(covariance.map(f64::from))).flatten();
            let Some(whitening) = whitening else {
                self.reasons |= Reasons::BAD_INPUT;
                continue;
            };
            self.whitening[at][band] = whitening;
            self.present[at][band] = true;
            // Row 0 of L⁻¹ is 1/σ of s0.
            brightest = brightest.max(f64::from(stokes[0]) * whitening[0]);
        }
        if self.present[at].contains(&true) {
            self.number[at] = observation.view;
            self.direction[at] = observation.direction / length.sqrt();
            let data = self.whiten(at, &lanes(&observation.stokes, &self.present[at]));
            // ∂/∂angle of a turn of the frame is (0, −2 s2, 2 s1).
            let turned = observation.stokes.map(|[_, s1, s2]| [0.0, -2.0 * s2, 2.0 * s1]);
            let turned = self.whiten(at, &lanes(&turned, &self.present[at]));
            if let Some(nuisance) = &mut self.nuisance {
                nuisance.light[at] = data.map(|x| x * settings.light_sigma);
                nuisance.rotation[at] = turned.map(|x| x * settings.rotation_sigma_deg.to_radians());
            }
            self.data[at] = data;
            self.views += 1;
        }
        brightest
    }

    fn directions(&self) -> &[DVec3] {
        &self.direction[..self.views]
    }

    /// Blocks of three measurements that there are.
    pub(super) fn blocks(&self) -> u32 {
        self.present.iter().flatten().map(|there| u32::from(*there)).sum()
    }

    /// L⁻¹ of every band of view `at`.
    #[inline]
    pub(super) fn whiten(&self, at: usize, lanes: &Lanes) -> Lanes {
        let mut out = [0.0; 9];
        for (band, w) in self.whitening[at].iter().enumerate() {
            let (a, b, c) = (lanes[3 * band], lanes[3 * band + 1], lanes[3 * band + 2]);
            out[3 * band] = w[0] * a;
            out[3 * band + 1] = w[1] * a + w[2] * b;
            out[3 * band + 2] = w[3] * a + w[4] * b + w[5] * c;
        }
        out
    }

    /// BᵀWa of `vector`, given in its views' lanes; zero without nuisances.
    pub(super) fn seen(&self, weights: &Weights, vector: &[Lanes; MAX_VIEWS]) -> Seen {
        let mut out = Seen::default();
        let Some(nuisance) = &self.nuisance else { return out };
        for at in 0..self.views {
            out.light += weighted(&weights[at], &nuisance.light[at], &vector[at]);
            out.rotation[at] = weighted(&weights[at], &nuisance.rotation[at], &vector[at]);
        }
        out
    }

    /// I + BᵀWB, `None` without nuisances.
    pub(super) fn arrow(&self, weights: &Weights) -> Option<Arrow> {
        let nuisance = self.nuisance.as_ref()?;
        let mut arrow = Arrow { corner: 1.0, views: [1.0; MAX_VIEWS], between: [0.0; MAX_VIEWS] };
        for at in 0..self.views {
            let (light, rotation) = (&nuisance.light[at], &nuisance.rotation[at]);
            arrow.corner += weighted(&weights[at], light, light);
            arrow.views[at] += weighted(&weights[at], rotation, rotation);
            arrow.between[at] = weighted(&weights[at], light, rotation);
        }
        for at in 0..self.views {
            arrow.corner -= arrow.between[at].powi(2) / arrow.views[at];
        }
        Some(arrow)
    }

    /// Takes the nuisances' most likely values out of `residual`; their cost Σκ².
    pub(super) fn relieve(&self, arrow: &Arrow, weights: &Weights, residual: &mut [Lanes; MAX_VIEWS]) -> f64 {
        let Some(nuisance) = &self.nuisance else { return 0.0 };
        let seen = arrow.reduced(&self.seen(weights, residual));
        let scale = seen.light / arrow.corner;
        let mut cost = scale * scale;
        for at in 0..self.views {
            let turn = (seen.rotation[at] - arrow.between[at] * scale) / arrow.views[at];
            cost += turn * turn;
            for (lane, r) in residual[at].iter_mut().enumerate() {
                *r -= nuisance.light[at][lane] * scale + nuisance.rotation[at][lane] * turn;
            }
        }
        cost
    }
}

impl Arrow {
    /// (Bᵀa)ᵀ (I + BᵀWB)⁻¹ (Bᵀb): what the nuisances take from aᵀWb.
    pub(super) fn taken(&self, a: &Seen, b: &Seen) -> f64 {
        let (a, b) = (self.reduced(a), self.reduced(b));
        let views = a.rotation.iter().zip(b.rotation).zip(self.views).map(|((a, b), m)| a * b / m);
        a.light * b.light / self.corner + views.sum::<f64>()
    }

    /// With the views' part eliminated from the light's.
    fn reduced(&self, seen: &Seen) -> Seen {
        let views = seen.rotation.iter().zip(self.between).zip(self.views).map(|((a, between), m)| between * a / m);
        Seen { light: seen.light - views.sum::<f64>(), rotation: seen.rotation }
    }
}

/// Σ w a b over the lanes of one view.
#[inline]
pub(super) fn weighted(weights: &[f64; BANDS], a: &Lanes, b: &Lanes) -> f64 {
    let [x, y, z] = by_band(a, b);
    weights[0] * x + weights[1] * y + weights[2] * z
}

/// Σ a b over the lanes of each band.
#[inline]
pub(super) fn by_band(a: &Lanes, b: &Lanes) -> [f64; BANDS] {
    [0, 3, 6].map(|k| a[k] * b[k] + a[k + 1] * b[k + 1] + a[k + 2] * b[k + 2])
}

/// Bands that are there, 0 for the others.
fn lanes(stokes: &[[f32; 3]; BANDS], present: &[bool; BANDS]) -> Lanes {
    let mut out = [0.0; 9];
    for (band, (stokes, there)) in stokes.iter().zip(present).enumerate() {
        if *there {
            out[3 * band..][..3].copy_from_slice(&stokes.map(f64::from));
        }
    }
    out
}

/// L⁻¹ of a covariance 00, 01, 02, 11, 12, 22; `None` unless it is finite and positive definite.
fn whitening([c00, c01, c02, c11, c12, c22]: [f64; 6]) -> Option<Whitening> {
    let l00 = c00.sqrt();
    let (l10, l20) = (c01 / l00, c02 / l00);
    let l11 = (c11 - l10 * l10).sqrt();
    let l21 = (c12 - l20 * l10) / l11;
    let l22 = (c22 - l20 * l20 - l21 * l21).sqrt();
    let (i00, i11, i22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let (i10, i21) = (-l10 * i00 * i11, -l21 * i11 * i22);
    let i20 = -(l20 * i00 + l21 * i10) * i22;
    let out = [i00, i10, i11, i20, i21, i22];
    // An infinite variance would pass as a weight of 0; it is no measurement.
    let positive = [i00, i11, i22].iter().all(|i| *i > 0.0);
    (positive && out.iter().all(|x| x.is_finite())).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitening_is_the_inverse_factor() {
        let c = [4.0, 1.0, -0.5, 3.0, 0.2, 2.0];
        let w = whitening(c).unwrap();
        let rows = [[w[0], 0.0, 0.0], [w[1], w[2], 0.0], [w[3], w[4], w[5]]];
        let full = [[c[0], c[1], c[2]], [c[1], c[3], c[4]], [c[2], c[4], c[5]]];
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = 0.0;
                for (k, row) in full.iter().enumerate() {
                    for (l, x) in row.iter().enumerate() {
                        sum += rows[i][k] * x * rows[j][l];
                    }
                }
                assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        for c in [
            [0.0; 6],
            [1.0, 2.0, 0.0, 1.0, 0.0, 1.0],
            [f64::NAN, 0.0, 0.0, 1.0, 0.0, 1.0],
            [1.0, 0.0, 0.0, f64::INFINITY, 0.0, 1.0],
            [-1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
        ] {
            assert_eq!(whitening(c), None, "{c:?}");
        }
    }

    #[test]
    fn nuisances_are_what_the_full_covariance_says() {
        // χ² by Woodbury against χ² by solving with I + BBᵀ, two views of gray light.
        let observe = |view, s: [f32; 3]| Observation {
            view,
            direction: DVec3::Z,
            stokes: [s, s.map(|x| 2.0 * x), s.map(|x| 0.5 * x)],
            covariance: [[1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]; 3],
        };
        let observations = [observe(3, [1.0, 0.3, -0.2]), observe(5, [0.7, -0.1, 0.4])];
        let settings = Settings { light_sigma: 0.02, rotation_sigma_deg: 1.5, ..Settings::default() };
        let problem = Problem::new(&observations, &settings);
        let mut residual = [[0.0; 9]; MAX_VIEWS];
        let mut flat = Vec::new();
        for (at, lanes) in residual.iter_mut().take(2).enumerate() {
            for (k, r) in lanes.iter_mut().enumerate() {
                *r = (1.7 * (at * 9 + k) as f64).sin();
                flat.push(*r);
            }
        }
        let nuisance = problem.nuisance.clone().unwrap();
        let mut columns = vec![[0.0; 18]; 3];
        for k in 0..18 {
            columns[0][k] = nuisance.light[k / 9][k % 9];
            columns[1 + k / 9][k] = nuisance.rotation[k / 9][k % 9];
        }
        let mut covariance = [[0.0; 18]; 18];
        for (i, row) in covariance.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                *x = columns.iter().map(|c| c[i] * c[j]).sum::<f64>() + f64::from(u8::from(i == j));
            }
        }
        let vector: [f64; 18] = flat.try_into().unwrap();
        let whole = super::super::linear::Cholesky::new(&covariance).unwrap().solve(&vector);
        let expected: f64 = whole.iter().zip(vector).map(|(a, b)| a * b).sum();
        let arrow = problem.arrow(&FULL).unwrap();
        let seen = problem.seen(&FULL, &residual);
        let square: f64 = vector.iter().map(|x| x * x).sum();
        assert!((square - arrow.taken(&seen, &seen) - expected).abs() < 1e-12 * square);
        let cost = problem.relieve(&arrow, &FULL, &mut residual);
        let left: f64 = residual.iter().flatten().map(|x| x * x).sum();
        assert!((left + cost - expected).abs() < 1e-12 * square);
    }
}
