//! Mitsuba 3: matrices of its BSDFs (float32: 1e-5 of M00 is what can be asked) and renders with their standard errors.

use super::mueller::upper_left;
use super::{Case, Report};
use anyhow::{Context, Result, bail};
use glam::DVec3;
use host_optics::integral::{FixedPoints, View, discrete, polarized_diffuse};
use host_optics::sky::Uniform;
use host_optics::trs::MirrorFacet;
use host_optics::{Dielectric, Frame, Ggx, Incidence, Ior, Light, Masking, Microfacet, PolarizedDiffuse};
use protocol_polar::{Degrees, Mueller};

/// Of M00.
const FLOAT32: f64 = 1e-5;
/// In standard errors.
const SIGMAS: f64 = 4.0;

/// One material of the rough BSDFs, all directions. Values contain the cosine of the light.
pub(super) fn rough(material: &Case, report: &mut Report) -> Result<()> {
    let (eta, k) = (material.number("eta")?, material.number("k")?);
    // Mitsuba's masking is the separable product.
    let ggx = Ggx::new(material.number("alpha")?, Masking::Separable)?;
    let surface = Microfacet { ior: Ior::new(eta, k)?, ggx };
    for record in material.list("records")? {
        let [camera, lamp, azimuth] = [angle(&record, "tc")?, angle(&record, "tl")?, angle(&record, "dphi")?];
        let wo = DVec3::new(camera.sin(), 0.0, camera.cos());
        let wi = DVec3::new(lamp.sin() * azimuth.cos(), lamp.sin() * azimuth.sin(), lamp.cos());
        // Its frames: x = normalize(n × k), or +y where that vanishes; k = −ω_i in, ω_o out.
        let axis = |k: DVec3| DVec3::Z.cross(k).try_normalize().unwrap_or(DVec3::Y);
        let incident = Frame::incident(wi, axis(-wi))?;
        let outgoing = Frame::camera(wo, axis(wo))?;
        let name = format!("{}, {}", material.name(), record.name());
        let expected = record.matrix("spec")?;
        let found = surface.mueller(wi, &incident, wo, &outgoing, DVec3::Z).0.map(|row| row.map(|m| wi.z * m));
        let what = "specular, of M00";
        report.all(what, FLOAT32, found.as_flattened(), expected.as_flattened(), expected[0][0], &name);
        if let (Ior::Dielectric(ior), true) = (surface.ior, record.has("diff")) {
            let body = PolarizedDiffuse { ior, albedo: material.number("diffuse_reflectance")? };
            let expected = record.matrix("diff")?;
            let found = body.linear(wi, &incident, wo, &outgoing, DVec3::Z).0.map(|row| row.map(|m| wi.z * m));
            let wanted = upper_left(&expected);
            let what = "polarized diffuse, of M00";
            report.all(what, FLOAT32, found.as_flattened(), wanted.as_flattened(), expected[0][0], &name);
        }
    }
    Ok(())
}

/// Matrices of smooth interfaces: paper eq. 2.
pub(super) fn smooth(record: &Case, report: &mut Report) -> Result<()> {
    let ior = Ior::new(record.number("eta")?, record.number("k")?)?;
    let at = Incidence::from_angle(Degrees(record.number("theta_deg")?).to_radians());
    let expected = record.matrix("M")?;
    let found = Mueller::reflection(ior.reflectance(at)).0;
    let name = format!("{}, {} deg", record.name(), record.number("theta_deg")?);
    report.all("M, of M00", FLOAT32, found.as_flattened(), expected.as_flattened(), expected[0][0], &name);
    Ok(())
}

/// Renders: mirrors (A, C) by paper eq. 8, rough plates (B, D) by eq. 6.
pub(super) fn renders(record: &Case, report: &mut Report) -> Result<()> {
    match record.group.split('_').next() {
        Some("A" | "C") => smooth_render(record, report),
        Some("B") => rough_render(record, report),
        Some("D") => lamp_render(record, report),
        _ => bail!("{} is not a set of renders A to D", record.group),
    }
}

/// A mirror under constant light of radiance 1, or under a polarizer that lets 0.5 of it pass.
fn smooth_render(record: &Case, report: &mut Report) -> Result<()> {
    let degrees = |key: &str| record.number(key).map(|x| Degrees(x).to_radians());
    let ior =
        if record.has("bsdf") { material(record.text("bsdf")?)?.0 } else { Ior::new(record.number("eta")?, 0.0)? };
    let polarized = record.has("psi_i");
    let facet = MirrorFacet {
        reflectance: ior.reflectance(Incidence::from_angle(degrees("theta")?)),
        radiance: if polarized { 0.5 } else { 1.0 },
        dolp: if polarized { 1.0 } else { 0.0 },
        psi: degrees(if polarized { "psi_i" } else { "phi_s" })?,
        phi: degrees("phi_s")?,
    };
    let [s0, s1, s2, _] = facet.stokes().0;
    let closed = record.triple("seed_eq8")?;
    report.all("closed form of eq. 8, of s0", FLOAT32, &[s0, s1, s2], &closed, s0, &record.name());
    against_render(record, [s0, s1, s2], report)
}

/// A rough plate under constant light.
fn rough_render(record: &Case, report: &mut Report) -> Result<()> {
    let view = camera(record)?;
    let (ior, albedo) = material(record.text("bsdf")?)?;
    let ggx = Ggx::new(record.number("alpha")?, Masking::Separable)?;
    let (rule, furnace) = (FixedPoints::new(48), Uniform { radiance: 1.0 });
    let mut found = rule.specular(&furnace, &Microfacet { ior, ggx }, DVec3::Z, &view);
    match (ior, albedo.filter(|albedo| *albedo > 0.0)) {
        (Ior::Dielectric(ior), Some(albedo)) => {
            let inside = rule.transmitted_irradiance(&furnace, ior, DVec3::Z);
            let body = PolarizedDiffuse { ior, albedo };
            for (s, d) in found.iter_mut().zip(polarized_diffuse(&body, DVec3::Z, &view, inside)) {
                *s += d;
            }
        }
        _ => against_quadrature(record, found, FLOAT32, report)?,
    }
    against_render(record, found, report)
}

/// A rough plate under a square lamp of radiance 1 behind a polarizer: 3° from its center to its sides, facing the sample
/// from the mirror direction.
fn lamp_render(record: &Case, report: &mut Report) -> Result<()> {
    let view = camera(record)?;
    let (ior, _) = material(record.text("bsdf")?)?;
    let surface = Microfacet { ior, ggx: Ggx::new(record.number("alpha")?, Masking::Separable)? };
    let center = DVec3::new(-view.direction.x, 0.0, view.direction.z);
    // Incident frame: x along the s axis (+y, as the camera's φ says), y across it and the propagation −ω_i.
    let s = DVec3::Y;
    let across = (-center).cross(s);
    let (sin, cos) = angle(record, "psi_i")?.sin_cos();
    let axis = s * cos + across * sin;
    // The lamp's sides are along the polarizer's axes: the two were turned together.
    let lamp = Lamp { absorbing: across * cos - s * sin };
    let half = Degrees(3.0).to_radians().0.tan();
    let steps = 48;
    let node = |k: u32| half * ((2.0 * f64::from(k) + 1.0) / f64::from(steps) - 1.0);
    let area = (2.0 * half / f64::from(steps)).powi(2);
    let directions: Vec<(DVec3, f64)> = (0..steps * steps)
        .map(|k| {
            let to = center + axis * node(k / steps) + lamp.absorbing * node(k % steps);
            // Unit distance to the lamp's plane: dω = dA/r³.
            (to.normalize(), area / to.length().powi(3))
        })
        .collect();
    let found = discrete(&lamp, &directions, &surface, DVec3::Z, &view);
    // That quadrature projects the transmitting axis onto the plane across each ray, the renderer does not.
    against_quadrature(record, found, 5e-3, report)?;
    against_render(record, found, report)
}

/// The lamp seen through its polarizer, wherever it is looked for: what passes a sheet is polarized across the ray and
/// its absorbing axis.
struct Lamp {
    absorbing: DVec3,
}

impl Light for Lamp {
    fn stokes(&self, direction: DVec3) -> [f64; 3] {
        let turn = Frame::sky(direction).turn_to(self.absorbing.cross(direction));
        [0.5, 0.5 * turn.cos, 0.5 * turn.sin]
    }
}

fn against_render(record: &Case, found: [f64; 3], report: &mut Report) -> Result<()> {
    let (mean, error) = (record.triple("mean")?, record.triple("se")?);
    for ((found, mean_k), error) in found.into_iter().zip(mean).zip(error) {
        // Below 1e-6 of s0, or 1e-8 of the light (R∥ at Brewster), a standard error is float32 rounding, not noise.
        let scale = error.max(1e-6 * mean[0]).max(1e-8);
        report.see("renders, in standard errors", SIGMAS, [found, mean_k, scale], &record.name());
    }
    Ok(())
}

fn against_quadrature(record: &Case, found: [f64; 3], bound: f64, report: &mut Report) -> Result<()> {
    if record.has("quadrature_double") {
        let expected = record.triple("quadrature_double")?;
        let what =
            if bound > FLOAT32 { "lamp by another quadrature, of s0" } else { "sky by another quadrature, of s0" };
        report.all(what, bound, &found, &expected, expected[0], &record.name());
    }
    Ok(())
}

/// The view: the s axis is +y, the camera's x lies at −φ from it.
fn camera(record: &Case) -> Result<View> {
    let theta = angle(record, "theta")?;
    let (sin_phi, cos_phi) = angle(record, "phi_s")?.sin_cos();
    let wo = DVec3::new(theta.sin(), 0.0, theta.cos());
    Ok(View::new(wo, DVec3::Y * cos_phi - wo.cross(DVec3::Y) * sin_phi)?)
}

fn angle(case: &Case, key: &str) -> Result<f64> {
    Ok(Degrees(case.number(key)?).to_radians().0)
}

/// `pplastic_eta1.5_diff0.5`, `dielectric1.5`, `roughconductor_0.43_2.46`: the index, and the albedo of plastics.
fn material(name: &str) -> Result<(Ior, Option<f64>)> {
    let digits = |part: &str| {
        let number = part.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        number.parse::<f64>().with_context(|| format!("material {name}"))
    };
    let parts: Vec<&str> = name.split('_').collect();
    Ok(match parts.as_slice() {
        ["pplastic", eta, albedo] => (Ior::Dielectric(Dielectric::new(digits(eta)?)?), Some(digits(albedo)?)),
        ["roughconductor", n, k] => (Ior::new(digits(n)?, digits(k)?)?, None),
        [dielectric] => (Ior::new(digits(dielectric)?, 0.0)?, None),
        _ => bail!("an unknown material: {name}"),
    })
}
