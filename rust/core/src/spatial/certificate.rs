//! The certificate of a stage's solution, computed from the stage's data and [`crate::judge`] only.
//!
//! Impulses and velocities solve a stage exactly when the equations of motion balance, the joints hold, and every law
//! holds with the present normal impulse as the radius of friction. Each violation is reported as a velocity.

use nalgebra::{Vector2, Vector3};

use crate::judge::{self, Mobility, worse};
use crate::math::Real;
use crate::robot::Axes;

use super::spatial_vector::{Twist, Wrench};
use super::stage::{Stage, StageLink, StageSolution};

/// Violations of a stage's equations; zero for the exact solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certificate<T = f64> {
    /// Worst imbalance of the equations of motion \[m/s\].
    pub balance: T,
    /// Worst velocity with which a joint opens or twists \[m/s\].
    pub joint: T,
    /// Worst violation of Signorini's law, ground, obstacles and links: |P - max(P - m gamma, 0)| / m \[m/s\].
    pub normal: T,
    /// Worst violation of maximal dissipation, sliding and rolling: |P - prox_C(P - m gamma)| / m \[m/s\].
    pub friction: T,
    /// Worst violation of an actuator's law \[m/s\].
    pub actuator: T,
}

impl<T: Real> Certificate<T> {
    /// The worst of all violations \[m/s\].
    #[inline(always)]
    pub fn residual(&self) -> T {
        let contact = worse(self.normal, self.friction);
        worse(worse(self.balance, self.joint), worse(contact, self.actuator))
    }
}

/// Verifies `solution` as a solution of `stage`.
#[inline(always)]
pub fn certify<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>) -> Certificate<T> {
    let zero = T::zero();
    let mut certificate = Certificate { balance: zero, joint: zero, normal: zero, friction: zero, actuator: zero };
    let mut squared_friction = zero;
    for i in 0..stage.chain() {
        verify_ground(stage, solution, i, &mut certificate, &mut squared_friction);
    }
    for (i, (axes, impulse)) in (stage.chain()..).zip(stage.surfaces.iter().zip(&solution.surface)) {
        let (link, x) = (&stage.links[i], &solution.twist[i]);
        let twist = Vector3::new(x.linear.x, x.linear.y, x.angular.z);
        let violation = judge::limit_surface(axes, &twist, impulse, link.mass, link.half_length).squared;
        squared_friction = worse(squared_friction, violation / (link.mass * link.mass));
    }
    verify_obstacle_friction(stage, solution, &mut squared_friction);
    certificate.friction = squared_friction.sqrt();
    let mass = |link: usize| stage.links[link].mass;
    let contacts = judge::rows(&stage.contacts, &solution.contact, &solution.twist, mass);
    let pairs = judge::rows(&stage.pairs, &solution.pair, &solution.twist, mass);
    certificate.normal = worse(certificate.normal, worse(contacts.0, pairs.0));
    for j in 0..stage.joints.len() {
        verify_joint(stage, solution, j, &mut certificate);
    }
    verify_balance(stage, solution, &mut certificate);
    certificate
}

#[inline(always)]
fn verify_ground<T: Real>(
    stage: &Stage<T>,
    solution: &StageSolution<T>,
    i: usize,
    certificate: &mut Certificate<T>,
    squared_friction: &mut T,
) {
    let (link, u, mu) = (&stage.links[i], &solution.twist[i], &stage.friction);
    let tangent = &link.tangent;
    let mobility = T::splat(1.0) / link.mass;
    let mut add_friction = |squared: T| {
        *squared_friction = worse(*squared_friction, squared * (mobility * mobility));
    };
    for end in 0..2 {
        let velocity = point_velocity(u, &lowest_point(link, end));
        let normal = solution.normal[i][end];
        let violation = judge::half_line(normal, velocity.z + link.ground[end], link.mass) * mobility;
        certificate.normal = worse(certificate.normal, violation);
        let slip = Vector2::new(
            tangent.x * velocity.x + tangent.y * velocity.y,
            tangent.x * velocity.y - tangent.y * velocity.x,
        );
        let load = link.share[end] * normal;
        let bound = Vector2::new(mu.sliding.x * load, mu.sliding.y * load);
        let shares = mu.skin.map(|skin| skin.shares());
        add_friction(judge::ground(&bound, shares, &slip, &solution.friction[i][end], link.mass).squared);
    }
    let rolling = Vector2::new(-(link.radius * u.angular.y), link.radius * u.angular.x);
    let radius = mu.rolling * (solution.normal[i][0] + solution.normal[i][1]);
    add_friction(judge::disc(radius, &rolling, &solution.rolling[i], link.mass).squared);
}

/// Coulomb's law at obstacles with the present normal impulses.
#[inline(always)]
fn verify_obstacle_friction<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, squared_friction: &mut T) {
    for (k, row) in stage.obstacle_friction.iter().enumerate() {
        let link = stage.contacts[k].link;
        let [along, across] = &row.tangents;
        let slip = Vector2::new(power(along, &solution.twist[link]), power(across, &solution.twist[link]));
        let radius = row.coefficient * solution.contact[k];
        let mass = stage.links[link].mass;
        let violation = judge::disc(radius, &slip, &solution.obstacle_friction[k], mass).squared / (mass * mass);
        *squared_friction = worse(*squared_friction, violation);
    }
}

/// The two links' joint points move alike, they do not turn against each other but about the joint's axes, and the drives
/// obey their law at the rates about these.
#[inline(always)]
fn verify_joint<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, j: usize, certificate: &mut Certificate<T>) {
    let (near, far) = (&stage.links[j], &stage.links[j + 1]);
    let mobility = Mobility::of(near.mass, near.inertia, near.half_length);
    let (u, w) = (&solution.twist[j], &solution.twist[j + 1]);
    let gap = minus(&point_velocity(u, &joint_point(near, 1.0)), &point_velocity(w, &joint_point(far, -1.0)));
    certificate.joint = worse(certificate.joint, scalar(&gap, &gap).sqrt());
    let relative = minus(&w.angular, &u.angular);
    let (axes, has) = axes_of_joint(stage, j);
    let twisting = if has == [true; 2] {
        scalar(&vector(&axes[0], &axes[1]), &relative).abs()
    } else {
        let axis = &axes[usize::from(has[1])];
        let left = minus(&relative, &times(axis, scalar(axis, &relative)));
        scalar(&left, &left).sqrt()
    };
    certificate.joint = worse(certificate.joint, twisting * near.half_length);
    for (axis, drive) in stage.joints[j].iter().enumerate() {
        if !has[axis] {
            certificate.joint = worse(certificate.joint, solution.rate[j][axis].abs() * near.half_length);
            certificate.actuator = worse(certificate.actuator, solution.actuator[j][axis].abs() * mobility.torque);
            continue;
        }
        let rate = scalar(&axes[axis], &relative);
        // The rates are what is integrated.
        let apart = (solution.rate[j][axis] - rate).abs();
        certificate.joint = worse(certificate.joint, apart * near.half_length);
        let wanted = drive.drive - drive.stiffness * rate;
        let impulse = solution.actuator[j][axis];
        let motor = stage.motors.get(2 * j + axis);
        let violation = judge::drive(impulse, wanted, drive.slack, drive.limit, motor.map(|motor| (motor, rate)));
        certificate.actuator = worse(certificate.actuator, violation * mobility.torque);
        if let (Some(motor), Some(&gear)) = (motor, solution.gear.get(2 * j + axis)) {
            let violation = judge::turning(motor.friction, gear, rate, near.mass, near.half_length);
            certificate.actuator = worse(certificate.actuator, violation);
        }
        if let (Some(stop), Some(impulses)) = (stage.stops.get(2 * j + axis), solution.stop.get(2 * j + axis)) {
            let velocity = stop.lever * rate;
            for (opening, &impulse) in [stop.offset[0] - velocity, stop.offset[1] + velocity].into_iter().zip(impulses)
            {
                let violation = judge::half_line(impulse, opening, near.mass) / near.mass;
                certificate.normal = worse(certificate.normal, violation);
            }
        }
    }
}

/// The momentum that links 1..i lack is supplied by the joint behind them. Its force is free, and so is its moment about
/// axes that the joint does not have; about those that it has it must be that of the actuators. Behind the last link there
/// is no joint.
#[inline(always)]
fn verify_balance<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, certificate: &mut Certificate<T>) {
    let zero = T::zero();
    let none = Vector3::new(zero, zero, zero);
    let (mut force, mut moment) = (none, none);
    let last = stage.chain() - 1;
    for (i, link) in stage.links.iter().enumerate() {
        if i > last {
            (force, moment) = (none, none);
        } else if i > 0 {
            moment = plus(&moment, &vector(&joint_point(link, -1.0), &force));
        }
        let mobility = Mobility::of(link.mass, link.inertia, link.half_length);
        let (own, about_centre) = missing(stage, solution, i);
        force = plus(&force, &own);
        moment = plus(&moment, &about_centre);
        if i >= last {
            let worst = scalar(&force, &force).sqrt() * mobility.force;
            certificate.balance = worse(certificate.balance, worst);
            let turning = scalar(&moment, &moment).sqrt() * mobility.end;
            certificate.balance = worse(certificate.balance, turning);
            continue;
        }
        // About the joint behind the link.
        moment = minus(&moment, &vector(&joint_point(link, 1.0), &force));
        let (axes, has) = axes_of_joint(stage, i);
        for (k, (axis, drive)) in axes.iter().zip(&solution.actuator[i]).enumerate() {
            if !has[k] {
                continue;
            }
            let mut left = scalar(axis, &moment) + *drive;
            if let (Some(stop), Some([upper, lower])) = (stage.stops.get(2 * i + k), solution.stop.get(2 * i + k)) {
                left += stop.lever * (*lower - *upper);
            }
            if let (Some(motor), Some(gear)) = (stage.motors.get(2 * i + k), solution.gear.get(2 * i + k)) {
                left += judge::motor_impulse(motor, *gear, solution.rate[i][k]);
            }
            certificate.balance = worse(certificate.balance, left.abs() * mobility.end);
        }
    }
}

/// M x - p - contact impulses of link `i`: what its joints must supply, as a force and a moment about the CG.
#[inline(always)]
fn missing<T: Real>(stage: &Stage<T>, solution: &StageSolution<T>, i: usize) -> (Vector3<T>, Vector3<T>) {
    let (link, u, t) = (&stage.links[i], &solution.twist[i], &stage.links[i].tangent);
    let spin = (link.roll_inertia - link.inertia) * scalar(&link.axes[2], &u.angular);
    let mut force = minus(&times(&u.linear, link.mass), &link.momentum.linear);
    let turning = plus(&times(&u.angular, link.inertia), &times(&link.axes[2], spin));
    let mut moment = minus(&turning, &link.momentum.angular);
    let chain = stage.chain();
    if i < chain {
        for end in 0..2 {
            let p = &solution.friction[i][end];
            let impulse = Vector3::new(t.x * p.x - t.y * p.y, t.y * p.x + t.x * p.y, solution.normal[i][end]);
            force = minus(&force, &impulse);
            moment = minus(&moment, &vector(&lowest_point(link, end), &impulse));
        }
        let rolling = &solution.rolling[i];
        moment = minus(&moment, &Vector3::new(link.radius * rolling.y, -(link.radius * rolling.x), T::zero()));
    } else {
        let friction = &solution.surface[i - chain];
        force = minus(&force, &Vector3::new(friction.x, friction.y, T::zero()));
        moment = minus(&moment, &Vector3::new(T::zero(), T::zero(), friction.z));
    }
    for (contact, &impulse) in stage.contacts.iter().zip(&solution.contact) {
        if contact.link == i {
            force = minus(&force, &times(&contact.direction.linear, impulse));
            moment = minus(&moment, &times(&contact.direction.angular, impulse));
        }
    }
    for (k, row) in stage.obstacle_friction.iter().enumerate().filter(|(k, _)| stage.contacts[*k].link == i) {
        let impulse = &solution.obstacle_friction[k];
        for (tangent, part) in row.tangents.iter().zip([impulse.x, impulse.y]) {
            force = minus(&force, &times(&tangent.linear, part));
            moment = minus(&moment, &times(&tangent.angular, part));
        }
    }
    for (pair, &impulse) in stage.pairs.iter().zip(&solution.pair) {
        for (_, w) in pair.links.iter().zip(&pair.direction).filter(|(link, _)| **link == i) {
            force = minus(&force, &times(&w.linear, impulse));
            moment = minus(&moment, &times(&w.angular, impulse));
        }
    }
    (force, moment)
}

/// The axes of the joint behind link `j`, frame I: e_y^B of that link and e_x^B of the next, or the hinge's own; and which of
/// them there are.
#[inline(always)]
fn axes_of_joint<T: Real>(stage: &Stage<T>, j: usize) -> ([Vector3<T>; 2], [bool; 2]) {
    let ([x, y, z], axes) = (&stage.links[j + 1].axes, stage.axes_of(j));
    let mut directions = [stage.links[j].axes[1], *x];
    if let Axes::About([a, b, c]) = axes {
        let across = plus(&times(x, T::splat(a)), &times(y, T::splat(b)));
        directions = [plus(&across, &times(z, T::splat(c))); 2];
    }
    (directions, [axes.has(0), axes.has(1)])
}

/// From the CG to the lowest point of the front (0) or rear (1) sphere.
#[inline(always)]
fn lowest_point<T: Real>(link: &StageLink<T>, end: usize) -> Vector3<T> {
    let reach = link.cg_offset + if end == 0 { link.sphere } else { -link.sphere };
    let mut arm = times(&link.axes[2], reach);
    arm.z -= link.radius;
    arm
}

/// From the CG to the joint in front (`side` 1) or behind (-1).
#[inline(always)]
fn joint_point<T: Real>(link: &StageLink<T>, side: f64) -> Vector3<T> {
    times(&link.axes[2], T::splat(side) * link.half_length + link.cg_offset)
}

#[inline(always)]
fn point_velocity<T: Real>(u: &Twist<T>, arm: &Vector3<T>) -> Vector3<T> {
    plus(&u.linear, &vector(&u.angular, arm))
}

#[inline(always)]
fn power<T: Real>(w: &Wrench<T>, u: &Twist<T>) -> T {
    scalar(&w.linear, &u.linear) + scalar(&w.angular, &u.angular)
}

#[inline(always)]
fn scalar<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

#[inline(always)]
fn vector<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

#[inline(always)]
fn times<T: Real>(a: &Vector3<T>, factor: T) -> Vector3<T> {
    Vector3::new(a.x * factor, a.y * factor, a.z * factor)
}

#[inline(always)]
fn plus<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x + b.x, a.y + b.y, a.z + b.z)
}

#[inline(always)]
fn minus<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x - b.x, a.y - b.y, a.z - b.z)
}
