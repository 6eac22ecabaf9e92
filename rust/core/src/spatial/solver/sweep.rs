//! One linear solve of the chain in O(n): elimination from tail to head.
//!
//! A link has the twist x_i = X x_{i-1} + S_h phi_h' + S_v phi_v', with X the shift from one CG to the next. Given what is out of
//! balance in the chain behind it, an affine function of six variables, the balance of both axes of a joint is two scalar
//! pivots, and a shift leaves a function of x_{i-1} of the same form: the articulated body inertia, or the Riccati recursion of
//! linear-quadratic control. Friction whose radius follows a normal impulse is the derivative of no function, so matrices are
//! not symmetric. All vectors are along the axes of frame I, so that no rotation is needed.

use nalgebra::{Vector2, Vector3};

use crate::laws::Symmetric2;
use crate::math::Real;
use crate::robot::Axes;

use crate::spatial::spatial_vector::{
    Momentum, SpatialVector, Twist, Wrench, along, cross, inner, scaled, sum, sum_with_cross, zero_vector,
};

/// Rows of a 3 x 3 matrix.
type Rows<T> = [Vector3<T>; 3];

/// `gradient + M x` of a twist x: what is out of balance where twists change by x.
#[derive(Debug, Clone, Copy)]
pub(super) struct Affine<T> {
    pub gradient: Momentum<T>,
    pub matrix: Matrix<T>,
}

/// A matrix from twists to wrenches, by blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matrix<T> {
    /// Forces by velocities, and by angular velocities.
    pub linear: Rows<T>,
    pub mixed: Rows<T>,
    /// Moments by velocities, and by angular velocities.
    pub back: Rows<T>,
    pub angular: Rows<T>,
}

/// How the force on a point falls with its velocity: friction with the slip and, where it follows the load, with the vertical
/// velocity; the load with that alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct PointStiffness<T> {
    pub sliding: Symmetric2<T>,
    pub coupling: Vector2<T>,
    pub normal: T,
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
    /// Of an elimination that can be repeated: like the rows, of the columns of the rates, and how much the moment about the yaw
    /// axis follows that about the pitch axis.
    columns: [SpatialVector<T>; 2],
    yaw_by_pitch: T,
}

/// Stiffness of a joint's actuator against its rate, and its impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorModel<T> {
    pub stiffness: T,
    pub impulse: T,
}

impl<T: Real> Matrix<T> {
    #[inline(always)]
    fn zero() -> Self {
        let none = [zero_vector(); 3];
        Self { linear: none, mixed: none, back: none, angular: none }
    }

    /// M x.
    #[inline(always)]
    fn times(&self, x: &Twist<T>) -> Momentum<T> {
        let (v, w) = (&x.linear, &x.angular);
        Momentum {
            linear: sum(&times(&self.linear, v), &times(&self.mixed, w)),
            angular: sum(&times(&self.back, v), &times(&self.angular, w)),
        }
    }

    /// M^T x.
    #[inline(always)]
    fn transposed_times(&self, x: &Twist<T>) -> Momentum<T> {
        let (v, w) = (&x.linear, &x.angular);
        Momentum {
            linear: sum(&weighted(&self.linear, v), &weighted(&self.back, w)),
            angular: sum(&weighted(&self.mixed, v), &weighted(&self.angular, w)),
        }
    }

    /// Adds a b^T.
    #[inline(always)]
    pub fn add_outer(&mut self, a: &Wrench<T>, b: &Wrench<T>) {
        for i in 0..3 {
            self.linear[i] = along(&self.linear[i], &b.linear, a.linear[i]);
            self.mixed[i] = along(&self.mixed[i], &b.angular, a.linear[i]);
            self.back[i] = along(&self.back[i], &b.linear, a.angular[i]);
            self.angular[i] = along(&self.angular[i], &b.angular, a.angular[i]);
        }
    }

    /// Adds the stiffness of the point at `arm` from the CG.
    #[inline(always)]
    pub fn add_at(&mut self, arm: &Vector3<T>, point: &PointStiffness<T>) {
        let (PointStiffness { sliding: k, coupling: c, normal }, r) = (point, arm);
        let [x, y] = [Vector3::new(k.xx, k.xy, c.x), Vector3::new(k.xy, k.yy, c.y)];
        let [a, b, d] = &mut self.linear;
        (*a, *b, d.z) = (sum(a, &x), sum(b, &y), d.z + *normal);
        // -K [r], row by row, and [r] K.
        let [p, q] = [cross(r, &x), cross(r, &y)];
        let (s, t) = (*normal * r.y, -(*normal * r.x));
        let [a, b, d] = &mut self.mixed;
        (*a, *b, d.x, d.y) = (sum(a, &p), sum(b, &q), d.x + s, d.y + t);
        let [a, b, d] = &mut self.back;
        *a = along(a, &y, -r.z);
        a.z += s;
        *b = along(b, &x, r.z);
        b.z += t;
        *d = along(&along(d, &y, r.x), &x, -r.y);
        // [r] (-K [r]).
        let [a, b, d] = &mut self.angular;
        *a = along(a, &q, -r.z);
        (a.x, a.y) = (r.y.mul_add(s, a.x), r.y.mul_add(t, a.y));
        *b = along(b, &p, r.z);
        (b.x, b.y) = (r.x.subtract_from(s, b.x), r.x.subtract_from(t, b.y));
        *d = along(&along(d, &q, r.x), &p, -r.y);
    }

    /// The same as a function of the twist at a point from which this one lies at `arm`: v = v_new + omega x arm.
    #[inline(always)]
    fn seen_from_before(&self, arm: &Vector3<T>) -> Self {
        // B' = B - A [d], row by row a^T [d] = (a x d)^T with a the rows of A; D' = D + [d] A; C' = C - D [d] + [d] B'.
        let mixed = shifted(&self.mixed, &self.linear, arm);
        Self {
            linear: self.linear,
            mixed,
            back: with_cross(&self.back, arm, &self.linear),
            angular: with_cross(&shifted(&self.angular, &self.back, arm), arm, &mixed),
        }
    }

    /// Rows, angular variables last.
    #[inline(always)]
    fn dense(&self) -> [[T; 6]; 6] {
        let ([a, b, c], [p, q, r]) = (&self.linear, &self.mixed);
        let ([d, e, f], [s, t, u]) = (&self.back, &self.angular);
        [row(a, p), row(b, q), row(c, r), row(d, s), row(e, t), row(f, u)]
    }
}

#[inline(always)]
fn row<T: Real>(v: &Vector3<T>, w: &Vector3<T>) -> [T; 6] {
    [v.x, v.y, v.z, w.x, w.y, w.z]
}

#[inline(always)]
fn times<T: Real>([x, y, z]: &Rows<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(inner(x, v), inner(y, v), inner(z, v))
}

/// Sum of the rows with these weights.
#[inline(always)]
fn weighted<T: Real>([x, y, z]: &Rows<T>, v: &Vector3<T>) -> Vector3<T> {
    along(&along(&scaled(x, v.x), y, v.y), z, v.z)
}

/// rows - factors [arm].
#[inline(always)]
fn shifted<T: Real>([x, y, z]: &Rows<T>, [a, b, c]: &Rows<T>, arm: &Vector3<T>) -> Rows<T> {
    [sum_with_cross(x, arm, a), sum_with_cross(y, arm, b), sum_with_cross(z, arm, c)]
}

/// rows + [arm] factors.
#[inline(always)]
fn with_cross<T: Real>([x, y, z]: &Rows<T>, arm: &Vector3<T>, [a, b, c]: &Rows<T>) -> Rows<T> {
    [
        along(&along(x, c, arm.y), b, -arm.z),
        along(&along(y, a, arm.z), c, -arm.x),
        along(&along(z, b, arm.x), a, -arm.y),
    ]
}

impl<T: Real> Affine<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self { gradient: Momentum::zero(), matrix: Matrix::zero() }
    }

    /// Adds the law of a row w: `force w` and the stiffness `penalty` against w . x.
    #[inline(always)]
    pub fn add_rank_one(&mut self, w: &Wrench<T>, penalty: T, force: T) {
        self.matrix.add_outer(&w.scaled(penalty), w);
        self.gradient = self.gradient.plus_scaled(w, force);
    }

    /// The same as a function of the twist at a point from which this one lies at `arm`.
    #[inline(always)]
    fn seen_from_before(&self, arm: &Vector3<T>) -> Self {
        Self { gradient: gradient_before(&self.gradient, arm), matrix: self.matrix.seen_from_before(arm) }
    }

    /// The twist that is in balance, and minus the gradient along that \[J\]: twice the decrease of a function, but no energy
    /// where friction follows.
    #[inline(always)]
    pub fn solution(&self) -> (Twist<T>, T) {
        let step = self.solution_under(&self.gradient);
        (step, -step.dot(&self.gradient))
    }

    /// The twist that is in balance with another gradient.
    #[inline(always)]
    pub fn solution_under(&self, gradient: &Momentum<T>) -> Twist<T> {
        let mut rows = self.matrix.dense();
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
}

/// One step of the factorisation, and of the right side `x`; the row of the pivot stays, for [`substitute_pivot`].
#[allow(clippy::needless_range_loop, reason = "rows are read and written at once")]
#[inline(always)]
fn eliminate_pivot<T: Real, const K: usize>(rows: &mut [[T; 6]; 6], x: &mut [T; 6]) {
    let inverse = T::splat(1.0) / rows[K][K];
    for i in K + 1..6 {
        let factor = rows[i][K] * inverse;
        for j in K + 1..6 {
            rows[i][j] = factor.subtract_from(rows[K][j], rows[i][j]);
        }
        x[i] = factor.subtract_from(x[K], x[i]);
    }
}

/// One step of the substitution back, from the last row on.
#[inline(always)]
fn substitute_pivot<T: Real, const K: usize>(rows: &[[T; 6]; 6], x: &mut [T; 6]) {
    let mut sum = x[K];
    for i in K + 1..6 {
        sum = rows[K][i].subtract_from(x[i], sum);
    }
    x[K] = sum / rows[K][K];
}

impl<T: Real> Elimination<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self { row: SpatialVector::zero(), constant: T::zero(), inverse: T::zero() }
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
            columns: [SpatialVector::zero(); 2],
            yaw_by_pitch: T::zero(),
        }
    }

    /// Places the link `shift` from the one before, whose rear joint moves it along `hinge`.
    #[inline(always)]
    pub fn place(&mut self, axes: Axes, shift: Vector3<T>, hinge: [Twist<T>; 2]) {
        (self.only, self.shift, self.hinge) = (axes.only(), shift, hinge);
    }

    /// Eliminates the rates of the joint before this link from `total`, the function of all from this link on, and turns
    /// it into one of the twist of the link before. Returns g H^-1 g of the rates if `total` is the gradient of a function. What
    /// [`Self::eliminate_linear`] needs stays if it is to be `repeatable`.
    #[inline(always)]
    pub fn eliminate(&mut self, total: &mut Affine<T>, actuators: &[ActuatorModel<T>; 2], repeatable: bool) -> T {
        let decrease = match self.only {
            Some(axis) => self.eliminate_one(axis, total, &actuators[axis], repeatable),
            None => self.eliminate_both(total, actuators, repeatable),
        };
        *total = total.seen_from_before(&self.shift);
        decrease
    }

    #[inline(always)]
    fn eliminate_one(
        &mut self,
        axis: usize,
        total: &mut Affine<T>,
        actuator: &ActuatorModel<T>,
        repeatable: bool,
    ) -> T {
        let hinge = &self.hinge[axis];
        let (column, row) = (total.matrix.times(hinge), total.matrix.transposed_times(hinge));
        let inverse = T::splat(1.0) / (hinge.dot(&column) + actuator.stiffness);
        let force = hinge.dot(&total.gradient) - actuator.impulse;
        let decrease = self.take_out(axis, total, (&column, &row), (inverse, force));
        (self.elimination[1 - axis], self.pitch_by_yaw) = (Elimination::zero(), T::zero());
        if repeatable {
            self.columns[axis] = gradient_before(&column.scaled(-inverse), &self.shift);
            (self.columns[1 - axis], self.yaw_by_pitch) = (SpatialVector::zero(), T::zero());
        }
        decrease
    }

    #[inline(always)]
    fn eliminate_both(
        &mut self,
        total: &mut Affine<T>,
        [of_yaw, of_pitch]: &[ActuatorModel<T>; 2],
        repeatable: bool,
    ) -> T {
        let [yaw, pitch] = self.hinge;
        let (column, row) = (total.matrix.times(&pitch), total.matrix.transposed_times(&pitch));
        let inverse = T::splat(1.0) / (pitch.dot(&column) + of_pitch.stiffness);
        let force = pitch.dot(&total.gradient) - of_pitch.impulse;
        // What is left for the yaw, once the pitch follows it.
        let [share, shared] = [yaw.dot(&row) * -inverse, yaw.dot(&column) * -inverse];
        let rest_column = total.matrix.times(&yaw).plus_scaled(&column, share);
        let rest_row = total.matrix.transposed_times(&yaw).plus_scaled(&row, shared);
        let rest_inverse = T::splat(1.0) / (yaw.dot(&rest_column) + of_yaw.stiffness);
        let rest_force = shared.mul_add(force, yaw.dot(&total.gradient) - of_yaw.impulse);
        let decrease = self.take_out(1, total, (&column, &row), (inverse, force))
            + self.take_out(0, total, (&rest_column, &rest_row), (rest_inverse, rest_force));
        self.pitch_by_yaw = share;
        if repeatable {
            let columns = [rest_column.scaled(-rest_inverse), column.scaled(-inverse)];
            self.columns = [gradient_before(&columns[0], &self.shift), gradient_before(&columns[1], &self.shift)];
            self.yaw_by_pitch = shared;
        }
        decrease
    }

    /// Eliminates the rate about one axis, given its column and row, 1 / pivot, and what is out of balance.
    #[inline(always)]
    fn take_out(
        &mut self,
        axis: usize,
        total: &mut Affine<T>,
        (column, row): (&Wrench<T>, &Wrench<T>),
        (inverse, force): (T, T),
    ) -> T {
        let (row, constant) = (row.scaled(-inverse), -(force * inverse));
        total.matrix.add_outer(column, &row);
        total.gradient = total.gradient.plus_scaled(column, constant);
        self.elimination[axis] = Elimination { row: gradient_before(&row, &self.shift), constant, inverse };
        -(force * constant)
    }

    /// Steps of the rates and of the link's twist, given the step of the link before.
    #[inline(always)]
    pub fn substitute(&self, before: &Twist<T>) -> ([T; 2], Twist<T>) {
        let [yaw, pitch] = &self.elimination;
        self.substitute_with(&[yaw.constant, pitch.constant], before)
    }

    /// Repeats the last elimination, which was repeatable, for another gradient of all from this link on, without actuators.
    /// Returns that of the link before, and the constants for [`Self::substitute_with`].
    #[inline(always)]
    pub fn eliminate_linear(&self, total: &Momentum<T>) -> (Momentum<T>, [T; 2]) {
        let ([yaw, pitch], [of_yaw, of_pitch]) = (&self.elimination, &self.columns);
        let pitching = self.hinge[1].dot(total);
        let yawing = self.yaw_by_pitch.mul_add(pitching, self.hinge[0].dot(total));
        let gradient = gradient_before(total, &self.shift).plus_scaled(of_pitch, pitching);
        (gradient.plus_scaled(of_yaw, yawing), [-(yawing * yaw.inverse), -(pitching * pitch.inverse)])
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
