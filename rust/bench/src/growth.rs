//! How cost grows with links, with pegs in the field, and with robots and threads.

use serde::Serialize;
use snake_core::ConfigError;
use snake_core::control::ControllerConfig;
use snake_core::environment::perception::{LinkPose, PegSensor, Surroundings};
use snake_core::environment::{EnvConfig, FieldKind, PlanarRobot, RobotModel, SpatialRobot, Task};
use snake_core::gait::{Reference, Wave};
use snake_core::obstacles::ObstacleGrid;
use snake_core::planar::{Fleet, PlanarSystem};
use snake_core::robot::RobotConfig;
use snake_core::scene::{Peg, START_7_5, START_FREE, TABLE_7_5};
use snake_core::stepping::{ImplicitConfig, widest_lanes};

use crate::clock::{Spent, median, spent, spent_by_all};
use crate::environments::{Actions, Robots, of_id, pool, spatial_env};
use crate::fleet::{ROBOTS, Window, staggered, time_window};
use crate::reference::{RobotOf, Sampled};
use crate::report::{emit, progress};
use crate::scenes::{self, Scenario};

const LINKS: [usize; 5] = [11, 25, 50, 100, 200];
const PEGS: [usize; 4] = [10, 100, 1_000, 10_000];
const BATCHES: [usize; 8] = [1, 8, 16, 64, 256, 1_024, 4_096, 16_384];
/// Robots of the 3D model cost ten times as much; beyond this number a row costs what it costs at this number.
const MOST_SPATIAL: usize = 1_024;
const QUICK_BATCHES: [usize; 3] = [1, 64, 1_024];
/// The size at which all environments and actions are compared.
const COMPARED: usize = 256;
const THREADS: [usize; 2] = [1, 2];

/// Measures all three kinds of growth and emits every point.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure(quick: bool) -> Result<(), ConfigError> {
    let links = if quick { &LINKS[..3] } else { &LINKS[..] };
    let rounds = if quick { 3 } else { 9 };
    with_links(links, rounds)?;
    with_pegs(rounds)?;
    with_batch(quick)
}

/// Cost of a fleet of one robot size or field size.
#[derive(Serialize)]
struct FleetPoint<'a> {
    axis: &'a str,
    scene: &'a str,
    links: usize,
    pegs: usize,
    robots: usize,
    /// CPU time of one step of one robot \[us\], median of the repetitions.
    us_per_step: f64,
    us_per_link: f64,
    /// What the cost of a step depends on: linear solves, and the parts of steps retaken, over steps.
    iterations_per_step: f64,
    events_per_step: f64,
    /// CPU time in which the leading link looks once for its nearest pegs \[us\]; only where pegs are counted.
    us_per_look: Option<f64>,
    repetitions: usize,
}

/// A fleet that is timed over and over.
struct TimedFleet {
    scenario: Scenario,
    system: PlanarSystem,
    fleet: Fleet,
    robots: Vec<RobotOf<Scenario>>,
    windows: Vec<Window>,
}

impl TimedFleet {
    fn new(scenario: Scenario) -> Result<Self, ConfigError> {
        progress(&format!("growth: {} links, {} pegs", scenario.robot.links, scenario.scene.obstacles.len()));
        let system = scenario.system()?;
        let robots = staggered(&scenario, &system, ROBOTS);
        let fleet = Fleet::new(ImplicitConfig::default(), &system, ROBOTS);
        Ok(Self { scenario, system, fleet, robots, windows: Vec::new() })
    }

    fn repeat(&mut self) {
        self.windows.push(time_window(&self.system, &mut self.fleet, &self.robots));
    }

    fn point<'a>(&'a self, axis: &'a str, us_per_look: Option<f64>) -> FleetPoint<'a> {
        let cpu: Vec<f64> = self.windows.iter().map(|window| window.spent.cpu).collect();
        let Window { steps, iterations, events, .. } = self.windows[0];
        let us_per_step = 1e6 * median(&cpu) / steps;
        FleetPoint {
            axis,
            scene: self.scenario.name,
            links: self.scenario.robot.links,
            pegs: self.scenario.scene.obstacles.len(),
            robots: ROBOTS,
            us_per_step,
            us_per_link: us_per_step / self.scenario.robot.links as f64,
            iterations_per_step: iterations / steps,
            events_per_step: events / steps,
            us_per_look,
            repetitions: self.windows.len(),
        }
    }
}

/// Times all fleets in turn.
fn take_turns(fleets: &mut [TimedFleet], rounds: usize) {
    for _ in 0..rounds {
        fleets.iter_mut().for_each(TimedFleet::repeat);
    }
}

/// The same gait with more links, free and threaded through a track of pegs along the whole body.
fn with_links(links: &[usize], rounds: usize) -> Result<(), ConfigError> {
    let mut fleets = Vec::new();
    for &n in links {
        fleets.push(TimedFleet::new(long_free(n))?);
        fleets.push(TimedFleet::new(long_track(n)?)?);
    }
    take_turns(&mut fleets, rounds);
    fleets.iter().for_each(|fleet| emit("growth", &fleet.point("links", None)));
    Ok(())
}

fn long_free(links: usize) -> Scenario {
    let aiko = scenes::aiko("free", "free, isotropic ground", &[], [0.2, 0.2], START_FREE);
    let joint_angle = (0..links - 1).map(|joint| Wave::default().target(joint, 0.0).angle).collect();
    Scenario { robot: RobotConfig { links, ..RobotConfig::default() }, joint_angle, ..aiko }
}

fn long_track(links: usize) -> Result<Scenario, ConfigError> {
    let config = EnvConfig {
        task: Task::FIELD,
        field: FieldKind::Track,
        difficulty: 0.0,
        robot: RobotConfig { links, ..RobotConfig::default() },
        controller: ControllerConfig::default(),
        ..EnvConfig::default()
    };
    scenes::of_environment("track", "regular track of pegs", &config, 0)
}

/// The course of (T Table 7.5) in a field of more and more pegs, none of them within reach.
fn with_pegs(rounds: usize) -> Result<(), ConfigError> {
    let mut fleets = Vec::new();
    for count in PEGS {
        let mut scenario = scenes::aiko("course-7.5", "course in a field", &[], [0.2, 0.2], START_7_5);
        scenario.scene.obstacles = course_in_a_field(count).into_iter().map(Into::into).collect();
        fleets.push(TimedFleet::new(scenario)?);
    }
    take_turns(&mut fleets, rounds);
    for fleet in &fleets {
        let look = us_per_look(&ObstacleGrid::of(&fleet.scenario.scene.obstacles));
        emit("growth", &fleet.point("pegs", Some(look)));
    }
    Ok(())
}

/// `count` pegs: the course, and the points of a lattice nearest to it but out of the robot's reach.
fn course_in_a_field(count: usize) -> Vec<Peg> {
    const PITCH: f64 = 0.4;
    let side = (count as f64).sqrt() as i32 / 2 + 8;
    let mut around: Vec<Peg> = (-side..=side)
        .flat_map(|i| (-side..=side).map(move |j| (f64::from(i) * PITCH, f64::from(j) * PITCH)))
        .map(|(x, y)| Peg { radius: 0.125, x: 1.1 + x, y: 0.09 + y })
        .filter(|peg| (peg.x - 1.1).abs() > 2.5 || (peg.y - 0.09).abs() > 1.0)
        .collect();
    around.sort_by(|a, b| (a.x - 1.1).hypot(a.y).total_cmp(&(b.x - 1.1).hypot(b.y)));
    TABLE_7_5.iter().map(|&peg| Peg::from(peg)).chain(around).take(count).collect()
}

/// Median CPU time of one look around \[us\].
fn us_per_look(pegs: &ObstacleGrid) -> f64 {
    const LOOKS: usize = 200;
    let mut sensor = PegSensor::new(EnvConfig::default().nearest_pegs, 1.342);
    let [x, y, angle] = START_7_5;
    let pose = LinkPose { x, y, angle };
    let times: Vec<f64> = (0..9)
        .map(|_| {
            spent(|| {
                (0..LOOKS)
                    .for_each(|_| sensor.scan(std::hint::black_box(&pose), &Surroundings::fixed(pegs, pegs.walls())))
            })
            .1
            .cpu
        })
        .collect();
    1e6 * median(&times) / LOOKS as f64
}

/// Throughput of one batch size.
#[derive(Serialize)]
struct BatchPoint<'a> {
    axis: &'a str,
    env: &'a str,
    actions: &'a str,
    robots: usize,
    threads: usize,
    /// Environment steps per second of wall time in the fastest repetition, which other work on the machine disturbs
    /// least, and in the slowest.
    steps_per_second: f64,
    slowest: f64,
    /// Environment steps per second of CPU time of all threads together, fastest repetition.
    steps_per_cpu_second: f64,
    /// CPU time over wall time and threads: 1 when no thread is ever idle.
    utilisation: f64,
    repetitions: usize,
}

fn with_batch(quick: bool) -> Result<(), ConfigError> {
    let batches = if quick { &QUICK_BATCHES[..] } else { &BATCHES[..] };
    for task in [Task::COURSE, Task::FIELD] {
        let (env, config) = of_id(task);
        with_robots::<PlanarRobot>(env, &config, batches, quick)?;
    }
    for task in [Task::FREE, Task::CORRIDOR] {
        let (env, config) = of_id(task);
        with_robots::<PlanarRobot>(env, &config, &[COMPARED], quick)?;
    }
    let (env, config) = spatial_env();
    let few = batches.partition_point(|&rows| rows <= MOST_SPATIAL);
    with_robots::<SpatialRobot>(env, &config, &batches[..few], quick)
}

fn with_robots<M: RobotModel>(
    env: &str,
    config: &EnvConfig,
    batches: &[usize],
    quick: bool,
) -> Result<(), ConfigError> {
    let (rounds, seconds) = repetitions(quick);
    for actions in Actions::ALL {
        let config = actions.configure(config);
        let pool = pool::<M>(&config, actions)?;
        let compared = [COMPARED];
        let sizes = if actions == Actions::RandomJoints { &compared } else { batches };
        progress(&format!("growth: {env}, {}, {sizes:?} robots", actions.name()));
        let mut timed = Vec::new();
        for (&rows, threads) in sizes.iter().flat_map(|rows| THREADS.map(|threads| (rows, threads))) {
            timed.push(TimedBatch::new(Robots::<M>::in_motion(&config, rows, threads, actions, &pool)?));
        }
        // All sizes in turns: a machine is not equally busy from minute to minute.
        for _ in 0..rounds {
            timed.iter_mut().for_each(|batch| batch.repeat(seconds));
        }
        timed.iter().for_each(|batch| emit("growth", &batch.point(env, actions)));
    }
    Ok(())
}

/// Throughput in registers of one width.
#[derive(Serialize)]
struct WidthPoint<'a> {
    env: &'a str,
    actions: &'a str,
    /// Robots per register.
    lanes: usize,
    robots: usize,
    steps_per_cpu_second: f64,
}

/// Measures environments in registers of the width that this process uses: that of the processor, or of the variable
/// `SNAKE_ENV_LANES`.
///
/// # Errors
/// A configuration is not admissible.
pub fn measure_width(quick: bool) -> Result<(), ConfigError> {
    for task in [Task::COURSE, Task::FIELD] {
        let (env, config) = of_id(task);
        in_registers::<PlanarRobot>(env, &config, quick)?;
    }
    let (env, config) = spatial_env();
    in_registers::<SpatialRobot>(env, &config, quick)
}

fn in_registers<M: RobotModel>(env: &str, config: &EnvConfig, quick: bool) -> Result<(), ConfigError> {
    let (rounds, seconds) = repetitions(quick);
    for actions in [Actions::Gait, Actions::Random] {
        let lanes = widest_lanes(COMPARED);
        progress(&format!("widths: {env}, {}, {lanes} robots per register", actions.name()));
        let pool = pool::<M>(config, actions)?;
        let mut batch = TimedBatch::new(Robots::<M>::in_motion(config, COMPARED, 1, actions, &pool)?);
        (0..rounds).for_each(|_| batch.repeat(seconds));
        let BatchPoint { actions, robots, steps_per_cpu_second, .. } = batch.point(env, actions);
        emit("width", &WidthPoint { env, actions, lanes, robots, steps_per_cpu_second });
    }
    Ok(())
}

/// Number of repetitions, and the length of one \[s\].
fn repetitions(quick: bool) -> (usize, f64) {
    if quick { (3, 0.1) } else { (5, 0.3) }
}

fn fastest(rates: &[f64]) -> f64 {
    rates.iter().copied().fold(0.0, f64::max)
}

/// A batch that is timed over and over.
struct TimedBatch<M: RobotModel> {
    robots: Robots<M>,
    /// Steps of all rows together, and the time they took.
    repetitions: Vec<(f64, Spent)>,
}

impl<M: RobotModel> TimedBatch<M> {
    /// The first step, which touches memory for the first time, is not measured.
    fn new(mut robots: Robots<M>) -> Self {
        robots.step();
        Self { robots, repetitions: Vec::new() }
    }

    /// Steps for about `seconds`, and at least once.
    fn repeat(&mut self, seconds: f64) {
        let start = std::time::Instant::now();
        let (steps, spent) = spent_by_all(|| {
            let mut steps = 0;
            while steps == 0 || start.elapsed().as_secs_f64() < seconds {
                self.robots.step();
                steps += self.robots.batch.num_envs();
            }
            steps as f64
        });
        self.repetitions.push((steps, spent));
    }

    fn point<'a>(&self, env: &'a str, actions: Actions) -> BatchPoint<'a> {
        let threads = self.robots.batch.num_threads();
        let each = |value: fn(&(f64, Spent)) -> f64| self.repetitions.iter().map(value).collect::<Vec<f64>>();
        let rates = each(|(steps, spent)| steps / spent.wall);
        BatchPoint {
            axis: "batch",
            env,
            actions: actions.name(),
            robots: self.robots.batch.num_envs(),
            threads,
            steps_per_second: fastest(&rates),
            slowest: rates.iter().copied().fold(f64::INFINITY, f64::min),
            steps_per_cpu_second: fastest(&each(|(steps, spent)| steps / spent.cpu)),
            utilisation: median(&each(|(_, spent)| spent.cpu / spent.wall)) / threads as f64,
            repetitions: self.repetitions.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use snake_core::stepping::ImplicitConfig;

    #[test]
    fn fields_have_as_many_pegs_as_asked_for_and_the_new_ones_are_out_of_reach() {
        let few = scenes::aiko("few", "", &TABLE_7_5, [0.2, 0.2], START_7_5);
        for count in PEGS {
            let pegs = course_in_a_field(count);
            assert_eq!(pegs.len(), count);
            let mut many = few.clone();
            many.scene.obstacles = pegs.into_iter().map(Into::into).collect();
            let ends = [&few, &many].map(|scenario| {
                let system = scenario.system().unwrap();
                let mut robot = scenario.at_start(&system);
                Fleet::new(ImplicitConfig::default(), &system, 1).advance(&system, [robot.driven()], 10.0);
                robot.body.state.pose.clone()
            });
            let distance = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(distance < 1e-12, "{count} pegs: {distance:e} m");
        }
    }

    #[test]
    fn a_long_robot_starts_free_of_the_pegs_along_its_whole_body() {
        let scenario = long_track(60).unwrap();
        let simulation = scenario.simulation(&ImplicitConfig::default()).unwrap();
        assert!(simulation.min_gap() > 0.0 && scenario.scene.obstacles.len() > 60);
    }
}
