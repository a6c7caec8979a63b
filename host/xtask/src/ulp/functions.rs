//! The functions under test, each in f64 and those that lanes use in f32 too.

use super::domain;
use super::exact::{self, big, ulps};
use super::facets::{Lobe, of_surface};
use super::fresnel::{Metal, Term, of_conductor, of_dielectric};
use host_fit::mas;
use host_optics::Masking::{HeightCorrelated, Separable};

/// A function under test.
#[derive(Clone, Copy)]
pub(super) struct Function {
    pub(super) name: &'static str,
    /// Last places of what.
    pub(super) unit: &'static str,
    pub(super) what: What,
}

/// What it is a function of.
#[derive(Clone, Copy)]
pub(super) enum What {
    Dielectric(Term),
    Conductor(Metal),
    Surface(Lobe),
    Mas,
}

/// The type it is computed in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    F64,
    F32,
}

impl Type {
    pub(super) fn name(self) -> &'static str {
        if self == Self::F64 { "f64" } else { "f32" }
    }

    /// Most last places allowed.
    pub(super) fn bound(self) -> f64 {
        if self == Self::F64 { 8.0 } else { 16.0 }
    }
}

impl Function {
    pub(super) fn domain(&self, in_type: Type) -> &'static str {
        match (self.what, in_type) {
            (What::Dielectric(_), Type::F64) => "η 1 + 1e-15 … 1000, θ 0 … 90° − 1e-6 rad",
            (What::Dielectric(_), Type::F32) => "η 1 + 1e-6 … 1000, θ 0 … 90° − 1e-6 rad",
            (What::Conductor(_), _) => "n .05 … 10, k 1e-6 … 10, θ 0 … 90° − 1e-6 rad",
            (What::Surface(_), _) => "α 1e-5 … 1, θ 0 … 90° − 1e-6 rad",
            (What::Mas, _) => "p 1e-9 … 1, p/σ 1e-8 … 100",
        }
    }

    /// The types it exists in.
    pub(super) fn types(&self) -> &'static [Type] {
        if matches!(self.what, What::Mas) { &[Type::F64] } else { &[Type::F64, Type::F32] }
    }

    /// The error at a point of the unit cube; `None` where the function refuses, as it should.
    pub(super) fn error(&self, in_type: Type, p: [f64; 3]) -> Option<f64> {
        match (self.what, in_type) {
            (What::Dielectric(term), Type::F64) => of_dielectric::<f64>(term, p),
            (What::Dielectric(term), Type::F32) => of_dielectric::<f32>(term, p),
            (What::Conductor(term), Type::F64) => of_conductor::<f64>(term, p),
            (What::Conductor(term), Type::F32) => of_conductor::<f32>(term, p),
            (What::Surface(lobe), Type::F64) => of_surface::<f64>(lobe, p),
            (What::Surface(lobe), Type::F32) => of_surface::<f32>(lobe, p),
            (What::Mas, _) => {
                let (dolp, sigma) = domain::measured(p);
                let exact = exact::mas(big(dolp), big(sigma));
                Some(ulps(mas(dolp, sigma), &exact, &exact))
            }
        }
    }

    /// The arguments of a point, in words.
    pub(super) fn place(&self, in_type: Type, p: [f64; 3]) -> String {
        match (self.what, in_type) {
            (What::Dielectric(_), Type::F64) => domain::dielectric_words::<f64>(p),
            (What::Dielectric(_), Type::F32) => domain::dielectric_words::<f32>(p),
            (What::Conductor(_), _) => domain::conductor_words(p),
            (What::Surface(lobe), _) if lobe.has_two_angles() => domain::two_angle_words(p),
            (What::Surface(_), _) => domain::surface_words(p),
            (What::Mas, _) => domain::measured_words(p),
        }
    }
}

pub(super) const FUNCTIONS: [Function; 37] = [
    of_eta("r_s", "itself", Term::Rs),
    of_eta("t = −r_p/r_s", "1", Term::T),
    of_eta("R⊥", "itself", Term::Perpendicular),
    of_eta("R∥", "R⊥", Term::Parallel),
    of_eta("√(R⊥R∥) cos δ", "R⊥", Term::CosDelta),
    of_eta("R⊥ − R∥", "itself", Term::Difference),
    of_eta("DoLP", "itself", Term::Dolp),
    of_eta("∂R⊥/∂η", "itself", Term::PerpendicularByEta),
    of_eta("∂t/∂η", "itself", Term::TByEta),
    of_eta("∂R⊥/∂c", "itself", Term::PerpendicularByCosine),
    of_eta("∂t/∂c", "itself", Term::TByCosine),
    of_eta("T⊥", "itself", Term::TransmittedPerpendicular),
    of_eta("T∥", "itself", Term::TransmittedParallel),
    of_eta("η from R⊥", "itself", Term::Inverse),
    of_eta("cos θ of Brewster", "itself", Term::BrewsterCosine),
    of_eta("sin² θ of Brewster", "itself", Term::BrewsterSine),
    of_metal("R⊥, metal", "itself", Metal::Perpendicular),
    of_metal("R∥, metal", "R⊥", Metal::Parallel),
    of_metal("√(R⊥R∥) cos δ, metal", "R⊥", Metal::CosDelta),
    of_metal("√(R⊥R∥) sin δ, metal", "R⊥", Metal::SinDelta),
    of_metal("R⊥ − R∥, metal", "itself", Metal::Difference),
    of_metal("DoLP, metal", "itself", Metal::Dolp),
    of_alpha("GGX D", "itself", Lobe::D),
    of_alpha("∂D/∂α", "2D/α", Lobe::DByAlpha),
    of_alpha("Smith Λ", "itself", Lobe::Lambda),
    of_alpha("∂Λ/∂α", "itself", Lobe::LambdaByAlpha),
    of_alpha("G1", "itself", Lobe::G1),
    of_alpha("G2, height-correlated", "itself", Lobe::G2(HeightCorrelated)),
    of_alpha("G2, separable", "itself", Lobe::G2(Separable)),
    of_alpha("G2/(4 c_i c_o), height-correlated", "itself", Lobe::Visibility(HeightCorrelated)),
    of_alpha("G2/(4 c_i c_o), separable", "itself", Lobe::Visibility(Separable)),
    of_alpha("∂/∂α of it, height-correlated", "itself", Lobe::VisibilityByAlpha(HeightCorrelated)),
    of_alpha("∂/∂α of it, separable", "itself", Lobe::VisibilityByAlpha(Separable)),
    of_alpha("density of visible normals", "itself", Lobe::VisibleDensity),
    of_alpha("G2/G1, height-correlated", "itself", Lobe::VisibleWeight(HeightCorrelated)),
    of_alpha("G2/G1, separable", "itself", Lobe::VisibleWeight(Separable)),
    Function { name: "DoLP without bias (MAS)", unit: "itself", what: What::Mas },
];

const fn of_eta(name: &'static str, unit: &'static str, term: Term) -> Function {
    Function { name, unit, what: What::Dielectric(term) }
}

const fn of_metal(name: &'static str, unit: &'static str, term: Metal) -> Function {
    Function { name, unit, what: What::Conductor(term) }
}

const fn of_alpha(name: &'static str, unit: &'static str, lobe: Lobe) -> Function {
    Function { name, unit, what: What::Surface(lobe) }
}
