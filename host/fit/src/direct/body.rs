//! The diffuse part of eq. 6 for ρ_d = 1 with its derivatives: Lambert, or the polarized body of `host_optics::diffuse`.

use super::polar::Polar;
use crate::material::by;
use core::f64::consts::FRAC_1_PI;
use glam::DVec3;
use host_optics::integral::View;
use host_optics::{Dielectric, Frame, Incidence, Light};

/// A Stokes vector and its derivatives by η and by the two slopes.
pub(super) type Diffuse = ([f64; 3], [[f64; 3]; 4]);

/// E(n)/π. E = n·F with the vector irradiance F = ∫ L ω dω, and ∂E/∂n = F: the weight is 0 at the horizon that moves.
pub(super) fn lambert(light: &impl Light, rule: &Polar, normal: DVec3, slopes: [DVec3; 2]) -> Diffuse {
    let [x, y, z] = rule.hemisphere(normal, |w| {
        let [l, ..] = light.stokes(w);
        (w * l).to_array()
    });
    let flux = DVec3::new(x, y, z) * FRAC_1_PI;
    let mut derivative = [[0.0; 3]; 4];
    derivative[by::SLOPE_X][0] = flux.dot(slopes[0]);
    derivative[by::SLOPE_Y][0] = flux.dot(slopes[1]);
    ([flux.dot(normal), 0.0, 0.0], derivative)
}

/// What the interface lets in, depolarized, and lets out towards the view.
pub(super) fn polarized(
    light: &impl Light,
    ior: Dielectric,
    rule: &Polar,
    normal: DVec3,
    slopes: [DVec3; 2],
    view: &View,
) -> Diffuse {
    // E_T, ∂/∂η, and ∂/∂n along both slopes.
    let inside = rule.hemisphere(normal, |w| {
        let s = light.stokes(w);
        let row = Row::new(ior, w, &Frame::sky(w), normal, slopes);
        let cosine = normal.dot(w);
        let passed = |row: &[f64; 3]| -> f64 { row.iter().zip(s).map(|(a, b)| a * b).sum() };
        let (value, by_eta, [by_x, by_y]) = (passed(&row.value), passed(&row.by_eta), row.by_slope.map(|r| passed(&r)));
        let moved = |k: usize| slopes[k].dot(w);
        [cosine * value, cosine * by_eta, cosine * by_x + moved(0) * value, cosine * by_y + moved(1) * value]
    });
    let out = Row::new(ior, view.direction, &view.frame, normal, slopes);
    let product = |outside: [f64; 3], change: f64| {
        [0, 1, 2].map(|k| FRAC_1_PI * (outside[k] * inside[0] + out.value[k] * change))
    };
    let mut derivative = [[0.0; 3]; 4];
    derivative[by::ETA] = product(out.by_eta, inside[1]);
    derivative[by::SLOPE_X] = product(out.by_slope[0], inside[2]);
    derivative[by::SLOPE_Y] = product(out.by_slope[1], inside[3]);
    (out.value.map(|x| FRAC_1_PI * x * inside[0]), derivative)
}

/// `host_optics::diffuse::transmitted_row` with its derivatives by η and along two changes of the normal.
struct Row {
    value: [f64; 3],
    by_eta: [f64; 3],
    by_slope: [[f64; 3]; 2],
}

impl Row {
    /// With a = (n × ω)·x, b = (n × ω)·y the row is [½(T⊥ + T∥), k (a² − b²), 2kab], k = −(R⊥ − R∥)/(2s²) = −2R⊥cq/(cq + s²)²:
    /// smooth at the normal, where the axis n × ω is lost.
    fn new(ior: Dielectric, w: DVec3, frame: &Frame, normal: DVec3, slopes: [DVec3; 2]) -> Self {
        let at = Incidence::between(normal, w);
        let c = at.cosine;
        let contrast = (ior.eta() - 1.0) * (ior.eta() + 1.0);
        let q = (contrast + c * c).sqrt();
        if c <= 0.0 || q <= 0.0 {
            return Self { value: [0.0; 3], by_eta: [0.0; 3], by_slope: [[0.0; 3]; 2] };
        }
        let [perpendicular, parallel] = ior.transmittance(at);
        let (r, t, g) = (ior.r_s(at).powi(2), ior.t(at), ior.gradient(at));
        // ½(T⊥ + T∥) = 1 − ½R⊥(1 + t²).
        let mean_by = |r_by: f64, t_by: f64| -0.5 * r_by * (1.0 + t * t) - r * t * t_by;
        let sum = c * q + at.sine_squared;
        let shape = -2.0 * c * q / (sum * sum);
        let k = r * shape;
        let q_by_eta = ior.eta() / q;
        let k_by_eta = g.perpendicular_by_eta * shape + k * q_by_eta * (1.0 / q - 2.0 * c / sum);
        let k_by_c =
            g.perpendicular_by_cosine * shape + k * (1.0 / c + c / (q * q) - 2.0 * (q + c * c / q - 2.0 * c) / sum);
        let axis = |n: DVec3| {
            let v = n.cross(w);
            [v.dot(frame.x), v.dot(frame.y)]
        };
        let [a, b] = axis(normal);
        let (cosine, sine) = ((a - b) * (a + b), 2.0 * a * b);
        let by_slope = slopes.map(|change| {
            let ([da, db], dc) = (axis(change), change.dot(w));
            [
                mean_by(g.perpendicular_by_cosine, g.t_by_cosine) * dc,
                k_by_c * dc * cosine + 2.0 * k * (a * da - b * db),
                k_by_c * dc * sine + 2.0 * k * (a * db + b * da),
            ]
        });
        Self {
            value: [0.5 * (perpendicular + parallel), k * cosine, k * sine],
            by_eta: [mean_by(g.perpendicular_by_eta, g.t_by_eta), k_by_eta * cosine, k_by_eta * sine],
            by_slope,
        }
    }
}
