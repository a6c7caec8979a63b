//! Every function of the facets' distribution, as it is computed and in its textbook form.

use super::domain::surface;
use super::exact::{Big, PI, Precision, big, ulps};
use host_optics::{Incidence, Masking};

/// A function of roughness and one or two angles.
#[derive(Clone, Copy)]
pub(super) enum Lobe {
    D,
    DByAlpha,
    Lambda,
    LambdaByAlpha,
    G1,
    G2(Masking),
    Visibility(Masking),
    VisibilityByAlpha(Masking),
    VisibleDensity,
    VisibleWeight(Masking),
}

impl Lobe {
    fn masking(self) -> Masking {
        match self {
            Self::G2(m) | Self::Visibility(m) | Self::VisibilityByAlpha(m) | Self::VisibleWeight(m) => m,
            _ => Masking::default(),
        }
    }

    /// Whether it depends on the second direction.
    pub(super) fn has_two_angles(self) -> bool {
        !matches!(self, Self::D | Self::DByAlpha | Self::Lambda | Self::LambdaByAlpha | Self::G1)
    }
}

/// The error of a function.
pub(super) fn of_surface<T: Precision>(lobe: Lobe, p: [f64; 3]) -> Option<f64> {
    let (ggx, i, o) = surface::<T>(p, lobe.masking())?;
    let (x, y) = (Angle::new(ggx.alpha(), i), Angle::new(ggx.alpha(), o));
    let a = &x.alpha;
    let one = || big(1.0);
    let itself = |found: T, exact: Big| Some(ulps(found, &exact, &exact));
    let g2 = |masking| match masking {
        Masking::HeightCorrelated => one() / (one() + x.lambda() + y.lambda()),
        Masking::Separable => x.g1() * y.g1(),
    };
    let between = || big(4.0) * &x.c * &y.c;
    match lobe {
        Lobe::D => itself(ggx.d(i), x.d()),
        // It crosses zero at tan θ_h = α, where both of its terms are 2D/α.
        Lobe::DByAlpha => {
            let slope = big(2.0) * x.d() / a;
            let narrow = a * a * &x.c * &x.c;
            let exact = &slope * (&x.s2 - &narrow) / (&x.s2 + &narrow);
            Some(ulps(ggx.d_by_alpha(i), &exact, &slope))
        }
        Lobe::Lambda => itself(ggx.lambda(i), x.lambda()),
        Lobe::LambdaByAlpha => itself(ggx.lambda_by_alpha(i), x.lambda_by_alpha()),
        Lobe::G1 => itself(ggx.g1(i), x.g1()),
        Lobe::G2(masking) => itself(ggx.g2(i, o), g2(masking)),
        Lobe::Visibility(masking) => itself(ggx.visibility(i, o), g2(masking) / between()),
        Lobe::VisibilityByAlpha(masking) => {
            let g = g2(masking);
            let slope = match masking {
                Masking::HeightCorrelated => &g * &g * (x.lambda_by_alpha() + y.lambda_by_alpha()),
                Masking::Separable => &g * (x.g1() * x.lambda_by_alpha() + y.g1() * y.lambda_by_alpha()),
            };
            itself(ggx.visibility_by_alpha(i, o), -slope / between())
        }
        Lobe::VisibleDensity => itself(ggx.visible_density(o, i, i.cosine), y.g1() * x.d() * &x.c / &y.c),
        Lobe::VisibleWeight(masking) => itself(ggx.visible_weight(i, o), g2(masking) / y.g1()),
    }
}

struct Angle {
    alpha: Big,
    c: Big,
    s2: Big,
}

impl Angle {
    fn new<T: Precision>(alpha: T, at: Incidence<T>) -> Self {
        Self { alpha: big(alpha), c: big(at.cosine), s2: big(at.sine_squared) }
    }

    /// α²/(π (α²c² + s²)²).
    fn d(&self) -> Big {
        let a2 = &self.alpha * &self.alpha;
        let sum = &a2 * &self.c * &self.c + &self.s2;
        a2 / (&*PI * &sum * &sum)
    }

    /// √(1 + α² tan² θ).
    fn root(&self) -> Big {
        (big(1.0) + &self.alpha * &self.alpha * &self.s2 / (&self.c * &self.c)).sqrt()
    }

    /// (√(1 + α² tan² θ) − 1)/2.
    fn lambda(&self) -> Big {
        (self.root() - big(1.0)) / big(2.0)
    }

    /// α tan² θ/(2 √(1 + α² tan² θ)).
    fn lambda_by_alpha(&self) -> Big {
        &self.alpha * &self.s2 / (&self.c * &self.c) / (big(2.0) * self.root())
    }

    /// 1/(1 + Λ).
    fn g1(&self) -> Big {
        big(1.0) / (big(1.0) + self.lambda())
    }
}
