//! Kinematics of the chain link by link, O(n), in any frame that turns with or stands in the plane.

use nalgebra::{Vector2, Vector3};

use crate::math::Real;

use super::{Model, ModelLink};
use crate::laws::SmoothLaw;

/// A link's velocity: (v_x, v_y) of its CG and omega.
pub type Twist = Vector3<f64>;

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

/// All links of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    pub links: Vec<LinkMotion>,
}

/// Virtual joints: orientation of the first link, and velocity of O_2 with the first link's rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    pub theta: f64,
    pub rate: Vector3<f64>,
}

/// e_y from e_x: a quarter turn.
pub fn quarter_turn(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

/// The third component of a x b.
pub fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Motion {
    pub fn new(links: usize) -> Self {
        let link = LinkMotion { axial: Vector2::x(), arm: Vector2::zeros(), twist: Twist::zeros() };
        Self { links: vec![link; links] }
    }

    /// Positions and velocities from virtual and real joints (T 6.2), (T 6.4), (T 6.7).
    pub fn set(&mut self, model: &Model, base: Base, phi: &[f64], phi_rate: &[f64]) {
        let (mut theta, mut omega) = (base.theta, base.rate.z);
        let (mut joint, mut velocity) = (Vector2::zeros(), base.rate.xy());
        for (i, (motion, link)) in self.links.iter_mut().zip(&model.links).enumerate() {
            if i > 0 {
                theta += phi[i - 1];
                omega += phi_rate[i - 1];
            }
            let (sin, cos) = theta.sin_cos();
            motion.axial = Vector2::new(cos, sin);
            let half = motion.axial * link.half_length;
            let swing = quarter_turn(half) * omega;
            motion.arm = joint + half;
            motion.twist = (velocity + swing).push(omega);
            joint = motion.arm + half;
            velocity += swing * 2.0;
        }
    }
}

impl LinkMotion {
    /// Slip velocity of the contact point `lever` before G_i, in the link's frame (T 6.10), (T 6.13).
    pub fn slip(&self, lever: f64) -> Vector2<f64> {
        let (v, e) = (&self.twist, &self.axial);
        Vector2::new(e.x * v.x + e.y * v.y, e.x * v.y - e.y * v.x + lever * v.z)
    }

    /// Friction of both contact points: force in the frame of the motion, and moment about G_i.
    pub fn friction(&self, link: &ModelLink, law: SmoothLaw) -> Vector3<f64> {
        let front = link.friction.force(law, self.slip(link.lever));
        let rear = link.friction.force(law, self.slip(-link.lever));
        let force = front + rear;
        let world = self.axial * force.x + quarter_turn(self.axial) * force.y;
        world.push(link.lever * (front.y - rear.y))
    }
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
