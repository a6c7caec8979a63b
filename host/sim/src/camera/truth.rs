//! Ground truth: what every pixel of a view sees, from the scene itself.

use host_image::{Encoding, Picture, Samples};
use host_optics::Ior;
use rayon::prelude::*;

use super::Pinhole;
use crate::scene::{Sample, SurfacePoint};

/// Truth maps of one view. Row-major, height × width, rows run down; pixels that miss the sample hold 0 in every map.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 on the sample, else 0.
    pub mask: Vec<f32>,
    /// (x, y, 0) on the sample, in m.
    pub position_m: Vec<[f32; 3]>,
    /// Index of the surface in [`Sample::surfaces`].
    pub surface: Vec<f32>,
    /// ρ_d at R, G, B.
    pub albedo: Vec<[f32; 3]>,
    /// Unit normal, in the world.
    pub normal: Vec<[f32; 3]>,
    /// GGX α.
    pub alpha: Vec<f32>,
    /// Re η at R, G, B.
    pub eta: Vec<[f32; 3]>,
    /// Im η at R, G, B; 0 for dielectrics.
    pub extinction: Vec<[f32; 3]>,
    /// Angle between the view and the normal, radians.
    pub incidence_rad: Vec<f32>,
}

#[derive(Clone, Copy, Default)]
struct Pixel {
    mask: f32,
    position: [f32; 3],
    surface: f32,
    albedo: [f32; 3],
    normal: [f32; 3],
    alpha: f32,
    eta: [f32; 3],
    extinction: [f32; 3],
    incidence: f32,
}

impl Truth {
    /// What `camera` sees of `sample` at the centers of its pixels.
    #[must_use]
    pub fn of(sample: &Sample, camera: &Pinhole) -> Self {
        let (width, height) = (camera.width, camera.height);
        let row = |row: usize| (0..width).map(move |column| pixel(sample, camera, row, column));
        let pixels: Vec<Pixel> = (0..height).into_par_iter().flat_map_iter(row).collect();
        let scalar = |get: fn(&Pixel) -> f32| pixels.iter().map(get).collect();
        let vector = |get: fn(&Pixel) -> [f32; 3]| pixels.iter().map(get).collect();
        Self {
            width,
            height,
            mask: scalar(|p| p.mask),
            position_m: vector(|p| p.position),
            surface: scalar(|p| p.surface),
            albedo: vector(|p| p.albedo),
            normal: vector(|p| p.normal),
            alpha: scalar(|p| p.alpha),
            eta: vector(|p| p.eta),
            extinction: vector(|p| p.extinction),
            incidence_rad: scalar(|p| p.incidence),
        }
    }

    /// Every map as a float picture, with the name its file should have.
    #[must_use]
    pub fn pictures(&self) -> Vec<(&'static str, Picture)> {
        let scalar = |map: &[f32]| self.picture(1, map.to_vec());
        let vector = |map: &[[f32; 3]]| self.picture(3, map.as_flattened().to_vec());
        vec![
            ("mask", scalar(&self.mask)),
            ("position_m", vector(&self.position_m)),
            ("surface", scalar(&self.surface)),
            ("albedo", vector(&self.albedo)),
            ("normal", vector(&self.normal)),
            ("alpha", scalar(&self.alpha)),
            ("eta", vector(&self.eta)),
            ("extinction", vector(&self.extinction)),
            ("incidence_rad", scalar(&self.incidence_rad)),
        ]
    }

    fn picture(&self, channels: usize, samples: Vec<f32>) -> Picture {
        let samples = Samples::F32(samples);
        Picture { width: self.width, height: self.height, channels, samples, encoding: Encoding::Linear }
    }
}

fn pixel(sample: &Sample, camera: &Pinhole, row: usize, column: usize) -> Pixel {
    let Some(point) = camera.plane_point(Pinhole::pixel(row, column)) else { return Pixel::default() };
    let (Some(SurfacePoint { surface, albedo, ior, alpha, normal }), Ok(view)) =
        (sample.at(point), camera.view_of(point))
    else {
        return Pixel::default();
    };
    let (eta, extinction) = (ior.map(|i| parts(i).0), ior.map(|i| parts(i).1));
    let incidence = normal.cross(view.direction).length().atan2(normal.dot(view.direction));
    Pixel {
        mask: 1.0,
        position: [single(point.x), single(point.y), 0.0],
        surface: f32::from(u16::try_from(surface).unwrap_or(u16::MAX)),
        albedo: albedo.map(single),
        normal: normal.to_array().map(single),
        alpha: single(alpha),
        eta: eta.map(single),
        extinction: extinction.map(single),
        incidence: single(incidence),
    }
}

fn parts(ior: Ior) -> (f64, f64) {
    match ior {
        Ior::Dielectric(d) => (d.eta(), 0.0),
        Ior::Conductor(c) => (c.n(), c.k()),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "maps are f32; rounding to nearest is meant")]
fn single(value: f64) -> f32 {
    value as f32
}
