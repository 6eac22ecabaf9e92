//! A robot moves the same, bit for bit, alone and in the lanes of a register among others.

use snake_core::gait::Reference;
use snake_core::stepping::{Body, Fleet, ImplicitConfig, Model, Scripted, StepStatistics};

use crate::allocation::REQUESTS;

/// A robot after some intervals, and the statistics of each.
pub type Outcome<M> = (Body<M>, Vec<StepStatistics>);

/// Moves robots in a fleet made for `width` of them.
fn moved<M: Model, R: Reference<M::Target>>(
    system: &M::System,
    config: ImplicitConfig,
    width: usize,
    intervals: &[f64],
    mut robots: Vec<Scripted<R, M>>,
) -> Vec<Outcome<M>> {
    let mut fleet = Fleet::new(config, system, width);
    let mut statistics = vec![Vec::new(); robots.len()];
    for &interval in intervals {
        fleet.advance(system, robots.iter_mut().map(Scripted::driven), interval);
        statistics.iter_mut().zip(&robots).for_each(|(all, robot)| all.push(robot.body.statistics));
    }
    robots.into_iter().map(|robot| robot.body).zip(statistics).collect()
}

/// Robots of a fleet that takes eight lanes; those for less than 12 do not.
pub const WIDE: usize = 13;

/// So many robots move, count and touch themselves the same alone and together in fleets made for `widths` robots. Returns
/// them as they are alone.
pub fn alone_as_among_others<M: Model, R: Reference<M::Target>>(
    system: &M::System,
    config: ImplicitConfig,
    widths: &[usize],
    intervals: &[f64],
    count: usize,
    robot: impl Fn(usize) -> Scripted<R, M>,
) -> Vec<Outcome<M>> {
    let alone: Vec<_> = (0..count).map(|k| moved(system, config, 1, intervals, vec![robot(k)]).remove(0)).collect();
    for &width in widths {
        let together = moved(system, config, width, intervals, (0..count).map(&robot).collect());
        for (k, ((body, statistics), (alone, of_alone))) in together.iter().zip(&alone).enumerate() {
            assert_eq!(body.state, alone.state, "robot {k} in a fleet made for {width}");
            assert_eq!(statistics, of_alone, "robot {k} in a fleet made for {width}");
            assert_eq!(body.impulses, alone.impulses, "robot {k} in a fleet made for {width}");
        }
    }
    alone
}

/// A fleet that has moved for `first` \[s\] asks for no memory in what follows.
pub fn steps_ask_for_no_memory<M: Model, R: Reference<M::Target>>(
    system: &M::System,
    config: ImplicitConfig,
    [first, then]: [f64; 2],
    mut robots: Vec<Scripted<R, M>>,
) {
    let mut fleet = Fleet::new(config, system, WIDE.max(robots.len()));
    fleet.advance(system, robots.iter_mut().map(Scripted::driven), first);
    let before = REQUESTS.get();
    fleet.advance(system, robots.iter_mut().map(Scripted::driven), then);
    assert_eq!(REQUESTS.get() - before, 0);
}

/// Of nine robots one receives an invalid velocity: it alone is flagged, rests where it was last good, and the others move
/// as beside a sound one, while it is among them and afterwards.
pub fn a_robot_that_diverges_leaves_its_neighbours_untouched<M: Model, R: Reference<M::Target>>(
    system: &M::System,
    config: ImplicitConfig,
    intervals: &[f64],
    robot: impl Fn(usize) -> Scripted<R, M>,
    poison: impl Fn(&mut M::Twist),
) {
    let robots = || -> Vec<_> { (0..9).map(&robot).collect() };
    let mut sound = moved(system, config, WIDE, intervals, robots());
    let mut robots = robots();
    poison(&mut robots[4].body.state.twist[3]);
    let mut fleet = Fleet::new(config, system, WIDE);
    fleet.advance(system, robots.iter_mut().map(Scripted::driven), intervals[0]);
    let diverged: Vec<usize> = (0..9).filter(|&k| robots[k].body.statistics.diverged).collect();
    assert_eq!(diverged, [4]);
    assert!(robots[4].body.state.is_plausible(), "a robot that diverged rests where it was last good");
    robots.remove(4);
    sound.remove(4);
    for &interval in &intervals[1..] {
        fleet.advance(system, robots.iter_mut().map(Scripted::driven), interval);
    }
    for (robot, (sound, _)) in robots.iter().zip(&sound) {
        assert_eq!(robot.body.state, sound.state);
    }
}
