//! Reflectances, their differences and derivatives, at normal incidence, Brewster ± 1e-12 and grazing, η from 1 + 1e-7 to
//! metals.

use crate::data::{Worst, cases, number, table};
use host_optics::materials::ALL;
use host_optics::{Dielectric, Incidence, Ior};

#[test]
fn every_fresnel_case_to_1e_12() {
    let Some(table) = table("analytic/fresnel.json") else { return };
    let mut own = Worst::default();
    let mut of_perpendicular = Worst::default();
    let mut ratio = Worst::default();
    let mut derivatives = Worst::default();
    let mut inverse = Worst::default();
    for case in cases(&table) {
        let field = |name: &str| number(&case[name]);
        let ior = Ior::new(field("eta_re"), field("eta_im")).unwrap();
        let at = Incidence { cosine: field("cos_theta"), sine_squared: field("sin2_theta") };
        let name = |what: &str| format!("case {} {} {what}", case["index"], case["tag"]);
        let r = ior.reflectance(at);
        let perpendicular = field("R_perp");
        own.see(r.perpendicular, perpendicular, perpendicular, &name("R_perp"));
        own.see(ior.difference(at), field("R_perp_minus_R_par"), field("R_perp_minus_R_par"), &name("difference"));
        own.see(ior.specular_dolp(at), field("dolp"), field("dolp"), &name("dolp"));
        of_perpendicular.see(r.parallel, field("R_par"), perpendicular, &name("R_par"));
        of_perpendicular.see(r.rr_cos_delta, field("sqrtRR_cos_delta"), perpendicular, &name("cos"));
        of_perpendicular.see(r.rr_sin_delta, field("sqrtRR_sin_delta"), perpendicular, &name("sin"));
        if case.get("t").is_some() {
            let d = Dielectric::new(field("eta_re")).unwrap();
            let g = d.gradient(at);
            ratio.see(d.t(at), field("t"), 1.0, &name("t"));
            derivatives.see(g.perpendicular_by_eta, field("dR_perp_deta"), field("dR_perp_deta"), &name("dR/deta"));
            derivatives.see(g.t_by_eta, field("dt_deta"), field("dt_deta"), &name("dt/deta"));
            // What one ulp of R⊥ says about η is the inverse's own limit: (∂η/∂R⊥) R⊥, which explodes at grazing.
            let found = Dielectric::from_perpendicular(perpendicular, at).unwrap().eta();
            let condition = 1.0_f64.max(perpendicular / g.perpendicular_by_eta);
            inverse.see(found, d.eta(), d.eta() * condition, &name("inverse"));
        }
    }
    own.below(1e-12, "fresnel, relative to itself");
    of_perpendicular.below(1e-12, "fresnel, relative to R_perp");
    ratio.below(1e-12, "fresnel t");
    derivatives.below(1e-12, "fresnel derivatives by eta");
    inverse.below(1e-12, "fresnel inverse, per condition");
}

/// The built-in table against the extract it was typed from (refractiveindex.info, n and k at 630, 532 and 465 nm).
#[test]
fn named_materials_are_those_of_the_database() {
    let Some(table) = table("../data/ior/ior_rgb.json") else { return };
    let pages: Vec<_> = table["materials"].as_object().unwrap().values().collect();
    for material in ALL {
        let page = pages
            .iter()
            .find(|p| {
                material.source.starts_with(&format!(
                    "{}, {}",
                    p["book"].as_str().unwrap(),
                    p["page"].as_str().unwrap()
                ))
            })
            .unwrap_or_else(|| panic!("no page for {}", material.source));
        for ((n, k), band) in material.rgb.into_iter().zip(["R", "G", "B"]) {
            let stated = page[band]["k"].as_f64().unwrap_or(0.0);
            assert!((n - number(&page[band]["n"])).abs() < 1e-9, "{} {band}", material.name);
            assert!((k - stated).abs() < 2e-6, "{} {band}: k = {k}, stated {stated}", material.name);
        }
    }
    assert_eq!(pages.len(), ALL.len());
}
