use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

/// Most robots that any [`Real`] holds side by side.
pub const MAX_LANES: usize = 8;

/// A real number, or one for each of several robots.
///
/// Every operation acts on each lane as IEEE arithmetic acts on a single `f64`, and products are fused with sums only by
/// [`Real::mul_add`], in every width alike, so that a robot's result does not depend on the width of the registers it
/// was computed in.
pub trait Real:
    Send
    + Sync
    + Copy
    + Debug
    + PartialEq
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Robots side by side.
    const LANES: usize;
    /// One truth value per lane.
    type Mask: Mask;

    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    fn lane(&self, lane: usize) -> f64;
    fn set_lane(&mut self, lane: usize, x: f64);
    fn sqrt(self) -> Self;
    /// `self factor + summand`, rounded once.
    fn mul_add(self, factor: Self, summand: Self) -> Self;
    /// `summand - self factor`, rounded once.
    #[inline(always)]
    fn subtract_from(self, factor: Self, summand: Self) -> Self {
        (-self).mul_add(factor, summand)
    }
    /// The larger; where one is NaN, `other`.
    fn max(self, other: Self) -> Self;
    /// The smaller; where one is NaN, `other`.
    fn min(self, other: Self) -> Self;
    fn le(self, other: Self) -> Self::Mask;
    fn lt(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }

    /// Runs `kernel` as a function of its own with the instruction set of this type switched on.
    fn run<K: Kernel>(kernel: K) -> K::Output;

    /// The same of a closure, which must be `#[inline(always)]`. Were it not known here that it is called once, the call
    /// would go by way of a function that is not inlined.
    #[inline(always)]
    fn call<R>(kernel: impl FnOnce() -> R) -> R {
        Self::run(Closure(kernel))
    }

    /// (sin x, cos x) to about one unit in the last place, for |x| below 1e6.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        super::trig::sin_cos(self)
    }

    /// arctan x to about two units in the last place.
    #[inline(always)]
    fn arctangent(self) -> Self {
        super::trig::atan(self)
    }
}

/// One truth value per lane.
pub trait Mask: Send + Sync + Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    const LANES: usize;

    /// True in the lanes for which `is_true` returns true.
    fn of(is_true: impl Fn(usize) -> bool) -> Self;
    fn any(self) -> bool;
    fn lane(self, lane: usize) -> bool;
}

/// A computation over lanes; `run` must be `#[inline(always)]`, so that it is compiled for the
/// instruction set it is run with.
pub trait Kernel {
    type Output;
    fn run(self) -> Self::Output;
}

/// The closure of [`Real::call`].
struct Closure<F>(F);

impl<R, F: FnOnce() -> R> Kernel for Closure<F> {
    type Output = R;

    #[inline(always)]
    fn run(self) -> R {
        (self.0)()
    }
}

impl Mask for bool {
    const LANES: usize = 1;

    #[inline(always)]
    fn of(is_true: impl Fn(usize) -> bool) -> Self {
        is_true(0)
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn lane(self, _: usize) -> bool {
        self
    }
}

impl Real for f64 {
    const LANES: usize = 1;
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        *self
    }

    #[inline(always)]
    fn set_lane(&mut self, _: usize, x: f64) {
        *self = x;
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        f64::mul_add(self, factor, summand)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    /// Without fused instructions [`f64::mul_add`] is a function call.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        #[inline(never)]
        #[target_feature(enable = "avx2,fma")]
        fn fused<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }
        #[inline(never)]
        fn plain<K: Kernel>(kernel: K) -> K::Output {
            kernel.run()
        }
        if super::Wide4::is_available() {
            // SAFETY: the processor has both.
            unsafe { fused(kernel) }
        } else {
            plain(kernel)
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    #[inline(never)]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run()
    }
}
