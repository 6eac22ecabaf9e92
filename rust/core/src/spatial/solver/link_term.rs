//! One link in the solver: inertia, the laws that act on it, and its motion during a Newton step.

use nalgebra::{Vector2, Vector3};

use crate::laws::Symmetric2;
use crate::math::{Mask, Real};

use super::friction_term::{FrictionLaw, FrictionTerm};
use super::sweep::{Quadratic, Segment, Symmetric};
use super::terms::{ActuatorTerm, ContactTerm, horizontal};
use crate::spatial::spatial_vector::{Twist, cross, difference, scaled, sum};
use crate::spatial::{Stage, StageFriction, StageLink, StageSolution};

/// What all contacts with the ground share.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundLaws<T> {
    /// Stiffness r of all contacts.
    pub penalty: T,
    pub sliding: FrictionLaw<T>,
    pub rolling: FrictionLaw<T>,
}

/// Contact of one end sphere with the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundTerm<T: Real> {
    /// From the CG to the contact point.
    arm: Vector3<T>,
    /// Of its sliding friction that is left.
    share: T,
    pub normal: ContactTerm<T>,
    pub friction: FrictionTerm<T>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct LinkTerm<T: Real> {
    pub segment: Segment<T>,
    pub link: StageLink<T>,
    pub inverse_mass: T,
    pub ends: [GroundTerm<T>; 2],
    pub rolling: FrictionTerm<T>,
    /// The joint to the link before; none for the first.
    pub actuators: [ActuatorTerm<T>; 2],
    /// Twist and rates before the present Newton step, the step, and where it leads.
    pub start: Twist<T>,
    pub step: Twist<T>,
    pub twist: Twist<T>,
    pub start_rates: [T; 2],
    pub step_rates: [T; 2],
    pub rates: [T; 2],
    pub ray: Ray<T>,
}

/// Velocities at the laws before a Newton step, and their change by it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray<T> {
    /// Slip and vertical velocity at both ends.
    pub slip: [Vector2<T>; 2],
    pub slip_change: [Vector2<T>; 2],
    pub closing: [T; 2],
    pub closing_change: [T; 2],
    pub rolling: Vector2<T>,
    pub rolling_change: Vector2<T>,
}

impl<T: Real> Ray<T> {
    #[inline(always)]
    pub fn none() -> Self {
        let zero = T::zero();
        let none = Vector2::new(zero, zero);
        Self {
            slip: [none; 2],
            slip_change: [none; 2],
            closing: [zero; 2],
            closing_change: [zero; 2],
            rolling: none,
            rolling_change: none,
        }
    }
}

impl<T: Real> GroundLaws<T> {
    #[inline(always)]
    pub fn new(mu: &StageFriction<T>, penalty: T) -> Self {
        let rolling = Vector2::new(mu.rolling, mu.rolling);
        Self { penalty, sliding: FrictionLaw::new(mu.sliding, penalty), rolling: FrictionLaw::new(rolling, penalty) }
    }
}

impl<T: Real> GroundTerm<T> {
    /// The laws at end `end` of link `i` with the friction radius of the starting impulses in `solution`.
    #[inline(always)]
    pub fn new(stage: &Stage<T>, solution: &StageSolution<T>, i: usize, end: usize, laws: &GroundLaws<T>) -> Self {
        let (link, impulse) = (&stage.links[i], solution.normal[i][end]);
        let share = link.share[end];
        let radius = share * laws.sliding.radius(impulse);
        Self {
            arm: link.ground_arm(end),
            share,
            normal: ContactTerm::new(link.ground[end], laws.penalty, impulse),
            friction: FrictionTerm::new(&laws.sliding, radius, &solution.friction[i][end]),
        }
    }

    /// Slip in frame Pi and vertical velocity of the contact point (T 4.24), (T 4.39).
    #[inline(always)]
    pub fn velocity(&self, x: &Twist<T>, tangent: &Vector2<T>) -> (Vector2<T>, T) {
        let v = x.velocity_at(&self.arm);
        (into_frame(tangent, &horizontal(&v)), v.z)
    }

    /// Adds gradient and Hessian of both laws at the velocities of their last evaluation.
    #[inline(always)]
    fn add_to(
        &self,
        model: &mut Quadratic<T>,
        tangent: &Vector2<T>,
        law: &FrictionLaw<T>,
        normal: T,
        stick: &Symmetric2<T>,
    ) {
        let force = out_of_frame(tangent, &self.friction.impulse(law));
        let (fx, fy, fz) = (force.x, force.y, self.normal.value);
        let r = &self.arm;
        let gradient = &mut model.gradient;
        let force = Vector3::new(fx, fy, fz);
        gradient.linear = difference(&gradient.linear, &force);
        gradient.angular = difference(&gradient.angular, &cross(r, &force));
        let k = turned(stick, tangent);
        model.linear.xx += k.xx;
        model.linear.xy += k.xy;
        model.linear.yy += k.yy;
        model.linear.zz += normal;
        // -K [r], and with it -[r]^T ... = [r] (-K [r]): the stiffness seen from the CG.
        let x = Vector3::new(-(k.xy * r.z), k.xx * r.z, k.xy * r.x - k.xx * r.y);
        let y = Vector3::new(-(k.yy * r.z), k.xy * r.z, k.yy * r.x - k.xy * r.y);
        let z = Vector3::new(normal * r.y, -(normal * r.x), T::zero());
        let c = &mut model.angular;
        c.xx += r.y * z.x - r.z * y.x;
        c.xy += r.y * z.y - r.z * y.y;
        c.xz -= r.z * y.z;
        c.yy += r.z * x.y - r.x * z.y;
        c.yz += r.z * x.z;
        c.zz += r.x * y.z - r.y * x.z;
        let mixed = &mut model.mixed;
        *mixed = [sum(&mixed[0], &x), sum(&mixed[1], &y), sum(&mixed[2], &z)];
    }
}

impl<T: Real> LinkTerm<T> {
    /// |x - M^-1 p|_M^2 / 2 at the present twist.
    #[inline(always)]
    pub fn inertia_model(&self) -> Quadratic<T> {
        let link = &self.link;
        let mut model = Quadratic::zero();
        model.linear = Symmetric::diagonal(link.mass);
        model.angular = Symmetric::diagonal(link.inertia);
        let axis = &link.axes[2];
        model.angular.add_outer(axis, &scaled(axis, link.roll_inertia - link.inertia));
        model.gradient = link.momentum_of(&self.twist).plus_scaled(&link.momentum, -T::splat(1.0));
        model
    }

    /// Moves all ground laws to the present twist and adds gradient and Hessian to `model`. In the lanes `coupled` the
    /// friction laws first take the radii that belong to the normal impulses. Returns how far the radii are from those,
    /// as a velocity.
    #[inline(always)]
    pub fn evaluate_ground<const RECENTRING: bool>(
        &mut self,
        model: &mut Quadratic<T>,
        laws: &GroundLaws<T>,
        coupled: T::Mask,
        recentred: T::Mask,
    ) -> T {
        let (twist, tangent) = (self.twist, self.link.tangent);
        let mut error = T::zero();
        let mut load = T::zero();
        for end in &mut self.ends {
            let (slip, closing) = end.velocity(&twist, &tangent);
            let normal = end.normal.evaluate(closing);
            let wanted = end.share * laws.sliding.radius(end.normal.value);
            let held = end.friction.radius;
            let touches = T::zero().lt(normal) | T::zero().lt(held);
            if !touches.any() {
                // A sphere in the air: its laws contribute nothing.
                end.friction.vanish();
                continue;
            }
            error = error.max((wanted - held).abs());
            end.friction.radius = T::select(coupled, wanted, held);
            load += end.normal.value;
            let stick = end.friction.evaluate(&laws.sliding, &slip);
            if RECENTRING {
                end.normal.recentre_here(closing, normal, recentred);
                end.friction.recentre_here(&laws.sliding, &slip, &stick, recentred);
            }
            end.add_to(model, &tangent, &laws.sliding, normal, &stick);
        }
        let (wanted, held) = (laws.rolling.radius(load), self.rolling.radius);
        error = error.max((wanted - held).abs());
        self.rolling.radius = T::select(coupled, wanted, held);
        self.evaluate_rolling::<RECENTRING>(model, &laws.rolling, recentred);
        error * self.inverse_mass
    }

    /// How far the laws' centres are from the impulses at most, squared \[N^2 s^2\].
    #[inline(always)]
    pub fn squared_error(&self, laws: &GroundLaws<T>) -> T {
        let [front, rear] = &self.ends;
        let normal = front.normal.squared_error().max(rear.normal.squared_error());
        let friction = front.friction.squared_error(&laws.sliding).max(rear.friction.squared_error(&laws.sliding));
        normal.max(friction).max(self.rolling.squared_error(&laws.rolling))
    }

    /// Largest radius of the ends' friction, over the mass \[m/s\].
    #[inline(always)]
    pub fn largest_radius(&self) -> T {
        self.ends[0].friction.radius.max(self.ends[1].friction.radius) * self.inverse_mass
    }

    /// All friction laws.
    #[inline(always)]
    pub fn frictions(&mut self) -> [&mut FrictionTerm<T>; 3] {
        let [front, rear] = &mut self.ends;
        [&mut front.friction, &mut rear.friction, &mut self.rolling]
    }

    /// Friction radii that belong to the present normal impulses.
    #[inline(always)]
    pub fn take_radii(&mut self, laws: &GroundLaws<T>) {
        for end in &mut self.ends {
            end.friction.radius = end.share * laws.sliding.radius(end.normal.value);
        }
        self.rolling.radius = laws.rolling.radius(self.ends[0].normal.value + self.ends[1].normal.value);
    }

    /// Rolling friction of both ends (T 4.86), as a function of L_SC (omega_x, omega_y): a disc may be turned.
    #[inline(always)]
    fn evaluate_rolling<const RECENTRING: bool>(
        &mut self,
        model: &mut Quadratic<T>,
        law: &FrictionLaw<T>,
        recentred: T::Mask,
    ) {
        let arm = self.link.radius;
        let velocity = rolling_velocity(&self.link, &self.twist);
        let stiffness = self.rolling.evaluate(law, &velocity);
        if RECENTRING {
            self.rolling.recentre_here(law, &velocity, &stiffness, recentred);
        }
        let squared = arm * arm;
        model.angular.xx += squared * stiffness.xx;
        model.angular.xy += squared * stiffness.xy;
        model.angular.yy += squared * stiffness.yy;
        let gradient = &mut model.gradient.angular;
        let impulse = self.rolling.impulse(law);
        gradient.x -= arm * impulse.x;
        gradient.y -= arm * impulse.y;
    }

    /// Prepares the line search along the current step.
    #[inline(always)]
    pub fn look_along_step(&mut self) {
        let tangent = &self.link.tangent;
        for (i, end) in self.ends.iter().enumerate() {
            (self.ray.slip[i], self.ray.closing[i]) = end.velocity(&self.start, tangent);
            (self.ray.slip_change[i], self.ray.closing_change[i]) = end.velocity(&self.step, tangent);
        }
        self.ray.rolling = rolling_velocity(&self.link, &self.start);
        self.ray.rolling_change = rolling_velocity(&self.link, &self.step);
    }

    /// The Newton step of the link and of the joint before it, given the step of the link before; that of link 1, which
    /// has no joint before it, is given. Returns the step of the link's twist.
    #[inline(always)]
    pub fn take_step(&mut self, has_joint: bool, before: Twist<T>) -> Twist<T> {
        self.step = before;
        if has_joint {
            (self.step_rates, self.step) = self.segment.substitute(&before);
        }
        self.step
    }

    /// The twist a fraction of the step on, in the given lanes.
    #[inline(always)]
    pub fn twist_after(&self, fraction: T, lanes: T::Mask) -> Twist<T> {
        let mut twist = self.twist;
        twist.select_into(lanes, &self.start.plus_scaled(&self.step, fraction));
        twist
    }

    /// Moves a fraction of the step on, in the given lanes.
    #[inline(always)]
    pub fn go(&mut self, fraction: T, lanes: T::Mask) {
        self.twist = self.twist_after(fraction, lanes);
        for axis in 0..2 {
            let shortened = self.start_rates[axis] + fraction * self.step_rates[axis];
            self.rates[axis] = T::select(lanes, shortened, self.rates[axis]);
        }
    }
}

/// L_SC (omega_x, omega_y): gamma_V of (T 4.43) turned by a right angle.
#[inline(always)]
fn rolling_velocity<T: Real>(link: &StageLink<T>, x: &Twist<T>) -> Vector2<T> {
    Vector2::new(link.radius * x.angular.x, link.radius * x.angular.y)
}

/// Components along and across `tangent`.
#[inline(always)]
fn into_frame<T: Real>(tangent: &Vector2<T>, v: &Vector2<T>) -> Vector2<T> {
    Vector2::new(tangent.x * v.x + tangent.y * v.y, tangent.x * v.y - tangent.y * v.x)
}

#[inline(always)]
fn out_of_frame<T: Real>(tangent: &Vector2<T>, v: &Vector2<T>) -> Vector2<T> {
    Vector2::new(tangent.x * v.x - tangent.y * v.y, tangent.y * v.x + tangent.x * v.y)
}

/// A stiffness along and across `tangent`, in frame I.
#[inline(always)]
fn turned<T: Real>(k: &Symmetric2<T>, tangent: &Vector2<T>) -> Symmetric2<T> {
    let (c, s) = (tangent.x, tangent.y);
    let (cc, cs, ss) = (c * c, c * s, s * s);
    let cross = (cs + cs) * k.xy;
    Symmetric2 {
        xx: cc * k.xx - cross + ss * k.yy,
        xy: cs * (k.xx - k.yy) + (cc - ss) * k.xy,
        yy: ss * k.xx + cross + cc * k.yy,
    }
}
