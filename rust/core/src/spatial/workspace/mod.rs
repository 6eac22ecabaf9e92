//! The current stage over lanes: its data, how it is built, and what follows from its solution.

mod kernels;
mod load;
mod results;

pub use kernels::opening;

use nalgebra::{Vector2, Vector3};

use crate::gait::CardanTarget;
use crate::math::{MAX_LANES, Mask, Real};
use crate::robot::Breakage;
use crate::spatial::{
    ChainVelocity, Configuration, Frame, Momentum, Newton, SpatialSystem, SpatialVector, Stage, StageFriction,
    StageLink, StageSolution, Twist,
};
use crate::stepping::penetration::Sinking;
use crate::stepping::{Backlash, Closings, EnergyLedger, JointStops, StribeckBounds};

use super::chain_state::GroundForces;
use super::contact_map::ContactMap;
use super::lane_fallback::LaneFallback;
use super::rest::RestCandidate;
use super::self_contact::SelfContactDetection;
use super::support::Support;

/// Data of the current stage, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct Workspace<T: Real> {
    /// Farthest point of each link's surface from its CG \[m\].
    reach: Vec<T>,
    half_length: Vec<T>,
    /// Of the robot, see [`crate::robot::Robot::extent`] \[m\].
    pub extent: f64,
    /// Acceleration in frame I \[m/s^2\].
    gravity: Vector3<T>,
    /// Gains k_P, k_D.
    gains: [T; 2],
    pub torque_limit: T,
    /// Whether a lane's robot differs from the system's in mass or friction.
    is_varied: bool,
    backlash: Backlash<T>,
    stribeck: StribeckBounds<T>,
    /// Joints that are locked or limp.
    broken: Vec<(usize, Breakage)>,
    /// Joint references at the end of the stage: yaw and pitch, angle and rate.
    pub target: Vec<[[T; 2]; 2]>,
    /// Robots at the start of the step.
    pub start: Configuration<T>,
    pub start_velocity: ChainVelocity<T>,
    pub start_momentum: Vec<Momentum<T>>,
    pub start_frames: Vec<Frame<T>>,
    /// Heights of the spheres' lowest points there \[m\], and which of them the ground carried.
    start_gap: Vec<[T; 2]>,
    stood: Vec<[T::Mask; 2]>,
    /// q_B and the expected end velocity of the stage.
    pub base: Configuration<T>,
    pub base_frames: Vec<Frame<T>>,
    guess: ChainVelocity<T>,
    /// Reference momenta p_R, without gravity.
    momentum: Vec<Momentum<T>>,
    /// Expected end configuration, and the twists of the guess there.
    pub predicted: Configuration<T>,
    pub frames: Vec<Frame<T>>,
    pub expected: Vec<Twist<T>>,
    /// Forces of the last stage.
    pub forces: GroundForces<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    newton: Newton<T>,
    rest: RestCandidate<T>,
    /// Lanes whose robots' last steps began at rest.
    began_at_rest: T::Mask,
    contacts: ContactMap,
    /// Of the present stage.
    pub supports: Vec<Support>,
    pub self_contacts: SelfContactDetection<T>,
    joint_stops: JointStops<T>,
    fallback: LaneFallback,
    /// Normal impulses of the ground in the first stage of a step.
    first_ground: Vec<T>,
    /// References of one robot.
    targets: Vec<CardanTarget>,
    /// Torques of the actuators beside the controller's, and those of one robot.
    has_own_torques: bool,
    own_torque: Vec<[T; 2]>,
    torques: Vec<f64>,
    energy: EnergyLedger<T>,
    pub closings: Closings,
    /// Of the ground alone: when spheres touch down within the step, and when after it \[s\].
    touchdown: T,
    touchdown_forecast: T,
    /// Time from the start of the step to the end of the stage \[s\].
    elapsed: T,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    pub kept: Kept<T>,
    /// Configuration at the end of the step.
    pub arrival: Configuration<T>,
    /// How much deeper the step takes a sphere that has sunk into the ground, at most \[m\].
    pub sinking_into_ground: T,
    /// What the step does to penetrations into pegs and links, lane by lane.
    pub sinking: [Sinking; MAX_LANES],
}

/// What is kept of a stage, lane by lane, once its solution is accepted; some lanes may need another prediction.
#[derive(Debug, Clone)]
pub struct Kept<T> {
    /// The stage's end velocity and momenta.
    pub end: ChainVelocity<T>,
    pub momentum: Vec<Momentum<T>>,
    pub actuator: Vec<[T; 2]>,
    pub energy: EnergyLedger<T>,
}

impl<T: Real> Workspace<T> {
    pub fn new(system: &SpatialSystem) -> Self {
        let links = system.robot.link_count();
        let zero = T::zero();
        let none = || vec![SpatialVector::zero(); links];
        let frames = || vec![Frame::origin(); links];
        Self {
            reach: system.robot.links.iter().map(|link| T::splat(link.reach().max(0.5 * link.length))).collect(),
            half_length: system.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            extent: system.robot.extent(),
            gravity: system.gravity.map(T::splat),
            gains: [system.controller.kp, system.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            is_varied: false,
            backlash: Backlash::new(2 * (links - 1)),
            stribeck: StribeckBounds::new(2 * links, system.stribeck.speed),
            broken: system.robot.broken.clone(),
            target: vec![[[zero; 2]; 2]; links - 1],
            start: Configuration::straight(links),
            start_velocity: ChainVelocity::rest(links),
            start_momentum: none(),
            start_frames: frames(),
            start_gap: vec![[zero; 2]; links],
            stood: vec![[T::Mask::of(|_| false); 2]; links],
            base: Configuration::straight(links),
            base_frames: frames(),
            guess: ChainVelocity::rest(links),
            momentum: none(),
            predicted: Configuration::straight(links),
            frames: frames(),
            expected: none(),
            forces: GroundForces::none(links),
            stage: empty_stage(system),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            rest: RestCandidate::new(links),
            began_at_rest: T::Mask::of(|_| false),
            contacts: ContactMap::new(links),
            supports: Vec::with_capacity(2 * links * T::LANES),
            self_contacts: SelfContactDetection::new(&system.robot),
            joint_stops: JointStops::new(&system.robot, 2),
            fallback: LaneFallback::new(links),
            first_ground: vec![zero; links],
            targets: vec![CardanTarget::default(); links - 1],
            has_own_torques: false,
            own_torque: vec![[zero; 2]; links - 1],
            torques: vec![0.0; 2 * (links - 1)],
            energy: EnergyLedger::zero(),
            closings: Closings::none(),
            touchdown: zero,
            touchdown_forecast: zero,
            elapsed: zero,
            deviation: zero,
            kept: Kept {
                end: ChainVelocity::rest(links),
                momentum: none(),
                actuator: vec![[zero; 2]; links - 1],
                energy: EnergyLedger::zero(),
            },
            arrival: Configuration::straight(links),
            sinking_into_ground: zero,
            sinking: [Sinking::No; MAX_LANES],
        }
    }
}

/// A stage with the constants of the system's robot.
fn empty_stage<T: Real>(system: &SpatialSystem) -> Stage<T> {
    let mut stage = Stage::with_capacity(system.robot.link_count());
    let zero = T::zero();
    let sliding = system.friction.map(T::splat);
    stage.friction = StageFriction { sliding, rolling: T::splat(system.rolling_friction) };
    stage.links.extend(system.robot.links.iter().map(|link| StageLink {
        axes: Frame::origin().axes,
        momentum: Momentum::zero(),
        mass: T::splat(link.mass),
        inertia: T::splat(link.inertia),
        roll_inertia: T::splat(link.roll_inertia),
        half_length: T::splat(0.5 * link.length),
        sphere: T::splat(link.contact_half_length),
        radius: T::splat(link.radius),
        tangent: Vector2::new(T::splat(1.0), zero),
        share: [T::splat(1.0); 2],
        ground: [zero; 2],
    }));
    stage
}
