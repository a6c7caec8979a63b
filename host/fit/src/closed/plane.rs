//! The normal from planes of incidence (paper eq. 5 and 7): the phase of each view is the direction of the s axis, and the
//! normal is perpendicular to the s axes of all views.

use super::real::{Real, Triple, along, choose, cross, dot, times};

/// What one view says about its plane of incidence.
#[derive(Clone, Copy)]
pub(super) struct Azimuth<R> {
    /// (cos 2φ, sin 2φ) of the phase in the ray's frame.
    pub(super) double: [R; 2],
    /// Unit s axis in the world; its sign means nothing.
    pub(super) axis: Triple<R>,
    /// Variance of φ, rad².
    pub(super) variance: R,
}

/// The normal and how it moves: δn = Σ_j `by_phase`[j] δφ_j.
pub(super) struct Intersection<R, const V: usize> {
    pub(super) normal: Triple<R>,
    pub(super) by_phase: [Triple<R>; V],
    /// sin² of the angle between the planes of incidence (of two views; for more, its counterpart in the weights).
    pub(super) separation: R,
    /// 1 where the planes determine the normal, 0 where it is the one nearest to +z that they allow.
    pub(super) determined: R,
}

/// The axis at angle φ of a frame (x, y), from (cos 2φ, sin 2φ): half-angle by a root, without cancellation.
#[inline(always)]
pub(super) fn axis<R: Real>(x: Triple<R>, y: Triple<R>, [c2, s2]: [R; 2]) -> Triple<R> {
    let (half, one, zero) = (R::of(0.5), R::of(1.0), R::of(0.0));
    let large = (half * (one + c2.abs())).max(half).sqrt();
    let small = half * s2 / large;
    let c = c2.less(zero, small, large);
    let s = c2.less(zero, large, small);
    along(times(x, c), y, s)
}

/// Steepest normal that is believed: n_z.
const LEAST_Z: f64 = 0.05;

/// Largest |δn|² that counts as an answer: (20°)².
const WORST: f64 = 0.12;

/// Least squares over the views: the smallest eigenvector of A = Σ w a aᵀ, w = 1/(σ_φ² sin² θ), since an error δφ moves a·n by
/// sin θ δφ. `known` is 1 for views that count and 0 else; `directions` are ω_o.
///
/// Its adjugate is Σ_{i<j} w_i w_j (a_i × a_j)(a_i × a_j)ᵀ (Cauchy-Binet), a sum without cancellation of which the
/// eigenvector is the largest; for two views it is the cross product itself.
#[inline(always)]
pub(super) fn intersect<R: Real, const V: usize>(
    azimuths: &[Azimuth<R>; V],
    directions: &[Triple<R>; V],
    known: &[R; V],
) -> Intersection<R, V> {
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let up = [zero, zero, one];
    let mut normal = up;
    let mut weights = [zero; V];
    let mut determinant = zero;
    // The angle of incidence is known after a first pass only; with two planes it weighs nothing.
    for _ in 0..if V > 2 { 2 } else { 1 } {
        let mut total = R::of(1e-30);
        for v in 0..V {
            let off = cross(normal, directions[v]);
            weights[v] = known[v] / (azimuths[v].variance * dot(off, off).max(R::of(3e-3)));
            total = total + weights[v];
        }
        let per_total = one / total;
        for weight in &mut weights {
            *weight = *weight * per_total;
        }
        let mut adjugate = [[zero; 3]; 3];
        let mut line = up;
        for i in 0..V {
            for j in i + 1..V {
                line = cross(azimuths[i].axis, azimuths[j].axis);
                let w = weights[i] * weights[j];
                for (row, a) in adjugate.iter_mut().zip(line) {
                    for (cell, b) in row.iter_mut().zip(line) {
                        *cell = *cell + w * a * b;
                    }
                }
            }
        }
        determinant = adjugate[0][0] + adjugate[1][1] + adjugate[2][2];
        if V > 2 {
            line = largest_eigenvector(adjugate);
        }
        let length = dot(line, line).max(R::of(1e-30)).sqrt();
        let upward = line[2].less(zero, -length, length);
        normal = times(line, one / upward);
    }
    let mut by_phase = [up; V];
    let mut spread = zero;
    let per_determinant = one / determinant.max(R::of(1e-12));
    // A⁻¹ in the tangent plane is (tr A − A)/det; Σ w = 1 = tr A.
    for j in 0..V {
        let mut moved = azimuths[j].axis;
        for i in 0..V {
            moved = along(moved, azimuths[i].axis, -weights[i] * dot(azimuths[i].axis, azimuths[j].axis));
        }
        // da/dφ = ω_o × a.
        let lever = dot(cross(directions[j], azimuths[j].axis), normal);
        by_phase[j] = times(moved, -weights[j] * lever * per_determinant);
        spread = spread + azimuths[j].variance * dot(by_phase[j], by_phase[j]);
    }
    let determined =
        spread.is_less(R::of(WORST)) * R::of(1e-9).is_less(determinant) * R::of(LEAST_Z).is_less(normal[2]);
    // Else: +z without its component along the axes that are known.
    let mut nearest = up;
    for v in 0..V {
        nearest = along(nearest, azimuths[v].axis, -weights[v] * azimuths[v].axis[2]);
    }
    let nearest = times(nearest, one / dot(nearest, nearest).max(R::of(1e-12)).sqrt());
    let fallback = choose(R::of(LEAST_Z), nearest[2], nearest, up);
    for v in &mut by_phase {
        for x in v {
            *x = (*x * determined).finite_or(zero);
        }
    }
    Intersection {
        normal: choose(R::of(0.5), determined, normal, fallback),
        by_phase,
        separation: R::of(4.0) * determinant,
        determined,
    }
}

/// Of a symmetric positive semi-definite matrix, of any length: the longest column of M¹⁶.
#[inline(always)]
fn largest_eigenvector<R: Real>(mut m: [Triple<R>; 3]) -> Triple<R> {
    for _ in 0..4 {
        let scale = R::of(1.0) / (m[0][0] + m[1][1] + m[2][2]).max(R::of(1e-30));
        let scaled = [times(m[0], scale), times(m[1], scale), times(m[2], scale)];
        for (row, from) in m.iter_mut().zip(&scaled) {
            *row = [dot(*from, scaled[0]), dot(*from, scaled[1]), dot(*from, scaled[2])];
        }
    }
    let first = choose(m[0][0], m[1][1], m[1], m[0]);
    choose(m[0][0].max(m[1][1]), m[2][2], m[2], first)
}
