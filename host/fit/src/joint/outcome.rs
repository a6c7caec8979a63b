//! What a fit says: parameters, their covariance, and the verdict.

use super::Reasons;
use super::descend::Minimum;
use super::linear::Cholesky;
use super::point::{NOTHING, facets};
use super::problem::Problem;
use super::settings::{Limits, Settings};
use crate::material::{BANDS, Facets};

/// Order of [`Fit::covariance`].
pub const PARAMETERS: [&str; 7] = ["rho_r", "rho_g", "rho_b", "eta", "alpha", "n_x", "n_y"];

/// σ of a logarithm, a slope or an albedo from which on it says nothing.
const UNKNOWN: f64 = 1e3;

/// The answer for one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// ρ_d of R, G, B, linear, >= 0; 0 for a band without data.
    pub albedo: [f64; BANDS],
    /// η, α and normal.
    pub facets: Facets,
    /// Covariance in the order of [`PARAMETERS`] (n_z follows from n_x and n_y), from the Fisher information at the minimum.
    /// What the data do not determine has an infinite variance and no covariances; a known index has none either, and 0.
    pub covariance: [[f64; 7]; 7],
    /// σ of the normal, degrees: rms angle over both directions across it.
    pub normal_sigma_deg: f64,
    /// 68 % interval of α: by curvature, or where that says little, by the profile of χ² (Δχ² = 1, all else at its best).
    pub alpha_interval: [f64; 2],
    /// χ² (with a robust loss: the sum of losses) with the nuisances' priors.
    pub chi2: f64,
    /// Measurements less parameters.
    pub freedom: u32,
    /// Views that had data.
    pub views: u32,
    /// Evaluations of the forward model, each in all views.
    pub evaluations: u32,
    /// What speaks against the answer.
    pub reasons: Reasons,
    /// The best other minimum, if its χ² is close.
    pub second: Option<Alternative>,
}

/// Other parameters that fit nearly as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alternative {
    /// ρ_d.
    pub albedo: [f64; BANDS],
    /// η, α and normal.
    pub facets: Facets,
    /// Its χ².
    pub chi2: f64,
}

impl Fit {
    /// σ in the order of [`PARAMETERS`].
    #[must_use]
    pub fn sigma(&self) -> [f64; 7] {
        [0, 1, 2, 3, 4, 5, 6].map(|k| self.covariance[k][k].sqrt())
    }

    /// What of [`Reasons`] is about parameters.
    pub(super) fn unidentifiable(&self) -> Reasons {
        let parameters = Reasons::ALBEDO | Reasons::INDEX | Reasons::ROUGHNESS | Reasons::NORMAL;
        Reasons(self.reasons.0 & parameters.0)
    }

    /// Parameters in which `other` differs by more than an identifiable one may be unsure of.
    pub(super) fn apart(&self, other: &Self, limits: &Limits) -> Reasons {
        let mut reasons = Reasons::NONE;
        let (here, there) = (&self.facets, &other.facets);
        let alpha = (here.alpha - there.alpha).abs();
        let albedo = self.albedo.iter().zip(other.albedo).any(|(a, b)| (a - b).abs() > limits.albedo);
        reasons.note(Reasons::ALBEDO, albedo);
        reasons.note(Reasons::INDEX, (here.eta - there.eta).abs() > limits.eta);
        reasons.note(Reasons::ROUGHNESS, alpha > limits.alpha || alpha > limits.alpha_relative * here.alpha);
        let angle = here.normal().cross(there.normal()).length().atan2(here.normal().dot(there.normal()));
        reasons.note(Reasons::NORMAL, angle.to_degrees() > limits.normal_deg);
        reasons
    }

    /// No answer.
    pub(super) fn unknown(problem: &Problem, guess: Facets, evaluations: u32, reasons: Reasons) -> Self {
        let mut covariance = [[0.0; 7]; 7];
        for (k, row) in covariance.iter_mut().enumerate() {
            row[k] = f64::INFINITY;
        }
        let undetermined = Reasons::ALBEDO | Reasons::INDEX | Reasons::ROUGHNESS | Reasons::NORMAL;
        Self {
            albedo: [0.0; BANDS],
            facets: guess,
            covariance,
            normal_sigma_deg: f64::INFINITY,
            alpha_interval: [0.0, f64::INFINITY],
            chi2: f64::INFINITY,
            freedom: 0,
            views: u32::try_from(problem.views).unwrap_or(u32::MAX),
            evaluations,
            reasons: problem.reasons | reasons | undetermined,
            second: None,
        }
    }

    /// The answer at `minimum`, by curvature alone; `shared` of the parameters are not this pixel's own.
    pub(super) fn at(
        problem: &Problem,
        minimum: &Minimum,
        index_is_free: bool,
        shared: u32,
        settings: &Settings,
    ) -> Self {
        let facets = facets(&minimum.theta);
        let (covariance, normal_variance) = covariance(minimum, &facets, index_is_free);
        let sigma = |k: usize| covariance[k][k].sqrt();
        let bands = (0..BANDS).filter(|band| problem.present.iter().any(|view| view[*band])).count();
        let parameters = bands + 3 + usize::from(index_is_free);
        let parameters = u32::try_from(parameters).unwrap_or(u32::MAX).saturating_sub(shared);
        let data = 3 * problem.blocks();
        let freedom = data.saturating_sub(parameters);
        let normal_sigma_deg = normal_variance.sqrt().to_degrees();
        let Limits { eta, alpha, alpha_relative, albedo, normal_deg, misfit: limit, .. } = settings.limits;

        let mut reasons = problem.reasons;
        reasons.note(Reasons::TOO_FEW_DATA, data < parameters);
        reasons.note(Reasons::NO_MIRRORED_LIGHT, minimum.specular < 9.0);
        reasons.note(Reasons::ALBEDO, (0..BANDS).any(|band| sigma(band) > albedo));
        reasons.note(Reasons::INDEX, sigma(3) > eta);
        reasons.note(Reasons::ROUGHNESS, sigma(4) > alpha || sigma(4) > alpha_relative * facets.alpha);
        reasons.note(Reasons::NORMAL, normal_sigma_deg > normal_deg);
        reasons.note(Reasons::OUTSIDE_MODEL, misfit(minimum.cost, freedom) > limit);
        reasons.note(Reasons::NOT_CONVERGED, !minimum.converged);
        let dark = (0..BANDS).any(|band| !minimum.free[band] && minimum.normal.albedo[band][band] > 0.0);
        reasons.note(Reasons::AT_BOUND, dark || minimum.held.contains(&true));

        let [low, high] = settings.alpha;
        let within = |alpha: f64| alpha.clamp(low, high);
        Self {
            albedo: minimum.albedo,
            facets,
            covariance,
            normal_sigma_deg,
            alpha_interval: [within(facets.alpha - sigma(4)), within(facets.alpha + sigma(4))],
            chi2: minimum.cost,
            freedom,
            views: u32::try_from(problem.views).unwrap_or(u32::MAX),
            evaluations: 0,
            reasons,
            second: None,
        }
    }
}

impl Alternative {
    pub(super) fn at(minimum: &Minimum) -> Self {
        Self { albedo: minimum.albedo, facets: facets(&minimum.theta), chi2: minimum.cost }
    }
}

/// χ² of so many degrees of freedom as a standard normal deviate: cube root, Wilson and Hilferty 1931.
pub(super) fn misfit(chi2: f64, freedom: u32) -> f64 {
    if freedom == 0 {
        return 0.0;
    }
    let k = f64::from(freedom);
    let variance = 2.0 / (9.0 * k);
    ((chi2 / k).cbrt() - (1.0 - variance)) / variance.sqrt()
}

/// Covariance in the order of [`PARAMETERS`], and the variance of the normal in rad².
fn covariance(minimum: &Minimum, facets: &Facets, index_is_free: bool) -> ([[f64; 7]; 7], f64) {
    let normal = &minimum.normal;
    let mut information = [[0.0; 7]; 7];
    for i in 0..7 {
        for j in 0..7 {
            information[i][j] = match (i < BANDS, j < BANDS) {
                (true, true) => normal.albedo[i][j],
                (true, false) => normal.cross[j - BANDS][i],
                (false, true) => normal.cross[i - BANDS][j],
                (false, false) => normal.theta[i - BANDS][j - BANDS],
            };
        }
    }
    from_information(&information, facets, index_is_free)
}

/// Covariance and variance of the normal from the information over (ρ_d, ln(η − 1), ln α, slopes).
fn from_information(information: &[[f64; 7]; 7], facets: &Facets, index_is_free: bool) -> ([[f64; 7]; 7], f64) {
    let mut information = *information;
    // The least that is known of anything, far beyond [`UNKNOWN`]; and unit diagonals, for the sake of rounding.
    let mut scale = [0.0; 7];
    for (k, row) in information.iter_mut().enumerate() {
        row[k] += NOTHING;
        scale[k] = 1.0 / row[k].sqrt();
    }
    for (i, row) in information.iter_mut().enumerate() {
        for (j, x) in row.iter_mut().enumerate() {
            *x *= scale[i] * scale[j];
        }
    }
    let inverse = Cholesky::new(&information).map(|factor| factor.inverse());
    let logarithmic = inverse.map_or([[f64::INFINITY; 7]; 7], |mut inverse| {
        for (i, row) in inverse.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                *x *= scale[i] * scale[j];
            }
        }
        inverse
    });
    transformed(&logarithmic, facets, index_is_free)
}

/// From (ρ_d, ln(η − 1), ln α, slopes) to [`PARAMETERS`], and the variance of the normal in rad².
fn transformed(logarithmic: &[[f64; 7]; 7], facets: &Facets, index_is_free: bool) -> ([[f64; 7]; 7], f64) {
    let n = facets.normal();
    let scale = [1.0, 1.0, 1.0, facets.eta - 1.0, facets.alpha];
    // ∂n/∂(n_x/n_z) = n_z (x − n n_x).
    let tilt = [
        [n.z * (1.0 - n.x * n.x), -n.z * n.x * n.y],
        [-n.z * n.x * n.y, n.z * (1.0 - n.y * n.y)],
        [-n.z * n.z * n.x, -n.z * n.z * n.y],
    ];
    let changed = |row: &[f64; 7]| {
        let [x, y] = [row[5], row[6]];
        let mut out = *row;
        for (value, scale) in out.iter_mut().zip(scale) {
            *value *= scale;
        }
        out[5] = tilt[0][0] * x + tilt[0][1] * y;
        out[6] = tilt[1][0] * x + tilt[1][1] * y;
        out
    };
    let known = [0, 1, 2, 3, 4, 5, 6].map(|k| (0.0..UNKNOWN * UNKNOWN).contains(&logarithmic[k][k]));
    let normal_known = known[5] && known[6];
    let known = [known[0], known[1], known[2], known[3], known[4], normal_known, normal_known];
    let rows = logarithmic.map(|row| changed(&row));
    let mut out = [[0.0; 7]; 7];
    for i in 0..7 {
        // By symmetry a column is a row.
        let column = changed(&rows.map(|row| row[i]));
        for j in 0..7 {
            if !index_is_free && (i == 3 || j == 3) {
                continue;
            }
            out[i][j] = match (known[i] && known[j], i == j) {
                (true, _) => column[j],
                (false, true) => f64::INFINITY,
                (false, false) => 0.0,
            };
        }
    }
    let across = |k: usize, l: usize| tilt.iter().map(|row| row[k] * row[l]).sum::<f64>();
    let variance = if normal_known {
        across(0, 0) * logarithmic[5][5] + 2.0 * across(0, 1) * logarithmic[5][6] + across(1, 1) * logarithmic[6][6]
    } else {
        f64::INFINITY
    };
    (out, variance.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misfit_is_a_normal_deviate() {
        // 95 % points of χ² (tables): 19.675 of 11, 31.410 of 20; median of 11: 10.341.
        for (chi2, freedom, expected) in [(19.675, 11, 1.645), (31.410, 20, 1.645), (10.341, 11, 0.0)] {
            assert!((misfit(chi2, freedom) - expected).abs() < 0.01);
        }
    }
}
