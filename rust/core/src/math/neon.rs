//! Two robots in a NEON register, which every 64-bit ARM processor has; robots are stepped in pairs of registers.

use std::arch::aarch64::*;

use super::wide::wide;
use super::{Mask, Pair, Real};

// SAFETY of every block of this file and of the macro: the instructions are part of the architecture, and a register has
// the size and the alignment of its array of lanes.

/// Four robots.
pub type Wide4 = Pair<Wide2>;

wide!(
    Wide2(float64x2_t), 2 lanes, Mask2(uint64x2_t),
    operators {
        Wide2: Add add vaddq_f64, Sub sub vsubq_f64, Mul mul vmulq_f64, Div div vdivq_f64;
        Mask2: BitAnd bitand vandq_u64, BitOr bitor vorrq_u64;
    },
    sqrt vsqrtq_f64, multiply_add multiply_add, negated_multiply_add negated_multiply_add, max larger, min smaller,
    neg(x) vnegq_f64(x), not(mask) veorq_u64(mask, vdupq_n_u64(u64::MAX)),
    le(x, y) vcleq_f64(x, y), lt(x, y) vcltq_f64(x, y),
    select(mask, yes, no) vbslq_f64(mask, yes, no),
    features "neon"
);

#[inline(always)]
fn multiply_add(x: float64x2_t, y: float64x2_t, summand: float64x2_t) -> float64x2_t {
    unsafe { vfmaq_f64(summand, x, y) }
}

#[inline(always)]
fn negated_multiply_add(x: float64x2_t, y: float64x2_t, summand: float64x2_t) -> float64x2_t {
    unsafe { vfmsq_f64(summand, x, y) }
}

/// As on x86: where one is NaN, the second.
#[inline(always)]
fn larger(x: float64x2_t, y: float64x2_t) -> float64x2_t {
    unsafe { vbslq_f64(vcgtq_f64(x, y), x, y) }
}

/// As on x86: where one is NaN, the second.
#[inline(always)]
fn smaller(x: float64x2_t, y: float64x2_t) -> float64x2_t {
    unsafe { vbslq_f64(vcltq_f64(x, y), x, y) }
}

impl Wide4 {
    pub fn is_available() -> bool {
        true
    }
}

impl Mask2 {
    #[inline(always)]
    fn bits(self) -> [u64; 2] {
        unsafe { [vgetq_lane_u64::<0>(self.0), vgetq_lane_u64::<1>(self.0)] }
    }
}

impl Mask for Mask2 {
    const LANES: usize = 2;

    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        let bits = |lane: usize| if is_true(lane) { u64::MAX } else { 0 };
        unsafe { Self(vsetq_lane_u64::<1>(bits(1), vdupq_n_u64(bits(0)))) }
    }

    #[inline(always)]
    fn any(self) -> bool {
        let [first, second] = self.bits();
        first | second != 0
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.bits()[lane] != 0
    }
}
