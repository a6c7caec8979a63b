//! Fresnel terms of a dielectric lane by lane, and the closed inverse of R⊥ − R∥. Forms as in [`host_optics::fresnel`].

use super::real::Real;
use crate::material::BANDS;

/// Where η is looked for: R⊥ − R∥ rises with η at every angle up to 4.
pub(super) const ETA: [f64; 2] = [1.001, 3.0];

/// q = √(η² − 1 + c²), R⊥, t and what follows from them at one incidence.
#[derive(Clone, Copy)]
pub(super) struct Fresnel<R> {
    /// D = R⊥ − R∥.
    pub(super) difference: R,
    /// ∂D/∂η.
    pub(super) difference_by_eta: R,
    /// ∂D/∂c along the circle c² + s² = 1.
    pub(super) difference_by_cosine: R,
    /// Specular DoLP (1 − t²)/(1 + t²) under unpolarized light.
    pub(super) dolp: R,
    /// ∂DoLP/∂η.
    pub(super) dolp_by_eta: R,
    /// ∂DoLP/∂c along the circle.
    pub(super) dolp_by_cosine: R,
}

impl<R: Real> Fresnel<R> {
    /// At η > 1 and an incidence (c, s²), c > 0.
    #[inline(always)]
    pub(super) fn at(eta: R, c: R, s2: R) -> Self {
        let (one, two, four) = (R::of(1.0), R::of(2.0), R::of(4.0));
        let e = (eta - one) * (eta + one);
        let q2 = e + c * c;
        let q = q2.sqrt();
        let (cq, sum) = (c * q, c + q);
        let (per_q, per_square, w) = (one / q, one / (sum * sum), one / (cq + s2));
        let t = (cq - s2) * w;
        // r_s² and r_s²/(η² − 1).
        let root = e * per_square;
        let (perpendicular, per_e) = (root * root, root * per_square);
        let twice_w2 = two * w * w;
        let t_by_eta = twice_w2 * c * s2 * eta * per_q;
        let t_by_cosine = twice_w2 * (s2 * (q2 + c * c) + two * cq * cq) * per_q;
        let one_minus = two * twice_w2 * cq * s2;
        let difference = perpendicular * one_minus;
        let twice = two * perpendicular * t;
        let per_both = one / (one + t * t);
        let dolp = one_minus * per_both;
        let dolp_by_t = -four * t * per_both * per_both;
        Self {
            difference,
            difference_by_eta: four * eta * c * per_q * per_e * one_minus - twice * t_by_eta,
            difference_by_cosine: -four * per_q * difference - twice * t_by_cosine,
            dolp,
            dolp_by_eta: dolp_by_t * t_by_eta,
            dolp_by_cosine: dolp_by_t * t_by_cosine,
        }
    }
}

/// What the inverse of D needs to know of an incidence.
#[derive(Clone, Copy)]
pub(super) struct Inverse<R> {
    c: R,
    s2: R,
    /// c² and 2cs.
    c2: R,
    double: R,
    /// Bounds of the start and of the answer.
    lowest: R,
    highest: R,
}

impl<R: Real> Inverse<R> {
    /// At an incidence (c, s²), c > 0.
    #[inline(always)]
    pub(super) fn at(c: R, s2: R) -> Self {
        let (c2, per_c) = (c * c, R::of(1.0) / c);
        Self {
            c,
            s2,
            c2,
            double: R::of(2.0) * c * s2.sqrt(),
            // Near the normal D says R⊥ badly: not from below η = 1.3 there.
            lowest: ((R::of(0.69) + c2).sqrt() * per_c).sqrt(),
            highest: ((R::of(ETA[1] * ETA[1] - 1.0) + c2).sqrt() * per_c).sqrt(),
        }
    }

    /// η of every band from D = R⊥ − R∥, at most the end of [`ETA`]; never NaN.
    ///
    /// With q = c y², √D = N/M, N = 2cs y (y² − 1), M = (y² + 1)(c² y² + s²). The start is the closed inverse of R⊥ = D (the
    /// paper's, exact at the Brewster angle): y² = (1 + √D)/(1 − √D). Three of Halley's steps on N/M, each with one division,
    /// take R∥ off: within 6e-6 for incidences up to 89° and η up to 3. The bands go step by step together: one alone is a
    /// chain of instructions that wait for each other.
    #[inline(always)]
    pub(super) fn eta(&self, difference: [R; BANDS]) -> [R; BANDS] {
        let (one, two, three) = (R::of(1.0), R::of(2.0), R::of(3.0));
        let Self { c, s2, c2, double, lowest, highest } = *self;
        let sum = c2 + s2;
        let (mut root, mut y) = (difference, difference);
        for b in 0..BANDS {
            root[b] = difference[b].max(R::of(1e-12)).min(R::of(0.81)).sqrt();
            y[b] = ((one + root[b]) / (one - root[b])).sqrt().max(lowest).min(highest);
        }
        for _ in 0..3 {
            for b in 0..BANDS {
                let y2 = y[b] * y[b];
                let (n, m) = (double * y[b] * (y2 - one), (y2 + one) * (c2 * y2 + s2));
                let (n_by, m_by) = (double * (three * y2 - one), two * y[b] * (two * c2 * y2 + sum));
                // M (√D − N/M), M² (N/M)′ and ½ M² (N/M)″ + (M′/M) M² (N/M)′.
                let miss = root[b] * m - n;
                let slope = n_by * m - n * m_by;
                let bend = three * double * y[b] * m - n * (R::of(6.0) * c2 * y2 + sum);
                let square = slope * slope;
                // Never farther than four of Newton's steps.
                let below = (square + miss * (bend * m - slope * m_by)).max(R::of(0.25) * square);
                y[b] = (y[b] + miss * slope * m / below).min(highest).max(R::of(1.000_001));
            }
        }
        let mut eta = y;
        for b in 0..BANDS {
            let q = c * y[b] * y[b];
            eta[b] = (one + (q - c) * (q + c)).sqrt();
        }
        eta
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_optics::{Dielectric, Incidence};
    use protocol_polar::Radians;

    fn optics(eta: f64, theta: f64) -> (f64, f64) {
        let (ior, at) = (Dielectric::new(eta).unwrap(), Incidence::from_angle(Radians(theta)));
        (ior.difference(at), ior.specular_dolp(at))
    }

    #[test]
    fn the_inverse_and_the_derivatives_are_those_of_host_optics() {
        let step = 1e-6;
        for degrees in [25.0, 40.0, 56.3, 70.0, 85.0] {
            let theta = f64::to_radians(degrees);
            for eta in [1.05, 1.3, 1.5, 2.0, 2.5] {
                let (s, c) = theta.sin_cos();
                let (difference, dolp) = optics(eta, theta);
                let [found, ..] = Inverse::at(c, s * s).eta([difference; BANDS]);
                assert!((found - eta).abs() < 1e-7, "{found} for {eta} at {degrees}");
                let at = Fresnel::at(eta, c, s * s);
                assert!((at.difference / difference - 1.0).abs() < 1e-9 && (at.dolp / dolp - 1.0).abs() < 1e-9);
                // d/dc along the circle is −1/sin θ d/dθ.
                let [up, down] = [optics(eta + step, theta), optics(eta - step, theta)];
                let [on, back] = [optics(eta, theta + step), optics(eta, theta - step)];
                for (found, expected) in [
                    (at.difference_by_eta, (up.0 - down.0) / (2.0 * step)),
                    (at.dolp_by_eta, (up.1 - down.1) / (2.0 * step)),
                    (at.difference_by_cosine, (back.0 - on.0) / (2.0 * step * s)),
                    (at.dolp_by_cosine, (back.1 - on.1) / (2.0 * step * s)),
                ] {
                    assert!((found - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{found} against {expected}");
                }
            }
        }
    }
}
