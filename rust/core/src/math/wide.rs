//! Four robots in an AVX2 register, eight in an AVX-512 one.
//!
//! Values of these types may be computed with only where `is_available` has returned true; they are fast only in code
//! inlined into a function with the matching `target_feature`.

use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use super::{Kernel, Mask, Real};

// SAFETY of every block of this file: values of these types are made by fleets only, which choose a width only after
// `is_available` has found its instruction set; and a register has the size of its array of lanes and a larger
// alignment.

/// Implements arithmetic and [`Real`] but for what differs between AVX2 and AVX-512: comparisons and
/// selection, given as closures over registers.
macro_rules! wide {
    (
        $wide:ident($register:ty), $lanes:literal lanes, $mask:ident($mask_register:ty),
        add $add:ident, sub $sub:ident, mul $mul:ident, div $div:ident, xor $xor:ident, set $set:ident,
        sqrt $sqrt:ident, max $max:ident, min $min:ident, compare $compare:ident, select $select:expr,
        features $features:literal
    ) => {
        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $wide($register);

        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $mask($mask_register);

        impl Add for $wide {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                unsafe { Self($add(self.0, other.0)) }
            }
        }

        impl Sub for $wide {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                unsafe { Self($sub(self.0, other.0)) }
            }
        }

        impl Mul for $wide {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                unsafe { Self($mul(self.0, other.0)) }
            }
        }

        impl Div for $wide {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                unsafe { Self($div(self.0, other.0)) }
            }
        }

        impl Neg for $wide {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                unsafe { Self($xor(self.0, $set(-0.0))) }
            }
        }

        impl AddAssign for $wide {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl SubAssign for $wide {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl PartialEq for $wide {
            fn eq(&self, other: &Self) -> bool {
                (0..$lanes).all(|lane| self.lane(lane) == other.lane(lane))
            }
        }

        impl Real for $wide {
            const LANES: usize = $lanes;
            type Mask = $mask;

            #[inline(always)]
            fn splat(x: f64) -> Self {
                unsafe { Self($set(x)) }
            }

            #[inline(always)]
            fn lane(self, lane: usize) -> f64 {
                unsafe { (*(&raw const self.0).cast::<[f64; $lanes]>())[lane] }
            }

            #[inline(always)]
            fn set_lane(&mut self, lane: usize, x: f64) {
                unsafe { (*(&raw mut self.0).cast::<[f64; $lanes]>())[lane] = x }
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                unsafe { Self($sqrt(self.0)) }
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                unsafe { Self($max(self.0, other.0)) }
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                unsafe { Self($min(self.0, other.0)) }
            }

            #[inline(always)]
            fn le(self, other: Self) -> $mask {
                unsafe { $mask($compare::<_CMP_LE_OQ>(self.0, other.0)) }
            }

            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                unsafe { $mask($compare::<_CMP_LT_OQ>(self.0, other.0)) }
            }

            #[inline(always)]
            fn select(mask: $mask, yes: Self, no: Self) -> Self {
                unsafe { Self($select(mask.0, yes.0, no.0)) }
            }

            #[inline(always)]
            fn run<K: Kernel>(kernel: K) -> K::Output {
                #[target_feature(enable = $features)]
                fn vectorised<K: Kernel>(kernel: K) -> K::Output {
                    kernel.run()
                }
                unsafe { vectorised(kernel) }
            }
        }
    };
}

wide!(
    Wide8(__m512d), 8 lanes, Mask8(__mmask8),
    add _mm512_add_pd, sub _mm512_sub_pd, mul _mm512_mul_pd, div _mm512_div_pd, xor _mm512_xor_pd,
    set _mm512_set1_pd, sqrt _mm512_sqrt_pd, max _mm512_max_pd, min _mm512_min_pd,
    compare _mm512_cmp_pd_mask, select |mask, yes, no| _mm512_mask_blend_pd(mask, no, yes),
    features "avx512f,avx512dq"
);

wide!(
    Wide4(__m256d), 4 lanes, Mask4(__m256d),
    add _mm256_add_pd, sub _mm256_sub_pd, mul _mm256_mul_pd, div _mm256_div_pd, xor _mm256_xor_pd,
    set _mm256_set1_pd, sqrt _mm256_sqrt_pd, max _mm256_max_pd, min _mm256_min_pd,
    compare _mm256_cmp_pd, select |mask, yes, no| _mm256_blendv_pd(no, yes, mask),
    features "avx2"
);

impl Wide8 {
    pub fn is_available() -> bool {
        is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq")
    }
}

impl Wide4 {
    pub fn is_available() -> bool {
        is_x86_feature_detected!("avx2")
    }
}

impl BitAnd for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for Mask8 {
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

impl BitAnd for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        unsafe { Self(_mm256_and_pd(self.0, other.0)) }
    }
}

impl BitOr for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        unsafe { Self(_mm256_or_pd(self.0, other.0)) }
    }
}

impl Not for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        unsafe { Self(_mm256_xor_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(-1)))) }
    }
}

impl Mask for Mask4 {
    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        let bits = |lane: usize| if is_true(lane) { -1 } else { 0 };
        unsafe { Self(_mm256_castsi256_pd(_mm256_set_epi64x(bits(3), bits(2), bits(1), bits(0)))) }
    }

    #[inline(always)]
    fn any(self) -> bool {
        unsafe { _mm256_movemask_pd(self.0) != 0 }
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        unsafe { _mm256_movemask_pd(self.0) >> lane & 1 == 1 }
    }
}
