//! Many robots of one plant advanced together by the default scheme.

#[cfg(target_arch = "x86_64")]
use crate::math::{Wide4, Wide8};

use super::group::Group;
use super::stage_kernels::StageKernels;
use super::{Driven, IntegratorConfig, Plant};

/// Advances robots in groups as wide as the machine's registers; one robot's motion does not depend on
/// that width, on its neighbours, or on their number.
#[derive(Debug, Clone)]
pub struct Fleet {
    config: IntegratorConfig,
    width: Width,
    members: Vec<usize>,
    retake: Vec<usize>,
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
            retake: Vec::with_capacity(robots),
        }
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
        let Self { config, width, members, retake } = self;
        members.clear();
        members.extend((0..robots.len()).filter(|&index| takes_part(index)));
        members.iter().for_each(|&member| robots[member].body_mut().begin());
        if duration <= 0.0 {
            return;
        }
        let mut run = Run { config, plant, robots, members, retake };
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
}

/// One call of [`Fleet::advance`].
struct Run<'a, D> {
    config: &'a IntegratorConfig,
    plant: &'a Plant,
    robots: &'a mut [D],
    members: &'a mut Vec<usize>,
    retake: &'a mut Vec<usize>,
}

impl<D: Driven> Run<'_, D> {
    fn advance<T: StageKernels>(&mut self, group: &mut Group<T>, duration: f64) {
        let steps = self.config.steps_in(duration);
        let h = duration / f64::from(steps);
        for k in 1..=steps {
            if self.config.order == 2 {
                self.sdirk_step(group, h);
            } else {
                self.euler_step(group, h);
            }
            self.close_step(h * f64::from(k));
        }
    }

    fn sdirk_step<T: StageKernels>(&mut self, group: &mut Group<T>, h: f64) {
        self.retake.clear();
        for members in self.members.chunks(T::LANES) {
            group.sdirk_step(self.plant, self.robots, members, h, self.retake);
        }
        let substeps = self.config.event_substeps;
        for members in self.retake.chunks(T::LANES) {
            members.iter().for_each(|&member| self.robots[member].body_mut().tally.events += 1);
            for _ in 0..substeps {
                group.euler_step(self.plant, self.robots, members, h / f64::from(substeps));
            }
        }
    }

    fn euler_step<T: StageKernels>(&mut self, group: &mut Group<T>, h: f64) {
        for members in self.members.chunks(T::LANES) {
            group.euler_step(self.plant, self.robots, members, h);
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
