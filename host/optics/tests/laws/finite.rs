//! No input that is finite gives an answer that is not: every pointwise function in f64 and in f32, at the limits of its
//! arguments and with vectors that are zero, subnormal, opposite, or not unit at all.

use crate::index;
use glam::DVec3;
use host_optics::brdf::Microfacet;
use host_optics::diffuse::transmitted_row;
use host_optics::frames::{axis_angle, direction, s_axis, tangents, transport};
use host_optics::ggx::MIN_ALPHA;
use host_optics::{
    Conductor, Dielectric, Frame, Ggx, Incidence, Ior, Masking, PolarizedDiffuse, Real, Reflection, Turn,
};
use proptest::prelude::*;
use protocol_polar::Radians;

/// Cosines in [−1, 1]: everywhere, at zero and one, an ulp from them, and subnormal.
fn cosine() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0..=1.0_f64,
        1 => prop::sample::select(vec![
            0.0, -0.0, 1.0, -1.0, 1.0_f64.next_down(), 1.0_f64.next_up(), 5e-324, -5e-324, f64::MIN_POSITIVE, 1e-45, 1e-38
        ]),
        2 => (-323.0..0.0_f64).prop_map(|e| 10_f64.powf(e)),
    ]
}

/// A cosine and the sin² that belongs to it, or one that does not.
fn incidence() -> impl Strategy<Value = Incidence> {
    (cosine(), cosine(), any::<bool>()).prop_map(|(cosine, other, belongs)| Incidence {
        cosine,
        sine_squared: if belongs { ((1.0 - cosine) * (1.0 + cosine)).max(0.0) } else { other.abs() },
    })
}

fn alpha() -> impl Strategy<Value = f64> {
    prop_oneof![4 => (-6.0..=0.0_f64).prop_map(|e| 10_f64.powf(e).clamp(MIN_ALPHA, 1.0)), 1 => Just(MIN_ALPHA), 1 => Just(1.0)]
}

/// η at both ends of its range, and in between.
fn eta() -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => Just(1.0), 1 => Just(1.0_f64.next_up()), 1 => Just(1000.0),
        2 => (-16.0..0.0_f64).prop_map(|e| 1.0 + 10_f64.powf(e)), 2 => 1.0..4.0_f64, 1 => 4.0..1000.0_f64,
    ]
}

/// n and k from the smallest positive number to 1000.
fn metal() -> impl Strategy<Value = (f64, f64)> {
    let part = || {
        prop_oneof![
            3 => 0.01..10.0_f64, 1 => Just(1.0), 1 => Just(1000.0), 1 => Just(5e-324),
            2 => (-307.0..3.0_f64).prop_map(|e| 10_f64.powf(e)),
        ]
    };
    (part(), part())
}

/// Unit vectors, zero, vectors too short to have a length, and the axes.
fn vector() -> impl Strategy<Value = DVec3> {
    prop_oneof![
        4 => (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64).prop_map(|(x, y, z)| DVec3::new(x, y, z).normalize_or_zero()),
        1 => prop::sample::select(vec![DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::Z, DVec3::NEG_Z]),
        1 => (cosine(), cosine(), cosine()).prop_map(|(x, y, z)| DVec3::new(x, y, z)),
        1 => (cosine(), cosine()).prop_map(|(x, z)| DVec3::new(x, 0.0, z).normalize_or_zero()),
    ]
}

fn of_dielectric<T: Real>(d: Dielectric<T>, at: Incidence<T>) -> Vec<T> {
    let (g, b) = (d.gradient(at), d.brewster());
    let mut all = vec![d.r_s(at), d.t(at), d.difference(at), d.specular_dolp(at), b.cosine, b.sine_squared];
    all.extend(d.terms(at));
    all.extend(d.transmittance(at));
    all.extend([g.perpendicular_by_eta, g.t_by_eta, g.perpendicular_by_cosine, g.t_by_cosine]);
    all.extend(Dielectric::from_perpendicular(d.terms(at)[0], at).map(Dielectric::eta));
    all
}

fn of_conductor<T: Real>(c: Conductor<T>, at: Incidence<T>) -> Vec<T> {
    let mut all = vec![c.difference(at), c.specular_dolp(at)];
    all.extend(c.terms(at));
    all
}

/// All but Λ, which is infinite at the horizon.
fn of_surface<T: Real>(ggx: &Ggx<T>, i: Incidence<T>, o: Incidence<T>) -> Vec<T> {
    vec![
        ggx.d(i),
        ggx.d_by_alpha(i),
        ggx.lambda_by_alpha(i),
        ggx.g1(i),
        ggx.g2(i, o),
        ggx.visibility(i, o),
        ggx.visibility_by_alpha(i, o),
        ggx.visible_density(i, o, o.cosine),
        ggx.visible_weight(i, o),
    ]
}

fn finite<T: Real>(all: &[T]) -> bool {
    all.iter().all(|x| Into::<f64>::into(*x).is_finite())
}

fn finite_vector(v: DVec3) -> bool {
    v.is_finite()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn fresnel_terms(eta in eta(), (n, k) in metal(), at in incidence()) {
        let d = Dielectric::new(eta).unwrap();
        let found = of_dielectric(d, at);
        prop_assert!(finite(&found), "{found:?}");
        let found = of_dielectric(d.single(), at.single());
        prop_assert!(finite(&found), "f32 {found:?}");
        let c = Conductor::new(n, k).unwrap();
        let found = of_conductor(c, at);
        prop_assert!(finite(&found), "{found:?}");
        let found = of_conductor(c.single(), at.single());
        prop_assert!(finite(&found), "f32 {found:?}");
    }

    #[test]
    fn distribution_of_facets(alpha in alpha(), separable in any::<bool>(), i in incidence(), o in incidence()) {
        let masking = if separable { Masking::Separable } else { Masking::HeightCorrelated };
        let ggx = Ggx::new(alpha, masking).unwrap();
        let found = of_surface(&ggx, i, o);
        prop_assert!(finite(&found), "{found:?}");
        let found = of_surface(&ggx.single(), i.single(), o.single());
        prop_assert!(finite(&found), "f32 {found:?}");
        prop_assert!(ggx.lambda(i) >= 0.0 && ggx.single().lambda(i.single()) >= 0.0, "never NaN");
    }

    #[test]
    fn directions_and_frames(a in vector(), b in vector(), opposite in any::<bool>(), huge in any::<bool>(), u in (0.0..1.0_f64, 0.0..1.0_f64)) {
        let b = if opposite { -a } else { b };
        let axis = if huge { b * f64::MAX } else { b };
        for at in [Incidence::between(a, b), Incidence::on_facet(a, b)] {
            prop_assert!(at.cosine.is_finite() && at.sine_squared.is_finite());
        }
        prop_assert!(finite_vector(s_axis(a, b)) && finite_vector(transport(b, a, -a)) && finite_vector(transport(a, a, b)));
        if let Ok(unit) = direction(a) {
            let (t, s) = tangents(unit);
            prop_assert!(finite_vector(t) && finite_vector(s) && finite_vector(Frame::sky(unit).y));
            for frame in [Frame::camera(unit, axis), Frame::incident(unit, axis)].into_iter().flatten() {
                prop_assert!(finite_vector(frame.x) && finite_vector(frame.y), "{frame:?}");
                let turn = frame.turn_to(a.cross(b));
                prop_assert!(turn.cos.is_finite() && turn.sin.is_finite() && axis_angle(&frame, b).0.is_finite());
            }
            if unit.z > 0.0 {
                let h = Ggx::new(MIN_ALPHA, Masking::Separable).unwrap().sample_visible(unit, [u.0, u.1]);
                prop_assert!(finite_vector(h), "{h}");
            }
        }
        let turn = Turn::towards(a.x, b.z).then(Turn::by(Radians(a.y))).inverse();
        prop_assert!(turn.cos.is_finite() && turn.sin.is_finite());
    }

    #[test]
    fn reflection_matrices(ior in index(), alpha in alpha(), wi in vector(), wo in vector(), normal in vector(), opposite in any::<bool>()) {
        let wo = if opposite { -wi } else { wo };
        let (incident, outgoing) = (Frame::sky(wi), Frame::sky(wo));
        let surface = Microfacet { ior, ggx: Ggx::new(alpha, Masking::default()).unwrap() };
        let full = Reflection::at_facet(ior, wi, &incident, wo, &outgoing).mueller().0;
        prop_assert!(full.iter().flatten().all(|m| m.is_finite()), "{full:?}");
        prop_assert!(surface.factor(wi, wo, normal).is_finite() && surface.factor_by_alpha(wi, wo, normal).is_finite());
        let linear = surface.linear(wi, &incident, wo, &outgoing, normal).0;
        prop_assert!(linear.iter().flatten().all(|m| m.is_finite()), "{linear:?}");
        if let Ior::Dielectric(ior) = ior {
            let body = PolarizedDiffuse { ior, albedo: 1.0 };
            let linear = body.linear(wi, &incident, wo, &outgoing, normal).0;
            prop_assert!(linear.iter().flatten().all(|m| m.is_finite()), "{linear:?}");
            prop_assert!(transmitted_row(ior, wi, &incident, normal).iter().all(|x| x.is_finite()));
        }
    }
}
