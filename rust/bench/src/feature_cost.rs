//! Cost of each feature, where it acts and in a scene that does not need it.
//!
//! Three kinds of rows. *Off*: the feature is not there. *Idle*: it is there but can never act, so the
//! robot's motion is that of *off* and the difference in cost is what a scene pays for what it does not
//! need. *Used*: it acts. Both scenes of a row are timed in turn and the median of the paired ratios is
//! reported. Contacts between links, which change what a robot does, are measured by their number instead: what a step
//! and a linear solve cost in postures with more and more of them.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::environment::{EnvConfig, Perception, PlanarRobot, Task};
use snake_core::obstacles::{Obstacle, Shape};
use snake_core::robot::RobotConfig;
use snake_core::scene::{Peg, START_7_5, START_FREE, TABLE_7_5};
use snake_core::slope::Slope;

use crate::clock::{median, spent};
use crate::environments::{Actions, Robots, of_id, pool};
use crate::fleet::{ROBOTS, Window};
use crate::report::{emit, progress};
use crate::scenes::{Scenario, aiko};
use crate::spatial::{self, SpatialScenario};
use crate::timed_fleet::TimedFleet;

/// One feature on against off.
#[derive(Serialize)]
struct Comparison<'a> {
    feature: &'a str,
    off: &'a str,
    on: &'a str,
    /// The feature is there but can never act.
    idle: bool,
    /// `step` of the integrator or `env step`.
    unit: &'a str,
    /// CPU time of one \[us\], medians.
    us_off: f64,
    us_on: f64,
    /// Median of the ratios of one repetition each, and the middle half of them.
    ratio: f64,
    ratio_low: f64,
    ratio_high: f64,
    repetitions: usize,
}

/// Measures every feature and emits a row for each.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure(quick: bool) -> Result<(), ConfigError> {
    let rounds = if quick { 7 } else { 31 };
    physics(rounds)?;
    in_space(rounds)?;
    pressed_links(rounds)?;
    environment(rounds)
}

fn physics(rounds: usize) -> Result<(), ConfigError> {
    let free = || aiko("free", "", &[], [0.2, 0.2], START_FREE);
    let with_pegs = |pegs: Vec<Peg>| {
        let mut scenario = free();
        scenario.scene.obstacles = pegs.into_iter().map(Into::into).collect();
        scenario
    };
    let with_friction = |friction| aiko("free", "", &[], friction, START_FREE);
    let with_limit = |scenario: Scenario, limit| Scenario {
        controller: ControllerConfig { torque_limit: Some(limit), ..ControllerConfig::default() },
        ..scenario
    };
    let course = || aiko("course", "", &TABLE_7_5, [0.2, 0.2], START_7_5);
    let with_robot = |robot| Scenario { robot, ..free() };
    let hollow = RobotConfig { self_contact: Some(false), ..RobotConfig::default() };
    let limited = |limit: f64| RobotConfig { joint_limit: Some(limit.into()), ..RobotConfig::default() };
    let unlimited = limited(f64::INFINITY);
    let rough_course = || {
        let mut scenario = course();
        scenario.scene.obstacles.iter_mut().for_each(|peg| peg.friction = 0.3);
        scenario
    };
    let with_obstacle = |obstacle| {
        let mut scenario = free();
        scenario.scene.obstacles = vec![obstacle];
        scenario
    };
    let on_slope = |angle| {
        let mut scenario = free();
        scenario.scene.slope = Slope { angle, direction: 0.0 };
        scenario
    };
    let far_peg = || with_obstacle(FAR_PEG.into());
    let step = "step";
    let rows = [
        ("pegs", "none", "one, 100 m away", true, free(), with_pegs(vec![FAR_PEG])),
        ("pegs", "none", "1,000, 5 m away and more", true, free(), with_pegs(far_field())),
        ("pegs", "none", "course of Table 7.5, touched", false, free(), course()),
        ("walls", "none", "one, 100 m away", true, free(), with_obstacle(far_wall())),
        (
            "friction at obstacles",
            "smooth peg, 100 m away",
            "rough one",
            true,
            far_peg(),
            with_obstacle(rough(FAR_PEG)),
        ),
        ("friction at obstacles", "none", "0.3, on the course", false, course(), rough_course()),
        ("slope", "level", "1e-12 rad", true, free(), on_slope(1e-12)),
        ("elliptic friction", "isotropic", "coefficients apart by 1e-12", true, free(), with_friction(NEARLY_EQUAL)),
        ("elliptic friction", "isotropic", "0.2 and 0.5", false, free(), with_friction([0.2, 0.5])),
        ("friction", "none", "isotropic, 0.2", false, with_friction([0.0, 0.0]), free()),
        ("self-contact", "none", "links that stay apart", true, with_robot(hollow), free()),
        ("joint limits", "none", "a right angle, never met", true, with_robot(unlimited), free()),
        ("joint limits", "a right angle", "0.79 rad, near, never met", true, free(), with_robot(limited(0.79))),
        ("joint limits", "a right angle", "0.65 rad, met", false, free(), with_robot(limited(0.65))),
        ("torque limit", "none", "1e9 N m, never reached", true, free(), with_limit(free(), 1e9)),
        ("torque limit", "none", "10 N m, on the course", false, course(), with_limit(course(), 10.0)),
    ];
    for (feature, off, on, idle, without, with) in rows {
        progress(&format!("skip: {feature}, {on}"));
        let (mut without, mut with) = (TimedFleet::new(&without)?, TimedFleet::new(&with)?);
        let pairs = pairs(rounds, || without.us_per_step(), || with.us_per_step());
        emit("skip", &Comparison::of(feature, off, on, idle, step, &pairs));
    }
    Ok(())
}

/// The same in the 3D model.
fn in_space(rounds: usize) -> Result<(), ConfigError> {
    let with = |mut scenario: SpatialScenario, obstacle: Obstacle| {
        scenario.scene.obstacles.push(obstacle);
        scenario
    };
    let solid = RobotConfig::default();
    let hollow = || RobotConfig { self_contact: Some(false), ..solid.clone() };
    let limited = |limit: f64| RobotConfig { joint_limit: Some(limit.into()), ..solid.clone() };
    let step = |height| Obstacle { height: Some(height), ..far_wall() };
    let (course, winding) = (spatial::course, spatial::sidewinding);
    let among_pegs = || with(course(), FAR_PEG.into());
    let rows = [
        (
            "3D: self-contact",
            "none",
            "links that stay apart",
            true,
            SpatialScenario { robot: hollow(), ..course() },
            course(),
        ),
        (
            "3D: joint limits",
            "none",
            "a right angle, never met",
            true,
            SpatialScenario { robot: limited(f64::INFINITY), ..course() },
            course(),
        ),
        (
            "3D: joint limits",
            "a right angle",
            "0.79 rad, near, never met",
            true,
            course(),
            SpatialScenario { robot: limited(0.79), ..course() },
        ),
        (
            "3D: joint limits",
            "a right angle",
            "0.65 rad, met",
            false,
            course(),
            SpatialScenario { robot: limited(0.65), ..course() },
        ),
        ("3D: pegs", "none", "one, 100 m away", true, winding(), with(winding(), FAR_PEG.into())),
        ("3D: walls", "a peg more, 100 m away", "a wall there", true, among_pegs(), with(course(), far_wall())),
        (
            "3D: friction at obstacles",
            "smooth peg, 100 m away",
            "rough one",
            true,
            among_pegs(),
            with(course(), rough(FAR_PEG)),
        ),
        (
            "3D: finite height",
            "a wall, 100 m away",
            "a step there",
            true,
            with(course(), far_wall()),
            with(course(), step(0.1)),
        ),
    ];
    for (feature, off, on, idle, without, with) in rows {
        progress(&format!("skip: {feature}, {on}"));
        let (mut without, mut with) = (TimedFleet::new(&without)?, TimedFleet::new(&with)?);
        let pairs = pairs(rounds, || without.us_per_step(), || with.us_per_step());
        emit("skip", &Comparison::of(feature, off, on, idle, "step", &pairs));
    }
    Ok(())
}

/// Robots that rock in postures which press more and more links on each other.
#[derive(Serialize)]
struct PressedLinks {
    /// Mean angle of the joints \[rad\].
    bend: f64,
    /// Pairs of links that press on each other, mean over robots and time.
    pairs: f64,
    /// CPU time of a step and of a linear solve \[us\], medians, and the solves of a step.
    us_step: f64,
    us_solve: f64,
    solves: f64,
}

fn pressed_links(rounds: usize) -> Result<(), ConfigError> {
    for bend in BENDS {
        progress(&format!("skip: pressed links, joints at {bend} rad"));
        let mut fleet = TimedFleet::coiled(bend)?;
        let windows: Vec<_> = (0..rounds).map(|_| fleet.window()).collect();
        let us = |count: fn(&Window) -> f64| {
            median(&windows.iter().map(|window| 1e6 * window.spent.cpu / count(window)).collect::<Vec<f64>>())
        };
        let record = PressedLinks {
            bend,
            pairs: fleet.pressed_pairs(),
            us_step: us(|window| window.steps),
            us_solve: us(|window| window.iterations),
            solves: windows[0].iterations / windows[0].steps,
        };
        emit("pressed", &record);
    }
    Ok(())
}

/// Mean angles of the joints: from open arcs to coils of more than a turn \[rad\].
const BENDS: [f64; 5] = [0.3, 0.66, 1.1, 1.3, 1.5];

fn environment(rounds: usize) -> Result<(), ConfigError> {
    let blind = |config: &EnvConfig| EnvConfig { perception: Perception::Blind, ..config.clone() };
    let [(_, course), (_, free)] = [Task::COURSE, Task::FREE].map(of_id);
    let keen = EnvConfig { nearest_pegs: 64, ..course.clone() };
    let rows = [
        ("no pegs to see, SnakeFree-v1", true, blind(&free), free),
        ("5 nearest pegs, SnakeCourse-v1", false, blind(&course), course.clone()),
        ("64 nearest pegs, SnakeCourse-v1", false, blind(&course), keen),
    ];
    for (on, idle, without, with) in rows {
        progress(&format!("skip: peg sensor, {on}"));
        compare_environments(rounds, "peg sensor", "blind", on, idle, [&without, &with])?;
    }
    let hollow = RobotConfig { self_contact: Some(false), ..RobotConfig::default() };
    for task in [Task::FREE, Task::FIELD, Task::COURSE] {
        let (id, with) = of_id(task);
        let without = EnvConfig { robot: hollow.clone(), ..with.clone() };
        progress(&format!("skip: self-contact, {id}"));
        compare_environments(rounds, "self-contact", "none", &format!("{id}, random gaits"), false, [&without, &with])?;
    }
    Ok(())
}

/// Times environments without and with a feature.
fn compare_environments(
    rounds: usize,
    feature: &str,
    off: &str,
    on: &str,
    idle: bool,
    [without, with]: [&EnvConfig; 2],
) -> Result<(), ConfigError> {
    let (mut without, mut with) = (company(without)?, company(with)?);
    let pairs = pairs(rounds, || us_per_env_step(&mut without), || us_per_env_step(&mut with));
    emit("skip", &Comparison::of(feature, off, on, idle, "env step", &pairs));
    Ok(())
}

fn rough(peg: Peg) -> Obstacle {
    Obstacle { friction: 0.3, ..peg.into() }
}

fn far_wall() -> Obstacle {
    Obstacle::endless(Shape::Segment { start: [100.0, -1.0], end: [100.0, 1.0] })
}

const FAR_PEG: Peg = Peg { radius: 0.1, x: 100.0, y: 0.0 };
const NEARLY_EQUAL: [f64; 2] = [0.2, 0.2 + 1e-12];

/// A ring of pegs around the robot, the nearest 5 m away.
fn far_field() -> Vec<Peg> {
    let place = |k: i32| (5.0 + 0.005 * f64::from(k), 0.61 * f64::from(k));
    (0..1000).map(place).map(|(r, angle)| Peg { radius: 0.1, x: r * angle.cos(), y: r * angle.sin() }).collect()
}

/// Environments in motion on one thread.
fn company(config: &EnvConfig) -> Result<Robots, ConfigError> {
    let pool = pool::<PlanarRobot>(config, Actions::Gait)?;
    Robots::in_motion(config, ROBOTS, 1, Actions::Gait, &pool)
}

fn us_per_env_step(robots: &mut Robots) -> f64 {
    const STEPS: usize = 10;
    let ((), spent) = spent(|| (0..STEPS).for_each(|_| robots.step()));
    1e6 * spent.cpu / (STEPS * ROBOTS) as f64
}

/// Values of both, measured in turn; the order changes so that neither always comes first.
fn pairs(rounds: usize, mut off: impl FnMut() -> f64, mut on: impl FnMut() -> f64) -> Vec<[f64; 2]> {
    off();
    on();
    let mut round = |k: usize| {
        if k.is_multiple_of(2) {
            let first = off();
            [first, on()]
        } else {
            let first = on();
            [off(), first]
        }
    };
    (0..rounds).map(&mut round).collect()
}

impl<'a> Comparison<'a> {
    fn of(feature: &'a str, off: &'a str, on: &'a str, idle: bool, unit: &'a str, pairs: &[[f64; 2]]) -> Self {
        let mut ratios: Vec<f64> = pairs.iter().map(|[off, on]| on / off).collect();
        ratios.sort_by(f64::total_cmp);
        let column = |k: usize| pairs.iter().map(|pair| pair[k]).collect::<Vec<f64>>();
        Self {
            feature,
            off,
            on,
            idle,
            unit,
            us_off: median(&column(0)),
            us_on: median(&column(1)),
            ratio: median(&ratios),
            ratio_low: ratios[ratios.len() / 4],
            ratio_high: ratios[3 * ratios.len() / 4],
            repetitions: pairs.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Sampled;
    use snake_core::planar::Fleet;
    use snake_core::stepping::ImplicitConfig;

    #[test]
    fn features_that_cannot_act_do_not_change_the_motion() {
        let free = aiko("free", "", &[], [0.2, 0.2], START_FREE);
        let mut among_far_pegs = free.clone();
        among_far_pegs.scene.obstacles = far_field().into_iter().map(Into::into).collect();
        let elliptic = aiko("free", "", &[], NEARLY_EQUAL, START_FREE);
        let [alone, far, nearly] = [free, among_far_pegs, elliptic].map(|scenario| {
            let system = scenario.system().unwrap();
            let mut robot = scenario.at_start(&system);
            Fleet::new(ImplicitConfig::default(), &system, 1).advance(&system, [robot.driven()], 5.0);
            robot.body.state.clone()
        });
        assert_eq!(alone, far);
        let apart = alone.pose.iter().zip(&nearly.pose).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-5, "{apart:e} m");
    }

    #[test]
    fn a_ratio_is_the_median_of_pairs_whatever_their_order() {
        let mut order = Vec::new();
        let calls = std::cell::RefCell::new(&mut order);
        let pairs = pairs(
            4,
            || {
                calls.borrow_mut().push("off");
                2.0
            },
            || {
                calls.borrow_mut().push("on");
                3.0
            },
        );
        let row = Comparison::of("f", "a", "b", false, "step", &pairs);
        assert_eq!((row.ratio, row.us_off, row.us_on), (1.5, 2.0, 3.0));
        assert_eq!(order[2..], ["off", "on", "on", "off", "off", "on", "on", "off"]);
    }
}
