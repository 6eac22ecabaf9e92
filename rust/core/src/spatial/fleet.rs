//! Many robots of one plant advanced together.

use crate::gait::CardanTarget;
#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};
use crate::stepping::IntegratorConfig;
use crate::stepping::lanes::{Lanes, member_of};
use crate::stepping::start::START_LASTS;

use super::group::SpatialGroup;
use super::kernels::SpatialKernels;
use super::way::{Interval, Way};
use super::{SpatialDriven, SpatialPlant};

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on that width, on
/// its neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct SpatialFleet {
    config: IntegratorConfig,
    width: Width,
    half_length: Vec<f64>,
    members: Vec<usize>,
    ways: Vec<Way>,
    under_way: UnderWay,
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
            ways: Vec::with_capacity(robots),
            under_way: UnderWay { second_order: Vec::with_capacity(robots), euler: Vec::with_capacity(robots) },
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
        let Self { config, width, half_length, members, ways, under_way, targets } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        members.iter().for_each(|&member| enter(plant, &mut robots[member], targets));
        let mut run = Run { config, plant, robots, members, ways, under_way };
        match width {
            Width::One(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Four(group) => run.advance(group, duration),
            #[cfg(target_arch = "x86_64")]
            Width::Eight(group) => run.advance(group, duration),
        }
        for &member in members.iter() {
            let body = robots[member].body_mut();
            if !body.diverged {
                body.motion.write(&plant.robot, half_length, &mut body.state);
            }
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

/// The robot in the coordinates of the scheme; one that was placed in motion with its reference has no start to
/// resolve.
fn enter<D: SpatialDriven>(plant: &SpatialPlant, robot: &mut D, targets: &mut [CardanTarget]) {
    let body = robot.body_mut();
    body.motion.read(&plant.robot, &body.state);
    if body.motion.elapsed > 0.0 {
        return;
    }
    robot.targets(robot.body().state.time, targets);
    let motion = &mut robot.body_mut().motion;
    if motion.follows(targets) {
        (motion.elapsed, motion.calm) = (START_LASTS, START_LASTS);
    }
}

/// One call of [`SpatialFleet::advance`].
struct Run<'a, D> {
    config: &'a IntegratorConfig,
    plant: &'a SpatialPlant,
    robots: &'a mut [D],
    members: &'a [usize],
    ways: &'a mut Vec<Way>,
    under_way: &'a mut UnderWay,
}

/// Robots that have not come to the end of the interval, by the scheme of their next part.
#[derive(Debug, Clone, Default)]
struct UnderWay {
    second_order: Vec<usize>,
    euler: Vec<usize>,
}

impl<D: SpatialDriven> Run<'_, D> {
    /// Each robot goes its own way to the end of the interval, in parts of steps as long as it needs; those that are on
    /// their way are grouped anew for every part.
    fn advance<T: SpatialKernels>(&mut self, group: &mut SpatialGroup<T>, duration: f64) {
        let interval = Interval::new(self.config, duration);
        group.event_tolerance = self.config.event_tolerance.unwrap_or(JUMP * interval.step * interval.step);
        self.ways.clear();
        self.ways.resize(self.robots.len(), Way::new(&interval));
        while self.plan(&interval) {
            let UnderWay { second_order, euler } = std::mem::take(self.under_way);
            for members in second_order.chunks(T::LANES) {
                let accepted = group.sdirk_step(self.plant, self.robots, members, self.lengths(members));
                self.conclude(&interval, members, accepted);
            }
            for members in euler.chunks(T::LANES) {
                let may_fail = std::array::from_fn(|lane| self.ways[member_of(members, lane)].may_fail());
                let accepted = group.euler_step(self.plant, self.robots, members, self.lengths(members), may_fail);
                self.conclude(&interval, members, accepted);
            }
            *self.under_way = UnderWay { second_order, euler };
        }
    }

    /// Chooses the next part of every robot that has not come to the end; whether there is any.
    fn plan(&mut self, interval: &Interval) -> bool {
        let UnderWay { second_order, euler } = &mut *self.under_way;
        second_order.clear();
        euler.clear();
        for &member in self.members {
            let (way, robot) = (&mut self.ways[member], &self.robots[member]);
            if way.has_ended(interval) || robot.body().diverged {
                continue;
            }
            way.plan(interval, robot);
            if way.is_euler() { euler.push(member) } else { second_order.push(member) }
        }
        // A register waits for its slowest lane.
        let robots = &*self.robots;
        for list in [&mut *second_order, &mut *euler] {
            list.sort_unstable_by_key(|&member| (robots[member].body().motion.effort, member));
        }
        !(second_order.is_empty() && euler.is_empty())
    }

    /// Lengths of the members' parts, lane by lane.
    fn lengths<T: SpatialKernels>(&self, members: &[usize]) -> T {
        let mut lengths = T::zero();
        for lane in 0..T::LANES {
            lengths.set_lane(lane, self.ways[member_of(members, lane)].length);
        }
        lengths
    }

    fn conclude(&mut self, interval: &Interval, members: &[usize], accepted: Lanes) {
        for (&member, accepted) in members.iter().zip(accepted) {
            let (way, robot) = (&mut self.ways[member], &mut self.robots[member]);
            if accepted {
                way.accept(interval, robot);
            } else {
                robot.body_mut().tally.events += u32::from(!way.is_euler());
                way.reject(interval);
            }
        }
    }
}

/// Default step \[s\]: tenths of a millimetre in the peg course, some millimetres in sidewinding, where the
/// indeterminate normal forces leave as much open.
const STEP: f64 = 0.01;

/// Change of acceleration that counts as abrupt \[m/s^2\]. Gentler than in the plane: links touch down all the time.
const JUMP: f64 = 4.0;
