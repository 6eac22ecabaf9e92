//! The problem of one stage: data, without any algorithm.
//!
//! The unknown of a stage is the end velocity u of the inclusion
//!
//! `M (u - u_ref) = W_T P_T + W_H P_H + W_J P_J + W_tau D`, `W_J^T u = 0`,
//! `-W_T^T u in N_{C_T}(P_T)`, where the ground resists spin also `-omega in N_[-b, b](P_S)`, of what can be pushed `-u in
//! N_E(P_E)` with a [limit surface](crate::laws::LimitSurface) E in place of both, `0 <= P_H  _|_  W_H^T u + offset >= 0`, `D = clamp(shrink(b - k W_tau^T u))`
//!
//! with directions W fixed at the predicted end configuration. It is (T 3.66)-(T 3.72) with the PD
//! torque taken at the end of the stage, and the optimality condition of a strongly convex problem:
//! u minimises `|u - u_ref|_M^2 / 2 + sum support_{C_T}(-gamma_T) + sum psi(gamma_tau)` subject to the
//! joints and to `W_H^T u + offset >= 0`. So u exists and is unique without friction at
//! contacts ([`FrictionRow`]); the impulses need not be.
//! Implicit Euler is one stage with coefficient h; higher order composes several.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::{LINK_CONTACTS_PER_LINK, PAIRS_PER_LINK};
use crate::laws::{Halves, Skin};
use crate::math::Real;
use crate::rows::{ContactRow, DriveRow, FrictionRow, MotorRow, PairRow, Saved, is_zero};
use crate::stepping::StageStop;

use super::Heading;

/// One link in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct StageLink<T = f64> {
    /// R_B^I at the predicted end configuration.
    pub heading: Heading<T>,
    /// u_ref: the velocity the link would have without any force in this stage.
    pub reference: Vector3<T>,
    pub mass: T,
    pub inertia: T,
    /// L_i / 2 \[m\].
    pub half_length: T,
    /// How far the CG lies in front of the middle, towards the head \[m\].
    #[serde(default = "T::zero", skip_serializing_if = "is_zero")]
    pub cg_offset: T,
    /// Semi-axes of C_T as impulses, mu m g c, in the link's frame; with a skin those of the longer half \[N s\]. Of what can
    /// be pushed, the forces of its limit surface.
    pub friction: Vector2<T>,
}

/// The drive of one joint in a stage.
pub type StageJoint<T = f64> = DriveRow<T>;

/// Contact of a link with an obstacle.
pub type StageContact<T = f64> = ContactRow<Vector3<T>, T>;

/// Contact between two links of the robot.
pub type StagePair<T = f64> = PairRow<Vector3<T>, T>;

/// Friction of a contact with an obstacle.
pub type StageObstacleFriction<T = f64> = FrictionRow<StageContact<T>, T>;

/// Friction of a contact between two links.
pub type StagePairFriction<T = f64> = FrictionRow<StagePair<T>, T>;

/// Data of one stage, of one robot or of several side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct Stage<T = f64> {
    /// c: the part of the step this stage covers \[s\].
    pub coefficient: T,
    /// Of links that slide otherwise forward than backward.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<Skin>,
    pub links: Vec<StageLink<T>>,
    pub joints: Vec<StageJoint<T>>,
    /// Largest impulse against the spin of each link; empty where the ground does not resist it. Of what can be pushed, the
    /// moment of its limit surface \[N m s\].
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    pub spins: Vec<T>,
    /// Of each joint; empty where no joint is near a stop.
    pub stops: Vec<StageStop<T>>,
    /// Of each joint; empty where robots have none.
    #[serde(default = "Vec::new")]
    pub motors: Vec<MotorRow<T>>,
    /// Sorted by link.
    pub contacts: Vec<StageContact<T>>,
    /// Of those contacts that have it, in their order.
    pub obstacle_friction: Vec<StageObstacleFriction<T>>,
    /// Contacts of the robot with itself.
    pub pairs: Vec<StagePair<T>>,
    /// Of those of them that have it, in their order.
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    pub pair_friction: Vec<StagePairFriction<T>>,
}

impl<T: Real> StageLink<T> {
    /// Distances of the CG from the joints in front of the link and behind it \[m\].
    #[inline(always)]
    pub fn arms(&self) -> [T; 2] {
        [self.half_length - self.cg_offset, self.half_length + self.cg_offset]
    }
}

impl<T: Real> Stage<T> {
    /// Number of links that joints connect; those behind them are obstacles that can be pushed.
    #[inline(always)]
    pub fn chain(&self) -> usize {
        self.joints.len() + 1
    }

    /// Semi-axes of the limit surface of something that can be pushed \[N s\], \[N m s\].
    #[inline(always)]
    pub fn limit_surface(&self, node: usize) -> Vector3<T> {
        let force = &self.links[node].friction;
        Vector3::new(force.x, force.y, self.spins.get(node).copied().unwrap_or(T::zero()))
    }

    /// Bounds of the ground's friction against the spin of the links that joints connect.
    #[inline(always)]
    pub fn link_spins(&self) -> &[T] {
        &self.spins[..self.spins.len().min(self.chain())]
    }

    pub fn with_capacity(links: usize) -> Self {
        Self {
            coefficient: T::zero(),
            skin: None,
            links: Vec::with_capacity(links),
            joints: Vec::with_capacity(links - 1),
            spins: Vec::with_capacity(links),
            stops: Vec::with_capacity(links - 1),
            motors: Vec::new(),
            contacts: Vec::with_capacity(PAIRS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(PAIRS_PER_LINK * links),
            pairs: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            pair_friction: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
        }
    }

    /// Whether it is an optimisation problem: no contact has friction.
    #[inline(always)]
    pub fn is_convex(&self) -> bool {
        self.obstacle_friction.is_empty() && self.pair_friction.is_empty()
    }
}

impl Stage {
    /// Leaves out obstacles that other lanes have, so that the first `nodes` links and obstacles are left.
    pub(super) fn leave_out(&mut self, nodes: usize) {
        self.links.truncate(nodes);
        let has_spins = nodes > self.chain() || self.spins.iter().any(|bound| *bound > 0.0);
        self.spins.truncate(if has_spins { nodes } else { 0 });
    }

    /// Of the robot \[kg\].
    pub(super) fn mass(&self) -> f64 {
        self.links[..self.chain()].iter().map(|link| link.mass).sum()
    }

    /// Mass of the lightest link \[kg\].
    pub(super) fn lightest_mass(&self) -> f64 {
        self.links.iter().map(|link| link.mass).fold(f64::INFINITY, f64::min)
    }

    /// Replaces the set of a skin by the whole ellipses on the sides on which the forces of `solution` lie, or would lie.
    pub(super) fn take_sides(&mut self, solution: &StageSolution) {
        let Some(skin) = self.skin.take() else { return };
        for ((link, impulse), u) in self.links.iter_mut().zip(&solution.friction).zip(&solution.twist) {
            link.friction.x *= skin.side(impulse.x - link.mass * link.heading.to_link(u.xy()).x);
        }
    }

    /// Velocities of links 2..n from the joints, given the twist of link 1 and all angular velocities.
    pub fn follow_joints(&self, twist: &mut [Vector3<f64>]) {
        for i in 1..self.chain() {
            let (near, far) = (&self.links[i - 1], &self.links[i]);
            let swing = near.heading.lateral() * (near.arms()[1] * twist[i - 1].z)
                + far.heading.lateral() * (far.arms()[0] * twist[i].z);
            (twist[i].x, twist[i].y) = (twist[i - 1].x + swing.x, twist[i - 1].y + swing.y);
        }
    }

    /// Energy of the reference velocity and of what friction, drives and closing contacts could give \[J\]: what the
    /// duality gap is to be compared with.
    pub fn energy(&self) -> f64 {
        let mut energy = 0.0;
        for link in &self.links {
            let u = &link.reference;
            energy += 0.5 * (link.mass * u.xy().norm_squared() + link.inertia * u.z * u.z);
            energy += 0.5 * link.friction.norm_squared() / link.mass;
        }
        for (link, spin) in self.links.iter().zip(&self.spins) {
            energy += 0.5 * spin * spin / link.inertia;
        }
        for (joint, links) in self.joints.iter().zip(self.links.windows(2)) {
            let most = joint.drive.abs().min(joint.limit);
            energy += 0.5 * most * most / (joint.stiffness + links[0].inertia.min(links[1].inertia));
        }
        for motor in &self.motors {
            energy += 0.5 * motor.inertia * motor.reference * motor.reference;
        }
        for contact in &self.contacts {
            energy += 0.5 * self.links[contact.link].mass * contact.offset.min(0.0).powi(2);
        }
        for pair in &self.pairs {
            energy += 0.5 * self.links[pair.links[0]].mass * pair.offset.min(0.0).powi(2);
        }
        energy
    }
}

/// What a solver returns and the certificate verifies.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSolution<T = f64> {
    /// u of each link.
    pub twist: Vec<Vector3<T>>,
    /// P_T of each link in its own frame \[N s\].
    pub friction: Vec<Vector2<T>>,
    /// Moment of friction of each entry of [`Stage::spins`] \[N m s\].
    pub spin: Vec<T>,
    /// D of each joint, positive driving phi upwards: -c tau_C of (T 3.51) \[N m s\].
    pub actuator: Vec<T>,
    /// Impulses of each entry of [`Stage::stops`] \[N s\].
    pub stop: Vec<[T; 2]>,
    /// Impulse of the gear's friction of each entry of [`Stage::motors`] \[N m s\].
    pub gear: Vec<T>,
    /// P_H of each entry of [`Stage::contacts`] \[N s\].
    pub contact: Vec<T>,
    /// Impulse of each entry of [`Stage::obstacle_friction`] \[N s\].
    pub obstacle_friction: Vec<T>,
    /// Impulse of each entry of [`Stage::pairs`] \[N s\].
    pub pair: Vec<T>,
    /// Impulse of each entry of [`Stage::pair_friction`] \[N s\].
    pub pair_friction: Vec<T>,
}

impl StageSolution {
    /// The same as [`Stage::leave_out`] has done.
    pub(super) fn leave_out(&mut self, stage: &Stage) {
        self.twist.truncate(stage.links.len());
        self.friction.truncate(stage.links.len());
        self.spin.truncate(stage.spins.len());
    }
}

impl<T: Real> StageSolution<T> {
    /// Friction of the ground on something that can be pushed, in its frame \[N s\], \[N m s\].
    #[inline(always)]
    pub fn surface_impulse(&self, node: usize) -> Vector3<T> {
        let force = &self.friction[node];
        Vector3::new(force.x, force.y, self.spin.get(node).copied().unwrap_or(T::zero()))
    }

    pub fn new(links: usize) -> Self {
        Self {
            twist: vec![Vector3::new(T::zero(), T::zero(), T::zero()); links],
            friction: vec![Vector2::new(T::zero(), T::zero()); links],
            spin: Vec::with_capacity(links),
            actuator: vec![T::zero(); links - 1],
            stop: Vec::with_capacity(links - 1),
            gear: Vec::new(),
            contact: Vec::with_capacity(PAIRS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(PAIRS_PER_LINK * links),
            pair: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
            pair_friction: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
        }
    }

    /// Of the size of `stage`, at rest and without impulses: the start of a solver that knows nothing.
    pub fn cold(stage: &Stage<T>) -> Self {
        let (mut solution, none) = (Self::new(stage.links.len()), T::zero());
        solution.spin.resize(stage.spins.len(), none);
        solution.actuator.truncate(stage.joints.len());
        solution.stop.resize(stage.stops.len(), [none; 2]);
        solution.gear.resize(stage.motors.len(), none);
        solution.contact.resize(stage.contacts.len(), none);
        solution.obstacle_friction.resize(stage.obstacle_friction.len(), none);
        solution.pair.resize(stage.pairs.len(), none);
        solution.pair_friction.resize(stage.pair_friction.len(), none);
        solution
    }
}
