//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! A link has the twist x_i = X x_{i-1} + S_h phi_h' + S_v phi_v', with X the shift from one CG to the next. Given the
//! minimum V_{i+1}(x_{i+1}) of the chain behind it, a quadratic of six variables, minimising over the two rates of a
//! joint is two scalar pivots, and a shift leaves V_i of the same form: the articulated body inertia, or the Riccati
//! recursion of linear-quadratic control. All vectors are along the axes of frame I, so that no rotation is needed.

use nalgebra::Vector3;

use crate::math::Real;

use crate::spatial::spatial_vector::{
    Momentum, SpatialVector, Twist, Wrench, along, cross, difference, inner, scaled, sum,
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

/// Result of eliminating one rate, for the back substitution: `rate = row . x + constant`.
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
    /// From the CG of the link before to this one's.
    shift: Vector3<T>,
    /// S_h, S_v.
    hinge: [Twist<T>; 2],
    elimination: [Elimination<T>; 2],
}

/// Stiffness of a joint's actuator against its rate, and its impulse.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorModel<T> {
    pub stiffness: T,
    pub impulse: T,
}

impl<T: Real> Symmetric<T> {
    #[inline(always)]
    pub fn diagonal(x: T) -> Self {
        let zero = T::zero();
        Self { xx: x, xy: zero, xz: zero, yy: x, yz: zero, zz: x }
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xz: self.xz + other.xz,
            yy: self.yy + other.yy,
            yz: self.yz + other.yz,
            zz: self.zz + other.zz,
        }
    }

    /// Adds factor (a b^T + b a^T) / 2, exactly symmetric if the vectors are the same or multiples.
    #[inline(always)]
    pub fn add_outer(&mut self, a: &Vector3<T>, b: &Vector3<T>) {
        self.xx += a.x * b.x;
        self.xy += a.x * b.y;
        self.xz += a.x * b.z;
        self.yy += a.y * b.y;
        self.yz += a.y * b.z;
        self.zz += a.z * b.z;
    }

    #[inline(always)]
    pub fn times(&self, v: &Vector3<T>) -> Vector3<T> {
        Vector3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
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
        let symmetric = Symmetric::diagonal(T::zero());
        Self { linear: symmetric, mixed: [none; 3], angular: symmetric, gradient: Momentum::zero() }
    }

    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        let ([a, b, c], [p, q, r]) = (&self.mixed, &other.mixed);
        Self {
            linear: self.linear.plus(&other.linear),
            mixed: [sum(a, p), sum(b, q), sum(c, r)],
            angular: self.angular.plus(&other.angular),
            gradient: Momentum {
                linear: sum(&self.gradient.linear, &other.gradient.linear),
                angular: sum(&self.gradient.angular, &other.gradient.angular),
            },
        }
    }

    /// H x.
    #[inline(always)]
    fn times(&self, x: &Twist<T>) -> Momentum<T> {
        let [a, b, c] = &self.mixed;
        let (v, w) = (&x.linear, &x.angular);
        let coupled = Vector3::new(inner(a, w), inner(b, w), inner(c, w));
        let back = Vector3::new(
            a.x * v.x + b.x * v.y + c.x * v.z,
            a.y * v.x + b.y * v.y + c.y * v.z,
            a.z * v.x + b.z * v.y + c.z * v.z,
        );
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

    /// Minimises over a rate that moves x along `hinge`, given the drive of that rate. Also returns twice the
    /// decrease.
    #[inline(always)]
    fn eliminate(&mut self, hinge: &Twist<T>, actuator: &ActuatorModel<T>) -> (Elimination<T>, T) {
        let column = self.times(hinge);
        let pivot = hinge.dot(&column) + actuator.stiffness;
        let force = hinge.dot(&self.gradient) - actuator.impulse;
        let inverse = T::splat(1.0) / pivot;
        let constant = force * inverse;
        self.add_rank_one(&column, -inverse, -constant);
        let row =
            SpatialVector { linear: scaled(&column.linear, -inverse), angular: scaled(&column.angular, -inverse) };
        (Elimination { row, constant: -constant, inverse }, force * constant)
    }

    /// The same as a function of the twist at a point from which this one lies at `arm`: v = v_new + omega x arm.
    #[inline(always)]
    fn seen_from_before(&self, arm: &Vector3<T>) -> Self {
        // B' = B - A [d] , row by row a^T [d] = (a x d)^T with a the rows of A; C' = C + [d] B' - B^T [d].
        let rows = self.linear.rows();
        let [a, b, c] = &self.mixed;
        let mixed = [
            difference(a, &cross(&rows[0], arm)),
            difference(b, &cross(&rows[1], arm)),
            difference(c, &cross(&rows[2], arm)),
        ];
        let [p, q, r] = &mixed;
        // Columns of B', and columns of B.
        let lifted = [
            cross(arm, &Vector3::new(p.x, q.x, r.x)),
            cross(arm, &Vector3::new(p.y, q.y, r.y)),
            cross(arm, &Vector3::new(p.z, q.z, r.z)),
        ];
        let old = [
            cross(&Vector3::new(a.x, b.x, c.x), arm),
            cross(&Vector3::new(a.y, b.y, c.y), arm),
            cross(&Vector3::new(a.z, b.z, c.z), arm),
        ];
        Self {
            mixed,
            angular: Symmetric {
                xx: self.angular.xx + lifted[0].x - old[0].x,
                xy: self.angular.xy + lifted[1].x - old[0].y,
                xz: self.angular.xz + lifted[2].x - old[0].z,
                yy: self.angular.yy + lifted[1].y - old[1].y,
                yz: self.angular.yz + lifted[2].y - old[1].z,
                zz: self.angular.zz + lifted[2].z - old[2].z,
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
        for k in 0..6 {
            let mut column = [T::zero(); 6];
            for (entry, row) in column.iter_mut().zip(&rows) {
                *entry = row[k];
            }
            let inverse = T::splat(1.0) / column[k];
            for i in k + 1..6 {
                let factor = column[i] * inverse;
                for (entry, above) in rows[i][k + 1..=i].iter_mut().zip(&column[k + 1..=i]) {
                    *entry -= factor * *above;
                }
                x[i] -= factor * x[k];
            }
        }
        for k in (0..6).rev() {
            let mut sum = x[k];
            for i in k + 1..6 {
                sum -= rows[i][k] * x[i];
            }
            x[k] = sum / rows[k][k];
        }
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

impl<T: Real> Segment<T> {
    /// A link that lies `shift` from the one before, whose rear joint moves it along `hinge`.
    #[inline(always)]
    pub fn new(shift: Vector3<T>, hinge: [Twist<T>; 2]) -> Self {
        let none = Elimination { row: SpatialVector::zero(), constant: T::zero(), inverse: T::zero() };
        Self { shift, hinge, elimination: [none; 2] }
    }

    /// Eliminates both rates of the joint before this link from `total`, the function of all from this link on.
    /// Returns the function of the twist of the link before, and twice the decrease.
    #[inline(always)]
    pub fn eliminate(&mut self, mut total: Quadratic<T>, actuators: &[ActuatorModel<T>; 2]) -> (Quadratic<T>, T) {
        let (pitch, first) = total.eliminate(&self.hinge[1], &actuators[1]);
        let (yaw, second) = total.eliminate(&self.hinge[0], &actuators[0]);
        self.elimination = [yaw, pitch];
        (total.seen_from_before(&self.shift), first + second)
    }

    /// Steps of the rates and of the link's twist, given the step of the link before.
    #[inline(always)]
    pub fn substitute(&self, before: &Twist<T>) -> ([T; 2], Twist<T>) {
        let [yaw, pitch] = &self.elimination;
        self.substitute_with(&[yaw.constant, pitch.constant], before)
    }

    /// Repeats the last elimination for another gradient of all from this link on, without actuators. Returns that of
    /// the link before, and the constants for [`Self::substitute_with`].
    #[inline(always)]
    pub fn eliminate_linear(&self, total: &Momentum<T>) -> (Momentum<T>, [T; 2]) {
        let (mut gradient, mut constant) = (*total, [T::zero(); 2]);
        for axis in [1, 0] {
            let force = self.hinge[axis].dot(&gradient);
            let Elimination { row, inverse, .. } = &self.elimination[axis];
            constant[axis] = -(force * *inverse);
            gradient = gradient.plus_scaled(row, force);
        }
        (gradient_before(&gradient, &self.shift), constant)
    }

    /// [`Self::substitute`] with the constants of another gradient.
    #[inline(always)]
    pub fn substitute_with(&self, constant: &[T; 2], before: &Twist<T>) -> ([T; 2], Twist<T>) {
        let mut x = self.carried(before);
        let mut rates = [T::zero(); 2];
        for (axis, rate) in rates.iter_mut().enumerate() {
            *rate = self.elimination[axis].row.dot(&x) + constant[axis];
            x = x.plus_scaled(&self.hinge[axis], *rate);
        }
        (rates, x)
    }

    /// The link's twist, given the twist of the link before and the rates.
    #[inline(always)]
    pub fn follow(&self, before: &Twist<T>, rates: &[T; 2]) -> Twist<T> {
        self.carried(before).plus_scaled(&self.hinge[0], rates[0]).plus_scaled(&self.hinge[1], rates[1])
    }

    #[inline(always)]
    fn carried(&self, before: &Twist<T>) -> Twist<T> {
        Twist { linear: before.velocity_at(&self.shift), angular: before.angular }
    }
}

/// A gradient by a link's twist as one by the twist at a point from which the link lies at `arm`.
#[inline(always)]
fn gradient_before<T: Real>(gradient: &Momentum<T>, arm: &Vector3<T>) -> Momentum<T> {
    let Momentum { linear, angular } = gradient;
    Momentum { linear: *linear, angular: sum(angular, &cross(arm, linear)) }
}
