//! The model at one point: χ² with the linear albedos at their best (variable projection, Golub and Pereyra 1973), and the
//! normal equations there.
//!
//! Coordinates: [`Theta`] = (ln(η − 1), ln α, n_x/n_z, n_y/n_z); then ρ_d of R, G, B, which are eliminated band by band.

use super::linear::{Cholesky, non_negative, restricted};
use super::problem::{Arrow, FULL, Problem, Seen, Weights, by_band, weighted};
use super::settings::Loss;
use crate::material::{BANDS, Facets, Forward, Lanes, MAX_VIEWS, Response, by};

/// (ln(η − 1), ln α, n_x/n_z, n_y/n_z).
pub(super) type Theta = [f64; 4];

/// Information below which a direction counts as free: σ of 1e5 in the units of [`Theta`].
pub(super) const NOTHING: f64 = 1e-10;

/// The coordinates of `facets`.
pub(super) fn theta(facets: &Facets) -> Theta {
    [(facets.eta - 1.0).ln(), facets.alpha.ln(), facets.slope[0], facets.slope[1]]
}

/// The inverse of [`theta`].
pub(super) fn facets(theta: &Theta) -> Facets {
    Facets { eta: 1.0 + theta[0].exp(), alpha: theta[1].exp(), slope: [theta[2], theta[3]] }
}

/// What one evaluation of the forward model says.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) theta: Theta,
    pub(super) albedo: [f64; BANDS],
    /// Which albedos are not held at 0.
    pub(super) free: [bool; BANDS],
    /// Sum of losses and of the nuisances' priors: χ² of plain least squares.
    pub(super) cost: f64,
    responses: [Response; MAX_VIEWS],
    diffuse: [Lanes; MAX_VIEWS],
    residual: [Lanes; MAX_VIEWS],
    weights: Weights,
    /// Σ of the whitened specular part, squared: how much of it stands out of the noise.
    pub(super) specular: f64,
}

/// The normal equations at a point, over [`Theta`] and the albedos.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normal {
    /// JᵀJ over [`Theta`].
    pub(super) theta: [[f64; 4]; 4],
    /// JᵀD: Theta × bands.
    pub(super) cross: [[f64; BANDS]; 4],
    /// DᵀD.
    pub(super) albedo: [[f64; BANDS]; BANDS],
    /// Jᵀr and Dᵀr.
    pub(super) gradient: ([f64; 4], [f64; BANDS]),
}

/// [`Normal`] with the free albedos eliminated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reduced {
    pub(super) matrix: [[f64; 4]; 4],
    pub(super) gradient: [f64; 4],
    /// (DᵀD)⁻¹ DᵀJ: bands × Theta.
    follow: [[f64; 4]; BANDS],
    /// (DᵀD)⁻¹ Dᵀr.
    rest: [f64; BANDS],
}

impl Point {
    /// A place to evaluate into.
    pub(super) const EMPTY: Self = Self {
        theta: [0.0; 4],
        albedo: [0.0; BANDS],
        free: [false; BANDS],
        cost: f64::INFINITY,
        responses: [Response::BLACK; MAX_VIEWS],
        diffuse: [[0.0; 9]; MAX_VIEWS],
        residual: [[0.0; 9]; MAX_VIEWS],
        weights: FULL,
        specular: 0.0,
    };

    /// Evaluates at `theta`, the albedos being best for the block weights of the point before. False if anything is not finite.
    pub(super) fn evaluate<F: Forward + ?Sized>(
        &mut self,
        forward: &F,
        problem: &Problem,
        loss: Loss,
        at: Theta,
        before: &Weights,
    ) -> bool {
        self.theta = at;
        self.cost = f64::INFINITY;
        self.weights = *before;
        self.specular = 0.0;
        let facets = facets(&at);
        let mut matrix = [[0.0; BANDS]; BANDS];
        let mut right = [0.0; BANDS];
        for view in 0..problem.views {
            let response = forward.response(problem.number[view], problem.direction[view], &facets);
            let specular = problem.whiten(view, &response.specular);
            let diffuse = problem.whiten(view, &response.diffuse);
            let mut rest = problem.data[view];
            for (r, s) in rest.iter_mut().zip(&specular) {
                *r -= s;
                self.specular += s * s;
            }
            let (norm, data) = (by_band(&diffuse, &diffuse), by_band(&diffuse, &rest));
            for band in 0..BANDS {
                matrix[band][band] += before[view][band] * norm[band];
                right[band] += before[view][band] * data[band];
            }
            self.responses[view] = response;
            self.diffuse[view] = diffuse;
            self.residual[view] = rest;
        }
        let arrow = problem.arrow(before);
        if let Some(arrow) = &arrow {
            let rest = problem.seen(before, &self.residual);
            let diffuse = self.diffuse_seen(problem);
            for i in 0..BANDS {
                right[i] -= arrow.taken(&diffuse[i], &rest);
                for j in 0..BANDS {
                    matrix[i][j] -= arrow.taken(&diffuse[i], &diffuse[j]);
                }
            }
        }
        (self.albedo, self.free) = non_negative(&matrix, &right);
        for view in 0..problem.views {
            for band in 0..BANDS {
                for k in 3 * band..3 * band + 3 {
                    self.residual[view][k] -= self.albedo[band] * self.diffuse[view][k];
                }
            }
        }
        self.weigh(problem, loss, arrow.as_ref());
        self.cost.is_finite()
    }

    /// Cost, and the weights that the residuals ask for.
    fn weigh(&mut self, problem: &Problem, loss: Loss, arrow: Option<&Arrow>) {
        let mut cost = arrow.map_or(0.0, |arrow| problem.relieve(arrow, &self.weights, &mut self.residual));
        for view in 0..problem.views {
            for (weight, square) in
                self.weights[view].iter_mut().zip(by_band(&self.residual[view], &self.residual[view]))
            {
                let (value, derivative) = loss.of(square);
                cost += value;
                *weight = derivative;
            }
        }
        self.cost = cost;
    }

    /// The weights of the residuals here.
    pub(super) fn weights(&self) -> &Weights {
        &self.weights
    }

    /// BᵀWD, band by band.
    fn diffuse_seen(&self, problem: &Problem) -> [Seen; BANDS] {
        [0, 1, 2].map(|band| {
            let mut only = [[0.0; 9]; MAX_VIEWS];
            for (only, diffuse) in only.iter_mut().zip(&self.diffuse).take(problem.views) {
                only[3 * band..][..3].copy_from_slice(&diffuse[3 * band..][..3]);
            }
            problem.seen(&self.weights, &only)
        })
    }

    /// The normal equations here. Without a free index its row and column are 0.
    pub(super) fn normal(&self, problem: &Problem, index_is_free: bool) -> Normal {
        let facets = facets(&self.theta);
        // ∂η/∂ln(η − 1), ∂α/∂ln α.
        let chain = [if index_is_free { facets.eta - 1.0 } else { 0.0 }, facets.alpha, 1.0, 1.0];
        let mut out = Normal {
            theta: [[0.0; 4]; 4],
            cross: [[0.0; BANDS]; 4],
            albedo: [[0.0; BANDS]; BANDS],
            gradient: ([0.0; 4], [0.0; BANDS]),
        };
        let mut columns = [[[0.0; 9]; MAX_VIEWS]; 4];
        for view in 0..problem.views {
            let (weights, residual, diffuse) = (&self.weights[view], &self.residual[view], &self.diffuse[view]);
            let response = &self.responses[view];
            for parameter in [by::ETA, by::ALPHA, by::SLOPE_X, by::SLOPE_Y] {
                let mut column = response.specular_by[parameter];
                for (k, x) in column.iter_mut().enumerate() {
                    *x = chain[parameter] * (*x + self.albedo[k / 3] * response.diffuse_by[parameter][k]);
                }
                let column = problem.whiten(view, &column);
                out.gradient.0[parameter] += weighted(weights, &column, residual);
                for (band, x) in by_band(&column, diffuse).into_iter().enumerate() {
                    out.cross[parameter][band] += weights[band] * x;
                }
                columns[parameter][view] = column;
                for other in 0..=parameter {
                    out.theta[parameter][other] += weighted(weights, &column, &columns[other][view]);
                }
            }
            let (norm, data) = (by_band(diffuse, diffuse), by_band(diffuse, residual));
            for band in 0..BANDS {
                out.albedo[band][band] += weights[band] * norm[band];
                out.gradient.1[band] += weights[band] * data[band];
            }
        }
        if let Some(arrow) = problem.arrow(&self.weights) {
            // The residual is relieved already: Jᵀr needs no correction.
            let seen = columns.map(|column| problem.seen(&self.weights, &column));
            let diffuse = self.diffuse_seen(problem);
            for i in 0..4 {
                for j in 0..=i {
                    out.theta[i][j] -= arrow.taken(&seen[i], &seen[j]);
                }
                for (band, diffuse) in diffuse.iter().enumerate() {
                    out.cross[i][band] -= arrow.taken(&seen[i], diffuse);
                }
            }
            for i in 0..BANDS {
                for j in 0..BANDS {
                    out.albedo[i][j] -= arrow.taken(&diffuse[i], &diffuse[j]);
                }
            }
        }
        for i in 0..4 {
            for j in 0..i {
                out.theta[j][i] = out.theta[i][j];
            }
        }
        out
    }
}

impl Normal {
    /// With the `free` albedos eliminated; the others stay where they are. `None` if anything is not finite.
    pub(super) fn reduce(&self, free: &[bool; BANDS]) -> Option<Reduced> {
        // A band that no weight is left of determines nothing.
        let free = [0, 1, 2].map(|band| free[band] && self.albedo[band][band] > 0.0);
        let factor = Cholesky::new(&restricted(&self.albedo, &free))?;
        let freed = |x: [f64; BANDS]| [0, 1, 2].map(|band| if free[band] { x[band] } else { 0.0 });
        let rest = factor.solve(&freed(self.gradient.1));
        let mut out = Reduced { matrix: self.theta, gradient: self.gradient.0, follow: [[0.0; 4]; BANDS], rest };
        for i in 0..4 {
            let follow = factor.solve(&freed(self.cross[i]));
            for band in 0..BANDS {
                out.follow[band][i] = follow[band];
                out.gradient[i] -= self.cross[i][band] * rest[band];
                for j in 0..4 {
                    out.matrix[i][j] -= follow[band] * self.cross[j][band];
                }
            }
            // Rounding must not make information negative.
            out.matrix[i][i] = out.matrix[i][i].max(0.0) + NOTHING;
        }
        let finite = out.matrix.iter().flatten().chain(&out.gradient).all(|x| x.is_finite());
        finite.then_some(out)
    }
}

impl Reduced {
    /// How the free albedos follow a step in [`Theta`], to first order.
    pub(super) fn albedo_step(&self, step: &Theta) -> [f64; BANDS] {
        [0, 1, 2].map(|band| self.rest[band] - self.follow[band].iter().zip(step).map(|(f, s)| f * s).sum::<f64>())
    }

    /// sᵀHs: the squared length of a step in units of σ.
    pub(super) fn square(&self, step: &Theta) -> f64 {
        (0..4).map(|i| (0..4).map(|j| step[i] * self.matrix[i][j] * step[j]).sum::<f64>()).sum()
    }
}
