//! The microfacet and the polarized diffuse Mueller matrices, retro-reflection, grazing, Brewster and poles included.

use super::{Case, Report};
use anyhow::Result;
use glam::DVec3;
use host_optics::{Dielectric, Frame, Ggx, Ior, LinearMueller, Masking, Microfacet, PolarizedDiffuse, Reflection};

const BOUND: f64 = 1e-12;

struct Geometry {
    wi: DVec3,
    wo: DVec3,
    normal: DVec3,
    incident: Frame,
    outgoing: Frame,
}

impl Geometry {
    fn of(case: &Case) -> Result<Self> {
        let (wi, wo) = (case.unit("wi")?, case.unit("wo")?);
        Ok(Self {
            wi,
            wo,
            normal: case.unit("n")?,
            incident: Frame::incident(wi, case.unit("x_in")?)?,
            outgoing: Frame::camera(wo, case.unit("x_out")?)?,
        })
    }
}

/// f_r and the frame chain of paper eq. 6, apart and together.
pub(super) fn microfacet(case: &Case, report: &mut Report) -> Result<()> {
    let name = case.name();
    let Geometry { wi, wo, normal, incident, outgoing } = Geometry::of(case)?;
    let eta = case.numbers("eta")?;
    let ior = Ior::new(eta.first().copied().unwrap_or(f64::NAN), eta.get(1).copied().unwrap_or(0.0))?;
    let alpha = case.number("alpha")?;

    let expected = case.matrix("M_reflection")?;
    let reflection = Reflection::at_facet(ior, wi, &incident, wo, &outgoing);
    let full = reflection.mueller().0;
    let m00 = expected[0][0];
    report.all("M_reflection, of M00", BOUND, full.as_flattened(), expected.as_flattened(), m00, &name);
    let linear = reflection.linear().0;
    report.all("M_reflection, of M00", BOUND, linear.as_flattened(), upper_left(&expected).as_flattened(), m00, &name);

    let maskings = [(Masking::HeightCorrelated, "f_r_height_correlated"), (Masking::Separable, "f_r_separable")];
    for (masking, key) in maskings {
        let found = Microfacet { ior, ggx: Ggx::new(alpha, masking)? }.factor(wi, wo, normal);
        let expected = case.number(key)?;
        report.see("f_r, of itself", BOUND, [found, expected, expected], &format!("{name} {key}"));
    }
    let surface = Microfacet { ior, ggx: Ggx::new(alpha, Masking::HeightCorrelated)? };
    let expected = case.matrix("mueller")?;
    let found = surface.mueller(wi, &incident, wo, &outgoing, normal).0;
    report.all("f_r M, of M00", BOUND, found.as_flattened(), expected.as_flattened(), expected[0][0], &name);
    Ok(())
}

/// T_out · depolarize · T_in; its fourth row and column are zero, which [`LinearMueller`] leaves out.
pub(super) fn diffuse(case: &Case, report: &mut Report) -> Result<()> {
    let name = case.name();
    let Geometry { wi, wo, normal, incident, outgoing } = Geometry::of(case)?;
    let body = PolarizedDiffuse { ior: Dielectric::new(case.number("eta")?)?, albedo: case.number("rho_d")? };
    let expected = case.matrix("mueller")?;
    let LinearMueller(found) = body.linear(wi, &incident, wo, &outgoing, normal);
    let wanted = upper_left(&expected);
    report.all("matrix, of M00", BOUND, found.as_flattened(), wanted.as_flattened(), expected[0][0], &name);
    let beyond = expected[3].iter().chain(expected.iter().map(|row| &row[3])).all(|x| x.abs() <= 0.0);
    report.holds("the fourth row and column are zero", beyond, &name);
    let dolp = found[1][0].hypot(found[2][0]) / found[0][0];
    report.see("DoLP of unpolarized light after it, absolute", BOUND, [dolp, case.number("dolp_out")?, 1.0], &name);
    Ok(())
}

/// The part of a matrix that acts on (L, Q, U).
pub(super) fn upper_left([a, b, c, _]: &[[f64; 4]; 4]) -> [[f64; 3]; 3] {
    [a, b, c].map(|[x, y, z, _]| [*x, *y, *z])
}
