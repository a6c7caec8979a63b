//! Laws that hold whatever the numbers: energy, reciprocity, realizability, frame invariance, limits.
#![expect(clippy::unwrap_used, reason = "inputs are inside the model by construction")]

mod facet;
mod finite;
mod fresnel;
mod integral;
mod sky;
mod trs;

use glam::DVec3;
use proptest::prelude::*;

/// Unit directions above z = 0, down to 90° − 1e-6 and with the exact normal among them.
pub(crate) fn above() -> impl Strategy<Value = DVec3> {
    let polar = prop_oneof![
        8 => 0.0..1.5_f64,
        1 => Just(0.0),
        1 => (-6.0..-0.5_f64).prop_map(|e| core::f64::consts::FRAC_PI_2 - 10_f64.powf(e)),
        1 => (-12.0..-1.0_f64).prop_map(|e| 10_f64.powf(e)),
    ];
    (polar, 0.0..core::f64::consts::TAU).prop_map(|(theta, phi)| {
        let (s, c) = theta.sin_cos();
        DVec3::new(s * phi.cos(), s * phi.sin(), c).normalize()
    })
}

/// α from 1e-5 to 1, evenly in its logarithm.
pub(crate) fn roughness() -> impl Strategy<Value = f64> {
    (-5.0..=0.0_f64).prop_map(|e| 10_f64.powf(e).min(1.0))
}

/// A refractive index: dielectrics from exactly 1 up, and conductors.
pub(crate) fn index() -> impl Strategy<Value = host_optics::Ior> {
    prop_oneof![
        4 => (1.0..3.0_f64).prop_map(|n| (n, 0.0)),
        1 => (-15.0..0.0_f64).prop_map(|e| (1.0 + 10_f64.powf(e), 0.0)),
        1 => Just((1.0, 0.0)),
        3 => (0.01..4.0_f64, 1e-6..8.0_f64),
    ]
    .prop_map(|(n, k)| host_optics::Ior::new(n, k).unwrap())
}
