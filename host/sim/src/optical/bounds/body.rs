//! Enclosures of what the body below a surface sends to the camera: ρ_d/π E T_out, E = ∫ L p(n·ω) dω with p(c) = c T_in(c) above
//! both horizons.
//!
//! Integrals over c are sums of 256 cells; 1 % is added to (or taken from) each against their error.

use super::{Interval, Profile};
use host_optics::{Dielectric, Incidence};

const CELLS: u16 = 256;
const GRACE: f64 = 0.01;

/// The body of one band under one interface, below normals within `tilt` (radians) of z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// `None`: Lambert, T = 1.
    interface: Option<Dielectric>,
    /// Range of E.
    irradiance: Interval,
    /// 2π ∫ L c b dc: what E changes by at most per degree of polarization.
    tint: f64,
    /// Least upper bound found of |∂E/∂n| per radian.
    slope: f64,
}

/// In radiance, of every pixel of a slice of θ_o.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Emitted {
    /// s0 at least.
    pub(crate) least: f64,
    /// More than s0 changes by per degree of polarization of the light.
    pub(crate) tint: f64,
    /// More than any component changes when another normal no farther than asked for is put in.
    pub(crate) moved: f64,
}

impl Body {
    /// `round`: the light depends on elevation alone and is not polarized.
    ///
    /// - |∂E/∂n| <= ∫ L |p′| |ω_t·e| dω, and ∫ |cos φ| dφ = 4; polarization adds P times the same of c b and of its turning
    ///   axis, b = ½ |T⊥ − T∥|.
    /// - Round light has a stationary point at n = z, so that there the slope is at most the tilt times
    ///   sup |∂²E/∂n²| <= ∫ L (|p″| (n′·ω)² + |p′| c) dω + p′(0) ∫ L cos² φ dφ, the last along the terminator. No round light's E
    ///   changes faster than with tilt.
    pub(crate) fn new(interface: Option<Dielectric>, light: &Profile, dolp: f64, tilt: f64, round: bool) -> Self {
        let [t, b] = [0, 1].map(|k| move |c: f64| transmitted(interface, c)[k]);
        let p = |c: f64| c * t(c);
        let turned = |c: f64| c * b(c);
        let step = 1.0 / f64::from(CELLS);
        let mut range = Interval::at(0.0);
        let (mut first, mut second) = (0.0, 0.0);
        let (mut brightest, mut tint) = (0.0_f64, 0.0_f64);
        for k in 0..CELLS {
            let (low, high) = (f64::from(k) * step, f64::from(k + 1) * step);
            let middle = 0.5 * (low + high);
            let elevation = Interval::new(low.asin() - tilt, high.asin() + tilt);
            let light_here = light.range(elevation);
            let sure = if elevation.low > 0.0 { light_here.low } else { 0.0 };
            let around = core::f64::consts::TAU * step;
            range = Interval::new(
                range.low + around * sure * (p(middle) - dolp * turned(middle)),
                range.high + around * light_here.high * (p(middle) + dolp * turned(middle)),
            );
            tint += around * light_here.high * turned(middle);
            let sine = ((1.0 - middle) * (1.0 + middle)).sqrt();
            let slope = |f: &dyn Fn(f64) -> f64| ((f(high) - f(low)) / step).abs();
            first += light_here.high * step * (4.0 * slope(&p) * sine);
            if dolp > 0.0 {
                first += light_here.high * dolp * around * (slope(&turned) * sine + 2.0 * turned(middle) / sine);
            }
            // p″ over this cell and the next.
            let bend = ((p((high + step).min(1.0)) - 2.0 * p(high) + p(low)) / (step * step)).abs();
            let bend = if k + 1 < CELLS { bend } else { 0.0 };
            // ∫ cos² φ dφ = π.
            second += light_here.high * 0.5 * around * (bend * sine * sine + 2.0 * slope(&p) * middle);
            brightest = brightest.max(light_here.high);
        }
        second += core::f64::consts::PI * brightest * t(0.0);
        let slope = if round && dolp == 0.0 { f64::min(first, tilt * second) } else { first };
        let irradiance = Interval::new(range.low * (1.0 - GRACE), range.high * (1.0 + GRACE));
        Self { interface, irradiance, tint: tint * (1.0 + GRACE), slope: slope * (1.0 + GRACE) }
    }

    /// Towards views at these θ_o (radians, below 88° with `moved` added), of these albedos.
    pub(crate) fn emitted(&self, theta: [f64; 2], albedo: [f64; 2], moved: f64) -> Emitted {
        let [low, high] = theta;
        let leaving = |theta: f64| transmitted(self.interface, theta.cos());
        // T falls with θ; b grows to near grazing, and is at most T.
        let least = leaving(high)[0];
        let scale = albedo.map(|a| a * core::f64::consts::FRAC_1_PI);
        let tint = scale[1] * self.tint * leaving(low)[0];
        let mut out = Emitted { least: scale[0] * self.irradiance.low * least, tint, moved: 0.0 };
        if moved > 0.0 {
            let (near, far) = ((low - moved).max(0.0), high + moved);
            // b e^(2iψ) moves by |b′| + 2 b/sin θ per radian; T by |T′|.
            let mut worst = [0.0_f64; 3];
            let step = (far - near) / 16.0;
            for k in 0..16_u8 {
                let ends = [near + step * f64::from(k), near + step * f64::from(k + 1)];
                let [[t0, b0], [t1, b1]] = ends.map(leaving);
                let turning = 2.0 * b0.max(b1) / ends[0].max(0.5 * step).sin();
                worst = [
                    worst[0].max((t1 - t0).abs() / step),
                    worst[1].max((b1 - b0).abs() / step + turning),
                    worst[2].max(b0.max(b1)),
                ];
            }
            let (e, change) = (self.irradiance.high, self.slope * moved);
            let power = change * leaving(near)[0] + e * worst[0] * moved;
            let polarized = change * worst[2] + e * worst[1] * moved;
            out.moved = 1.05 * scale[1] * power.max(polarized);
        }
        out
    }
}

/// ½ (T⊥ + T∥) and ½ |T⊥ − T∥| at cos θ.
fn transmitted(interface: Option<Dielectric>, cosine: f64) -> [f64; 2] {
    let Some(ior) = interface else { return [1.0, 0.0] };
    let [s, p] = ior.transmittance(Incidence { cosine, sine_squared: (1.0 - cosine) * (1.0 + cosine) });
    [0.5 * (s + p), 0.5 * (s - p).abs()]
}
