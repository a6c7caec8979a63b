//! The microfacet and the polarized diffuse Mueller matrices, retro-reflection, grazing, Brewster and poles included.

use crate::data::{Worst, cases, number, numbers, table, unit};
use host_optics::{Dielectric, Frame, Ggx, Ior, Masking, Microfacet, PolarizedDiffuse, Reflection};
use serde_json::Value;

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

#[test]
fn every_microfacet_matrix_to_1e_12() {
    let Some(table) = table("analytic/brdf_mueller.json") else { return };
    let (mut chain, mut factor, mut whole) = (Worst::default(), Worst::default(), Worst::default());
    for case in cases(&table) {
        let name = format!("case {} {}", case["index"], case["tag"]);
        let (wi, wo, n) = (unit(&case["wi"]), unit(&case["wo"]), unit(&case["n"]));
        let incident = Frame::incident(wi, unit(&case["x_in"])).unwrap();
        let outgoing = Frame::camera(wo, unit(&case["x_out"])).unwrap();
        let eta = numbers(&case["eta"]);
        let ior = Ior::new(eta[0], eta[1]).unwrap();
        let ggx = |masking| Ggx::new(number(&case["alpha"]), masking).unwrap();

        let expected = matrix(&case["M_reflection"]);
        let reflection = Reflection::at_facet(ior, wi, &incident, wo, &outgoing);
        let (full, linear) = (reflection.mueller().0, reflection.linear().0);
        for r in 0..4 {
            for c in 0..4 {
                chain.see(full[r][c], expected[r][c], expected[0][0], &name);
                if r < 3 && c < 3 {
                    chain.see(linear[r][c], expected[r][c], expected[0][0], &name);
                }
            }
        }
        for (masking, key) in
            [(Masking::HeightCorrelated, "f_r_height_correlated"), (Masking::Separable, "f_r_separable")]
        {
            let f = Microfacet { ior, ggx: ggx(masking) }.factor(wi, wo, n);
            let expected = number(&case[key]);
            factor.see(f, expected, expected, &format!("{name} {key}"));
        }
        let surface = Microfacet { ior, ggx: ggx(Masking::HeightCorrelated) };
        let expected = matrix(&case["mueller"]);
        let found = surface.mueller(wi, &incident, wo, &outgoing, n).0;
        for r in 0..4 {
            for c in 0..4 {
                whole.see(found[r][c], expected[r][c], expected[0][0], &name);
            }
        }
    }
    chain.below(1e-12, "M_reflection, relative to M00");
    factor.below(1e-12, "f_r");
    whole.below(1e-12, "f_r M, relative to M00");
}

#[test]
fn every_polarized_diffuse_matrix_to_1e_12() {
    let Some(table) = table("analytic/diffuse_polarized.json") else { return };
    let mut worst = Worst::default();
    for case in cases(&table) {
        let name = format!("case {}", case["index"]);
        let (wi, wo, n) = (unit(&case["wi"]), unit(&case["wo"]), unit(&case["n"]));
        let incident = Frame::incident(wi, unit(&case["x_in"])).unwrap();
        let outgoing = Frame::camera(wo, unit(&case["x_out"])).unwrap();
        let ior = Dielectric::new(number(&case["eta"])).unwrap();
        let body = PolarizedDiffuse { ior, albedo: number(&case["rho_d"]) };
        let expected = matrix(&case["mueller"]);
        let found = body.linear(wi, &incident, wo, &outgoing, n).0;
        for r in 0..3 {
            for c in 0..3 {
                worst.see(found[r][c], expected[r][c], expected[0][0], &name);
            }
            assert!(expected[r][3].abs() + expected[3][r].abs() <= 0.0, "a fourth row or column in {name}");
        }
        let dolp = found[1][0].hypot(found[2][0]) / found[0][0];
        worst.see(dolp, number(&case["dolp_out"]), 1.0, &name);
    }
    worst.below(1e-12, "polarized diffuse, relative to M00");
}
