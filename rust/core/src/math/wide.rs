//! Several robots in a vector register.
//!
//! Values of these types may be computed with only where `is_available` has returned true; they are fast only in code
//! inlined into a function with the matching `target_feature`.

// SAFETY of every block of this file: values of these types are made by fleets only, which choose a width only after
// `is_available` has found its instruction set; and a register has the size of its array of lanes and a larger
// alignment.

/// Implements arithmetic and [`Real`](super::Real) of a register; what differs between instruction sets is given as
/// functions and expressions of registers.
macro_rules! wide {
    (
        $wide:ident($register:ty), $lanes:literal lanes, $mask:ident($mask_register:ty),
        operators { $($operand:ident: $($operator:ident $method:ident $operation:path),+;)+ },
        sqrt $sqrt:ident, multiply_add $multiply_add:ident, negated_multiply_add $negated_multiply_add:ident,
        max $max:ident, min $min:ident, neg($x:ident) $neg:expr, not($not_mask:ident) $not:expr,
        le($x_le:ident, $y_le:ident) $le:expr, lt($x_lt:ident, $y_lt:ident) $lt:expr,
        select($test:ident, $yes:ident, $no:ident) $select:expr,
        features $features:literal
    ) => {
        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $wide($register);

        #[derive(Debug, Clone, Copy)]
        #[repr(transparent)]
        pub struct $mask($mask_register);

        $($(
            impl std::ops::$operator for $operand {
                type Output = Self;
                #[allow(unused_unsafe, reason = "some operations are safe")]
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    unsafe { Self($operation(self.0, other.0)) }
                }
            }
        )+)+

        impl std::ops::Neg for $wide {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                let $x = self.0;
                unsafe { Self($neg) }
            }
        }

        impl std::ops::Not for $mask {
            type Output = Self;
            #[allow(unused_unsafe, reason = "some operations are safe")]
            #[inline(always)]
            fn not(self) -> Self {
                let $not_mask = self.0;
                unsafe { Self($not) }
            }
        }

        impl std::ops::AddAssign for $wide {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl std::ops::SubAssign for $wide {
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

        #[allow(unused_unsafe, reason = "instructions that every processor of an architecture has are safe")]
        impl $crate::math::Real for $wide {
            const LANES: usize = $lanes;
            type Mask = $mask;

            #[inline(always)]
            fn splat(x: f64) -> Self {
                // By way of memory, since constants are also made where the instructions are not switched on.
                unsafe { std::mem::transmute::<[f64; $lanes], Self>([x; $lanes]) }
            }

            #[inline(always)]
            fn lane(&self, lane: usize) -> f64 {
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
            fn mul_add(self, factor: Self, summand: Self) -> Self {
                unsafe { Self($multiply_add(self.0, factor.0, summand.0)) }
            }

            #[inline(always)]
            fn subtract_from(self, factor: Self, summand: Self) -> Self {
                unsafe { Self($negated_multiply_add(self.0, factor.0, summand.0)) }
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
                let ($x_le, $y_le) = (self.0, other.0);
                unsafe { $mask($le) }
            }

            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                let ($x_lt, $y_lt) = (self.0, other.0);
                unsafe { $mask($lt) }
            }

            #[inline(always)]
            fn select(mask: $mask, yes: Self, no: Self) -> Self {
                let ($test, $yes, $no) = (mask.0, yes.0, no.0);
                unsafe { Self($select) }
            }

            #[inline(always)]
            fn run<K: $crate::math::Kernel>(kernel: K) -> K::Output {
                #[inline(never)]
                #[target_feature(enable = $features)]
                fn vectorised<K: $crate::math::Kernel>(kernel: K) -> K::Output {
                    kernel.run()
                }
                unsafe { vectorised(kernel) }
            }
        }
    };
}

pub(super) use wide;
