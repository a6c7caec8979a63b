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

/// Of up to so many rows one, and at least so many, are looked at for a surface's mean normal and view.
const SKIP: usize = 32;

/// Pixels of a row that differ in nothing but ω_o are taken together, up to so many: enough to save work, few enough for the
/// box around their ω_o to be small.
const RUN: usize = 32;

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
    /// No normal is farther from the mean, as a chord (about radians). Like every extent here an upper bound that is met, or all but
    /// met: equal pixels are taken together.
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
        let mut total = totals(&lines, SKIP.min(lines.len() / SKIP).max(1), surfaces);
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
                let mut rest = *line;
                while let Some(first) = rest.first() {
                    let (run, views) = Views::of_run(rest);
                    let k = usize::from(first.surface);
                    if let (Some(b), Some(c)) = (boxes.get_mut(k), centers.get(k)) {
                        b.add_run(run, &views, row, c, &view_chart);
                    }
                    rest = &rest[run.len()..];
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
        let width = self.map.width.max(1);
        let [first, end] = self.extent.rows;
        let own = self.map.pixels.get(first * width..(end * width).min(self.map.pixels.len())).unwrap_or_default();
        let facing = |p: &Pixel| {
            let (n, o) = (Vec3::from(p.normal), Vec3::from(p.to_camera));
            (p.surface == self.surface && n.dot(o) > 0.0).then_some((n, o))
        };
        // So many pixels are looked at, an odd number apart, out of step with rows of even width; of a surface that is rarely
        // hit, all.
        let stride = (own.len() / (4 * count.max(1))) | 1;
        let mut found: Vec<_> = own.iter().skip(stride / 2).step_by(stride).filter_map(facing).collect();
        if found.len() < count {
            found = own.iter().filter_map(facing).collect();
        }
        let thin = (found.len() / count.max(1)).max(1);
        found.into_iter().skip(thin / 2).step_by(thin).collect()
    }

    /// Up to `count` pixels whose mirrored ray is within `reach` (a chord) of a direction; one at least.
    pub(crate) fn mirroring(self, direction: DVec3, reach: f64, count: usize) -> Vec<(Vec3, Vec3)> {
        let target = single3(direction);
        let far = |(n, o): &(Vec3, Vec3)| (*n * (2.0 * n.dot(*o)) - *o).distance_squared(target);
        let all: Vec<_> = self.rows().map(|at| (far(&at), at)).collect();
        let reach = super::numbers::single(reach * reach);
        let near: Vec<_> = all.iter().filter(|(d, _)| *d <= reach).map(|(_, at)| *at).collect();
        let thin = (near.len() / count.max(1)).max(1);
        let nearest = all.iter().min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, at)| *at);
        nearest.into_iter().chain(near.into_iter().skip(thin / 2).step_by(thin)).collect()
    }
}

/// Box around the ω_o of some pixels, by component.
struct Views {
    low: Vec3,
    high: Vec3,
}

impl Views {
    /// The first pixels of `line` that differ in nothing but ω_o, at most [`RUN`].
    #[inline]
    fn of_run(line: &[Pixel]) -> (&[Pixel], Self) {
        let first = line[0];
        let key = |p: &Pixel| {
            let [nx, ny, nz] = p.normal.map(f32::to_bits);
            let [r, g, b] = p.albedo.map(f32::to_bits);
            ([nx, ny, nz, r], [g, b, u32::from(p.surface)])
        };
        let own = key(&first);
        let [mut low, mut high] = [first.to_camera; 2];
        let mut count = 0;
        for p in line.iter().take(RUN) {
            if key(p) != own {
                break;
            }
            for (k, x) in p.to_camera.into_iter().enumerate() {
                // Unlike f32::min and f32::max these are single instructions.
                low[k] = if x < low[k] { x } else { low[k] };
                high[k] = if x > high[k] { x } else { high[k] };
            }
            count += 1;
        }
        (&line[..count], Self { low: Vec3::from(low), high: Vec3::from(high) })
    }

    /// Range of ω_o·v.
    fn along(&self, v: Vec3) -> [f32; 2] {
        let (a, b) = (v * self.low, v * self.high);
        [a.min(b).element_sum(), a.max(b).element_sum()]
    }

    /// The largest squared distance from `center`.
    fn farthest(&self, center: Vec3) -> f32 {
        (self.low - center).abs().max((self.high - center).abs()).length_squared()
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

    /// Pixels that differ in nothing but ω_o, in `views`.
    fn add_run(&mut self, run: &[Pixel], views: &Views, row: usize, c: &Centers, view_chart: &Chart) {
        let normal = Vec3::from(run[0].normal);
        let cosine = views.along(normal);
        if run.len() < 4 || cosine[0] <= 0.0 {
            run.iter().for_each(|p| self.add(p, row, c, view_chart));
            return;
        }
        self.pixels += run.len();
        self.rows = [self.rows[0].min(row), self.rows[1].max(row + 1)];
        self.view.merge(&view_chart.project_box(|axis| views.along(axis)));
        self.normal_radius = self.normal_radius.max(normal.distance_squared(c.normal_single));
        self.view_radius = self.view_radius.max(views.farthest(c.view_single));
        self.cosine = [self.cosine[0].min(cosine[0]), self.cosine[1].max(cosine[1].min(1.0))];
        let [lowest, _] = views.along(normal * (2.0 * normal.z) - Vec3::Z);
        self.lowest_mirror = self.lowest_mirror.min(lowest);
        self.add_albedo(run[0].albedo);
    }

    fn add_albedo(&mut self, albedo: [f32; 3]) {
        for a in albedo {
            self.albedo = [self.albedo[0].min(a), self.albedo[1].max(a)];
        }
    }

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
        self.add_albedo(p.albedo);
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
