//! Between slices and registers: the only `unsafe` of the x86-64 kernel beside the calls in `simd`.

/// Loads and stores for one instruction set. In scope must be `Vector`, `Half`, `LANES` and `low_bytes`.
macro_rules! memory {
    ($features:literal) => {
        #[inline]
        #[target_feature(enable = $features)]
        fn load(from: &[u16; LANES]) -> Vector {
            // SAFETY: both types have this size, and every bit pattern is a value of both.
            #[expect(unsafe_code, reason = "the vector type has no safe conversion")]
            unsafe {
                core::mem::transmute::<[u16; LANES], Vector>(*from)
            }
        }

        #[inline]
        #[target_feature(enable = $features)]
        fn store_i16(to: &mut [i16; LANES], values: Vector) {
            // SAFETY: both types have this size, and every bit pattern is a value of both.
            #[expect(unsafe_code, reason = "the vector type has no safe conversion")]
            let values = unsafe { core::mem::transmute::<Vector, [i16; LANES]>(values) };
            *to = values;
        }

        #[inline]
        #[target_feature(enable = $features)]
        fn store_u16(to: &mut [u16; LANES], values: Vector) {
            // SAFETY: both types have this size, and every bit pattern is a value of both.
            #[expect(unsafe_code, reason = "the vector type has no safe conversion")]
            let values = unsafe { core::mem::transmute::<Vector, [u16; LANES]>(values) };
            *to = values;
        }

        /// Stores values below 256.
        #[inline]
        #[target_feature(enable = $features)]
        fn store_u8(to: &mut [u8; LANES], values: Vector) {
            // SAFETY: both types have this size, and every bit pattern is a value of both.
            #[expect(unsafe_code, reason = "the vector type has no safe conversion")]
            let values = unsafe { core::mem::transmute::<Half, [u8; LANES]>(low_bytes(values)) };
            *to = values;
        }
    };
}
pub(super) use memory;
