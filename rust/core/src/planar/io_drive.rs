//! Input-output linearisation (T 6.58 != D22) as drives of a planar stage.
//!
//! The controller's model is the smooth two-point one of chapter 6, the plant the set-valued one of chapter 3. Over a
//! stage of coefficient c the error dynamics (T 6.63) are followed by implicit Euler, joint by joint:
//!
//! `rate* = (rate_R + c (phi_d'' + K_D phi_d' + K_P (phi_d - phi_B))) / (1 + k)`, `k = c K_D + c^2 K_P`,
//! `u = (rate* - rate_R) / c`,
//!
//! which is bounded for any c, and the drive is `D = c tau(u) - k s (omega_J - rate*)` within the torque limit, with
//! tau the inverse dynamics of the model and s the inertia that a joint feels on its own. If the plant were the model,
//! this would be the linearly implicit torque exactly; since it is not, the second term responds within the stage to
//! pegs and sticking. It is diagonal, so the stage stays as cheap, and as convex, as under PD.

use std::f64::consts::FRAC_2_PI;

use nalgebra::{Vector2, Vector3};

use crate::control::AxisGains;
use crate::gait::Jet;
use crate::math::Real;
use crate::planar::{Heading, StageJoint};
use crate::scene::SMOOTHING;

use super::PlanarSystem;
use super::inverse_dynamics::{InverseDynamics, LinkInertia, LinkMotion, own_inertia};

/// The controller's model with workspace, in the lanes of a register.
pub struct IoDrive<T: Real> {
    dynamics: InverseDynamics<T>,
    /// Distances of each CG from the joints in front of the link and behind it \[m\].
    arms: Vec<[T; 2]>,
    /// L_GS, and the largest Coulomb force of one contact point along and across the link.
    lever: Vec<T>,
    coulomb: Vec<Vector2<T>>,
    own_inertia: Vec<T>,
    motion: Vec<LinkMotion<T>>,
    /// rate*, u and tau of each joint.
    followed: Vec<T>,
    u: Vec<T>,
    tau: Vec<T>,
}

/// Input of the controller from a stage.
pub struct IoInput<'a, T: Real> {
    /// Headings at the predicted end of the stage.
    pub heading: &'a [Heading<T>],
    /// Configuration q_B, reference velocity u_R and expected end velocity.
    pub base: &'a [Vector3<T>],
    pub reference: &'a [Vector3<T>],
    pub guess: &'a [Vector3<T>],
    /// phi_d, phi_d', phi_d'' at the end of the stage.
    pub target: &'a [Jet<T>],
    /// Of all joints: K_P, K_D, and the factor on the largest torque.
    pub gains: &'a AxisGains<T>,
    pub strength: T,
    pub coefficient: T,
}

impl<T: Real> IoDrive<T> {
    /// The robot of the system on two contact points per link, without viscous friction. The pull of inclined ground is
    /// left out: it accelerates all links alike and takes no torques.
    pub fn new(system: &PlanarSystem) -> Self {
        let links = &system.robot.links;
        let inertia: Vec<_> = links.iter().map(LinkInertia::of).collect();
        let coulomb = links.iter().map(|link| system.point_friction(link).map(T::splat));
        let zero = T::zero();
        let nothing = Vector2::new(zero, zero);
        let motion = LinkMotion { axial: nothing, arm: nothing, twist: Vector3::new(zero, zero, zero) };
        let joints = vec![zero; links.len() - 1];
        Self {
            dynamics: InverseDynamics::new(inertia.iter().map(LinkInertia::splat).collect()),
            arms: links.iter().map(|link| link.arms().map(T::splat)).collect(),
            lever: links.iter().map(|link| T::splat(link.contact_half_length)).collect(),
            coulomb: coulomb.collect(),
            own_inertia: own_inertia(&inertia).into_iter().map(T::splat).collect(),
            motion: vec![motion; links.len()],
            followed: joints.clone(),
            u: joints.clone(),
            tau: joints,
        }
    }

    /// Writes the drives of a stage.
    #[inline(always)]
    pub fn fill(&mut self, at: &IoInput<T>, joints: &mut Vec<StageJoint<T>>) {
        let c = at.coefficient;
        let AxisGains { kp, kd, .. } = *at.gains;
        let k = c * (kd + c * kp);
        let divisor = T::splat(1.0) / (T::splat(1.0) + k);
        for (j, Jet { value: angle, rate, acceleration }) in at.target.iter().enumerate() {
            let error = *angle - (at.base[j + 1].z - at.base[j].z);
            let before = at.reference[j + 1].z - at.reference[j].z;
            let wanted = *acceleration + kd * *rate + kp * error;
            self.followed[j] = (before + c * wanted) * divisor;
            self.u[j] = (wanted - kd * before - c * kp * before) * divisor;
        }
        self.move_model(at);
        self.dynamics.solve(&self.motion, &self.u, &mut self.tau);
        joints.clear();
        for (j, tau) in self.tau.iter().enumerate() {
            let stiffness = k * self.own_inertia[j];
            let drive = c * *tau + stiffness * self.followed[j];
            joints.push(StageJoint { drive, stiffness, limit: c * at.gains.limit(at.strength), slack: T::zero() });
        }
    }

    /// Places, velocities and friction of the model's links at the predicted end of the stage.
    #[inline(always)]
    fn move_model(&mut self, at: &IoInput<T>) {
        let (mut x, mut y) = (T::zero(), T::zero());
        for (i, motion) in self.motion.iter_mut().enumerate() {
            let (heading, [front, rear]) = (&at.heading[i], self.arms[i]);
            motion.axial = Vector2::new(heading.cos, heading.sin);
            motion.arm = Vector2::new(x + heading.cos * front, y + heading.sin * front);
            motion.twist = at.guess[i];
            (x, y) = (motion.arm.x + heading.cos * rear, motion.arm.y + heading.sin * rear);
            self.dynamics.applied[i] = friction(motion, self.lever[i], &self.coulomb[i]);
        }
    }
}

/// (T 6.21) at both contact points: force in the world frame and moment about G_i.
#[inline(always)]
fn friction<T: Real>(motion: &LinkMotion<T>, lever: T, coulomb: &Vector2<T>) -> Vector3<T> {
    let (e, v) = (&motion.axial, &motion.twist);
    let along = e.x * v.x + e.y * v.y;
    let across = e.x * v.y - e.y * v.x;
    let swing = lever * v.z;
    let (front, rear) = (smooth_force(coulomb.y, across + swing), smooth_force(coulomb.y, across - swing));
    let axial = smooth_force(coulomb.x, along);
    let (p, q) = (axial + axial, front + rear);
    Vector3::new(e.x * p - e.y * q, e.y * p + e.x * q, lever * (front - rear))
}

/// (T 6.21) along one axis: the force at the slip velocity `slip`, with `d` the largest one.
#[inline(always)]
fn smooth_force<T: Real>(d: T, slip: T) -> T {
    -d * ((slip * T::splat(1.0 / SMOOTHING)).arctangent() * T::splat(FRAC_2_PI))
}
