//! D, Λ, G1 and both G2 from α = 1e-5 to 1 and from the normal to grazing.

use crate::data::{Worst, cases, number, table};
use host_optics::{Ggx, Incidence, Masking};
use protocol_polar::Radians;

#[test]
fn every_ggx_case_to_1e_12() {
    let Some(table) = table("analytic/ggx.json") else { return };
    let mut worst = Worst::default();
    for case in cases(&table) {
        let field = |name: &str| number(&case[name]);
        let alpha = field("alpha");
        let correlated = Ggx::new(alpha, Masking::HeightCorrelated).unwrap();
        let separable = Ggx::new(alpha, Masking::Separable).unwrap();
        let at = Incidence { cosine: field("cos_theta"), sine_squared: field("sin2_theta") };
        let name = |what: &str| format!("case {} {what}", case["index"]);
        let mut see = |what: &str, found: f64, expected: f64| worst.see(found, expected, expected, &name(what));
        see("D", correlated.d(at), field("D"));
        see("Lambda", correlated.lambda(at), field("Lambda"));
        see("G1", correlated.g1(at), field("G1"));
        for partner in case["G2"].as_array().unwrap() {
            let o = Incidence::from_angle(Radians(number(&partner["theta_o_rad"])));
            for (ggx, key) in [(correlated, "G2_height_correlated"), (separable, "G2_separable")] {
                let expected = number(&partner[key]);
                see(key, ggx.g2(at, o), expected);
                see(key, 4.0 * at.cosine * o.cosine * ggx.visibility(at, o), expected);
                see(key, ggx.visible_weight(at, o) * ggx.g1(o), expected);
            }
        }
    }
    worst.below(1e-12, "ggx, relative to itself");
}
