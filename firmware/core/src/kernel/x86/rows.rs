//! Rows of weights times differences, and the root of the sum of squares, for one instruction set.

/// In scope must be `Vector`, `GROUPS`, `FastRow`, `array` and the operations, named as the intrinsics are.
macro_rules! rows {
    ($features:literal) => {
        /// One row: weights in pairs, rounding constant, shift, each for every lane.
        #[derive(Clone, Copy)]
        struct Row<const PAIRS: usize> {
            q: [Vector; PAIRS],
            half: Vector,
            shift: Vector,
        }

        impl<const PAIRS: usize> Row<PAIRS> {
            #[target_feature(enable = $features)]
            fn new(row: &FastRow) -> Self {
                let pair =
                    |p: usize| i32::from(row.q[2 * p] as u16 as i16) & 0xFFFF | i32::from(row.q[2 * p + 1]) << 16;
                Self {
                    q: array::from_fn(|p| splat_epi32(pair(p))),
                    half: splat_epi32(row.half),
                    shift: splat_epi32(row.shift as i32),
                }
            }

            /// (Σ q_k (x_k − dark) + ½) >> shift, clamped to 16 bits.
            #[inline]
            #[target_feature(enable = $features)]
            fn component(&self, low: &[Vector; PAIRS], high: &[Vector; PAIRS]) -> Vector {
                let (mut l, mut h) = (self.half, self.half);
                for p in 0..PAIRS {
                    l = add_epi32(l, madd_epi16(low[p], self.q[p]));
                    h = add_epi32(h, madd_epi16(high[p], self.q[p]));
                }
                packs_epi32(srav_epi32(l, self.shift), srav_epi32(h, self.shift))
            }
        }

        /// Squares of all residual rows, low and high photosites of a group as unpacked; clamped to 2³⁰.
        #[inline]
        #[target_feature(enable = $features)]
        fn sum_of_squares<const PAIRS: usize>(
            rows: &[Row<PAIRS>],
            low: &[Vector; PAIRS],
            high: &[Vector; PAIRS],
        ) -> [Vector; 2] {
            let zero = zero();
            let (mut l, mut h) = (zero, zero);
            for two in rows.chunks(2) {
                let one = two[0].component(low, high);
                let other = match two.get(1) {
                    Some(row) => row.component(low, high),
                    None => zero,
                };
                // At most 2³¹ from two squares and 2³⁰ from before: an unsigned word holds it.
                let square = |pair| madd_epi16(pair, pair);
                let limit = splat_epi32(1 << 30);
                l = min_epu32(add_epi32(l, square(unpacklo_epi16(one, other))), limit);
                h = min_epu32(add_epi32(h, square(unpackhi_epi16(one, other))), limit);
            }
            [l, h]
        }

        /// Integer roots, bit by bit from the highest that any of the block has; the largest, 32767, stands for all above as well.
        #[inline]
        #[target_feature(enable = $features)]
        fn roots(squares: &[Vector; 2 * GROUPS]) -> [Vector; GROUPS] {
            let mut bits_used = zero();
            for square in squares {
                bits_used = or(bits_used, *square);
            }
            let mut roots = [zero(); 2 * GROUPS];
            for shift in (0..15).rev() {
                if !intersect(bits_used, splat_epi32(-1 << (2 * shift))) {
                    continue; // every square is below this bit's
                }
                let bit = splat_epi32(1 << shift);
                for i in 0..2 * GROUPS {
                    let trial = or(roots[i], bit);
                    let too_large = cmpgt_epi32(madd_epi16(trial, trial), squares[i]);
                    roots[i] = or(roots[i], andnot(too_large, bit));
                }
            }
            let mut packed = [zero(); GROUPS];
            for (packed, [low, high]) in packed.iter_mut().zip(roots.as_chunks().0) {
                *packed = packs_epi32(*low, *high);
            }
            packed
        }
    };
}
pub(super) use rows;
