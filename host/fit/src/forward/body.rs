//! The diffuse term: irradiance tabulated over normals (and η), and what leaves towards the camera in closed form.

use super::chart::{Chart, Extent};
use super::numbers::{real, single};
use super::respond::Oriented;
use super::spline::{Axis, interpolate};
use super::{Body, IndexRange, TableOptions};
use crate::light::KnownLight;
use crate::material::{Response, by};
use core::f64::consts::{FRAC_1_PI, PI};
use glam::DVec3;
use host_optics::prefilter::irradiance;
use host_optics::{Dielectric, Incidence, Ior, OpticsError};
use rayon::prelude::*;

/// Step of the grid over normals, radians: irradiance changes no faster than a cosine but at its own terminator.
const STEP: f64 = 0.1;
/// Indices at which transmitted irradiance is known: a cubic through them errs by less than 1e-4 over [1.1, 2.3].
const INDICES: usize = 4;
/// Numbers of one index at one node: R, G, B and one that is not used.
const WIDTH: usize = 4;
/// Numbers of a node.
const STRIDE: usize = INDICES * WIDTH;

/// The diffuse term of every view of one light.
#[derive(Debug)]
pub(super) struct BodyTable {
    leaving: Leaving,
    normals: Chart,
    axes: [Axis; 2],
    /// Places of the polynomial in η; one if η does not matter.
    etas: Vec<f64>,
    /// Spline coefficients, \[y\]\[x\]\[η, band\].
    values: Vec<[f32; STRIDE]>,
}

#[derive(Clone, Copy, Debug)]
enum Leaving {
    Nothing,
    Evenly,
    ThroughInterface(Option<[Dielectric; 3]>),
}

impl BodyTable {
    /// Over slopes up to `slope` and η in `eta`.
    pub(super) fn new(
        light: &KnownLight,
        options: &TableOptions,
        slope: f64,
        eta: [f64; 2],
    ) -> Result<Self, OpticsError> {
        let fixed = match options.index {
            IndexRange::Free(_) => None,
            IndexRange::Fixed(bands) => Some(bands),
        };
        let dielectrics = fixed.map(|bands| bands.map(|b| if let Ior::Dielectric(d) = b { Some(d) } else { None }));
        let leaving = match (options.body, dielectrics) {
            (Body::Lambert, _) => Leaving::Evenly,
            (Body::Interface, None) => Leaving::ThroughInterface(None),
            (Body::Interface, Some([Some(r), Some(g), Some(b)])) => Leaving::ThroughInterface(Some([r, g, b])),
            (Body::Interface, Some(_)) => Leaving::Nothing,
        };
        let count = if matches!(leaving, Leaving::ThroughInterface(None)) { INDICES } else { 1 };
        let node = |j: usize| {
            let x = (PI * (real(j) + 0.5) / real(count)).cos();
            0.5 * (eta[0] + eta[1]) + 0.5 * (eta[1] - eta[0]) * x
        };
        let etas: Vec<f64> = (0..count).map(node).collect();
        let bodies: Vec<Option<[Dielectric; 3]>> = match leaving {
            Leaving::ThroughInterface(None) => {
                etas.iter().map(|eta| Dielectric::new(*eta).map(|d| Some([d; 3]))).collect::<Result<_, _>>()?
            }
            Leaving::ThroughInterface(fixed) => vec![fixed],
            Leaving::Evenly | Leaving::Nothing => vec![None],
        };
        let normals = Chart::about(DVec3::Z, DVec3::X);
        let mut extent = Extent::EMPTY;
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            extent.add(normals.project(DVec3::new(x * slope, y * slope, 1.0).normalize()));
        }
        let axes = [0, 1].map(|k| Axis::over([extent.low[k] - 1e-3, extent.high[k] + 1e-3], STEP, 2));
        let mut table = Self { leaving, normals, axes, etas, values: Vec::new() };
        if !matches!(leaving, Leaving::Nothing) {
            table.fill(light, &bodies);
        }
        Ok(table)
    }

    fn fill(&mut self, light: &KnownLight, bodies: &[Option<[Dielectric; 3]>]) {
        let [x, y] = self.axes;
        let node = |at: usize| {
            let normal = self.normals.direction([x.at(at % x.nodes), y.at(at / x.nodes)]);
            let mut out = [0.0; STRIDE];
            for (body, out) in bodies.iter().zip(out.chunks_exact_mut(WIDTH)) {
                let e = irradiance(light.pyramid(), light.sources(), *body, normal);
                out[..3].copy_from_slice(&e.map(single));
            }
            out
        };
        let mut values: Vec<_> = (0..x.nodes * y.nodes).into_par_iter().map(node).collect();
        for row in values.chunks_exact_mut(x.nodes) {
            interpolate(row.as_flattened_mut(), x.nodes, STRIDE, STRIDE);
        }
        interpolate(values.as_flattened_mut(), y.nodes, x.nodes * STRIDE, x.nodes * STRIDE);
        self.values = values;
    }

    pub(super) fn len(&self) -> usize {
        self.values.len() * STRIDE
    }

    /// Adds the diffuse part and its derivatives.
    pub(super) fn add(&self, out: &mut Response, wo: DVec3, camera_x: DVec3, at: &Oriented, [eta, keep_eta]: [f64; 2]) {
        match self.leaving {
            Leaving::Nothing => {}
            Leaving::Evenly => {
                let e = self.irradiance(at, eta);
                let [value, _, by_x, by_y] = e.map(|e| e.map(|e| FRAC_1_PI * e));
                for (k, value) in value.into_iter().enumerate() {
                    out.diffuse[3 * k] = value;
                    out.diffuse_by[by::SLOPE_X][3 * k] = by_x[k];
                    out.diffuse_by[by::SLOPE_Y][3 * k] = by_y[k];
                }
            }
            Leaving::ThroughInterface(fixed) => {
                let e = self.irradiance(at, eta);
                let own = |index: f64| Emission::new(index, wo, camera_x, at);
                let bands = match fixed {
                    None => [own(eta); 3],
                    Some(bands) => bands.map(|b| own(b.eta())),
                };
                for (k, emission) in bands.iter().enumerate() {
                    let e = e.map(|e| FRAC_1_PI * e[k]);
                    for s in 0..3 {
                        let lane = 3 * k + s;
                        let value = emission.value[s];
                        out.diffuse[lane] = e[0] * value;
                        if fixed.is_none() {
                            let change = e[1] * value + e[0] * emission.by_eta[s];
                            out.diffuse_by[by::ETA][lane] = keep_eta * change;
                        }
                        for (axis, by) in [by::SLOPE_X, by::SLOPE_Y].into_iter().enumerate() {
                            out.diffuse_by[by][lane] = e[2 + axis] * value + e[0] * emission.by_slope[axis][s];
                        }
                    }
                }
            }
        }
    }

    /// E of three bands, and its derivatives by η and by the two slopes.
    fn irradiance(&self, at: &Oriented, eta: f64) -> [[f64; 3]; 4] {
        let [place, by_x, by_y] = self.normals.project_with(at.normal, at.by);
        let [x, y] = [0, 1].map(|k| self.axes[k].place(place[k]));
        let mut sums = [[0.0_f32; STRIDE]; 3];
        for j in 0..3 {
            let start = (y.first + j) * self.axes[0].nodes + x.first;
            let nodes = &self.values[start..start + 3];
            for l in 0..STRIDE {
                let [a, b, c] = [nodes[0][l], nodes[1][l], nodes[2][l]];
                let value = x.weights[0] * a + x.weights[1] * b + x.weights[2] * c;
                let slope = x.slopes[0] * a + x.slopes[1] * b + x.slopes[2] * c;
                sums[0][l] += y.weights[j] * value;
                sums[1][l] += y.weights[j] * slope;
                sums[2][l] += y.slopes[j] * value;
            }
        }
        let mut out = [[0.0; 3]; 4];
        for (j, [weight, slope]) in self.basis(eta).into_iter().enumerate().take(self.etas.len()) {
            for k in 0..3 {
                let [value, along_x, along_y] = sums.map(|s| f64::from(s[WIDTH * j + k]));
                out[0][k] += weight * value;
                out[1][k] += slope * value;
                out[2][k] += weight * (along_x * by_x[0] + along_y * by_x[1]);
                out[3][k] += weight * (along_x * by_y[0] + along_y * by_y[1]);
            }
        }
        out
    }

    /// Lagrange's polynomials in η and their derivatives.
    fn basis(&self, eta: f64) -> [[f64; 2]; INDICES] {
        let mut out = [[0.0; 2]; INDICES];
        for (j, (own, o)) in self.etas.iter().zip(&mut out).enumerate() {
            let (mut value, mut slope) = (1.0, 0.0);
            for other in self.etas.iter().enumerate().filter(|(k, _)| *k != j).map(|(_, other)| other) {
                let scale = 1.0 / (own - other);
                slope = (slope * (eta - other) + value) * scale;
                value *= (eta - other) * scale;
            }
            *o = [value, slope];
        }
        out
    }
}

/// Stokes leaving towards ω_o for a transmitted irradiance of π ([`host_optics::diffuse::transmitted_row`]), in the camera frame.
#[derive(Clone, Copy)]
struct Emission {
    value: [f64; 3],
    by_eta: [f64; 3],
    by_slope: [[f64; 3]; 2],
}

impl Emission {
    /// (T⊥ + T∥)/2 and g sin² θ (cos 2φ, sin 2φ) with g = −(R⊥ − R∥)/(2 sin² θ) = −2 R⊥ c q/(cq + s²)², smooth at the normal.
    /// With x = x_cam − (x_cam·ω_o) ω_o, sin² θ (cos 2φ, sin 2φ) |x|² = (a² − b², 2ab), a = (n × ω_o)·x, b = −n·x.
    fn new(eta: f64, wo: DVec3, camera_x: DVec3, at: &Oriented) -> Self {
        let c = at.cosine;
        let incidence = Incidence::between(at.normal, wo);
        // An interface without contrast transmits everything.
        let Ok(ior) = Dielectric::new(eta.max(1.0 + 1e-9)) else {
            return Self { value: [0.0; 3], by_eta: [0.0; 3], by_slope: [[0.0; 3]; 2] };
        };
        let eta = ior.eta();
        let r = ior.reflectance(incidence);
        let t = ior.t(incidence);
        let gradient = ior.gradient(incidence);
        let mean_by = |perpendicular: f64, by_t: f64| -0.5 * perpendicular * (1.0 + t * t) - r.perpendicular * t * by_t;
        let mean = 0.5 * ior.transmittance(incidence).iter().sum::<f64>();
        let mean_by_eta = mean_by(gradient.perpendicular_by_eta, gradient.t_by_eta);
        let mean_by_c = mean_by(gradient.perpendicular_by_cosine, gradient.t_by_cosine);
        let contrast = (eta - 1.0) * (eta + 1.0);
        let q = (contrast + c * c).sqrt();
        let below = c * q + incidence.sine_squared;
        let g = -2.0 * r.perpendicular * c * q / (below * below);
        let g_by_c = g * (1.0 / c - 4.0 / q + c / (q * q) - 2.0 * (q + c * c / q - 2.0 * c) / below);
        let g_by_eta = g * (4.0 * eta * c / (contrast * q) + eta / (q * q) - 2.0 * c * eta / (q * below));
        let x = camera_x - wo * camera_x.dot(wo);
        let scale = 1.0 / x.length_squared().max(1e-12);
        let (a, b) = (at.normal.cross(wo).dot(x), -at.normal.dot(x));
        let (along, across) = ((a - b) * (a + b) * scale, 2.0 * a * b * scale);
        let by_slope = at.by.map(|d| {
            let dc = d.dot(wo);
            let (da, db) = (d.cross(wo).dot(x), -d.dot(x));
            let d_along = 2.0 * (a * da - b * db) * scale;
            let d_across = 2.0 * (a * db + b * da) * scale;
            [mean_by_c * dc, g_by_c * dc * along + g * d_along, g_by_c * dc * across + g * d_across]
        });
        Self {
            value: [mean, g * along, g * across],
            by_eta: [mean_by_eta, g_by_eta * along, g_by_eta * across],
            by_slope,
        }
    }
}
