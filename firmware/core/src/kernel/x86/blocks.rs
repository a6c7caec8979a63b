//! 16-bit planes on x86-64: one text for AVX2 and AVX-512, sixteen or thirty-two photosites at a time, frames in pairs.
//!
//! Two frames interleaved are multiplied by two weights and added in one instruction (`madd`); packing 32 to 16 bits
//! saturates. Unpacking and packing both work within 128-bit lanes, so the order comes out as it went in. The
//! samples' differences from dark fit 15 bits wherever the photosite is not handed to the definition; where it is,
//! anything may be computed here, and nothing traps.

/// The twin for one instruction set. In scope must be `Vector`, `LANES` and the operations, named as the intrinsics are.
macro_rules! twin {
    ($features:literal) => {
        use crate::kernel::narrow::{BLOCK, Fast, FastRow, RECOMPUTE};
        use crate::kernel::{Dark, StripInput, StripOutput};
        use core::array;
        use protocol_polar::{Flags, MAX_FRAMES};

        const GROUPS: usize = BLOCK / LANES;
        /// A block of one plane.
        type Block<T> = [[T; LANES]; GROUPS];

        /// Computes whole blocks, marks what the definition must compute, and says whether there is any.
        #[target_feature(enable = $features)]
        pub(in crate::kernel) fn strip(fast: &Fast, input: &StripInput, output: StripOutput<i16, u16>) -> bool {
            match input.frames.len() {
                3 => blocks::<2, 0>(fast, input, output),
                4 => blocks::<2, 1>(fast, input, output),
                5 | 6 => blocks::<3, 2>(fast, input, output),
                7 | 8 => blocks::<4, 2>(fast, input, output),
                9 | 10 => blocks::<5, 2>(fast, input, output),
                11 | 12 => blocks::<6, 2>(fast, input, output),
                13 | 14 => blocks::<7, 2>(fast, input, output),
                _ => blocks::<8, 2>(fast, input, output),
            }
        }

        /// `PAIRS` pairs of frames; `ROWS` residual rows, 2 standing for any number above 1.
        #[target_feature(enable = $features)]
        fn blocks<const PAIRS: usize, const ROWS: usize>(
            fast: &Fast,
            input: &StripInput,
            output: StripOutput<i16, u16>,
        ) -> bool {
            let count = output.flags.len() / BLOCK;
            // A place beyond the last frame holds the first one again: its weight is 0, and the extremes do not change.
            let frames: [[&[Block<u16>]; 2]; PAIRS] = array::from_fn(|p| {
                array::from_fn(|h| &in_blocks(input.frames.get(2 * p + h).unwrap_or(&input.frames[0]))[..count])
            });
            let dark_level = match input.dark {
                Dark::Level(level) => splat_epi16(level as i16),
                Dark::Map(_) => zero(),
            };
            let dark_map = match input.dark {
                Dark::Level(_) => None,
                Dark::Map(map) => Some(&in_blocks(map)[..count]),
            };
            let flat = input.flat.map(|flat| &in_blocks(flat)[..count]);
            let planes = output.stokes.map(|plane| &mut in_blocks_mut(plane)[..count]);
            let residual = &mut in_blocks_mut(output.residual)[..count];
            let flags = &mut in_blocks_mut(output.flags)[..count];

            let rows = fast.stokes_rows().map(|row| Row::<PAIRS>::new(row));
            // As many as can occur: making the others costs what a hundred photosites do.
            let mut more = [rows[0]; MAX_FRAMES - 3];
            for (to, from) in more.iter_mut().zip(fast.residual_rows()) {
                *to = Row::new(from);
            }
            let more = &more[..fast.residual_rows().len()];
            let judge = Judge::new(fast);
            let none = zero();
            let mut marks = none;
            let mut groups = [Group { s0: none, signs: none, rare: none }; GROUPS];
            let mut squares = [none; 2 * GROUPS];
            for b in 0..count {
                for g in 0..GROUPS {
                    let dark = match dark_map {
                        Some(map) => load(&map[b][g]),
                        None => dark_level,
                    };
                    let gain = match flat {
                        Some(flat) => Some(load(&flat[b][g])),
                        None => None,
                    };
                    let (mut brightest, mut signs) = (dark, zero());
                    let (mut low, mut high) = ([dark; PAIRS], [dark; PAIRS]);
                    for p in 0..PAIRS {
                        let (one, two) = (load(&frames[p][0][b][g]), load(&frames[p][1][b][g]));
                        brightest = max_epu16(brightest, max_epu16(one, two));
                        let (one, two) = (sub_epi16(one, dark), sub_epi16(two, dark));
                        signs = or(signs, or(one, two));
                        low[p] = unpacklo_epi16(one, two);
                        high[p] = unpackhi_epi16(one, two);
                    }
                    let mut group = Group { s0: dark, signs, rare: subs_epu16(brightest, judge.below_white) };
                    let mut ends = Ends::none();
                    for (j, row) in rows.iter().enumerate() {
                        let mut s = row.component(&low, &high);
                        ends.see(s);
                        if j == 0 {
                            group.s0 = s;
                        }
                        if let Some(gain) = gain {
                            s = adds_epi16(s, excess(s, gain));
                            ends.see(s);
                        }
                        store_i16(&mut planes[j][b][g], s);
                    }
                    group.rare = or(group.rare, ends.reached());
                    if ROWS == 2 {
                        groups[g] = group;
                        [squares[2 * g], squares[2 * g + 1]] = sum_of_squares(more, &low, &high);
                    } else {
                        let r = if ROWS == 1 { abs_epi16(more[0].component(&low, &high)) } else { none };
                        store_u16(&mut residual[b][g], scaled(r, gain));
                        let found = judge.flags(&group, r);
                        marks = or(marks, found);
                        store_u8(&mut flags[b][g], found);
                    }
                }
                if ROWS == 2 {
                    let roots = roots(&squares);
                    for g in 0..GROUPS {
                        let gain = match flat {
                            Some(flat) => Some(load(&flat[b][g])),
                            None => None,
                        };
                        store_u16(&mut residual[b][g], scaled(roots[g], gain));
                        let found = judge.flags(&groups[g], roots[g]);
                        marks = or(marks, found);
                        store_u8(&mut flags[b][g], found);
                    }
                }
            }
            intersect(marks, splat_epi16(RECOMPUTE.into()))
        }

        /// What is known of sixteen photosites before their residual.
        #[derive(Clone, Copy)]
        struct Group {
            s0: Vector,
            /// Or of all differences from dark.
            signs: Vector,
            /// Not 0 where the definition must compute.
            rare: Vector,
        }

        /// Which values have reached an end of their word, and may have been clamped.
        struct Ends(Vector);

        impl Ends {
            #[inline]
            #[target_feature(enable = $features)]
            fn none() -> Self {
                Self(splat_epi16(-1))
            }

            /// The offset brings the largest value to 0 and the smallest to 1.
            #[inline]
            #[target_feature(enable = $features)]
            fn see(&mut self, s: Vector) {
                self.0 = min_epu16(self.0, add_epi16(s, splat_epi16(-0x7FFF)));
            }

            /// Not 0 where one has.
            #[inline]
            #[target_feature(enable = $features)]
            fn reached(&self) -> Vector {
                subs_epu16(splat_epi16(2), self.0)
            }
        }

        /// Makes flag bytes.
        struct Judge {
            below_white: Vector,
            floor: Vector,
            /// Minus the whole part of the slope.
            slope: Vector,
            /// The slope's eight fractional bits in the upper half of each pair.
            slope_fraction: Vector,
        }

        impl Judge {
            #[target_feature(enable = $features)]
            fn new(fast: &Fast) -> Self {
                Self {
                    below_white: splat_epi16(fast.white.wrapping_sub(1) as i16),
                    floor: splat_epi32(fast.misfit_floor),
                    slope: splat_epi16(-(fast.misfit_slope >> 8) as i16), // 9 bits
                    slope_fraction: splat_epi32((fast.misfit_slope & 0xFF) << 16),
                }
            }

            /// Flags of sixteen photosites with residual `r` before the flat.
            #[inline]
            #[target_feature(enable = $features)]
            fn flags(&self, group: &Group, r: Vector) -> Vector {
                let s0 = max_epi16(group.s0, zero());
                let over = |r_s0, r_slope| {
                    // r² − s0 · whole slope − (s0 · fraction >> 8): the slope's parts multiply apart, so the shift loses the same.
                    let fraction = srli_epi32::<8>(madd_epi16(r_s0, self.slope_fraction));
                    cmpgt_epi32(sub_epi32(madd_epi16(r_s0, r_slope), fraction), self.floor)
                };
                let misfit = packs_epi32(
                    over(unpacklo_epi16(r, s0), unpacklo_epi16(r, self.slope)),
                    over(unpackhi_epi16(r, s0), unpackhi_epi16(r, self.slope)),
                );
                let below = srai_epi16::<15>(group.signs);
                // A residual that reaches the end of 15 bits is rare as well.
                let rare = or(group.rare, subs_epu16(r, splat_epi16(i16::MAX - 1)));
                let common = cmpeq_epi16(rare, zero());
                let flag = |flag: u8| splat_epi16(flag.into());
                or(
                    andnot(common, flag(RECOMPUTE)),
                    or(and(misfit, flag(Flags::MISFIT.0)), and(below, flag(Flags::BELOW_BLACK.0))),
                )
            }
        }

        /// s · (gain − 1), rounded as s · gain is: 32768 is gain 1, so s · gain / 32768 is s and this.
        #[inline]
        #[target_feature(enable = $features)]
        fn excess(s: Vector, gain: Vector) -> Vector {
            mulhrs_epi16(s, xor(gain, splat_epi16(i16::MIN)))
        }

        /// A residual of 15 bits times the gain: below 2¹⁶.
        #[inline]
        #[target_feature(enable = $features)]
        fn scaled(r: Vector, gain: Option<Vector>) -> Vector {
            match gain {
                Some(gain) => add_epi16(r, excess(r, gain)),
                None => r,
            }
        }

        /// `plane` in whole blocks.
        fn in_blocks<T>(plane: &[T]) -> &[Block<T>] {
            plane.as_chunks().0.as_chunks().0
        }

        fn in_blocks_mut<T>(plane: &mut [T]) -> &mut [Block<T>] {
            plane.as_chunks_mut().0.as_chunks_mut().0
        }
    };
}
pub(super) use twin;
