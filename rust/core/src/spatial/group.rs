//! Steps of as many robots at once as a register has lanes: Euler's, and the two stages of second order.

use nalgebra::Vector2;

use crate::gait::CardanTarget;
use crate::math::{MAX_LANES, Mask, Real};
use crate::solver::{RESIDUAL_LIMIT, SolveStatus, is_unconverged};
use crate::spatial::{read_lane, write_lane};
use crate::stepping::IntegratorConfig;
use crate::stepping::energy::Works;
use crate::stepping::lanes::{Lanes, NO_LANES, active, lanes_of, mask, member_of};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};

use super::contact_map::{Push, Slots};
use super::kernels::{Part, Solve, SpatialKernels};
use super::lane_fallback::Rescue;
use super::stage_work::StageWork;
use super::standing::is_at_rest;
use super::{SpatialBody, SpatialDriven, SpatialPlant};

/// Workspace for up to `T::LANES` robots of one plant.
#[derive(Debug, Clone)]
pub struct SpatialGroup<T: Real> {
    config: IntegratorConfig,
    work: StageWork<T>,
    slots: Slots,
    rescue: Rescue,
    /// Works, pushes of pegs and normal impulses of the ground in the first stage.
    first_works: Works<T>,
    first_pushes: Vec<Push>,
    first_ground: Vec<T>,
    /// Pushes of pegs in the last stage.
    pushes: Vec<Push>,
    /// How far the last stage ended from its first prediction \[m\], and beyond which deviation a step is not smooth.
    deviation: T,
    pub event_tolerance: f64,
    /// Linear solves of the step at hand.
    effort: [u32; MAX_LANES],
    targets: Vec<CardanTarget>,
}

impl<T: SpatialKernels> SpatialGroup<T> {
    pub fn new(config: IntegratorConfig, plant: &SpatialPlant) -> Self {
        let links = plant.robot.link_count();
        let pushes = || Vec::with_capacity(4 * links * T::LANES);
        Self {
            config,
            work: StageWork::new(plant),
            slots: Slots::new(links),
            rescue: Rescue::new(plant),
            first_works: Works::none(),
            first_pushes: pushes(),
            first_ground: vec![T::zero(); links],
            pushes: pushes(),
            deviation: T::zero(),
            event_tolerance: f64::INFINITY,
            effort: [0; MAX_LANES],
            targets: vec![CardanTarget::default(); links - 1],
        }
    }

    /// Euler steps of lengths `h` for the robots `members` of `fleet`. Those that `may_fail` and have links that sink
    /// are left as they were; the others' lanes are returned.
    pub fn euler_step<D: SpatialDriven>(
        &mut self,
        plant: &SpatialPlant,
        fleet: &mut [D],
        members: &[usize],
        h: T,
        may_fail: Lanes,
    ) -> Lanes {
        self.load(fleet, members);
        self.run_stage(plant, fleet, members, h, h);
        T::run_part(&mut self.work, Part::Arrive);
        let accepted = std::array::from_fn(|lane| lane < members.len() && !(may_fail[lane] && self.sinks(lane)));
        self.accept(fleet, members, accepted, h);
        accepted
    }

    /// Steps of second order of lengths `h`. Robots whose forces changed abruptly, or with links that sink, are left as
    /// they were; the others' lanes are returned.
    pub fn sdirk_step<D: SpatialDriven>(
        &mut self,
        plant: &SpatialPlant,
        fleet: &mut [D],
        members: &[usize],
        h: T,
    ) -> Lanes {
        let c = T::splat(GAMMA) * h;
        self.load(fleet, members);
        self.run_stage(plant, fleet, members, c, c);
        self.keep_first_stage();
        let second = Part::Extrapolate { elapsed: T::splat(1.0 - GAMMA) * h, share: EXTRAPOLATION, lead: 1.0 / GAMMA };
        T::run_part(&mut self.work, second);
        self.run_stage(plant, fleet, members, c, h);
        T::run_part(&mut self.work, Part::Arrive);
        let smooth = self.smooth(members);
        self.add_first_stage(fleet, members, smooth);
        self.accept(fleet, members, smooth, h);
        smooth
    }

    /// The lanes in which the forces of the first stage foretold the end of the second, and no link sinks.
    fn smooth(&self, members: &[usize]) -> Lanes {
        let abrupt = |lane: usize| self.deviation.lane(lane) > self.bound(lane);
        std::array::from_fn(|lane| lane < members.len() && !abrupt(lane) && !self.sinks(lane))
    }

    /// Deviation beyond which a lane's step is not smooth \[m\].
    fn bound(&self, lane: usize) -> f64 {
        let mut pushes = self.first_pushes.iter().chain(&self.pushes).filter(|push| push.lane == lane);
        let pushed = pushes.any(|push| push.impulse != Vector2::zeros());
        if pushed { PUSHED * self.event_tolerance } else { self.event_tolerance }
    }

    fn sinks(&self, lane: usize) -> bool {
        self.work.sinking.lane(lane) > SINKING
    }

    /// Gathers robots; lanes without one repeat the first.
    fn load<D: SpatialDriven>(&mut self, fleet: &[D], members: &[usize]) {
        for lane in 0..T::LANES {
            let motion = &fleet[member_of(members, lane)].body().motion;
            self.work.start.set_lane(lane, &motion.posture);
            self.work.start_speed.set_lane(lane, &motion.speed);
            write_lane::<T, _>(&mut self.work.start_momentum, lane, &motion.momentum);
            self.work.forces.set_lane(lane, &motion.forces);
            self.slots.recall(lane, &motion.pairs);
        }
        self.work.settled = T::Mask::of(|lane| fleet[member_of(members, lane)].body().motion.settled);
        self.effort.fill(0);
        T::run_part(&mut self.work, Part::Begin);
    }

    /// Solves one stage of coefficient `c` that ends `end` after the start of the step. Where it ends far from its
    /// prediction, it is predicted anew from its own end and solved again.
    fn run_stage<D: SpatialDriven>(&mut self, plant: &SpatialPlant, fleet: &mut [D], members: &[usize], c: T, end: T) {
        self.read_references(plant, fleet, members, end);
        self.pushes.clear();
        let mut pending = lanes_of(members);
        for repetition in 1..=MAX_PREDICTIONS {
            T::run_part(&mut self.work, Part::Predict { c, elapsed: end });
            self.find_pegs(plant, fleet, members, pending, end);
            self.solve(fleet, members, pending);
            if repetition == 1 {
                self.deviation = self.work.deviation;
            }
            let surprised = |lane: usize| !matches!(self.work.deviation.lane(lane), deviation if deviation < SURPRISE);
            let again: Lanes =
                std::array::from_fn(|lane| pending[lane] && repetition < MAX_PREDICTIONS && surprised(lane));
            let solved = std::array::from_fn(|lane| pending[lane] && !again[lane]);
            self.keep(solved, again);
            pending = again;
            if pending == NO_LANES {
                break;
            }
        }
    }

    fn keep(&mut self, solved: Lanes, again: Lanes) {
        T::run_part(&mut self.work, Part::Keep { solved: mask::<T>(solved), again: mask::<T>(again) });
        for lane in (0..T::LANES).filter(|&lane| solved[lane]) {
            self.pushes.extend(self.slots.pushes(&self.work, lane));
        }
    }

    fn read_references<D: SpatialDriven>(&mut self, plant: &SpatialPlant, fleet: &[D], members: &[usize], end: T) {
        for lane in 0..T::LANES {
            let driven = &fleet[member_of(members, lane)];
            let time = driven.body().state.time + end.lane(lane);
            driven.targets(time, &mut self.targets);
            for (lanes, CardanTarget { yaw, pitch }) in self.work.target.iter_mut().zip(&self.targets) {
                for (lanes, target) in lanes.iter_mut().zip([yaw, pitch]) {
                    lanes[0].set_lane(lane, target.angle);
                    lanes[1].set_lane(lane, target.rate);
                }
            }
            self.work.torque_limit.set_lane(lane, plant.controller.limit_until(time));
        }
    }

    fn find_pegs<D: SpatialDriven>(
        &mut self,
        plant: &SpatialPlant,
        fleet: &[D],
        members: &[usize],
        pending: Lanes,
        elapsed: T,
    ) {
        let Self { slots, work, .. } = self;
        slots.clear(work);
        for (i, link) in plant.robot.links.iter().enumerate() {
            let among_pegs = active(members, pending).map(|(lane, member)| (lane, fleet[member].body()));
            let among_pegs = among_pegs.filter(|(_, body)| !body.pegs.pegs().is_empty());
            slots.add(work, i, link, among_pegs, elapsed);
        }
    }

    fn solve<D: SpatialDriven>(&mut self, fleet: &mut [D], members: &[usize], lanes: Lanes) {
        let (tolerance, max_iterations) = (self.config.tolerance(), self.config.max_iterations());
        let solve = Solve { work: &mut self.work, tolerance, max_iterations, lanes: mask::<T>(lanes) };
        let (outcome, certificate) = T::solve(solve);
        let residual = certificate.residual();
        for (lane, member) in active(members, lanes) {
            let tally = &mut fleet[member].body_mut().tally;
            let (mut iterations, mut residual) = (outcome.iterations.lane(lane) as u32, residual.lane(lane));
            // The judge has the last word on what the solver takes for solved.
            let mut missed = is_unconverged(outcome.converged.lane(lane), residual, RESIDUAL_LIMIT * tolerance);
            if missed {
                let (solves, closing, certificate) =
                    self.rescue.solve_lane(&mut self.work, &self.slots, lane, tolerance);
                tally.fallbacks += 1;
                tally.eased += u32::from(closing == SolveStatus::Relaxed);
                iterations += solves;
                missed = closing == SolveStatus::Unsolved;
                residual = certificate.residual();
            }
            tally.add_solve(iterations, missed, residual, 0.0);
            self.effort[lane] += iterations;
            self.slots.remember(&self.work, lane);
        }
        T::run_part(&mut self.work, Part::Evaluate { lanes: mask::<T>(lanes) });
    }

    /// Remembers what the first stage adds to the tallies if the step is accepted.
    fn keep_first_stage(&mut self) {
        self.first_works = self.work.kept.works;
        std::mem::swap(&mut self.first_pushes, &mut self.pushes);
        let c = self.work.stage.coefficient;
        for (sum, ends) in self.first_ground.iter_mut().zip(&self.work.forces.normal) {
            *sum = ends[0] * c + ends[1] * c;
        }
    }

    /// Adds the first stage's share, `EXTRAPOLATION` times its impulses.
    fn add_first_stage<D: SpatialDriven>(&self, fleet: &mut [D], members: &[usize], lanes: Lanes) {
        for (lane, member) in active(members, lanes) {
            let SpatialBody { tally, ground_impulse, .. } = fleet[member].body_mut();
            tally.add_works(&self.first_works, lane, EXTRAPOLATION);
            for (sum, impulse) in ground_impulse.iter_mut().zip(&self.first_ground) {
                *sum += impulse.lane(lane) * EXTRAPOLATION;
            }
            for push in self.first_pushes.iter().filter(|push| push.lane == lane) {
                tally.contact_impulse[push.link] += push.impulse * EXTRAPOLATION;
            }
        }
    }

    /// The stage's end becomes the robots' state after a step of length `h`; its works and impulses count once.
    fn accept<D: SpatialDriven>(&mut self, fleet: &mut [D], members: &[usize], lanes: Lanes, h: T) {
        for (lane, member) in active(members, lanes) {
            let (c, h) = (self.work.stage.coefficient.lane(lane), h.lane(lane));
            let SpatialBody { state, motion, tally, ground_impulse, joint_torque, .. } = fleet[member].body_mut();
            let kept = &self.work.kept;
            motion.settled = is_at_rest(&motion.speed);
            self.work.arrival.read_lane(lane, &mut motion.posture);
            kept.end.read_lane(lane, &mut motion.speed);
            read_lane::<T, _>(&kept.momentum, lane, &mut motion.momentum);
            self.work.forces.read_lane(lane, &mut motion.forces);
            motion.pairs.clear();
            motion.pairs.extend_from_slice(self.slots.pairs(lane));
            motion.elapsed += h;
            motion.calm += h;
            motion.effort = self.effort[lane];
            state.time += h;
            tally.add_works(&kept.works, lane, 1.0);
            for push in self.pushes.iter().filter(|push| push.lane == lane) {
                tally.contact_impulse[push.link] += push.impulse;
            }
            for (sum, ends) in ground_impulse.iter_mut().zip(&motion.forces.normal) {
                *sum += ends[0] * c + ends[1] * c;
            }
            for (torque, drive) in joint_torque.iter_mut().zip(&kept.drive) {
                *torque = -Vector2::new(drive[0].lane(lane), drive[1].lane(lane)) / c;
            }
        }
    }
}

/// What remains of the tolerance for a deviation where a peg pushes: links that touch down or lift off gain little from
/// shorter steps, a robot that meets a peg much.
const PUSHED: f64 = 0.25;

/// A step that takes a sunk sphere deeper by more is divided \[m\].
const SINKING: f64 = 2e-5;

/// How often a stage may be predicted: the second prediction starts from a solution of the stage.
const MAX_PREDICTIONS: u32 = 4;

/// Distance between prediction and end of a stage from which on it is predicted anew \[m\].
const SURPRISE: f64 = 2e-3;
