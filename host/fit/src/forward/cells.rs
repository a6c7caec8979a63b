//! The light one lobe can tell apart, as arrays for vector loops.

use glam::DVec3;
use host_optics::prefilter::{Pyramid, Sources};

/// Cells of the sky and small sources in front of a lobe; single precision, one entry each in every array.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    pub(super) direction: [Vec<f32>; 3],
    /// ∫ L dω, R, G, B.
    pub(super) power: [Vec<f32>; 3],
    /// ∫ (Q, U) dω, R, G, B, in the sky frame of the direction; empty for unpolarized light.
    pub(super) polarization: [[Vec<f32>; 2]; 3],
    /// Variance along one axis of the light inside, radians².
    pub(super) variance: Vec<f32>,
    pub(super) polarized: bool,
}

/// Values along a vector.
pub(super) const WIDE: usize = 8;

/// Widest cell, in units of the fineness: what Fresnel terms and cosines change over.
const WIDEST: f32 = 1.0;

impl Cells {
    /// Entries, a multiple of [`WIDE`]: the last ones may be dark.
    pub(super) fn len(&self) -> usize {
        self.variance.len()
    }

    /// Those a lobe of roughness `alpha` with unit `normal`, seen along `wo`, needs for the light to be resolved to the share
    /// `fineness` of its own width everywhere.
    pub(super) fn gather(
        &mut self,
        sky: &Pyramid,
        sources: &Sources,
        normal: DVec3,
        wo: DVec3,
        alpha: f64,
        fineness: f64,
    ) {
        self.clear(sky.polarized());
        let (n, o) = (normal.as_vec3(), wo.as_vec3());
        let (alpha_squared, share) = (super::numbers::single(alpha * alpha), super::numbers::single(fineness));
        sky.walk(|found| {
            let cell = found.cell;
            let (w, radius) = (cell.direction, cell.radius);
            let cosine = n.dot(w);
            if cosine < -radius {
                return true;
            }
            let sum = w + o;
            // 4 cos² θ_d (α²c_h² + s_h²), c_h and s_h of the half vector sum/|sum|.
            let along = n.dot(sum);
            let width = alpha_squared * along * along + n.cross(sum).length_squared();
            let widest = share * share * width.min(WIDEST);
            if radius * radius > widest {
                return false;
            }
            // At the own horizon, where the lobe ends.
            if cosine < radius && radius > 0.3 * share {
                return false;
            }
            self.push(w.to_array(), cell.power, found.polarization, 1.0 - cell.length);
            true
        });
        for (w, solid_angle) in sources.points.iter().filter(|(w, _)| w.z > 0.0) {
            let power = sources.radiance.map(|l| super::numbers::single(l * solid_angle));
            self.push(w.as_vec3().to_array(), power, [[0.0; 2]; 3], 0.0);
        }
        while !self.len().is_multiple_of(WIDE) {
            self.push([0.0; 3], [0.0; 3], [[0.0; 2]; 3], 0.0);
        }
    }

    fn push(&mut self, direction: [f32; 3], power: [f32; 3], polarization: [[f32; 2]; 3], variance: f32) {
        for k in 0..3 {
            self.direction[k].push(direction[k]);
            self.power[k].push(power[k]);
            if self.polarized {
                for (into, x) in self.polarization[k].iter_mut().zip(polarization[k]) {
                    into.push(x);
                }
            }
        }
        self.variance.push(variance);
    }

    fn clear(&mut self, polarized: bool) {
        self.polarized = polarized;
        for k in 0..3 {
            self.direction[k].clear();
            self.power[k].clear();
            self.polarization[k].iter_mut().for_each(Vec::clear);
        }
        self.variance.clear();
    }
}
