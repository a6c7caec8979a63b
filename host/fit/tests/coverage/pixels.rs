//! Cameras around a sample, and what they measure of a material.

use core::f64::consts::TAU;
use glam::DVec3;
use host_fit::forward::{TableOptions, Tables, ViewRays};
use host_fit::light::KnownLight;
use host_fit::material::{BANDS, Facets, Observation};
use host_optics::integral::{self, FixedPoints, View};
use host_optics::{Dielectric, Ggx, Light, Masking, Microfacet, PolarizedDiffuse};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

/// A camera, in sides of the sample.
#[derive(Clone, Copy)]
pub(crate) struct Camera {
    pub(crate) position: DVec3,
    pub(crate) x_axis: DVec3,
}

/// ρ_d and the facets of a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Material {
    pub(crate) albedo: [f64; BANDS],
    pub(crate) facets: Facets,
}

impl Camera {
    /// Six sides away at `theta` and `azimuth`, degrees, with a level picture.
    pub(crate) fn at(theta: f64, azimuth: f64) -> Self {
        let ((s, c), (sine, cosine)) = (theta.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
        Self { position: DVec3::new(s * cosine, s * sine, c) * 6.0, x_axis: DVec3::new(-sine, cosine, 0.0) }
    }

    /// ω_o from a place on the sample, |x|, |y| <= ½.
    pub(crate) fn direction(&self, [x, y]: [f64; 2]) -> DVec3 {
        (self.position - DVec3::new(x, y, 0.0)).normalize()
    }

    /// The rays of a sample of unit side.
    fn rays(&self) -> ViewRays {
        let places = [[0.0, 0.0], [-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]];
        ViewRays { camera_x: self.x_axis, rays: places.map(|place| self.direction(place)).to_vec() }
    }
}

impl Material {
    /// In the order of `host_fit::joint::PARAMETERS`.
    pub(crate) fn parameters(&self) -> [f64; 7] {
        let ([r, g, b], n) = (self.albedo, self.facets.normal());
        [r, g, b, self.facets.eta, self.facets.alpha, n.x, n.y]
    }

    /// (s0, s1, s2) of every band along `direction`, with the polarized body under the interface.
    pub(crate) fn stokes<L: Light>(
        &self,
        lights: &[L; BANDS],
        rule: &FixedPoints,
        direction: DVec3,
        x_axis: DVec3,
    ) -> [[f64; 3]; BANDS] {
        let view = View::new(direction, x_axis).unwrap();
        let ior = Dielectric::new(self.facets.eta).unwrap();
        let ggx = Ggx::new(self.facets.alpha, Masking::HeightCorrelated).unwrap();
        let (surface, normal) = (Microfacet { ior: ior.into(), ggx }, self.facets.normal());
        core::array::from_fn(|band| {
            let light = &lights[band];
            let specular = rule.specular(light, &surface, normal, &view);
            let body = PolarizedDiffuse { ior, albedo: self.albedo[band] };
            let inside = rule.transmitted_irradiance(light, ior, normal);
            let diffuse = integral::polarized_diffuse(&body, normal, &view, inside);
            [0, 1, 2].map(|k| specular[k] + diffuse[k])
        })
    }

    /// What `cameras` measure at `place`, with σ of `noise` times s0 on every component, and as many σ of error as `error` says.
    pub(crate) fn pixel<L: Light>(
        &self,
        lights: &[L; BANDS],
        rule: &FixedPoints,
        (cameras, place): (&[Camera], [f64; 2]),
        noise: f64,
        mut error: impl FnMut() -> f64,
    ) -> Vec<Observation> {
        let one = |(view, camera): (usize, &Camera)| {
            let direction = camera.direction(place);
            let exact = self.stokes(lights, rule, direction, camera.x_axis);
            let sigma = exact.map(|s| noise * s[0]);
            let stokes = [0, 1, 2].map(|b| exact[b].map(|s| single(s + sigma[b] * error())));
            let covariance = sigma.map(|sigma| {
                let variance = single(sigma * sigma);
                [variance, 0.0, 0.0, variance, 0.0, variance]
            });
            Observation { view, direction, stokes, covariance }
        };
        cameras.iter().enumerate().map(one).collect()
    }
}

/// Tables for `lights` over a sample of unit side.
pub(crate) fn tables<L: Light + Clone + Send + Sync + 'static>(
    lights: &[L; BANDS],
    cameras: &[Camera],
    options: &TableOptions,
) -> Tables {
    let light = KnownLight::sampled(KnownLight::FORMULA_SIZE, lights.clone()).unwrap();
    let rays: Vec<ViewRays> = cameras.iter().map(Camera::rays).collect();
    Tables::new(&light, &rays, options).unwrap()
}

/// Random numbers, the same for the same seed.
pub(crate) struct Random(SmallRng);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SmallRng::seed_from_u64(seed))
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// Normal, σ = 1 (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (TAU * self.0.random::<f64>()).cos()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "images are f32")]
pub(crate) fn single(x: f64) -> f32 {
    x as f32
}
