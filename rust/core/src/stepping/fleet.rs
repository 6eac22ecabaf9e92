//! Many robots of one system advanced together by the default scheme.

use std::fmt::{self, Debug, Formatter};

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::math::Wide4;
#[cfg(target_arch = "x86_64")]
use crate::math::Wide8;
use crate::math::{MAX_LANES, Real};

use super::body::Driven;
use super::group::{AnyGroup, Group, Parts, Verdicts};
use super::lane_count::lanes_of_registers;
use super::lanes::Members;
use super::model::Model;
use super::plan::{Interval, StepPlan};
use super::queues::Queues;
use super::start::first_part;
use super::verdict::solves_left;
use super::{Accuracy, ImplicitConfig};

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on that width, on
/// its neighbours, or on their number.
pub struct Fleet<M: Model> {
    config: ImplicitConfig,
    accuracy: Accuracy,
    /// Robots that it is made for.
    expected: usize,
    /// Made when it first advances: each environment of a batch has a fleet of its own, which never does.
    groups: Option<Groups<M>>,
    /// Empty; its memory is used again.
    robots: Vec<Driven<'static, M>>,
    plans: Vec<StepPlan>,
    queues: Queues,
    targets: Vec<M::Target>,
}

impl<M: Model> Fleet<M> {
    /// A fleet of about `robots` robots; few of them are faster one by one than in a wide group.
    pub fn new(config: ImplicitConfig, system: &M::System, robots: usize) -> Self {
        Self::for_joints(config, robots, M::robot(system).joint_count())
    }

    fn for_joints(config: ImplicitConfig, robots: usize, joints: usize) -> Self {
        Self {
            config,
            accuracy: config.accuracy(&M::ACCURACY),
            expected: robots,
            groups: None,
            robots: Vec::with_capacity(robots),
            plans: Vec::with_capacity(robots),
            queues: Queues::with_capacity(robots),
            targets: vec![M::Target::default(); joints],
        }
    }

    /// The configured accuracy, with the model's defaults.
    pub fn accuracy(&self) -> &Accuracy {
        &self.accuracy
    }

    /// Integrates `robots` over `duration` in equal steps no longer than the configured one. A robot whose state becomes
    /// implausible keeps its last plausible one and is flagged.
    pub fn advance<'r>(&mut self, system: &M::System, robots: impl IntoIterator<Item = Driven<'r, M>>, duration: f64) {
        let mut list: Vec<Driven<'r, M>> = std::mem::take(&mut self.robots);
        list.extend(robots);
        self.advance_all(system, &mut list, duration);
        self.robots = emptied(list);
    }

    /// [`advance`](Self::advance) for robots that are in a list already.
    pub(crate) fn advance_all(&mut self, system: &M::System, robots: &mut [Driven<M>], duration: f64) {
        let Self { config, accuracy, expected, groups, plans, queues, targets, .. } = self;
        robots.iter_mut().for_each(|robot| robot.body.begin());
        if duration <= 0.0 {
            return;
        }
        let interval = Interval::new(config, accuracy, duration);
        robots.iter_mut().for_each(|robot| prepare(system, robot, accuracy.step, targets));
        plans.clear();
        plans.resize(robots.len(), StepPlan::at_start(&interval));
        let groups = groups.get_or_insert_with(|| Groups::new(config, system, *expected));
        Run { config, system, robots, plans, queues, interval }.advance(groups);
        let sound = robots.iter_mut().filter(|robot| !robot.body.statistics.diverged);
        sound.for_each(|robot| M::from_reduced(system, robot.body));
    }
}

/// A copy makes a workspace of its own when it first advances.
impl<M: Model> Clone for Fleet<M> {
    fn clone(&self) -> Self {
        Self::for_joints(self.config, self.expected, self.targets.len())
    }
}

impl<M: Model> Debug for Fleet<M> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.debug_struct("Fleet").field("config", &self.config).field("expected", &self.expected).finish_non_exhaustive()
    }
}

/// The memory of a list of robots: collected in place, and no robot is left that would live as long as the list.
fn emptied<M: Model>(mut list: Vec<Driven<M>>) -> Vec<Driven<'static, M>> {
    list.clear();
    list.into_iter().map(|_| unreachable!("the list is empty")).collect()
}

/// The group of `lanes` lanes; for [`Model::group`] alone, since it compiles the steps for every width.
pub fn group_for<M: Model>(config: &ImplicitConfig, system: &M::System, lanes: usize) -> Box<dyn AnyGroup<M>> {
    match lanes {
        #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
        Wide4::LANES => Box::new(Group::<M, Wide4>::new(config, system)),
        #[cfg(target_arch = "x86_64")]
        Wide8::LANES => Box::new(Group::<M, Wide8>::new(config, system)),
        _ => Box::new(Group::<M, f64>::new(config, system)),
    }
}

/// The groups of a fleet: robots that do not fill a wide register may share a narrower one.
struct Groups<M: Model> {
    /// See [`lanes_of_registers`].
    lanes: [usize; MAX_LANES + 1],
    /// By their lanes.
    groups: [Option<Box<dyn AnyGroup<M>>>; MAX_LANES + 1],
}

impl<M: Model> Groups<M> {
    /// For about `robots` robots.
    fn new(config: &ImplicitConfig, system: &M::System, robots: usize) -> Self {
        let lanes = lanes_of_registers(robots);
        let group = |width: usize| lanes[1..].contains(&width).then(|| M::group(config, system, width));
        Self { lanes, groups: std::array::from_fn(group) }
    }

    /// Lanes of the widest.
    fn widest(&self) -> usize {
        self.lanes[MAX_LANES]
    }

    /// How many of so many robots share the next register.
    fn share(&self, robots: usize) -> usize {
        robots.min(self.lanes[robots.min(MAX_LANES)])
    }

    /// The group for so many robots that share a register.
    fn of(&mut self, robots: usize) -> &mut dyn AnyGroup<M> {
        self.groups[self.lanes[robots]].as_mut().expect("a group of every width").as_mut()
    }
}

/// Prepares a robot for an interval: its reduced coordinates, and how long the first part of a robot that was just placed
/// is: short unless it was placed in motion with its reference. `step` is the configured one \[s\].
fn prepare<M: Model>(system: &M::System, robot: &mut Driven<M>, step: f64, targets: &mut [M::Target]) {
    let Driven { body, reference } = robot;
    M::to_reduced(system, body);
    if body.clock.next > 0.0 {
        return;
    }
    reference.targets(body.state.time, targets);
    body.clock.next = if M::follows(system, body, targets) { step } else { first_part(step) };
}

/// One call of [`Fleet::advance`].
struct Run<'a, 'r, M: Model> {
    config: &'a ImplicitConfig,
    system: &'a M::System,
    robots: &'a mut [Driven<'r, M>],
    plans: &'a mut [StepPlan],
    queues: &'a mut Queues,
    interval: Interval,
}

impl<M: Model> Run<'_, '_, M> {
    /// Each robot follows its own plan to the end of the interval; robots are regrouped for every part.
    fn advance(&mut self, groups: &mut Groups<M>) {
        self.queues.clear();
        for member in 0..self.robots.len() {
            self.enqueue(member);
        }
        while !self.queues.is_empty() {
            self.robots[0].body.interrupt.check();
            let round = self.queues.next_round(groups.widest(), &|member| self.plans[member].position());
            for (queue, are_euler) in [(&round.second_order, false), (&round.euler, true)] {
                let mut left = queue.as_slice();
                while !left.is_empty() {
                    let (members, others) = left.split_at(groups.share(left.len()));
                    let parts = self.parts(members, are_euler);
                    let mut register = Members::new(self.system, self.robots, members);
                    let verdicts = groups.of(members.len()).step(&mut register, &parts);
                    self.conclude(members, &verdicts);
                    left = others;
                }
            }
            self.queues.end_round(round);
        }
    }

    /// Chooses the next part of a robot, unless it has reached the end, and queues it.
    fn enqueue(&mut self, member: usize) {
        let (plan, robot) = (&mut self.plans[member], &mut self.robots[member]);
        if plan.has_ended(&self.interval) || robot.body.statistics.diverged {
            return;
        }
        plan.choose_part(&self.interval, robot);
        self.queues.push(member, &plan.part);
    }

    /// The members' parts, lane by lane; lanes without a member repeat the first.
    fn parts(&self, members: &[usize], are_euler: bool) -> Parts {
        let length = |lane: usize| self.plans[*members.get(lane).unwrap_or(&members[0])].part.length;
        let may_fail = |lane: usize| lane < members.len() && self.may_fail(members[lane]);
        Parts { are_euler, lengths: std::array::from_fn(length), may_fail: std::array::from_fn(may_fail) }
    }

    fn may_fail(&self, member: usize) -> bool {
        let spent = self.robots[member].body.step_solves;
        self.plans[member].part.may_fail && solves_left(spent, self.config.max_iterations) > 0
    }

    fn conclude(&mut self, members: &[usize], verdicts: &Verdicts) {
        for (lane, &member) in members.iter().enumerate() {
            let (plan, body) = (&mut self.plans[member], &mut *self.robots[member].body);
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
