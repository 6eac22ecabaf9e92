//! The stage at hand over lanes: its data, how it is built, and what follows from its solution.

use nalgebra::{Vector2, Vector3};

use crate::contact::PAIRS_PER_LINK;
use crate::control::ControlLaw;
use crate::gait::{Jet, WaveJets};
use crate::math::{Mask, Real};
use crate::planar::{Heading, Newton, Stage, StageJoint, StageLink, StageSolution};
use crate::robot::Link;

use super::Plant;
use super::backlash::FreePlay;
use super::io_drive::{IoDrive, Situation};
use super::stribeck::Weakening;
use crate::stepping::energy::Works;

/// Data of the stage at hand, for as many robots as `T` has lanes.
#[derive(Debug, Clone)]
pub struct StageWork<T: Real> {
    /// Constants of the links, in every lane.
    pub constants: Vec<LinkConstants<T>>,
    pub half_length: Vec<T>,
    /// Zero for each link.
    at_rest: Vec<Vector3<T>>,
    /// q_B, u_R and the expected end velocity of the stage.
    pub base: Vec<Vector3<T>>,
    pub reference: Vec<Vector3<T>>,
    pub guess: Vec<Vector3<T>>,
    /// Expected end configuration.
    pub predicted: Vec<Vector3<T>>,
    pub heading: Vec<Heading<T>>,
    /// The wave that the joints follow at the end of the stage, where they follow one.
    pub wave: WaveJets<T>,
    /// Joint references at the end of the stage, and gains k_P, k_D.
    pub target: Vec<Jet<T>>,
    pub gains: [T; 2],
    pub torque_limit: T,
    /// Whether any robot's scene has pegs; without them nobody asks how far a robot moves.
    pub has_pegs: bool,
    /// The lanes whose robots have pegs around them; for the others a coarse bound on their motion does.
    pub among_pegs: T::Mask,
    /// How far away pegs may matter to the stage.
    pub outlook: Outlook<T>,
    /// Input-output linearisation instead of PD.
    pub io: Option<IoDrive<T>>,
    pub free_play: FreePlay<T>,
    pub weakening: Weakening<T>,
    /// Forces of the last stage.
    pub friction_force: Vec<Vector2<T>>,
    pub contact_force: Vec<T>,
    pub drive_torque: Vec<T>,
    pub stage: Stage<T>,
    pub solution: StageSolution<T>,
    pub newton: Newton<T>,
    /// End configuration.
    pub end: Vec<Vector3<T>>,
    /// Works of the solved stage \[J\].
    pub works: Works<T>,
    /// How far the stage ended from its prediction, for any point of the robot \[m\].
    pub deviation: T,
    /// Solution lane by lane, once it stands: some lanes may need another prediction.
    pub kept_twist: Vec<Vector3<T>>,
    pub kept_drive: Vec<T>,
    pub kept_works: Works<T>,
}

#[derive(Debug, Clone, Copy)]
pub struct LinkConstants<T> {
    pub mass: T,
    pub inertia: T,
    pub reach: T,
    /// mu m g \[N\].
    pub friction: Vector2<T>,
}

/// How far away pegs may matter to a stage.
#[derive(Debug, Clone, Copy)]
pub struct Outlook<T> {
    /// Largest speed of any point of the robot, at the start of the stage or expected at its end \[m/s\].
    pub fastest: T,
    /// Largest way of any point of the robot from the start of the step to the predicted end \[m\].
    pub lead: T,
}

impl<T: Real> LinkConstants<T> {
    fn of(plant: &Plant, link: &Link) -> Self {
        Self {
            mass: T::splat(link.mass),
            inertia: T::splat(link.inertia),
            reach: T::splat(link.reach()),
            friction: plant.friction_force(link).map(T::splat),
        }
    }

    /// Bound on how far a point of the link moves between two poses, or on how much faster it is at one of
    /// two twists.
    #[inline(always)]
    pub fn farthest(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        let (x, y) = (to.x - from.x, to.y - from.y);
        (x * x + y * y).sqrt() + self.reach * (to.z - from.z).abs()
    }

    /// A coarser bound that takes no root.
    #[inline(always)]
    fn farther(&self, to: &Vector3<T>, from: &Vector3<T>) -> T {
        (to.x - from.x).abs() + (to.y - from.y).abs() + self.reach * (to.z - from.z).abs()
    }
}

impl<T: Real> StageWork<T> {
    pub fn new(plant: &Plant) -> Self {
        let links = plant.robot.link_count();
        let zero = T::zero();
        let rest = vec![Vector3::new(zero, zero, zero); links];
        Self {
            constants: plant.robot.links.iter().map(|link| LinkConstants::of(plant, link)).collect(),
            half_length: plant.robot.links.iter().map(|link| T::splat(0.5 * link.length)).collect(),
            at_rest: rest.clone(),
            base: rest.clone(),
            reference: rest.clone(),
            guess: rest.clone(),
            predicted: rest.clone(),
            heading: vec![Heading { cos: T::splat(1.0), sin: zero }; links],
            wave: WaveJets::still(),
            target: vec![Jet { value: zero, rate: zero, acceleration: zero }; links - 1],
            gains: [plant.controller.kp, plant.controller.kd].map(T::splat),
            torque_limit: T::splat(f64::INFINITY),
            io: (plant.controller.law == ControlLaw::Io).then(|| IoDrive::new(&plant.robot, plant.friction())),
            free_play: FreePlay::new(links - 1),
            weakening: Weakening::new(links, plant.stribeck().speed),
            has_pegs: false,
            among_pegs: T::Mask::of(|_| false),
            outlook: Outlook { fastest: zero, lead: zero },
            friction_force: vec![Vector2::new(zero, zero); links],
            deviation: zero,
            kept_twist: rest.clone(),
            kept_drive: vec![zero; links - 1],
            kept_works: Works::none(),
            drive_torque: vec![zero; links - 1],
            contact_force: Vec::with_capacity(PAIRS_PER_LINK * links),
            stage: Stage::with_capacity(links),
            solution: StageSolution::new(links),
            newton: Newton::new(links),
            end: rest.clone(),
            works: Works::none(),
        }
    }

    #[inline(always)]
    pub fn fill_links(&mut self) {
        let c = T::splat(self.stage.coefficient);
        self.stage.links.clear();
        for (i, link) in self.constants.iter().enumerate() {
            self.stage.links.push(StageLink {
                heading: self.heading[i],
                reference: self.reference[i],
                mass: link.mass,
                inertia: link.inertia,
                half_length: self.half_length[i],
                friction: Vector2::new(link.friction.x * c, link.friction.y * c),
            });
        }
        if self.weakening.is_any {
            self.weakening.weaken(&mut self.stage.links);
        }
    }

    #[inline(always)]
    pub fn fill_joints(&mut self) {
        let Some(io) = &mut self.io else { return self.fill_pd() };
        let situation = Situation {
            heading: &self.heading,
            base: &self.base,
            reference: &self.reference,
            guess: &self.guess,
            target: &self.target,
            gains: self.gains,
            torque_limit: self.torque_limit,
            coefficient: T::splat(self.stage.coefficient),
        };
        io.fill(&situation, &mut self.stage.joints);
    }

    /// The PD torque (T 3.51 != D3) at the end of the stage, where phi = phi_base + c omega_J, is linear in
    /// omega_J.
    #[inline(always)]
    fn fill_pd(&mut self) {
        let c = T::splat(self.stage.coefficient);
        let [kp, kd] = self.gains;
        self.stage.joints.clear();
        for (j, target) in self.target.iter().enumerate() {
            let error = target.value - (self.base[j + 1].z - self.base[j].z);
            self.stage.joints.push(StageJoint {
                drive: c * (kp * error + kd * target.rate),
                stiffness: c * (c * kp + kd),
                limit: c * self.torque_limit,
                slack: T::zero(),
            });
        }
        if self.free_play.is_any {
            self.free_play.loosen(c, kd, &mut self.stage.joints);
        }
    }

    #[inline(always)]
    pub fn load_forces(&mut self) {
        let c = T::splat(self.stage.coefficient);
        self.solution.twist.copy_from_slice(&self.guess);
        for (impulse, force) in self.solution.friction.iter_mut().zip(&self.friction_force) {
            *impulse = Vector2::new(force.x * c, force.y * c);
        }
        for (impulse, torque) in self.solution.drive.iter_mut().zip(&self.drive_torque) {
            *impulse = *torque * c;
        }
        self.solution.contact.clear();
        for force in &self.contact_force {
            self.solution.contact.push(*force * c);
        }
    }

    #[inline(always)]
    pub fn measure_deviation(&mut self) {
        let fastest = self.farthest::<true>(&self.solution.twist, &self.guess);
        self.deviation = fastest * T::splat(self.stage.coefficient);
    }

    /// Bound on how far a point of the robot moves between poses, or on how much faster it is at one of two twists.
    #[inline(always)]
    pub fn bound(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let (near, mut bound) = (self.among_pegs, T::zero());
        if near.any() {
            bound = self.farthest::<true>(to, from);
        }
        if (!near).any() {
            bound = T::select(near, bound, self.farthest::<false>(to, from));
        }
        bound
    }

    /// Bound on the speed of any point of the robot at a twist \[m/s\].
    #[inline(always)]
    pub fn fastest(&self, twist: &[Vector3<T>]) -> T {
        self.bound(twist, &self.at_rest)
    }

    /// The largest of a bound over the links, sharp or coarse.
    #[inline(always)]
    fn farthest<const SHARP: bool>(&self, to: &[Vector3<T>], from: &[Vector3<T>]) -> T {
        let mut farthest = T::zero();
        for (link, (to, from)) in self.constants.iter().zip(to.iter().zip(from)) {
            farthest = farthest.max(if SHARP { link.farthest(to, from) } else { link.farther(to, from) });
        }
        farthest
    }

    #[inline(always)]
    pub fn store_forces(&mut self) {
        let per_second = T::splat(1.0) / T::splat(self.stage.coefficient);
        for (force, impulse) in self.friction_force.iter_mut().zip(&self.solution.friction) {
            *force = Vector2::new(impulse.x * per_second, impulse.y * per_second);
        }
        for (force, impulse) in self.contact_force.iter_mut().zip(&self.solution.contact) {
            *force = *impulse * per_second;
        }
    }
}
