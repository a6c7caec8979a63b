//! DoLP and AoLP from integers, for previews: CORDIC, no float, no division, no table of angles larger than 17 entries.
//!
//! Volder 1959, "The CORDIC trigonometric computing technique", vectoring mode. The AoLP is half the angle of (s1, s2), so
//! its 16-bit turn covers 180°.

/// Degree and angle of linear polarization of one photosite or block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PolarForm {
    /// DoLP, unsigned Q0.16: 65535 stands for 1 and above; 0 without light.
    pub dolp_q16: u16,
    /// AoLP, 65536 = 180°, counter-clockwise from x; 0 where s1 = s2 = 0.
    pub aolp_turn16: u16,
}

/// atan(2^−i) in units of 2^−32 of a full turn, i = 0..17, rounded.
const ANGLES: [i32; 17] = [
    536_870_912,
    316_933_406,
    167_458_907,
    85_004_756,
    42_667_331,
    21_354_465,
    10_679_838,
    5_340_245,
    2_670_163,
    1_335_087,
    667_544,
    333_772,
    166_886,
    83_443,
    41_722,
    20_861,
    10_430,
];
/// Π cos(atan 2^−i) in Q31: undoes the growth of the magnitude.
const SHRINK_Q31: i64 = 1_304_065_748;
/// Bits below the input's last place: inputs are below 2^16, and √2 · 2^16 · 1.647 · 2^13 stays below 2^31.
const GUARD_BITS: u32 = 13;

/// DoLP and AoLP of `[s0, s1, s2]`, each in [−65535, 65535], in any common unit.
///
/// Against exact arithmetic, wherever √(s1² + s2²) >= 64: AoLP within 1.5 units (0.004°), DoLP within 2 units + 2/s0
/// (searched by a test; derivation in docs/NUMERICS.md).
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "each value is bounded just before")]
pub fn polar_form([s0, s1, s2]: [i32; 3]) -> PolarForm {
    if s1 == 0 && s2 == 0 {
        return PolarForm::default();
    }
    let clamp = |s: i32| s.clamp(-65535, 65535) << GUARD_BITS;
    let (mut x, mut y) = (clamp(s1), clamp(s2));
    let mut turn = 0_i32;
    if x < 0 {
        (x, y, turn) = (-x, -y, i32::MIN); // half a turn
    }
    for (i, angle) in (0_u32..).zip(ANGLES) {
        let (dx, dy) = (y >> i, x >> i);
        if y >= 0 {
            (x, y, turn) = (x + dx, y - dy, turn.wrapping_add(angle));
        } else {
            (x, y, turn) = (x - dx, y + dy, turn.wrapping_sub(angle));
        }
    }
    // Round to the nearest 2^−16 turn; the top wraps to 0, as an axis does.
    let aolp_turn16 = (turn.wrapping_add(1 << 15) >> 16) as u16;
    if s0 <= 0 {
        return PolarForm { dolp_q16: 0, aolp_turn16 };
    }
    let magnitude = ((i64::from(x) * SHRINK_Q31) >> 31) as u32;
    PolarForm { dolp_q16: ratio_q16(magnitude, (clamp(s0)) as u32), aolp_turn16 }
}

/// `a / b` in Q0.16 by shift and subtract, 65535 where it is 1 or more. Both below 2^31, b > 0.
fn ratio_q16(a: u32, b: u32) -> u16 {
    if a >= b {
        return u16::MAX;
    }
    let (mut rest, mut quotient) = (a, 0_u16);
    for _ in 0..16 {
        rest <<= 1;
        quotient <<= 1;
        if rest >= b {
            rest -= b;
            quotient |= 1;
        }
    }
    quotient
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{PI, TAU};

    #[test]
    fn constants_are_what_they_say() {
        for (i, angle) in ANGLES.iter().enumerate() {
            let exact = libm::atan(libm::ldexp(1.0, -(i as i32))) / TAU * 4_294_967_296.0;
            assert!((f64::from(*angle) - exact).abs() <= 0.5, "atan 2^-{i}: {exact}");
        }
        let shrink: f64 = (0..17).map(|i| libm::cos(libm::atan(libm::ldexp(1.0, -i)))).product();
        assert!((SHRINK_Q31 as f64 - shrink * 2_147_483_648.0).abs() <= 1.0, "{}", shrink * 2_147_483_648.0);
    }

    #[test]
    fn stays_within_its_bound_all_around() {
        let (mut worst_angle, mut worst_dolp): (f64, f64) = (0.0, 0.0);
        for radius in [64.0, 65.5, 100.0, 999.0, 12_345.0, 46_000.0, 65_535.0_f64] {
            for step in 0..4096 {
                let theta = TAU * f64::from(step) / 4096.0 + 1e-3;
                let (s1, s2) = ((radius * theta.cos()).round() as i32, (radius * theta.sin()).round() as i32);
                for s0 in [(s1.abs().max(s2.abs()) * 3 / 2 + 1).min(65_535), 65_535] {
                    let got = polar_form([s0, s1, s2]);
                    let axis = 0.5 * f64::from(s2).atan2(f64::from(s1));
                    let want = axis.rem_euclid(PI) / PI * 65536.0;
                    let off = (f64::from(got.aolp_turn16) - want + 32768.0).rem_euclid(65536.0) - 32768.0;
                    worst_angle = worst_angle.max(off.abs());
                    let dolp = (f64::from(s1).hypot(f64::from(s2)) / f64::from(s0) * 65536.0).min(65535.0);
                    worst_dolp =
                        worst_dolp.max((f64::from(got.dolp_q16) - dolp).abs() - 2.0 * 65536.0 / f64::from(s0) / 8192.0);
                }
            }
        }
        assert!(worst_angle <= 1.5, "AoLP off by {worst_angle} units");
        assert!(worst_dolp <= 2.0, "DoLP off by {worst_dolp} units");
    }

    #[test]
    fn quadrants_and_darkness() {
        let aolp = |s1, s2| polar_form([1000, s1, s2]).aolp_turn16;
        assert_eq!([aolp(1000, 0), aolp(0, 1000), aolp(-1000, 0), aolp(0, -1000)], [0, 16384, 32768, 49152]);
        assert_eq!(polar_form([0, 0, 0]), PolarForm::default());
        assert_eq!(polar_form([-5, 100, 0]).dolp_q16, 0);
        assert_eq!(polar_form([100, 100, 0]).dolp_q16, 65535);
    }
}
