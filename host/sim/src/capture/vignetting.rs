//! The corners of the picture are darker: a factor cosⁿ of the angle off the axis, 4 for a simple lens.
//!
//! Bound: every component of a photosite is scaled by one factor v of its own in [v_min, 1], and |s_j| <= s0: 1 − v_min,
//! v_min in a corner.

use rayon::prelude::*;

use crate::camera::Pinhole;
use crate::frames::{Row, RowStage};
use crate::scene::Scene;
use crate::signal::single;
use crate::{Assessment, Facts};

/// Measured, see [`Assessment::cost_ns_per_pixel`].
const COST_NS: f64 = 0.1;

/// The factor of every photosite, row-major, height × width.
pub(crate) struct Vignetting {
    factors: Vec<f32>,
}

impl Vignetting {
    /// `None` for a lens without any.
    pub(crate) fn of(scene: &Scene, camera: &Pinhole) -> Option<Self> {
        let exponent = scene.camera.vignetting_exponent;
        let row = |row: usize| (0..camera.width).map(move |column| single(factor(camera, exponent, row, column)));
        (exponent > 0.0).then(|| Self { factors: (0..camera.height).into_par_iter().flat_map_iter(row).collect() })
    }
}

impl RowStage for Vignetting {
    fn apply(&self, at: &Row<'_>, electrons: &mut [f32]) {
        let factors = &self.factors[at.row * electrons.len()..][..electrons.len()];
        electrons.iter_mut().zip(factors).for_each(|(e, f)| *e *= f);
    }
}

pub(crate) fn assess(facts: &Facts<'_>) -> Assessment {
    let exponent = facts.scene.camera.vignetting_exponent;
    let corner = facts.scene.views.get(facts.view).map_or(1.0, |camera| factor(camera, exponent, 0, 0));
    Assessment::new(1.0 - corner, COST_NS, format!("cos^{exponent} leaves {corner:.4} in the corners"))
}

fn factor(camera: &Pinhole, exponent: f64, row: usize, column: usize) -> f64 {
    camera.off_axis_cosine(Pinhole::pixel(row, column)).powf(exponent)
}

#[cfg(test)]
mod tests {
    use crate::Effect;
    use crate::frames::testing::{check_bound, studio};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_bound_holds(exponent in 0.0..8.0, focal_px in 5.0..500.0, seed in 0_u64..1000) {
            let mut scene = studio(seed);
            scene.camera.vignetting_exponent = exponent;
            scene.views[0].focal_px = focal_px;
            check_bound(&scene, Effect::Vignetting)?;
        }
    }
}
