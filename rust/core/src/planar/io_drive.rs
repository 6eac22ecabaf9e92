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

use nalgebra::{Vector2, Vector3};

use crate::control::{ControllerConfig, Treatment};
use crate::gait::{Jet, JointTarget};
use crate::laws::SmoothLaw;
use crate::math::Real;
use crate::minimal::{Feedback, Ground, InverseDynamics, LinkMotion, Measurement, Model};
use crate::planar::{Heading, PlanarState, StageJoint};
use crate::slope::Slope;

use super::PlanarSystem;

/// The controller's model with workspace, in the lanes of a register.
#[derive(Debug, Clone)]
pub struct IoDrive<T: Real> {
    dynamics: InverseDynamics<T>,
    half_length: Vec<T>,
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
    /// K_P, K_D.
    pub gains: [T; 2],
    pub torque_limit: T,
    pub coefficient: T,
}

impl<T: Real> IoDrive<T> {
    pub fn new(system: &PlanarSystem) -> Self {
        let model = model_of(system);
        let zero = T::zero();
        let nothing = Vector2::new(zero, zero);
        let motion = LinkMotion { axial: nothing, arm: nothing, twist: Vector3::new(zero, zero, zero) };
        let joints = vec![zero; model.joint_count()];
        Self {
            dynamics: InverseDynamics::with(model.links.iter().map(|link| link.inertia().splat()).collect()),
            half_length: model.links.iter().map(|link| T::splat(link.half_length)).collect(),
            lever: model.links.iter().map(|link| T::splat(link.lever)).collect(),
            coulomb: model.links.iter().map(|link| link.friction.coulomb.map(T::splat)).collect(),
            own_inertia: model.own_inertia().into_iter().map(T::splat).collect(),
            motion: vec![motion; model.link_count()],
            followed: joints.clone(),
            u: joints.clone(),
            tau: joints,
        }
    }

    /// Writes the drives of a stage.
    #[inline(always)]
    pub fn fill(&mut self, at: &IoInput<T>, joints: &mut Vec<StageJoint<T>>) {
        let c = at.coefficient;
        let [kp, kd] = at.gains;
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
            joints.push(StageJoint { drive, stiffness, limit: c * at.torque_limit, slack: T::zero() });
        }
    }

    /// Places, velocities and friction of the model's links at the predicted end of the stage.
    #[inline(always)]
    fn move_model(&mut self, at: &IoInput<T>) {
        let (mut x, mut y) = (T::zero(), T::zero());
        for (i, motion) in self.motion.iter_mut().enumerate() {
            let (heading, half) = (&at.heading[i], self.half_length[i]);
            let (half_x, half_y) = (heading.cos * half, heading.sin * half);
            motion.axial = Vector2::new(heading.cos, heading.sin);
            motion.arm = Vector2::new(x + half_x, y + half_y);
            motion.twist = at.guess[i];
            (x, y) = (x + half_x + half_x, y + half_y + half_y);
            self.dynamics.applied[i] = friction(motion, self.lever[i], &self.coulomb[i]);
        }
    }
}

/// The same controller for the thesis's scheme: torques from the state at the start of a step (T 3.51 != D8).
#[derive(Debug, Clone)]
pub struct ExplicitIo {
    model: Model,
    feedback: Feedback,
    measured: Measurement,
    /// tau \[N m\].
    pub tau: Vec<f64>,
}

impl ExplicitIo {
    pub fn new(system: &PlanarSystem) -> Self {
        let model = model_of(system);
        let feedback = Feedback::new(ControllerConfig { treatment: Treatment::Step, ..system.controller }, &model);
        let joints = model.joint_count();
        Self { feedback, measured: Measurement::new(joints), tau: vec![0.0; joints], model }
    }

    /// Computes tau.
    pub fn update(&mut self, state: &PlanarState, targets: &[JointTarget]) {
        let Self { model, feedback, measured, tau } = self;
        let (first, twist) = (&state.pose[0], &state.twist[0]);
        measured.theta = first.z;
        // O_2 lies half a link behind G.
        let half = model.links[0].half_length * twist.z;
        measured.velocity = twist.xy() - Heading::of(first.z).lateral() * half;
        measured.theta_rate = twist.z;
        for j in 0..tau.len() {
            (measured.phi[j], measured.phi_rate[j]) = (state.joint_angle(j), state.joint_rate(j));
        }
        feedback.torque(model, measured, targets, state.time, tau);
    }
}

/// The robot on two contact points per link; the planar model has no viscous friction.
///
/// The pull of inclined ground is left out: it accelerates all links alike and takes no torques.
fn model_of(system: &PlanarSystem) -> Model {
    let coulomb = (system.friction() * (system.normal_gravity() / system.robot.gravity)).into();
    Model::new(&system.robot, &Ground { coulomb, viscous: [0.0; 2], slope: Slope::default() })
}

/// (T 6.21) at both contact points: force in the world frame and moment about G_i.
#[inline(always)]
fn friction<T: Real>(motion: &LinkMotion<T>, lever: T, coulomb: &Vector2<T>) -> Vector3<T> {
    let (e, v) = (&motion.axial, &motion.twist);
    let along = e.x * v.x + e.y * v.y;
    let across = e.x * v.y - e.y * v.x;
    let swing = lever * v.z;
    let [front, rear] = [across + swing, across - swing].map(|slip| SmoothLaw::printed_force(coulomb.y, slip));
    let axial = SmoothLaw::printed_force(coulomb.x, along);
    let (p, q) = (axial + axial, front + rear);
    Vector3::new(e.x * p - e.y * q, e.y * p + e.x * q, lever * (front - rear))
}
