//! Environments under random actions.

use snake_core::batch::{Batch, Outputs};
use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, FieldKind, RobotModel, Task};
use snake_core::simulation::Simulation;
use snake_core::stepping::ImplicitConfig;

use crate::figures::Figures;
use crate::observable::Observable;

/// One kind of environment.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub task: Task,
    pub mode: ActionMode,
    pub field: FieldKind,
    pub difficulty: f64,
    pub step: f64,
    pub tolerance: f64,
}

/// Every action mode on every field, from mild to wild, at fine and coarse steps.
pub fn kinds() -> Vec<Kind> {
    let mut kinds = Vec::new();
    for mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual] {
        for field in [FieldKind::Track, FieldKind::Lattice, FieldKind::Poisson] {
            for (difficulty, step, tolerance) in [(0.0, 0.01, 1e-8), (1.0, 0.05, 1e-6), (1.0, 0.05, 1e-8)] {
                kinds.push(Kind { task: Task::FIELD, mode, field, difficulty, step, tolerance });
            }
        }
    }
    kinds
}

/// Every action mode of the spatial model in every task, on the fields most of all.
pub fn spatial_kinds() -> Vec<Kind> {
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
                kinds.push(Kind { task, mode, field, difficulty, step, tolerance: 1e-6 });
            }
        }
    }
    kinds
}

/// Takes `steps` environment steps, batch by batch, with uniformly random actions that change now and then.
pub fn random_steps<M: RobotModel>(kind: Kind, steps: u64, seed: u64) -> Figures
where
    Simulation<M::Model>: Observable,
{
    let Kind { task, mode, field, difficulty, step, tolerance } = kind;
    let integrator = ImplicitConfig { step: Some(step), tolerance, ..ImplicitConfig::default() }.into();
    let config = EnvConfig {
        model: M::KIND,
        task,
        action_mode: mode,
        field,
        difficulty,
        integrator,
        max_episode_steps: 200,
        ..EnvConfig::default()
    };
    let mut run = Run::<M>::new(&config, seed);
    for _ in 0..steps.div_ceil(ROWS as u64) {
        run.step();
    }
    run.figures
}

struct Run<M: RobotModel> {
    /// Step of the integrator \[s\].
    step: f64,
    batch: Batch<M>,
    random: Rng,
    actions: Vec<f64>,
    observation: Vec<f32>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    signals: Vec<f64>,
    figures: Figures,
}

impl<M: RobotModel> Run<M>
where
    Simulation<M::Model>: Observable,
{
    fn new(config: &EnvConfig, seed: u64) -> Self {
        let batch = Batch::<M>::new(config, ROWS, 1).expect("an admissible environment");
        let mut run = Self {
            step: config.integrator.step(),
            actions: vec![0.0; ROWS * batch.action_size()],
            observation: vec![0.0; ROWS * batch.observation_size()],
            reward: vec![0.0; ROWS],
            terminated: vec![false; ROWS],
            truncated: vec![false; ROWS],
            signals: vec![0.0; batch.signals().len() * ROWS],
            random: Rng::new(seed, u64::MAX),
            figures: Figures::default(),
            batch,
        };
        let seeds: Vec<Option<u64>> = (0..ROWS as u64).map(|row| Some(seed * 1_000_003 + row)).collect();
        run.reset(&[true; ROWS], &seeds);
        run
    }

    fn step(&mut self) {
        for action in &mut self.actions {
            if self.random.chance(0.3) {
                *action = self.random.uniform(-1.2, 1.2);
            }
        }
        let Self { batch, actions, observation, reward, terminated, truncated, signals, .. } = self;
        batch.step(actions, &[true; ROWS], Outputs { observation, reward, terminated, truncated, signals });
        self.record();
        let done: Vec<bool> = self.terminated.iter().zip(&self.truncated).map(|(a, b)| *a || *b).collect();
        if done.contains(&true) {
            self.reset(&done, &[None; ROWS]);
        }
    }

    fn reset(&mut self, mask: &[bool], seeds: &[Option<u64>]) {
        let Self { batch, observation, reward, terminated, truncated, signals, .. } = self;
        batch.reset(mask, seeds, Outputs { observation, reward, terminated, truncated, signals });
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
            let (unconverged, residual) = (signal("misses", row), signal("residual", row));
            figures.unconverged += unconverged as u64;
            figures.fallbacks += signal("fallbacks", row) as u64;
            figures.iterations += signal("iterations", row) as u64;
            figures.broken += u64::from(signal("diverged", row) != 0.0);
            let worst = if unconverged > 0.0 { &mut figures.counted_residual } else { &mut figures.residual };
            *worst = worst.max(residual);
            let is_flagged = signal("penetrated", row) + signal("diverged", row) > 0.0;
            figures.measure_one(self.batch.environment(row).model().simulation(), self.step, is_flagged);
        }
        let finite = self.observation.iter().all(|x| x.is_finite()) && self.reward.iter().all(|x| x.is_finite());
        figures.broken += u64::from(!finite);
    }
}

/// Environments side by side.
const ROWS: usize = 32;
