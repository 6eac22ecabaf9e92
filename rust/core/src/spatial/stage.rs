//! The problem of one stage of the spatial model: data, without any algorithm.
//!
//! The unknowns of a stage are the twists x = (v, omega) of all links, frame I, and the joint rates, with
//!
//! `M x - p = W_N P_N + W_T P_T + W_V P_V + W_H P_H + W_J P_J + W_tau D`, `W_J^T x = 0` (T 4.69), (T 4.112 != D41),
//! `0 <= P_N  _|_  W_N^T x + offset >= 0` (T 4.78), the same for obstacles (T 4.79) and between links of one robot,
//! `-W_T^T x in N_{C_T}(P_T)` with the ellipse of semi-axes mu P_N (T 4.82)-(T 4.84), or a half of it and a half of another
//! one,
//! `-W_V^T x in N_{C_V}(P_V)` with the disc of radius mu_V P_N (T 4.86)-(T 4.87),
//! `D = clamp(b - k phi')` (T 4.101)-(T 4.102), and of what can be pushed `-x in N_E(P_E)` with a
//! [limit surface](crate::laws::LimitSurface) E. That stays upright because nothing pushes it otherwise than along the ground
//! or turns it otherwise than about the vertical.
//!
//! Directions W and inertias are those of the predicted end configuration; p is the momentum each link would have
//! without contacts, joints and drives. Angular momenta about the CG, in frame I, are what the gyroscopic term of
//! (T 4.72) leaves constant, so it needs no approximation: a free link keeps its momentum exactly.
//!
//! Both end spheres of a link have the same rolling velocity, L_SC (e_z x omega), so their rolling frictions add up
//! to one law with the sum of their radii.

use nalgebra::{SVector, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::contact::LINK_CONTACTS_PER_LINK;
use crate::laws::Skin;
use crate::math::{Real, keep, select_into};
use crate::robot::Axes;
use crate::rows::{ContactRow, DriveRow, MotorRow, PairRow, Saved, is_zero};
use crate::stepping::StageStop;

use super::spatial_vector::{Momentum, Twist, Wrench, cross, scaled, sum, zero_vector};

/// One link in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct StageLink<T = f64> {
    /// e_x^B, e_y^B, e_z^B at the predicted end configuration.
    pub axes: [Vector3<T>; 3],
    /// p: linear momentum, and angular momentum about the CG \[kg m/s\], \[kg m^2/s\].
    pub momentum: Momentum<T>,
    pub mass: T,
    /// Theta_psi, about axes across the link \[kg m^2\].
    pub inertia: T,
    /// Theta_rho, about e_z^B \[kg m^2\].
    pub roll_inertia: T,
    /// L_i / 2 \[m\].
    pub half_length: T,
    /// How far the CG lies in front of the middle, towards the head \[m\].
    #[serde(default = "T::zero", skip_serializing_if = "is_zero")]
    pub cg_offset: T,
    /// L_GS: from the middle to the centres of the end spheres \[m\].
    pub sphere: T,
    /// L_SC \[m\].
    pub radius: T,
    /// e_x^Pi, along which friction has mu_x \[-\] (T 4.36).
    pub tangent: Vector2<T>,
    /// Front and rear: what the slip before the stage leaves of the sliding friction \[-\] (T 7.5.4).
    pub share: [T; 2],
    /// Front and rear: the contact closes when the sphere's vertical velocity plus this reaches zero \[m/s\].
    pub ground: [T; 2],
}

/// The drive of one axis of a joint in a stage.
pub type StageDrive<T = f64> = DriveRow<T>;

/// Contact of a link with an obstacle, w_H with its angular part in frame I.
pub type StageContact<T = f64> = ContactRow<Wrench<T>, T>;

/// Contact between two links of the robot, w of both with their angular parts in frame I.
pub type StagePair<T = f64> = PairRow<Wrench<T>, T>;

/// Friction of a contact of a link with an obstacle in a stage. A lane without it has tangents 0 and coefficient 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct StageObstacleFriction<T = f64> {
    /// Along two directions across the normal, at the surface of the link, with their angular parts in frame I.
    pub tangents: [Wrench<T>; 2],
    /// Coulomb coefficient: the radius of the disc of friction over the normal impulse \[-\].
    pub coefficient: T,
}

impl StageObstacleFriction {
    /// At a point of the surface, `arm` from the CG, with the unit normal `normal`.
    pub fn new(normal: &Vector3<f64>, arm: &Vector3<f64>, coefficient: f64) -> Self {
        let flat = if normal.z.abs() < STEEP { Vector3::z() } else { Vector3::x() };
        let along = flat.cross(normal).normalize();
        let tangent = |linear: Vector3<f64>| Wrench { linear, angular: arm.cross(&linear) };
        Self { tangents: [tangent(along), tangent(normal.cross(&along))], coefficient }
    }

    /// The same with the ground's coefficients along a link and across it: the ellipse is a disc of scaled tangents.
    pub fn along(axis: &Vector3<f64>, normal: &Vector3<f64>, arm: &Vector3<f64>, coefficients: &Vector2<f64>) -> Self {
        let across = normal.cross(axis).try_normalize(PARALLEL);
        let Some(across) = across else { return Self::new(normal, arm, coefficients.max()) };
        let coefficient = coefficients.max();
        let tangent = |direction: Vector3<f64>, own: f64| {
            let linear = direction * (own / coefficient);
            Wrench { linear, angular: arm.cross(&linear) }
        };
        let tangents = [tangent(across.cross(normal), coefficients.x), tangent(across, coefficients.y)];
        Self { tangents, coefficient }
    }

    /// The impulse along the tangents that is an impulse in space.
    pub fn impulse_of(&self, impulse: &Vector3<f64>) -> Vector2<f64> {
        let along = |tangent: &Wrench| {
            let squared = tangent.linear.norm_squared();
            if squared > 0.0 { tangent.linear.dot(impulse) / squared } else { 0.0 }
        };
        Vector2::new(along(&self.tangents[0]), along(&self.tangents[1]))
    }
}

/// Coefficients of ground friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct StageFriction<T = f64> {
    /// (mu_Tx, mu_Ty); with a skin the larger mu_Tx.
    pub sliding: Vector2<T>,
    /// mu_V.
    pub rolling: T,
    /// Of links that slide otherwise forward than backward.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<Skin>,
}

impl<T: Real> StageFriction<T> {
    pub fn none() -> Self {
        Self { sliding: Vector2::new(T::zero(), T::zero()), rolling: T::zero(), skin: None }
    }
}

/// Data of one stage, of one robot or of several side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Saved", deny_unknown_fields)]
pub struct Stage<T = f64> {
    /// c: the part of the step this stage covers \[s\].
    pub coefficient: T,
    pub friction: StageFriction<T>,
    /// The chain, and behind it what can be pushed, upright and without ends.
    pub links: Vec<StageLink<T>>,
    /// Semi-axes of the limit surface of what can be pushed: force along and across it, and moment \[N s\], \[N m s\].
    #[serde(default = "Vec::new", skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Vector3<T>>,
    /// The axes of each joint; of those beyond the end, and so where it is empty, both.
    #[serde(default)]
    pub axes: Vec<Axes>,
    /// Yaw and pitch of each joint; nothing drives an axis that it does not have.
    pub joints: Vec<[StageDrive<T>; 2]>,
    /// Of the two axes of each joint in turn; empty where no joint is near a stop.
    pub stops: Vec<StageStop<T>>,
    /// Of the same axes; empty where robots have none.
    #[serde(default = "Vec::new")]
    pub motors: Vec<MotorRow<T>>,
    /// Sorted by link.
    pub contacts: Vec<StageContact<T>>,
    /// Friction of each entry of `contacts`; empty where no obstacle has any.
    pub obstacle_friction: Vec<StageObstacleFriction<T>>,
    /// Contacts of the robot with itself.
    pub pairs: Vec<StagePair<T>>,
}

impl<T: Real> Stage<T> {
    pub fn with_capacity(links: usize) -> Self {
        let zero = T::zero();
        Self {
            coefficient: zero,
            friction: StageFriction::none(),
            links: Vec::with_capacity(links),
            surfaces: Vec::with_capacity(links),
            axes: Vec::with_capacity(links - 1),
            joints: Vec::with_capacity(links - 1),
            stops: Vec::with_capacity(2 * (links - 1)),
            motors: Vec::new(),
            contacts: Vec::with_capacity(CONTACTS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(CONTACTS_PER_LINK * links),
            pairs: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
        }
    }

    /// Number of links of the chain.
    #[inline(always)]
    pub fn chain(&self) -> usize {
        self.links.len() - self.surfaces.len()
    }

    /// The axes of a joint.
    #[inline(always)]
    pub fn axes_of(&self, joint: usize) -> Axes {
        self.axes.get(joint).copied().unwrap_or_default()
    }

    /// Copies without freeing memory.
    pub fn copy_from(&mut self, other: &Self) {
        (self.coefficient, self.friction) = (other.coefficient, other.friction);
        self.links.clone_from(&other.links);
        self.surfaces.clone_from(&other.surfaces);
        self.axes.clone_from(&other.axes);
        self.joints.clone_from(&other.joints);
        self.stops.clone_from(&other.stops);
        self.motors.clone_from(&other.motors);
        self.contacts.clone_from(&other.contacts);
        self.obstacle_friction.clone_from(&other.obstacle_friction);
        self.pairs.clone_from(&other.pairs);
    }
}

impl Stage {
    /// Leaves out obstacles that only other lanes have, so that the first `nodes` links and obstacles are left.
    pub(super) fn leave_out(&mut self, nodes: usize) {
        let chain = self.chain();
        self.links.truncate(nodes);
        self.surfaces.truncate(nodes - chain);
    }

    /// Of all links of the robot, were each faster by `speed` \[kg m/s\].
    pub(super) fn momentum_with(&self, speed: f64) -> f64 {
        self.links[..self.chain()].iter().map(|link| link.momentum.linear.norm() + link.mass * speed).sum()
    }
}

impl<T: Real> StageLink<T> {
    /// Coordinates of the centres of the front and of the rear sphere along e_z^B, from the CG \[m\].
    #[inline(always)]
    pub fn spheres(&self) -> [T; 2] {
        [self.cg_offset + self.sphere, self.cg_offset - self.sphere]
    }

    /// From the CG to the lowest point of the front (0) or rear (1) sphere (T 4.23).
    #[inline(always)]
    pub fn ground_arm(&self, end: usize) -> Vector3<T> {
        let mut arm = scaled(&self.axes[2], self.spheres()[end]);
        arm.z -= self.radius;
        arm
    }

    /// From the joint to the link before to the CG, and from there to the joint to the link behind.
    #[inline(always)]
    pub fn joint_arms(&self) -> [Vector3<T>; 2] {
        let (front, rear) = (self.half_length - self.cg_offset, self.half_length + self.cg_offset);
        [scaled(&self.axes[2], front), scaled(&self.axes[2], rear)]
    }

    /// Change of the link's twist with the rate of the joint to the link before about `axis`.
    #[inline(always)]
    pub fn hinge(&self, axis: &Vector3<T>) -> Twist<T> {
        Twist { linear: cross(axis, &self.joint_arms()[0]), angular: *axis }
    }

    /// M x.
    #[inline(always)]
    pub fn momentum_of(&self, twist: &Twist<T>) -> Momentum<T> {
        let z = &self.axes[2];
        let w = &twist.angular;
        let excess = (self.roll_inertia - self.inertia) * (z.x * w.x + z.y * w.y + z.z * w.z);
        let across = scaled(w, self.inertia);
        Momentum { linear: scaled(&twist.linear, self.mass), angular: sum(&across, &scaled(z, excess)) }
    }
}

/// What a solver returns and the certificate verifies.
#[derive(Debug, Clone, PartialEq)]
pub struct StageSolution<T = f64> {
    /// x of each link, frame I, and of what can be pushed.
    pub twist: Vec<Twist<T>>,
    /// Friction of the ground on each entry of [`Stage::surfaces`]: force and moment, frame I \[N s\], \[N m s\].
    pub surface: Vec<Vector3<T>>,
    /// (phi_h', phi_v') of each joint \[rad/s\].
    pub rate: Vec<[T; 2]>,
    /// P_N at the front and the rear sphere of each link \[N s\].
    pub normal: Vec<[T; 2]>,
    /// P_T at the same, in frame Pi \[N s\].
    pub friction: Vec<[Vector2<T>; 2]>,
    /// P_V of both spheres together, along the axes of frame I \[N s\].
    pub rolling: Vec<Vector2<T>>,
    /// D of each joint: yaw, pitch, positive driving phi upwards \[N m s\].
    pub actuator: Vec<[T; 2]>,
    /// Impulses of each entry of [`Stage::stops`] \[N s\].
    pub stop: Vec<[T; 2]>,
    /// Impulse of the gear's friction of each entry of [`Stage::motors`] \[N m s\].
    pub gear: Vec<T>,
    /// P_H of each entry of [`Stage::contacts`] \[N s\].
    pub contact: Vec<T>,
    /// P_T of each entry of [`Stage::obstacle_friction`], along its tangents \[N s\].
    pub obstacle_friction: Vec<Vector2<T>>,
    /// Impulse of each entry of [`Stage::pairs`] \[N s\].
    pub pair: Vec<T>,
}

impl<T: Real> StageSolution<T> {
    pub fn new(links: usize) -> Self {
        let zero = T::zero();
        let none = Vector2::new(zero, zero);
        Self {
            twist: vec![Twist::zero(); links],
            surface: Vec::with_capacity(links),
            rate: vec![[zero; 2]; links - 1],
            normal: vec![[zero; 2]; links],
            friction: vec![[none; 2]; links],
            rolling: vec![none; links],
            actuator: vec![[zero; 2]; links - 1],
            stop: Vec::with_capacity(2 * (links - 1)),
            gear: Vec::new(),
            contact: Vec::with_capacity(CONTACTS_PER_LINK * links),
            obstacle_friction: Vec::with_capacity(CONTACTS_PER_LINK * links),
            pair: Vec::with_capacity(LINK_CONTACTS_PER_LINK * links),
        }
    }

    /// The same with so many obstacles that can be pushed.
    pub fn among(mut self, movables: usize) -> Self {
        self.twist.resize(self.twist.len() + movables, Twist::zero());
        self.surface.resize(movables, zero_vector());
        self
    }

    /// Impulses of the ground on a link's ends, zero on what can be pushed: normal, sliding, rolling.
    #[inline(always)]
    pub fn ground(&self, node: usize) -> ([T; 2], [Vector2<T>; 2], Vector2<T>) {
        if node < self.normal.len() {
            return (self.normal[node], self.friction[node], self.rolling[node]);
        }
        let none = Vector2::new(T::zero(), T::zero());
        ([T::zero(); 2], [none; 2], none)
    }

    /// Copies without freeing memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.twist.clone_from(&other.twist);
        self.surface.clone_from(&other.surface);
        self.rate.clone_from(&other.rate);
        self.normal.clone_from(&other.normal);
        self.friction.clone_from(&other.friction);
        self.rolling.clone_from(&other.rolling);
        self.actuator.clone_from(&other.actuator);
        self.stop.clone_from(&other.stop);
        self.gear.clone_from(&other.gear);
        self.contact.clone_from(&other.contact);
        self.obstacle_friction.clone_from(&other.obstacle_friction);
        self.pair.clone_from(&other.pair);
    }

    /// Copies the given lanes of another solution of the same stage.
    #[inline(always)]
    pub fn select_into(&mut self, lanes: T::Mask, other: &Self) {
        for (own, theirs) in self.twist.iter_mut().zip(&other.twist) {
            own.select_into(lanes, theirs);
        }
        select_all(&mut self.surface, lanes, &other.surface);
        select_all(self.friction.as_flattened_mut(), lanes, other.friction.as_flattened());
        select_all(&mut self.rolling, lanes, &other.rolling);
        select_all(&mut self.obstacle_friction, lanes, &other.obstacle_friction);
        keep_all(self.normal.as_flattened_mut(), lanes, other.normal.as_flattened());
        keep_all(self.rate.as_flattened_mut(), lanes, other.rate.as_flattened());
        keep_all(self.actuator.as_flattened_mut(), lanes, other.actuator.as_flattened());
        keep_all(self.stop.as_flattened_mut(), lanes, other.stop.as_flattened());
        keep_all(&mut self.gear, lanes, &other.gear);
        keep_all(&mut self.contact, lanes, &other.contact);
        keep_all(&mut self.pair, lanes, &other.pair);
    }
}

impl StageSolution {
    /// The same as [`Stage::leave_out`] has done.
    pub(super) fn leave_out(&mut self, stage: &Stage) {
        self.twist.truncate(stage.links.len());
        self.surface.truncate(stage.surfaces.len());
    }
}

#[inline(always)]
fn select_all<T: Real, const N: usize>(own: &mut [SVector<T, N>], lanes: T::Mask, theirs: &[SVector<T, N>]) {
    for (own, theirs) in own.iter_mut().zip(theirs) {
        select_into(own, lanes, theirs);
    }
}

#[inline(always)]
fn keep_all<T: Real>(own: &mut [T], lanes: T::Mask, theirs: &[T]) {
    for (own, theirs) in own.iter_mut().zip(theirs) {
        keep(own, lanes, *theirs);
    }
}

/// Vertical part of a normal from which on its tangents are not taken from the vertical.
const STEEP: f64 = 0.9;

/// Room for obstacles near a link; more are possible.
pub(in crate::spatial) const CONTACTS_PER_LINK: usize = 4;

/// Sine between a link and a normal below which the link has no direction on the surface.
const PARALLEL: f64 = 1e-9;
