//! Many robots of one plant advanced together.

use crate::gait::CardanTarget;
use crate::math::MAX_LANES;
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::stepper::IntegratorConfig;
use crate::stepper::division::Division;
use crate::stepper::start::{START_LASTS, longest_step};

use super::super::{SpatialDriven, SpatialPlant};
use super::group::SpatialGroup;
use super::kernels::SpatialKernels;

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on that width, on its
/// neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct SpatialFleet {
    config: IntegratorConfig,
    width: Width,
    half_length: Vec<f64>,
    members: Vec<usize>,
    divisions: Vec<Division>,
    targets: Vec<CardanTarget>,
}

/// A group of the width chosen at construction.
#[derive(Debug, Clone)]
enum Width {
    One(Box<SpatialGroup<f64>>),
    #[cfg(target_arch = "x86_64")]
    Four(Box<SpatialGroup<Wide4>>),
    #[cfg(target_arch = "x86_64")]
    Eight(Box<SpatialGroup<Wide8>>),
}

impl SpatialFleet {
    /// A fleet of about `robots` robots; a few do better one by one than in a wide group.
    pub fn new(config: IntegratorConfig, plant: &SpatialPlant, robots: usize) -> Self {
        let config = IntegratorConfig { step: Some(config.step.unwrap_or(STEP)), ..config };
        Self {
            config,
            width: Width::choose(config, plant, robots),
            half_length: plant.robot.links.iter().map(|link| 0.5 * link.length).collect(),
            members: Vec::with_capacity(robots),
            divisions: Division::of_all_levels(&config, robots),
            targets: vec![CardanTarget::default(); plant.robot.joint_count()],
        }
    }

    /// The configuration with this scheme's default step.
    pub fn config(&self) -> &IntegratorConfig {
        &self.config
    }

    /// Integrates the robots chosen by `takes_part` over `duration` in equal steps no longer than the configured one. A
    /// robot whose state becomes absurd stays where it last was good, flagged.
    pub fn advance<D: SpatialDriven>(
        &mut self,
        plant: &SpatialPlant,
        robots: &mut [D],
        duration: f64,
        takes_part: impl Fn(usize) -> bool,
    ) {
        let Self { config, width, half_length, members, divisions, targets } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        members.iter().for_each(|&member| enter(plant, &mut robots[member], targets));
        let mut run = Run { config, plant, robots, members, divisions };
        match width {
            Width::One(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Four(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Eight(group) => run.advance(group, duration),
        }
        for &member in members.iter() {
            let body = robots[member].body_mut();
            body.motion.write(&plant.robot, half_length, &mut body.state);
        }
    }
}

impl Width {
    fn choose(config: IntegratorConfig, plant: &SpatialPlant, robots: usize) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if robots > 2 && Wide8::is_available() {
                return Width::Eight(Box::new(SpatialGroup::new(config, plant)));
            }
            if robots > 1 && Wide4::is_available() {
                return Width::Four(Box::new(SpatialGroup::new(config, plant)));
            }
        }
        Width::One(Box::new(SpatialGroup::new(config, plant)))
    }
}

/// The robot in the coordinates of the scheme; one that was placed in motion with its reference has no start to resolve.
fn enter<D: SpatialDriven>(plant: &SpatialPlant, robot: &mut D, targets: &mut [CardanTarget]) {
    let body = robot.body_mut();
    body.motion.read(&plant.robot, &body.state);
    if body.motion.elapsed > 0.0 {
        return;
    }
    robot.targets(robot.body().state.time, targets);
    let motion = &mut robot.body_mut().motion;
    if motion.follows(targets) {
        motion.elapsed = START_LASTS;
    }
}

/// One call of [`SpatialFleet::advance`].
struct Run<'a, D> {
    config: &'a IntegratorConfig,
    plant: &'a SpatialPlant,
    robots: &'a mut [D],
    members: &'a mut Vec<usize>,
    divisions: &'a mut [Division],
}

impl<D: SpatialDriven> Run<'_, D> {
    fn advance<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, duration: f64) {
        let steps = self.config.steps_in(duration);
        let h = duration / f64::from(steps);
        group.event_tolerance = self.config.event_tolerance.unwrap_or(JUMP * h * h);
        for k in 1..=steps {
            let members = std::mem::take(self.members);
            if self.config.order == 2 {
                self.step(group, &members, h, 0);
            } else {
                self.euler_steps(group, &members, h, 1);
            }
            *self.members = members;
            self.close_step(h * f64::from(k));
        }
    }

    /// One step of second order for `members`, divided where that does not do: a step in which forces change abruptly is
    /// halved and halved again, and at last taken as Euler steps. The first steps after a robot was placed are short.
    fn step<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, members: &[usize], h: f64, level: usize) {
        let mut division = std::mem::take(&mut self.divisions[level]);
        let robots = &*self.robots;
        let longest = |member: usize| longest_step(self.config.step(), robots[member].body().motion.elapsed);
        division.sort(members, |member| h > longest(member));
        let Division { tried, untried, rejected } = &mut division;
        // A register waits for its slowest lane.
        tried.sort_unstable_by_key(|&member| (robots[member].body().motion.effort, member));
        for members in tried.chunks(T::LANES) {
            group.sdirk_step(self.plant, self.robots, members, h, rejected);
        }
        rejected.iter().for_each(|&member| self.robots[member].body_mut().tally.events += 1);
        if level < self.config.event_halvings() {
            rejected.append(untried);
            self.halve(group, rejected, h, level);
        } else {
            self.euler_steps(group, rejected, h, self.config.event_steps());
            self.halve(group, untried, h, level);
        }
        self.divisions[level] = division;
    }

    fn halve<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, members: &[usize], h: f64, level: usize) {
        if !members.is_empty() {
            self.step(group, members, 0.5 * h, level + 1);
            self.step(group, members, 0.5 * h, level + 1);
        }
    }

    /// An interval of length `h` in `count` Euler steps.
    fn euler_steps<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, members: &[usize], h: f64, count: u32) {
        for members in members.chunks(T::LANES) {
            for _ in 0..count {
                self.euler_step(group, members, h / f64::from(count), 0);
            }
        }
    }

    /// An Euler step for as many robots as there are lanes, halved and halved again for those with links that sink.
    fn euler_step<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, members: &[usize], h: f64, level: usize) {
        let accepted = group.euler_step(self.plant, self.robots, members, h, level < MAX_HALVINGS);
        let (mut rest, mut count) = ([0; MAX_LANES], 0);
        for (&member, _) in members.iter().zip(accepted).filter(|(_, accepted)| !accepted) {
            rest[count] = member;
            count += 1;
        }
        if count > 0 {
            self.euler_step(group, &rest[..count], 0.5 * h, level + 1);
            self.euler_step(group, &rest[..count], 0.5 * h, level + 1);
        }
    }

    /// Sets the time free of accumulated round-off and takes diverged robots out.
    fn close_step(&mut self, elapsed: f64) {
        let robots = &mut *self.robots;
        self.members.retain(|&member| {
            let body = robots[member].body_mut();
            body.tally.steps += 1;
            body.state.time = body.interval_start() + elapsed;
            if !body.motion.speed.is_sane() {
                body.contain();
            }
            !body.diverged
        });
    }
}

/// Default step \[s\]: tenths of a millimetre in the peg course, some millimetres in sidewinding, where the
/// indeterminate normal forces leave as much open.
const STEP: f64 = 0.01;

/// How often an Euler step in which links sink is halved.
const MAX_HALVINGS: usize = 6;

/// Change of acceleration that counts as abrupt \[m/s^2\]. Gentler than in the plane: links touch down all the time.
const JUMP: f64 = 4.0;
