//! DoLP and AoLP: their first-order uncertainty and the bias of DoLP.

use protocol_polar::Radians;

/// First-order standard deviations of what is read off a Stokes vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// σ of DoLP, in units of DoLP.
    pub dolp: f64,
    /// σ of AoLP. Meaningful while it is small (below some 10°): the angle lives on a circle.
    pub aolp: Radians,
}

/// Propagates the covariance of (s0, s1, s2) to first order, correlations included.
///
/// With P = √(s1² + s2²)/s0 and φ = ½ atan2(s2, s1): ∇P = (−P, cos 2φ, sin 2φ)/s0 and ∇φ = (0, −sin 2φ, cos 2φ)/(2 s0 P).
/// `None` where there is no light (s0 <= 0) or no polarization at all: neither derivative exists there.
#[must_use]
pub fn uncertainty(stokes: [f64; 3], covariance: [[f64; 3]; 3]) -> Option<Uncertainty> {
    let [s0, s1, s2] = stokes;
    let linear = s1.hypot(s2);
    if !(s0 > 0.0 && linear > 0.0) {
        return None;
    }
    let (c, s) = (s1 / linear, s2 / linear);
    let sigma = |gradient: [f64; 3]| {
        let variance: f64 = gradient
            .iter()
            .zip(&covariance)
            .map(|(g, row)| g * row.iter().zip(&gradient).map(|(v, h)| v * h).sum::<f64>())
            .sum();
        // Rounding may leave a tiny negative variance where the true one is zero.
        variance.max(0.0).sqrt()
    };
    Some(Uncertainty { dolp: sigma([-linear / s0, c, s]) / s0, aolp: Radians(sigma([0.0, -s, c]) / (2.0 * linear)) })
}

/// The one σ of s1/s0 and s2/s0 that [`mas`] wants, √((var s1 + var s2)/2)/s0: an approximation wherever the two
/// variances differ or are correlated. `None` where there is no light.
#[must_use]
pub fn isotropic_sigma(s0: f64, covariance: [[f64; 3]; 3]) -> Option<f64> {
    let mean = 0.5 * (covariance[1][1] + covariance[2][2]);
    (s0 > 0.0).then(|| mean.max(0.0).sqrt() / s0)
}

/// DoLP with its bias taken off: the modified asymptotic estimator p − σ² (1 − exp(−p²/σ²))/(2p) of Plaszczynski et al.
/// 2014 (MNRAS 439, 4048), eq. 37 without its noise anisotropy term.
///
/// `dolp` >= 0 as measured, `sigma` >= 0 of s1/s0 and s2/s0. Both components must have the *same* σ and no correlation (an
/// equispaced set of angles and additive noise): see [`isotropic_sigma`]. The result lies in [p/2, p]; the mean over noise
/// is the true DoLP from about three σ on, and σ itself (not 0) for unpolarized light. Within 3 ulp (`cargo xtask ulp`).
#[must_use]
pub fn mas(dolp: f64, sigma: f64) -> f64 {
    let x = (dolp / sigma).powi(2);
    // (1 − exp(−x))/x, which is 1 where x underflows (and where 0/0 asks), 0 for a σ of 0.
    let ratio = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
    dolp * (1.0 - 0.5 * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mas_at_the_ends() {
        assert!(mas(0.0, 0.1).abs() < f64::MIN_POSITIVE);
        assert!(mas(0.0, 0.0).abs() < f64::MIN_POSITIVE);
        assert!((mas(0.3, 0.0) - 0.3).abs() < 1e-16);
        assert!((mas(1e-200, 1.0) / 5e-201 - 1.0).abs() < 1e-15, "underflow of p² must not undo the correction");
    }

    /// PHYSICS §4: N equispaced angles, additive σ: σ_AoLP = (σ/(s0 P))√(2/N), σ_DoLP = (σ/s0)√(8/N)√(1 + P²/2).
    #[test]
    fn equispaced_angles_have_the_closed_form_sigmas() {
        for (n, p, phi) in [(3.0, 0.2, 0.4), (4.0, 0.9, 2.0), (8.0, 0.05, 1.0_f64)] {
            let (s0, sigma) = (700.0, 3.0);
            let v = sigma * sigma / n;
            let cov = [[4.0 * v, 0.0, 0.0], [0.0, 8.0 * v, 0.0], [0.0, 0.0, 8.0 * v]];
            let s = [s0, s0 * p * (2.0 * phi).cos(), s0 * p * (2.0 * phi).sin()];
            let u = uncertainty(s, cov).unwrap();
            let aolp = sigma / (s0 * p) * (2.0 / n).sqrt();
            let dolp = sigma / s0 * (8.0 / n).sqrt() * (1.0 + p * p / 2.0).sqrt();
            assert!((u.aolp.0 / aolp - 1.0).abs() < 1e-14 && (u.dolp / dolp - 1.0).abs() < 1e-14);
        }
        assert_eq!(uncertainty([0.0, 1.0, 0.0], [[1.0; 3]; 3]), None);
        assert_eq!(uncertainty([1.0, 0.0, 0.0], [[1.0; 3]; 3]), None);
    }
}
