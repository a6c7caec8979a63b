//! What enters the body: irradiance, and what of it passes the interface.

use super::{Pyramid, Sources};
use crate::diffuse::transmitted_row;
use crate::{Dielectric, Frame};
use glam::DVec3;

/// Largest radius of a cell of the sky, radians, above and about the surface's horizon.
const CELL: f64 = 0.07;
const CELL_AT_HORIZON: f64 = 0.02;

/// E of three bands on a plane with unit `normal`, or, with the interface of a `body`, what of it is transmitted inwards
/// (for [`crate::integral::polarized_diffuse`]). Of the sky and of small sources.
///
/// Error below 1e-4 of the result, against [`crate::integral::Adaptive`] under the skies of [`super::Fineness`].
#[must_use]
pub fn irradiance(sky: &Pyramid, sources: &Sources, body: Option<[Dielectric; 3]>, normal: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let row =
        |k: usize, w: DVec3, frame: &Frame| body.map_or([1.0, 0.0, 0.0], |b| transmitted_row(b[k], w, frame, normal));
    let gray = body.is_none_or(|[r, g, b]| r == g && g == b);
    let rows = |w: DVec3, frame: &Frame| {
        let first = row(0, w, frame);
        if gray { [first; 3] } else { [first, row(1, w, frame), row(2, w, frame)] }
    };
    sky.walk(|found| {
        let w = found.cell.direction.as_dvec3();
        let cosine = normal.dot(w);
        let radius = f64::from(found.cell.radius);
        if cosine < -radius {
            return true;
        }
        if radius > CELL || (radius > CELL_AT_HORIZON && cosine < radius + 0.2) {
            return false;
        }
        if cosine > 0.0 {
            let length = f64::from(found.cell.length);
            let rows = rows(w, &Frame::sky(w));
            for (k, (s, [a, b, c])) in sum.iter_mut().zip(rows).enumerate() {
                let [q, u] = found.polarization[k].map(f64::from);
                *s += cosine * length * (a * f64::from(found.cell.power[k]) + b * q + c * u);
            }
        }
        true
    });
    for (w, solid_angle) in sources.risen() {
        let cosine = normal.dot(*w);
        if cosine > 0.0 {
            let rows = rows(*w, &Frame::sky(*w));
            for (k, s) in sum.iter_mut().enumerate() {
                *s += cosine * solid_angle * sources.radiance[k] * rows[k][0];
            }
        }
    }
    sum
}
