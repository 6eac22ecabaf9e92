//! Environments under random actions.

use snake_core::batch::{Batch, Outputs};
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, FieldKind, ModelKind, RobotModel, Task, World};
use snake_core::obstacles::{Obstacle, ObstacleGrid, Shape};
use snake_core::scene::SceneConfig;
use snake_core::stepping::{ImplicitConfig, Model};

use crate::figures::Figures;
use crate::geometry::{Surroundings, capsules, gap_to_stops};
use crate::observable::Observable;

/// One kind of environment.
#[derive(Debug, Clone, PartialEq)]
pub struct Kind {
    pub name: String,
    pub config: EnvConfig,
}

/// The tasks and a room of walls in an action mode, all else by default.
pub fn everywhere(mode: ActionMode) -> Vec<Kind> {
    let planar = |(name, config)| (name, EnvConfig { action_mode: mode, ..config });
    let mut places = vec![("course", of_task(Task::COURSE, 0.5))];
    places.extend(
        [("field 0", 0.0), ("field 0.5", 0.5), ("field 1", 1.0)].map(|(name, d)| (name, of_task(Task::FIELD, d))),
    );
    places.extend(elsewhere(ModelKind::Planar));
    places.into_iter().map(planar).map(Kind::new).collect()
}

/// The same of the 3D model.
pub fn everywhere_in_space(mode: ActionMode) -> Vec<Kind> {
    let spatial = |(name, config)| (name, EnvConfig { action_mode: mode, model: ModelKind::Spatial, ..config });
    let mut places = vec![("free", of_task(Task::FREE, 0.5)), ("course", of_task(Task::COURSE, 0.5))];
    places.push(("field", of_task(Task::FIELD, 1.0)));
    places.extend(elsewhere(ModelKind::Spatial));
    places.into_iter().map(spatial).map(Kind::new).collect()
}

/// A room with a rough box in every action mode.
pub fn rough_rooms(model: ModelKind) -> Vec<Kind> {
    let modes =
        [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques];
    let rough = |mode| {
        let config = EnvConfig { scene: Some(room(model, 0.3)), ..of_task(Task::FREE, 0.5) };
        Kind::new(("rough room", EnvConfig { action_mode: mode, model, ..config }))
    };
    modes.map(rough).into()
}

fn elsewhere(model: ModelKind) -> [(&'static str, EnvConfig); 4] {
    [
        ("perturbed", of_task(Task::PERTURBED, 1.0)),
        ("maze", of_task(Task::MAZE, 0.5)),
        ("corridor", of_task(Task::CORRIDOR, 0.5)),
        ("walls", EnvConfig { scene: Some(room(model, 0.0)), ..of_task(Task::FREE, 0.5) }),
    ]
}

fn of_task(task: Task, difficulty: f64) -> EnvConfig {
    EnvConfig { task, difficulty, ..EnvConfig::default() }
}

/// Walls and corners, two boxes, one of them of this friction, and a peg around the robot, which lies along x in the plane and
/// along y in 3D.
fn room(model: ModelKind, friction: f64) -> SceneConfig {
    let at = |[x, y]: [f64; 2]| if model == ModelKind::Planar { [x, y] } else { [y, x] };
    let wall = |start, end| Shape::Segment { start: at(start), end: at(end) };
    let square = |size, centre, angle| {
        let [x, y] = at(centre);
        Shape::Box { size: at(size), x, y, angle }
    };
    let [x, y] = at([0.8, -0.1]);
    let shapes = [
        wall([-2.2, -0.35], [1.6, -0.35]),
        wall([-2.2, 0.35], [0.9, 0.35]),
        // With the first, a corner of 45 degrees.
        wall([0.9, 0.35], [1.6, -0.35]),
        wall([-2.2, -0.35], [-2.2, 0.35]),
        square([0.2, 0.2], [0.35, 0.3], 0.5),
        Shape::Polygon { vertices: [[0.2, -0.35], [0.5, -0.35], [0.35, -0.2]].map(at).to_vec() },
        Shape::Circle([0.1, x, y].into()),
    ];
    let rough = Obstacle { friction, ..Obstacle::endless(square([0.6, 0.05], [-1.7, 0.1], 0.3)) };
    let obstacles = shapes.map(Obstacle::endless).into_iter().chain([rough]).collect();
    SceneConfig { obstacles, friction: [0.2, 0.5], ..SceneConfig::default() }
}

/// Every field, from mild to wild, at fine and coarse steps.
pub fn step_lengths() -> Vec<Kind> {
    let mut kinds = Vec::new();
    for mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual] {
        for field in [FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson] {
            for (difficulty, step, tolerance) in [(0.0, 0.01, 1e-8), (1.0, 0.05, 1e-6), (1.0, 0.05, 1e-8)] {
                let config = EnvConfig { action_mode: mode, field, ..of_task(Task::FIELD, difficulty) };
                kinds.push(Kind::stepped(config, step, tolerance));
            }
        }
    }
    kinds
}

/// The same of the 3D model, and its other tasks.
pub fn step_lengths_in_space() -> Vec<Kind> {
    let mut kinds = Vec::new();
    for mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual] {
        for (task, field) in [
            (Task::FREE, FieldKind::Track),
            (Task::COURSE, FieldKind::Track),
            (Task::MAZE, FieldKind::Track),
            (Task::FIELD, FieldKind::Track),
            (Task::FIELD, FieldKind::Lattice),
            (Task::FIELD, FieldKind::Poisson),
        ] {
            for (difficulty, step) in [(0.0, 0.01), (1.0, 0.025)] {
                let model = ModelKind::Spatial;
                let config = EnvConfig { model, action_mode: mode, field, ..of_task(task, difficulty) };
                kinds.push(Kind::stepped(config, step, 1e-5));
            }
        }
    }
    kinds
}

impl Kind {
    fn new((place, config): (&str, EnvConfig)) -> Self {
        Self { name: format!("{:?}, {place}", config.action_mode), config }
    }

    fn stepped(config: EnvConfig, step: f64, tolerance: f64) -> Self {
        let EnvConfig { task, action_mode, field, difficulty, .. } = &config;
        let name = format!("{action_mode:?}, {task:?} {field:?} {difficulty}, h {step} s, tolerance {tolerance:e}");
        let integrator = ImplicitConfig { step: Some(step), tolerance: Some(tolerance), ..ImplicitConfig::default() };
        Self { name, config: EnvConfig { integrator, ..config } }
    }
}

/// Takes `steps` environment steps, batch by batch, with random actions.
pub fn random_steps<M: RobotModel<Model: Observable>>(config: &EnvConfig, steps: u64, seed: u64) -> Figures {
    let mut run = Run::<M>::new(config, seed);
    for _ in 0..steps.div_ceil(ROWS as u64) {
        run.step();
    }
    run.figures
}

struct Run<M: RobotModel<Model: Observable>> {
    /// Step of the integrator \[s\].
    step: f64,
    /// Control periods so far.
    periods: usize,
    /// Obstacles of every episode, unless the task draws them.
    room: Option<Vec<Obstacle>>,
    batch: Batch<M>,
    random: Rng,
    actions: Vec<f64>,
    observation: Vec<f32>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    signals: Vec<f64>,
    /// Poses at the end of the last part of a step, and obstacles, of every row.
    poses: Vec<Vec<<M::Model as Model>::Pose>>,
    surroundings: Vec<Surroundings>,
    figures: Figures,
}

impl<M: RobotModel<Model: Observable>> Run<M> {
    fn new(config: &EnvConfig, seed: u64) -> Self {
        let batch = Batch::<M>::new(config, ROWS, 1).expect("an admissible environment");
        let mut run = Self {
            step: config.integrator.step(),
            periods: 0,
            room: config.scene.as_ref().map(|scene| scene.obstacles.clone()),
            actions: vec![0.0; ROWS * batch.action_size()],
            observation: vec![0.0; ROWS * batch.observation_size()],
            reward: vec![0.0; ROWS],
            terminated: vec![false; ROWS],
            truncated: vec![false; ROWS],
            signals: vec![0.0; batch.signals().len() * ROWS],
            poses: vec![Vec::new(); ROWS],
            surroundings: vec![Surroundings::default(); ROWS],
            random: Rng::new(seed, u64::MAX),
            figures: Figures::default(),
            batch,
        };
        (0..ROWS).for_each(|row| run.batch.keep_path(row));
        let seeds: Vec<Option<u64>> = (0..ROWS as u64).map(|row| Some(seed * 1_000_003 + row)).collect();
        run.reset(&[true; ROWS], &seeds);
        run
    }

    fn step(&mut self) {
        self.draw_actions();
        let Self { batch, actions, observation, reward, terminated, truncated, signals, .. } = self;
        batch.step(actions, &[true; ROWS], Outputs { observation, reward, terminated, truncated, signals });
        self.record();
        let done: Vec<bool> = self.terminated.iter().zip(&self.truncated).map(|(a, b)| *a || *b).collect();
        if done.contains(&true) {
            self.reset(&done, &[None; ROWS]);
        }
        self.periods += 1;
    }

    /// Uniform actions or, as often, actions at their limits, which robots hold for different times.
    fn draw_actions(&mut self) {
        let size = self.batch.action_size();
        for (row, action) in self.actions.chunks_exact_mut(size).enumerate() {
            if self.periods.is_multiple_of(HELD[row % HELD.len()]) {
                let is_extreme = self.random.chance(0.5);
                for value in action {
                    let drawn = self.random.around_zero(1.0);
                    *value = if is_extreme { drawn.signum() } else { drawn };
                }
            }
        }
    }

    fn reset(&mut self, mask: &[bool], seeds: &[Option<u64>]) {
        let rows: Vec<usize> = (0..ROWS).filter(|&row| mask[row]).collect();
        if let Some(room) = &self.room {
            let world = World { obstacles: Some(ObstacleGrid::of(room).into()), ..World::default() };
            self.batch.set_next_worlds(&rows, vec![world; rows.len()]).expect("a room with space for the robot");
        }
        let Self { batch, observation, reward, terminated, truncated, signals, .. } = self;
        batch.reset(mask, seeds, Outputs { observation, reward, terminated, truncated, signals });
        for row in rows {
            let environment = self.batch.environment(row);
            self.surroundings[row] = Surroundings::new(&environment.obstacles());
            self.poses[row] = environment.model().simulation().state().pose.clone();
        }
    }

    fn record(&mut self) {
        let figures = &mut self.figures;
        let signal = |name: &str, row: usize| {
            let place =
                self.batch.signals().iter().position(|signal| signal.name == name).expect("a signal of this name");
            self.signals[place * ROWS + row]
        };
        figures.steps += ROWS as u64;
        for row in 0..ROWS {
            let (unconverged, residual) = (signal("unconverged", row), signal("residual", row));
            figures.unconverged += unconverged as u64;
            figures.fallbacks += signal("fallbacks", row) as u64;
            figures.iterations += signal("iterations", row) as u64;
            figures.broken += u64::from(signal("diverged", row) != 0.0);
            let is_flagged = signal("penetrated", row) + signal("diverged", row) > 0.0;
            let model = self.batch.environment(row).model();
            let (robot, simulation) = (model.robot(), model.simulation());
            let relaxed = simulation.body().statistics.relaxed;
            figures.relaxed += u64::from(relaxed);
            let is_counted = unconverged > 0.0 || relaxed > 0;
            let worst = if is_counted { &mut figures.counted_residual } else { &mut figures.residual };
            *worst = worst.max(residual);
            let (around, before) = (&self.surroundings[row], &mut self.poses[row]);
            let mut gap = f64::INFINITY;
            let mut passed = false;
            let parts = simulation.body().path.iter().flatten();
            for poses in parts.chain([simulation.state()]).map(|state| &state.pose) {
                gap = gap.min(around.gaps(&capsules(robot, poses)).least()).min(gap_to_stops(robot, poses));
                passed |= around.passed_through(robot, before, poses);
                before.copy_from_slice(poses);
            }
            figures.measure_one(simulation, gap, self.step, is_flagged);
            figures.tunnels += u64::from(!is_flagged && passed);
        }
        let finite = self.observation.iter().all(|x| x.is_finite()) && self.reward.iter().all(|x| x.is_finite());
        figures.broken += u64::from(!finite);
    }
}

/// Environments side by side.
const ROWS: usize = 32;

/// Control periods for which a random action is held; robots differ in it.
const HELD: [usize; 3] = [1, 2, 20];
