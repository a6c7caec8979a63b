//! Making a view's table, and measuring what it is worth.

use super::body::BodyTable;
use super::cells::Cells;
use super::chart::{Chart, Extent};
use super::index::IndexBasis;
use super::lobe::{Geometry, Index, Mixture, Nine, sum};
use super::numbers::{count_above, real};
use super::solve::Design;
use super::spacing;
use super::spline::{Axis, interpolate};
use super::view::{BLOCK, Level, Limits, Patch, Patches, Soft, ViewTable};
use super::{IndexRange, TableOptions, ViewRays};
use crate::light::KnownLight;
use crate::material::Facets;
use glam::DVec3;
use host_optics::integral::View;
use host_optics::prefilter::{Fineness, Reflector};
use host_optics::{Dielectric, Ggx, Ior, OpticsError};
use rayon::prelude::*;

/// Half of the widest patch of ω_o over which a parabola holds, of the widest for a plane, and for a constant.
const PARABOLA: f64 = 0.13;
const PLANE: f64 = 0.012;
const CONSTANT: f64 = 1e-3;

/// What an integral at a node asks for.
pub(super) struct Maker<'a> {
    pub(super) light: &'a KnownLight,
    pub(super) camera_x: DVec3,
    pub(super) rays: Chart,
    pub(super) mirror: Chart,
    pub(super) patches: &'a Patches,
    pub(super) roughness: Axis,
    pub(super) indices: Vec<Index>,
    pub(super) options: &'a TableOptions,
    pub(super) fineness: f64,
}

/// Memory that nodes share, one after the other.
#[derive(Default)]
pub(super) struct Workspace {
    cells: Cells,
    geometry: Geometry,
    values: Vec<f32>,
}

/// The table of a view.
pub(super) fn view(light: &KnownLight, rays: &ViewRays, options: &TableOptions) -> Result<ViewTable, OpticsError> {
    let directions: Vec<DVec3> =
        rays.rays.iter().map(|r| host_optics::frames::direction(*r)).collect::<Result<_, _>>()?;
    let camera_x = host_optics::frames::direction(rays.camera_x)?;
    for ray in &directions {
        View::new(*ray, camera_x)?;
    }
    let center = host_optics::frames::direction(directions.iter().sum())?;
    let chart = Chart::about(center, camera_x);
    let mut extent = Extent::EMPTY;
    directions.iter().for_each(|d| extent.add(chart.project(*d)));
    let grid: [usize; 2] = core::array::from_fn(|k| count_above(extent.half(k) / PARABOLA));
    let patches = Patches { extent, grid, all: Vec::new() };
    let limits = limits(options);
    let index = match options.index {
        IndexRange::Free(_) => IndexBasis::new(limits.eta.reach(), options.tolerance)?,
        IndexRange::Fixed(_) => IndexBasis::new([1.5, 1.5], options.tolerance)?,
    };
    let indices: Vec<Index> = match options.index {
        IndexRange::Free(_) => index.nodes.iter().map(|n| Index::Gray(*n)).collect(),
        IndexRange::Fixed(bands) => vec![fixed(bands)],
    };
    // Splines in ln α err by 0.008 h³ f''' and their coefficients by h⁴ f''''/64, where a sun's image has f''' = 8.
    let step = (0.2 * (options.tolerance / 1e-3).cbrt()).clamp(0.05, 0.4);
    let maker = Maker {
        light,
        camera_x,
        rays: chart,
        mirror: Chart::about(DVec3::new(-center.x, -center.y, center.z), center),
        patches: &patches,
        roughness: Axis::over(limits.log_alpha.reach(), step, 1),
        indices,
        options,
        fineness: (8.0 * options.tolerance).sqrt().clamp(0.03, 0.3),
    };
    let blocks = (9 * maker.indices.len()).div_ceil(BLOCK);
    let all = maker.patches(blocks, &limits);
    let body = BodyTable::new(light, options, limits.slope.reach()[1], limits.eta.reach())?;
    let (mirror, roughness) = (maker.mirror, maker.roughness);
    Ok(ViewTable {
        camera_x,
        rays: chart,
        patches: Patches { all, ..patches },
        mirror,
        roughness,
        index,
        body,
        blocks,
        limits,
    })
}

fn limits(options: &TableOptions) -> Limits {
    let [low, high] = options.alpha.map(f64::ln);
    let eta = match options.index {
        IndexRange::Free([low, high]) => {
            // Below 1 there is no physics, at 1 no reflection.
            let margin = (0.05 * (high - low) + 0.01).min(0.9 * (low - 1.0)).max(1e-6);
            Soft { low, high, margin }
        }
        IndexRange::Fixed(_) => Soft { low: 1.5, high: 1.5, margin: 1e-6 },
    };
    Limits {
        slope: Soft { low: -options.slope, high: options.slope, margin: 0.1 * options.slope + 0.02 },
        log_alpha: Soft { low, high, margin: 0.1 },
        eta,
    }
}

fn fixed(bands: [Ior; 3]) -> Index {
    match bands {
        [Ior::Dielectric(r), Ior::Dielectric(g), Ior::Dielectric(b)] if r == g && g == b => Index::Gray(r),
        _ => Index::Bands(bands),
    }
}

impl Maker<'_> {
    fn patches(&self, blocks: usize, limits: &Limits) -> Vec<Patch> {
        let count = self.patches.grid[0] * self.patches.grid[1];
        let designs: Vec<Design> = (0..count)
            .map(|p| {
                let [_, half] = self.patches.place(p);
                let size = half[0].max(half[1]);
                Design::of(if size < CONSTANT {
                    1
                } else if size < PLANE {
                    3
                } else {
                    6
                })
            })
            .collect();
        let extents: Vec<Extent> = (0..count).map(|p| self.mirrored(p, limits.slope.reach()[1])).collect();
        let steps: Vec<Vec<[f64; 2]>> = extents.iter().enumerate().map(|(p, e)| spacing::choose(self, p, e)).collect();
        let bytes_per_node = |p: usize| designs[p].places.len() * blocks * BLOCK * core::mem::size_of::<f32>();
        // The finest grids give way until all fit.
        let axes = |finest: f64| -> Vec<Vec<[Axis; 2]>> {
            let level = |e: &Extent, s: &[f64; 2]| -> [Axis; 2] {
                core::array::from_fn(|k| Axis::over([e.low[k], e.high[k]], s[k].max(finest), 2))
            };
            extents.iter().zip(&steps).map(|(e, steps)| steps.iter().map(|s| level(e, s)).collect()).collect()
        };
        let bytes = |axes: &[Vec<[Axis; 2]>]| -> f64 {
            let nodes =
                |levels: &Vec<[Axis; 2]>| levels.iter().map(|[x, y]| real(x.nodes) * real(y.nodes)).sum::<f64>();
            axes.iter().enumerate().map(|(p, levels)| nodes(levels) * real(bytes_per_node(p))).sum()
        };
        let mut finest = 1e-4;
        let mut grids = axes(finest);
        while bytes(&grids) > real(self.options.memory_bytes) && finest < 1.0 {
            finest *= 1.1;
            grids = axes(finest);
        }
        let patch = |(p, levels): (usize, Vec<[Axis; 2]>)| Patch {
            terms: designs[p].places.len(),
            levels: levels
                .into_iter()
                .enumerate()
                .map(|(node, axes)| self.level(p, node, axes, &designs[p], blocks))
                .collect(),
        };
        grids.into_iter().enumerate().map(patch).collect()
    }

    /// Where the mirror directions of a patch go.
    fn mirrored(&self, patch: usize, slope: f64) -> Extent {
        let [middle, half] = self.patches.place(patch);
        let mut extent = Extent::EMPTY;
        for corner in [[0.0, 0.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let wo = self.ray(middle, half, corner);
            for k in 0..17 * 17 {
                let share = |i: usize| slope * (real(i) / 8.0 - 1.0);
                let n = DVec3::new(share(k % 17), share(k / 17), 1.0).normalize();
                let cosine = n.dot(wo);
                if cosine > 0.05 {
                    extent.add(self.mirror.project(n * (2.0 * cosine) - wo));
                }
            }
        }
        if extent.low[0] > extent.high[0] {
            extent.add([0.0; 2]);
        }
        extent
    }

    fn ray(&self, middle: [f64; 2], half: [f64; 2], within: [f64; 2]) -> DVec3 {
        self.rays.direction([middle[0] + half[0] * within[0], middle[1] + half[1] * within[1]])
    }

    /// The lobes whose integral is the coefficient of node `level` of ln α: −1/8, 5/4, −1/8.
    fn mixture(&self, level: usize) -> Mixture {
        let (at, step) = (self.roughness.at(level), self.roughness.step());
        let parts = [(-step, -0.125), (0.0, 1.25), (step, -0.125)].map(|(d, share)| ((at + d).exp(), share));
        Mixture { parts, masking: self.options.masking }
    }

    /// The response of one index at a mirror direction and the middle ray of a patch, as a node would hold it.
    pub(super) fn sample(&self, space: &mut Workspace, patch: usize, level: usize, place: [f64; 2]) -> Nine {
        let [middle, half] = self.patches.place(patch);
        let wo = self.ray(middle, half, [0.0; 2]);
        let mixture = self.mixture(level);
        let normal = self.gather(space, place, wo, &mixture);
        match View::new(wo, self.camera_x) {
            Ok(view) => {
                space.geometry.compute(&space.cells, normal, &view, &mixture);
                sum(&space.cells, &space.geometry, &self.indices[self.indices.len() / 2])
            }
            Err(_) => [0.0; 9],
        }
    }

    fn gather(&self, space: &mut Workspace, place: [f64; 2], wo: DVec3, mixture: &Mixture) -> DVec3 {
        let normal = (self.mirror.direction(place) + wo).normalize_or(wo);
        let (sky, sources) = (self.light.pyramid(), self.light.sources());
        space.cells.gather(sky, sources, normal, wo, mixture.parts[0].0, self.fineness);
        normal
    }

    fn level(&self, patch: usize, level: usize, axes: [Axis; 2], design: &Design, blocks: usize) -> Level {
        let [x, y] = axes;
        let width = blocks * BLOCK;
        let stride = design.places.len() * width;
        let mixture = self.mixture(level);
        let [middle, half] = self.patches.place(patch);
        let mut values = vec![0.0; x.nodes * y.nodes * stride];
        values.par_chunks_exact_mut(stride).enumerate().for_each_init(Workspace::default, |space, (at, out)| {
            let place = [x.at(at % x.nodes), y.at(at / x.nodes)];
            self.gather(space, place, self.ray(middle, half, [0.0; 2]), &mixture);
            space.values.clear();
            space.values.resize(stride, 0.0);
            for (within, values) in design.places.iter().zip(space.values.chunks_exact_mut(width)) {
                let wo = self.ray(middle, half, *within);
                let Ok(view) = View::new(wo, self.camera_x) else { continue };
                let normal = (self.mirror.direction(place) + wo).normalize_or(wo);
                space.geometry.compute(&space.cells, normal, &view, &mixture);
                for (index, nine) in self.indices.iter().zip(values.chunks_exact_mut(9)) {
                    nine.copy_from_slice(&sum(&space.cells, &space.geometry, index));
                }
            }
            design.coefficients(&space.values, width, out);
        });
        for row in values.chunks_exact_mut(x.nodes * stride) {
            interpolate(row, x.nodes, stride, stride);
        }
        interpolate(&mut values, y.nodes, x.nodes * stride, x.nodes * stride);
        let (values, _) = values.as_chunks::<BLOCK>();
        Level { axes, values: values.to_vec() }
    }
}

/// Materials tried by [`measure`], and the least n·ω_o among them: at grazing angles a response changes with ω_o faster than
/// a parabola.
const TESTS: usize = 256;
const LEAST_COSINE: f64 = 0.25;

/// Median, 95th percentile and worst error of the specular part, and how many materials were tried.
pub(super) fn measure(table: &ViewTable, light: &KnownLight, options: &TableOptions) -> ([f64; 3], usize) {
    let patches = &table.patches;
    let cases = (0..TESTS).into_par_iter().filter_map(|k| {
        // Evenly spread in six dimensions.
        let share = |j: i32| (real(k + 1) * 1.196_280_188_f64.powi(-j)).fract();
        let within =
            [(0, 1), (1, 2)].map(|(a, j)| patches.extent.middle(a) + patches.extent.half(a) * (2.0 * share(j) - 1.0));
        let wo = table.rays.direction(within);
        let slope = [3, 4].map(|j| options.slope * (2.0 * share(j) - 1.0));
        let [low, high] = options.alpha.map(f64::ln);
        let alpha = (low + (high - low) * share(5)).exp().clamp(options.alpha[0], options.alpha[1]);
        let (eta, bands) = match options.index {
            IndexRange::Free([low, high]) => {
                let eta = low + (high - low) * share(6);
                (eta, [Ior::from(Dielectric::new(eta).ok()?); 3])
            }
            IndexRange::Fixed(bands) => (1.5, bands),
        };
        let facets = Facets { eta, alpha, slope };
        let view = View::new(wo, table.camera_x).ok()?;
        let normal = facets.normal();
        if normal.dot(wo) < LEAST_COSINE {
            return None;
        }
        let reflector = Reflector::new(bands, Ggx::new(alpha, options.masking).ok()?);
        let mut exact = reflector.specular(light.pyramid(), Fineness(0.03), normal, &view);
        let sun = reflector.sources(light.sources(), normal, &view);
        exact.iter_mut().flatten().zip(sun.iter().flatten()).for_each(|(s, more)| *s += more);
        Some((table.response(wo, &facets).specular, exact))
    });
    let cases: Vec<_> = cases.collect();
    let brightest = cases.iter().flat_map(|(_, e)| e.map(|band| band[0])).fold(0.0, f64::max);
    let mut errors: Vec<f64> = cases
        .iter()
        .map(|(found, exact)| {
            let lanes = found.iter().zip(exact.iter().flat_map(|b| b.map(|x| (x, b[0]))));
            lanes.map(|(f, (e, s0))| (f - e).abs() / s0.max(0.01 * brightest).max(1e-300)).fold(0.0, f64::max)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors.get(count_above(share * real(errors.len())) - 1).copied().unwrap_or(0.0);
    ([at(0.5), at(0.95), at(1.0)], errors.len())
}
