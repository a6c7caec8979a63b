//! One pass over a picture: where the pixels of each surface look, and how bright they may be.

use super::Pixel;
use super::chart::{Chart, Extent};
use super::numbers::single3;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The pixels of one view.
#[derive(Clone, Copy, Debug)]
pub struct PixelMap<'a> {
    /// Columns.
    pub width: usize,
    /// The camera's x axis in the world, of any length.
    pub camera_x: DVec3,
    /// Row-major; a whole number of rows.
    pub pixels: &'a [Pixel],
}

/// Of so many rows one is looked at for a surface's mean normal and view.
const SKIP: usize = 8;

/// What a view holds, surface by surface.
#[derive(Clone, Debug)]
pub struct Survey {
    pub(crate) view_chart: Chart,
    /// One per surface of the scene.
    pub surfaces: Vec<SurfaceExtent>,
}

/// The pixels of one surface that face the camera.
#[derive(Clone, Debug)]
pub struct SurfaceExtent {
    /// How many.
    pub pixels: usize,
    /// How many more show their back and stay black.
    pub hidden: usize,
    /// Unit mean of (a sample of) their normals.
    pub mean_normal: DVec3,
    /// No normal is farther from the mean, as a chord (about radians).
    pub normal_radius: f64,
    /// Unit mean of ω_o.
    pub mean_view: DVec3,
    /// No ω_o is farther from the mean, as a chord.
    pub view_radius: f64,
    /// Range of n·ω_o.
    pub cosine: [f64; 2],
    /// Least height ω_z of a mirrored ray.
    pub lowest_mirror: f64,
    /// Range of ρ_d over pixels and bands.
    pub albedo: [f64; 2],
    pub(crate) mirror_chart: Chart,
    pub(crate) normal_chart: Chart,
    pub(crate) view_chart: Chart,
    pub(crate) view: Extent,
    rows: [usize; 2],
}

/// The pixels of one surface, for what is built over them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixels<'a> {
    pub(crate) map: PixelMap<'a>,
    pub(crate) surface: u16,
    pub(crate) extent: &'a SurfaceExtent,
    pub(crate) mirror_chart: Chart,
    pub(crate) view_chart: Chart,
    pub(crate) view: Extent,
}

#[derive(Clone, Copy)]
struct Sums {
    pixels: usize,
    normal: DVec3,
    view: DVec3,
    mirror: DVec3,
}

#[derive(Clone, Copy)]
struct Boxes {
    pixels: usize,
    rows: [usize; 2],
    view: Extent,
    /// Squared chords.
    normal_radius: f32,
    view_radius: f32,
    cosine: [f32; 2],
    lowest_mirror: f32,
    albedo: [f32; 2],
    hidden: usize,
}

impl Survey {
    /// Of a view of a scene with `surfaces` surfaces. Pixels whose index is beyond them count as nothing.
    #[must_use]
    pub fn new(map: &PixelMap<'_>, surfaces: usize) -> Self {
        let width = map.width.max(1);
        let lines: Vec<&[Pixel]> = map.pixels.chunks(width).collect();
        // A few rows tell the centers; all of them if some surface is not among those.
        let mut total = totals(&lines, SKIP, surfaces);
        if total.iter().any(|s| s.pixels == 0) {
            total = totals(&lines, 1, surfaces);
        }
        let all = total.iter().fold(DVec3::ZERO, |v, s| v + s.view);
        let view_chart = Chart::about(all.try_normalize().unwrap_or(DVec3::Z));
        let centers: Vec<Centers> = total.iter().map(Centers::of).collect();
        let none = || vec![Boxes::EMPTY; surfaces];
        let boxes = lines
            .par_iter()
            .enumerate()
            .fold(none, |mut boxes, (row, line)| {
                for p in line.iter() {
                    let k = usize::from(p.surface);
                    if let (Some(b), Some(c)) = (boxes.get_mut(k), centers.get(k)) {
                        b.add(p, row, c, &view_chart);
                    }
                }
                boxes
            })
            .reduce(none, |mut a, b| {
                a.iter_mut().zip(&b).for_each(|(a, b)| a.merge(b));
                a
            });
        let extent = |(c, b): (&Centers, &Boxes)| SurfaceExtent {
            pixels: b.pixels,
            hidden: b.hidden,
            mean_normal: c.normal,
            normal_radius: f64::from(b.normal_radius.sqrt()),
            mean_view: c.view,
            view_radius: f64::from(b.view_radius.sqrt()),
            cosine: b.cosine.map(f64::from),
            lowest_mirror: f64::from(b.lowest_mirror),
            albedo: b.albedo.map(f64::from),
            mirror_chart: c.mirror_chart,
            normal_chart: c.normal_chart,
            view_chart,
            view: b.view,
            rows: b.rows,
        };
        Self { view_chart, surfaces: centers.iter().zip(&boxes).map(extent).collect() }
    }

    pub(crate) fn pixels<'a>(&'a self, map: &PixelMap<'a>, surface: usize) -> Option<Pixels<'a>> {
        let extent = self.surfaces.get(surface).filter(|e| e.pixels > 0)?;
        Some(Pixels {
            map: *map,
            surface: u16::try_from(surface).ok()?,
            extent,
            mirror_chart: extent.mirror_chart,
            view_chart: self.view_chart,
            view: extent.view,
        })
    }
}

impl<'a> Pixels<'a> {
    /// (normal, ω_o) of every pixel, by rows in parallel.
    pub(crate) fn rows(self) -> impl ParallelIterator<Item = (Vec3, Vec3)> + 'a {
        let width = self.map.width.max(1);
        let [first, end] = self.extent.rows;
        let lines = self.map.pixels.get(first * width..(end * width).min(self.map.pixels.len())).unwrap_or_default();
        lines.par_chunks(width).flat_map_iter(move |line| {
            let own = line.iter().filter(move |p| p.surface == self.surface);
            own.map(|p| (Vec3::from(p.normal), Vec3::from(p.to_camera))).filter(|(n, o)| n.dot(*o) > 0.0)
        })
    }

    /// Up to about `count` of them, spread over the picture.
    pub(crate) fn some(self, count: usize) -> Vec<(Vec3, Vec3)> {
        // A stride with the golden ratio in it does not fall in step with rows.
        let stride = (self.extent.pixels / count.max(1)).max(1);
        let own = self.map.pixels.iter().filter(|p| p.surface == self.surface);
        let facing = own.map(|p| (Vec3::from(p.normal), Vec3::from(p.to_camera))).filter(|(n, o)| n.dot(*o) > 0.0);
        facing.skip(stride / 2).step_by(stride).collect()
    }
}

struct Centers {
    normal: DVec3,
    view: DVec3,
    mirror_chart: Chart,
    normal_chart: Chart,
    normal_single: Vec3,
    view_single: Vec3,
}

impl Centers {
    fn of(s: &Sums) -> Self {
        let unit = |v: DVec3| v.try_normalize().unwrap_or(DVec3::Z);
        let (normal, view) = (unit(s.normal), unit(s.view));
        Self {
            normal,
            view,
            mirror_chart: Chart::about(unit(s.mirror)),
            normal_chart: Chart::about(normal),
            normal_single: single3(normal),
            view_single: single3(view),
        }
    }
}

impl Sums {
    const NONE: Self = Self { pixels: 0, normal: DVec3::ZERO, view: DVec3::ZERO, mirror: DVec3::ZERO };

    fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.normal += other.normal;
        self.view += other.view;
        self.mirror += other.mirror;
    }
}

/// Sums over every `skip`th row, added in the order of rows whatever the threads do.
fn totals(lines: &[&[Pixel]], skip: usize, surfaces: usize) -> Vec<Sums> {
    let chosen: Vec<&[Pixel]> = lines.iter().step_by(skip).copied().collect();
    let rows: Vec<Vec<Sums>> = chosen.par_iter().map(|line| sums(line, surfaces)).collect();
    let mut total = vec![Sums::NONE; surfaces];
    for row in &rows {
        for (t, s) in total.iter_mut().zip(row) {
            t.add(s);
        }
    }
    total
}

fn sums(line: &[Pixel], surfaces: usize) -> Vec<Sums> {
    let mut out = vec![(0_usize, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO); surfaces];
    for p in line {
        let Some(s) = out.get_mut(usize::from(p.surface)) else { continue };
        let (n, o) = (Vec3::from(p.normal), Vec3::from(p.to_camera));
        let cosine = n.dot(o);
        if cosine > 0.0 {
            *s = (s.0 + 1, s.1 + n, s.2 + o, s.3 + n * (2.0 * cosine) - o);
        }
    }
    out.into_iter()
        .map(|(pixels, n, o, m)| Sums { pixels, normal: n.as_dvec3(), view: o.as_dvec3(), mirror: m.as_dvec3() })
        .collect()
}

impl Boxes {
    const EMPTY: Self = Self {
        pixels: 0,
        rows: [usize::MAX, 0],
        view: Extent::EMPTY,
        normal_radius: 0.0,
        view_radius: 0.0,
        cosine: [f32::INFINITY, f32::NEG_INFINITY],
        lowest_mirror: f32::INFINITY,
        albedo: [f32::INFINITY, f32::NEG_INFINITY],
        hidden: 0,
    };

    fn add(&mut self, p: &Pixel, row: usize, c: &Centers, view_chart: &Chart) {
        let (n, o) = (Vec3::from(p.normal), Vec3::from(p.to_camera));
        let cosine = n.dot(o);
        if cosine <= 0.0 {
            self.hidden += 1;
            return;
        }
        self.pixels += 1;
        self.rows = [self.rows[0].min(row), self.rows[1].max(row + 1)];
        self.view.add(view_chart.project(o));
        self.normal_radius = self.normal_radius.max(n.distance_squared(c.normal_single));
        self.view_radius = self.view_radius.max(o.distance_squared(c.view_single));
        self.cosine = [self.cosine[0].min(cosine), self.cosine[1].max(cosine)];
        self.lowest_mirror = self.lowest_mirror.min(2.0 * cosine * n.z - o.z);
        for a in p.albedo {
            self.albedo = [self.albedo[0].min(a), self.albedo[1].max(a)];
        }
    }

    fn merge(&mut self, other: &Self) {
        self.hidden += other.hidden;
        self.pixels += other.pixels;
        self.rows = [self.rows[0].min(other.rows[0]), self.rows[1].max(other.rows[1])];
        self.view.merge(&other.view);
        self.normal_radius = self.normal_radius.max(other.normal_radius);
        self.view_radius = self.view_radius.max(other.view_radius);
        self.cosine = [self.cosine[0].min(other.cosine[0]), self.cosine[1].max(other.cosine[1])];
        self.lowest_mirror = self.lowest_mirror.min(other.lowest_mirror);
        self.albedo = [self.albedo[0].min(other.albedo[0]), self.albedo[1].max(other.albedo[1])];
    }
}
