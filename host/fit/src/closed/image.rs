//! Whole images: rows in parallel, eight pixels at a time.

#![expect(clippy::needless_range_loop, reason = "one index walks several arrays side by side")]

use super::kernel::{Found, solve};
use super::phase::Seen;
use super::real::{LANES, Lanes, Real, Triple, Work, along, cross, dot, single, times};
use super::{Estimate, SkyTable, reasons, sky_aware};
use crate::material::{BANDS, MAX_VIEWS, Observation};
use crate::{FitError, UpperTriangle};
use glam::DVec3;
use rayon::prelude::*;
use wide::f32x8;

/// Where the pixels of rectified views lie on the sample: X = origin + column · `column` + row · `row`, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Pixel (0, 0).
    pub origin: DVec3,
    /// From one column to the next.
    pub column: DVec3,
    /// From one row to the next (down).
    pub row: DVec3,
}

impl Grid {
    /// The point of a pixel.
    #[expect(clippy::cast_precision_loss, reason = "rows and columns of an image are far below 2^52")]
    fn point(&self, column: usize, row: usize) -> DVec3 {
        self.origin + self.column * column as f64 + self.row * row as f64
    }
}

/// The covariance of a view's Stokes values.
#[derive(Clone, Copy, Debug)]
pub enum Covariance<'a> {
    /// The same for every pixel, by band.
    Same([UpperTriangle; BANDS]),
    /// Per pixel, by band; height × width, row-major.
    Planes([&'a [UpperTriangle]; BANDS]),
}

impl Covariance<'_> {
    #[inline(always)]
    fn at(&self, band: usize, index: usize) -> UpperTriangle {
        match self {
            Self::Same(bands) => bands[band],
            Self::Planes(bands) => bands[band][index],
        }
    }
}

/// One view, rectified to the sample.
#[derive(Clone, Copy, Debug)]
pub struct ViewPlanes<'a> {
    /// The camera's center; far away for a distant one.
    pub camera: DVec3,
    /// The camera's x axis.
    pub x_axis: DVec3,
    /// s0, s1, s2 of R, G, B; height × width, row-major.
    pub stokes: [[&'a [f32]; 3]; BANDS],
    /// Their covariance.
    pub covariance: Covariance<'a>,
}

/// [`Estimate`]s of an image; height × width, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfacePlanes {
    /// ρ_d by band.
    pub albedo: [Vec<f32>; BANDS],
    /// η.
    pub eta: Vec<f32>,
    /// α: a start value.
    pub alpha: Vec<f32>,
    /// Unit normal.
    pub normal: [Vec<f32>; 3],
    /// σ of ρ_d.
    pub sigma_albedo: [Vec<f32>; BANDS],
    /// σ of η.
    pub sigma_eta: Vec<f32>,
    /// rms angle of the normal, radians.
    pub sigma_normal_rad: Vec<f32>,
    /// Bits of [`super::Reasons`].
    pub reasons: Vec<u32>,
}

/// Number of f32 planes.
const PLANES: usize = 13;

/// One row of every plane: albedo, η, α, normal, their σ.
struct Row<'a> {
    planes: [&'a mut [f32]; PLANES],
    reasons: &'a mut [u32],
}

impl SurfacePlanes {
    fn filled(width: usize, height: usize, row: impl Fn(usize, &mut Row<'_>) + Sync) -> Self {
        let mut all: [Vec<f32>; PLANES] = core::array::from_fn(|_| vec![0.0; width * height]);
        let mut bits = vec![0; width * height];
        let mut chunks = all.each_mut().map(|plane| plane.chunks_exact_mut(width.max(1)));
        let rows: Vec<Row<'_>> = bits
            .chunks_exact_mut(width.max(1))
            .map(|reasons| Row { planes: chunks.each_mut().map(|c| c.next().unwrap_or_default()), reasons })
            .collect();
        rows.into_par_iter().enumerate().for_each(|(y, mut into)| row(y, &mut into));
        let [r, g, b, eta, alpha, x, y, z, sr, sg, sb, sigma_eta, sigma_normal_rad] = all;
        Self {
            albedo: [r, g, b],
            eta,
            alpha,
            normal: [x, y, z],
            sigma_albedo: [sr, sg, sb],
            sigma_eta,
            sigma_normal_rad,
            reasons: bits,
        }
    }
}

/// Mode *closed* for every pixel; see [`super::pixel`]. f32 arithmetic: values within 3e-5 (relative above 1) of f64 where they
/// are determined.
///
/// # Errors
/// [`FitError::Size`] where planes disagree in size, or for no or more than [`MAX_VIEWS`] views.
pub fn planes(views: &[ViewPlanes<'_>], grid: &Grid, width: usize, sky: &SkyTable) -> Result<SurfacePlanes, FitError> {
    let height = checked(views, width)?;
    Ok(match views.len() {
        1 | 2 => lanes::<2>(views, grid, [width, height], sky),
        3 => lanes::<3>(views, grid, [width, height], sky),
        4 => lanes::<4>(views, grid, [width, height], sky),
        _ => lanes::<MAX_VIEWS>(views, grid, [width, height], sky),
    })
}

/// Mode *sky-aware* for every pixel, in f64; see [`sky_aware()`].
///
/// # Errors
/// As [`planes`].
pub fn sky_aware_planes(
    views: &[ViewPlanes<'_>],
    grid: &Grid,
    width: usize,
    sky: &SkyTable,
) -> Result<SurfacePlanes, FitError> {
    let height = checked(views, width)?;
    let axes: Vec<DVec3> = views.iter().map(|view| view.x_axis).collect();
    Ok(SurfacePlanes::filled(width, height, |y, row| {
        let mut observations = Vec::with_capacity(views.len());
        for x in 0..width {
            let (index, point) = (y * width + x, grid.point(x, y));
            observations.clear();
            observations.extend(views.iter().enumerate().map(|(number, view)| Observation {
                view: number,
                direction: (view.camera - point).normalize_or_zero(),
                stokes: view.stokes.map(|band| band.map(|plane| plane[index])),
                covariance: core::array::from_fn(|band| view.covariance.at(band, index)),
            }));
            row.put(x, &sky_aware(&observations, &axes, sky));
        }
    }))
}

fn checked(views: &[ViewPlanes<'_>], width: usize) -> Result<usize, FitError> {
    let same = |what, found, expected| {
        if found == expected { Ok(()) } else { Err(FitError::Size { what, found, expected }) }
    };
    same("views", views.len(), views.len().clamp(1, MAX_VIEWS))?;
    let pixels = views.first().map_or(0, |view| view.stokes[0][0].len());
    same("columns that divide the samples", pixels.checked_rem(width).unwrap_or(pixels), 0)?;
    for view in views {
        for plane in view.stokes.iter().flatten() {
            same("samples of a Stokes plane", plane.len(), pixels)?;
        }
        if let Covariance::Planes(bands) = view.covariance {
            for plane in bands {
                same("samples of a covariance plane", plane.len(), pixels)?;
            }
        }
    }
    Ok(pixels.checked_div(width).unwrap_or(0))
}

fn lanes<const V: usize>(
    views: &[ViewPlanes<'_>],
    grid: &Grid,
    [width, height]: [usize; 2],
    sky: &SkyTable,
) -> SurfacePlanes {
    let scale = sky.white().map(|white| if white > 0.0 { 1.0 / white } else { 0.0 });
    SurfacePlanes::filled(width, height, |y, into| {
        let work = Line::<V> { views, grid, sky, scale, y, into };
        #[cfg(target_arch = "x86_64")]
        let Err(work) = super::x86::with_avx2(work) else { return };
        work.run::<f32x8>();
    })
}

/// One row of an image.
struct Line<'a, 'b, const V: usize> {
    views: &'a [ViewPlanes<'a>],
    grid: &'a Grid,
    sky: &'a SkyTable,
    scale: [f64; BANDS],
    y: usize,
    into: &'a mut Row<'b>,
}

impl<const V: usize> Work for Line<'_, '_, V> {
    #[inline(always)]
    fn run<R: Lanes>(self) {
        let width = self.into.reasons.len();
        let mut seen = [Seen::nothing(); V];
        let mut x = 0;
        while x < width {
            for (seen, view) in seen.iter_mut().zip(self.views) {
                let framed = aim(view, self.grid.point(x, self.y), self.grid.column, seen);
                let [r, g, b] = self.scale;
                let scale = [R::of(r) * framed, R::of(g) * framed, R::of(b) * framed];
                load(view, self.y * width + x, scale, seen);
            }
            self.into.put_lanes(x, &solve::<R, V>(&seen, self.sky));
            x += LANES;
        }
    }
}

/// Directions and frames of eight pixels of a row, from `point` on, and the scale of their samples: 0 where there is no
/// frame (the camera in the sample, its axis along the ray), so that the light says nothing.
#[inline(always)]
fn aim<R: Lanes>(view: &ViewPlanes<'_>, point: DVec3, column: DVec3, seen: &mut Seen<R>) -> R {
    let to = view.camera - point;
    // In units of the distance: no overflow, and no length that underflows.
    let unit = 1.0 / to.length();
    let steps = R::load([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let direction = normalized(along(triple(to * unit), triple(column * -unit), steps));
    let axis = triple(view.x_axis);
    let x = normalized(along(axis, direction, -dot(axis, direction)));
    let framed = (dot(x, x) + dot(direction, direction)).finite_or(R::of(0.0)).min(R::of(1.0));
    let blank = Seen::<R>::nothing();
    seen.present = R::of(1.0);
    for k in 0..3 {
        seen.direction[k] = direction[k].finite_or(blank.direction[k]);
        seen.x[k] = x[k].finite_or(blank.x[k]);
    }
    let y = cross(direction, x);
    for k in 0..3 {
        seen.y[k] = y[k].finite_or(blank.y[k]);
    }
    framed
}

/// Samples and covariances of eight pixels, from the `first` of the image on; 0 beyond its end.
#[inline(always)]
fn load<R: Lanes>(view: &ViewPlanes<'_>, first: usize, scale: [R; BANDS], seen: &mut Seen<R>) {
    for b in 0..BANDS {
        for k in 0..3 {
            seen.stokes[b][k] = R::load(eight(&view.stokes[b][k][first..], 0.0)) * scale[b];
        }
        let square = scale[b] * scale[b];
        match view.covariance {
            Covariance::Same(bands) => {
                for k in 0..6 {
                    seen.covariance[b][k] = R::of(f64::from(bands[b][k])) * square;
                }
            }
            Covariance::Planes(bands) => {
                let given = eight(&bands[b][first..], [0.0; 6]);
                for k in 0..6 {
                    let mut column = [0.0; LANES];
                    for (to, from) in column.iter_mut().zip(&given) {
                        *to = from[k];
                    }
                    seen.covariance[b][k] = R::load(column) * square;
                }
            }
        }
    }
}

/// The first eight, or as many as there are and `blank`.
#[inline(always)]
fn eight<T: Copy>(samples: &[T], blank: T) -> [T; LANES] {
    samples.first_chunk().copied().unwrap_or_else(|| {
        let mut padded = [blank; LANES];
        padded[..samples.len()].copy_from_slice(samples);
        padded
    })
}

#[inline(always)]
fn triple<R: Real>(v: DVec3) -> Triple<R> {
    [R::of(v.x), R::of(v.y), R::of(v.z)]
}

#[inline(always)]
fn normalized<R: Real>(v: Triple<R>) -> Triple<R> {
    times(v, R::of(1.0) / dot(v, v).sqrt())
}

impl Row<'_> {
    #[inline(always)]
    fn put_lanes<R: Lanes>(&mut self, x: usize, found: &Found<R>) {
        let [r, g, b] = found.albedo;
        let n = found.normal;
        let [sr, sg, sb] = found.sigma_albedo;
        let values =
            [r, g, b, found.eta, found.alpha, n[0], n[1], n[2], sr, sg, sb, found.sigma_eta, found.sigma_normal];
        for (plane, value) in self.planes.iter_mut().zip(&values) {
            put_eight(&mut plane[x..], value.store());
        }
        put_eight(&mut self.reasons[x..], found.reasons.store().map(|bits| reasons(f64::from(bits)).0));
    }

    fn put(&mut self, x: usize, found: &Estimate) {
        let [r, g, b] = found.albedo;
        let n = found.normal();
        let [sr, sg, sb] = found.sigma.albedo;
        let (facets, sigma) = (&found.facets, &found.sigma);
        let values = [r, g, b, facets.eta, facets.alpha, n.x, n.y, n.z, sr, sg, sb, sigma.eta, sigma.normal_rad];
        for (plane, value) in self.planes.iter_mut().zip(values) {
            plane[x] = single(value);
        }
        self.reasons[x] = found.reasons.0;
    }
}

#[inline(always)]
fn put_eight<T: Copy>(to: &mut [T], values: [T; LANES]) {
    if let Some(to) = to.first_chunk_mut() {
        *to = values;
    } else {
        let count = to.len();
        to.copy_from_slice(&values[..count]);
    }
}
