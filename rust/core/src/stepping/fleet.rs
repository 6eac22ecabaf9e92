//! Many robots of one system advanced together by the default scheme.

use crate::math::Real;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::math::Wide4;
#[cfg(target_arch = "x86_64")]
use crate::math::Wide8;

use super::ImplicitConfig;
use super::group::Group;
use super::kernels::{Compiled, CompiledModel};
use super::lane_count::lanes_for;
use super::lanes::{Lanes, Members};
use super::model::{Driven, Model, RobotState};
use super::plan::{Interval, StepPlan};
use super::start::START_LASTS;
use super::verdict::solves_left;

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on that width, on
/// its neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct Fleet<M: Model> {
    config: ImplicitConfig,
    width: Width<M>,
    members: Vec<usize>,
    plans: Vec<StepPlan<M::Division>>,
    pending: Pending,
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

/// Robots that have not come to the end of the interval, by the scheme of their next part.
#[derive(Debug, Clone, Default)]
struct Pending {
    second_order: Vec<usize>,
    euler: Vec<usize>,
}

impl<M: CompiledModel> Fleet<M> {
    /// A fleet of about `robots` robots; few of them are faster one by one than in a wide group.
    pub fn new(config: ImplicitConfig, system: &M::System, robots: usize) -> Self {
        let config = M::configured(config);
        Self {
            config,
            width: Width::choose(config, system, robots),
            members: Vec::with_capacity(robots),
            plans: Vec::with_capacity(robots),
            pending: Pending { second_order: Vec::with_capacity(robots), euler: Vec::with_capacity(robots) },
            targets: vec![M::Target::default(); M::robot(system).joint_count()],
        }
    }

    /// The configuration with the model's defaults.
    pub fn config(&self) -> &ImplicitConfig {
        &self.config
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
        let Self { config, width, members, plans, pending, targets } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        members.iter().for_each(|&member| prepare(system, &mut robots[member], targets));
        let interval = Interval::new(config, duration);
        plans.clear();
        plans.resize(robots.len(), StepPlan::at_start());
        let mut run = Run { config, system, robots, members, plans, pending, interval };
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
    fn choose(config: ImplicitConfig, system: &M::System, robots: usize) -> Self {
        match lanes_for(robots) {
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            Wide4::LANES => Width::Four(Box::new(Group::new(config, system))),
            #[cfg(target_arch = "x86_64")]
            Wide8::LANES => Width::Eight(Box::new(Group::new(config, system))),
            _ => Width::One(Box::new(Group::new(config, system))),
        }
    }
}

/// Prepares a robot for an interval: its reduced coordinates, and whether its start is to be resolved by short steps,
/// which one that was placed in motion with its reference does not need.
fn prepare<D: Driven>(
    system: &<D::Model as Model>::System,
    robot: &mut D,
    targets: &mut [<D::Model as Model>::Target],
) {
    D::Model::to_reduced(system, robot.body_mut());
    if robot.body().clock.since_start > 0.0 {
        return;
    }
    robot.targets(robot.body().state.time(), targets);
    if D::Model::follows(robot.body(), targets) {
        let clock = &mut robot.body_mut().clock;
        (clock.since_start, clock.since_jump) = (START_LASTS, START_LASTS);
    }
}

/// One call of [`Fleet::advance`].
struct Run<'a, D: Driven> {
    config: &'a ImplicitConfig,
    system: &'a <D::Model as Model>::System,
    robots: &'a mut [D],
    members: &'a [usize],
    plans: &'a mut [StepPlan<<D::Model as Model>::Division>],
    pending: &'a mut Pending,
    interval: Interval,
}

impl<D: Driven> Run<'_, D> {
    /// Each robot follows its own plan to the end of the interval; those that have not reached it are regrouped for
    /// every part.
    fn advance<T: Real>(&mut self, group: &mut Group<D::Model, T>)
    where
        D::Model: Compiled<T>,
    {
        let step = self.interval.step;
        group.event_tolerance = self.config.event_tolerance.unwrap_or(D::Model::ABRUPT_CHANGE * step * step);
        while self.choose_parts() {
            let Pending { second_order, euler } = std::mem::take(self.pending);
            for members in second_order.chunks(T::LANES) {
                let lengths = self.lengths(members);
                let accepted = group.sdirk_step(&mut Members::new(self.system, self.robots, members), lengths);
                self.conclude(members, accepted);
            }
            for members in euler.chunks(T::LANES) {
                let lengths = self.lengths(members);
                let may_fail = std::array::from_fn(|lane| lane < members.len() && self.may_fail(members[lane]));
                let accepted =
                    group.euler_step(&mut Members::new(self.system, self.robots, members), lengths, may_fail);
                self.conclude(members, accepted);
            }
            *self.pending = Pending { second_order, euler };
        }
    }

    /// Chooses the next part of every robot that has not reached the end; returns whether there is any.
    fn choose_parts(&mut self) -> bool {
        let Pending { second_order, euler } = &mut *self.pending;
        second_order.clear();
        euler.clear();
        for &member in self.members {
            let (plan, robot) = (&mut self.plans[member], &mut self.robots[member]);
            if plan.has_ended(&self.interval) || robot.body().statistics.diverged {
                continue;
            }
            plan.choose_part(&self.interval, robot);
            if plan.part.is_euler { euler.push(member) } else { second_order.push(member) }
        }
        // A register takes as long as its slowest lane.
        for list in [&mut *second_order, &mut *euler] {
            list.sort_unstable_by_key(|&member| (self.plans[member].solves, member));
        }
        !(second_order.is_empty() && euler.is_empty())
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

    fn conclude(&mut self, members: &[usize], accepted: Lanes) {
        for (&member, accepted) in members.iter().zip(accepted) {
            let (plan, body) = (&mut self.plans[member], self.robots[member].body_mut());
            if accepted {
                plan.accept(&self.interval, body);
            } else {
                plan.reject(&self.interval, body);
            }
        }
    }
}
