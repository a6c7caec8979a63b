//! What may be set of a fit.

/// How residuals count. Their measure is the norm n of a view's and band's whitened (s0, s1, s2), whose square is a χ² of three
/// degrees of freedom where the model holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// n²: maximum likelihood.
    #[default]
    Squares,
    /// n² up to n = k, 2kn − k² beyond (Huber 1964).
    Huber(f64),
    /// (c²/3)(1 − (1 − n²/c²)³) up to n = c, constant beyond (Beaton and Tukey 1974). It has minima of its own making: the
    /// search is done with Huber's loss of k = c/2 and this one only finishes. A region stays with Huber's.
    Tukey(f64),
}

impl Loss {
    /// What to search with.
    pub(super) fn convex(self) -> Self {
        if let Self::Tukey(c) = self { Self::Huber(0.5 * c) } else { self }
    }

    /// Cost for n², and its derivative by n²: the weight of iterated least squares.
    pub(super) fn of(self, square: f64) -> (f64, f64) {
        match self {
            Self::Huber(k) if square > k * k => {
                let n = square.sqrt();
                (k * (2.0 * n - k), k / n)
            }
            Self::Tukey(c) if square >= c * c => (c * c / 3.0, 0.0),
            Self::Tukey(c) => {
                let rest = 1.0 - square / (c * c);
                (c * c / 3.0 * (1.0 - rest * rest * rest), rest * rest)
            }
            Self::Squares | Self::Huber(_) => (square, 1.0),
        }
    }
}

/// From where to descend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Starts {
    /// From the best of the starts given; a grid only where none is.
    Given,
    /// As [`Self::Given`], and from the grid where χ² is too large, a parameter is not identifiable or at a bound, or the
    /// descent did not converge.
    #[default]
    Auto,
    /// From all starts given and the grid: finds second minima.
    All,
}

/// Beyond which σ a parameter counts as not identifiable, and other limits of the verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// σ of η.
    pub eta: f64,
    /// σ of α.
    pub alpha: f64,
    /// σ of α over α.
    pub alpha_relative: f64,
    /// σ of any ρ_d.
    pub albedo: f64,
    /// σ of the normal, degrees.
    pub normal_deg: f64,
    /// χ² − χ² of the best minimum, below which another counts.
    pub second_minimum: f64,
    /// χ² as a standard normal deviate (Wilson and Hilferty 1931) above which the model is refused.
    pub misfit: f64,
    /// s0 over its σ that some band of some view must reach.
    pub signal: f64,
    /// Degrees between the two views furthest apart.
    pub separation_deg: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            eta: 0.2,
            alpha: 0.1,
            alpha_relative: 0.5,
            albedo: 0.1,
            normal_deg: 5.0,
            second_minimum: 9.0,
            misfit: 4.0,
            signal: 10.0,
            separation_deg: 10.0,
        }
    }
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How residuals count.
    pub loss: Loss,
    /// From where to descend.
    pub starts: Starts,
    /// Most evaluations of one descent; 0 evaluates the start and stays there (covariances at known parameters).
    pub iterations: u32,
    /// Done when the step is shorter than this many σ (in the metric of the information matrix); the last step is still taken.
    pub tolerance: f64,
    /// Range of η, above 1.
    pub eta: [f64; 2],
    /// Range of α, above 0.
    pub alpha: [f64; 2],
    /// Largest |n_x/n_z| and |n_y/n_z|.
    pub slope: f64,
    /// Prior relative σ of the radiance of the light, common to all observations of a pixel; 0: known.
    pub light_sigma: f64,
    /// Prior σ of the zero of the polarizer's angle in degrees, for each view its own; 0: known.
    pub rotation_sigma_deg: f64,
    /// Look at the likelihood along α where its curvature says little.
    pub profile: bool,
    /// Limits of the verdict.
    pub limits: Limits,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            loss: Loss::default(),
            starts: Starts::default(),
            iterations: 30,
            tolerance: 1e-3,
            eta: [1.001, 4.0],
            alpha: [1e-3, 1.0],
            slope: 3.0,
            light_sigma: 0.0,
            rotation_sigma_deg: 0.0,
            profile: true,
            limits: Limits::default(),
        }
    }
}
