//! Anderson acceleration (1965) of the fixed point of the friction radii: where each takes the radius that belongs to its
//! normal impulse, errors may shrink slowly or grow. The last moves tell how errors change with the radii; the next one
//! goes where that would leave the least.

use crate::math::{Mask, Real};

/// Moves that are remembered: the projection below is that onto a plane.
const DEPTH: usize = 2;

/// What is known of a solve's friction radii.
pub(super) struct Anderson<T: Real> {
    radii: Vec<Tracked<T>>,
    /// Lanes in which radii have been compared before.
    begun: T::Mask,
    /// Multiples theta of the last changes that are taken back, the latest first.
    taken_back: [T; DEPTH],
    /// Share of the error that is left by the combination by which radii go on.
    mixing: f64,
}

/// A radius when it was last compared with the wanted one, all \[N s\].
#[derive(Debug, Clone, Copy)]
struct Tracked<T> {
    wanted: T,
    /// By how much the radius was to grow.
    error: T,
    /// How both changed by the last moves, the latest first.
    changes: [Change<T>; DEPTH],
}

#[derive(Debug, Clone, Copy)]
struct Change<T> {
    wanted: T,
    error: T,
}

impl<T: Real> Anderson<T> {
    /// With room for so many friction discs.
    pub fn new(discs: usize, mixing: f64) -> Self {
        let radii = Vec::with_capacity(discs);
        Self { radii, begun: T::Mask::of(|_| false), taken_back: [T::zero(); DEPTH], mixing }
    }

    /// Forgets all.
    #[inline(always)]
    pub fn start(&mut self) {
        self.radii.clear();
        self.begun = T::Mask::of(|_| false);
    }

    /// Compares radii from number `first` on with those of the normal impulses, which stand beside them \[N s\], in the given
    /// lanes.
    #[inline(always)]
    pub fn compare<'a>(&mut self, first: usize, radii: impl IntoIterator<Item = (&'a mut T, T)>, lanes: T::Mask)
    where
        T: 'a,
    {
        let known = lanes & self.begun;
        for (k, (present, wanted)) in (first..).zip(radii) {
            if k == self.radii.len() {
                self.radii.push(Tracked::unknown());
            }
            let (radius, error) = (&mut self.radii[k], wanted - *present);
            let latest = Change { wanted: wanted - radius.wanted, error: error - radius.error };
            for (older, newer) in [(1, radius.changes[0]), (0, latest)] {
                let change = &mut radius.changes[older];
                change.wanted = T::select(known, newer.wanted, change.wanted);
                change.error = T::select(known, newer.error, change.error);
            }
            radius.wanted = T::select(lanes, wanted, radius.wanted);
            radius.error = T::select(lanes, error, radius.error);
        }
    }

    /// Moves radii from number `first` on, once all are compared and [combined](Self::combine).
    #[inline(always)]
    pub fn go<'a>(&self, first: usize, radii: impl IntoIterator<Item = (&'a mut T, T)>, lanes: T::Mask)
    where
        T: 'a,
    {
        let [first_theta, second_theta] = self.taken_back;
        for ((present, _), Tracked { wanted, error, changes: [latest, older] }) in
            radii.into_iter().zip(&self.radii[first..])
        {
            let wanted = second_theta.subtract_from(older.wanted, first_theta.subtract_from(latest.wanted, *wanted));
            let error = second_theta.subtract_from(older.error, first_theta.subtract_from(latest.error, *error));
            let next = T::splat(1.0 - self.mixing).subtract_from(error, wanted).max(T::zero());
            *present = T::select(lanes, next, *present);
        }
    }

    /// The multiples theta of the last changes that minimise |e - theta_1 Delta e_1 - theta_2 Delta e_2|, by orthogonal
    /// projection. Changes that are not known, of round-off, or no more than a multiple of another one, have none.
    #[inline(always)]
    pub fn combine(&mut self, lanes: T::Mask) {
        let zero = T::zero();
        let (mut latest, mut mixed, mut older) = (zero, zero, zero);
        let (mut error_latest, mut error_older, mut squared_error) = (zero, zero, zero);
        for Tracked { error, changes: [newer, old], .. } in &self.radii {
            latest = newer.error.mul_add(newer.error, latest);
            mixed = newer.error.mul_add(old.error, mixed);
            older = old.error.mul_add(old.error, older);
            error_latest = newer.error.mul_add(*error, error_latest);
            error_older = old.error.mul_add(*error, error_older);
            squared_error = error.mul_add(*error, squared_error);
        }
        let noise = T::splat(ROUND_OFF) * squared_error;
        let slope = T::select(noise.lt(latest), mixed / latest, zero);
        let rest = slope.subtract_from(mixed, older);
        let independent = (T::splat(DEPENDENT) * older).max(noise).lt(rest);
        let second = T::select(independent, slope.subtract_from(error_latest, error_older) / rest, zero);
        let first = T::select(noise.lt(latest), mixed.subtract_from(second, error_latest) / latest, zero);
        self.taken_back = [first, second];
        self.begun = self.begun | lanes;
    }
}

impl<T: Real> Tracked<T> {
    #[inline(always)]
    fn unknown() -> Self {
        let zero = T::zero();
        Self { wanted: zero, error: zero, changes: [Change { wanted: zero, error: zero }; DEPTH] }
    }
}

/// Square of the sine of the angle between two changes below which the older one counts as a multiple of the latest.
const DEPENDENT: f64 = 1e-8;

/// Square of a change over that of the error below which round-off may have made it: a radius that stays at zero changes
/// nothing, and multiples of such changes would be as large as they are arbitrary.
const ROUND_OFF: f64 = 1e-20;

#[cfg(test)]
mod tests {
    use super::*;

    /// Radii after a move of each, towards those that `wanted` returns.
    fn moved(anderson: &mut Anderson<f64>, mut radii: [f64; 2], wanted: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
        let wanted = wanted(radii);
        anderson.compare(0, radii.iter_mut().zip(wanted), true);
        anderson.combine(true);
        anderson.go(0, radii.iter_mut().zip(wanted), true);
        radii
    }

    /// Wanted radii x* + A (x - x*) with |eigenvalues of A| = 1.4, from which plain iteration goes away.
    fn repelled([x, y]: [f64; 2]) -> [f64; 2] {
        let (x, y) = (x - 100.0, y - 100.0);
        [100.0 + 0.2 * x - 1.5 * y, 100.0 + 1.2 * x + 0.3 * y]
    }

    #[test]
    fn two_radii_with_linear_errors_are_found_by_three_moves() {
        for mixing in [0.5, 1.0] {
            let (mut anderson, mut radii) = (Anderson::new(2, mixing), [101.0, 100.5]);
            for _ in 0..3 {
                radii = moved(&mut anderson, radii, repelled);
            }
            assert!(radii.iter().all(|radius| (radius - 100.0).abs() < 1e-9), "mixing {mixing}: {radii:?}");
        }
    }

    #[test]
    fn errors_that_never_change_and_radii_below_zero_are_harmless() {
        let (mut anderson, mut radii) = (Anderson::new(2, 1.0), [1.0, 2.0]);
        for _ in 0..5 {
            radii = moved(&mut anderson, radii, |[x, y]| [x + 1.0, y - 1.0]);
            assert!(radii.iter().all(|radius| radius.is_finite() && *radius >= 0.0), "{radii:?}");
        }
    }

    #[test]
    fn changes_of_round_off_tell_nothing() {
        let mut anderson = Anderson::new(2, 0.5);
        let mut radii = [0.0; 2];
        for wanted in [[0.1, 0.2], [0.1 + f64::EPSILON * 0.1, 0.2]] {
            radii = moved(&mut anderson, [0.0; 2], |_| wanted);
        }
        assert!((radii[0] - 0.05).abs() < 1e-9 && (radii[1] - 0.1).abs() < 1e-9, "{radii:?}");
    }

    #[test]
    fn a_new_solve_knows_nothing_of_the_last_one() {
        let mut used = Anderson::new(2, 0.5);
        let mut radii = [101.0, 100.5];
        for _ in 0..2 {
            radii = moved(&mut used, radii, repelled);
        }
        used.start();
        let again = moved(&mut used, [101.0, 100.5], repelled);
        assert_eq!(again, moved(&mut Anderson::new(2, 0.5), [101.0, 100.5], repelled));
    }
}
