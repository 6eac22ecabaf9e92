//! One link in the solver: inertia, the laws that act on it, and its motion during a Newton step.

use nalgebra::{Vector2, Vector3};

use crate::laws::{Halves, Skin, SurfaceEvaluation, Symmetric2, Whole};
use crate::math::{Mask, Real};
use crate::solver::{ActuatorTerm, SurfaceTerm};

use super::friction_term::{FrictionLaw, FrictionTerm};
use super::progress::PassLanes;
use super::ray_laws::RayLaws;
use super::sweep::{Affine, PointStiffness, Segment};
use super::terms::ContactTerm;
use crate::spatial::spatial_vector::{
    Momentum, Twist, Wrench, along, difference, inner, scaled, sum, sum_with_cross, zero_vector,
};
use crate::spatial::{Stage, StageFriction, StageSolution};

/// What all contacts with the ground share.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundLaws<T> {
    /// Stiffness r of all contacts.
    pub penalty: T,
    pub sliding: FrictionLaw<T>,
    pub rolling: FrictionLaw<T>,
    /// Of links that slide otherwise forward than backward.
    pub skin: Option<Skin>,
}

/// Contact of one end sphere with the ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroundTerm<T: Real> {
    /// Of its sliding friction that is left.
    share: T,
    pub normal: ContactTerm<T>,
    pub friction: FrictionTerm<T>,
}

/// A contact of a link with the ground where it was last evaluated: force and stiffness on the contact point, frame I.
#[derive(Debug, Clone, Copy)]
struct GroundForce<T> {
    force: Vector3<T>,
    stiffness: PointStiffness<T>,
    /// The normal impulse that friction radii follow, and how far that of sliding was from what belongs to it \[N s\].
    load: T,
    radius_error: T,
}

/// A link as a pass over the chain needs it: as few numbers as possible, so that all links of a register stay near the
/// processor.
#[derive(Debug, Clone, Copy)]
pub(super) struct LinkTerm<T: Real> {
    pub segment: Segment<T>,
    /// e_z^B.
    axis: Vector3<T>,
    pub momentum: Momentum<T>,
    pub mass: T,
    pub inverse_mass: T,
    /// Theta_psi, and how much larger Theta_rho is.
    inertia: T,
    roll_excess: T,
    /// Coordinates of the spheres' centres along it, from the CG.
    spheres: [T; 2],
    radius: T,
    /// From horizontal velocities to the slip gamma^ of [`FrictionTerm`]: S times the directions of frame Pi, as rows.
    slip: [Vector2<T>; 2],
    pub ends: [GroundTerm<T>; 2],
    pub rolling: FrictionTerm<T>,
    /// The joint to the link before; none for the first.
    pub actuators: [ActuatorTerm<T>; 2],
    /// Twist and rates before the present Newton step until [`Self::go`], from then on where it led; and the step.
    pub twist: Twist<T>,
    pub rates: [T; 2],
    pub step: Twist<T>,
    pub step_rates: [T; 2],
}

impl<T: Real> GroundLaws<T> {
    #[inline(always)]
    pub fn new(mu: &StageFriction<T>, penalty: T) -> Self {
        let rolling = Vector2::new(mu.rolling, mu.rolling);
        let (sliding, rolling) = (FrictionLaw::new(mu.sliding, penalty), FrictionLaw::new(rolling, penalty));
        Self { penalty, sliding, rolling, skin: mu.skin }
    }
}

impl<T: Real> GroundTerm<T> {
    /// The laws at end `end` of link `i` with the friction radius of the starting impulses in `solution`.
    #[inline(always)]
    pub fn new(stage: &Stage<T>, solution: &StageSolution<T>, i: usize, end: usize, laws: &GroundLaws<T>) -> Self {
        let (link, (normal, friction, _)) = (&stage.links[i], solution.ground(i));
        let impulse = normal[end];
        let share = link.share[end];
        let radius = share * laws.sliding.radius(impulse);
        Self {
            share,
            normal: ContactTerm::new(link.ground[end], laws.penalty, impulse),
            friction: FrictionTerm::new(&laws.sliding, radius, &friction[end]),
        }
    }

    /// Radius that belongs to the present normal impulse.
    #[inline(always)]
    fn wanted_radius(&self, laws: &GroundLaws<T>) -> T {
        self.share * laws.sliding.radius(self.normal.value)
    }
}

impl<T: Real> LinkTerm<T> {
    /// Room for a link.
    pub fn vacant() -> Self {
        let (zero, none) = (T::zero(), Vector2::new(T::zero(), T::zero()));
        let friction = FrictionTerm::new(&FrictionLaw::new(none, zero), zero, &none);
        let end = GroundTerm { share: zero, normal: ContactTerm::new(zero, zero, zero), friction };
        Self {
            segment: Segment::vacant(),
            axis: zero_vector(),
            momentum: Momentum::zero(),
            mass: zero,
            inverse_mass: zero,
            inertia: zero,
            roll_excess: zero,
            spheres: [zero; 2],
            radius: zero,
            slip: [none; 2],
            ends: [end; 2],
            rolling: friction,
            actuators: [ActuatorTerm::none(); 2],
            twist: Twist::zero(),
            rates: [zero; 2],
            step: Twist::zero(),
            step_rates: [zero; 2],
        }
    }

    /// Begins a stage at a twist, moving at these rates about the joint before the link. In place: returned by value, a link
    /// is copied through memory.
    #[inline(always)]
    pub fn begin(
        &mut self,
        stage: &Stage<T>,
        solution: &StageSolution<T>,
        i: usize,
        laws: &GroundLaws<T>,
        (twist, rates, actuators): (Twist<T>, [T; 2], [ActuatorTerm<T>; 2]),
    ) {
        let (link, shape, tangent) = (&stage.links[i], &laws.sliding.shape, &stage.links[i].tangent);
        let ([front, rear], _, rolling) = solution.ground(i);
        (self.axis, self.momentum) = (link.axes[2], link.momentum);
        (self.mass, self.inverse_mass) = (link.mass, T::splat(1.0) / link.mass);
        (self.inertia, self.roll_excess) = (link.inertia, link.roll_inertia - link.inertia);
        (self.spheres, self.radius) = (link.spheres(), link.radius);
        self.slip[0] = Vector2::new(shape.x * tangent.x, shape.x * tangent.y);
        self.slip[1] = Vector2::new(-(shape.y * tangent.y), shape.y * tangent.x);
        self.ends[0] = GroundTerm::new(stage, solution, i, 0, laws);
        self.ends[1] = GroundTerm::new(stage, solution, i, 1, laws);
        self.rolling = FrictionTerm::new(&laws.rolling, laws.rolling.radius(front + rear), &rolling);
        (self.actuators, self.twist, self.rates) = (actuators, twist, rates);
        (self.step, self.step_rates) = (Twist::zero(), [T::zero(); 2]);
    }

    /// M x.
    #[inline(always)]
    pub fn momentum_of(&self, twist: &Twist<T>) -> Momentum<T> {
        let spin = self.roll_excess * inner(&self.axis, &twist.angular);
        Momentum {
            linear: scaled(&twist.linear, self.mass),
            angular: along(&scaled(&twist.angular, self.inertia), &self.axis, spin),
        }
    }

    /// From the CG to the contact points of both spheres (T 4.23).
    #[inline(always)]
    fn arms(&self) -> [Vector3<T>; 2] {
        // A map would be compiled as a function without the instructions of the kernel.
        let (r, s) = (scaled(&self.axis, self.spheres[0]), scaled(&self.axis, self.spheres[1]));
        [Vector3::new(r.x, r.y, r.z - self.radius), Vector3::new(s.x, s.y, s.z - self.radius)]
    }

    /// Slip gamma^ and vertical velocity of a contact point under a twist (T 4.24), (T 4.39).
    #[inline(always)]
    fn contact_velocity(&self, arm: &Vector3<T>, x: &Twist<T>) -> (Vector2<T>, T) {
        let (v, [p, q]) = (x.velocity_at(arm), &self.slip);
        (Vector2::new(p.x.mul_add(v.x, p.y * v.y), q.x.mul_add(v.x, q.y * v.y)), v.z)
    }

    /// A force or stiffness in frame I, of one in the coordinates of the disc.
    #[inline(always)]
    fn out_of_disc(&self, f: &Vector2<T>) -> Vector2<T> {
        let [p, q] = &self.slip;
        Vector2::new(p.x.mul_add(f.x, q.x * f.y), p.y.mul_add(f.x, q.y * f.y))
    }

    #[inline(always)]
    fn stiffness_out_of_disc(&self, k: &Symmetric2<T>) -> Symmetric2<T> {
        let [p, q] = &self.slip;
        let along = Vector2::new(k.xx.mul_add(p.x, k.xy * q.x), k.xx.mul_add(p.y, k.xy * q.y));
        let across = Vector2::new(k.xy.mul_add(p.x, k.yy * q.x), k.xy.mul_add(p.y, k.yy * q.y));
        Symmetric2 {
            xx: p.x.mul_add(along.x, q.x * across.x),
            xy: p.x.mul_add(along.y, q.x * across.y),
            yy: p.y.mul_add(along.y, q.y * across.y),
        }
    }

    /// Moves all ground laws to the present twist and adds gradient and tangent to `model`, with those of
    /// |x - M^-1 p|_M^2 / 2. The friction laws first take the radii that belong to the normal impulses, where these are
    /// plausible. Returns how far they are from those, as a velocity.
    #[inline(always)]
    pub fn evaluate<const RECENTRING: bool>(
        &mut self,
        halves: impl Halves,
        model: &mut Affine<T>,
        laws: &GroundLaws<T>,
        lanes: &PassLanes<T>,
    ) -> T {
        let arms = self.arms();
        let front = self.touch::<RECENTRING>(0, &arms[0], halves, laws, lanes);
        let rear = self.touch::<RECENTRING>(1, &arms[1], halves, laws, lanes);
        let rolling_error =
            self.rolling.follow(laws.rolling.radius(front.load + rear.load), lanes.plausible * self.mass);
        let wanted = laws.rolling.strength * (self.ends[0].normal.value + self.ends[1].normal.value);
        let velocity = self.rolling_velocity(&self.twist);
        let law = &laws.rolling;
        let tangent = self.rolling.evaluate::<RECENTRING>(Whole, law, &velocity, (rolling_error, wanted), lanes);
        let by_load = times(law.strength * self.radius, &tangent.by_radius);
        let rolling = (self.rolling.value, tangent.stiffness, by_load);
        self.add_to(model, [&front, &rear], [&arms[0], &arms[1]], rolling);
        front.radius_error.max(rear.radius_error).max(rolling_error) * self.inverse_mass
    }

    /// Moves the laws of one end, whose contact point is `arm` from the CG, to the present twist. A loop over both ends would
    /// keep what it finds in memory.
    #[inline(always)]
    fn touch<const RECENTRING: bool>(
        &mut self,
        end: usize,
        arm: &Vector3<T>,
        halves: impl Halves,
        laws: &GroundLaws<T>,
        lanes: &PassLanes<T>,
    ) -> GroundForce<T> {
        let (slip, closing) = self.contact_velocity(arm, &self.twist);
        let most = lanes.plausible * self.mass;
        let term = &mut self.ends[end];
        let normal = term.normal.evaluate(closing);
        let touches = T::zero().lt(normal) | T::zero().lt(term.friction.radius);
        if !touches.any() {
            // A sphere in the air: its laws contribute nothing.
            term.normal.recentre(lanes.recentred);
            term.friction.vanish(lanes.recentred);
            return GroundForce::none();
        }
        let load = term.normal.value;
        let radius_error = term.friction.follow(term.wanted_radius(laws), most);
        if RECENTRING {
            term.normal.recentre_here(closing, normal, lanes.recentred);
        }
        let (bearing, strength) = (term.normal.value, term.share * laws.sliding.strength);
        let radius = (radius_error, strength * bearing);
        let tangent = term.friction.evaluate::<RECENTRING>(halves, &laws.sliding, &slip, radius, lanes);
        let value = term.friction.value;
        let by_load = times(strength * normal, &tangent.by_radius);
        let (friction, sliding) = (self.out_of_disc(&value), self.stiffness_out_of_disc(&tangent.stiffness));
        GroundForce {
            force: Vector3::new(friction.x, friction.y, bearing),
            stiffness: PointStiffness { sliding, coupling: self.out_of_disc(&by_load), normal },
            load,
            radius_error,
        }
    }

    /// Moves the friction of something that can be pushed to the present twist, multipliers to the impulses in the lanes
    /// `recentred`, and adds gradient and tangent as [`Self::evaluate`]. Returns how far the centre is from the impulse,
    /// squared \[N^2 s^2\].
    #[inline(always)]
    pub fn evaluate_surface(
        &self,
        surface: &mut SurfaceTerm<T>,
        model: &mut Affine<T>,
        laws: &GroundLaws<T>,
        recentred: T::Mask,
    ) -> T {
        let twist = self.twist.in_plane();
        if recentred.any() {
            surface.evaluate(&twist);
            surface.recentre(recentred);
        }
        let SurfaceEvaluation { across, stiffness, along, .. } = surface.evaluate(&twist);
        let impulse = surface.impulse();
        let change = self.momentum_of(&self.twist).plus_scaled(&self.momentum, -T::splat(1.0));
        model.gradient = model.gradient.plus_scaled(&change, T::splat(1.0));
        model.gradient = model.gradient.plus_scaled(&Wrench::upright(&impulse), -T::splat(1.0));
        let [a, b, c] = &mut model.matrix.linear;
        (a.x, b.y, c.z) = (a.x + self.mass + across.x, b.y + self.mass + across.y, c.z + self.mass);
        let [a, b, c] = &mut model.matrix.angular;
        (a.x, b.y) = (a.x + self.inertia, b.y + self.inertia);
        c.z += self.inertia + self.roll_excess + across.z;
        model.add_rank_one(&Wrench::upright(&along), -stiffness, T::zero());
        surface.squared_error(&twist, self.mass) * laws.penalty * laws.penalty
    }

    /// How far the laws' centres are from the impulses at most, squared \[N^2 s^2\].
    #[inline(always)]
    pub fn squared_error(&self, halves: impl Halves, laws: &GroundLaws<T>) -> T {
        let [front, rear] = &self.ends;
        let normal = front.normal.squared_error().max(rear.normal.squared_error());
        let sliding = &laws.sliding;
        let friction = front.friction.squared_error(halves, sliding).max(rear.friction.squared_error(halves, sliding));
        normal.max(friction).max(self.rolling.squared_error(Whole, &laws.rolling))
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

    /// Radii of [`Self::frictions`], and those of the normal impulses \[N s\].
    #[inline(always)]
    pub fn radii(&mut self, laws: &GroundLaws<T>) -> [(&mut T, T); 3] {
        let [front, rear] = &mut self.ends;
        let load = front.normal.value + rear.normal.value;
        let (of_front, of_rear) = (front.wanted_radius(laws), rear.wanted_radius(laws));
        [
            (&mut front.friction.radius, of_front),
            (&mut rear.friction.radius, of_rear),
            (&mut self.rolling.radius, laws.rolling.radius(load)),
        ]
    }

    /// Adds all terms of the link at once, so that each entry is stored once. Rolling friction of both ends (T 4.86) is a
    /// function of L_SC (omega_x, omega_y): a disc may be turned.
    #[inline(always)]
    fn add_to(
        &self,
        model: &mut Affine<T>,
        [front, rear]: [&GroundForce<T>; 2],
        [r, s]: [&Vector3<T>; 2],
        (rolling, k, by_load): (Vector2<T>, Symmetric2<T>, Vector2<T>),
    ) {
        let missing = self.momentum_of(&self.twist).plus_scaled(&self.momentum, -T::splat(1.0));
        let Momentum { linear, angular } = &mut model.gradient;
        *linear = difference(&sum(linear, &missing.linear), &sum(&front.force, &rear.force));
        *angular = sum_with_cross(&sum(angular, &missing.angular), &front.force, r);
        *angular = sum_with_cross(angular, &rear.force, s);
        angular.x = self.radius.subtract_from(rolling.x, angular.x);
        angular.y = self.radius.subtract_from(rolling.y, angular.y);
        let matrix = &mut model.matrix;
        let [a, b, c] = &mut matrix.linear;
        (a.x, b.y, c.z) = (a.x + self.mass, b.y + self.mass, c.z + self.mass);
        matrix.add_at(r, &front.stiffness);
        matrix.add_at(s, &rear.stiffness);
        // Rolling friction falls with the vertical velocities of both contact points.
        let (p, q) = (front.stiffness.normal, rear.stiffness.normal);
        let (bearing, load) = (p + q, Vector2::new(p.mul_add(r.y, q * s.y), -p.mul_add(r.x, q * s.x)));
        let [a, b, _] = &mut matrix.back;
        (a.z, b.z) = (by_load.x.mul_add(bearing, a.z), by_load.y.mul_add(bearing, b.z));
        let (axis, spin, squared) = (&self.axis, scaled(&self.axis, self.roll_excess), self.radius * self.radius);
        let [a, b, c] = &mut matrix.angular;
        (*a, *b, *c) = (along(a, &spin, axis.x), along(b, &spin, axis.y), along(c, &spin, axis.z));
        a.x += by_load.x.mul_add(load.x, squared.mul_add(k.xx, self.inertia));
        a.y += by_load.x.mul_add(load.y, squared * k.xy);
        b.x += by_load.y.mul_add(load.x, squared * k.xy);
        b.y += by_load.y.mul_add(load.y, squared.mul_add(k.yy, self.inertia));
        c.z += self.inertia;
    }

    /// L_SC (omega_x, omega_y): gamma_V of (T 4.43) turned by a right angle.
    #[inline(always)]
    fn rolling_velocity(&self, x: &Twist<T>) -> Vector2<T> {
        Vector2::new(self.radius * x.angular.x, self.radius * x.angular.y)
    }

    /// Adds all ground laws along the step.
    #[inline(always)]
    pub fn add_ground_along(&self, halves: impl Halves, laws: &GroundLaws<T>, ray: &mut RayLaws<T>) {
        let (gamma, rate) = (self.rolling_velocity(&self.twist), self.rolling_velocity(&self.step));
        self.rolling.add_along(Whole, &laws.rolling, &gamma, &rate, ray);
        for (end, arm) in self.ends.iter().zip(&self.arms()) {
            let (slip, closing) = self.contact_velocity(arm, &self.twist);
            let (slip_change, closing_change) = self.contact_velocity(arm, &self.step);
            end.normal.add_along(closing, closing_change, ray);
            end.friction.add_along(halves, &laws.sliding, &slip, &slip_change, ray);
        }
    }

    /// The Newton step of the link and of the joint before it, given the step of the link before. Returns the step of the
    /// link's twist.
    #[inline(always)]
    pub fn take_step(&mut self, before: &Twist<T>) -> Twist<T> {
        (self.step_rates, self.step) = self.segment.substitute(before);
        self.step
    }

    /// The twist a fraction of the step on, in the given lanes.
    #[inline(always)]
    pub fn twist_after(&self, fraction: T, lanes: T::Mask) -> Twist<T> {
        let mut twist = self.twist;
        twist.select_into(lanes, &self.twist.plus_scaled(&self.step, fraction));
        twist
    }

    /// Moves a fraction of the step on, in the given lanes.
    #[inline(always)]
    pub fn go(&mut self, fraction: T, lanes: T::Mask) {
        self.twist = self.twist_after(fraction, lanes);
        for axis in 0..2 {
            let there = self.rates[axis] + fraction * self.step_rates[axis];
            self.rates[axis] = T::select(lanes, there, self.rates[axis]);
        }
    }
}

impl<T: Real> GroundForce<T> {
    #[inline(always)]
    fn none() -> Self {
        let zero = T::zero();
        Self {
            force: Vector3::new(zero, zero, zero),
            stiffness: PointStiffness {
                sliding: Symmetric2 { xx: zero, xy: zero, yy: zero },
                coupling: Vector2::new(zero, zero),
                normal: zero,
            },
            load: zero,
            radius_error: zero,
        }
    }
}

#[inline(always)]
fn times<T: Real>(factor: T, v: &Vector2<T>) -> Vector2<T> {
    Vector2::new(factor * v.x, factor * v.y)
}
