//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! A link has the twist x_i = X x_{i-1} + S_h phi_h' + S_v phi_v', with X the shift from one CG to the next. Given the
//! minimum V_{i+1}(x_{i+1}) of the chain behind it, a quadratic of six variables, minimising over the two rates of a
//! joint is two scalar pivots, and a shift leaves V_i of the same form: the articulated body inertia, or the Riccati
//! recursion of linear-quadratic control. All vectors are along the axes of frame I, so that no rotation is needed.

use nalgebra::Vector3;

use crate::math::Real;
use crate::robot::Axes;

use crate::spatial::spatial_vector::{
    Momentum, SpatialVector, Twist, Wrench, along, inner, scaled, sum, sum_with_cross, zero_vector,
};

/// Symmetric 3 x 3 matrix.
#[derive(Debug, Clone, Copy)]
pub(super) struct Symmetric<T> {
    pub xx: T,
    pub xy: T,
    pub xz: T,
    pub yy: T,
    pub yz: T,
    pub zz: T,
}

/// `g . x + x^T H x / 2` of a twist x.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic<T> {
    pub linear: Symmetric<T>,
    /// Rows of the block that couples v (rows) with omega (columns).
    pub mixed: [Vector3<T>; 3],
    pub angular: Symmetric<T>,
    pub gradient: Momentum<T>,
}

/// Result of eliminating one rate, for the back substitution: `rate = row . x + constant`, x the twist of the link before.
/// A rate that is no unknown has zeros.
#[derive(Debug, Clone, Copy)]
struct Elimination<T> {
    row: SpatialVector<T>,
    constant: T,
    /// 1 / pivot.
    inverse: T,
}

/// A link in the chain: its position, and the elimination of the joint before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment<T> {
    /// The axis of a joint that has one, the same in all lanes. The rate about another is no unknown: it is zero.
    only: Option<usize>,
    /// From the CG of the link before to this one's.
    shift: Vector3<T>,
    /// S_h, S_v.
    hinge: [Twist<T>; 2],
    elimination: [Elimination<T>; 2],
    /// How much the pitch rate follows the yaw rate: both are found from the twist before at once.
    pitch_by_yaw: T,
    /// What an addition to the gradient adds to the constants.
    pub correction: [T; 2],
}

/// Stiffness of a joint's actuator against its rate, and its impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorModel<T> {
    pub stiffness: T,
    pub impulse: T,
}

impl<T: Real> Symmetric<T> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = T::zero();
        Self { xx: zero, xy: zero, xz: zero, yy: zero, yz: zero, zz: zero }
    }

    /// Adds a b^T, for vectors that are the same or multiples.
    #[inline(always)]
    fn add_outer(&mut self, a: &Vector3<T>, b: &Vector3<T>) {
        self.xx = a.x.mul_add(b.x, self.xx);
        self.xy = a.x.mul_add(b.y, self.xy);
        self.xz = a.x.mul_add(b.z, self.xz);
        self.yy = a.y.mul_add(b.y, self.yy);
        self.yz = a.y.mul_add(b.z, self.yz);
        self.zz = a.z.mul_add(b.z, self.zz);
    }

    /// The same for two pairs of vectors.
    #[inline(always)]
    fn add_two_outer(&mut self, [(a, b), (c, d)]: [(&Vector3<T>, &Vector3<T>); 2]) {
        self.xx = a.x.mul_add(b.x, c.x.mul_add(d.x, self.xx));
        self.xy = a.x.mul_add(b.y, c.x.mul_add(d.y, self.xy));
        self.xz = a.x.mul_add(b.z, c.x.mul_add(d.z, self.xz));
        self.yy = a.y.mul_add(b.y, c.y.mul_add(d.y, self.yy));
        self.yz = a.y.mul_add(b.z, c.y.mul_add(d.z, self.yz));
        self.zz = a.z.mul_add(b.z, c.z.mul_add(d.z, self.zz));
    }

    #[inline(always)]
    fn times(&self, v: &Vector3<T>) -> Vector3<T> {
        let [x, y, z] = &self.rows();
        Vector3::new(inner(x, v), inner(y, v), inner(z, v))
    }

    #[inline(always)]
    fn rows(&self) -> [Vector3<T>; 3] {
        [
            Vector3::new(self.xx, self.xy, self.xz),
            Vector3::new(self.xy, self.yy, self.yz),
            Vector3::new(self.xz, self.yz, self.zz),
        ]
    }
}

impl<T: Real> Quadratic<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        let none = Vector3::new(T::zero(), T::zero(), T::zero());
        Self { linear: Symmetric::zero(), mixed: [none; 3], angular: Symmetric::zero(), gradient: Momentum::zero() }
    }

    /// H x.
    #[inline(always)]
    fn times(&self, x: &Twist<T>) -> Momentum<T> {
        let [a, b, c] = &self.mixed;
        let (v, w) = (&x.linear, &x.angular);
        let coupled = Vector3::new(inner(a, w), inner(b, w), inner(c, w));
        let back = along(&along(&scaled(a, v.x), b, v.y), c, v.z);
        Momentum { linear: sum(&self.linear.times(v), &coupled), angular: sum(&self.angular.times(w), &back) }
    }

    /// Adds `force w . x + penalty (w . x)^2 / 2`.
    #[inline(always)]
    pub fn add_rank_one(&mut self, w: &Wrench<T>, penalty: T, force: T) {
        let (linear, angular) = (scaled(&w.linear, penalty), scaled(&w.angular, penalty));
        self.linear.add_outer(&w.linear, &linear);
        self.mixed[0] = along(&self.mixed[0], &angular, w.linear.x);
        self.mixed[1] = along(&self.mixed[1], &angular, w.linear.y);
        self.mixed[2] = along(&self.mixed[2], &angular, w.linear.z);
        self.angular.add_outer(&w.angular, &angular);
        self.gradient = self.gradient.plus_scaled(w, force);
    }

    /// Adds two terms `force w . x + (row . x) (w . x) / 2` with rows that are multiples of w.
    #[inline(always)]
    fn add_two(&mut self, [(v, p, f), (w, q, g)]: [(&Wrench<T>, &Wrench<T>, T); 2]) {
        self.linear.add_two_outer([(&v.linear, &p.linear), (&w.linear, &q.linear)]);
        for (i, row) in self.mixed.iter_mut().enumerate() {
            *row = along(&along(row, &p.angular, v.linear[i]), &q.angular, w.linear[i]);
        }
        self.angular.add_two_outer([(&v.angular, &p.angular), (&w.angular, &q.angular)]);
        self.gradient = self.gradient.plus_scaled(v, f).plus_scaled(w, g);
    }

    /// The same as a function of the twist at a point from which this one lies at `arm`: v = v_new + omega x arm.
    #[inline(always)]
    fn seen_from_before(&self, arm: &Vector3<T>) -> Self {
        // B' = B - A [d] , row by row a^T [d] = (a x d)^T with a the rows of A; C' = C + [d] B' - B^T [d].
        let rows = self.linear.rows();
        let [a, b, c] = &self.mixed;
        let mixed =
            [sum_with_cross(a, arm, &rows[0]), sum_with_cross(b, arm, &rows[1]), sum_with_cross(c, arm, &rows[2])];
        let [p, q, r] = &mixed;
        let (own, d) = (&self.angular, arm);
        Self {
            mixed,
            angular: Symmetric {
                xx: with_products(own.xx, [r.x, q.x, c.x, b.x], [d.y, d.z, d.y, d.z]),
                xy: with_products(own.xy, [r.y, q.y, a.x, c.x], [d.y, d.z, d.z, d.x]),
                xz: with_products(own.xz, [r.z, q.z, b.x, a.x], [d.y, d.z, d.x, d.y]),
                yy: with_products(own.yy, [p.y, r.y, a.y, c.y], [d.z, d.x, d.z, d.x]),
                yz: with_products(own.yz, [p.z, r.z, b.y, a.y], [d.z, d.x, d.x, d.y]),
                zz: with_products(own.zz, [q.z, p.z, b.z, a.z], [d.x, d.y, d.x, d.y]),
            },
            gradient: gradient_before(&self.gradient, arm),
            ..*self
        }
    }

    /// The twist that minimises the function, and twice the decrease: an L D L^T factorisation.
    #[inline(always)]
    pub fn minimiser(&self) -> (Twist<T>, T) {
        let step = self.minimiser_under(&self.gradient);
        (step, -step.dot(&self.gradient))
    }

    /// The twist that minimises the function with another gradient.
    #[inline(always)]
    pub fn minimiser_under(&self, gradient: &Momentum<T>) -> Twist<T> {
        let mut rows = self.dense();
        let (v, w) = (&gradient.linear, &gradient.angular);
        let mut x = [-v.x, -v.y, -v.z, -w.x, -w.y, -w.z];
        // A loop over pivots would not be unrolled, and would keep its numbers in memory.
        eliminate_pivot::<T, 0>(&mut rows, &mut x);
        eliminate_pivot::<T, 1>(&mut rows, &mut x);
        eliminate_pivot::<T, 2>(&mut rows, &mut x);
        eliminate_pivot::<T, 3>(&mut rows, &mut x);
        eliminate_pivot::<T, 4>(&mut rows, &mut x);
        x[5] = x[5] / rows[5][5];
        substitute_pivot::<T, 4>(&rows, &mut x);
        substitute_pivot::<T, 3>(&rows, &mut x);
        substitute_pivot::<T, 2>(&rows, &mut x);
        substitute_pivot::<T, 1>(&rows, &mut x);
        substitute_pivot::<T, 0>(&rows, &mut x);
        Twist { linear: Vector3::new(x[0], x[1], x[2]), angular: Vector3::new(x[3], x[4], x[5]) }
    }

    /// Lower half of H, angular variables last.
    #[inline(always)]
    fn dense(&self) -> [[T; 6]; 6] {
        let zero = T::zero();
        let (a, c) = (self.linear.rows(), self.angular.rows());
        let mut rows = [[zero; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                rows[i][j] = a[i][j];
                rows[3 + i][j] = self.mixed[j][i];
                rows[3 + i][3 + j] = c[i][j];
            }
        }
        rows
    }
}

/// One step of the factorisation of the lower half of a symmetric matrix, and of the right side `x`; the column of the pivot
/// stays unscaled, for [`substitute_pivot`].
#[allow(clippy::needless_range_loop, reason = "rows are read and written at once")]
#[inline(always)]
fn eliminate_pivot<T: Real, const K: usize>(rows: &mut [[T; 6]; 6], x: &mut [T; 6]) {
    let inverse = T::splat(1.0) / rows[K][K];
    for i in K + 1..6 {
        let factor = rows[i][K] * inverse;
        for j in K + 1..=i {
            rows[i][j] = factor.subtract_from(rows[j][K], rows[i][j]);
        }
        x[i] = factor.subtract_from(x[K], x[i]);
    }
}

/// One step of the substitution back, from the last row on.
#[inline(always)]
fn substitute_pivot<T: Real, const K: usize>(rows: &[[T; 6]; 6], x: &mut [T; 6]) {
    let mut sum = x[K];
    for i in K + 1..6 {
        sum = rows[i][K].subtract_from(x[i], sum);
    }
    x[K] = sum / rows[K][K];
}

impl<T: Real> Elimination<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self { row: SpatialVector::zero(), constant: T::zero(), inverse: T::zero() }
    }

    /// With the row of the link's own twist without the rate.
    #[inline(always)]
    fn new(column: &SpatialVector<T>, inverse: T, force: T) -> Self {
        Self { row: column.scaled(-inverse), constant: -(force * inverse), inverse }
    }

    /// With the row of the twist of the link before.
    #[inline(always)]
    fn seen_from_before(&self, shift: &Vector3<T>) -> Self {
        Self { row: gradient_before(&self.row, shift), ..*self }
    }
}

impl<T: Real> Segment<T> {
    /// Room for a link.
    pub fn vacant() -> Self {
        let (hinge, elimination) = ([Twist::zero(); 2], [Elimination::zero(); 2]);
        Self {
            only: None,
            shift: zero_vector(),
            hinge,
            elimination,
            pitch_by_yaw: T::zero(),
            correction: [T::zero(); 2],
        }
    }

    /// Places the link `shift` from the one before, whose rear joint moves it along `hinge`.
    #[inline(always)]
    pub fn place(&mut self, axes: Axes, shift: Vector3<T>, hinge: [Twist<T>; 2]) {
        (self.only, self.shift, self.hinge) = (axes.only(), shift, hinge);
    }

    /// Eliminates the rates of the joint before this link from `total`, the function of all from this link on, and turns
    /// it into one of the twist of the link before. Returns twice the decrease.
    #[inline(always)]
    pub fn eliminate(&mut self, total: &mut Quadratic<T>, actuators: &[ActuatorModel<T>; 2]) -> T {
        let decrease = match self.only {
            Some(axis) => self.eliminate_one(axis, total, &actuators[axis]),
            None => self.eliminate_both(total, actuators),
        };
        *total = total.seen_from_before(&self.shift);
        decrease
    }

    #[inline(always)]
    fn eliminate_one(&mut self, axis: usize, total: &mut Quadratic<T>, actuator: &ActuatorModel<T>) -> T {
        let hinge = &self.hinge[axis];
        let column = total.times(hinge);
        let inverse = T::splat(1.0) / (hinge.dot(&column) + actuator.stiffness);
        let force = hinge.dot(&total.gradient) - actuator.impulse;
        let elimination = Elimination::new(&column, inverse, force);
        total.add_rank_one(&column, -inverse, elimination.constant);
        self.elimination[axis] = elimination.seen_from_before(&self.shift);
        (self.elimination[1 - axis], self.pitch_by_yaw) = (Elimination::zero(), T::zero());
        -(force * elimination.constant)
    }

    #[inline(always)]
    fn eliminate_both(&mut self, total: &mut Quadratic<T>, [of_yaw, of_pitch]: &[ActuatorModel<T>; 2]) -> T {
        let [yaw, pitch] = &self.hinge;
        let (column, unchanged) = (total.times(pitch), total.times(yaw));
        let inverse = T::splat(1.0) / (pitch.dot(&column) + of_pitch.stiffness);
        let force = pitch.dot(&total.gradient) - of_pitch.impulse;
        // What is left for the yaw, once the pitch follows it.
        let share = yaw.dot(&column) * inverse;
        let rest = unchanged.plus_scaled(&column, -share);
        let rest_inverse = T::splat(1.0) / (yaw.dot(&rest) + of_yaw.stiffness);
        let rest_force = share.subtract_from(force, yaw.dot(&total.gradient) - of_yaw.impulse);
        let (pitch, yaw) =
            (Elimination::new(&column, inverse, force), Elimination::new(&rest, rest_inverse, rest_force));
        total.add_two([(&column, &pitch.row, pitch.constant), (&rest, &yaw.row, yaw.constant)]);
        let decrease = -(force * pitch.constant + rest_force * yaw.constant);
        self.elimination = [yaw.seen_from_before(&self.shift), pitch.seen_from_before(&self.shift)];
        self.pitch_by_yaw = -share;
        decrease
    }

    /// Steps of the rates and of the link's twist, given the step of the link before.
    #[inline(always)]
    pub fn substitute(&self, before: &Twist<T>) -> ([T; 2], Twist<T>) {
        let [yaw, pitch] = &self.elimination;
        self.substitute_with(&[yaw.constant, pitch.constant], before)
    }

    /// Repeats the last elimination for another gradient of all from this link on, without actuators. Returns that of
    /// the link before, the constants for [`Self::substitute_with`], and twice the decrease.
    #[inline(always)]
    pub fn eliminate_linear(&self, total: &Momentum<T>) -> (Momentum<T>, [T; 2], T) {
        let [yaw, pitch] = &self.elimination;
        let of_pitch = self.hinge[1].dot(total);
        let of_yaw = self.pitch_by_yaw.mul_add(of_pitch, self.hinge[0].dot(total));
        let gradient = gradient_before(total, &self.shift).plus_scaled(&pitch.row, of_pitch);
        let constant = [-(of_yaw * yaw.inverse), -(of_pitch * pitch.inverse)];
        let decrease = -of_yaw.mul_add(constant[0], of_pitch * constant[1]);
        (gradient.plus_scaled(&yaw.row, of_yaw), constant, decrease)
    }

    /// Adds a share of the correction to the constants, in the given lanes.
    #[inline(always)]
    pub fn correct(&mut self, share: T, lanes: T::Mask) {
        for (Elimination { constant, .. }, correction) in self.elimination.iter_mut().zip(self.correction) {
            *constant = T::select(lanes, share.mul_add(correction, *constant), *constant);
        }
    }

    /// [`Self::substitute`] with the constants of another gradient.
    #[inline(always)]
    pub fn substitute_with(&self, constant: &[T; 2], before: &Twist<T>) -> ([T; 2], Twist<T>) {
        let [yaw, pitch] = &self.elimination;
        let yaw_rate = yaw.row.dot(before) + constant[0];
        let pitch_rate = self.pitch_by_yaw.mul_add(yaw_rate, pitch.row.dot(before) + constant[1]);
        let rates = [yaw_rate, pitch_rate];
        (rates, self.follow(before, &rates))
    }

    /// The link's twist, given the twist of the link before and the rates.
    #[inline(always)]
    pub fn follow(&self, before: &Twist<T>, rates: &[T; 2]) -> Twist<T> {
        let carried = Twist { linear: before.velocity_at(&self.shift), angular: before.angular };
        carried.plus_scaled(&self.hinge[0], rates[0]).plus_scaled(&self.hinge[1], rates[1])
    }
}

/// A gradient by a link's twist as one by the twist at a point from which the link lies at `arm`.
#[inline(always)]
fn gradient_before<T: Real>(gradient: &Momentum<T>, arm: &Vector3<T>) -> Momentum<T> {
    let Momentum { linear, angular } = gradient;
    Momentum { linear: *linear, angular: sum_with_cross(angular, arm, linear) }
}

/// `entry + d u - e v + f w - g x`.
#[inline(always)]
pub(super) fn with_products<T: Real>(entry: T, [u, v, w, x]: [T; 4], [d, e, f, g]: [T; 4]) -> T {
    g.subtract_from(x, f.mul_add(w, e.subtract_from(v, d.mul_add(u, entry))))
}
