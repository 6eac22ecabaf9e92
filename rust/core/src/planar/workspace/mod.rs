//! The current stage over lanes: its data, how it is built, and what follows from its solution.

mod bodies;
mod kernels;
mod load;
mod motion;
mod motion_bound;
mod references;
mod results;

use nalgebra::{Vector2, Vector3};

use crate::control::ControlLaw;
use crate::math::{MAX_LANES, Mask, Real, laned};
use crate::obstacles::Movable;
use crate::planar::{Newton, PlanarSystem, Stage, StageSolution};
use crate::robot::Link;
use crate::stepping::lanes::{Lanes, NO_LANES};
use crate::stepping::penetration::Sinking;
use crate::stepping::{Awake, Closings, Drives, EnergyLedger, FrictionShares, JointStops, Motors, StageSpring};

use super::contacts::Contacts;
use super::io_drive::IoDrive;
use super::lane_fallback::LaneFallback;
use super::self_contact::SelfContactDetection;

pub use motion::{Motion, StageKinematics};
use references::References;

/// Data of the current stage, for as many robots as `T` has lanes.
pub struct Workspace<T: Real> {
    /// Constants of the links, in every lane, and whether the lanes' robots differ in them from the system's.
    pub constants: Vec<LinkConstants<T>>,
    is_varied: bool,
    /// Obstacles that can be pushed: as many as the robot of any lane has had, and those that are awake, behind the links of the
    /// robot in all that has an entry for each. A lane that has fewer than others has absent ones, which rest and touch nothing.
    pub room: usize,
    pub awake: Awake,
    absent: LinkConstants<T>,
    /// What holds them, and whether anything holds any.
    springs: Vec<StageSpring<T>>,
    has_springs: bool,
    /// Whether the ground resists the spin of links too.
    resists_spin: bool,
    /// Acceleration by which gravity pulls the links along inclined ground \[m/s^2\].
    pull: Vector2<T>,
    /// Zero for each link.
    at_rest: Vec<Vector3<T>>,
    pub motion: Motion<T>,
    pub references: References<T>,
    pub drives: Drives<T>,
    /// Input-output linearisation instead of PD.
    io: Option<IoDrive<T>>,
    pub shares: FrictionShares<T>,
    /// Whether any robot's scene has obstacles; without them it does not matter how far a robot moves.
    pub has_obstacles: bool,
    /// The lanes whose robots have obstacles around them; for the others a coarse bound on their motion does.
    pub among_obstacles: T::Mask,
    pub near_obstacles: Lanes,
    /// How far any point of a robot may move, with the margin added, before obstacles matter; negative where some may, or
    /// nothing is listed yet \[m\].
    pub clear_way: T,
    /// The lanes whose robots stay within it in the stage at hand.
    pub is_clear: T::Mask,
    pub contacts: Contacts<T>,
    pub self_contacts: SelfContactDetection<T>,
    pub joint_stops: JointStops<T>,
    pub motors: Motors<T>,
    pub closings: Closings<T>,
    /// Forces of the last stage.
    pub friction_force: Vec<Vector2<T>>,
    /// Of the ground against spin; empty where it does not resist it.
    spin_torque: Vec<T>,
    pub actuator_torque: Vec<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    fallback: LaneFallback,
    pub result: StageResult<T>,
}

/// What follows from the solution of a stage.
pub struct StageResult<T: Real> {
    /// Work.
    stage_energy: EnergyLedger<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    /// Solution lane by lane, once it is accepted; some lanes may need another prediction.
    pub twist: Vec<Vector3<T>>,
    pub actuator: Vec<T>,
    energy: EnergyLedger<T>,
    /// End configuration.
    pub end: Vec<Vector3<T>>,
    /// Bound on the distance of any point of the robot from the predicted end of the step \[m\].
    pub misprediction: T,
    /// What the step does to penetrations, lane by lane.
    pub sinking: [Sinking; MAX_LANES],
    /// Whether the end of the step is the state of a robot rather than of a diverged computation.
    plausible: T::Mask,
}

#[derive(Debug, Clone, Copy)]
pub struct LinkConstants<T> {
    pub mass: T,
    pub inertia: T,
    /// L_i / 2, and how far the CG lies in front of the middle \[m\].
    pub half_length: T,
    pub cg_offset: T,
    pub reach: T,
    /// mu m g \[N\].
    pub friction: Vector2<T>,
    /// Acceleration along inclined ground \[m/s^2\].
    pub pull: Vector2<T>,
    /// Largest moment against spin \[N m\].
    pub spin: T,
}

impl<T: Real> LinkConstants<T> {
    fn of(system: &PlanarSystem, link: &Link) -> Self {
        Self {
            mass: T::splat(link.mass),
            inertia: T::splat(link.inertia),
            half_length: T::splat(0.5 * link.length),
            cg_offset: T::splat(link.cg_offset),
            reach: T::splat(link.reach()),
            friction: system.friction_force(link).map(T::splat),
            pull: system.pull().map(T::splat),
            spin: T::splat(system.spin_torque(link, &Vector2::repeat(1.0))),
        }
    }
}

laned! {
    LinkConstants { mass, inertia, half_length, cg_offset, reach, friction, pull, spin };
}

impl LinkConstants<f64> {
    fn of_movable(system: &PlanarSystem, movable: &Movable) -> Self {
        let bounds = movable.friction(system.normal_gravity());
        let (reach, friction, spin) = (movable.turning_reach(), bounds.xy(), bounds.z);
        Self { reach, friction, spin, ..Self::of(system, &movable.link) }
    }
}

impl<T: Real> Workspace<T> {
    pub fn new(system: &PlanarSystem, movables: usize) -> Self {
        let links = system.robot.link_count();
        let nodes = links + movables;
        let zero = T::zero();
        let none = Vector2::new(zero, zero);
        let rest = vec![Vector3::new(zero, zero, zero); nodes];
        let mut constants: Vec<_> = system.robot.links.iter().map(|link| LinkConstants::of(system, link)).collect();
        constants.reserve_exact(movables);
        let absent = LinkConstants { friction: none, pull: none, spin: zero, reach: zero, ..constants[0] };
        let resists_spin = system.resists_spin();
        Self {
            constants,
            is_varied: false,
            room: movables,
            awake: Awake::none(),
            absent,
            springs: Vec::with_capacity(movables),
            has_springs: false,
            resists_spin,
            pull: system.pull().map(T::splat),
            at_rest: rest.clone(),
            motion: Motion::new(system, movables),
            references: References::new(links - 1),
            drives: Drives::new(&system.robot, system.gains(), 1),
            io: (system.controller.law == ControlLaw::Io).then(|| IoDrive::new(system)),
            shares: FrictionShares::new(links, system.stribeck.speed, &system.patches),
            has_obstacles: false,
            among_obstacles: T::Mask::of(|_| false),
            near_obstacles: NO_LANES,
            clear_way: zero,
            is_clear: T::Mask::of(|_| false),
            contacts: Contacts::with_capacity(nodes),
            self_contacts: SelfContactDetection::new(&system.robot, movables),
            joint_stops: JointStops::new(&system.robot, 1),
            motors: Motors::new(&system.robot, 1),
            closings: Closings::none(),
            friction_force: vec![Vector2::new(zero, zero); nodes],
            spin_torque: vec![zero; if resists_spin || movables > 0 { nodes } else { 0 }],
            actuator_torque: vec![zero; links - 1],
            stage: Stage { skin: system.skin, ..Stage::with_capacity(nodes) },
            solution: StageSolution { actuator: vec![zero; links - 1], ..StageSolution::new(nodes) },
            newton: Newton::new(nodes),
            fallback: LaneFallback::new(nodes),
            result: StageResult {
                stage_energy: EnergyLedger::zero(),
                deviation: zero,
                twist: rest.clone(),
                actuator: vec![zero; links - 1],
                energy: EnergyLedger::zero(),
                end: rest,
                misprediction: zero,
                sinking: [Sinking::No; MAX_LANES],
                plausible: T::Mask::of(|_| true),
            },
        }
    }

    /// Whether a lane's robot may touch a peg or itself.
    fn is_near_contact(&self, lane: usize) -> bool {
        self.near_obstacles[lane] || self.self_contacts.is_near(lane)
    }
}
