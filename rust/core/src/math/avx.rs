//! Four robots in an AVX2 register, eight in an AVX-512 one.

use std::arch::x86_64::*;
use std::ops::{BitAnd, BitOr};

use super::wide::wide;
use super::{Mask, Real};

// SAFETY of every block of this file and of the macro: values of these types are made by fleets only, which choose a
// width only after `is_available` has found its instruction set; and a register has the size of its array of lanes and a
// larger alignment.

wide!(
    Wide8(__m512d), 8 lanes, Mask8(__mmask8),
    operators {
        Wide8: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd;
        Mask8: BitAnd bitand BitAnd::bitand, BitOr bitor BitOr::bitor;
    },
    sqrt _mm512_sqrt_pd, multiply_add _mm512_fmadd_pd, negated_multiply_add _mm512_fnmadd_pd,
    max _mm512_max_pd, min _mm512_min_pd, neg(x) _mm512_xor_pd(x, _mm512_set1_pd(-0.0)), not(mask) !mask,
    le(x, y) _mm512_cmp_pd_mask::<_CMP_LE_OQ>(x, y), lt(x, y) _mm512_cmp_pd_mask::<_CMP_LT_OQ>(x, y),
    select(mask, yes, no) _mm512_mask_blend_pd(mask, no, yes),
    features "avx512f,avx512dq"
);

wide!(
    Wide4(__m256d), 4 lanes, Mask4(__m256d),
    operators {
        Wide4: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd;
        Mask4: BitAnd bitand _mm256_and_pd, BitOr bitor _mm256_or_pd;
    },
    sqrt _mm256_sqrt_pd, multiply_add _mm256_fmadd_pd, negated_multiply_add _mm256_fnmadd_pd,
    max _mm256_max_pd, min _mm256_min_pd, neg(x) _mm256_xor_pd(x, _mm256_set1_pd(-0.0)),
    not(mask) _mm256_xor_pd(mask, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))),
    le(x, y) _mm256_cmp_pd::<_CMP_LE_OQ>(x, y), lt(x, y) _mm256_cmp_pd::<_CMP_LT_OQ>(x, y),
    select(mask, yes, no) _mm256_blendv_pd(no, yes, mask),
    features "avx2,fma"
);

impl Wide8 {
    pub fn is_available() -> bool {
        is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
    }
}

impl Wide4 {
    pub fn is_available() -> bool {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
}

impl Mask for Mask8 {
    const LANES: usize = 8;

    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        Self((0..8).fold(0, |bits, lane| bits | __mmask8::from(is_true(lane)) << lane))
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.0 >> lane & 1 == 1
    }
}

// Single lanes by way of memory: the code that sets and reads them is compiled without AVX, where an intrinsic would be a
// call.
impl Mask for Mask4 {
    const LANES: usize = 4;

    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        let bits: [u64; 4] = std::array::from_fn(|lane| if is_true(lane) { u64::MAX } else { 0 });
        unsafe { Self(std::mem::transmute::<[u64; 4], __m256d>(bits)) }
    }

    #[inline(always)]
    fn any(self) -> bool {
        unsafe { _mm256_movemask_pd(self.0) != 0 }
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        unsafe { std::mem::transmute::<__m256d, [u64; 4]>(self.0)[lane] != 0 }
    }
}
