//! Enclosures of what a rough lobe sends to the camera, cell by cell over the slopes of its facets, for any light of which a
//! range by elevation is known.
//!
//! With slopes m = r (cos φ, sin φ) about the pixel's normal n (φ = 0 towards the camera; h ∝ n + m) paper eq. 6 is
//! ∫ P22 (1 + m·t)₊ G2 F(h) dm, and everything in it but the light is a function of r, φ and θ_o alone:
//! ω_o·(n + m) = c_o + r s_o cos φ, cos θ_d = that/√(1 + r²), n·ω_i = c_o (2/(1 + r²) − 1) + 2 r s_o cos φ/(1 + r²). Each cell
//! multiplies its exact mass of P22 by intervals of the rest; ω_i is within the tilt of n of its own elevation above z. Sums of
//! intervals enclose the integral. φ and −φ share a cell: they differ in nothing but their light.

use super::{Fresnel, Interval, Profile};
use core::f64::consts::{FRAC_PI_2, PI};
use host_optics::{Ggx, Masking};

/// Cells of a half turn.
const AZIMUTHS: u8 = 12;
/// Rings of equal mass out to a slope of 4 α.
const INNER: u8 = 12;
/// Slopes beyond this mirror a view of cos θ_o > 0.02 below the surface.
const STEEPEST: f64 = 120.0;

/// Cells of slope space for one roughness.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    ggx: Ggx,
    rings: Vec<(Interval, f64)>,
    /// cos φ, sin φ.
    azimuths: Vec<[Interval; 2]>,
}

/// What the sums are over.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice<'a> {
    /// Range of θ_o in radians; views beyond 88.8° have no enclosure.
    pub(crate) theta: [f64; 2],
    /// No normal is farther from z, radians.
    pub(crate) tilt: f64,
    pub(crate) fresnel: &'a Fresnel,
    pub(crate) light: &'a Profile,
    /// Largest DoLP of the light. [`Sums::along`] and [`Sums::across`] are of light without polarization.
    pub(crate) dolp: f64,
    /// Normals may be replaced by others up to so far away, radians.
    pub(crate) moved: f64,
}

impl Slice<'_> {
    /// s0 of a mirror at the pixel's normal, and its s1 in the frame of its plane of incidence without the light's polarization.
    pub(crate) fn mirror(&self) -> [Interval; 2] {
        let [low, high] = self.theta;
        let seen = self.fresnel.range(Interval::new(high.cos().max(0.0), low.cos()), self.dolp);
        let elevation = Interval::new(FRAC_PI_2 - high - self.tilt, FRAC_PI_2 - low + self.tilt);
        let light = self.light.range(elevation);
        // Below the world's horizon it is black.
        let light = if elevation.low > 0.0 { light } else { Interval::new(0.0, light.high) };
        [seen.power * light, (seen.difference * light).scale(0.5)]
    }
}

/// Radiances; of every pixel of a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// s0 at least.
    pub(crate) least: f64,
    /// s0 at most.
    pub(crate) most: f64,
    /// More than any component gains without masking.
    pub(crate) masked: f64,
    /// More than any component changes when another normal no farther than `moved` is put in, ∫ |f̄/f − 1| f F over directions ω_i.
    pub(crate) moved: f64,
    /// s1 in the frame of the pixel's own plane of incidence, unpolarized light.
    pub(crate) along: [f64; 2],
    /// |s2| there at most.
    pub(crate) across: f64,
}

impl Cells {
    pub(crate) fn new(ggx: Ggx) -> Self {
        let alpha = ggx.alpha();
        let beyond = |r: f64| alpha * alpha / (alpha * alpha + r * r);
        let slope = |v: f64| alpha * ((1.0 - v) / v).sqrt();
        let last = beyond(4.0 * alpha);
        let step = (1.0 - last) / f64::from(INNER);
        let mut ends: Vec<f64> = (0..INNER).map(|k| slope(1.0 - step * f64::from(k))).collect();
        let mut r = 4.0 * alpha;
        while r < STEEPEST {
            ends.push(r);
            // Where the mirrored ray moves by less than a degree rings may be wide.
            r = if r < 0.01 { (4.0 * r).min(0.011) } else { 1.3 * r };
        }
        ends.push(r);
        let ring = |w: &[f64]| (Interval::new(w[0], w[1]), beyond(w[0]) - beyond(w[1]));
        let angle = |k: u8| PI * f64::from(k) / f64::from(AZIMUTHS);
        let azimuth = |k: u8| {
            let (a, b) = (angle(k), angle(k + 1));
            let (low, high) =
                (a.sin().min(b.sin()), if a < FRAC_PI_2 && b > FRAC_PI_2 { 1.0 } else { a.sin().max(b.sin()) });
            [Interval::new(b.cos(), a.cos()), Interval::new(low, high)]
        };
        Self { ggx, rings: ends.windows(2).map(ring).collect(), azimuths: (0..AZIMUTHS).map(azimuth).collect() }
    }

    /// Over a slice. `None` where it has no enclosure.
    pub(crate) fn sum(&self, slice: &Slice<'_>) -> Option<Sums> {
        let [low, high] = slice.theta;
        if high.cos() < 0.02 || low > high {
            return None;
        }
        let view = View {
            cosine: Interval::new(high.cos(), low.cos()),
            sine: Interval::new(low.sin(), high.sin()),
            lambda: Interval::new(lambda(self.ggx, low), lambda(self.ggx, high)),
        };
        let mut sums = Sums::default();
        for (r, mass) in &self.rings {
            let share = mass / f64::from(AZIMUTHS);
            self.azimuths.iter().for_each(|azimuth| self.add(&mut sums, slice, &view, *r, *azimuth, share));
        }
        if slice.moved > 0.0 && high + slice.moved >= FRAC_PI_2 - 0.03 {
            sums.moved = f64::INFINITY;
        }
        Some(sums)
    }

    fn add(&self, sums: &mut Sums, slice: &Slice<'_>, view: &View, r: Interval, azimuth: [Interval; 2], share: f64) {
        let [cos_phi, sin_phi] = azimuth;
        let x = r * cos_phi;
        let up = view.cosine + x * view.sine;
        let inverse = r.square().offset(1.0).reciprocal();
        let light = view.cosine * inverse.scale(2.0).offset(-1.0) + (x * view.sine * inverse).scale(2.0);
        if up.high <= 0.0 || light.high <= -slice.moved.sin() {
            return;
        }
        let elevation = light.clamp(-1.0, 1.0).map(f64::asin);
        let above = Interval::new(elevation.low - slice.tilt, elevation.high + slice.tilt);
        if above.high <= 0.0 {
            return;
        }
        // 1 + m·t, of the slice at its own θ_o.
        let weight = (up * view.cosine.reciprocal()).clamp(0.0, f64::INFINITY);
        let cosine = (up * inverse.sqrt()).clamp(0.0, 1.0);
        let seen = slice.fresnel.range(cosine, slice.dolp);
        let radiance = slice.light.range(above);
        // Its lowest ray surely sees the sky.
        let whole = above.low > 0.0 && light.low > 0.0 && up.low > 0.0;
        let mask = self.masking(FRAC_PI_2 - elevation.high, FRAC_PI_2 - elevation.low, view.lambda);
        let brightest = share * weight.high * radiance.high;
        let dimmest = if whole { share * weight.low * radiance.low * mask.low } else { 0.0 };
        sums.moved += brightest * seen.power.high * self.moved(slice, r, elevation, mask);
        if light.high <= 0.0 {
            return;
        }
        sums.least += dimmest * seen.power.low;
        sums.most += brightest * mask.high * seen.power.high;
        sums.masked += brightest * (1.0 - mask.low) * seen.power.high;
        let [along, across] = turned(view, r, cos_phi, sin_phi);
        let polarized = Interval::new(dimmest, brightest * mask.high) * seen.difference.scale(0.5);
        let own = polarized * along;
        sums.along = [sums.along[0] + own.low, sums.along[1] + own.high];
        // φ and −φ cancel but for the spread of all that is not known.
        sums.across += 0.5 * (polarized.high - polarized.low) * across.magnitude();
    }

    /// G2 for θ_i in an interval (radians); 0 at and below the horizon.
    fn masking(&self, low: f64, high: f64, view: Interval) -> Interval {
        let of = |i: f64, o: f64| match self.ggx.masking() {
            Masking::HeightCorrelated => 1.0 / (1.0 + i + o),
            Masking::Separable => 1.0 / ((1.0 + i) * (1.0 + o)),
        };
        Interval::new(of(lambda(self.ggx, high), view.high), of(lambda(self.ggx, low.max(0.0)), view.low))
    }

    /// At most |a Ḡ2 − G2| <= Ḡ2 |a − 1| + |Ḡ2 − G2| for a normal up to `moved` away, a of D and of 1/cos θ_o: θ_h, θ_i and θ_o each move by
    /// no more. D by a factor of at most exp(`moved` sup |d ln D/dθ_h|); G2 by no more than the sum of what both Λ grow by, which are
    /// convex in θ; and by ω_i also by no more than 2/α times what n·ω_i moves by, as G1 = 2c/(c + √(c² + α²s²)) is concave in c with
    /// that slope at its zero.
    fn moved(&self, slice: &Slice<'_>, r: Interval, elevation: Interval, mask: Interval) -> f64 {
        let by = slice.moved;
        if by <= 0.0 {
            return 0.0;
        }
        let alpha = self.ggx.alpha();
        let grown = (by * steepest(alpha, (r.low.atan() - by).max(0.0), r.high.atan() + by)).exp();
        let [_, theta] = slice.theta;
        let (nearer, farther) = (theta.cos() / (theta + by).cos(), theta.cos() / (theta - by).max(0.0).cos());
        let growth = |theta: f64| lambda(self.ggx, theta + by) - lambda(self.ggx, theta);
        let lowest = FRAC_PI_2 - elevation.low;
        let by_light = if lowest + by < FRAC_PI_2 { growth(lowest) } else { f64::INFINITY };
        let highest = (FRAC_PI_2 - elevation.high - by).max(0.0);
        let most = self.masking(highest, FRAC_PI_2, Interval::at(0.0)).high.max(mask.high);
        let masked = (most * by_light).min(2.0 * by / alpha) + most * growth(theta);
        most * (grown * nearer - 1.0).max(1.0 - farther / grown) + masked * (1.0 + masked)
    }
}

#[derive(Clone, Copy)]
struct View {
    cosine: Interval,
    sine: Interval,
    lambda: Interval,
}

/// Λ at θ radians.
fn lambda(ggx: Ggx, theta: f64) -> f64 {
    if theta >= FRAC_PI_2 {
        f64::INFINITY
    } else {
        ggx.lambda(host_optics::Incidence::from_angle(protocol_polar::Radians(theta)))
    }
}

/// sup of |d ln D/dθ_h| = 4 s c (1 − α²)/(α²c² + s²), which peaks at tan θ_h = α, over an interval in [0, π/2].
fn steepest(alpha: f64, low: f64, high: f64) -> f64 {
    let at = |theta: f64| {
        let (s, c) = theta.sin_cos();
        4.0 * s * c.max(0.0) / (alpha * alpha * c * c + s * s)
    };
    let peak = alpha.atan();
    if low <= peak && peak <= high { 2.0 / alpha } else { at(low).max(at(high.min(FRAC_PI_2))) }
}

/// cos and sin of twice the turn from the plane of (n, ω_o) to that of (h, ω_o): across ω_o, h has the components s_o − r c_o cos φ
/// and r sin φ.
fn turned(view: &View, r: Interval, cos_phi: Interval, sin_phi: Interval) -> [Interval; 2] {
    let (p, b) = (view.sine - r * cos_phi * view.cosine, r * sin_phi);
    let (p2, b2) = (p.square(), b.square());
    let all = Interval::new(-1.0, 1.0);
    if p2.low + b2.low <= 0.0 {
        return [all, all];
    }
    // (p² − b²)/(p² + b²) grows with p²/b²; |sin 2ψ| = 2 |p b|/(p² + b²).
    let cosine = |p2: f64, b2: f64| (p2 - b2) / (p2 + b2);
    let along = Interval::new(cosine(p2.low, b2.high), cosine(p2.high, b2.low));
    let across = (2.0 * p.magnitude() * b.magnitude() / (p2.low + b2.low)).min(1.0);
    [along, Interval::new(-across, across)]
}
