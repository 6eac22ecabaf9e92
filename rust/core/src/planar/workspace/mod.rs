//! The current stage over lanes: its data, how it is built, and what follows from its solution.

mod kernels;
mod load;
mod motion_bound;
mod results;

use nalgebra::{Vector2, Vector3};

use crate::control::ControlLaw;
use crate::gait::{Jet, JointTarget, WaveJets};
use crate::math::{MAX_LANES, Mask, Real};
use crate::planar::{Heading, Newton, PlanarSystem, Stage, StageSolution};
use crate::robot::{Breakage, Link};
use crate::stepping::lanes::{Lanes, NO_LANES};
use crate::stepping::{Backlash, Closings, EnergyLedger, JointStops, StribeckBounds};

use super::contacts::Contacts;
use super::io_drive::IoDrive;
use super::lane_fallback::LaneFallback;
use super::self_contact::SelfContactDetection;
use crate::stepping::penetration::Sinking;

use motion_bound::MotionBound;

/// Data of the current stage, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct Workspace<T: Real> {
    /// Constants of the links, in every lane.
    pub constants: Vec<LinkConstants<T>>,
    pub half_length: Vec<T>,
    smallest_radius: f64,
    /// Acceleration by which gravity pulls the links along inclined ground \[m/s^2\].
    pull: Vector2<T>,
    /// Zero for each link.
    at_rest: Vec<Vector3<T>>,
    /// State at the start of the step.
    pub start_pose: Vec<Vector3<T>>,
    pub start_twist: Vec<Vector3<T>>,
    /// q_B, u_R and the expected end velocity of the stage.
    pub base: Vec<Vector3<T>>,
    pub reference: Vec<Vector3<T>>,
    pub guess: Vec<Vector3<T>>,
    /// Expected end configuration, and the mean velocities on the way there.
    pub predicted: Vec<Vector3<T>>,
    pub travel: Vec<Vector3<T>>,
    pub heading: Vec<Heading<T>>,
    /// The wave that the joints follow at the end of the stage, where they follow one.
    pub wave: WaveJets<T>,
    /// Joint references at the end of the stage, and gains k_P, k_D.
    pub target: Vec<Jet<T>>,
    pub gains: [T; 2],
    pub torque_limit: T,
    /// Whether any robot's scene has pegs; without them it does not matter how far a robot moves.
    pub has_pegs: bool,
    /// The lanes whose robots have pegs around them; for the others a coarse bound on their motion does.
    pub among_pegs: T::Mask,
    pub near_pegs: Lanes,
    pub contacts: Contacts,
    pub self_contacts: SelfContactDetection<T>,
    pub joint_stops: JointStops<T>,
    pub closings: Closings,
    /// Time from the start of the step to the end of the stage \[s\].
    pub elapsed: T,
    /// How far away pegs may matter to the stage.
    pub motion_bound: MotionBound<T>,
    /// Input-output linearisation instead of PD.
    pub io: Option<IoDrive<T>>,
    /// Joints that are locked or limp.
    broken: Vec<(usize, Breakage)>,
    pub backlash: Backlash<T>,
    pub stribeck: StribeckBounds<T>,
    /// Whether the lanes' robots differ from the system's.
    is_varied: bool,
    /// References of one robot.
    targets: Vec<JointTarget>,
    /// Torques of the actuators beside the controller's, and those of one robot.
    has_own_torques: bool,
    own_torque: Vec<T>,
    torques: Vec<f64>,
    /// Forces of the last stage.
    pub friction_force: Vec<Vector2<T>>,
    pub actuator_torque: Vec<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    fallback: LaneFallback,
    /// End configuration.
    pub end: Vec<Vector3<T>>,
    /// Work of the solved stage.
    energy: EnergyLedger<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    /// Solution lane by lane, once it is accepted; some lanes may need another prediction.
    pub kept_twist: Vec<Vector3<T>>,
    pub kept_actuator: Vec<T>,
    kept_energy: EnergyLedger<T>,
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
    pub reach: T,
    /// mu m g \[N\].
    pub friction: Vector2<T>,
}

impl<T: Real> LinkConstants<T> {
    fn of(system: &PlanarSystem, link: &Link) -> Self {
        Self {
            mass: T::splat(link.mass),
            inertia: T::splat(link.inertia),
            reach: T::splat(link.reach()),
            friction: system.friction_force(link).map(T::splat),
        }
    }
}

impl<T: Real> Workspace<T> {
    pub fn new(system: &PlanarSystem) -> Self {
        let links = system.robot.link_count();
        let zero = T::zero();
        let rest = vec![Vector3::new(zero, zero, zero); links];
        Self {
            constants: system.robot.links.iter().map(|link| LinkConstants::of(system, link)).collect(),
            half_length: system.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            smallest_radius: system.smallest_radius(),
            pull: system.pull().map(T::splat),
            at_rest: rest.clone(),
            start_pose: rest.clone(),
            start_twist: rest.clone(),
            base: rest.clone(),
            reference: rest.clone(),
            guess: rest.clone(),
            predicted: rest.clone(),
            travel: rest.clone(),
            heading: vec![Heading { cos: T::splat(1.0), sin: zero }; links],
            wave: WaveJets::still(),
            target: vec![Jet { value: zero, rate: zero, acceleration: zero }; links - 1],
            gains: [system.controller.kp, system.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            io: (system.controller.law == ControlLaw::Io).then(|| IoDrive::new(system)),
            broken: system.robot.broken.clone(),
            backlash: Backlash::new(links - 1),
            stribeck: StribeckBounds::new(links, system.stribeck().speed),
            is_varied: false,
            targets: vec![JointTarget::default(); links - 1],
            has_own_torques: false,
            own_torque: vec![zero; links - 1],
            torques: vec![0.0; links - 1],
            has_pegs: false,
            among_pegs: T::Mask::of(|_| false),
            near_pegs: NO_LANES,
            contacts: Contacts::with_capacity(links, T::LANES),
            self_contacts: SelfContactDetection::new(&system.robot),
            joint_stops: JointStops::new(&system.robot, 1),
            closings: Closings::none(),
            elapsed: zero,
            motion_bound: MotionBound { fastest: zero, displacement: zero },
            friction_force: vec![Vector2::new(zero, zero); links],
            deviation: zero,
            kept_twist: rest.clone(),
            kept_actuator: vec![zero; links - 1],
            kept_energy: EnergyLedger::zero(),
            misprediction: zero,
            sinking: [Sinking::No; MAX_LANES],
            plausible: T::Mask::of(|_| true),
            actuator_torque: vec![zero; links - 1],
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            fallback: LaneFallback::new(links),
            end: rest.clone(),
            energy: EnergyLedger::zero(),
        }
    }

    /// Whether a lane's robot may touch a peg or itself.
    fn is_near_contact(&self, lane: usize) -> bool {
        self.near_pegs[lane] || self.self_contacts.is_near(lane)
    }
}
