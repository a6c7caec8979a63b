//! The known light as the closed forms read it: a table without trigonometry, poles or seams.
//!
//! Nodes lie in the Lambert azimuthal projection p = (ω_x, ω_y)/√(1 + ω_z), in which the upper hemisphere is the unit disk;
//! values between them are bilinear. Q and U are kept in the frame whose x axis is the world's +x carried from the zenith to ω
//! along the great circle: it has no pole above the horizon. With 256 nodes a side a clear sky is met within 1e-4 of its
//! radiance; light with edges (the sun's disk) is as sharp as the nodes.

use super::real::{Real, Triple, dot, single};
use crate::material::BANDS;
use core::f64::consts::{FRAC_PI_2, PI};
use glam::DVec3;
use host_optics::Frame;
use host_optics::frames::transport;

/// Light is asked for down to here: all that an interpolation above the horizon touches.
const LOWEST: f64 = -0.5;

/// L, Q, U of every band, and the irradiance of a tilted sample.
#[derive(Clone, Debug)]
pub struct SkyTable {
    size: usize,
    /// L, then Q, then U of R, G, B, and nothing thrice; row-major in (p_y, p_x).
    nodes: Vec<[f32; 12]>,
    /// Radiance of a white Lambert sample with normal +z, by band: the unit the closed forms count in.
    white: [f64; BANDS],
    /// The radiance of every direction, where it is the same.
    even: Option<[f64; BANDS]>,
    /// Irradiance by normal n: (constant, gradient), relative to that of +z.
    tilt: [(f64, DVec3); BANDS],
}

impl SkyTable {
    /// Samples light at `size` × `size` nodes (at least 2 × 2; 256 for a clear sky).
    ///
    /// `stokes(ω)` is (L, Q, U) of R, G, B in [`Frame::sky`] out of unit ω; it is asked to 30° below the horizon, where black is
    /// as good an answer as any but bleeds into the last row of nodes. `irradiance(n)` is that of a plane with unit normal n;
    /// it is asked at the zenith and at four normals 30° off, and taken as linear in n in between (exact for a uniform sky).
    #[must_use]
    pub fn sample(
        stokes: impl Fn(DVec3) -> [[f64; 3]; BANDS],
        irradiance: impl Fn(DVec3) -> [f64; BANDS],
        size: usize,
    ) -> Self {
        let size = size.max(2);
        let mut nodes = Vec::with_capacity(size * size);
        for row in 0..size {
            for column in 0..size {
                nodes.push(node(&stokes, [column, row].map(|k| 2.0 * real(k) / real(size - 1) - 1.0)));
            }
        }
        let [s, c] = [0.5, 0.75_f64.sqrt()];
        let above = irradiance(DVec3::Z);
        let [east, west, north, south] =
            [[s, 0.0], [-s, 0.0], [0.0, s], [0.0, -s]].map(|[x, y]| irradiance(DVec3::new(x, y, c)));
        let (mut white, mut tilt) = ([0.0; BANDS], [(1.0, DVec3::ZERO); BANDS]);
        for band in 0..BANDS {
            if !(above[band] > 0.0 && above[band].is_finite()) {
                continue;
            }
            let [east, west, north, south] = [east, west, north, south].map(|e| e[band] / above[band]);
            // E(n) = constant + gradient · n through the zenith and the mean of the four.
            let up = (1.0 - 0.25 * (east + west + north + south)) / (1.0 - c);
            white[band] = above[band] / PI;
            tilt[band] = (1.0 - up, DVec3::new(0.5 * (east - west) / s, 0.5 * (north - south) / s, up));
        }
        Self { size, nodes, white, even: None, tilt }
    }

    /// Unpolarized light of the same radiance from everywhere above the horizon, by band: what a chart next to the sample
    /// tells.
    #[must_use]
    pub fn uniform(radiance: [f64; BANDS]) -> Self {
        let irradiance = |normal: DVec3| radiance.map(|l| l * FRAC_PI_2 * (1.0 + normal.z));
        Self { even: Some(radiance), ..Self::sample(|_| radiance.map(|l| [l, 0.0, 0.0]), irradiance, 2) }
    }

    /// Radiance of a white Lambert sample with normal +z, by band.
    pub(super) fn white(&self) -> [f64; BANDS] {
        self.white
    }

    /// Irradiance at `normal` relative to that at +z, never below 0.05: a start, not a division by zero.
    #[inline(always)]
    pub(super) fn irradiance<R: Real>(&self, band: usize, normal: Triple<R>) -> R {
        let (constant, _) = self.tilt[band];
        (R::of(constant) + self.irradiance_along(band, normal)).max(R::of(0.05))
    }

    /// ∂/∂n of [`Self::irradiance`] along `step`.
    #[inline(always)]
    pub(super) fn irradiance_along<R: Real>(&self, band: usize, step: Triple<R>) -> R {
        let (_, gradient) = self.tilt[band];
        dot([R::of(gradient.x), R::of(gradient.y), R::of(gradient.z)], step)
    }

    /// L of every band out of unit `direction`; 0 at and below the horizon.
    #[inline(always)]
    pub(super) fn radiance<R: Real>(&self, direction: Triple<R>) -> Triple<R> {
        if let Some([r, g, b]) = self.even {
            let above = R::of(0.0).is_less(direction[2]);
            return [above * R::of(r), above * R::of(g), above * R::of(b)];
        }
        let [column, row] = self.place(direction);
        R::each([column, row, direction[2]], |[column, row, z]| {
            let mut l = [0.0; 4];
            if z > 0.0 {
                self.blend([column, row], |weight, node| {
                    for (l, x) in l.iter_mut().zip(&node[..4]) {
                        *l += weight * x;
                    }
                });
            }
            let [r, g, b, _] = l;
            [r, g, b]
        })
    }

    /// (L, Q, U) of every band out of unit `direction` in the frame of [`Self::frame`]; 0 at and below the horizon.
    pub(super) fn stokes(&self, direction: DVec3) -> [[f64; 3]; BANDS] {
        let mut sum = [0.0; 12];
        if direction.z > 0.0 {
            self.blend(self.place(direction.to_array()).map(single), |weight, node| {
                for (sum, x) in sum.iter_mut().zip(node) {
                    *sum += weight * x;
                }
            });
        }
        core::array::from_fn(|band| [0, BANDS, 2 * BANDS].map(|component| f64::from(sum[component + band])))
    }

    /// Frame of the table's Q and U.
    pub(super) fn frame(direction: DVec3) -> Frame {
        let x = transport(DVec3::X, DVec3::Z, direction);
        Frame { x, y: x.cross(direction) }
    }

    /// Column and row of a direction above the horizon, in nodes.
    #[inline(always)]
    fn place<R: Real>(&self, [x, y, z]: Triple<R>) -> [R; 2] {
        let (zero, last) = (R::of(0.0), R::of(real(self.size - 1)));
        let half = R::of(0.5) * last;
        let scale = half / (R::of(1.0) + z).sqrt();
        [(x * scale + half).max(zero).min(last), (y * scale + half).max(zero).min(last)]
    }

    /// The four nodes around a place with their weights.
    #[inline(always)]
    fn blend(&self, [column, row]: [f32; 2], mut add: impl FnMut(f32, &[f32; 12])) {
        let [(column, fx), (row, fy)] = [cell(column, self.size), cell(row, self.size)];
        let first = row * self.size + column;
        let pair = |start: usize| self.nodes.get(start..start + 2);
        if let (Some([a, b]), Some([c, d])) = (pair(first), pair(first + self.size)) {
            add((1.0 - fx) * (1.0 - fy), a);
            add(fx * (1.0 - fy), b);
            add((1.0 - fx) * fy, c);
            add(fx * fy, d);
        }
    }
}

/// What lies at p.
fn node(stokes: impl Fn(DVec3) -> [[f64; 3]; BANDS], [x, y]: [f64; 2]) -> [f32; 12] {
    let square = x * x + y * y;
    // Deeper down, where the frame ends in a pole, the last value goes on.
    let z = (1.0 - square).max(LOWEST);
    let root = if square > 0.0 { ((1.0 - z) * (1.0 + z) / square).sqrt() } else { 0.0 };
    let direction = DVec3::new(x * root, y * root, z);
    let mut node = [0.0; 12];
    let turn = SkyTable::frame(direction).turn_to(Frame::sky(direction).x);
    for (band, light) in stokes(direction).into_iter().enumerate() {
        let [l, q, u] = turn.apply_linear(light);
        node[band] = single(l);
        node[BANDS + band] = single(q);
        node[2 * BANDS + band] = single(u);
    }
    node
}

/// The node at or before a place, never the last, and how far beyond it the place lies.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "the place is inside the table, whose sides are far below 2^24"
)]
#[inline(always)]
fn cell(at: f32, size: usize) -> (usize, f32) {
    let whole = (at as usize).min(size - 2);
    (whole, at - whole as f32)
}

#[expect(clippy::cast_precision_loss, reason = "nodes of a table are far below 2^52")]
fn real(k: usize) -> f64 {
    k as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_optics::Light;
    use host_optics::sky::{ClearSky, Polarized, Rayleigh};

    #[test]
    fn a_clear_sky_is_met_between_the_nodes() {
        let sun = DVec3::new(0.5, 0.6, 0.6).normalize();
        let light = Polarized {
            light: ClearSky { base: 1.0, horizon: 0.5, aureole: 0.5, width: 0.5, sun },
            pattern: Rayleigh::new(sun, 0.8).unwrap(),
        };
        let table = SkyTable::sample(|w| [light.stokes(w); BANDS], |_| [1.0; BANDS], 256);
        for k in 0..500 {
            let (z, azimuth) = (0.03 + 0.97 * f64::from(k) / 499.0, 2.4 * f64::from(k));
            let w = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
            let [expected, ..] = [light.stokes(w)];
            let turn = Frame::sky(w).turn_to(SkyTable::frame(w).x);
            let [_, _, found] = table.stokes(w);
            let found = turn.apply_linear(found);
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-4, "{found} against {expected} at {w}");
            }
            let [radiance, ..] = table.radiance(w.to_array());
            assert!((radiance - expected[0]).abs() < 2e-4);
        }
    }
}
