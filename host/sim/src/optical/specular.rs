//! How the specular part of eq. 6 is evaluated, and the choice for each surface of a view.

use super::Surface;
use super::chart::Field;
use super::effects::normal_variation;
use super::light::{BandLight, SunPoints};
use super::lune::{LEAST_ALPHA, Lune};
use super::numbers::single3;
use super::sun_lobe;
use super::survey::Pixels;
use super::table::{Lanes, Over, Table, lanes};
use crate::{Effect, EffectSet};
use glam::{DVec3, Vec3};
use host_optics::integral::{Adaptive, FixedPoints, View, discrete};
use host_optics::prefilter::{Fineness, Pyramid, Reflector, Rgb, Sources};
use host_optics::{Frame, Incidence, Light, Microfacet, Reflection};

/// How paper eq. 6 is evaluated where the surface is rough. A surface without its roughness is a mirror under any of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Evaluation {
    /// Against prefiltered Stokes light (or fixed points under a smooth formula), tabulated over mirror directions and views
    /// until interpolation errs by no more than `tolerance` at test pixels, relative to s0.
    Prefiltered {
        /// Largest error of interpolation.
        tolerance: f64,
    },
    /// [`FixedPoints`] of this many rings at every pixel.
    Points {
        /// r of the 2 r² points.
        rings: u32,
    },
    /// [`Adaptive`] to this tolerance at every pixel: the reference.
    Adaptive {
        /// Relative to s0.
        tolerance: f64,
    },
}

/// What a surface of a view was evaluated with.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// No pixel shows it.
    Absent,
    /// A table of so many nodes, with the largest error of interpolation at test pixels relative to s0.
    Table {
        /// Nodes computed.
        nodes: usize,
        /// Measured error.
        error: f64,
    },
    /// Every pixel for itself.
    Direct,
}

/// What evaluates one point.
#[derive(Clone, Debug)]
pub(crate) enum Rule {
    Mirror,
    Cells(Fineness),
    Lune(Lune),
    Points(FixedPoints),
    Adaptive(Adaptive),
}

/// Everything an evaluation at one normal and view needs.
pub(crate) struct Point<'a> {
    pub(crate) light: &'a [BandLight<'a>; 3],
    pub(crate) polarized: bool,
    pub(crate) gray: bool,
    pub(crate) sky: Option<&'a Pyramid>,
    pub(crate) sun: &'a SunPoints,
    pub(crate) surface: &'a Surface,
    pub(crate) reflector: Reflector,
    pub(crate) rule: Rule,
    pub(crate) camera_x: DVec3,
}

/// The specular part of one surface in one view.
#[derive(Debug)]
pub(crate) enum Specular {
    Absent,
    /// One normal for all: over ω_o alone.
    Flat(Field<12>),
    Table(Table),
    Direct,
}

/// Below this multiple of the sun's angular radius a lobe sees the points of the disk one by one.
const NARROW: f64 = 2.0;

/// Test pixels of a table.
const TESTS: usize = 32;
/// First step between nodes of ω_o, radians.
const VIEW_STEP: f64 = 0.09;
/// Normals that differ by no more, as a chord, are one.
const EQUAL_NORMALS: f64 = 1e-6;
/// Halvings of a grid's step before it is given up.
const REFINEMENTS: usize = 5;

/// Error of a table's nodes, as a share of what its interpolation may err by.
const NODE_SHARE: f64 = 0.1;

/// A sum over cells errs as the square of their size: 0.1 of the lobe's width is good to about 1e-3 of s0 under a map with a low
/// sun, 0.2 to 3e-3.
fn fineness(tolerance: f64) -> Fineness {
    Fineness((10.0 * tolerance).sqrt().clamp(0.03, 0.3))
}

/// Rings at the nodes of a table under a smooth sky where the lobe is too narrow for a [`Lune`].
fn node_rings(tolerance: f64) -> u32 {
    if tolerance >= 2e-4 { 12 } else { 16 }
}

impl Rule {
    /// The rule for a surface's nodes or pixels.
    pub(crate) fn choose(
        evaluation: Evaluation,
        effects: EffectSet,
        smooth: bool,
        surface: &Surface,
        texel: f64,
    ) -> Self {
        if !effects.contains(Effect::Roughness) || surface.is_mirror() {
            return Self::Mirror;
        }
        match evaluation {
            Evaluation::Prefiltered { tolerance } if smooth && surface.ggx.alpha() >= LEAST_ALPHA => {
                Self::Lune(Lune::new(surface.ggx.alpha(), NODE_SHARE * tolerance))
            }
            // Where the lobe is narrower than a texel, cells would be seen as points.
            Evaluation::Prefiltered { tolerance } if smooth || surface.ggx.alpha() < 1.5 * texel => {
                Self::Points(FixedPoints::new(node_rings(tolerance)))
            }
            Evaluation::Prefiltered { tolerance } => Self::Cells(fineness(tolerance)),
            Evaluation::Points { rings } => Self::Points(FixedPoints::new(rings)),
            Evaluation::Adaptive { tolerance } => Self::Adaptive(Adaptive::new(tolerance)),
        }
    }
}

impl Point<'_> {
    /// Stokes of three bands in the camera frame of `wo`. Black where the camera has no frame (a ray along its x axis).
    pub(crate) fn at(&self, normal: DVec3, wo: DVec3) -> Rgb {
        let Ok(view) = View::new(wo, self.camera_x) else { return [[0.0; 3]; 3] };
        let mut out = match &self.rule {
            Rule::Mirror if self.polarized => {
                return self.reflector.mirror::<true>(|wi| self.seen::<true>(wi), normal, &view);
            }
            Rule::Mirror => return self.reflector.mirror::<false>(|wi| self.seen::<false>(wi), normal, &view),
            Rule::Cells(fineness) => match self.sky {
                Some(sky) => self.reflector.specular(sky, *fineness, normal, &view),
                None => [[0.0; 3]; 3],
            },
            Rule::Lune(rule) => self.over_lune(rule, normal, &view),
            Rule::Points(rule) => self.bands(|band, surface| rule.specular(band, surface, normal, &view)),
            Rule::Adaptive(rule) => self.bands(|band, surface| rule.specular(band, surface, normal, &view).value),
        };
        if !self.sun.sources.points.is_empty() {
            let narrow = self.narrow_sun(normal, wo);
            let sources = narrow.as_ref().unwrap_or(&self.sun.sources);
            let sun = match self.rule {
                Rule::Adaptive(_) => self.exact_sun(sources, normal, &view),
                _ => self.reflector.sources(sources, normal, &view),
            };
            for (s, more) in out.iter_mut().flatten().zip(sun.iter().flatten()) {
                *s += more;
            }
        }
        out
    }

    /// What a mirror sees of the sky and of the sun's disk; L alone where the light is not polarized.
    fn seen<const POLARIZED: bool>(&self, wi: DVec3) -> Rgb {
        let disk = self.sun.radiance_towards(wi);
        core::array::from_fn(|k| {
            if POLARIZED {
                let [l, q, u] = self.light[k].stokes(wi);
                [l + disk[k], q, u]
            } else {
                [self.light[k].radiance(wi) + disk[k], 0.0, 0.0]
            }
        })
    }

    /// Three bands, or one for all where nothing tells them apart.
    fn bands(&self, value: impl Fn(&BandLight<'_>, &Microfacet) -> [f64; 3]) -> Rgb {
        let one = |k: usize| value(&self.light[k], &Microfacet { ior: self.surface.ior[k], ggx: self.surface.ggx });
        if self.gray { [one(0); 3] } else { [one(0), one(1), one(2)] }
    }

    /// The sum over a lune's directions, whose geometry and polarization the bands share. For light by formulas.
    fn over_lune(&self, rule: &Lune, normal: DVec3, view: &View) -> Rgb {
        let wo = view.direction;
        let mut sum = [[0.0; 3]; 3];
        if normal.dot(wo) <= 0.0 {
            return sum;
        }
        let ior = self.surface.ior;
        let facets = Microfacet { ior: ior[0], ggx: self.surface.ggx };
        let bands = if self.gray { 1 } else { 3 };
        for (wi, solid_angle) in rule.points(normal, wo) {
            let weight = facets.factor(wi, wo, normal) * normal.dot(wi) * solid_angle;
            // One pattern is put on the radiance of all bands.
            let [_, q, u] = self.light[0].with_radiance([1.0, 0.0, 0.0], wi);
            let mut reflection = Reflection::at_facet(ior[0], wi, &Frame::sky(wi), wo, &view.frame);
            for k in 0..bands {
                if k > 0 && ior[k] != ior[k - 1] {
                    reflection.reflectance = ior[k].reflectance(Incidence::on_facet(wi, wo));
                }
                let l = weight * self.light[k].radiance(wi);
                for (total, s) in sum[k].iter_mut().zip(reflection.apply([l, l * q, l * u])) {
                    *total += s;
                }
            }
        }
        if self.gray { [sum[0]; 3] } else { sum }
    }

    /// The sun's disk in points that follow the lobe, where that is not much wider than the disk.
    fn narrow_sun(&self, normal: DVec3, wo: DVec3) -> Option<Sources> {
        let alpha = self.surface.ggx.alpha();
        let radius = self.sun.angular_radius;
        // One point for all of the disk is left out's own choice.
        if self.sun.sources.points.len() == 1 || alpha > NARROW * radius || normal.dot(wo) <= 0.0 {
            return None;
        }
        let mirror = normal * (2.0 * normal.dot(wo)) - wo;
        let points = sun_lobe::points(self.sun.center, radius, mirror, sun_lobe::width(alpha, normal, wo));
        Some(Sources { points, radiance: self.sun.sources.radiance })
    }

    fn exact_sun(&self, sun: &Sources, normal: DVec3, view: &View) -> Rgb {
        let one = |k: usize| {
            let light = host_optics::sky::Uniform { radiance: sun.radiance[k] };
            let surface = Microfacet { ior: self.surface.ior[k], ggx: self.surface.ggx };
            discrete(&light, &sun.points, &surface, normal, view)
        };
        [one(0), one(1), one(2)]
    }
}

impl Specular {
    /// For one surface. A table is tried where it is cheaper than its pixels, and kept if its measured error fits.
    pub(crate) fn plan(
        pixels: &Pixels<'_>,
        point: &Point<'_>,
        evaluation: Evaluation,
        effects: EffectSet,
    ) -> (Self, Method) {
        let (smooth, tolerance) = match evaluation {
            Evaluation::Prefiltered { tolerance } => (point.light.iter().all(|b| b.map().is_none()), tolerance),
            _ => return (Self::Direct, Method::Direct),
        };
        // A mirror under a map is as sharp as the map, and the sun has an edge.
        let sun = !point.sun.sources.points.is_empty();
        if matches!(point.rule, Rule::Mirror) && (!smooth || sun) {
            return (Self::Direct, Method::Direct);
        }
        let flat = !effects.contains(Effect::NormalVariation) || pixels.extent.normal_radius < EQUAL_NORMALS;
        let limit = pixels.extent.pixels / 4 * 3 + 64;
        // One normal leaves two coordinates of four.
        let count = if flat { TESTS / 2 } else { TESTS };
        let mut tests = pixels.some(count);
        if sun {
            // A table is worst where the highlight is, which a few pixels miss.
            let reach = 4.0 * point.surface.ggx.alpha() + point.sun.angular_radius;
            tests.extend(pixels.mirroring(point.sun.center, reach, count));
        }
        let over = if smooth { Over::Normal } else { Over::Mirror };
        // Between nodes of the chart, and of ω_o.
        let mut steps = [if smooth { 0.15 } else { point.surface.ggx.alpha().clamp(0.01, 0.15) }, VIEW_STEP];
        let bumpy = over == Over::Normal && !flat;
        let mut axis = usize::from(bumpy && pixels.extent.normal_radius < 0.3 * steps[0]);
        let (mut before, mut last, mut stuck) = (steps, f64::INFINITY, false);
        for _ in 0..if bumpy { 2 * REFINEMENTS } else { REFINEMENTS } {
            let (plan, nodes) = if flat {
                let normal = normal_variation::mean(pixels.extent);
                let size = pixels.view.size() / steps[0] + 4.0;
                if size * size > super::numbers::real(limit) {
                    break;
                }
                let field = Field::build(pixels.view_chart, &pixels.view, steps[0], |wo| lanes(&point.at(normal, wo)));
                let nodes = field.nodes();
                (Self::Flat(field), nodes)
            } else {
                let node = |n: DVec3, wo: DVec3| point.at(n, wo);
                let Some(table) = Table::build(pixels, over, steps, tolerance, limit, node) else { break };
                let nodes = table.computed();
                (Self::Table(table), nodes)
            };
            let error = plan.error(&tests, pixels, point, flat);
            if error <= tolerance {
                return (plan, Method::Table { nodes, error });
            }
            if bumpy && error > 0.7 * last {
                // A finer step was no use: the other one is what errs, or both.
                if !stuck {
                    steps = before;
                }
                (stuck, axis) = (true, 1 - axis);
            } else {
                stuck = false;
            }
            (before, last) = (steps, error.min(last));
            // Cubic interpolation: the error falls as the fourth power of the step, a little more slowly in practice.
            steps[axis] *= match axis {
                1 => 0.75,
                _ if bumpy => (0.6 * tolerance / error).powf(0.3).clamp(0.35, 0.85),
                _ if error > 20.0 * tolerance => 0.4,
                _ => 0.6,
            };
            if bumpy && axis == 0 {
                // Steps longer than the chart are one.
                steps[0] = steps[0].min(1.2 * pixels.extent.normal_radius);
            }
        }
        (Self::Direct, Method::Direct)
    }

    /// Largest difference from direct evaluation at test pixels, relative to s0 (of at least a hundredth of the brightest's).
    fn error(&self, tests: &[(Vec3, Vec3)], pixels: &Pixels<'_>, point: &Point<'_>, flat: bool) -> f64 {
        use rayon::prelude::*;
        let mean = normal_variation::mean(pixels.extent);
        let pairs: Vec<(Lanes, Lanes)> = tests
            .par_iter()
            .map(|(n, o)| {
                let normal = if flat { mean } else { n.as_dvec3().normalize() };
                let exact = lanes(&point.at(normal, o.as_dvec3().normalize()));
                (self.lookup(single3(normal), *o), exact)
            })
            .collect();
        let brightest = pairs.iter().map(|(_, e)| e[0].max(e[3]).max(e[6])).fold(0.0_f32, f32::max);
        let relative = pairs.iter().flat_map(|(found, exact)| {
            (0..9).map(move |k| {
                let s0 = exact[k - k % 3].max(0.01 * brightest);
                if s0 > 0.0 { f64::from((found[k] - exact[k]).abs() / s0) } else { 0.0 }
            })
        });
        relative.fold(0.0, f64::max)
    }

    /// Nine numbers at a pixel; of a direct plan nothing.
    pub(crate) fn lookup(&self, normal: Vec3, wo: Vec3) -> Lanes {
        match self {
            Self::Flat(field) => field.at(wo),
            Self::Table(table) => table.at(normal, wo),
            Self::Absent | Self::Direct => [0.0; 12],
        }
    }
}
