//! Eq. 6 by quadrature as a [`Forward`]: for smooth analytic light, as a reference, and to fit with where no table is.
//!
//! Points are placed about the mirror direction at the current normal and α, in the lobe's own proportions; derivatives are the
//! integrals of the integrand's derivatives at points held fixed in ω_i ([`lobe`]). They are exact up to the quadrature's
//! error, like the values.

mod body;
mod lobe;
mod polar;

use crate::material::{BANDS, Facets, Forward, Lanes, Response, by};
use glam::DVec3;
use host_optics::frames::s_axis;
use host_optics::integral::View;
use host_optics::{Dielectric, Frame, Ggx, Incidence, Ior, Light, Masking, Reflection};
use lobe::{Lobe, Weight};
use polar::{Polar, Ray};
use protocol_polar::Reflectance;

/// What lies below the facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// Paper eq. 6: unpolarized, ρ_d E/π.
    #[default]
    Lambert,
    /// [`host_optics::PolarizedDiffuse`] under an interface of the facets' index. Of a conductor: Lambert.
    Polarized,
}

/// Eq. 6 under analytic light, see the module.
#[derive(Clone, Debug)]
pub struct Direct<L> {
    bands: [L; BANDS],
    cameras: Vec<DVec3>,
    rule: Polar,
    masking: Masking,
    body: Body,
    fixed: Option<Ior>,
}

impl<L: Light + Sync> Direct<L> {
    /// Under the light of `bands`, for views whose pictures have `cameras[view]` to the right, with 2 `order`² points.
    ///
    /// Error under a smooth polarized sky, α from 1e-4 to 0.6, views to 82° and mirror directions below the horizon included, in
    /// units of s0 (median / worst): order 16 3e-6 / 5e-3, 24 5e-7 / 2e-4, 32 1e-7 / 3e-5, 48 3e-8 / 2e-6.
    #[must_use]
    pub fn new(bands: [L; BANDS], cameras: Vec<DVec3>, order: u32) -> Self {
        let (masking, body) = (Masking::default(), Body::default());
        Self { bands, cameras, rule: Polar::new(order), masking, body, fixed: None }
    }

    /// With another masking and shadowing than the height-correlated.
    #[must_use]
    pub fn with_masking(self, masking: Masking) -> Self {
        Self { masking, ..self }
    }

    /// With another body than Lambert's.
    #[must_use]
    pub fn with_body(self, body: Body) -> Self {
        Self { body, ..self }
    }

    /// With a known index, which is then no parameter: a metal, a coating.
    #[must_use]
    pub fn with_index(self, ior: Ior) -> Self {
        Self { fixed: Some(ior), ..self }
    }

    fn add_specular(&self, ior: Ior, lobe: &Lobe, view: &View, slopes: [DVec3; 2], into: &mut Response) {
        let (normal, wo) = (lobe.normal, lobe.wo);
        let cosine = normal.dot(wo);
        let mirrored = normal * (2.0 * cosine) - wo;
        let across = normal.cross(wo) / cosine;
        for Ray { e, ends, weight } in self.rule.rays(mirrored, normal) {
            // Facets turn by half the ray's angle in the plane of incidence and by 1/cos θ_o as much across it. With r the
            // slope of a facet in that measure, points are even in t = 1 − α/√(α² + r²): the distribution's own shape.
            let narrow = lobe.ggx.alpha() / 1.0_f64.hypot(e.dot(across));
            let [low, high] = ends.map(|theta| {
                let x = (0.5 * theta).tan();
                let slant = narrow.hypot(x);
                (x / slant) * (x / (slant + narrow))
            });
            for (node, share) in self.rule.radii() {
                let t = low + (high - low) * node;
                let rest = 1.0 - t;
                let x = narrow * (t * (2.0 - t)).sqrt() / rest;
                let stretch = 1.0 + x * x;
                let wi = mirrored * ((1.0 - x) * (1.0 + x) / stretch) + e * (2.0 * x / stretch);
                let Some(w) = lobe.weight(wi) else { continue };
                // dω = 4x dx dφ/(1 + x²)², x dx = α² dt/(1 − t)³.
                let area = weight * share * (high - low) * (2.0 * narrow / (rest * stretch)).powi(2) / rest;
                self.add_point(ior, wi, view, area, &w, slopes, into);
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the inner body of one loop")]
    fn add_point(
        &self,
        ior: Ior,
        wi: DVec3,
        view: &View,
        area: f64,
        w: &Weight,
        slopes: [DVec3; 2],
        into: &mut Response,
    ) {
        let s = s_axis(wi, view.direction);
        let at = Incidence::on_facet(wi, view.direction);
        let reflection = Reflection {
            into_plane: Frame::sky(wi).turn_to(s).inverse(),
            reflectance: ior.reflectance(at),
            out_of_plane: view.frame.turn_to(s),
        };
        let by_eta = match (self.fixed, ior) {
            (None, Ior::Dielectric(d)) => Some(Reflection { reflectance: by_index(d, at), ..reflection }),
            _ => None,
        };
        let [value, by_alpha] = [w.value, w.by_alpha].map(|x| x * area);
        let by_slope = slopes.map(|change| w.by_normal.dot(change) * area);
        for (band, light) in self.bands.iter().enumerate() {
            let incident = light.stokes(wi);
            let add = |lanes: &mut Lanes, stokes: [f64; 3], factor: f64| {
                for (lane, x) in lanes.iter_mut().skip(3 * band).zip(stokes) {
                    *lane += factor * x;
                }
            };
            let stokes = reflection.apply(incident);
            add(&mut into.specular, stokes, value);
            add(&mut into.specular_by[by::ALPHA], stokes, by_alpha);
            add(&mut into.specular_by[by::SLOPE_X], stokes, by_slope[0]);
            add(&mut into.specular_by[by::SLOPE_Y], stokes, by_slope[1]);
            if let Some(by_eta) = &by_eta {
                add(&mut into.specular_by[by::ETA], by_eta.apply(incident), value);
            }
        }
    }

    fn add_diffuse(&self, ior: Ior, normal: DVec3, slopes: [DVec3; 2], view: &View, into: &mut Response) {
        for (band, light) in self.bands.iter().enumerate() {
            let (value, mut derivatives) = match (self.body, ior) {
                (Body::Polarized, Ior::Dielectric(d)) => body::polarized(light, d, &self.rule, normal, slopes, view),
                _ => body::lambert(light, &self.rule, normal, slopes),
            };
            if self.fixed.is_some() {
                derivatives[by::ETA] = [0.0; 3];
            }
            into.diffuse[3 * band..][..3].copy_from_slice(&value);
            for (lanes, derivative) in into.diffuse_by.iter_mut().zip(derivatives) {
                lanes[3 * band..][..3].copy_from_slice(&derivative);
            }
        }
    }
}

impl<L: Light + Sync> Forward for Direct<L> {
    fn index_is_free(&self) -> bool {
        self.fixed.is_none()
    }

    fn response(&self, view: usize, direction: DVec3, facets: &Facets) -> Response {
        let camera = self.cameras.get(view).and_then(|x| View::new(direction, *x).ok());
        let ggx = Ggx::new(facets.alpha, self.masking);
        let ior = self.fixed.map_or_else(|| Ior::new(facets.eta, 0.0), Ok);
        let (Some(view), Ok(ggx), Ok(ior)) = (camera, ggx, ior) else { return Response::BLACK };
        let normal = facets.normal();
        let mut response = Response::BLACK;
        // Also refuses a normal that is not a number.
        if normal.dot(view.direction) > 0.0 {
            // ∂n/∂(n_x/n_z) = n_z (x − n n_x).
            let slopes = [DVec3::X, DVec3::Y].map(|axis| (axis - normal * normal.dot(axis)) * normal.z);
            let lobe = Lobe { ggx, normal, wo: view.direction };
            self.add_specular(ior, &lobe, &view, slopes, &mut response);
            self.add_diffuse(ior, normal, slopes, &view, &mut response);
        }
        response
    }
}

/// ∂/∂η of the reflectance terms: R⊥, R⊥t², −R⊥t.
fn by_index(dielectric: Dielectric, at: Incidence) -> Reflectance {
    let (r, t, g) = (dielectric.r_s(at).powi(2), dielectric.t(at), dielectric.gradient(at));
    let (r_by, t_by) = (g.perpendicular_by_eta, g.t_by_eta);
    Reflectance {
        perpendicular: r_by,
        parallel: r_by * t * t + 2.0 * r * t * t_by,
        rr_cos_delta: -r_by * t - r * t_by,
        rr_sin_delta: 0.0,
    }
}
