//! Images are their pixels.

use crate::{Noise, clear, facet, single, table, towards};
use glam::DVec3;
use host_fit::closed::{Covariance, Grid, SurfacePlanes, ViewPlanes, pixel, planes, sky_aware, sky_aware_planes};
use host_fit::closed::{Estimate, Reasons, SkyTable};
use host_fit::material::Observation;
use host_fit::{FitError, UpperTriangle};
use host_optics::integral::View;

const WIDTH: usize = 13;
const HEIGHT: usize = 3;
const NOISE: UpperTriangle = [1e-6, 0.0, 1e-7, 2e-6, 0.0, 2e-6];

struct Scene {
    cameras: Vec<DVec3>,
    axes: Vec<DVec3>,
    grid: Grid,
    /// By view, band and component.
    stokes: Vec<[[Vec<f32>; 3]; 3]>,
    sky: SkyTable,
}

impl Scene {
    fn new(views: usize) -> Self {
        let lights = clear(0.3);
        let grid = Grid { origin: DVec3::new(-0.3, 0.1, 0.0), column: DVec3::X * 0.05, row: DVec3::Y * -0.05 };
        let cameras: Vec<DVec3> = [(56.0, 0.0), (56.0, 90.0), (20.0, 45.0), (50.0, 200.0)][..views]
            .iter()
            .map(|(t, a)| 4.0 * towards(*t, *a))
            .collect();
        let axes: Vec<DVec3> = cameras.iter().map(|w| crate::level(w.normalize())).collect();
        let mut random = Noise(5);
        let mut scene = Self { cameras, axes, grid, stokes: vec![Default::default(); views], sky: table(&lights) };
        for index in 0..WIDTH * HEIGHT {
            let normal = towards(8.0 * random.uniform(), 360.0 * random.uniform());
            let point = scene.point(index);
            for v in 0..views {
                let view = View::new(scene.cameras[v] - point, scene.axes[v]).unwrap();
                for (b, light) in lights.iter().enumerate() {
                    let s = facet(light, 1.5, normal, 0.2 + 0.2 * b as f64, &view);
                    for (plane, s) in scene.stokes[v][b].iter_mut().zip(s) {
                        plane.push(single(s + 1e-3 * random.normal()));
                    }
                }
            }
        }
        scene
    }

    fn point(&self, index: usize) -> DVec3 {
        self.grid.origin + self.grid.column * (index % WIDTH) as f64 + self.grid.row * (index / WIDTH) as f64
    }

    fn views<'a>(&'a self, covariance: Covariance<'a>) -> Vec<ViewPlanes<'a>> {
        let each = self.stokes.iter().zip(&self.cameras).zip(&self.axes);
        each.map(|((stokes, camera), axis)| ViewPlanes {
            camera: *camera,
            x_axis: *axis,
            stokes: stokes.each_ref().map(|band| band.each_ref().map(Vec::as_slice)),
            covariance,
        })
        .collect()
    }

    fn observations(&self, index: usize) -> Vec<Observation> {
        let each = self.stokes.iter().zip(&self.cameras).enumerate();
        each.map(|(view, (stokes, camera))| Observation {
            view,
            direction: (*camera - self.point(index)).normalize(),
            stokes: stokes.each_ref().map(|band| band.each_ref().map(|plane| plane[index])),
            covariance: [NOISE; 3],
        })
        .collect()
    }
}

fn same(found: &SurfacePlanes, index: usize, expected: &Estimate, tolerance: f64) {
    let near = |a: f32, b: f64, what: &str| {
        let fits = (f64::from(a) - b).abs() <= tolerance * (1.0 + b.abs()) || (f64::from(a) - b).is_nan();
        assert!(fits, "{what} of pixel {index}: {a} against {b}");
    };
    let n = expected.normal();
    for k in 0..3 {
        near(found.albedo[k][index], expected.albedo[k], "albedo");
        near(found.normal[k][index], n[k], "normal");
        near(found.sigma_albedo[k][index], expected.sigma.albedo[k], "sigma of the albedo");
    }
    near(found.eta[index], expected.facets.eta, "index");
    near(found.alpha[index], expected.facets.alpha, "roughness");
    near(found.sigma_eta[index], expected.sigma.eta, "sigma of the index");
    near(found.sigma_normal_rad[index], expected.sigma.normal_rad, "sigma of the normal");
    assert_eq!(Reasons(found.reasons[index]), expected.reasons);
}

#[test]
fn planes_are_their_pixels() {
    for views in 1..=4 {
        let scene = Scene::new(views);
        let closed = planes(&scene.views(Covariance::Same([NOISE; 3])), &scene.grid, WIDTH, &scene.sky).unwrap();
        let given = vec![NOISE; WIDTH * HEIGHT];
        let per_pixel = Covariance::Planes([given.as_slice(); 3]);
        assert_eq!(closed, planes(&scene.views(per_pixel), &scene.grid, WIDTH, &scene.sky).unwrap());
        let aware = sky_aware_planes(&scene.views(per_pixel), &scene.grid, WIDTH, &scene.sky).unwrap();
        for index in 0..WIDTH * HEIGHT {
            let seen = scene.observations(index);
            same(&closed, index, &pixel(&seen, &scene.axes, &scene.sky), 3e-5);
            same(&aware, index, &sky_aware(&seen, &scene.axes, &scene.sky), 1e-6);
        }
    }
}

#[test]
fn planes_that_do_not_fit_are_refused() {
    let scene = Scene::new(2);
    let mut views = scene.views(Covariance::Same([NOISE; 3]));
    let refused = |views: &[ViewPlanes<'_>], width| {
        let answer = planes(views, &scene.grid, width, &scene.sky);
        assert!(matches!(answer, Err(FitError::Size { .. })), "{answer:?}");
        assert_eq!(answer, sky_aware_planes(views, &scene.grid, width, &scene.sky));
    };
    refused(&[], WIDTH);
    refused(&views, WIDTH - 1);
    refused(&views, 0);
    refused(&vec![views[0]; 9], WIDTH);
    views[1].stokes[2][1] = &scene.stokes[0][0][0][1..];
    refused(&views, WIDTH);
    views[1] = ViewPlanes { covariance: Covariance::Planes([&[NOISE]; 3]), ..views[0] };
    refused(&views, WIDTH);
}
