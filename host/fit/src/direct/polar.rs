//! Quadrature over the visible sky {n·ω > 0, ω_z > 0} in polar coordinates about one of its directions.
//!
//! Along a ray ω = m cos θ + e sin θ the ends of the domain are known in closed form. The two directions on both horizons are
//! antipodal, so their azimuths about any center differ by π exactly: each half turn between them has one active horizon and a
//! smooth integrand. Rules are Fejér's first (Fejér 1933), which is open, spectral and has its weights in closed form.

use core::f64::consts::PI;
use glam::DVec3;
use host_optics::frames::{direction, tangents};

/// Fejér's first rule on [0, 1]: nodes (1 + cos θ_k)/2, θ_k = (k + ½)π/N; exact for polynomials of degree N − 1.
pub(super) fn fejer(order: u32) -> Vec<(f64, f64)> {
    let n = f64::from(order.max(1));
    let node = |k: u32| {
        let angle = PI * (f64::from(k) + 0.5) / n;
        let sum: f64 = (1..=order / 2)
            .map(f64::from)
            // The last of an even number of terms stands for a frequency the nodes do not see: it vanishes there by itself.
            .map(|j| (2.0 * j * angle).cos() / (4.0 * j * j - 1.0))
            .sum();
        (0.5 * (1.0 + angle.cos()), (1.0 - 2.0 * sum) / n)
    };
    (0..order.max(1)).map(node).collect()
}

/// The rays of a half turn and the nodes along each.
#[derive(Clone, Debug)]
pub(super) struct Polar {
    /// cos φ, sin φ and the weight in φ.
    azimuths: Vec<[f64; 3]>,
    /// Node and weight on [0, 1].
    radii: Vec<(f64, f64)>,
}

/// One ray of a [`Polar`] rule about a center.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// Unit vector across the center.
    pub(super) e: DVec3,
    /// The visible θ along it, low < high.
    pub(super) ends: [f64; 2],
    /// Weight in azimuth.
    pub(super) weight: f64,
}

impl Polar {
    /// `order` nodes along a ray and as many azimuths in every half turn.
    pub(super) fn new(order: u32) -> Self {
        let radii = fejer(order);
        let azimuth = |(x, w): &(f64, f64)| {
            let (s, c) = (PI * x).sin_cos();
            [c, s, PI * w]
        };
        Self { azimuths: radii.iter().map(azimuth).collect(), radii }
    }

    /// Node and weight on [0, 1].
    pub(super) fn radii(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.radii.iter().copied()
    }

    /// The rays about unit `center` that see anything of the sky above both horizons.
    pub(super) fn rays(&self, center: DVec3, normal: DVec3) -> impl Iterator<Item = Ray> + '_ {
        let corner = direction(normal.cross(DVec3::Z)).unwrap_or(DVec3::X);
        let (x, y) =
            direction(corner - center * corner.dot(center)).map_or_else(|_| tangents(center), |x| (x, center.cross(x)));
        [1.0, -1.0].into_iter().flat_map(move |half| {
            self.azimuths.iter().filter_map(move |[c, s, weight]| {
                let e = (x * *c + y * *s) * half;
                let ends = visible(center, e, normal, visible(center, e, DVec3::Z, [0.0, PI]));
                (ends[1] > ends[0]).then_some(Ray { e, ends, weight: *weight })
            })
        })
    }

    /// ∫ f(ω) dω over the visible sky, in θ about unit `normal`, for integrands without a peak.
    pub(super) fn hemisphere<const K: usize>(&self, normal: DVec3, mut f: impl FnMut(DVec3) -> [f64; K]) -> [f64; K] {
        let mut sum = [0.0; K];
        for Ray { e, ends: [low, high], weight } in self.rays(normal, normal) {
            for (x, w) in self.radii() {
                let (sine, cosine) = (low + (high - low) * x).sin_cos();
                let weight = weight * w * (high - low) * sine;
                for (total, value) in sum.iter_mut().zip(f(normal * cosine + e * sine)) {
                    *total += weight * value;
                }
            }
        }
        sum
    }
}

/// The part of θ in `within` (0 to π at most) where m cos θ + e sin θ is above the plane across `axis`.
fn visible(m: DVec3, e: DVec3, axis: DVec3, [low, high]: [f64; 2]) -> [f64; 2] {
    // A cos θ + B sin θ = R sin(θ + φ), positive for −φ < θ < π − φ.
    let phase = m.dot(axis).atan2(e.dot(axis));
    [low.max(-phase), high.min(PI - phase)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fejer_is_exact_for_polynomials() {
        for order in [1, 2, 5, 8, 13] {
            for degree in 0..order {
                let sum: f64 = fejer(order).iter().map(|(x, w)| w * x.powi(i32::try_from(degree).unwrap())).sum();
                assert!((sum * f64::from(degree + 1) - 1.0).abs() < 1e-13, "{order} {degree}: {sum}");
            }
        }
    }

    /// ∫ (n·ω) dω over the lune between two horizons is π (1 + cos tilt)/2, the form factor of a tilted plate.
    #[test]
    fn the_tilted_plate_sees_its_share_of_the_sky() {
        for tilt in [0.0, 0.2, 0.5, 0.9_f64] {
            let normal = DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
            let [e] = Polar::new(16).hemisphere(normal, |w| [normal.dot(w)]);
            assert!((e - 0.5 * PI * (1.0 + tilt.cos())).abs() < 1e-7, "{tilt}: {e}");
        }
    }
}
