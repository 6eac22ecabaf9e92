//! Many robots of one system advanced together by the default scheme.

use crate::math::Real;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::math::Wide4;
#[cfg(target_arch = "x86_64")]
use crate::math::Wide8;

use super::group::{Group, Verdicts};
use super::kernels::{Compiled, CompiledModel};
use super::lane_count::lanes_for;
use super::lanes::Members;
use super::model::{Driven, Model};
use super::plan::{Interval, StepPlan};
use super::queues::Queues;
use super::start::first_part;
use super::verdict::solves_left;
use super::{Accuracy, ImplicitConfig};

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on that width, on
/// its neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct Fleet<M: Model> {
    config: ImplicitConfig,
    accuracy: Accuracy,
    width: Width<M>,
    members: Vec<usize>,
    plans: Vec<StepPlan>,
    queues: Queues,
    targets: Vec<M::Target>,
}

/// A group of the width chosen at construction.
#[derive(Debug, Clone)]
enum Width<M: Model> {
    One(Box<Group<M, f64>>),
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    Four(Box<Group<M, Wide4>>),
    #[cfg(target_arch = "x86_64")]
    Eight(Box<Group<M, Wide8>>),
}

impl<M: CompiledModel> Fleet<M> {
    /// A fleet of about `robots` robots; few of them are faster one by one than in a wide group.
    pub fn new(config: ImplicitConfig, system: &M::System, robots: usize) -> Self {
        Self {
            config,
            accuracy: config.accuracy(&M::ACCURACY),
            width: Width::choose(&config, system, robots),
            members: Vec::with_capacity(robots),
            plans: Vec::with_capacity(robots),
            queues: Queues::with_capacity(robots),
            targets: vec![M::Target::default(); M::robot(system).joint_count()],
        }
    }

    /// The configured accuracy, with the model's defaults.
    pub fn accuracy(&self) -> &Accuracy {
        &self.accuracy
    }

    /// Integrates the robots chosen by `takes_part` over `duration` in equal steps no longer than the configured one. A
    /// robot whose state becomes implausible keeps its last plausible one and is flagged.
    pub fn advance<D: Driven<Model = M>>(
        &mut self,
        system: &M::System,
        robots: &mut [D],
        duration: f64,
        takes_part: impl Fn(usize) -> bool,
    ) {
        let Self { config, accuracy, width, members, plans, queues, targets } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        let interval = Interval::new(config, accuracy, duration);
        members.iter().for_each(|&member| prepare(system, &mut robots[member], accuracy.step, targets));
        plans.clear();
        plans.resize(robots.len(), StepPlan::at_start(&interval));
        let mut run = Run { config, system, robots, members, plans, queues, interval };
        match width {
            Width::One(group) => run.advance(group),
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            Width::Four(group) => run.advance(group),
            #[cfg(target_arch = "x86_64")]
            Width::Eight(group) => run.advance(group),
        }
        for &member in members.iter() {
            let body = robots[member].body_mut();
            if !body.statistics.diverged {
                M::from_reduced(system, body);
            }
        }
    }
}

impl<M: CompiledModel> Width<M> {
    fn choose(config: &ImplicitConfig, system: &M::System, robots: usize) -> Self {
        match lanes_for(robots) {
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            Wide4::LANES => Width::Four(Box::new(Group::new(config, system))),
            #[cfg(target_arch = "x86_64")]
            Wide8::LANES => Width::Eight(Box::new(Group::new(config, system))),
            _ => Width::One(Box::new(Group::new(config, system))),
        }
    }
}

/// Prepares a robot for an interval: its reduced coordinates, and how long the first part of a robot that was just placed
/// is: short unless it was placed in motion with its reference. `step` is the configured one \[s\].
fn prepare<D: Driven>(
    system: &<D::Model as Model>::System,
    robot: &mut D,
    step: f64,
    targets: &mut [<D::Model as Model>::Target],
) {
    D::Model::to_reduced(system, robot.body_mut());
    if robot.body().clock.next > 0.0 {
        return;
    }
    robot.targets(robot.body().state.time, targets);
    let is_following = D::Model::follows(system, robot.body(), targets);
    robot.body_mut().clock.next = if is_following { step } else { first_part(step) };
}

/// One call of [`Fleet::advance`].
struct Run<'a, D: Driven> {
    config: &'a ImplicitConfig,
    system: &'a <D::Model as Model>::System,
    robots: &'a mut [D],
    members: &'a [usize],
    plans: &'a mut [StepPlan],
    queues: &'a mut Queues,
    interval: Interval,
}

impl<D: Driven> Run<'_, D> {
    /// Each robot follows its own plan to the end of the interval; robots are regrouped for every part.
    fn advance<T: Real>(&mut self, group: &mut Group<D::Model, T>)
    where
        D::Model: Compiled<T>,
    {
        self.queues.clear();
        for &member in self.members {
            self.enqueue(member);
        }
        while !self.queues.is_empty() {
            self.robots[self.members[0]].body().interrupt.check();
            let round = self.queues.next_round(T::LANES, |member| self.plans[member].position());
            for members in round.second_order.chunks(T::LANES) {
                let lengths = self.lengths(members);
                let verdicts = group.sdirk_step(&mut Members::new(self.system, self.robots, members), lengths);
                self.conclude(members, &verdicts);
            }
            for members in round.euler.chunks(T::LANES) {
                let lengths = self.lengths(members);
                let may_fail = std::array::from_fn(|lane| lane < members.len() && self.may_fail(members[lane]));
                let verdicts =
                    group.euler_step(&mut Members::new(self.system, self.robots, members), lengths, may_fail);
                self.conclude(members, &verdicts);
            }
            self.queues.end_round(round);
        }
    }

    /// Chooses the next part of a robot, unless it has reached the end, and queues it.
    fn enqueue(&mut self, member: usize) {
        let (plan, robot) = (&mut self.plans[member], &mut self.robots[member]);
        if plan.has_ended(&self.interval) || robot.body().statistics.diverged {
            return;
        }
        plan.choose_part(&self.interval, robot);
        self.queues.push(member, &plan.part);
    }

    /// Lengths of the members' parts, lane by lane.
    fn lengths<T: Real>(&self, members: &[usize]) -> T {
        let mut lengths = T::zero();
        for lane in 0..T::LANES {
            lengths.set_lane(lane, self.plans[*members.get(lane).unwrap_or(&members[0])].part.length);
        }
        lengths
    }

    fn may_fail(&self, member: usize) -> bool {
        let spent = self.robots[member].body().step_solves;
        self.plans[member].part.may_fail && solves_left(spent, self.config.max_iterations) > 0
    }

    fn conclude(&mut self, members: &[usize], verdicts: &Verdicts) {
        for (lane, &member) in members.iter().enumerate() {
            let (plan, body) = (&mut self.plans[member], self.robots[member].body_mut());
            if verdicts.postponed[lane] {
                self.queues.push(member, &plan.part);
                continue;
            }
            body.postponements = 0;
            if verdicts.accepted[lane] {
                plan.accept(&self.interval, body);
            } else {
                plan.reject(&self.interval, body);
            }
            self.enqueue(member);
        }
    }
}
