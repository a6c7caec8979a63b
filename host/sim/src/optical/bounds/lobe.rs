//! Moments of the GGX distribution of slopes, P22 = α²/(π (α² + r²)²) per dm, and what a lobe surely sends to the camera.
//!
//! With slopes m (facet normal h ∝ n + m) paper eq. 6 is ∫ P22 G2 (1 + m·t)₊ F(h) dm, t the tangent part of ω_o over n·ω_o,
//! |t| = tan θ_o, and F what a mirror h sends to the camera.

use crate::optical::{LightBounds, Surface, SurfaceExtent};
use core::f64::consts::FRAC_PI_2;
use host_optics::{Incidence, Ior, Masking};
use protocol_polar::Radians;

/// The lobe of one surface over all its pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe<'a> {
    surface: &'a Surface,
    light: &'a LightBounds,
    /// Range of θ_o.
    theta: [f64; 2],
    /// Slopes up to here mirror into the sky above both horizons, whatever their azimuth.
    pub(crate) reach: f64,
}

impl<'a> Lobe<'a> {
    pub(crate) fn new(surface: &'a Surface, extent: &SurfaceExtent, light: &'a LightBounds) -> Self {
        // f32 pixels: 1e-6 rad covers their rounding.
        let theta = [extent.cosine[1], extent.cosine[0]].map(|c| c.clamp(-1.0, 1.0).acos());
        let theta = [(theta[0] - 1e-6).max(0.0), theta[1] + 1e-6];
        // A slope r turns the facet by atan r and the mirrored ray by twice that.
        let horizon = (FRAC_PI_2 - theta[1]).min(extent.lowest_mirror.clamp(-1.0, 1.0).asin());
        let reach = (0.5 * horizon - 1e-6).tan().min(1.0 / theta[1].tan().max(1e-9));
        Self { surface, light, theta, reach: reach.max(0.0) }
    }

    fn alpha(&self) -> f64 {
        self.surface.ggx.alpha()
    }

    /// Mass of slopes beyond r: α²/(α² + r²).
    pub(crate) fn mass_beyond(&self, r: f64) -> f64 {
        let a2 = self.alpha() * self.alpha();
        a2 / (a2 + r * r)
    }

    /// ∫ P22 |m| over slopes beyond r: α (π/2 − atan(r/α)) + α² r/(α² + r²).
    pub(crate) fn first_beyond(&self, r: f64) -> f64 {
        self.alpha() * self.alpha().atan2(r) + self.mass_beyond(r) * r
    }

    /// ∫ P22 |m|² over slopes up to r: α² (ln(1 + r²/α²) − r²/(α² + r²)).
    pub(crate) fn second_within(&self, r: f64) -> f64 {
        let a2 = self.alpha() * self.alpha();
        a2 * ((r * r / a2).ln_1p() - r * r / (a2 + r * r))
    }

    /// Least G2 of slopes up to r.
    pub(crate) fn least_masking(&self, r: f64) -> f64 {
        let at = |theta: f64| self.surface.ggx.lambda(Incidence::from_angle(Radians(theta)));
        let (o, i) = (at(self.theta[1]), at(self.theta[1] + 2.0 * r.atan()));
        match self.surface.ggx.masking() {
            Masking::HeightCorrelated => 1.0 / (1.0 + o + i),
            Masking::Separable => 1.0 / ((1.0 + o) * (1.0 + i)),
        }
    }

    /// Least and largest s0 of a mirror at a slope up to r, over bands: ½ R⊥ <= ½ (R⊥ + R∥) <= R⊥, and R⊥ grows with θ.
    pub(crate) fn mirror_range(&self, r: f64, k: usize) -> [f64; 2] {
        let tilt = r.atan();
        let [low, high] = self.light.range[k];
        let p = self.light.max_dolp;
        let least = 0.5 * perpendicular(self.surface.ior[k], self.theta[0] - tilt) * low * (1.0 - p);
        let most = perpendicular(self.surface.ior[k], self.theta[1] + tilt) * high * (1.0 + p);
        [least, most]
    }

    /// What the specular s0 of any pixel has at least, from slopes up to r (whose mean of 1 + m·t is 1).
    pub(crate) fn least(&self, r: f64, k: usize) -> f64 {
        (1.0 - self.mass_beyond(r)) * self.least_masking(r) * self.mirror_range(r, k)[0]
    }

    /// What slopes beyond r send to the camera at most, unmasked: rings that double, each with its largest reflectance.
    pub(crate) fn tail(&self, r: f64, k: usize) -> f64 {
        let tan = self.theta[1].tan();
        let mut sum = 0.0;
        let mut inner = r;
        for ring in 0..8 {
            let outer = if ring == 7 { f64::INFINITY } else { 2.0 * inner };
            let beyond = |r: f64| if r.is_finite() { [self.mass_beyond(r), self.first_beyond(r)] } else { [0.0; 2] };
            let ([m0, f0], [m1, f1]) = (beyond(inner), beyond(outer));
            sum += (m0 - m1 + tan * (f0 - f1)) * self.mirror_range(outer, k)[1];
            inner = outer;
        }
        sum
    }
}

fn perpendicular(ior: Ior, theta: f64) -> f64 {
    ior.reflectance(Incidence::from_angle(Radians(theta.clamp(0.0, FRAC_PI_2)))).perpendicular
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optical::Body;
    use host_optics::Ggx;

    #[test]
    fn moments_are_those_of_the_distribution() {
        let surface = Surface {
            ior: [Ior::new(1.5, 0.0).unwrap(); 3],
            ggx: Ggx::new(0.1, Masking::HeightCorrelated).unwrap(),
            body: Body::Lambert,
        };
        let light = LightBounds { range: [[1.0, 1.0]; 3], max_dolp: 0.0 };
        let lobe = Lobe { surface: &surface, light: &light, theta: [0.0, 0.5], reach: 0.3 };
        let integral = |power: i32, from: f64, to: f64| {
            let steps = 100_000;
            let h = (to - from) / f64::from(steps);
            let at = |k: i32| from + (f64::from(k) + 0.5) * h;
            (0..steps).map(|k| 2.0 * 0.01 * at(k).powi(power + 1) / (0.01 + at(k).powi(2)).powi(2) * h).sum::<f64>()
        };
        let beyond = |power| integral(power, 0.3, 50.0) + 2.0 * 0.01 * 50.0_f64.powi(power - 2) / f64::from(2 - power);
        assert!((lobe.mass_beyond(0.3) - beyond(0)).abs() < 1e-6);
        assert!((lobe.first_beyond(0.3) - beyond(1)).abs() < 1e-6);
        assert!((lobe.second_within(0.3) - integral(2, 0.0, 0.3)).abs() < 1e-6);
    }
}
