//! One linear solve of the chain in O(n): elimination from tail to head with a value function.
//!
//! Unknowns are the velocity p of the free end of link 1 and the angular velocities omega_i. Link i
//! has the joint velocity p_i at its near end, so that its CG moves with p_i + omega_i a e_y, a being the arm from there
//! to the CG, L/2 where that is in the middle, and its far end with p_{i+1} = p_i + omega_i L e_y. Given the minimum V_{i+1}(p_{i+1}, omega_i) of all
//! that lies behind, a quadratic of three variables, minimising over omega_i is one scalar pivot and
//! leaves V_i(p_i, omega_{i-1}) of the same form: the recursion of linear-quadratic control.
//!
//! Friction whose bound follows a normal impulse is the derivative of no function: the matrix then has an antisymmetric part,
//! and the same pivots solve the linear equations. `ROUGH` tells whether there may be such friction.
//!
//! Everything is written in the frame of the present link, where the arm is along e_y and friction is diagonal; a value
//! function is turned by the joint angle when it passes a joint.

use nalgebra::{Vector2, Vector3};

use crate::laws::{SurfaceEvaluation, Symmetric2};
use crate::math::Real;
use crate::planar::Heading;
use crate::solver::SurfaceTerm;

/// `g . x + x^T H x / 2` of x = (v_x, v_y, omega): velocity of a point and an angular velocity. With an antisymmetric part K it
/// stands for `g + (H + K) x`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadratic<T> {
    pub xx: T,
    pub xy: T,
    pub yy: T,
    pub xw: T,
    pub yw: T,
    pub ww: T,
    pub gx: T,
    pub gy: T,
    pub gw: T,
    pub skew: Skew<T>,
}

/// K of a [`Quadratic`], the entries above the diagonal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Skew<T> {
    xy: T,
    xw: T,
    yw: T,
}

/// A link in the chain: its place, and what its elimination left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment<T> {
    /// Direction of the joint angle to the link before.
    pub turn: Heading<T>,
    /// From the near end to the CG, and from there to the far end \[m\].
    pub arms: [T; 2],
    elimination: Elimination<T>,
    /// Like `px` and `py` of the elimination, of the column of omega_i instead of its row; what is `ROUGH` leaves it.
    column: [T; 2],
}

/// What eliminating omega_i leaves behind for the back substitution:
/// `omega_i = px p_x + py p_y + previous omega_{i-1} + constant`.
#[derive(Debug, Clone, Copy)]
struct Elimination<T> {
    px: T,
    py: T,
    previous: T,
    constant: T,
    /// 1 / H_omega.
    inverse: T,
}

impl<T: Real> Quadratic<T> {
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = T::zero();
        let skew = Skew::zero();
        Self { xx: zero, xy: zero, yy: zero, xw: zero, yw: zero, ww: zero, gx: zero, gy: zero, gw: zero, skew }
    }

    #[inline(always)]
    fn plus<const ROUGH: bool>(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
            xw: self.xw + other.xw,
            yw: self.yw + other.yw,
            ww: self.ww + other.ww,
            gx: self.gx + other.gx,
            gy: self.gy + other.gy,
            gw: self.gw + other.gw,
            skew: if ROUGH { self.skew.plus(other.skew) } else { self.skew },
        }
    }

    /// Adds `force w . x + penalty (w . x)^2 / 2`.
    #[inline(always)]
    pub fn add_rank_one(&mut self, w: &Vector3<T>, penalty: T, force: T) {
        let (px, py, pz) = (penalty * w.x, penalty * w.y, penalty * w.z);
        self.xx = px.mul_add(w.x, self.xx);
        self.xy = px.mul_add(w.y, self.xy);
        self.yy = py.mul_add(w.y, self.yy);
        self.xw = px.mul_add(w.z, self.xw);
        self.yw = py.mul_add(w.z, self.yw);
        self.ww = pz.mul_add(w.z, self.ww);
        self.gx = force.mul_add(w.x, self.gx);
        self.gy = force.mul_add(w.y, self.gy);
        self.gw = force.mul_add(w.z, self.gw);
    }

    /// Adds the matrix `coupling a b^T`: an impulse along `a` falls with the velocity along `b`.
    #[inline(always)]
    pub fn add_coupling(&mut self, a: &Vector3<T>, b: &Vector3<T>, coupling: T) {
        let half = T::splat(0.5) * coupling;
        let [xy, yx] = [half * a.x * b.y, half * a.y * b.x];
        let [xw, wx] = [half * a.x * b.z, half * a.z * b.x];
        let [yw, wy] = [half * a.y * b.z, half * a.z * b.y];
        self.xx = coupling.mul_add(a.x * b.x, self.xx);
        self.yy = coupling.mul_add(a.y * b.y, self.yy);
        self.ww = coupling.mul_add(a.z * b.z, self.ww);
        (self.xy, self.xw, self.yw) = (self.xy + (xy + yx), self.xw + (xw + wx), self.yw + (yw + wy));
        self.skew = self.skew.plus(Skew { xy: xy - yx, xw: xw - wx, yw: yw - wy });
    }

    /// Adds a friction impulse and its stiffness against the slip (v_x, v_y).
    #[inline(always)]
    pub fn add_friction(&mut self, stiffness: &Symmetric2<T>, impulse: &Vector2<T>) {
        self.xx += stiffness.xx;
        self.xy += stiffness.xy;
        self.yy += stiffness.yy;
        self.gx -= impulse.x;
        self.gy -= impulse.y;
    }

    /// Subtracts the linear term `force . x`: a constant force lowers the gradient.
    #[inline(always)]
    pub fn subtract_force(&mut self, force: &Vector3<T>) {
        self.gx -= force.x;
        self.gy -= force.y;
        self.gw -= force.z;
    }

    /// Adds impulse and stiffness of friction on what can be pushed, at its twist.
    #[inline(always)]
    pub fn add_surface(&mut self, surface: &mut SurfaceTerm<T>, twist: &Vector3<T>) {
        let SurfaceEvaluation { across, stiffness, along, .. } = surface.evaluate(twist);
        (self.xx, self.yy, self.ww) = (self.xx + across.x, self.yy + across.y, self.ww + across.z);
        self.add_rank_one(&along, -stiffness, T::zero());
        self.subtract_force(&surface.impulse());
    }

    /// Derivative along `step`.
    #[inline(always)]
    pub fn slope_along(&self, step: &Vector3<T>) -> T {
        self.gx.mul_add(step.x, self.gy.mul_add(step.y, self.gw * step.z))
    }

    /// g + (H + K) step.
    #[inline(always)]
    pub fn gradient_after<const ROUGH: bool>(&self, step: &Vector3<T>) -> Vector3<T> {
        let symmetric = Vector3::new(
            self.xx.mul_add(step.x, self.xy.mul_add(step.y, self.xw.mul_add(step.z, self.gx))),
            self.xy.mul_add(step.x, self.yy.mul_add(step.y, self.yw.mul_add(step.z, self.gy))),
            self.xw.mul_add(step.x, self.yw.mul_add(step.y, self.ww.mul_add(step.z, self.gw))),
        );
        if ROUGH { self.skew.add_to(symmetric, step) } else { symmetric }
    }

    /// The same seen from a point nearer by `arm` along the link: v = v_new + omega arm e_y.
    #[inline(always)]
    fn seen_from_before<const ROUGH: bool>(self, arm: T) -> Self {
        let yw = self.yy.mul_add(arm, self.yw);
        Self {
            xw: self.xy.mul_add(arm, self.xw),
            yw,
            ww: arm.mul_add(self.yw + yw, self.ww),
            gw: arm.mul_add(self.gy, self.gw),
            skew: if ROUGH { self.skew.seen_from_before(arm) } else { self.skew },
            ..self
        }
    }

    /// The same in the frame of the link before; `joint` is the direction of the joint angle between them.
    #[inline(always)]
    fn turned_back<const ROUGH: bool>(self, joint: &Heading<T>) -> Self {
        let (c, s) = (joint.cos, joint.sin);
        let (cc, cs, ss) = (c * c, c * s, s * s);
        let cross = (cs + cs) * self.xy;
        Self {
            xx: cc.mul_add(self.xx, ss.mul_add(self.yy, -cross)),
            xy: cs.mul_add(self.xx - self.yy, (cc - ss) * self.xy),
            yy: ss.mul_add(self.xx, cc.mul_add(self.yy, cross)),
            xw: s.subtract_from(self.yw, c * self.xw),
            yw: s.mul_add(self.xw, c * self.yw),
            gx: s.subtract_from(self.gy, c * self.gx),
            gy: s.mul_add(self.gx, c * self.gy),
            skew: if ROUGH { self.skew.turned_back(joint) } else { self.skew },
            ..self
        }
    }

    /// Minimises over omega with the spring k (omega - omega_before)^2 / 2 added; what is left is a
    /// function of the velocity and omega_before. Also returns g_omega^2 / H_omega, twice the decrease.
    #[inline(always)]
    fn eliminate<const ROUGH: bool>(self, k: T) -> (Elimination<T>, Self, T) {
        let inverse = T::splat(1.0) / (self.ww + k);
        let (px, py, constant, previous) = (self.xw * inverse, self.yw * inverse, self.gw * inverse, k * inverse);
        let mut left = Self {
            xx: self.xw.subtract_from(px, self.xx),
            xy: self.xw.subtract_from(py, self.xy),
            yy: self.yw.subtract_from(py, self.yy),
            xw: px * k,
            yw: py * k,
            ww: self.ww * previous,
            gx: self.xw.subtract_from(constant, self.gx),
            gy: self.yw.subtract_from(constant, self.gy),
            gw: k * constant,
            skew: self.skew,
        };
        let mut elimination = Elimination { px: -px, py: -py, previous, constant: -constant, inverse };
        if ROUGH {
            let Skew { xy, xw, yw } = self.skew;
            let [sx, sy] = [xw * inverse, yw * inverse];
            left.xx = xw.mul_add(sx, left.xx);
            left.xy = xw.mul_add(sy, left.xy);
            left.yy = yw.mul_add(sy, left.yy);
            (left.gx, left.gy) = (xw.subtract_from(constant, left.gx), yw.subtract_from(constant, left.gy));
            let xy = self.xw.mul_add(sy, self.yw.subtract_from(sx, xy));
            left.skew = Skew { xy, xw: xw * previous, yw: yw * previous };
            (elimination.px, elimination.py) = (sx - px, sy - py);
        }
        (elimination, left, self.gw * constant)
    }

    /// The velocity that minimises V(p, 0), and twice the decrease.
    #[inline(always)]
    pub fn minimiser(&self) -> (Vector2<T>, T) {
        let step = self.minimiser_under(Vector2::new(self.gx, self.gy));
        (step, -(self.gx * step.x + self.gy * step.y))
    }

    /// The velocity that minimises V(p, 0) with another linear term.
    #[inline(always)]
    pub fn minimiser_under(&self, g: Vector2<T>) -> Vector2<T> {
        let [xy, yx] = [self.xy + self.skew.xy, self.xy - self.skew.xy];
        let determinant = xy.subtract_from(yx, self.xx * self.yy);
        let x = self.yy.subtract_from(g.x, xy * g.y) / determinant;
        let y = self.xx.subtract_from(g.y, yx * g.x) / determinant;
        Vector2::new(x, y)
    }
}

impl<T: Real> Skew<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self { xy: T::zero(), xw: T::zero(), yw: T::zero() }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self { xy: self.xy + other.xy, xw: self.xw + other.xw, yw: self.yw + other.yw }
    }

    /// g + K step.
    #[inline(always)]
    fn add_to(&self, g: Vector3<T>, step: &Vector3<T>) -> Vector3<T> {
        let Self { xy, xw, yw } = *self;
        Vector3::new(
            xy.mul_add(step.y, xw.mul_add(step.z, g.x)),
            xy.subtract_from(step.x, yw.mul_add(step.z, g.y)),
            xw.subtract_from(step.x, yw.subtract_from(step.y, g.z)),
        )
    }

    #[inline(always)]
    fn seen_from_before(self, arm: T) -> Self {
        Self { xw: arm.mul_add(self.xy, self.xw), ..self }
    }

    #[inline(always)]
    fn turned_back(self, joint: &Heading<T>) -> Self {
        let w = joint.to_world(Vector2::new(self.xw, self.yw));
        Self { xy: self.xy, xw: w.x, yw: w.y }
    }
}

impl<T: Real> Elimination<T> {
    fn zero() -> Self {
        let zero = T::zero();
        Self { px: zero, py: zero, previous: zero, constant: zero, inverse: zero }
    }
}

impl<T: Real> Segment<T> {
    /// A link of heading `heading` behind one of heading `before`; for the first link that is its own.
    #[inline(always)]
    pub fn new(heading: &Heading<T>, before: &Heading<T>, arms: [T; 2]) -> Self {
        let (elimination, column) = (Elimination::zero(), [T::zero(); 2]);
        Self { turn: heading.relative_to(before), arms, elimination, column }
    }

    /// Puts another link in the place of this one; what an elimination left stays.
    #[inline(always)]
    pub fn place(&mut self, heading: &Heading<T>, before: &Heading<T>, arms: [T; 2]) {
        (self.turn, self.arms) = (heading.relative_to(before), arms);
    }

    /// Eliminates omega_i, given the value of all that lies behind the far end and the link's own model at its CG,
    /// both in its frame, and the stiffness of the joint before it. Returns the value at the near end in the frame
    /// of the link before, and twice the decrease.
    #[inline(always)]
    pub fn eliminate<const ROUGH: bool>(
        &mut self,
        behind: Quadratic<T>,
        own: Quadratic<T>,
        stiffness: T,
    ) -> (Quadratic<T>, T) {
        let [near, far] = self.arms;
        let total = behind.seen_from_before::<ROUGH>(near + far).plus::<ROUGH>(own.seen_from_before::<ROUGH>(near));
        let (elimination, left, decrease) = total.eliminate::<ROUGH>(stiffness);
        self.elimination = elimination;
        if ROUGH {
            let Quadratic { xw, yw, skew, .. } = total;
            let inverse = -elimination.inverse;
            self.column = [(xw + skew.xw) * inverse, (yw + skew.yw) * inverse];
        }
        (left.turned_back::<ROUGH>(&self.turn), decrease)
    }

    /// The twist of the link in its frame, given the velocity of its near end in the frame of the link before and
    /// the angular velocity of that; both go on to the next link.
    #[inline(always)]
    pub fn substitute(&self, end: &mut Vector2<T>, omega: &mut T) -> Vector3<T> {
        self.substitute_with(self.elimination.constant, end, omega)
    }

    /// Repeats the last elimination with another linear term `own` of the link at its CG and `behind` of all that lies
    /// behind its far end, (g_x, g_y, g_omega) in its frame. Returns that at the near end in the frame of the link
    /// before, and the constant for [`Self::substitute_with`]. That elimination was `ROUGH`.
    #[inline(always)]
    pub fn eliminate_linear(&self, behind: &Vector3<T>, own: &Vector3<T>) -> (Vector3<T>, T) {
        let (e, [near, far]) = (&self.elimination, self.arms);
        let turning = (near + far).mul_add(behind.y, near.mul_add(own.y, own.z + behind.z));
        let [cx, cy] = self.column;
        let (x, y) = (cx.mul_add(turning, own.x + behind.x), cy.mul_add(turning, own.y + behind.y));
        let before = self.turn.to_world(Vector2::new(x, y));
        (Vector3::new(before.x, before.y, e.previous * turning), -(turning * e.inverse))
    }

    /// [`Self::substitute`] with the constant of another linear term.
    #[inline(always)]
    pub fn substitute_with(&self, constant: T, end: &mut Vector2<T>, omega: &mut T) -> Vector3<T> {
        let (e, near) = (&self.elimination, self.turn.to_link(*end));
        *omega = e.px.mul_add(near.x, e.py.mul_add(near.y, e.previous.mul_add(*omega, constant)));
        self.move_along(near, *omega, end)
    }

    /// The same for an angular velocity that is given.
    #[inline(always)]
    pub fn follow(&self, omega: T, end: &mut Vector2<T>) -> Vector3<T> {
        self.move_along(self.turn.to_link(*end), omega, end)
    }

    #[inline(always)]
    fn move_along(&self, near: Vector2<T>, omega: T, end: &mut Vector2<T>) -> Vector3<T> {
        let centre = self.arms[0].mul_add(omega, near.y);
        *end = Vector2::new(near.x, self.arms[1].mul_add(omega, centre));
        Vector3::new(near.x, centre, omega)
    }
}
