//! What lights the sample: a sky through a table, and a sun by its points.

use glam::DVec3;
use host_optics::diffuse::transmitted_row;
use host_optics::integral::{View, lambert, polarized_diffuse};
use host_optics::prefilter::{Reflector, Rgb, Sources};
use host_optics::sky::SunDisk;
use host_optics::{Dielectric, Frame, Ior, Masking, PolarizedDiffuse};

use super::surface::{Material, Ranges};
use super::{RelightError, RelightOptions};
use crate::forward::{Body, IndexRange, TableOptions, Tables, ViewRays};
use crate::maps::PlaneRect;
use crate::material::{BANDS, Forward};
use crate::session::{Camera, LightSpec};

/// From this many of the disk's radii on a lobe does not see its size: the light is taken out of its center. Relative
/// error of the lobe's peak there: r²/(4α²) = 6e-4.
const WIDE_LOBE: f64 = 20.0;

/// Light on the sample as one camera sees its reflection.
#[derive(Debug)]
pub struct Illumination {
    camera_x: DVec3,
    sky: Option<Tables>,
    sun: Option<DiskLight>,
    body: Body,
    masking: Masking,
}

/// The disk of the sun.
#[derive(Debug)]
struct DiskLight {
    radius: f64,
    /// As 128 points.
    points: Sources,
    /// As one.
    center: Sources,
}

impl Illumination {
    /// Tables of the sky that cover `ranges`, seen on `plane` by `camera`.
    pub(super) fn new(
        light: &LightSpec,
        camera: &Camera,
        plane: &PlaneRect,
        ranges: &Ranges,
        options: &RelightOptions,
    ) -> Result<Self, RelightError> {
        let known = LightSpec { sun: None, ..light.clone() }.known()?;
        let lit = known.irradiance(DVec3::Z).into_iter().any(|e| e > 0.0);
        let sun = light.sun.map(DiskLight::new).filter(DiskLight::shines);
        if !lit && sun.is_none() {
            return Err(RelightError::NoLight);
        }
        let table = TableOptions {
            index: IndexRange::Free(ranges.eta),
            alpha: ranges.alpha,
            slope: ranges.slope,
            body: options.body,
            masking: options.masking,
            tolerance: options.tolerance,
            ..TableOptions::default()
        };
        let sky = if lit { Some(Tables::new(&known, &[rays(camera, plane)], &table)?) } else { None };
        Ok(Self { camera_x: camera.right(), sky, sun, body: options.body, masking: options.masking })
    }

    /// The sky's table.
    pub(super) fn sky(&self) -> Option<&Tables> {
        self.sky.as_ref()
    }

    /// \[R, G, B\]\[s0, s1, s2\] along unit `direction`.
    pub(super) fn reflected(&self, direction: DVec3, material: &Material) -> Rgb {
        let mut out = [[0.0; 3]; BANDS];
        if let Some(sky) = &self.sky {
            let response = sky.response(0, direction, &material.facets);
            for (band, stokes) in out.iter_mut().enumerate() {
                for (k, s) in stokes.iter_mut().enumerate() {
                    let lane = 3 * band + k;
                    *s = response.specular[lane] + material.albedo[band] * response.diffuse[lane];
                }
            }
        }
        if let Some(sun) = &self.sun {
            let more = self.under_sun(sun, direction, material);
            for (s, m) in out.iter_mut().flatten().zip(more.as_flattened()) {
                *s += m;
            }
        }
        out
    }

    /// Black for what has no frame or index, and where the surface faces away.
    fn under_sun(&self, sun: &DiskLight, direction: DVec3, material: &Material) -> Rgb {
        let black = [[0.0; 3]; BANDS];
        let facets = &material.facets;
        let normal = facets.normal();
        let made = (View::new(direction, self.camera_x), Dielectric::new(facets.eta));
        let (Ok(view), Ok(ior)) = made else { return black };
        let Ok(reflector) = Reflector::gray(Ior::Dielectric(ior), facets.alpha, self.masking) else { return black };
        if normal.dot(view.direction) <= 0.0 {
            return black;
        }
        let points = if facets.alpha > WIDE_LOBE * sun.radius { &sun.center } else { &sun.points };
        let mut out = reflector.sources(points, normal, &view);
        for (w, solid_angle) in &sun.center.points {
            let cosine = normal.dot(*w).max(0.0);
            for (band, stokes) in out.iter_mut().enumerate() {
                let (albedo, e) = (material.albedo[band], cosine * solid_angle * sun.center.radiance[band]);
                let diffuse = match self.body {
                    Body::Lambert => lambert(albedo, e),
                    Body::Interface => {
                        let [passed, ..] = transmitted_row(ior, *w, &Frame::sky(*w), normal);
                        polarized_diffuse(&PolarizedDiffuse { ior, albedo }, normal, &view, e * passed)
                    }
                };
                stokes.iter_mut().zip(diffuse).for_each(|(s, d)| *s += d);
            }
        }
        out
    }
}

impl DiskLight {
    fn new((disk, radiance): (SunDisk, [f64; 3])) -> Self {
        let points = disk.points();
        let center = points.iter().map(|(w, weight)| *w * *weight).sum::<DVec3>().normalize();
        let solid_angle = disk.solid_angle();
        // Ω = 4π sin²(r/2).
        let radius = 2.0 * (solid_angle / (4.0 * std::f64::consts::PI)).sqrt().min(1.0).asin();
        let center = Sources { points: vec![(center, solid_angle)], radiance };
        Self { radius, points: Sources { points, radiance }, center }
    }

    fn shines(&self) -> bool {
        let risen = self.center.points.iter().any(|(w, _)| w.z > 0.0);
        risen && self.center.radiance.iter().any(|l| *l > 0.0)
    }
}

/// Directions to the camera from the middle, the corners and the middles of the edges.
fn rays(camera: &Camera, plane: &PlaneRect) -> ViewRays {
    let PlaneRect { left, right, bottom, top } = *plane;
    let (x, y) = ([left, 0.5 * (left + right), right], [bottom, 0.5 * (bottom + top), top]);
    let rays = x.iter().flat_map(|x| y.iter().map(|y| camera.towards(glam::DVec2::new(*x, *y)))).collect();
    ViewRays { camera_x: camera.right(), rays }
}
