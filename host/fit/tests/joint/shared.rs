//! Skies, views, noisy pixels, and the independent tables beside the checkout.

use core::f64::consts::TAU;
use glam::DVec3;
use host_fit::direct::Direct;
use host_fit::joint::Fit;
use host_fit::material::{BANDS, Facets, Forward, Observation};
use host_optics::sky::{ClearSky, Polarized, Rayleigh};
use serde_json::Value;
use std::path::{Path, PathBuf};

pub(crate) type Sky = Polarized<ClearSky, Rayleigh>;

/// The clear sky of the tables.
pub(crate) fn sky(sun: DVec3, max_dolp: f64) -> Sky {
    let sun = sun.normalize();
    Polarized {
        light: ClearSky { base: 0.6, horizon: 0.5, aureole: 2.0, width: 0.25, sun },
        pattern: Rayleigh::new(sun, max_dolp).unwrap(),
    }
}

/// The cases of a table, or `None` (said aloud) where there is no such folder.
pub(crate) fn table(name: &str) -> Option<Vec<Value>> {
    let root = std::env::var_os("BREWSTER_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(root.join("oracles/analytic").join(name)) else {
        println!("skipped: no ../shared");
        return None;
    };
    let file: Value = serde_json::from_str(&text).unwrap();
    Some(file["cases"].as_array().unwrap().clone())
}

/// A JSON number, or a decimal string with more digits than an f64 holds.
pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap()
}

pub(crate) fn vector(value: &Value) -> DVec3 {
    DVec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

/// Camera x axes and directions: two oblique views 90° apart in azimuth, one near the normal.
pub(crate) const CAMERAS: [DVec3; 3] =
    [DVec3::new(0.1, 1.0, 0.0), DVec3::new(1.0, -0.2, 0.1), DVec3::new(0.7, 0.7, 0.0)];
pub(crate) const DIRECTIONS: [DVec3; 3] =
    [DVec3::new(0.8, -0.1, 0.6), DVec3::new(-0.1, -0.82, 0.55), DVec3::new(-0.15, 0.1, 1.0)];

/// A rule cheap enough for thousands of fits; data and fit share its error.
pub(crate) fn direct() -> Direct<Sky> {
    direct_of(7)
}

/// A finer one, whose derivatives are closer to those of its values.
pub(crate) fn direct_of(order: u32) -> Direct<Sky> {
    Direct::new([sky(DVec3::new(0.6, 0.3, 0.5), 0.8); 3], CAMERAS.to_vec(), order)
}

/// A material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Truth {
    pub(crate) albedo: [f64; BANDS],
    pub(crate) facets: Facets,
}

impl Truth {
    /// In the order of `host_fit::joint::PARAMETERS`.
    pub(crate) fn parameters(&self) -> [f64; 7] {
        parameters(self.albedo, &self.facets)
    }

    /// What view number `view` along `direction` measures, with σ of `noise` times s0 and as many σ of error as `error` says.
    #[expect(clippy::cast_possible_truncation, reason = "a pixel is f32")]
    pub(crate) fn observed(
        &self,
        forward: &impl Forward,
        view: usize,
        direction: DVec3,
        noise: f64,
        mut error: impl FnMut() -> f64,
    ) -> Observation {
        let direction = direction.normalize();
        let r = forward.response(view, direction, &self.facets);
        let mut out = Observation { view, direction, stokes: [[0.0; 3]; 3], covariance: [[0.0; 6]; 3] };
        for band in 0..BANDS {
            let s = [0, 1, 2].map(|k| r.specular[3 * band + k] + self.albedo[band] * r.diffuse[3 * band + k]);
            let sigma = noise * s[0].max(1e-9);
            out.stokes[band] = s.map(|s| (s + sigma * error()) as f32);
            let variance = (sigma * sigma) as f32;
            out.covariance[band] = [variance, 0.0, 0.0, variance, 0.0, variance];
        }
        out
    }

    /// All of [`DIRECTIONS`] up to `views`.
    pub(crate) fn pixel(
        &self,
        forward: &impl Forward,
        views: usize,
        noise: f64,
        mut error: impl FnMut() -> f64,
    ) -> Vec<Observation> {
        let directions = DIRECTIONS.iter().enumerate().take(views);
        directions.map(|(view, w)| self.observed(forward, view, *w, noise, &mut error)).collect()
    }
}

/// In the order of `host_fit::joint::PARAMETERS`.
pub(crate) fn parameters([r, g, b]: [f64; 3], facets: &Facets) -> [f64; 7] {
    let n = facets.normal();
    [r, g, b, facets.eta, facets.alpha, n.x, n.y]
}

/// Every number of an answer: none may be NaN.
pub(crate) fn numbers(fit: &Fit) -> Vec<f64> {
    let mut all = parameters(fit.albedo, &fit.facets).to_vec();
    all.extend(fit.covariance.as_flattened());
    all.extend([fit.normal_sigma_deg, fit.chi2, fit.alpha_interval[0], fit.alpha_interval[1]]);
    if let Some(second) = fit.second {
        all.extend(parameters(second.albedo, &second.facets));
        all.push(second.chi2);
    }
    all
}

/// Deterministic random numbers: SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// In [0, 1).
    #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal, σ = 1 (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    pub(crate) fn material(&mut self, alpha: [f64; 2], albedo: [f64; 2]) -> Truth {
        Truth {
            albedo: [0; 3].map(|_| self.between(albedo[0], albedo[1])),
            facets: Facets {
                eta: self.between(1.35, 1.75),
                alpha: self.between(alpha[0], alpha[1]),
                slope: [self.between(-0.2, 0.2), self.between(-0.2, 0.2)],
            },
        }
    }
}
