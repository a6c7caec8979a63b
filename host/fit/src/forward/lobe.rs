//! The specular part of eq. 6 at one normal and view, for several indices at once: a sum over [`Cells`] in vector loops, f32.
//!
//! A cell is not a point: the distribution is averaged over its light by the second moment, D + ½ σ² ∇²D, which lets cells be
//! twice as wide.

use super::cells::{Cells, WIDE};
use super::numbers::single;
use super::wide::{Work, fma};
use core::f32::consts::FRAC_1_PI;
use glam::DVec3;
use host_optics::integral::View;
use host_optics::{Dielectric, Incidence, Ior, Masking};

/// Band-major s0, s1, s2.
pub(super) type Nine = [f32; 9];

/// What reflects: one index for all bands, or an index for each.
#[derive(Clone, Copy, Debug)]
pub(super) enum Index {
    Gray(Dielectric),
    Bands([Ior; 3]),
}

/// Per cell, what all indices share.
#[derive(Clone, Debug, Default)]
pub(super) struct Geometry {
    /// f_r (n·ω_i) without Fresnel.
    weight: Vec<f32>,
    /// cos and sin² of the angle of incidence on the facet.
    cosine: Vec<f32>,
    sine_squared: Vec<f32>,
    /// cos and sin of twice the angle of the s axis in the camera frame and in the sky frame.
    out: [Vec<f32>; 2],
    into: [Vec<f32>; 2],
}

/// A sum of lobes of different roughness: a table's coefficient instead of its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture {
    /// α and share.
    pub(super) parts: [(f64, f64); 3],
    pub(super) masking: Masking,
}

struct Shape<'a> {
    cells: &'a Cells,
    normal: DVec3,
    view: &'a View,
    mixture: &'a Mixture,
    out: &'a mut Geometry,
}

impl Geometry {
    pub(super) fn compute(&mut self, cells: &Cells, normal: DVec3, view: &View, mixture: &Mixture) {
        let Self { weight, cosine, sine_squared, out: [a, b], into: [c, d] } = self;
        for v in [weight, cosine, sine_squared, a, b, c, d] {
            v.resize(cells.len(), 0.0);
        }
        super::wide::widest(Shape { cells, normal, view, mixture, out: self });
    }
}

impl Work for Shape<'_> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        if self.cells.polarized { self.fill::<true>() } else { self.fill::<false>() }
    }
}

impl Shape<'_> {
    #[inline(always)]
    fn fill<const POLARIZED: bool>(self) {
        let n = self.cells.len();
        let three = |v: DVec3| [single(v.x), single(v.y), single(v.z)];
        let [nx, ny, nz] = three(self.normal);
        let [ox, oy, oz] = three(self.view.direction);
        let [cx, cy, cz] = three(self.view.frame.x);
        let [dx, dy, dz] = three(self.view.frame.y);
        let co = nx * ox + ny * oy + nz * oz;
        let correlated = self.mixture.masking == Masking::HeightCorrelated;
        let parts = self.mixture.parts.map(|(alpha, share)| {
            let a2 = single(alpha * alpha);
            (a2, (co * co + a2 * (1.0 - co * co).max(0.0)).sqrt(), single(share * alpha * alpha) * FRAC_1_PI)
        });
        let [x, y, z] = self.cells.direction.each_ref().map(|v| &v[..n]);
        let variance = &self.cells.variance[..n];
        let Geometry { weight, cosine, sine_squared, out: [out_c, out_s], into: [into_c, into_s] } = self.out;
        let (weight, cosine, sine_squared) = (&mut weight[..n], &mut cosine[..n], &mut sine_squared[..n]);
        let (out_c, out_s) = (&mut out_c[..n], &mut out_s[..n]);
        let (into_c, into_s) = (&mut into_c[..n], &mut into_s[..n]);
        for i in 0..n {
            let (wx, wy, wz) = (x[i], y[i], z[i]);
            let (sx, sy, sz) = (wx + ox, wy + oy, wz + oz);
            let square = (sx * sx + sy * sy + sz * sz).max(1e-12);
            let inverse = 1.0 / square;
            let cd2 = 0.25 * square;
            let (ex, ey, ez) = (wx - ox, wy - oy, wz - oz);
            let sd2 = 0.25 * (ex * ex + ey * ey + ez * ez);
            let ch = nx * sx + ny * sy + nz * sz;
            let (px, py, pz) = (ny * sz - nz * sy, nz * sx - nx * sz, nx * sy - ny * sx);
            let sh2 = (px * px + py * py + pz * pz) * inverse;
            let ch2 = ch * ch * inverse;
            let ci = (nx * wx + ny * wy + nz * wz).max(0.0);
            let si2 = (1.0 - ci * ci).max(0.0);
            // The part of n across the plane of incidence: n·(ω_i × ω_o)/|ω_i × ω_o|, |ω_i × ω_o|² = 4 c_d² s_d².
            let triple = nx * (wy * oz - wz * oy) + ny * (wz * ox - wx * oz) + nz * (wx * oy - wy * ox);
            let across = (triple * triple / (4.0 * cd2 * sd2).max(1e-9)).min(sh2);
            let spread = (sh2 - across) + across / cd2;
            let curve = 1.0 + 1.0 / cd2;
            let mut sum = 0.0;
            for (a2, ro, scale) in parts {
                let u = a2 * ch2 + sh2;
                let iu = 1.0 / u;
                let moment = 0.5 * variance[i] * iu * (6.0 * spread * iu - curve);
                let ri = (ci * ci + a2 * si2).sqrt();
                let visibility = if correlated { 0.5 / (co * ri + ci * ro) } else { 1.0 / ((ci + ri) * (co + ro)) };
                sum += scale * iu * iu * visibility * (1.0 + moment.clamp(-0.5, 1.0));
            }
            weight[i] = sum * ci;
            cosine[i] = cd2.sqrt();
            sine_squared[i] = sd2;
            // Components of ω_i × ω_o in the camera frame.
            let a = wx * dx + wy * dy + wz * dz;
            let b = -(wx * cx + wy * cy + wz * cz);
            let length = 1.0 / (a * a + b * b).max(1e-12);
            out_c[i] = (a - b) * (a + b) * length;
            out_s[i] = 2.0 * a * b * length;
            if POLARIZED {
                // And in the sky frame x = (ω_y, −ω_x, 0)/ρ, y = x × ω_i.
                let rho2 = (wx * wx + wy * wy).max(1e-12);
                let b = -(ox * wy - oy * wx);
                let a = oz * rho2 - wz * (ox * wx + oy * wy);
                let length = 1.0 / (a * a + b * b).max(1e-12);
                into_c[i] = (a - b) * (a + b) * length;
                into_s[i] = 2.0 * a * b * length;
            }
        }
    }
}

/// Nine numbers for one index.
struct Sum<'a> {
    cells: &'a Cells,
    geometry: &'a Geometry,
    index: Dielectric,
}

/// The specular part for an index.
pub(super) fn sum(cells: &Cells, geometry: &Geometry, index: &Index) -> Nine {
    match index {
        Index::Gray(index) => super::wide::widest(Sum { cells, geometry, index: *index }),
        Index::Bands(bands) => sum_bands(cells, geometry, bands),
    }
}

impl Work for Sum<'_> {
    type Out = Nine;

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> Nine {
        if self.cells.polarized { self.add::<FUSED, true>() } else { self.add::<FUSED, false>() }
    }
}

impl Sum<'_> {
    #[inline(always)]
    fn add<const FUSED: bool, const POLARIZED: bool>(self) -> Nine {
        let eta = self.index.eta();
        let contrast = single((eta - 1.0) * (eta + 1.0));
        let mut sums = [[0.0_f32; WIDE]; 9];
        for start in (0..self.cells.len()).step_by(WIDE) {
            self.step::<FUSED, POLARIZED>(&mut sums, start, contrast);
        }
        sums.map(|s| s.iter().sum())
    }

    #[inline(always)]
    fn step<const FUSED: bool, const POLARIZED: bool>(&self, sums: &mut [[f32; WIDE]; 9], start: usize, contrast: f32) {
        let g = self.geometry;
        let at = |v: &[f32]| -> [f32; WIDE] {
            let whole = &v[start..start + WIDE];
            core::array::from_fn(|l| whole[l])
        };
        let (w, c, s2) = (at(&g.weight), at(&g.cosine), at(&g.sine_squared));
        let (oc, os) = (at(&g.out[0]), at(&g.out[1]));
        let mut mean = [0.0; WIDE];
        let mut half = [0.0; WIDE];
        let mut diagonal = [0.0; WIDE];
        for l in 0..WIDE {
            let q = fma::<FUSED>(c[l], c[l], contrast).sqrt();
            let rs = contrast / ((c[l] + q) * (c[l] + q));
            let perpendicular = w[l] * rs * rs;
            let cq = c[l] * q;
            let inverse = 1.0 / (cq + s2[l]);
            let t = (cq - s2[l]) * inverse;
            mean[l] = 0.5 * perpendicular * fma::<FUSED>(t, t, 1.0);
            half[l] = 2.0 * perpendicular * cq * s2[l] * inverse * inverse;
            diagonal[l] = -perpendicular * t;
        }
        for band in 0..3 {
            let p = at(&self.cells.power[band]);
            if POLARIZED {
                let (ic, is) = (at(&g.into[0]), at(&g.into[1]));
                let (q, u) = (at(&self.cells.polarization[band][0]), at(&self.cells.polarization[band][1]));
                for l in 0..WIDE {
                    let (along, crossed) = (ic[l] * q[l] + is[l] * u[l], ic[l] * u[l] - is[l] * q[l]);
                    let s1 = fma::<FUSED>(half[l], p[l], mean[l] * along);
                    let s2 = diagonal[l] * crossed;
                    sums[3 * band][l] += fma::<FUSED>(mean[l], p[l], half[l] * along);
                    sums[3 * band + 1][l] += fma::<FUSED>(oc[l], s1, -os[l] * s2);
                    sums[3 * band + 2][l] += fma::<FUSED>(os[l], s1, oc[l] * s2);
                }
            } else {
                for l in 0..WIDE {
                    let s1 = half[l] * p[l];
                    sums[3 * band][l] = fma::<FUSED>(mean[l], p[l], sums[3 * band][l]);
                    sums[3 * band + 1][l] = fma::<FUSED>(oc[l], s1, sums[3 * band + 1][l]);
                    sums[3 * band + 2][l] = fma::<FUSED>(os[l], s1, sums[3 * band + 2][l]);
                }
            }
        }
    }
}

/// As [`Sum`], one cell and band at a time: metals.
fn sum_bands(cells: &Cells, g: &Geometry, bands: &[Ior; 3]) -> Nine {
    let mut sums = [0.0_f64; 9];
    for i in 0..cells.len() {
        let at = Incidence { cosine: f64::from(g.cosine[i]), sine_squared: f64::from(g.sine_squared[i]) };
        let [oc, os] = g.out.each_ref().map(|v| f64::from(v[i]));
        for (band, ior) in bands.iter().enumerate() {
            let r = ior.reflectance(at);
            let (mean, half) = (0.5 * (r.perpendicular + r.parallel), 0.5 * (r.perpendicular - r.parallel));
            let weight = f64::from(g.weight[i]);
            let (p, mut along, mut crossed) = (weight * f64::from(cells.power[band][i]), 0.0, 0.0);
            if cells.polarized {
                let [ic, is] = g.into.each_ref().map(|v| f64::from(v[i]));
                let [q, u] = cells.polarization[band].each_ref().map(|v| weight * f64::from(v[i]));
                (along, crossed) = (ic * q + is * u, ic * u - is * q);
            }
            let (s1, s2) = (half * p + mean * along, r.rr_cos_delta * crossed);
            sums[3 * band] += mean * p + half * along;
            sums[3 * band + 1] += oc * s1 - os * s2;
            sums[3 * band + 2] += os * s1 + oc * s2;
        }
    }
    sums.map(single)
}
