//! DoLP and AoLP from integers, for previews: CORDIC, no float, no division, no table of angles larger than 17 entries.
//!
//! Volder 1959, "The CORDIC trigonometric computing technique", vectoring mode. The AoLP is half the angle of (s1, s2), so
//! its 16-bit turn covers 180°.

use super::simd;

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
const SHRINK_Q31: u64 = 1_304_065_748;
/// Bits below the input's last place: inputs are below 2^16, and √2 · 2^16 · 1.647 · 2^13 stays below 2^31.
const GUARD_BITS: u32 = 13;

/// DoLP and AoLP of `[s0, s1, s2]`, each in [−65535, 65535], in any common unit.
///
/// Against exact arithmetic, with r = √(s1² + s2²) in units of the input: AoLP within 0.66 + 36.5/r units, DoLP within
/// 1 + 128/s0 units (derived in docs/NUMERICS.md, searched by a test).
#[must_use]
pub fn polar_form(stokes: [i32; 3]) -> PolarForm {
    vectoring(stokes.map(|s| s.clamp(-65535, 65535)))
}

/// [`polar_form`] of each photosite of 16-bit planes, vectorized: same bits. `dolp` and `aolp` get
/// [`PolarForm::dolp_q16`] and [`PolarForm::aolp_turn16`].
///
/// All five slices have one value per photosite, row-major; if one is shorter, the rest of the others is left alone.
pub fn polar_form_strip([s0, s1, s2]: [&[i16]; 3], dolp: &mut [u16], aolp: &mut [u16]) {
    simd::widest(
        #[inline(always)]
        || {
            let planes = s0.iter().zip(s1).zip(s2).zip(dolp).zip(aolp);
            for ((((s0, s1), s2), dolp), aolp) in planes {
                let form = vectoring([(*s0).into(), (*s1).into(), (*s2).into()]);
                (*dolp, *aolp) = (form.dolp_q16, form.aolp_turn16);
            }
        },
    );
}

/// The rotation and the ratio, of numbers in [−65535, 65535]. Choices instead of branches and loops of fixed length: the
/// compiler makes one vector loop of the whole.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "each value is bounded just before")]
fn vectoring([s0, s1, s2]: [i32; 3]) -> PolarForm {
    let behind = s1 < 0;
    let mut x = s1.abs() << GUARD_BITS;
    let mut y = (if behind { -s2 } else { s2 }) << GUARD_BITS;
    let mut turn = if behind { i32::MIN } else { 0 }; // half a turn
    for (i, angle) in (0_u32..).zip(ANGLES) {
        let (dx, dy) = (y >> i, x >> i);
        let up = y >= 0;
        x = if up { x + dx } else { x - dx };
        y = if up { y - dy } else { y + dy };
        turn = turn.wrapping_add(if up { angle } else { -angle });
    }
    // Round to the nearest 2^−16 turn; the top wraps to 0, as an axis does.
    let aolp_turn16 = (turn.wrapping_add(1 << 15) >> 16) as u16;
    let magnitude = ((u64::from(x as u32) * SHRINK_Q31) >> 31) as u32;
    let dolp_q16 = ratio_q16(magnitude, (s0.max(0) << GUARD_BITS) as u32);
    PolarForm {
        dolp_q16: if s0 <= 0 || s1 | s2 == 0 { 0 } else { dolp_q16 },
        aolp_turn16: if s1 | s2 == 0 { 0 } else { aolp_turn16 },
    }
}

/// `a / b` in Q0.16 by shift and subtract, 65535 where it is 1 or more. Both below 2^31; any number if b is 0.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "sixteen bits were pushed")]
fn ratio_q16(a: u32, b: u32) -> u16 {
    let (mut rest, mut quotient) = (a, 0_u32);
    for _ in 0..16 {
        let double = rest << 1;
        // What is too small to subtract from wraps to the larger number.
        rest = double.min(double.wrapping_sub(b));
        quotient = quotient << 1 | u32::from(rest != double);
    }
    if a >= b { u16::MAX } else { quotient as u16 }
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
        for radius in [3.0, 20.0, 64.0, 65.5, 100.0, 999.0, 12_345.0, 46_000.0, 65_535.0_f64] {
            for step in 0..4096 {
                let theta = TAU * f64::from(step) / 4096.0 + 1e-3;
                let (s1, s2) = ((radius * theta.cos()).round() as i32, (radius * theta.sin()).round() as i32);
                for s0 in [(s1.abs().max(s2.abs()) * 3 / 2 + 1).min(65_535), 65_535] {
                    let got = polar_form([s0, s1, s2]);
                    let axis = 0.5 * f64::from(s2).atan2(f64::from(s1));
                    let want = axis.rem_euclid(PI) / PI * 65536.0;
                    let off = (f64::from(got.aolp_turn16) - want + 32768.0).rem_euclid(65536.0) - 32768.0;
                    let r = f64::from(s1).hypot(f64::from(s2));
                    worst_angle = worst_angle.max(off.abs() / (0.66 + 36.5 / r));
                    let dolp = (r / f64::from(s0) * 65536.0).min(65535.0);
                    let bound = 1.0 + 128.0 / f64::from(s0);
                    worst_dolp = worst_dolp.max((f64::from(got.dolp_q16) - dolp).abs() / bound);
                }
            }
        }
        assert!(worst_angle <= 1.0, "AoLP off by {worst_angle} of its bound");
        assert!(worst_dolp <= 1.0, "DoLP off by {worst_dolp} of its bound");
        assert!(worst_angle > 0.5 && worst_dolp > 0.5, "a bound that is never approached says nothing");
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
