//! The transmitted radiance sinusoid (TRS): what a turning polarizer shows of a mirror facet under partially polarized
//! light (paper eq. 7-10), and the cases in which it gives the normal's azimuth away.
//!
//! **Erratum.** Paper eq. 9 as printed has a minus before its last term. The Mueller product of eq. 1-4 and 8 gives a
//! plus; so does Mitsuba 3. [`MirrorFacet::radiance`] is the corrected form, and a test holds it against the product.

use core::f64::consts::FRAC_PI_2;
use protocol_polar::{Mueller, Radians, Reflectance, Stokes};

/// A mirror facet under partially polarized light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorFacet {
    /// Fresnel terms at the facet's angle of incidence.
    pub reflectance: Reflectance,
    /// L, radiance of the incident light.
    pub radiance: f64,
    /// P in [0, 1], its degree of linear polarization.
    pub dolp: f64,
    /// ψ_i: incident angle of polarization minus the angle of the s axis, in a frame of the incident beam.
    pub psi: Radians,
    /// φ: angle of the s axis in the camera frame. The normal's azimuth in the picture is φ + π/2.
    pub phi: Radians,
}

/// The sinusoid ½ (max + min) + ½ (max − min) cos 2(φ_o − phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sinusoid {
    /// I_max = ½ (s0 + √(s1² + s2²)).
    pub max: f64,
    /// I_min = ½ (s0 − √(s1² + s2²)).
    pub min: f64,
    /// Polarizer angle of I_max, in [0, π): the angle of polarization.
    pub phase: Radians,
}

impl Sinusoid {
    /// Of light with these Stokes parameters.
    #[must_use]
    pub fn of(light: Stokes) -> Self {
        let [s0, s1, s2, _] = light.0;
        let amplitude = s1.hypot(s2);
        Self { max: 0.5 * (s0 + amplitude), min: 0.5 * (s0 - amplitude), phase: light.aolp() }
    }

    /// Value behind an ideal polarizer at φ_o.
    #[must_use]
    pub fn at(&self, polarizer: Radians) -> f64 {
        let (c, _) = Radians(polarizer.0 - self.phase.0).cos_sin_double();
        0.5 * (self.max + self.min) + 0.5 * (self.max - self.min) * c
    }
}

impl MirrorFacet {
    /// Stokes of the reflected light in the camera frame, M_rot(φ) M_ref M_rot(ψ_i) L [1, P, 0, 0] (paper eq. 8).
    ///
    /// s0 = I⊥ + I∥ and not a product with ½(R⊥ ± R∥), which would cancel where light polarized across the s axis meets the
    /// Brewster angle.
    #[must_use]
    pub fn stokes(&self) -> Stokes {
        let [perpendicular, parallel] = self.components();
        let (_, s) = self.psi.cos_sin_double();
        let across = self.radiance * self.dolp * s;
        let Reflectance { rr_cos_delta, rr_sin_delta, .. } = self.reflectance;
        let in_plane =
            [perpendicular + parallel, perpendicular - parallel, rr_cos_delta * across, -rr_sin_delta * across];
        Mueller::rotation(self.phi).apply(Stokes(in_plane))
    }

    /// (I⊥, I∥) = (½ L R⊥ (1 + P cos 2ψ_i), ½ L R∥ (1 − P cos 2ψ_i)): reflected power along the s axis and across it.
    #[must_use]
    pub fn components(&self) -> [f64; 2] {
        let (c, _) = self.psi.cos_sin_double();
        let half = 0.5 * self.radiance;
        [
            half * self.reflectance.perpendicular * (1.0 + self.dolp * c),
            half * self.reflectance.parallel * (1.0 - self.dolp * c),
        ]
    }

    /// Radiance behind an ideal polarizer at φ_o (paper eq. 9 with the sign of its last term corrected):
    /// ½(I⊥ + I∥) + ½(I⊥ − I∥) cos 2(φ_o − φ) **+** ½ L P √(R⊥R∥) cos δ sin 2ψ_i sin 2(φ_o − φ).
    #[must_use]
    pub fn radiance(&self, polarizer: Radians) -> f64 {
        let [perpendicular, parallel] = self.components();
        let (c, s) = Radians(polarizer.0 - self.phi.0).cos_sin_double();
        let (_, sin_psi) = self.psi.cos_sin_double();
        0.5 * (perpendicular + parallel)
            + 0.5 * (perpendicular - parallel) * c
            + 0.5 * self.radiance * self.dolp * self.reflectance.rr_cos_delta * sin_psi * s
    }

    /// How far the phase of the sinusoid is turned away from φ, in (−π/2, π/2]: the error of reading the normal's azimuth
    /// off the angle of polarization. tan 2Δ = L P √(R⊥R∥) cos δ sin 2ψ_i/(I⊥ − I∥).
    #[must_use]
    pub fn azimuth_error(&self) -> Radians {
        let [perpendicular, parallel] = self.components();
        let (_, sin_psi) = self.psi.cos_sin_double();
        let across = self.radiance * self.dolp * self.reflectance.rr_cos_delta * sin_psi;
        Radians(0.5 * across.atan2(perpendicular - parallel))
    }
}

/// Special case 1, unpolarized light (P = 0): I_max = ½ L R⊥ and I_min = ½ L R∥ with the phase at φ, always.
#[must_use]
pub fn unpolarized(reflectance: Reflectance, radiance: f64, phi: Radians) -> Sinusoid {
    Sinusoid {
        max: 0.5 * radiance * reflectance.perpendicular,
        min: 0.5 * radiance * reflectance.parallel,
        phase: phi.as_axis(),
    }
}

/// Special case 2, light polarized along (`along = true`, ψ_i = 0) or across (ψ_i = π/2) the s axis: sin 2ψ_i = 0, so
/// I⊥ = ½ L R⊥ (1 ± P) and I∥ = ½ L R∥ (1 ∓ P). The phase is φ while I⊥ > I∥ and φ + π/2 beyond.
#[must_use]
pub fn aligned(reflectance: Reflectance, radiance: f64, dolp: f64, along: bool, phi: Radians) -> Sinusoid {
    let p = if along { dolp } else { -dolp };
    let perpendicular = 0.5 * radiance * reflectance.perpendicular * (1.0 + p);
    let parallel = 0.5 * radiance * reflectance.parallel * (1.0 - p);
    let phase = if perpendicular >= parallel { phi } else { Radians(phi.0 + FRAC_PI_2) };
    Sinusoid { max: perpendicular.max(parallel), min: perpendicular.min(parallel), phase: phase.as_axis() }
}

/// Special case 3, the Brewster angle (R∥ = 0): I_max = ½ L R⊥ (1 + P cos 2ψ_i), I_min = 0 and the phase is φ, whatever the
/// polarization of the light.
#[must_use]
pub fn brewster(perpendicular: f64, radiance: f64, dolp: f64, psi: Radians, phi: Radians) -> Sinusoid {
    let (c, _) = psi.cos_sin_double();
    Sinusoid { max: 0.5 * radiance * perpendicular * (1.0 + dolp * c), min: 0.0, phase: phi.as_axis() }
}
