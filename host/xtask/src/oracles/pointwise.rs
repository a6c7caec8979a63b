//! Functions of one or two angles: Fresnel, GGX, the sky. 20-digit tables from 80-digit arithmetic.

use super::{Case, Report};
use anyhow::Result;
use glam::DVec3;
use host_optics::sky::{Berry, ClearSky, Pattern, Rayleigh};
use host_optics::{Dielectric, Frame, Ggx, Incidence, Ior, Light, Masking};
use protocol_polar::Radians;

/// What f64 in stable forms must reach.
const BOUND: f64 = 1e-12;

/// Reflectances, their differences and derivatives, and the inverse: η from 1 + 1e-7 to metals, normal incidence,
/// Brewster ± 1e-12 and grazing.
pub(super) fn fresnel(case: &Case, report: &mut Report) -> Result<()> {
    let ior = Ior::new(case.number("eta_re")?, case.number("eta_im")?)?;
    let at = Incidence { cosine: case.number("cos_theta")?, sine_squared: case.number("sin2_theta")? };
    let r = ior.reflectance(at);
    let name = case.name();
    let perpendicular = case.number("R_perp")?;
    let own =
        [("R_perp", r.perpendicular), ("R_perp_minus_R_par", ior.difference(at)), ("dolp", ior.specular_dolp(at))];
    for (key, found) in own {
        let expected = case.number(key)?;
        report.see("R_perp, R_perp - R_par, DoLP, of themselves", BOUND, [found, expected, expected], &name);
    }
    // Near Brewster R∥ and the δ terms vanish: only R⊥ is a scale for them.
    let of_perpendicular =
        [("R_par", r.parallel), ("sqrtRR_cos_delta", r.rr_cos_delta), ("sqrtRR_sin_delta", r.rr_sin_delta)];
    for (key, found) in of_perpendicular {
        report.see("R_par and delta terms, of R_perp", BOUND, [found, case.number(key)?, perpendicular], &name);
    }
    if case.has("t") {
        let dielectric = Dielectric::new(case.number("eta_re")?)?;
        let gradient = dielectric.gradient(at);
        report.see("t, absolute", BOUND, [dielectric.t(at), case.number("t")?, 1.0], &name);
        for (key, found) in [("dR_perp_deta", gradient.perpendicular_by_eta), ("dt_deta", gradient.t_by_eta)] {
            let expected = case.number(key)?;
            report.see("derivatives by eta, of themselves", BOUND, [found, expected, expected], &name);
        }
        // What one ulp of R⊥ says about η is the inverse's own limit: (∂η/∂R⊥) R⊥, which explodes at grazing.
        let eta = dielectric.eta();
        let condition = 1.0_f64.max(perpendicular / gradient.perpendicular_by_eta);
        let found = Dielectric::from_perpendicular(perpendicular, at)?.eta();
        report.see("inverse, of eta and its condition", BOUND, [found, eta, eta * condition], &name);
    }
    Ok(())
}

/// D, Λ, G1 and both G2, α from 1e-5 to 1, from the normal to grazing.
pub(super) fn ggx(case: &Case, report: &mut Report) -> Result<()> {
    const WHAT: &str = "D, Lambda, G1, G2, of themselves";
    let alpha = case.number("alpha")?;
    let correlated = Ggx::new(alpha, Masking::HeightCorrelated)?;
    let separable = Ggx::new(alpha, Masking::Separable)?;
    let at = Incidence { cosine: case.number("cos_theta")?, sine_squared: case.number("sin2_theta")? };
    let name = case.name();
    for (key, found) in [("D", correlated.d(at)), ("Lambda", correlated.lambda(at)), ("G1", correlated.g1(at))] {
        let expected = case.number(key)?;
        report.see(WHAT, BOUND, [found, expected, expected], &format!("{name} {key}"));
    }
    for partner in case.list("G2")? {
        let o = Incidence::from_angle(Radians(partner.number("theta_o_rad")?));
        for (ggx, key) in [(correlated, "G2_height_correlated"), (separable, "G2_separable")] {
            let expected = partner.number(key)?;
            let forms = [
                ggx.g2(at, o),
                4.0 * at.cosine * o.cosine * ggx.visibility(at, o),
                ggx.visible_weight(at, o) * ggx.g1(o),
            ];
            for found in forms {
                report.see(WHAT, BOUND, [found, expected, expected], &format!("{name} {key}"));
            }
        }
    }
    Ok(())
}

/// The clear sky of the tables.
pub(super) fn clear(sun: DVec3) -> ClearSky {
    ClearSky { base: 0.6, horizon: 0.5, aureole: 2.0, width: 0.25, sun }
}

/// Sky frames, the clear-sky formula, Rayleigh and Berry patterns at the sun, the antisun, the neutral points and the zenith.
pub(super) fn sky(case: &Case, report: &mut Report) -> Result<()> {
    let name = case.name();
    let (sun, w) = (case.unit("sun")?, case.unit("w")?);
    let frame = Frame::sky(w).x.to_array();
    report.all("sky frame, absolute", BOUND, &frame, &case.triple("frame_x")?, 1.0, &name);
    let [l, ..] = clear(sun).stokes(w);
    let expected = case.number("L")?;
    report.see("radiance, of itself", BOUND, [l, expected, expected], &name);
    let expected = [case.number("rayleigh_q")?, case.number("rayleigh_u")?];
    report.all("Rayleigh (q, u), absolute", BOUND, &Rayleigh::new(sun, 1.0)?.fraction(w), &expected, 1.0, &name);
    let expected = [case.number("berry_q")?, case.number("berry_u")?];
    let berry = Berry::new(sun, case.number("berry_split_deg")?, 1.0)?;
    report.all("Berry (q, u), absolute", BOUND, &berry.fraction(w), &expected, 1.0, &name);
    Ok(())
}
