//! Matrices of Mitsuba 3's BSDFs (float32; our formulas must agree to its precision, 1e-5 of M00).

use crate::data::{Worst, number, numbers, table};
use glam::DVec3;
use host_optics::integral::{FixedPoints, View, polarized_diffuse};
use host_optics::sky::Uniform;
use host_optics::trs::MirrorFacet;
use host_optics::{Dielectric, Frame, Ggx, Incidence, Ior, Masking, Microfacet, PolarizedDiffuse};
use protocol_polar::{Degrees, Mueller};

#[test]
fn rough_matrices_agree_with_mitsuba() {
    let Some(table) = table("mitsuba/bsdf_mueller.json") else { return };
    let (mut specular, mut diffuse) = (Worst::default(), Worst::default());
    for material in table["materials"].as_array().unwrap() {
        let (eta, k) = (number(&material["eta"]), number(&material["k"]));
        let ior = Ior::new(eta, k).unwrap();
        // Mitsuba's masking is the separable product.
        let ggx = Ggx::new(number(&material["alpha"]), Masking::Separable).unwrap();
        let surface = Microfacet { ior, ggx };
        for record in material["records"].as_array().unwrap() {
            let angle = |name: &str| Degrees(number(&record[name])).to_radians().0;
            let (camera, lamp, azimuth) = (angle("tc"), angle("tl"), angle("dphi"));
            let wo = DVec3::new(camera.sin(), 0.0, camera.cos());
            let wi = DVec3::new(lamp.sin() * azimuth.cos(), lamp.sin() * azimuth.sin(), lamp.cos());
            // Its frames: x = normalize(n × k), or +y where that vanishes; k = −ω_i in, ω_o out.
            let axis = |k: DVec3| {
                let x = DVec3::Z.cross(k);
                if x.length() > 0.0 { x.normalize() } else { DVec3::Y }
            };
            let incident = Frame::incident(wi, axis(-wi)).unwrap();
            let outgoing = Frame::camera(wo, axis(wo)).unwrap();
            let name = format!("{} {}", material["name"], record);
            let expected = numbers(&record["spec"]);
            let found = surface.mueller(wi, &incident, wo, &outgoing, DVec3::Z).0;
            for r in 0..4 {
                for c in 0..4 {
                    specular.see(wi.z * found[r][c], expected[4 * r + c], expected[0], &name);
                }
            }
            if let Some(expected) = record.get("diff").filter(|_| k <= 0.0).map(numbers) {
                let body = PolarizedDiffuse {
                    ior: Dielectric::new(eta).unwrap(),
                    albedo: number(&material["diffuse_reflectance"]),
                };
                let found = body.linear(wi, &incident, wo, &outgoing, DVec3::Z).0;
                for r in 0..3 {
                    for c in 0..3 {
                        diffuse.see(wi.z * found[r][c], expected[4 * r + c], expected[0], &name);
                    }
                }
            }
        }
    }
    specular.below(1e-5, "Mitsuba specular, relative to M00");
    diffuse.below(1e-5, "Mitsuba polarized diffuse, relative to M00");
}

#[test]
fn smooth_matrices_agree_with_mitsuba() {
    let Some(table) = table("mitsuba/smooth_fresnel_mueller.json") else { return };
    let mut worst = Worst::default();
    for record in table["records"].as_array().unwrap() {
        let ior = Ior::new(number(&record["eta"]), number(&record["k"])).unwrap();
        let at = Incidence::from_angle(Degrees(number(&record["theta_deg"])).to_radians());
        let expected = numbers(&record["M"]);
        let found = Mueller::reflection(ior.reflectance(at)).0;
        for r in 0..4 {
            for c in 0..4 {
                worst.see(found[r][c], expected[4 * r + c], expected[0], &record["theta_deg"].to_string());
            }
        }
    }
    worst.below(1e-5, "Mitsuba smooth, relative to M00");
}

/// Renders of rough plates under a constant sky, with their standard errors; and the same by another quadrature.
#[test]
fn integrals_agree_with_mitsuba_renders() {
    let Some(table) = table("mitsuba/mc_reference.json") else { return };
    let (mut sigma, mut quadrature) = (Worst::default(), Worst::default());
    for record in table["B_rough_constant"].as_array().unwrap() {
        let theta = Degrees(number(&record["theta"])).to_radians().0;
        let (sin_phi, cos_phi) = Degrees(number(&record["phi_s"])).to_radians().0.sin_cos();
        let wo = DVec3::new(theta.sin(), 0.0, theta.cos());
        // The s axis is +y; the camera's x lies at −φ from it.
        let view = View::new(wo, DVec3::Y * cos_phi - wo.cross(DVec3::Y) * sin_phi).unwrap();
        let (ior, albedo) = material(record["bsdf"].as_str().unwrap());
        let ggx = Ggx::new(number(&record["alpha"]), Masking::Separable).unwrap();
        let (rule, furnace) = (FixedPoints::new(48), Uniform { radiance: 1.0 });
        let specular = rule.specular(&furnace, &Microfacet { ior, ggx }, DVec3::Z, &view);
        let diffuse = match (ior, albedo) {
            (Ior::Dielectric(ior), Some(albedo)) => {
                let inside = rule.transmitted_irradiance(&furnace, ior, DVec3::Z);
                polarized_diffuse(&PolarizedDiffuse { ior, albedo }, DVec3::Z, &view, inside)
            }
            _ => [0.0; 3],
        };
        let (mean, error) = (numbers(&record["mean"]), numbers(&record["se"]));
        let name = format!("{} alpha {} theta {}", record["bsdf"], record["alpha"], record["theta"]);
        for k in 0..3 {
            let found = specular[k] + diffuse[k];
            // Below 1e-7 of s0 a standard error is float32 rounding, not noise.
            sigma.see(found, mean[k], error[k].max(1e-6 * mean[0]), &name);
            if albedo.unwrap_or(0.0) <= 0.0 {
                quadrature.see(found, number(&record["quadrature_double"][k]), mean[0], &name);
            }
        }
    }
    sigma.below(4.0, "Mitsuba renders, in standard errors");
    quadrature.below(1e-5, "eq. 6 under a constant sky by another quadrature, relative to s0");
}

/// Renders' closed form of eq. 8 under polarized light of every orientation.
#[test]
fn equation_8_agrees_with_mitsuba() {
    let Some(table) = table("mitsuba/mc_reference.json") else { return };
    let (mut closed, mut sigma) = (Worst::default(), Worst::default());
    for record in table["C_polarised_smooth"].as_array().unwrap() {
        let angle = |name: &str| Degrees(number(&record[name])).to_radians();
        let (Ior::Dielectric(ior), _) = material(record["bsdf"].as_str().unwrap()) else { panic!("dielectrics only") };
        let facet = MirrorFacet {
            reflectance: ior.reflectance(Incidence::from_angle(angle("theta"))),
            radiance: 0.5,
            dolp: 1.0,
            psi: angle("psi_i"),
            phi: angle("phi_s"),
        };
        let (found, mean, error) = (facet.stokes().0, numbers(&record["mean"]), numbers(&record["se"]));
        for k in 0..3 {
            closed.see(found[k], number(&record["seed_eq8"][k]), found[0], &record.to_string());
            sigma.see(found[k], mean[k], error[k].max(1e-3 * mean[0]).max(1e-8), &record.to_string());
        }
    }
    closed.below(1e-6, "eq. 8 closed form, relative to s0");
    sigma.below(4.0, "eq. 8 against renders, in standard errors");
}

/// `pplastic_eta1.5_diff0.5`, `dielectric1.5`, `roughconductor_0.43_2.46`.
fn material(name: &str) -> (Ior, Option<f64>) {
    let digits = |part: &str| part.trim_start_matches(|c: char| c.is_ascii_alphabetic()).parse::<f64>().unwrap();
    let parts: Vec<&str> = name.split('_').collect();
    match parts.as_slice() {
        ["pplastic", eta, albedo] => (Ior::new(digits(eta), 0.0).unwrap(), Some(digits(albedo))),
        ["roughconductor", n, k] => (Ior::new(digits(n), digits(k)).unwrap(), None),
        [dielectric] => (Ior::new(digits(dielectric), 0.0).unwrap(), None),
        _ => panic!("an unknown material: {name}"),
    }
}
