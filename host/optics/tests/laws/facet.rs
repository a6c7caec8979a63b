//! GGX and the microfacet and diffuse Mueller matrices: normalization, sampling, reciprocity, realizability, frames.

use crate::{above, index, roughness};
use core::f64::consts::{LN_2, PI};
use glam::DVec3;
use host_optics::{
    Dielectric, Frame, Ggx, Incidence, Masking, Microfacet, OpticsError, PolarizedDiffuse, Reflection, Turn,
};
use proptest::prelude::*;
use protocol_polar::{Mueller, Radians};

const BOTH: [Masking; 2] = [Masking::HeightCorrelated, Masking::Separable];

fn correlated(alpha: f64) -> Ggx {
    Ggx::new(alpha, Masking::HeightCorrelated).unwrap()
}

/// 2^k × 2^k midpoints of the unit square.
fn square(side: u32) -> impl Iterator<Item = [f64; 2]> {
    let step = 1.0 / f64::from(side);
    (0..side).flat_map(move |i| (0..side).map(move |j| [(f64::from(i) + 0.5) * step, (f64::from(j) + 0.5) * step]))
}

#[test]
fn roughness_outside_the_model_is_refused() {
    for alpha in [0.0, -0.1, 1.1, 1e-9, f64::NAN] {
        assert!(matches!(Ggx::new(alpha, Masking::Separable), Err(OpticsError::Roughness(_))), "{alpha}");
    }
}

/// ∫ D cos dω over θ_h up to Θ is T²/(α² + T²), T = tan Θ: the distribution is that of projected area.
#[test]
fn the_distribution_has_unit_projected_area() {
    for alpha in [1e-5, 0.01, 0.3, 1.0] {
        let ggx = correlated(alpha);
        // In x = asinh(tan θ/α) the integrand is smooth; tan from 0 to T.
        let (end, steps) = ((1.0_f64 / alpha).asinh(), 4000_u32);
        let width = end / f64::from(steps);
        let sum: f64 = (0..steps)
            .map(|k| {
                let x = (f64::from(k) + 0.5) * width;
                let tan = alpha * x.sinh();
                let c = 1.0 / 1.0_f64.hypot(tan);
                let at = Incidence { cosine: c, sine_squared: (tan * c).powi(2) };
                // dω = 2π sin dθ, dθ = c² d tan.
                2.0 * PI * ggx.d(at) * c * (tan * c) * c * c * alpha * x.cosh() * width
            })
            .sum();
        let expected = 1.0 / (1.0 + alpha * alpha);
        assert!((sum / expected - 1.0).abs() < 1e-5, "alpha {alpha}: {sum} against {expected}");
    }
}

/// α = 1 at normal incidence: facets are uniform in cos² and the albedo of a perfect mirror surface is 1 − ln 2.
#[test]
fn the_white_furnace_at_full_roughness() {
    for masking in BOTH {
        let ggx = Ggx::new(1.0, masking).unwrap();
        let o = Incidence { cosine: 1.0, sine_squared: 0.0 };
        let mut sum = 0.0;
        for u in square(512) {
            let h = ggx.sample_visible(DVec3::Z, u);
            let wi = h * (2.0 * h.z) - DVec3::Z;
            sum += ggx.visible_weight(Incidence::between(DVec3::Z, wi), o);
        }
        let albedo = sum / 512.0 / 512.0;
        assert!((albedo - (1.0 - LN_2)).abs() < 1e-5, "{masking:?}: {albedo}");
    }
}

/// The share of samples in a cone about the normal is the integral of the stated density over it.
#[test]
fn sampled_facets_follow_their_density() {
    for (alpha, theta) in [(0.05, 0.2), (0.3, 1.2), (1.0, 0.9), (0.3, 1.5)] {
        let ggx = correlated(alpha);
        let wo = DVec3::new(f64::sin(theta), 0.0, f64::cos(theta));
        let o = Incidence::between(DVec3::Z, wo);
        let limit = 1.0 / 1.0_f64.hypot(alpha);
        let inside = square(512).filter(|u| ggx.sample_visible(wo, *u).z > limit).count();
        // Over the cone tan θ_h < α: u = tan²/α² in [0, 1], azimuth; dω = π α² cos³ dx dy.
        let sum: f64 = square(256)
            .map(|[x, y]| {
                let tan = alpha * x.sqrt();
                let c = 1.0 / 1.0_f64.hypot(tan);
                let (s, k) = (2.0 * PI * y).sin_cos();
                let h = DVec3::new(tan * c * k, tan * c * s, c);
                ggx.visible_density(o, Incidence::between(DVec3::Z, h), wo.dot(h)) * PI * alpha * alpha * c.powi(3)
            })
            .sum();
        let (share, expected) = (inside as f64 / 512.0_f64.powi(2), sum / 256.0_f64.powi(2));
        assert!((share - expected).abs() < 4e-3, "alpha {alpha}, theta {theta}: {share} against {expected}");
    }
}

#[test]
fn diffuse_light_leaves_polarized_across_the_specular() {
    // η = 1.5 at 56.3°: DoLP 0.0799, across the s axis.
    let eta = 1.5_f64;
    let theta = eta.atan();
    let wo = DVec3::new(theta.sin(), 0.0, theta.cos());
    let body = PolarizedDiffuse { ior: Dielectric::new(eta).unwrap(), albedo: 0.5 };
    let s_axis = DVec3::Z.cross(wo);
    let [l, q, u] = body.emission(wo, &Frame::camera(wo, s_axis).unwrap(), DVec3::Z);
    assert!((-q / l - 0.0799).abs() < 5e-5 && u.abs() < 1e-16, "{}", q / l);
}

#[test]
fn a_turn_is_a_rotation() {
    let (a, b) = (Radians(0.4), Radians(-1.3));
    let both = Turn::by(a).then(Turn::by(b));
    let direct = Turn::by(Radians(-0.9));
    assert!((both.cos - direct.cos).abs() + (both.sin - direct.sin).abs() < 1e-15);
    let (full, own) = (Mueller::rotation(a), Turn::by(a).mueller());
    assert!(full.0.iter().flatten().zip(own.0.iter().flatten()).all(|(x, y)| (x - y).abs() < 1e-16));
    let (s, c) = 0.4_f64.sin_cos();
    let towards = Turn::towards(1e-200 * c, 1e-200 * s);
    assert!((towards.cos - Turn::by(a).cos).abs() < 1e-15 && (towards.sin - Turn::by(a).sin).abs() < 1e-15);
}

fn frames(wi: DVec3, wo: DVec3, roll: f64) -> (Frame, Frame) {
    let camera = Frame::camera(wo, wo.any_orthonormal_vector()).unwrap();
    let x = camera.x * roll.cos() + camera.y * roll.sin();
    (Frame::sky(wi), Frame::camera(wo, x).unwrap())
}

/// Elementary symmetric polynomials of the eigenvalues of Cloude's coherency matrix, scaled to trace 1, of a Mueller matrix whose
/// fourth row and column are 0; none for the zero matrix.
fn coherency_coefficients(m: &[[f64; 3]; 3]) -> Vec<f64> {
    if m[0][0] <= 0.0 {
        return Vec::new();
    }
    // σ of s0 (power), s1 (x − y) and s2 (diagonal); all of them real.
    let sigma: [[[f64; 2]; 2]; 3] = [[[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]];
    let mut h = [[0.0; 4]; 4];
    for (j, row) in m.iter().enumerate() {
        for (k, x) in row.iter().enumerate() {
            for (a, line) in h.iter_mut().enumerate() {
                for (b, entry) in line.iter_mut().enumerate() {
                    *entry += 0.25 * x / m[0][0] * sigma[j][a / 2][b / 2] * sigma[k][a % 2][b % 2];
                }
            }
        }
    }
    let product = |p: &[[f64; 4]; 4], q: &[[f64; 4]; 4]| {
        let entry = |a: usize, b: usize| (0..4).map(|k| p[a][k] * q[k][b]).sum::<f64>();
        [0, 1, 2, 3].map(|a| [0, 1, 2, 3].map(|b| entry(a, b)))
    };
    let mut power = h;
    let mut traces = Vec::new();
    for _ in 0..4 {
        traces.push((0..4).map(|k| power[k][k]).sum::<f64>());
        power = product(&power, &h);
    }
    // e_n = 1/n Σ (−1)^(i − 1) e_(n − i) p_i.
    let mut e = vec![1.0];
    for n in 1..=4_u32 {
        let sum: f64 =
            (1..=n).map(|i| if i % 2 == 1 { 1.0 } else { -1.0 } * e[(n - i) as usize] * traces[i as usize - 1]).sum();
        e.push(sum / f64::from(n));
    }
    e
}

proptest! {
    #[test]
    fn linear_light_stays_physical_and_finite(
        wi in above(), wo in above(), ior in index(), alpha in roughness(),
        p in 0.0..=1.0_f64, psi in -2.0..2.0_f64, roll in 0.0..6.0_f64, separable in any::<bool>(),
    ) {
        let masking = if separable { Masking::Separable } else { Masking::HeightCorrelated };
        let surface = Microfacet { ior, ggx: Ggx::new(alpha, masking).unwrap() };
        let (incident, outgoing) = frames(wi, wo, roll);
        let light = [1.0, p * (2.0 * psi).cos(), p * (2.0 * psi).sin()];
        let [l, q, u] = surface.linear(wi, &incident, wo, &outgoing, DVec3::Z).apply(light);
        prop_assert!(l.is_finite() && l >= -1e-15 * l.abs() && q.hypot(u) <= l * (1.0 + 1e-12) + 1e-300, "{l} {q} {u}");
        let reflection = Reflection::at_facet(ior, wi, &incident, wo, &outgoing);
        let [l, q, u] = reflection.apply(light);
        prop_assert!((-1e-14..=1.0 + 1e-14).contains(&l) && q.hypot(u) <= l + 1e-14);
        let full = reflection.mueller().0;
        for (row, own) in full.iter().zip(reflection.linear().0) {
            for (a, b) in row.iter().zip(own) {
                prop_assert!((a - b).abs() <= 1e-15 * 4.0);
            }
        }
        for x in [surface.factor_by_alpha(wi, wo, DVec3::Z), surface.factor(wi, wo, DVec3::Z)] {
            prop_assert!(x.is_finite());
        }
        let albedo = 0.7;
        if let host_optics::Ior::Dielectric(ior) = ior {
            let body = PolarizedDiffuse { ior, albedo };
            let [l, q, u] = body.linear(wi, &incident, wo, &outgoing, DVec3::Z).apply(light);
            prop_assert!(l >= 0.0 && l <= 2.0 * albedo / PI && q.hypot(u) <= l * (1.0 + 1e-12), "{l} {q} {u}");
        }
    }

    /// Reversing the light transposes the matrix; s2 changes sign because the reversed beam is seen from behind.
    #[test]
    fn reciprocity(wi in above(), wo in above(), ior in index(), alpha in 0.01..1.0_f64, roll in 0.0..6.0_f64) {
        let surface = Microfacet { ior, ggx: correlated(alpha) };
        let (incident, outgoing) = frames(wi, wo, roll);
        let forth = surface.linear(wi, &incident, wo, &outgoing, DVec3::Z).0;
        let back = surface
            .linear(wo, &Frame::incident(wo, outgoing.x).unwrap(), wi, &Frame::camera(wi, incident.x).unwrap(), DVec3::Z)
            .0;
        let sign = [1.0, 1.0, -1.0];
        for r in 0..3 {
            for c in 0..3 {
                let reversed = sign[r] * sign[c] * back[c][r];
                prop_assert!((forth[r][c] - reversed).abs() <= 1e-9 * forth[0][0], "{forth:?} {back:?}");
            }
        }
    }

    /// The same in 4 × 4, M(ω_o → ω_i) = Q M(ω_i → ω_o)ᵀ Q with Q = diag(1, 1, −1, 1), and below the interface.
    #[test]
    fn reciprocity_of_the_full_matrix_and_of_the_body(
        wi in above(), wo in above(), ior in index(), alpha in 0.01..1.0_f64, roll in 0.0..6.0_f64, eta in 1.0..3.0_f64,
    ) {
        let surface = Microfacet { ior, ggx: correlated(alpha) };
        let (incident, outgoing) = frames(wi, wo, roll);
        let (from, to) = (Frame::incident(wo, outgoing.x).unwrap(), Frame::camera(wi, incident.x).unwrap());
        let forth = surface.mueller(wi, &incident, wo, &outgoing, DVec3::Z).0;
        let back = surface.mueller(wo, &from, wi, &to, DVec3::Z).0;
        let q = [1.0, 1.0, -1.0, 1.0];
        for r in 0..4 {
            for c in 0..4 {
                prop_assert!((forth[r][c] - q[r] * q[c] * back[c][r]).abs() <= 1e-9 * forth[0][0], "{forth:?} {back:?}");
            }
        }
        let body = PolarizedDiffuse { ior: Dielectric::new(eta).unwrap(), albedo: 0.6 };
        let forth = body.linear(wi, &incident, wo, &outgoing, DVec3::Z).0;
        let back = body.linear(wo, &from, wi, &to, DVec3::Z).0;
        for r in 0..3 {
            for c in 0..3 {
                prop_assert!((forth[r][c] - q[r] * q[c] * back[c][r]).abs() <= 1e-13 * forth[0][0], "{forth:?} {back:?}");
            }
        }
    }

    /// Realizable: Cloude's coherency matrix of M_ref (Gil and Ossikovski, "Polarized Light and the Mueller Matrix Approach",
    /// 5.3) is that of one Jones matrix, so tr(MᵀM) = 4 M00²; and light of any polarization, s3 included, stays physical.
    #[test]
    fn a_reflection_is_one_jones_matrix(
        wi in above(), wo in above(), ior in index(), alpha in roughness(), roll in 0.0..6.0_f64,
        psi in -2.0..2.0_f64, chi in -0.8..0.8_f64,
    ) {
        let (incident, outgoing) = frames(wi, wo, roll);
        let surface = Microfacet { ior, ggx: correlated(alpha) };
        let m = surface.mueller(wi, &incident, wo, &outgoing, DVec3::Z);
        let m00 = m.0[0][0];
        let trace: f64 = m.0.iter().flatten().map(|x| (x / m00.max(1e-280)).powi(2)).sum();
        prop_assert!(m00 < 1e-200 || (trace - 4.0).abs() < 1e-12, "{m:?}");
        let light = [1.0, (2.0 * chi).cos() * (2.0 * psi).cos(), (2.0 * chi).cos() * (2.0 * psi).sin(), (2.0 * chi).sin()];
        let [s0, s1, s2, s3] = m.apply(protocol_polar::Stokes(light)).0;
        prop_assert!((s1.hypot(s2).hypot(s3) - s0).abs() <= 1e-12 * m00, "what was fully polarized stays so");
    }

    /// The body depolarizes and is still realizable: Cloude's coherency matrix H = ¼ Σ m_jk σ_j ⊗ σ_k* of the 4 × 4 matrix (Gil
    /// and Ossikovski, 5.4) has no negative eigenvalue. Without a fourth row and column m is a column times a row, so H is
    /// ¼ (c·σ) ⊗ (r·σ)*, whose eigenvalues are products of (c0 ± |c|)/2 and (r0 ± |r|)/2.
    #[test]
    fn a_body_is_realizable(
        wi in above(), wo in above(), eta in 1.0..3.0_f64, albedo in 0.0..=1.0_f64, roll in 0.0..6.0_f64,
    ) {
        let (incident, outgoing) = frames(wi, wo, roll);
        let body = PolarizedDiffuse { ior: Dielectric::new(eta).unwrap(), albedo };
        let m = body.linear(wi, &incident, wo, &outgoing, DVec3::Z).0;
        let m00 = m[0][0];
        let spread = |[_, q, u]: [f64; 3]| q.hypot(u);
        let (column, row) = ([m00, m[1][0], m[2][0]], m[0]);
        // One column times one row: every entry is m_j0 m_0k/m00.
        for j in 0..3 {
            for k in 0..3 {
                prop_assert!((m[j][k] * m00 - column[j] * row[k]).abs() <= 1e-15 * m00 * m00, "{m:?}");
            }
        }
        for sign in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let eigenvalue = 0.25 * (m00 + sign[0] * spread(column)) * (m00 + sign[1] * spread(row));
            prop_assert!(eigenvalue >= -1e-15 * m00 * m00, "{eigenvalue} of {m:?}");
        }
        // The same without knowing its form: tr H^k, k = 1 to 4, and Newton's identities give the coefficients of the
        // characteristic polynomial, which are all >= 0 for a Hermitian matrix exactly where no eigenvalue is negative.
        for coefficient in coherency_coefficients(&m) {
            prop_assert!(coefficient >= -1e-12, "{coefficient} of {m:?}");
        }
    }

    /// World, camera and light turned together change nothing.
    #[test]
    fn the_world_may_turn(
        wi in above(), wo in above(), ior in index(), alpha in 0.05..1.0_f64, roll in 0.0..6.0_f64,
        axis in above(), angle in -3.0..3.0_f64,
    ) {
        let turn = glam::DQuat::from_axis_angle(axis, angle);
        let turned = |f: &Frame| Frame { x: turn * f.x, y: turn * f.y };
        let (incident, outgoing) = frames(wi, wo, roll);
        let surface = Microfacet { ior, ggx: correlated(alpha) };
        let here = surface.linear(wi, &incident, wo, &outgoing, DVec3::Z);
        let there = surface.linear(turn * wi, &turned(&incident), turn * wo, &turned(&outgoing), turn * DVec3::Z);
        let body = PolarizedDiffuse { ior: Dielectric::new(1.5).unwrap(), albedo: 0.6 };
        let below = body.linear(wi, &incident, wo, &outgoing, DVec3::Z);
        let below_there = body.linear(turn * wi, &turned(&incident), turn * wo, &turned(&outgoing), turn * DVec3::Z);
        // Cosines are known to 1e-16, and 1e-6 is the least of them; an axis across both beams has the same as its error.
        let across = (wi - wo).cross(wi + wo).length();
        prop_assume!(wi.z > 1e-3 && wo.z > 1e-3 && across > 1e-3);
        for (a, b, scale) in [(here, there, here.0[0][0]), (below, below_there, below.0[0][0])] {
            for (x, y) in a.0.iter().flatten().zip(b.0.iter().flatten()) {
                prop_assert!((x - y).abs() <= 1e-9 * scale, "{a:?} {b:?}");
            }
        }
    }

    /// Turning the incident frame along with the light, or the camera, changes nothing but the frame of the answer.
    #[test]
    fn frames_do_not_matter(wi in above(), wo in above(), ior in index(), a in -3.0..3.0_f64, b in -3.0..3.0_f64) {
        let (incident, outgoing) = frames(wi, wo, 0.3);
        let light = [1.0, 0.3, -0.5];
        let direct = Reflection::at_facet(ior, wi, &incident, wo, &outgoing).apply(light);
        let turned = Frame::incident(wi, incident.x * a.cos() + incident.y * a.sin()).unwrap();
        let rolled = Frame::camera(wo, outgoing.x * b.cos() + outgoing.y * b.sin()).unwrap();
        let seen = Turn::by(Radians(-a)).apply_linear(light);
        let there = Reflection::at_facet(ior, wi, &turned, wo, &rolled).apply(seen);
        let back = Turn::by(Radians(b)).apply_linear(there);
        for (x, y) in direct.iter().zip(back) {
            prop_assert!((x - y).abs() < 1e-13, "{direct:?} {back:?}");
        }
    }

    #[test]
    fn derivatives_by_alpha_are_the_slopes(wi in above(), wo in above(), alpha in 0.01..0.99_f64, separable in any::<bool>()) {
        let masking = if separable { Masking::Separable } else { Masking::HeightCorrelated };
        let ggx = |alpha: f64| Ggx::new(alpha, masking).unwrap();
        let slope = |f: &dyn Fn(f64) -> f64| {
            let h = 1e-3 * alpha;
            let d = |h: f64| (f(alpha + h) - f(alpha - h)) / (2.0 * h);
            (4.0 * d(h) - d(2.0 * h)) / 3.0
        };
        let (i, o) = (Incidence::between(DVec3::Z, wi), Incidence::between(DVec3::Z, wo));
        let surface = |alpha: f64| Microfacet { ior: host_optics::Ior::new(1.5, 0.0).unwrap(), ggx: ggx(alpha) };
        let now = ggx(alpha);
        for (found, expected, value) in [
            (now.d_by_alpha(i), slope(&|a| ggx(a).d(i)), now.d(i)),
            (now.lambda_by_alpha(i), slope(&|a| ggx(a).lambda(i)), now.lambda(i)),
            (now.visibility_by_alpha(i, o), slope(&|a| ggx(a).visibility(i, o)), now.visibility(i, o)),
            (
                surface(alpha).factor_by_alpha(wi, wo, DVec3::Z),
                slope(&|a| surface(a).factor(wi, wo, DVec3::Z)),
                surface(alpha).factor(wi, wo, DVec3::Z),
            ),
        ] {
            prop_assert!((found - expected).abs() <= 1e-8 * (value.abs() / alpha), "{found} against {expected}");
        }
    }

    /// Below 1 mrad of roughness facets hardly leave the normal: the mirror limit.
    #[test]
    fn samples_stay_visible_and_near_the_normal(wo in above(), alpha in roughness(), u1 in 0.0..1.0_f64, u2 in 0.0..1.0_f64) {
        let h = correlated(alpha).sample_visible(wo, [u1, u2]);
        prop_assert!(h.is_finite() && (h.length() - 1.0).abs() < 1e-12 && h.z >= 0.0);
        prop_assert!(wo.dot(h) >= -1e-12, "an invisible facet");
        if u2 < 0.5 {
            // tan θ_h <= α (sin + |w|)/height of the stretched cap.
            prop_assert!(h.x.hypot(h.y) <= 4.0 * alpha * h.z + 1e-15, "{h:?} at alpha {alpha}");
        }
    }
}
