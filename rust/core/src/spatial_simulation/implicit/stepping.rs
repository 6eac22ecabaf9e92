//! Steps of one robot: Euler's, and the two stages of second order.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{UnitQuaternion, Vector3};

use crate::gait::{CardanReference, CardanTarget};
use crate::spatial::{Closing, Fallback, Frame, Pose, Posture, SLACK, Screw, Speed, certify};
use crate::stepper::{IntegratorConfig, Tally};

use super::super::{SpatialBody, SpatialPlant};
use super::pegs::{Pair, Situation};
use super::stage_work::StageWork;
use super::works::Works;

/// State of a robot in coordinates in which joints cannot open, and the workspace of its steps.
#[derive(Debug, Clone)]
pub struct Stepping {
    config: IntegratorConfig,
    pub posture: Posture,
    pub speed: Speed,
    /// Momentum of each link, and angular momentum about its CG, frame I: what joints exchange and nothing loses.
    pub momentum: Vec<Screw>,
    work: StageWork,
    fallback: Fallback,
    /// Links at the start of the step, and at the base of the stage.
    start_frames: Vec<Frame>,
    base_frames: Vec<Frame>,
    /// Pairs of the last stage.
    pairs: Vec<Pair>,
    last_pairs: Vec<Pair>,
    /// End velocity of the first stage; normal forces before the step.
    first: Speed,
    force_before: Vec<[f64; 2]>,
    first_impulse: Vec<Vector3<f64>>,
    /// Normal impulses of the ground in the first stage, both ends of a link together.
    first_ground: Vec<f64>,
    first_works: Works,
    trial: Posture,
    trial_frames: Vec<Frame>,
    targets: Vec<CardanTarget>,
    /// How far the last stage ended from its first prediction \[m\], and beyond which deviation a step is not smooth.
    deviation: f64,
    pub event_tolerance: f64,
}

impl Stepping {
    pub fn new(config: IntegratorConfig, plant: &SpatialPlant) -> Self {
        let links = plant.robot.link_count();
        Self {
            config,
            posture: Posture::straight(links),
            speed: Speed::rest(links),
            momentum: vec![Screw::zero(); links],
            work: StageWork::new(plant),
            fallback: Fallback::new(links),
            start_frames: vec![Frame::origin(); links],
            base_frames: vec![Frame::origin(); links],
            pairs: Vec::with_capacity(4 * links),
            last_pairs: Vec::with_capacity(4 * links),
            first: Speed::rest(links),
            force_before: vec![[0.0; 2]; links],
            first_impulse: vec![Vector3::zeros(); links],
            first_ground: vec![0.0; links],
            first_works: Works::default(),
            trial: Posture::straight(links),
            trial_frames: vec![Frame::origin(); links],
            targets: vec![CardanTarget::default(); links - 1],
            deviation: 0.0,
            event_tolerance: f64::INFINITY,
        }
    }

    /// Forgets the forces of the last stage.
    pub fn forget(&mut self) {
        self.work.normal_force.fill([0.0; 2]);
        self.pairs.clear();
    }

    /// Forces of the last stage, from which the next one starts.
    pub fn forces(&self) -> (&[[f64; 2]], &[Pair]) {
        (&self.work.normal_force, &self.pairs)
    }

    /// Takes saved forces over.
    pub fn recall(&mut self, normal: &[[f64; 2]], pairs: &[Pair]) {
        self.work.normal_force.copy_from_slice(normal);
        self.pairs.clear();
        self.pairs.extend_from_slice(pairs);
    }

    /// One Euler step of length `h`. If a link sank and `may_fail`, it is left undone: false.
    pub fn euler_step(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        h: f64,
        may_fail: bool,
    ) -> bool {
        self.begin();
        self.force_before.copy_from_slice(&self.work.normal_force);
        self.run_stage(plant, body, reference, h, h);
        if may_fail && self.sinks() {
            self.work.normal_force.copy_from_slice(&self.force_before);
            return false;
        }
        self.accept(body, h);
        true
    }

    /// One step of second order of length `h`. If forces changed abruptly or a link sank it is left undone: false.
    pub fn sdirk_step(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        h: f64,
    ) -> bool {
        let c = GAMMA * h;
        self.begin();
        self.force_before.copy_from_slice(&self.work.normal_force);
        self.run_stage(plant, body, reference, c, c);
        self.keep_first_stage();
        self.begin_second_stage(h);
        self.run_stage(plant, body, reference, c, h);
        if self.deviation > self.event_tolerance || self.sinks() {
            self.work.normal_force.copy_from_slice(&self.force_before);
            return false;
        }
        self.add_first_stage(body);
        self.accept(body, h);
        true
    }

    /// Poses of all links.
    pub fn place_links(&mut self, pose: &mut [Pose]) {
        self.posture.place_links(&self.work.half_length, &mut self.start_frames);
        let about = UnitQuaternion::from_axis_angle;
        let [w, x, y, z] = self.posture.orientation;
        let mut orientation = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        for (i, (pose, frame)) in pose.iter_mut().zip(&self.start_frames).enumerate() {
            if i > 0 {
                let [yaw, pitch] = self.posture.angle[i - 1];
                orientation = orientation * about(&Vector3::y_axis(), yaw) * about(&Vector3::x_axis(), pitch);
            }
            *pose = Pose { position: frame.position, orientation };
        }
    }

    /// Base, reference momenta and guess of a stage that starts with the step.
    fn begin(&mut self) {
        self.work.begin_step(&self.posture, &self.speed, &self.momentum);
        self.start_frames.copy_from_slice(&self.work.frames);
        self.base_frames.copy_from_slice(&self.work.frames);
    }

    fn keep_first_stage(&mut self) {
        self.first.copy_from(&self.work.end);
        self.first_works = Works::of(&self.work.stage, &self.work.solution);
        self.first_impulse.fill(Vector3::zeros());
        for (peg, impulse) in self.work.stage.pegs.iter().zip(&self.work.solution.peg) {
            self.first_impulse[peg.link] += peg.direction.linear * *impulse;
        }
        for (sum, ends) in self.first_ground.iter_mut().zip(&self.work.solution.normal) {
            *sum = ends[0] + ends[1];
        }
    }

    /// Base, reference momenta and guess of the second stage of a step of length `h`.
    fn begin_second_stage(&mut self, h: f64) {
        self.work.extrapolate_momenta(EXTRAPOLATION);
        self.work.base.travel(&self.posture, &self.first, (1.0 - GAMMA) * h);
        self.work.base.place_links(&self.work.half_length, &mut self.base_frames);
        self.work.guess.blend(&self.speed, &self.first, 1.0 / GAMMA);
    }

    /// Adds the first stage's share, `EXTRAPOLATION` times its impulses.
    fn add_first_stage(&self, body: &mut SpatialBody) {
        let SpatialBody { tally, ground_impulse, .. } = body;
        self.first_works.add_to(tally, EXTRAPOLATION);
        for (sum, impulse) in tally.contact_impulse.iter_mut().zip(&self.first_impulse) {
            *sum += impulse.xy() * EXTRAPOLATION;
        }
        for (sum, impulse) in ground_impulse.iter_mut().zip(&self.first_ground) {
            *sum += impulse * EXTRAPOLATION;
        }
    }

    /// Solves one stage that ends `end` after the start of the step. Where it ends far from its prediction, it is
    /// predicted anew from its own end and solved again.
    fn run_stage(
        &mut self,
        plant: &SpatialPlant,
        body: &mut SpatialBody,
        reference: &impl CardanReference,
        c: f64,
        end: f64,
    ) {
        let time = body.state.time + end;
        reference.targets(time, &mut self.targets);
        self.work.take_references(&self.targets, plant.controller.limit_until(time));
        for repetition in 1..=MAX_PREDICTIONS {
            self.work.predict(c);
            self.work.fill(end);
            self.find_pegs(plant, body, end);
            self.solve(&mut body.tally);
            let deviation = self.work.deviation();
            if repetition == 1 {
                self.deviation = deviation;
            }
            if deviation < SURPRISE {
                break;
            }
            self.work.guess.copy_from(&self.work.end);
        }
    }

    fn find_pegs(&mut self, plant: &SpatialPlant, body: &SpatialBody, elapsed: f64) {
        std::mem::swap(&mut self.pairs, &mut self.last_pairs);
        self.pairs.clear();
        self.work.stage.pegs.clear();
        self.work.solution.peg.clear();
        if body.pegs.pegs().is_empty() {
            return;
        }
        let c = self.work.stage.coefficient;
        for (i, link) in plant.robot.links.iter().enumerate() {
            let situation = Situation {
                link,
                start: &self.start_frames[i],
                base: &self.base_frames[i],
                end: &self.work.frames[i],
                expected: &self.work.expected[i],
                coefficient: c,
                elapsed,
            };
            situation.visit(i, &body.pegs, |peg, contact| {
                let same = |pair: &&Pair| pair.link == i && pair.peg == peg;
                let force = self.last_pairs.iter().find(same).map_or(0.0, |pair| pair.force);
                self.pairs.push(Pair { link: i, peg, force });
                self.work.stage.pegs.push(contact);
                self.work.solution.peg.push(c * force);
            });
        }
    }

    fn solve(&mut self, tally: &mut Tally) {
        let (tolerance, cap) = (self.config.tolerance(), self.config.max_iterations());
        let (outcome, mut certificate) = self.work.solve(tolerance, cap, true);
        let mut iterations = outcome.iterations as u32;
        // The judge has the last word on what the solver takes for solved.
        let mut missed =
            !outcome.converged || certificate.residual().is_nan() || certificate.residual() > SLACK * tolerance;
        if missed {
            let StageWork { stage, solution, .. } = &mut self.work;
            let (solves, closing) = self.fallback.solve_hard(stage, solution, tolerance);
            self.work.take_solution();
            tally.fallbacks += 1;
            iterations += solves;
            missed = closing == Closing::Open;
            certificate = certify(&self.work.stage, &self.work.solution);
        }
        tally.add_solve(iterations, missed, certificate.residual(), 0.0);
        let c = self.work.stage.coefficient;
        for (pair, impulse) in self.pairs.iter_mut().zip(&self.work.solution.peg) {
            pair.force = impulse / c;
        }
    }

    /// Whether the solved stage takes a sphere deeper into the ground than it was at the start of the step: a link that
    /// turns fast leaves the linearised gap.
    fn sinks(&mut self) -> bool {
        let work = &mut self.work;
        self.trial.travel(&work.base, &work.end, work.stage.coefficient);
        self.trial.place_links(&work.half_length, &mut self.trial_frames);
        self.trial_frames.iter().enumerate().any(|(i, frame)| {
            let link = &work.stage.links[i];
            (0..2).any(|end| {
                let gap = frame.ground_gap(link, end);
                gap < -SUNK && gap < work.start_gap[i][end] - SINKING
            })
        })
    }

    /// The stage's end becomes the robot's state after a step of length `h`; its works and impulses count once.
    fn accept(&mut self, body: &mut SpatialBody, h: f64) {
        let work = &self.work;
        self.posture.travel(&work.base, &work.end, work.stage.coefficient);
        self.speed.copy_from(&work.end);
        work.end_momenta(&mut self.momentum);
        body.state.time += h;
        Works::of(&work.stage, &work.solution).add_to(&mut body.tally, 1.0);
        for (peg, impulse) in work.stage.pegs.iter().zip(&work.solution.peg) {
            body.tally.contact_impulse[peg.link] += peg.direction.linear.xy() * *impulse;
        }
        for (sum, ends) in body.ground_impulse.iter_mut().zip(&work.solution.normal) {
            *sum += ends[0] + ends[1];
        }
        for (torque, [yaw, pitch]) in body.joint_torque.iter_mut().zip(&work.solution.drive) {
            *torque = -nalgebra::Vector2::new(*yaw, *pitch) / work.stage.coefficient;
        }
    }
}

/// gamma = 1 - 1/sqrt 2, for which the two-stage SDIRK is of order 2 and L-stable.
const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// (1 - gamma) / gamma: weight of the first stage's impulses in the whole step.
const EXTRAPOLATION: f64 = (1.0 - GAMMA) / GAMMA;

/// A step that takes a sphere deeper than `SUNK`, by more than `SINKING`, is divided \[m\].
const SUNK: f64 = 2e-4;
const SINKING: f64 = 2e-5;

/// How often a stage may be predicted: the second prediction starts from a solution of the stage.
const MAX_PREDICTIONS: u32 = 4;

/// Distance between prediction and end of a stage from which on it is predicted anew \[m\].
const SURPRISE: f64 = 2e-3;
