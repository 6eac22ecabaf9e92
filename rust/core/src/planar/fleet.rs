//! Many robots of one plant advanced together by the default scheme.

use crate::gait::JointTarget;
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};

use super::division::Division;
use super::group::Group;
use super::hardest::Hardest;
use super::stage_kernels::StageKernels;
use super::{Driven, Plant};
use crate::stepping::IntegratorConfig;
use crate::stepping::start::{START_LASTS, end_before, follows, longest_step};

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on
/// that width, on its neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct Fleet {
    config: IntegratorConfig,
    width: Width,
    members: Vec<usize>,
    divisions: Vec<Division>,
    targets: Vec<JointTarget>,
}

/// A group of the width chosen at construction.
#[derive(Debug, Clone)]
enum Width {
    One(Box<Group<f64>>),
    #[cfg(target_arch = "x86_64")]
    Four(Box<Group<Wide4>>),
    #[cfg(target_arch = "x86_64")]
    Eight(Box<Group<Wide8>>),
}

impl Fleet {
    /// A fleet of about `robots` robots; a few do better one by one than in a wide group.
    pub fn new(config: IntegratorConfig, plant: &Plant, robots: usize) -> Self {
        Self {
            config,
            width: Width::choose(config, plant, robots),
            members: Vec::with_capacity(robots),
            divisions: Division::of_all_levels(&config, robots),
            targets: vec![JointTarget::default(); plant.robot.joint_count()],
        }
    }

    /// Begins to keep the hardest stage of all robots, or ends it.
    pub fn keep_hardest(&mut self, hardest: Option<Hardest>) {
        *self.width.hardest() = hardest.map(Box::new);
    }

    /// The hardest stage since [`Self::keep_hardest`].
    pub fn hardest(&mut self) -> Option<&Hardest> {
        self.width.hardest().as_deref()
    }

    /// Integrates the robots chosen by `takes_part` over `duration` in equal steps no longer than the
    /// configured one. A robot whose state becomes absurd stays where it last was good, flagged.
    pub fn advance<D: Driven>(
        &mut self,
        plant: &Plant,
        robots: &mut [D],
        duration: f64,
        takes_part: impl Fn(usize) -> bool,
    ) {
        let Self { config, width, members, divisions, targets } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        members.iter().for_each(|&member| settle(&mut robots[member], targets));
        let mut run = Run { config, plant, robots, members, divisions };
        match width {
            Width::One(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Four(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Eight(group) => run.advance(group, duration),
        }
    }
}

impl Width {
    fn choose(config: IntegratorConfig, plant: &Plant, robots: usize) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if robots > 2 && Wide8::is_available() {
                return Width::Eight(Box::new(Group::new(config, plant)));
            }
            if robots > 1 && Wide4::is_available() {
                return Width::Four(Box::new(Group::new(config, plant)));
            }
        }
        Width::One(Box::new(Group::new(config, plant)))
    }

    fn hardest(&mut self) -> &mut Option<Box<Hardest>> {
        match self {
            Width::One(group) => &mut group.hardest,
            #[cfg(target_arch = "x86_64")]
            Width::Four(group) => &mut group.hardest,
            #[cfg(target_arch = "x86_64")]
            Width::Eight(group) => &mut group.hardest,
        }
    }
}

/// One call of [`Fleet::advance`].
struct Run<'a, D> {
    config: &'a IntegratorConfig,
    plant: &'a Plant,
    robots: &'a mut [D],
    members: &'a mut Vec<usize>,
    divisions: &'a mut [Division],
}

impl<D: Driven> Run<'_, D> {
    fn advance<T: StageKernels>(&mut self, group: &mut Group<T>, duration: f64) {
        let steps = self.config.steps_in(duration);
        let h = duration / f64::from(steps);
        group.event_tolerance = self.config.event_tolerance(h);
        for k in 1..=steps {
            let mut members = std::mem::take(self.members);
            let on_the_way = self.those_that_meet_no_jump(&mut members, h);
            let (smooth, jumping) = members.split_at(on_the_way);
            self.whole_step(group, smooth, h);
            for member in jumping {
                self.step_over_jumps(group, *member, h);
            }
            *self.members = members;
            self.close_step(h * f64::from(k));
        }
    }

    /// Moves robots whose reference jumps within the next step to the end of the list; how many are before them.
    fn those_that_meet_no_jump(&self, members: &mut [usize], h: f64) -> usize {
        let meets_one = |member: usize| {
            let robot = &self.robots[member];
            let time = robot.body().state.time;
            end_before(time, |time| robot.next_jump(time)) < time + h
        };
        let jumping = members.iter().filter(|&&member| meets_one(member)).count();
        if jumping > 0 {
            members.sort_unstable_by_key(|&member| (meets_one(member), member));
        }
        members.len() - jumping
    }

    fn whole_step<T: StageKernels>(&mut self, group: &mut Group<T>, members: &[usize], h: f64) {
        if self.config.order == 2 {
            self.step(group, members, h, 0);
        } else {
            self.euler_steps(group, members, h, 1);
        }
    }

    /// A step in parts that end where the reference jumps (T 7.2.2): links that a jump sets in motion are as those of a
    /// robot just placed. A step across would smear the jump over its length.
    fn step_over_jumps<T: StageKernels>(&mut self, group: &mut Group<T>, member: usize, h: f64) {
        let end = self.robots[member].body().state.time + h;
        loop {
            let robot = &self.robots[member];
            let time = robot.body().state.time;
            let before = end_before(time, |time| robot.next_jump(time));
            if before >= end {
                return self.whole_step(group, &[member], end - time);
            }
            self.whole_step(group, &[member], before - time);
            self.robots[member].body_mut().warm_start.elapsed = 0.0;
        }
    }

    /// One step of second order for `members`, divided where that does not do.
    ///
    /// A step in which a peg's force changes abruptly is halved and halved again, and at last taken as Euler steps.
    /// Such steps come in groups, so that the one after is halved without being tried. A robot that starts from rest
    /// meets a reference in motion, so its first step is halved towards the start until it resolves the boundary layer
    /// of a stiff controller, and following steps grow slowly.
    fn step<T: StageKernels>(&mut self, group: &mut Group<T>, members: &[usize], h: f64, level: usize) {
        let mut division = std::mem::take(&mut self.divisions[level]);
        let robots = &*self.robots;
        let longest = |member: usize| longest_step(self.config.step(), robots[member].body().warm_start.elapsed);
        let may_halve = level == 0 && self.config.event_halvings() > 0;
        let rough = |member: usize| may_halve && robots[member].body().warm_start.rough;
        division.sort(members, |member| h > longest(member) || rough(member));
        let Division { tried, untried, rejected } = &mut division;
        // A register waits for its slowest lane.
        tried.sort_unstable_by_key(|&member| (robots[member].body().effort, member));
        for members in tried.chunks(T::LANES) {
            group.sdirk_step(self.plant, self.robots, members, h, rejected);
        }
        if level == 0 {
            members.iter().for_each(|&member| self.robots[member].body_mut().warm_start.rough = false);
        }
        for &member in rejected.iter() {
            let body = self.robots[member].body_mut();
            body.tally.events += 1;
            body.warm_start.rough = true;
        }
        if level < self.config.event_halvings() {
            rejected.append(untried);
            self.halve(group, rejected, h, level);
        } else {
            self.euler_steps(group, rejected, h, self.config.event_steps());
            self.halve(group, untried, h, level);
        }
        self.divisions[level] = division;
    }

    fn halve<T: StageKernels>(&mut self, group: &mut Group<T>, members: &[usize], h: f64, level: usize) {
        if !members.is_empty() {
            self.step(group, members, 0.5 * h, level + 1);
            self.step(group, members, 0.5 * h, level + 1);
        }
    }

    /// An interval of length `h` in `count` Euler steps.
    fn euler_steps<T: StageKernels>(&mut self, group: &mut Group<T>, members: &[usize], h: f64, count: u32) {
        for members in members.chunks(T::LANES) {
            for _ in 0..count {
                group.euler_step(self.plant, self.robots, members, h / f64::from(count));
            }
        }
    }

    /// Sets the time free of accumulated round-off and takes diverged robots out.
    fn close_step(&mut self, elapsed: f64) {
        let robots = &mut *self.robots;
        self.members.retain(|&member| {
            let body = robots[member].body_mut();
            body.tally.steps += 1;
            body.state.time = body.interval_start() + elapsed;
            body.contain();
            !body.diverged
        });
    }
}

/// A robot that was placed in motion with its reference has no start to resolve.
fn settle<D: Driven>(robot: &mut D, targets: &mut [JointTarget]) {
    if robot.body().warm_start.elapsed > 0.0 {
        return;
    }
    let state = &robot.body().state;
    robot.targets(state.time, targets);
    let mut joints = targets.iter().enumerate();
    if joints.all(|(joint, target)| follows(target, state.joint_angle(joint), state.joint_rate(joint))) {
        robot.body_mut().warm_start.elapsed = START_LASTS;
    }
}
