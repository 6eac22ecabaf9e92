//! Two registers side by side: their chains of dependent operations fill each other's waiting times.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use super::{Kernel, Mask, Real};

/// The lanes of two registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair<T>([T; 2]);

impl<T: Copy> Pair<T> {
    #[inline(always)]
    fn map(self, f: impl Fn(T) -> T) -> Self {
        let [first, second] = self.0;
        Self([f(first), f(second)])
    }

    #[inline(always)]
    fn zip<U: Copy, V>(self, other: Pair<U>, f: impl Fn(T, U) -> V) -> Pair<V> {
        let ([a, b], [c, d]) = (self.0, other.0);
        Pair([f(a, c), f(b, d)])
    }
}

/// Operators that act on either register.
macro_rules! each {
    ($bound:ident: $($operator:ident $method:ident),+) => {
        $(impl<T: $bound> $operator for Pair<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, T::$method)
            }
        })+
    };
}

each!(Real: Add add, Sub sub, Mul mul, Div div);
each!(Mask: BitAnd bitand, BitOr bitor);

impl<T: Real> Neg for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(T::neg)
    }
}

impl<M: Mask> Not for Pair<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self.map(M::not)
    }
}

impl<T: Real> AddAssign for Pair<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Pair<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Real for Pair<T> {
    const LANES: usize = 2 * T::LANES;
    type Mask = Pair<T::Mask>;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([T::splat(x); 2])
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane / T::LANES].lane(lane % T::LANES)
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, x: f64) {
        self.0[lane / T::LANES].set_lane(lane % T::LANES, x);
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(T::sqrt)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        let ([a, b], [c, d], [e, f]) = (self.0, factor.0, summand.0);
        Self([a.mul_add(c, e), b.mul_add(d, f)])
    }

    #[inline(always)]
    fn subtract_from(self, factor: Self, summand: Self) -> Self {
        let ([a, b], [c, d], [e, f]) = (self.0, factor.0, summand.0);
        Self([a.subtract_from(c, e), b.subtract_from(d, f)])
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, T::max)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, T::min)
    }

    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.zip(other, T::le)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.zip(other, T::lt)
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let ([m, n], [a, b], [c, d]) = (mask.0, yes.0, no.0);
        Self([T::select(m, a, c), T::select(n, b, d)])
    }

    #[inline(always)]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        T::run(kernel)
    }
}

impl<M: Mask> Mask for Pair<M> {
    const LANES: usize = 2 * M::LANES;

    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        Self([M::of(&is_true), M::of(|lane| is_true(lane + M::LANES))])
    }

    #[inline(always)]
    fn any(self) -> bool {
        (self.0[0] | self.0[1]).any()
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.0[lane / M::LANES].lane(lane % M::LANES)
    }
}
