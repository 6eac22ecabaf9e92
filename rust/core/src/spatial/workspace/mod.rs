//! The current stage over lanes: its data, how it is built, and what follows from its solution.

mod bodies;
mod kernels;
mod load;
mod motion;
mod results;

pub use kernels::opening;
pub use motion::{Motion, StageKinematics};

use nalgebra::{Vector2, Vector3};

use crate::contact::ContactMemory;
use crate::gait::CardanTarget;
use crate::math::{MAX_LANES, Mask, Real};
use crate::robot::Link;
use crate::spatial::spatial_vector::zero_vector;
use crate::spatial::{
    ChainVelocity, Configuration, Frame, Momentum, Newton, SpatialSystem, Stage, StageFriction, StageLink,
    StageSolution,
};
use crate::stepping::penetration::Sinking;
use crate::stepping::{Awake, Closings, Drives, EnergyLedger, FrictionShares, JointStops, Motors};

use super::chain_state::GroundForces;
use super::lane_fallback::LaneFallback;
use super::obstacle_contacts::ObstacleContacts;
use super::rest::RestCandidate;
use super::self_contact::SelfContactDetection;
use super::support::Support;

use bodies::StageMovable;

/// Data of the current stage, for as many robots as `T` has lanes.
pub struct Workspace<T: Real> {
    /// Farthest point of each link's surface from its CG \[m\].
    reach: Vec<T>,
    /// Acceleration in frame I \[m/s^2\].
    gravity: Vector3<T>,
    /// Whether a lane's robot differs from the system's in mass or friction.
    is_varied: bool,
    pub motion: Motion<T>,
    /// References at the end of the stage, angle and rate of yaw and pitch of each joint, and those of one robot.
    target: Vec<[[T; 2]; 2]>,
    targets: Vec<CardanTarget>,
    drives: Drives<T>,
    /// Obstacles that can be pushed: as many as the robot of any lane has had, those that are awake, and their nodes behind the
    /// chain. A lane that has fewer than others has absent ones, which rest and touch nothing.
    room: usize,
    pub awake: Awake,
    movables: Vec<StageMovable<T>>,
    absent: StageMovable<T>,
    upright: StageLink<T>,
    /// Their friction in the last stage \[N\], \[N m\].
    surface_force: Vec<Vector3<T>>,
    /// Of each link, on the coefficients of friction of the ground.
    friction_factor: Vec<T>,
    shares: FrictionShares<T>,
    /// Which spheres the ground carried at the start of the step.
    stood: Vec<[T::Mask; 2]>,
    /// Lanes whose robots' last steps began at rest.
    began_at_rest: T::Mask,
    pub contacts: ObstacleContacts<T>,
    pub self_contacts: SelfContactDetection<T>,
    /// Contacts of the last stage, lane by lane: a step that is rejected leaves those of its robot unchanged.
    pub known: [ContactMemory; MAX_LANES],
    /// Of the present stage, lane by lane.
    pub supports: [Vec<Support>; MAX_LANES],
    joint_stops: JointStops<T>,
    motors: Motors<T>,
    pub closings: Closings<T>,
    /// Forces of the last stage.
    pub forces: GroundForces<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    /// The same after further steps of the solver.
    polished: StageSolution<T>,
    newton: Newton<T>,
    rest: RestCandidate<T>,
    fallback: LaneFallback,
    /// Normal impulses of the ground in the first stage of a step.
    first_ground: Vec<T>,
    pub result: StageResult<T>,
}

/// What follows from the solution of a stage.
pub struct StageResult<T: Real> {
    /// Work.
    energy: EnergyLedger<T>,
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
pub struct Kept<T> {
    /// The stage's end velocity and momenta.
    pub end: ChainVelocity<T>,
    pub momentum: Vec<Momentum<T>>,
    pub actuator: Vec<[T; 2]>,
    pub energy: EnergyLedger<T>,
}

impl<T: Real> Workspace<T> {
    pub fn new(system: &SpatialSystem, movables: usize) -> Self {
        let links = system.robot.link_count();
        let nodes = links + movables;
        let zero = T::zero();
        Self {
            reach: system
                .robot
                .links
                .iter()
                .map(|link| T::splat(link.reach().max(0.5 * link.length + link.cg_offset.abs())))
                .collect(),
            gravity: system.gravity.map(T::splat),
            is_varied: false,
            motion: Motion::new(system, movables),
            target: vec![[[zero; 2]; 2]; links - 1],
            targets: vec![CardanTarget::default(); links - 1],
            drives: Drives::new(&system.robot, system.gains(), 2),
            room: movables,
            awake: Awake::none(),
            movables: Vec::with_capacity(movables),
            absent: StageMovable::absent(system),
            upright: StageLink { cg_offset: zero, share: [zero; 2], ..stage_link(&system.robot.links[0]) },
            surface_force: vec![zero_vector(); movables],
            friction_factor: system.robot.links.iter().map(|link| T::splat(link.friction_factor)).collect(),
            shares: FrictionShares::new(2 * links, system.stribeck.speed, &system.patches),
            stood: vec![[T::Mask::of(|_| false); 2]; links],
            began_at_rest: T::Mask::of(|_| false),
            contacts: ObstacleContacts::with_capacity(nodes),
            self_contacts: SelfContactDetection::new(&system.robot, movables),
            known: std::array::from_fn(|_| ContactMemory::with_capacity(8 * nodes)),
            supports: std::array::from_fn(|_| Vec::with_capacity(2 * links)),
            joint_stops: JointStops::new(&system.robot, 2),
            motors: Motors::new(&system.robot, 2),
            closings: Closings::none(),
            forces: GroundForces::none(links),
            stage: empty_stage(system, movables),
            solution: StageSolution::new(links).among(movables),
            polished: StageSolution::new(links).among(movables),
            newton: Newton::new(nodes),
            rest: RestCandidate::new(nodes),
            fallback: LaneFallback::new(links, movables),
            first_ground: vec![zero; links],
            result: StageResult {
                energy: EnergyLedger::zero(),
                deviation: zero,
                kept: Kept {
                    end: ChainVelocity::rest(links).among(movables),
                    momentum: vec![Momentum::zero(); links],
                    actuator: vec![[zero; 2]; links - 1],
                    energy: EnergyLedger::zero(),
                },
                arrival: Configuration::straight(links).among(movables),
                sinking_into_ground: zero,
                sinking: [Sinking::No; MAX_LANES],
            },
        }
    }
}

/// A stage with the constants of the system's robot.
fn empty_stage<T: Real>(system: &SpatialSystem, movables: usize) -> Stage<T> {
    let mut stage = Stage::with_capacity(system.robot.link_count() + movables);
    stage.axes.clone_from(&system.robot.axes);
    let sliding = system.friction.map(T::splat);
    stage.friction = StageFriction { sliding, rolling: T::splat(system.rolling_friction), skin: system.skin };
    stage.links.extend(system.robot.links.iter().map(stage_link));
    stage.surfaces.reserve(movables);
    stage
}

fn stage_link<T: Real>(link: &Link) -> StageLink<T> {
    let zero = T::zero();
    StageLink {
        axes: Frame::origin().axes,
        momentum: Momentum::zero(),
        mass: T::splat(link.mass),
        inertia: T::splat(link.inertia),
        roll_inertia: T::splat(link.roll_inertia),
        half_length: T::splat(0.5 * link.length),
        cg_offset: T::splat(link.cg_offset),
        sphere: T::splat(link.contact_half_length),
        radius: T::splat(link.radius),
        tangent: Vector2::new(T::splat(1.0), zero),
        share: [T::splat(1.0); 2],
        ground: [zero; 2],
    }
}
