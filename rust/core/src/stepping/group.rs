//! Steps of as many robots at once as a register has lanes.
//!
//! A stage with base configuration q_B, reference velocity u_R and coefficient c solves
//! `M (u - u_R) = impulses over c`, `q = q_B + c u`, (T 3.65 != D2).
//!
//! * Order 1, implicit Euler: one stage (q_A, u_A, h).
//! * Order 2 (T 3.66 != D12), the L-stable SDIRK with gamma = 1 - 1/sqrt 2 applied to the inclusion itself:
//!   stage (q_A, u_A, gamma h) gives u_1; stage (q_A + (1 - gamma) h u_1,
//!   u_A + (1 - gamma)/gamma (u_1 - u_A), gamma h) gives u_E.
//!   The second reference velocity extrapolates the impulses of the first stage, which is wrong where they
//!   change abruptly. The second stage then ends far from its prediction, which extrapolates too, and the step
//!   is rejected, to be retaken in parts and at last as Euler steps (T 3.58 != D6).

use crate::contact::Source;
use crate::math::{MAX_LANES, Real};

use super::body::Trial;
use super::energy::EnergyLedger;
use super::kernels::{Operation, Request, run, solve};
use super::lanes::{Lanes, Members, NO_LANES, active, mask};
use super::model::Model;
use super::sdirk::{EXTRAPOLATION, GAMMA};
use super::stage::{ContactImpulse, StageInput, StageOutput};
use super::statistics::StepStatistics;
use super::verdict::{Effort, solves_left};
use super::{Accuracy, ImplicitConfig};

/// Workspace for up to `T::LANES` robots of one system.
pub struct Group<M: Model, T: Real> {
    accuracy: Accuracy,
    max_iterations: u32,
    workspace: M::Workspace<T>,
    /// Work and contact impulses of the first stage, until the step is accepted.
    first_energy: EnergyLedger<T>,
    first_contact_impulses: Vec<ContactImpulse>,
    /// Contact impulses of the last stage.
    contact_impulses: Vec<ContactImpulse>,
    /// How far the last stage ended from its first prediction \[m\].
    deviation: T,
    /// How well its stages were solved, which counts once the step is accepted.
    quality: [StepStatistics; MAX_LANES],
}

impl<T: Real, M: Model> Group<M, T> {
    pub fn new(config: &ImplicitConfig, system: &M::System) -> Self {
        let links = M::robot(system).link_count();
        let contact_impulses = || Vec::with_capacity(PEG_IMPULSES_PER_LINK * links * T::LANES);
        Self {
            accuracy: config.accuracy(&M::ACCURACY),
            max_iterations: config.max_iterations,
            workspace: M::Workspace::new(system),
            first_energy: EnergyLedger::zero(),
            first_contact_impulses: contact_impulses(),
            contact_impulses: contact_impulses(),
            deviation: T::zero(),
            quality: [StepStatistics::default(); MAX_LANES],
        }
    }

    /// Euler steps of lengths `h`. Those that `may_fail` and take a penetration too deep are rejected; those whose stage
    /// ended far from its prediction may be postponed.
    fn euler_step(&mut self, members: &mut Members<M>, h: T, may_fail: Lanes) -> Verdicts {
        self.load(members);
        let lanes = members.lanes();
        let postponed = self.run_stage(members, lanes, h, h, AfterMisprediction::Later);
        let ended = std::array::from_fn(|lane| lanes[lane] && !postponed[lane]);
        run(&mut self.workspace, Operation::Arrive);
        self.workspace.end_step(members, ended);
        // The first prediction tells how abruptly forces change, also of a stage that has been postponed since.
        let predicted =
            std::array::from_fn(|lane| lanes[lane] && members.body(lane).postponements == u32::from(postponed[lane]));
        self.keep_trial(members, predicted);
        let accepted = std::array::from_fn(|lane| ended[lane] && !(may_fail[lane] && self.workspace.sinks(lane)));
        self.accept(members, accepted, h);
        for lane in active(accepted) {
            members.body_mut(lane).statistics.penetrated |= self.workspace.sinks_beyond_recovery(lane);
        }
        Verdicts { accepted, postponed }
    }

    /// Steps of second order of lengths `h`. Those in which forces change abruptly or that take a penetration too deep
    /// are rejected; those whose first stage ended far from its prediction may be postponed.
    fn sdirk_step(&mut self, members: &mut Members<M>, h: T) -> Verdicts {
        let c = T::splat(GAMMA) * h;
        self.load(members);
        let lanes = members.lanes();
        let postponed = self.run_stage(members, lanes, c, c, AfterMisprediction::Later);
        let lanes: Lanes = std::array::from_fn(|lane| lanes[lane] && !postponed[lane]);
        self.keep_first_stage(members, lanes);
        run(&mut self.workspace, Operation::Extrapolate { h });
        self.run_stage(members, lanes, c, h, AfterMisprediction::UnlessRejected);
        run(&mut self.workspace, Operation::Arrive);
        self.workspace.end_step(members, lanes);
        self.keep_trial(members, lanes);
        let accepted = std::array::from_fn(|lane| lanes[lane] && self.is_smooth(lane) && !self.workspace.sinks(lane));
        self.add_first_stage(members, accepted);
        self.accept(members, accepted, h);
        Verdicts { accepted, postponed }
    }

    /// Whether the forces of the first stage predict the end of the second, on the same patches of the ground.
    fn is_smooth(&self, lane: usize) -> bool {
        let is_abrupt = self.relative_deviation(lane) > 1.0 || self.workspace.closing(lane).crossing < f64::INFINITY;
        !is_abrupt
    }

    /// How far the last stage of a part ended from its prediction, over how far that of an accepted part of second order
    /// may.
    fn relative_deviation(&self, lane: usize) -> f64 {
        let share = if self.workspace.closing(lane).is_fresh() { CLOSING } else { 1.0 };
        self.deviation.lane(lane) / (share * self.accuracy.step_tolerance)
    }

    /// Records what the parts of the given lanes say of the next ones.
    fn keep_trial(&self, members: &mut Members<M>, lanes: Lanes) {
        for lane in active(lanes) {
            let (deviation, closing) = (self.relative_deviation(lane), self.workspace.closing(lane));
            members.body_mut(lane).trial = Trial { deviation, closing };
        }
    }

    fn load(&mut self, members: &mut Members<M>) {
        self.workspace.load(members);
        self.first_contact_impulses.clear();
        self.quality.fill(StepStatistics::default());
        run(&mut self.workspace, Operation::Begin);
        self.workspace.take_guesses(members);
    }

    /// Solves one stage of coefficient `c`, which ends `end` after the start of the step, in the given lanes. Where it
    /// ends far from its prediction, it is predicted again from its own end and solved again, at once or later; returns
    /// the lanes in which that is done later.
    fn run_stage(
        &mut self,
        members: &mut Members<M>,
        lanes: Lanes,
        c: T,
        end: T,
        after_misprediction: AfterMisprediction,
    ) -> Lanes {
        self.read_references(members, end);
        self.contact_impulses.clear();
        let mut pending = lanes;
        for repetition in 1..=MAX_PREDICTIONS {
            run(&mut self.workspace, Operation::Predict { c, elapsed: end, pending: mask::<T>(pending) });
            self.workspace.find_contacts(members, pending);
            self.solve(members, pending);
            if repetition == 1 {
                self.deviation = self.workspace.deviation();
            }
            let may_repeat = |lane: usize| {
                let is_rejected = after_misprediction == AfterMisprediction::UnlessRejected && !self.is_smooth(lane);
                !is_rejected && repetition + members.body(lane).postponements < MAX_PREDICTIONS
            };
            let again: Lanes =
                std::array::from_fn(|lane| pending[lane] && self.workspace.is_mispredicted(lane) && may_repeat(lane));
            let solved = std::array::from_fn(|lane| pending[lane] && !again[lane]);
            run(&mut self.workspace, Operation::Keep { solved: mask::<T>(solved), again: mask::<T>(again) });
            self.workspace.collect_contact_impulses(members, solved, &mut self.contact_impulses);
            for lane in active(solved) {
                if let Some(record) = &mut members.body_mut(lane).record {
                    self.workspace.record(lane, &mut record.stage);
                }
            }
            if after_misprediction == AfterMisprediction::Later {
                for lane in active(again) {
                    let body = members.body_mut(lane);
                    self.workspace.postpone(lane, body);
                    body.postponements += 1;
                }
                return again;
            }
            pending = again;
            if pending == NO_LANES {
                break;
            }
        }
        NO_LANES
    }

    fn read_references(&mut self, members: &Members<M>, end: T) {
        let waving = self.workspace.read_waves(members, end);
        if waving != NO_LANES {
            run(&mut self.workspace, Operation::FollowWaves);
        }
        self.workspace.read_references(members, end, waving);
    }

    /// Solves the stage in all lanes, and by the fallback where that fails; see [`super::verdict`].
    fn solve(&mut self, members: &mut Members<M>, lanes: Lanes) {
        let (tolerance, max_iterations) = (self.accuracy.tolerance, self.max_iterations);
        let solved = solve(&mut self.workspace, Request { tolerance, max_iterations, lanes: mask::<T>(lanes) });
        for lane in active(lanes) {
            let iterations = solved.outcome.iterations.lane(lane) as u32;
            let body = members.body_mut(lane);
            let is_solved = solved.is_solved(lane, tolerance);
            let solves_left = solves_left(body.step_solves, max_iterations);
            let effort = Effort { solves_left, is_brief: body.has_relaxed };
            let quality = &mut self.quality[lane];
            let mut cost = iterations;
            match (!is_solved).then(|| self.workspace.fall_back(lane, tolerance, effort)).flatten() {
                Some(result) => {
                    quality.add_fallback(iterations, &result);
                    body.has_relaxed |= quality.relaxed > 0;
                    cost = cost.saturating_add(result.cost());
                }
                None => quality.add_solve(iterations, !is_solved, solved.residual.lane(lane), solved.gap.lane(lane)),
            }
            let solves = std::mem::take(&mut quality.iterations);
            body.statistics.iterations += solves;
            body.statistics.fallbacks += std::mem::take(&mut quality.fallbacks);
            body.step_solves = body.step_solves.saturating_add(cost);
            body.solves = solves;
        }
        run(&mut self.workspace, Operation::Evaluate { lanes: mask::<T>(lanes) });
    }

    /// Keeps work and impulses of pegs of the first stage until the step is accepted.
    fn keep_first_stage(&mut self, members: &mut Members<M>, lanes: Lanes) {
        self.first_energy = *self.workspace.kept_energy();
        std::mem::swap(&mut self.first_contact_impulses, &mut self.contact_impulses);
        self.workspace.keep_first_stage();
        for lane in active(lanes) {
            if let Some(record) = &mut members.body_mut(lane).record {
                record.keep_first_stage();
            }
        }
    }

    /// Adds the first stage's share, `EXTRAPOLATION` times its impulses.
    fn add_first_stage(&self, members: &mut Members<M>, lanes: Lanes) {
        for lane in active(lanes) {
            let body = members.body_mut(lane);
            body.statistics.add_work(&self.first_energy, lane, EXTRAPOLATION);
            self.workspace.add_first_stage(lane, EXTRAPOLATION, body);
            if let Some(record) = &mut body.record {
                record.add_first_stage(EXTRAPOLATION);
            }
        }
        add_contact_impulses(&self.first_contact_impulses, members, lanes, EXTRAPOLATION);
    }

    /// The stage's end becomes the robots' state after steps of lengths `h`; its work and impulses count once.
    fn accept(&mut self, members: &mut Members<M>, lanes: Lanes, h: T) {
        let system = members.system;
        for lane in active(lanes) {
            let (body, h) = (members.body_mut(lane), h.lane(lane));
            self.workspace.accept(system, lane, body);
            body.state.time += h;
            body.statistics.add_work(self.workspace.kept_energy(), lane, 1.0);
            body.statistics.add_quality(&self.quality[lane]);
            if let Some(record) = &mut body.record {
                record.add_stage();
            }
            if body.path.is_some() {
                M::from_reduced(system, body);
                body.path.iter_mut().for_each(|path| path.push(body.state.clone()));
            }
        }
        add_contact_impulses(&self.contact_impulses, members, lanes, 1.0);
    }
}

/// A [`Group`] of any width.
pub trait AnyGroup<M: Model>: Send + Sync {
    /// Takes the next parts of the robots of one register.
    fn step(&mut self, members: &mut Members<M>, parts: &Parts) -> Verdicts;
}

impl<M: Model, T: Real> AnyGroup<M> for Group<M, T> {
    fn step(&mut self, members: &mut Members<M>, parts: &Parts) -> Verdicts {
        let mut h = T::zero();
        for lane in 0..T::LANES {
            h.set_lane(lane, parts.lengths[lane]);
        }
        if parts.are_euler { self.euler_step(members, h, parts.may_fail) } else { self.sdirk_step(members, h) }
    }
}

/// The next parts of the robots of a register, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Parts {
    /// Whether they are Euler steps instead of steps of second order.
    pub are_euler: bool,
    /// \[s\]
    pub lengths: [f64; MAX_LANES],
    /// Of Euler steps, see [`Part::may_fail`](super::plan::Part::may_fail).
    pub may_fail: Lanes,
}

/// What became of the steps of a register, lane by lane; those of other lanes are rejected.
#[derive(Debug, Clone, Copy)]
pub struct Verdicts {
    pub accepted: Lanes,
    /// The step is taken again as it is, from another guess.
    pub postponed: Lanes,
}

/// When a stage that ended far from its prediction is solved again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AfterMisprediction {
    /// At once, but not where the step will be rejected for its end.
    UnlessRejected,
    /// With other robots.
    Later,
}

/// Adds contact impulses, times `weight`, to the robots' sums.
fn add_contact_impulses<M: Model>(
    contact_impulses: &[ContactImpulse],
    members: &mut Members<M>,
    lanes: Lanes,
    weight: f64,
) {
    for each in contact_impulses.iter().filter(|each| lanes[each.lane]) {
        let body = members.body_mut(each.lane);
        let links = body.impulses.contact.len();
        if each.link >= links {
            // On an obstacle that can be pushed.
            continue;
        }
        match each.source {
            Source::Link(other) if other >= links => {
                body.impulses.contact[each.link] += each.impulse * weight;
                body.obstacle_impulse.add(body.obstacles.len() + other - links, each.impulse * weight);
            }
            Source::Fixture(_) => body.impulses.contact[each.link] += each.impulse * weight,
            Source::Link(_) => body.impulses.self_contact[each.link] += each.impulse * weight,
            Source::Obstacle(obstacle) | Source::Top(obstacle) => {
                if let Source::Top(_) = each.source {
                    body.impulses.top[each.link] += each.impulse.z * weight;
                }
                body.impulses.contact[each.link] += each.impulse * weight;
                body.obstacle_impulse.add(obstacle, each.impulse * weight);
            }
        }
        if let Some(record) = &mut body.record {
            record.add_contact(each, weight);
        }
    }
}

/// What remains of the tolerance for a deviation if a contact closes: the second stage extrapolates the impulse of the
/// impact with the forces'.
const CLOSING: f64 = 0.25;

/// Most predictions of a stage, the first included; the later ones start from a solution of it.
const MAX_PREDICTIONS: u32 = 4;

/// Peg impulses reserved for each link of a lane; a denser field grows the list once.
const PEG_IMPULSES_PER_LINK: usize = 8;
