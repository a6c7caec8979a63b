//! Mode *sky-aware*: a mirror facet under light of known polarization (paper eq. 8), on Lambert's ground.
//!
//! Diffuse light is unpolarized, so s1 and s2 of every band and view depend on three numbers only: the slopes of the normal and
//! η. They are found by damped Gauss-Newton on the whitened (s1, s2), and the diffuse part is what they leave of s0. Where the
//! sky is polarized more than a mirror facet polarizes (P >= specular DoLP) the phase may be turned by up to 90°: those
//! starts are tried beside the phase itself and the mean normal, and the likelihood chooses.

use super::fresnel::ETA;
use super::phase::{Seen, azimuth};
use super::plane::{Azimuth, axis, intersect};
use super::{Estimate, Reasons, SkyTable, seen, solve_f64};
use crate::material::{BANDS, Facets, Observation};
use glam::{DMat3, DVec2, DVec3};
use host_optics::{Dielectric, Frame, Incidence, Reflection};

/// Iterations of one start.
const LIMIT: u32 = 20;

/// Steps of the difference quotients: wide enough for the table's f32, narrow against its cells.
const STEP_SLOPE: f64 = 1e-4;
const STEP_ETA: f64 = 1e-5;

/// Steepest slope.
const SLOPE: f64 = 5.0;

/// Phases turned by up to 90° are tried where P exceeds this much of the specular DoLP.
const NEAR_FLIP: f64 = 0.7;

/// How many starts beyond the best are always tried.
const ALWAYS: usize = 1;

/// Indices a normal is tried with.
const ETA_STARTS: [f64; 3] = [1.3, 1.5, 1.8];

/// A second start within this χ² of the best, elsewhere, is a second answer.
const SECOND: f64 = 9.0;

/// Specular Stokes of every band.
type Bands = [[f64; 3]; BANDS];

/// One view's measurement, ready to be compared.
struct Target {
    direction: DVec3,
    frame: Frame,
    stokes: Bands,
    /// Inverse covariance of (s1, s2): 11, 12, 22; 0 for a band that says nothing.
    weight: [[f64; 3]; BANDS],
    covariance: [[f64; 6]; BANDS],
}

/// (n_x/n_z, n_y/n_z, η).
type Parameters = DVec3;

struct Problem<'a> {
    targets: Vec<Target>,
    sky: &'a SkyTable,
    white: [f64; BANDS],
}

/// Normal equations at one place.
struct Linear {
    chi2: f64,
    hessian: DMat3,
    gradient: DVec3,
}

/// Where a start ended.
#[derive(Clone, Copy, Debug)]
struct End {
    at: Parameters,
    chi2: f64,
    converged: bool,
}

/// Mode *sky-aware* for one pixel; arguments as for [`super::pixel`], whose answer is returned where fewer than two views
/// can be used. The covariances decide between the branches: they should be those of the noise.
#[must_use]
pub fn sky_aware(observations: &[Observation], x_axes: &[DVec3], sky: &SkyTable) -> Estimate {
    let (seen, count) = seen(observations, x_axes, sky);
    let mut start = Estimate::from(&solve_f64(&seen, count, sky));
    let problem = Problem::new(&seen[..count], sky);
    if problem.targets.len() < 2 {
        return start;
    }
    let mut starts = problem.starts(&start, &seen[..count]);
    starts.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut starts = starts.iter();
    let Some((first, _)) = starts.next() else { return start };
    let mut best = problem.descend(*first);
    let mut second = None;
    for (number, (at, _)) in starts.enumerate() {
        // The better starts always; the others where nothing fits yet.
        if number >= ALWAYS && best.chi2 < problem.expected_chi2() {
            break;
        }
        let end = problem.descend(*at);
        let (good, other) = if end.chi2 < best.chi2 { (end, best) } else { (best, end) };
        best = good;
        if normal(good.at).angle_between(normal(other.at)) > 0.02 && other.chi2 - good.chi2 < SECOND {
            second = Some(Reasons::SECOND_MINIMUM);
        }
    }
    problem.answer(&best, &mut start);
    start.reasons |= second.unwrap_or_default();
    start
}

fn normal(at: Parameters) -> DVec3 {
    DVec3::new(at.x, at.y, 1.0).normalize()
}

fn limited(at: Parameters) -> Parameters {
    let slope = DVec2::new(at.x, at.y).clamp_length_max(SLOPE);
    DVec3::new(slope.x, slope.y, at.z.clamp(ETA[0], ETA[1]))
}

impl<'a> Problem<'a> {
    fn new(seen: &[Seen<f64>], sky: &'a SkyTable) -> Self {
        let white = sky.white().map(|w| if w > 0.0 { 1.0 / w } else { 0.0 });
        let targets = seen.iter().filter_map(target).collect();
        Self { targets, sky, white }
    }

    /// Specular Stokes of one view for two values of η, in its frame; nothing where no light is mirrored.
    fn specular(&self, target: &Target, normal: DVec3, eta: [f64; 2]) -> [Bands; 2] {
        let direction = target.direction;
        let cosine = normal.dot(direction);
        let mirrored = normal * (2.0 * cosine) - direction;
        if cosine <= 0.0 || mirrored.z <= 0.0 {
            return [[[0.0; 3]; BANDS]; 2];
        }
        let across = normal.cross(direction);
        let s = if across.length_squared() > 0.0 { across } else { direction.any_orthonormal_vector() };
        let into_plane = SkyTable::frame(mirrored).turn_to(s).inverse();
        let out_of_plane = target.frame.turn_to(s);
        let at = Incidence { cosine, sine_squared: across.length_squared() };
        let light = self.sky.stokes(mirrored);
        eta.map(|eta| {
            let Ok(ior) = Dielectric::new(eta) else { return [[0.0; 3]; BANDS] };
            let reflection = Reflection { into_plane, reflectance: ior.reflectance(at), out_of_plane };
            core::array::from_fn(|b| reflection.apply(light[b].map(|x| x * self.white[b])))
        })
    }

    /// Specular Stokes of every view and their derivatives by the three parameters.
    fn jacobian(&self, target: &Target, at: Parameters) -> (Bands, [Bands; 3]) {
        // Away from the end of the range.
        let step = if at.z + STEP_ETA > ETA[1] { -STEP_ETA } else { STEP_ETA };
        let [here, by_eta] = self.specular(target, normal(at), [at.z, at.z + step]);
        let quotient = |there: Bands, step: f64| -> Bands {
            core::array::from_fn(|b| core::array::from_fn(|k| (there[b][k] - here[b][k]) / step))
        };
        let [by_x, by_y] = [DVec3::X, DVec3::Y].map(|axis| {
            let [there, _] = self.specular(target, normal(at + axis * STEP_SLOPE), [at.z, at.z]);
            quotient(there, STEP_SLOPE)
        });
        (here, [by_x, by_y, quotient(by_eta, step)])
    }

    fn linear(&self, at: Parameters) -> Linear {
        let mut sum = Linear { chi2: 0.0, hessian: DMat3::ZERO, gradient: DVec3::ZERO };
        for target in &self.targets {
            let (here, by) = self.jacobian(target, at);
            for b in 0..BANDS {
                let [w11, w12, w22] = target.weight[b];
                let miss = [1, 2].map(|k| target.stokes[b][k] - here[b][k]);
                let rows = [1, 2].map(|k| DVec3::from_array(by.map(|p| p[b][k])));
                let weighted = [rows[0] * w11 + rows[1] * w12, rows[0] * w12 + rows[1] * w22];
                sum.chi2 += w11 * miss[0] * miss[0] + 2.0 * w12 * miss[0] * miss[1] + w22 * miss[1] * miss[1];
                for (row, weighted) in rows.iter().zip(&weighted) {
                    sum.hessian += DMat3::from_cols(*row * weighted.x, *row * weighted.y, *row * weighted.z);
                }
                sum.gradient += weighted[0] * miss[0] + weighted[1] * miss[1];
            }
        }
        sum
    }

    /// χ² of (s1, s2).
    fn chi2(&self, at: Parameters) -> f64 {
        let mut sum = 0.0;
        for target in &self.targets {
            let [here, _] = self.specular(target, normal(at), [at.z, at.z]);
            for ((measured, modeled), [w11, w12, w22]) in target.stokes.iter().zip(here).zip(target.weight) {
                let [x, y] = [1, 2].map(|k| measured[k] - modeled[k]);
                sum += w11 * x * x + 2.0 * w12 * x * y + w22 * y * y;
            }
        }
        sum
    }

    /// What χ² hardly exceeds where the model holds: its mean and five standard deviations.
    fn expected_chi2(&self) -> f64 {
        let bands = self.targets.iter().flat_map(|t| &t.weight).filter(|w| w[0] > 0.0);
        let freedom: f64 = bands.fold(0.0, |sum, _| sum + 2.0);
        freedom + 5.0 * (2.0 * freedom).sqrt()
    }

    /// Starts with their χ²: the closed normal, the mean normal, and what turned phases say; each with the best of a few η.
    fn starts(&self, closed: &Estimate, seen: &[Seen<f64>]) -> Vec<(Parameters, f64)> {
        let [x, y] = closed.facets.slope;
        let mut slopes = vec![[x, y], [0.0, 0.0]];
        let flips = slopes.iter().any(|[x, y]| self.flips(normal(DVec3::new(*x, *y, 0.0)), ETA_STARTS[1]));
        let mut usable = seen.iter().map(|view| (view, azimuth(view))).filter(|(_, (_, known))| *known > 0.0);
        if let (true, Some(first), Some(second)) = (flips, usable.next(), usable.next()) {
            for flips in [[true, false], [false, true], [true, true]] {
                let pair = [(first, flips[0]), (second, flips[1])];
                let turned = pair.map(|((view, (azimuth, _)), flip)| turned(&azimuth, view, flip));
                let found = intersect(&turned, &pair.map(|((view, _), _)| view.direction), &[1.0, 1.0]);
                let [x, y, z] = found.normal;
                slopes.push([x / z, y / z]);
            }
        }
        let start = |[x, y]: [f64; 2]| {
            let tried = ETA_STARTS.map(|eta| limited(DVec3::new(x, y, eta))).map(|at| (at, self.chi2(at)));
            tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
        };
        slopes.into_iter().filter_map(start).collect()
    }

    /// Whether the light of some view is polarized nearly as much as a facet with this normal polarizes.
    fn flips(&self, normal: DVec3, eta: f64) -> bool {
        let Ok(ior) = Dielectric::new(eta) else { return false };
        self.targets.iter().any(|target| {
            let at = Incidence::between(normal, target.direction);
            let light = self.sky.stokes(normal * (2.0 * at.cosine) - target.direction);
            light.iter().any(|[l, q, u]| q.hypot(*u) > NEAR_FLIP * ior.specular_dolp(at) * l)
        })
    }

    /// Levenberg-Marquardt from one start.
    fn descend(&self, start: Parameters) -> End {
        let mut end = End { at: start, chi2: f64::INFINITY, converged: false };
        let mut damping = 1e-6;
        let mut here = self.linear(start);
        end.chi2 = here.chi2;
        for _ in 0..LIMIT {
            // What a full step would gain is little against the noise, or against what is left.
            let gain = (here.hessian + DMat3::from_diagonal(DVec3::splat(1e-9))).inverse() * here.gradient;
            if gain.dot(here.gradient) < 1e-6 + 1e-12 * end.chi2 {
                end.converged = true;
                break;
            }
            let scale = here.hessian.diagonal() * damping + DVec3::splat(1e-9);
            let damped = here.hessian + DMat3::from_diagonal(scale);
            let step = damped.inverse() * here.gradient;
            if !step.is_finite() {
                break;
            }
            let next = limited(end.at + step.clamp_length_max(0.5));
            let moved = (next - end.at).length();
            let there = self.linear(next);
            if there.chi2 < end.chi2 {
                (end.at, end.chi2, here) = (next, there.chi2, there);
                damping *= 0.1;
            } else {
                damping = (damping * 30.0).max(1e-3);
            }
            if moved < 1e-9 {
                // At a bound, or as near as the table's cells allow.
                end.converged = true;
                break;
            }
        }
        end
    }

    /// Writes η, normal, albedo and their σ at `end` over the start.
    fn answer(&self, end: &End, into: &mut Estimate) {
        let linear = self.linear(end.at);
        let covariance = linear.hessian.inverse();
        let determined = covariance.is_finite() && covariance.diagonal().min_element() > 0.0;
        let variance = if determined { covariance.diagonal() } else { DVec3::INFINITY };
        let n = normal(end.at);
        // Slopes to angle: across the tilt n_z, along it n_z²; n_z² · (σ_x² + σ_y²) bounds both and meets them at n_z = 1.
        let normal_rad = n.z * (variance.x + variance.y).sqrt();
        into.facets = Facets { eta: end.at.z, alpha: into.facets.alpha, slope: [end.at.x, end.at.y] };
        let parts: Vec<(Bands, [Bands; 3])> = self.targets.iter().map(|t| self.jacobian(t, end.at)).collect();
        let mut bound = false;
        let mut albedo_known = true;
        for b in 0..BANDS {
            let weights =
                self.targets.iter().map(|t| if t.weight[b][0] > 0.0 { 1.0 / t.covariance[b][0] } else { 0.0 });
            let weights: Vec<f64> = weights.collect();
            let total: f64 = weights.iter().sum();
            let light = self.sky.irradiance(b, n.to_array());
            if total <= 0.0 {
                (into.albedo[b], into.sigma.albedo[b], albedo_known) = (0.5, f64::INFINITY, false);
                continue;
            }
            let (mut diffuse, mut by) = (0.0, DVec3::ZERO);
            for ((target, weight), (here, derivative)) in self.targets.iter().zip(&weights).zip(&parts) {
                let share = weight / total;
                diffuse += share * (target.stokes[b][0] - here[b][0]);
                by -= DVec3::from_array(derivative.map(|d| d[b][0])) * share;
            }
            let raw = diffuse / light;
            // A tilted sample gets other light: δρ = −ρ δE/E.
            for (k, axis) in [DVec3::X, DVec3::Y].into_iter().enumerate() {
                let step = normal(end.at + axis * STEP_SLOPE) - n;
                by[k] -= raw * self.sky.irradiance_along(b, step.to_array()) / STEP_SLOPE;
            }
            bound |= !(0.0..=1.0).contains(&raw);
            into.albedo[b] = raw.clamp(0.0, 1.0);
            // δparameters = H⁻¹ Jᵀ W δ(s1, s2): row of δdiffuse by way of them.
            let row = covariance * by;
            let mut sum = 0.0;
            for ((target, weight), (_, derivative)) in self.targets.iter().zip(&weights).zip(&parts) {
                for k in 0..BANDS {
                    let [w11, w12, w22] = target.weight[k];
                    let [a, c] = [1, 2].map(|s| DVec3::from_array(derivative.map(|d| d[k][s])).dot(row));
                    let own = if k == b { weight / total } else { 0.0 };
                    sum += quadratic([own, a * w11 + c * w12, a * w12 + c * w22], target.covariance[k]);
                }
            }
            into.sigma.albedo[b] =
                if determined && sum.is_finite() { sum.max(0.0).sqrt() / light } else { f64::INFINITY };
            albedo_known &= into.sigma.albedo[b] < 0.1;
        }
        into.sigma.eta = variance.z.sqrt();
        into.sigma.normal_rad = normal_rad;
        let lit = parts.iter().any(|(here, _)| here.iter().any(|s| s[0] > 0.0));
        bound |= end.at.z <= ETA[0] || end.at.z >= ETA[1];
        let kept = Reasons::TOO_DARK | Reasons::OUTSIDE_MODEL | Reasons::ROUGHNESS;
        let mut reasons = Reasons(into.reasons.0 & kept.0);
        for (set, reason) in [
            (into.sigma.eta.is_nan() || into.sigma.eta > 0.25, Reasons::INDEX),
            (normal_rad.is_nan() || normal_rad > 0.35, Reasons::NORMAL),
            (!albedo_known, Reasons::ALBEDO),
            (!end.converged, Reasons::NOT_CONVERGED),
            (bound, Reasons::AT_BOUND),
            (!lit, Reasons::NO_MIRRORED_LIGHT),
        ] {
            if set {
                reasons |= reason;
            }
        }
        into.reasons = reasons;
    }
}

/// `azimuth`, or the one 90° off.
fn turned(azimuth: &Azimuth<f64>, seen: &Seen<f64>, flip: bool) -> Azimuth<f64> {
    let double = if flip { azimuth.double.map(|x| -x) } else { azimuth.double };
    Azimuth { double, axis: axis(seen.x, seen.y, double), variance: azimuth.variance }
}

/// gᵀ C g.
fn quadratic(g: [f64; 3], [c00, c01, c02, c11, c12, c22]: [f64; 6]) -> f64 {
    g[0] * g[0] * c00
        + g[1] * g[1] * c11
        + g[2] * g[2] * c22
        + 2.0 * (g[0] * g[1] * c01 + g[0] * g[2] * c02 + g[1] * g[2] * c12)
}

/// A view as a target, if any band of it says something.
fn target(seen: &Seen<f64>) -> Option<Target> {
    let mut target = Target {
        direction: DVec3::from_array(seen.direction),
        frame: Frame { x: DVec3::from_array(seen.x), y: DVec3::from_array(seen.y) },
        stokes: [[0.0; 3]; BANDS],
        weight: [[0.0; 3]; BANDS],
        covariance: [[0.0; 6]; BANDS],
    };
    let mut any = false;
    for b in 0..BANDS {
        let (s, mut c) = (seen.stokes[b], seen.covariance[b]);
        // As in the closed mode: finite, above three sigma, and never quite without noise.
        if !(s.iter().chain(&c).all(|x| x.abs() < 1e12) && s[0] > 3.0 * c[0].max(0.0).sqrt() + 1e-6) {
            continue;
        }
        let floor = (1e-5 * s[0]).powi(2) + 1e-14;
        for k in [0, 3, 5] {
            c[k] = c[k].max(0.0) + floor;
        }
        let determinant = c[3] * c[5] - c[4] * c[4];
        if determinant > 0.0 {
            (target.stokes[b], target.covariance[b]) = (s, c);
            target.weight[b] = [c[5] / determinant, -c[4] / determinant, c[3] / determinant];
            any = true;
        }
    }
    any.then_some(target)
}
