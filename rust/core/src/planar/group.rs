//! The default scheme for as many robots at once as a register has lanes.
//!
//! A stage with base configuration q_B, reference velocity u_R and coefficient c solves
//! `M (u - u_R) = impulses over c`, `q = q_B + c u` (see [`crate::planar::Stage`]), (T 3.65 != D2).
//!
//! * Order 1, implicit Euler: one stage (q_A, u_A, h).
//! * Order 2 (T 3.66 != D12), the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself:
//!   stage (q_A, u_A, gamma h) gives u_1; stage (q_A + (1 - gamma) h u_1,
//!   u_A + (1 - gamma)/gamma (u_1 - u_A), gamma h) gives u_E.
//!   The second reference velocity extrapolates the impulses of the first stage, which is wrong where they
//!   change abruptly. The second stage then ends far from its prediction, which extrapolates too, and the step
//!   is left undone, to be retaken in parts and at last as Euler steps (T 3.58 != D6).

mod adaptive;
mod contact_detection;

use nalgebra::Vector3;

use crate::contact::PAIRS_PER_LINK;
use crate::gait::JointTarget;
use crate::math::{Mask, Real};
use crate::solver::is_unconverged;

use super::contacts::Contacts;
use super::hardest::Hardest;
use super::lane_fallback::Rescue;
use super::stage_kernels::{Extrapolate, Solve, StageKernels};
use super::stage_work::StageWork;
use super::{Body, Driven, Plant, Variation};
use crate::stepping::IntegratorConfig;
use crate::stepping::energy::Works;
use crate::stepping::lanes::{Lanes, NO_LANES, active, lanes_of, mask, member_of, read_lane, set_vector};
use crate::stepping::sdirk::{EXTRAPOLATION, GAMMA};

pub use adaptive::Adaptive;
use contact_detection::{Impulse, add_impulses, end_gap};

/// Workspace for up to `T::LANES` robots of one plant.
#[derive(Debug, Clone)]
pub struct Group<T: Real> {
    config: IntegratorConfig,
    work: StageWork<T>,
    contacts: Contacts,
    rescue: Rescue,
    /// Kept when asked for alone.
    pub hardest: Option<Box<Hardest>>,
    /// State at the start of the step.
    start_pose: Vec<Vector3<T>>,
    start_twist: Vec<Vector3<T>>,
    /// Works and contact impulses of the first stage, until the step is accepted.
    first_works: Works<T>,
    first_impulses: Vec<Impulse>,
    /// Contact impulses of the last stage.
    impulses: Vec<Impulse>,
    /// How far the last stage ended from its first prediction \[m\].
    deviation: T,
    /// Beyond which deviation a step is not smooth \[m\].
    pub event_tolerance: f64,
    /// Lanes in which a contact has closed during the step that was open after the last accepted one.
    closing: Lanes,
    /// Lanes whose robots have pegs around them.
    among_pegs: Lanes,
    /// Whether the lanes' robots differ from the plant.
    varied: bool,
    /// References of one robot.
    targets: Vec<JointTarget>,
}

impl<T: StageKernels> Group<T> {
    pub fn new(config: IntegratorConfig, plant: &Plant) -> Self {
        let links = plant.robot.link_count();
        let zero = T::zero();
        let rest = vec![Vector3::new(zero, zero, zero); links];
        Self {
            config,
            work: StageWork::new(plant),
            contacts: Contacts::with_capacity(links, T::LANES),
            rescue: Rescue::new(links),
            hardest: None,
            start_pose: rest.clone(),
            start_twist: rest,
            first_works: Works::none(),
            first_impulses: Vec::with_capacity(PAIRS_PER_LINK * links * T::LANES),
            impulses: Vec::with_capacity(PAIRS_PER_LINK * links * T::LANES),
            deviation: zero,
            event_tolerance: config.event_tolerance(config.step()),
            closing: NO_LANES,
            among_pegs: NO_LANES,
            varied: false,
            targets: vec![JointTarget::default(); links - 1],
        }
    }

    /// One Euler step of length `h` for the robots `members` of `fleet`.
    pub fn euler_step<D: Driven>(&mut self, plant: &Plant, fleet: &mut [D], members: &[usize], h: f64) {
        let lanes = lanes_of(members);
        self.load(plant, fleet, members);
        self.begin_first_stage();
        self.run_stage(plant, fleet, members, lanes, h, h);
        self.accept(plant, fleet, members, lanes, h);
    }

    /// One second-order step of length `h`; robots for which it does not do are left as they were and added to
    /// `rejected`.
    pub fn sdirk_step<D: Driven>(
        &mut self,
        plant: &Plant,
        fleet: &mut [D],
        members: &[usize],
        h: f64,
        rejected: &mut Vec<usize>,
    ) {
        let c = GAMMA * h;
        let lanes = lanes_of(members);
        self.load(plant, fleet, members);
        self.begin_first_stage();
        self.run_stage(plant, fleet, members, lanes, c, c);
        self.keep_first_stage();
        self.begin_second_stage(h);
        self.run_stage(plant, fleet, members, lanes, c, h);
        let smooth = self.smooth(lanes);
        self.add_first_stage(fleet, members, smooth);
        self.accept(plant, fleet, members, smooth, h);
        rejected.extend(members.iter().zip(smooth).filter(|(_, smooth)| !smooth).map(|(&member, _)| member));
    }

    /// The lanes in which the forces of the first stage foretold the end of the second. Away from pegs they all count:
    /// friction is bounded and the schemes keep their stability.
    fn smooth(&self, lanes: Lanes) -> Lanes {
        let bound =
            |lane: usize| if self.closing[lane] { CLOSING * self.event_tolerance } else { self.event_tolerance };
        let is_smooth = |lane| !(self.among_pegs[lane] && self.deviation.lane(lane) > bound(lane));
        std::array::from_fn(|lane| lanes[lane] && is_smooth(lane))
    }

    /// Gathers states; lanes without a robot repeat the first one.
    fn load<D: Driven>(&mut self, plant: &Plant, fleet: &[D], members: &[usize]) {
        self.load_variations(plant, fleet, members);
        self.work.free_play.load(plant, fleet, members);
        self.work.weakening.load(plant, fleet, members);
        self.work.has_pegs = members.iter().any(|&member| !fleet[member].body().pegs.pegs().is_empty());
        self.among_pegs = std::array::from_fn(|lane| {
            lane < T::LANES && !fleet[member_of(members, lane)].body().warm_start.near.pairs().is_empty()
        });
        self.work.among_pegs = mask::<T>(self.among_pegs);
        for lane in 0..T::LANES {
            let body = fleet[member_of(members, lane)].body();
            for (lanes, torque) in self.work.drive_torque.iter_mut().zip(&body.warm_start.joint_torque) {
                lanes.set_lane(lane, -torque);
            }
            for (i, (q, u)) in body.state.pose.iter().zip(&body.state.twist).enumerate() {
                set_vector(&mut self.start_pose[i], lane, q);
                set_vector(&mut self.start_twist[i], lane, u);
            }
        }
    }

    /// Constants of the lanes' own robots; nothing to do where all are as the plant.
    fn load_variations<D: Driven>(&mut self, plant: &Plant, fleet: &[D], members: &[usize]) {
        let was_varied = self.varied;
        self.varied = members.iter().any(|&member| fleet[member].body().variation != Variation::default());
        if !self.varied && !was_varied {
            return;
        }
        for lane in 0..T::LANES {
            let Variation { mass, friction, .. } = fleet[member_of(members, lane)].body().variation;
            for (constants, link) in self.work.constants.iter_mut().zip(&plant.robot.links) {
                let bound = plant.friction_force(link).component_mul(&friction) * mass;
                constants.mass.set_lane(lane, link.mass * mass);
                constants.inertia.set_lane(lane, link.inertia * mass);
                constants.friction.x.set_lane(lane, bound.x);
                constants.friction.y.set_lane(lane, bound.y);
            }
        }
    }

    fn load_friction<D: Driven>(&mut self, fleet: &[D], members: &[usize]) {
        for lane in 0..T::LANES {
            let warm_start = &fleet[member_of(members, lane)].body().warm_start;
            for (lanes, force) in self.work.friction_force.iter_mut().zip(&warm_start.friction) {
                lanes.x.set_lane(lane, force.x);
                lanes.y.set_lane(lane, force.y);
            }
        }
    }

    /// Base, reference velocity and guess of a stage that starts with the step.
    fn begin_first_stage(&mut self) {
        self.work.base.copy_from_slice(&self.start_pose);
        self.work.reference.copy_from_slice(&self.start_twist);
        self.work.guess.copy_from_slice(&self.start_twist);
        self.work.free_play.begin_step();
        self.work.weakening.begin_step(&self.start_twist);
        self.closing = NO_LANES;
    }

    /// Base, reference velocity and guess of the second stage of a step of length `h`.
    fn begin_second_stage(&mut self, h: f64) {
        T::extrapolate(Extrapolate {
            work: &mut self.work,
            start_pose: &self.start_pose,
            start_twist: &self.start_twist,
            elapsed: h - GAMMA * h,
            reference: EXTRAPOLATION,
            guess: 1.0 / GAMMA,
            slip: 0.5 / (GAMMA * GAMMA),
        });
    }

    /// Solves one stage that ends `end` after the start of the step.
    ///
    /// Where the stage ends farther from its prediction than the margin within which contacts are looked
    /// for, it is predicted anew from its own end and solved again.
    fn run_stage<D: Driven>(
        &mut self,
        plant: &Plant,
        fleet: &mut [D],
        members: &[usize],
        lanes: Lanes,
        c: f64,
        end: f64,
    ) {
        self.work.stage.coefficient = c;
        self.read_references(plant, fleet, members, end);
        self.load_friction(fleet, members);
        self.impulses.clear();
        let mut pending = lanes;
        for repetition in 1..=MAX_PREDICTIONS {
            self.find_contacts(plant, fleet, members, pending, end);
            self.solve(fleet, members, pending);
            if repetition == 1 {
                self.deviation = self.work.deviation;
            }
            let again = if repetition < MAX_PREDICTIONS { self.surprised(pending) } else { NO_LANES };
            let solved = std::array::from_fn(|lane| pending[lane] && !again[lane]);
            T::keep(&mut self.work, mask::<T>(solved), mask::<T>(again));
            self.save_forces(fleet, members, solved);
            pending = again;
            if pending == NO_LANES {
                break;
            }
        }
    }

    fn solve<D: Driven>(&mut self, fleet: &mut [D], members: &[usize], lanes: Lanes) {
        let (outcome, certificate) = T::solve(Solve {
            work: &mut self.work,
            tolerance: self.config.tolerance(),
            max_iterations: self.config.max_iterations(),
            lanes: mask::<T>(lanes),
        });
        let residual = certificate.residual();
        for (lane, member) in active(members, lanes) {
            let Body { tally, effort, .. } = fleet[member].body_mut();
            let iterations = outcome.iterations.lane(lane) as u32;
            *effort = iterations;
            if let Some(hardest) = &mut self.hardest {
                hardest.offer(&self.work.stage, lane, iterations);
            }
            let tolerance = self.config.tolerance();
            // The judge has the last word on what the solver takes for solved.
            let missed = is_unconverged(outcome.converged.lane(lane), residual.lane(lane), tolerance);
            match missed.then(|| self.rescue.solve_lane(&mut self.work, lane, tolerance)).flatten() {
                Some(rescued) => rescued.record(iterations, tally),
                None => tally.add_solve(iterations, missed, residual.lane(lane), certificate.gap.lane(lane)),
            }
        }
    }

    /// Joint references at `end` after the start of the step.
    fn read_references<D: Driven>(&mut self, plant: &Plant, fleet: &[D], members: &[usize], end: f64) {
        let mut waving = NO_LANES;
        for (lane, waving) in waving.iter_mut().enumerate().take(T::LANES) {
            let driven = &fleet[member_of(members, lane)];
            let time = driven.body().state.time + end;
            if let Some(wave) = driven.travelling_wave(time) {
                self.work.wave.set_lane(lane, &wave);
                *waving = true;
            }
            let share = driven.body().variation.torque_limit;
            self.work.torque_limit.set_lane(lane, share * plant.controller.limit_until(time));
        }
        if waving != NO_LANES {
            T::undulate(&mut self.work);
        }
        for lane in (0..T::LANES).filter(|&lane| !waving[lane]) {
            let driven = &fleet[member_of(members, lane)];
            driven.targets(driven.body().state.time + end, &mut self.targets);
            for (lanes, target) in self.work.target.iter_mut().zip(&self.targets) {
                lanes.value.set_lane(lane, target.angle);
                lanes.rate.set_lane(lane, target.rate);
                lanes.acceleration.set_lane(lane, target.acceleration);
            }
        }
    }

    /// Remembers works and contact impulses of the first stage until the step is accepted.
    fn keep_first_stage(&mut self) {
        self.first_works = self.work.kept_works;
        std::mem::swap(&mut self.first_impulses, &mut self.impulses);
    }

    /// Adds the first stage's share, `EXTRAPOLATION` times its impulses, to the robots' tallies.
    fn add_first_stage<D: Driven>(&self, fleet: &mut [D], members: &[usize], lanes: Lanes) {
        for (lane, member) in active(members, lanes) {
            fleet[member].body_mut().tally.add_works(&self.first_works, lane, EXTRAPOLATION);
        }
        add_impulses(&self.first_impulses, fleet, members, lanes, EXTRAPOLATION);
    }

    /// The stage's end becomes the robots' state after a step of length `h`; its works and impulses
    /// count once.
    fn accept<D: Driven>(&mut self, plant: &Plant, fleet: &mut [D], members: &[usize], lanes: Lanes, h: f64) {
        let arrival = T::finish(&mut self.work);
        for (lane, member) in active(members, lanes) {
            let body = fleet[member].body_mut();
            read_lane(&self.work.end, lane, &mut body.state.pose);
            read_lane(&self.work.kept_twist, lane, &mut body.state.twist);
            self.work.free_play.save(lane, &mut body.warm_start.play);
            body.state.time += h;
            body.sane = arrival.sane.lane(lane);
            body.warm_start.elapsed += h;
            body.warm_start.near.arrive(self.work.outlook.lead.lane(lane), arrival.astray.lane(lane));
            body.warm_start.near.end_step(|pair| end_gap(&self.work, lane, pair, plant, &body.pegs));
            body.tally.add_works(&self.work.kept_works, lane, 1.0);
            for (torque, drive) in body.warm_start.joint_torque.iter_mut().zip(&self.work.kept_drive) {
                *torque = -drive.lane(lane) / self.work.stage.coefficient;
            }
        }
        add_impulses(&self.impulses, fleet, members, lanes, 1.0);
    }
}

/// What remains of the tolerance for a deviation if a contact closes: an impact's impulse is extrapolated with the
/// forces'.
const CLOSING: f64 = 0.5;

/// How often a stage may be predicted: the second prediction starts from a solution of the stage.
const MAX_PREDICTIONS: u32 = 4;
