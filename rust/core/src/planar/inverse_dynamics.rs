//! Torques that give the joints of a chain desired accelerations, its first link being free: (T 6.58) in O(n).
//!
//! (T 6.58) takes M_22 - M_21 M_11^-1 M_12 apart into two steps that need no matrix: the base balance
//! (T 6.53), three equations for the acceleration of the virtual joints, and the moments about each
//! joint of all that lies behind it. Written for one robot or for several in the lanes of a register.

use nalgebra::{DMatrix, Vector2, Vector3};

use crate::math::Real;
use crate::robot::Link;

/// Position and velocity of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkMotion<T = f64> {
    /// e_x^Bi.
    pub axial: Vector2<T>,
    /// r_Gi - r_O2 (T 6.2) \[m\].
    pub arm: Vector2<T>,
    /// Velocity of G_i and omega_i (T 6.4), (T 6.7).
    pub twist: Vector3<T>,
}

/// Inertia of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkInertia<T = f64> {
    pub mass: T,
    /// About the CG \[kg m^2\].
    pub inertia: T,
    /// From the joint in front to the CG \[m\].
    pub front: T,
    /// The distance from there to the joint behind, over that.
    pub rear_ratio: T,
}

impl LinkInertia {
    pub fn of(link: &Link) -> Self {
        let [front, rear] = link.arms();
        Self { mass: link.mass, inertia: link.inertia, front, rear_ratio: rear / front }
    }

    /// The same in every lane.
    pub fn splat<T: Real>(&self) -> LinkInertia<T> {
        let [mass, inertia, front, rear_ratio] = [self.mass, self.inertia, self.front, self.rear_ratio].map(T::splat);
        LinkInertia { mass, inertia, front, rear_ratio }
    }
}

/// Workspace: forces on each link as (x, y, moment about G_i).
#[derive(Debug, Clone)]
pub struct InverseDynamics<T = f64> {
    links: Vec<LinkInertia<T>>,
    /// Applied forces, to be written before [`Self::solve`].
    pub applied: Vec<Vector3<T>>,
    /// Inertia minus applied forces.
    force: Vec<Vector3<T>>,
}

impl<T: Real> InverseDynamics<T> {
    pub fn new(links: Vec<LinkInertia<T>>) -> Self {
        let zero = Vector3::new(T::zero(), T::zero(), T::zero());
        Self { applied: vec![zero; links.len()], force: vec![zero; links.len()], links }
    }

    /// tau for joint accelerations `u` under the applied forces; returns the acceleration of the virtual joints.
    #[inline(always)]
    pub fn solve(&mut self, motion: &[LinkMotion<T>], u: &[T], tau: &mut [T]) -> Vector3<T> {
        let base = self.base_acceleration(motion, u);
        self.moments(motion, &base, tau);
        base
    }

    /// Forces with the acceleration of the virtual joints left out, then that acceleration (T 6.53).
    #[inline(always)]
    fn base_acceleration(&mut self, motion: &[LinkMotion<T>], u: &[T]) -> Vector3<T> {
        let zero = T::zero();
        let (mut alpha, mut joint_x, mut joint_y) = (zero, zero, zero);
        let (mut x, mut y, mut moment) = (zero, zero, zero);
        for (i, (link, at)) in self.links.iter().zip(motion).enumerate() {
            if i > 0 {
                alpha += u[i - 1];
            }
            let (front_x, front_y) = (at.axial.x * link.front, at.axial.y * link.front);
            // Tangential and centripetal acceleration from the joint in front to the CG.
            let square = at.twist.z * at.twist.z;
            let (along_x, along_y) = (-front_y * alpha - front_x * square, front_x * alpha - front_y * square);
            let applied = &self.applied[i];
            let force = Vector3::new(
                (joint_x + along_x) * link.mass - applied.x,
                (joint_y + along_y) * link.mass - applied.y,
                link.inertia * alpha - applied.z,
            );
            x += force.x;
            y += force.y;
            moment += force.z + at.arm.x * force.y - at.arm.y * force.x;
            self.force[i] = force;
            joint_x += along_x + along_x * link.rear_ratio;
            joint_y += along_y + along_y * link.rear_ratio;
        }
        let links = self.links.iter().zip(motion);
        let composite = Composite::of(links.map(|(link, at)| (link.mass, link.inertia, at.arm)));
        composite.rate_of(Vector3::new(-x, -y, -moment))
    }

    /// From tail to head: the moment about each joint of the forces behind it.
    #[inline(always)]
    fn moments(&self, motion: &[LinkMotion<T>], base: &Vector3<T>, tau: &mut [T]) {
        let (mut x, mut y, mut moment) = (T::zero(), T::zero(), T::zero());
        for i in (1..self.force.len()).rev() {
            let (link, at, force) = (&self.links[i], &motion[i], &self.force[i]);
            let (front_x, front_y) = (at.axial.x * link.front, at.axial.y * link.front);
            let own_x = force.x + (base.x - at.arm.y * base.z) * link.mass;
            let own_y = force.y + (base.y + at.arm.x * base.z) * link.mass;
            moment += force.z + link.inertia * base.z;
            let ratio = link.rear_ratio;
            moment += front_x * (own_y + y + ratio * y) - front_y * (own_x + x + ratio * x);
            x += own_x;
            y += own_y;
            tau[i - 1] = moment;
        }
    }
}

/// 1 / (M_22_bar^-1)_jj of the straight robot: the inertia each joint feels when all others are free
/// \[kg m^2\].
pub fn own_inertia(links: &[LinkInertia]) -> Vec<f64> {
    let mut reach = 0.0;
    let straight: Vec<_> = links
        .iter()
        .map(|link| {
            let arm = Vector2::new(reach + link.front, 0.0);
            reach = arm.x + link.rear_ratio * link.front;
            LinkMotion { axial: Vector2::x(), arm, twist: Vector3::zeros() }
        })
        .collect();
    let joints = links.len() - 1;
    let mut dynamics = InverseDynamics::new(links.to_vec());
    let mut mass = DMatrix::zeros(joints, joints);
    for j in 0..joints {
        let unit: Vec<f64> = (0..joints).map(|k| f64::from(u8::from(k == j))).collect();
        dynamics.solve(&straight, &unit, mass.column_mut(j).as_mut_slice());
    }
    let mobility = mass.cholesky().map(|factor| factor.inverse());
    (0..joints).map(|j| mobility.as_ref().map_or(0.0, |mobility| mobility[(j, j)].recip())).collect()
}

/// Mass, centre and moment of inertia of the chain as one rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Composite<T = f64> {
    pub mass: T,
    /// Centre of mass seen from O_2 \[m\].
    pub centre: Vector2<T>,
    /// About the centre of mass \[kg m^2\].
    pub inertia: T,
}

impl<T: Real> Composite<T> {
    /// Of links at the given places: `(mass, inertia, arm)`.
    #[inline(always)]
    pub fn of(links: impl Iterator<Item = (T, T, Vector2<T>)>) -> Self {
        let zero = T::zero();
        let (mut mass, mut x, mut y, mut second) = (zero, zero, zero, zero);
        for (m, inertia, arm) in links {
            mass += m;
            x += m * arm.x;
            y += m * arm.y;
            second += m * (arm.x * arm.x + arm.y * arm.y) + inertia;
        }
        let centre = Vector2::new(x / mass, y / mass);
        let inertia = second - (x * centre.x + y * centre.y);
        Self { mass, centre, inertia }
    }

    /// The rigid rate (of O_2, and of rotation) whose momentum is `(p, moment about O_2)`: M_11^-1 of (T 6.53).
    #[inline(always)]
    pub fn rate_of(&self, momentum: Vector3<T>) -> Vector3<T> {
        let (x, y) = (momentum.x / self.mass, momentum.y / self.mass);
        let moment = momentum.z - (self.centre.x * momentum.y - self.centre.y * momentum.x);
        let angular = moment / self.inertia;
        Vector3::new(x + self.centre.y * angular, y - self.centre.x * angular, angular)
    }
}
