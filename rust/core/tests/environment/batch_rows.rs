//! Laws of the batch: rows are alone in the world.

use snake_core::batch::{Batch, Outputs};
use snake_core::environment::rng::Rng;
use snake_core::environment::{
    ActionMode, EnvConfig, EnvironmentState, ModelKind, PlanarRobot, RobotModel, SpatialRobot, Task,
};
use snake_core::stepping::ImplicitConfig;

/// Arrays that a batch writes to.
#[derive(Clone, PartialEq, Debug)]
struct Arrays {
    observation: Vec<f32>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    signals: Vec<f64>,
}

impl Arrays {
    fn of<M: RobotModel>(batch: &Batch<M>) -> Self {
        let n = batch.num_envs();
        Self {
            observation: vec![7.0; n * batch.observation_size()],
            reward: vec![7.0; n],
            terminated: vec![true; n],
            truncated: vec![true; n],
            signals: vec![7.0; n * batch.signals().len()],
        }
    }

    fn outputs(&mut self) -> Outputs<'_> {
        Outputs {
            observation: &mut self.observation,
            reward: &mut self.reward,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
            signals: &mut self.signals,
        }
    }

    /// Everything about one row, bits as they are.
    fn row(&self, row: usize) -> (Vec<u32>, u64, bool, bool, Vec<u64>) {
        let n = self.reward.len();
        let size = self.observation.len() / n;
        let observation = &self.observation[row * size..(row + 1) * size];
        (
            observation.iter().map(|value| value.to_bits()).collect(),
            self.reward[row].to_bits(),
            self.terminated[row],
            self.truncated[row],
            self.signals.chunks(n).map(|signal| signal[row].to_bits()).collect(),
        )
    }
}

fn short_field() -> EnvConfig {
    EnvConfig { task: Task::FIELD, max_episode_steps: 25, ..EnvConfig::default() }
}

/// The action of the row with a seed in a step: it depends on nothing else.
fn action(seed: usize, step: u64, size: usize) -> impl Iterator<Item = f64> {
    let mut stream = Rng::new(seed as u64, step);
    (0..size).map(move |_| stream.around_zero(1.2))
}

/// Rows `first..first + n` of one large imagined batch over 40 steps, resetting rows that end, and their last states.
fn trajectory<M: RobotModel>(
    config: &EnvConfig,
    first: usize,
    n: usize,
    threads: usize,
) -> (Vec<Arrays>, Vec<EnvironmentState<M::State>>) {
    let mut batch = Batch::<M>::new(config, n, threads).unwrap();
    let mut arrays = Arrays::of(&batch);
    let seeds: Vec<_> = (first..first + n).map(|seed| Some(seed as u64)).collect();
    batch.reset(&vec![true; n], &seeds, arrays.outputs());
    let mut history = vec![arrays.clone()];
    for step in 0..40 {
        let actions: Vec<f64> = (first..first + n).flat_map(|seed| action(seed, step, batch.action_size())).collect();
        batch.step(&actions, &vec![true; n], arrays.outputs());
        history.push(arrays.clone());
        let ended: Vec<bool> = arrays.terminated.iter().zip(&arrays.truncated).map(|(a, b)| *a || *b).collect();
        batch.reset(&ended, &vec![None; n], arrays.outputs());
    }
    let states = (0..n).map(|row| batch.save(row)).collect();
    (history, states)
}

fn rows_are_alone<M: RobotModel>(config: &EnvConfig) {
    let (whole, states) = trajectory::<M>(config, 0, 12, 1);
    for threads in [2, 3, 8] {
        assert!(whole == trajectory::<M>(config, 0, 12, threads).0, "{threads} threads");
    }
    for (first, n, threads) in [(0, 1, 1), (5, 1, 1), (3, 7, 2)] {
        let (part, own) = trajectory::<M>(config, first, n, threads);
        assert!(states[first..first + n] == own, "states of rows {first}..{}", first + n);
        for (whole, part) in whole.iter().zip(&part) {
            for row in 0..n {
                assert!(whole.row(first + row) == part.row(row), "rows {first}..{}, {threads} threads", first + n);
            }
        }
    }
}

#[test]
fn results_do_not_depend_on_threads_or_batch_size() {
    rows_are_alone::<PlanarRobot>(&short_field());
    // Without obstacles, robots fold here and there.
    rows_are_alone::<PlanarRobot>(&EnvConfig { task: Task::FREE, action_mode: ActionMode::Joints, ..short_field() });
}

#[test]
fn spatial_rows_do_not_depend_on_threads_or_batch_size() {
    let integrator = ImplicitConfig { step: Some(0.025), ..ImplicitConfig::default() };
    rows_are_alone::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, integrator, ..short_field() });
}

/// A path has the states within the control period, in order, and the last one is the row's; to keep it changes nothing.
#[test]
fn a_path_kept_leads_to_the_state_and_changes_nothing() {
    keeps_path::<PlanarRobot>(&short_field());
    keeps_path::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..short_field() });
}

fn keeps_path<M: RobotModel>(config: &EnvConfig) {
    let mut batches = [0, 1].map(|_| Batch::<M>::new(config, 2, 1).unwrap());
    batches[1].keep_path(0);
    let mut written = batches.each_ref().map(Arrays::of);
    let mut longest = 0;
    for step in 0..20 {
        for (batch, arrays) in batches.iter_mut().zip(&mut written) {
            let actions: Vec<f64> = [0, 1].into_iter().flat_map(|row| action(row, step, batch.action_size())).collect();
            batch.step(&actions, &[true; 2], arrays.outputs());
        }
        assert_eq!(written[0], written[1]);
        let body = |row: usize| batches[1].environment(row).model().simulation().body();
        assert!(body(1).path.is_none());
        let path = body(0).path.as_ref().expect("a path");
        longest = longest.max(path.len());
        let times: Vec<f64> = path.iter().map(|state| state.time).collect();
        assert!(times[0] > body(0).interval_start() && times.is_sorted(), "{times:?}");
        let end = path.last().expect("at least one part").clone();
        let mut state = body(0).state.clone();
        // The end of the interval is set without accumulated round-off.
        assert!((end.time - state.time).abs() < 1e-12);
        state.time = end.time;
        assert_eq!(end, state);
    }
    assert!(longest > 2, "some step is divided");
}

#[test]
fn rows_that_are_not_active_stay_untouched() {
    for threads in [1, 2] {
        let mut batch = Batch::<PlanarRobot>::new(&short_field(), 6, threads).unwrap();
        let mut arrays = Arrays::of(&batch);
        batch.reset(&[true; 6], &[Some(1); 6], arrays.outputs());
        let before = arrays.clone();
        let saved = batch.save(2);
        let active = [true, true, false, true, true, false];
        batch.step(&vec![0.4; 6 * batch.action_size()], &active, arrays.outputs());
        for (row, active) in active.iter().enumerate() {
            assert_eq!(arrays.row(row) == before.row(row), !active);
        }
        assert_eq!(batch.save(2), saved);
    }
}

#[test]
fn a_row_that_diverges_leaves_its_neighbours_alone() {
    let config = EnvConfig { task: Task::COURSE, ..EnvConfig::default() };
    diverge_in_row_three::<PlanarRobot>(&config);
    diverge_in_row_three::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..config });
}

fn diverge_in_row_three<M: RobotModel>(config: &EnvConfig) {
    let mut divergences = 0;
    for threads in [1, 2] {
        let batch = || Batch::<M>::new(config, 5, threads).unwrap();
        let (mut sick, mut sound) = (batch(), batch());
        let (mut a, mut b) = (Arrays::of(&sick), Arrays::of(&sound));
        let seeds = [0, 1, 2, 3, 4].map(Some);
        sick.reset(&[true; 5], &seeds, a.outputs());
        sound.reset(&[true; 5], &seeds, b.outputs());
        let mut state = serde_json::to_value(sick.save(3)).unwrap();
        state["model"]["simulation"]["state"]["twist"][0][2] = serde_json::json!(1e200);
        sick.restore(&[3], &[serde_json::from_value(state).unwrap()]).unwrap();
        for _ in 0..5 {
            let actions = vec![0.1; 5 * sick.action_size()];
            sick.step(&actions, &[true; 5], a.outputs());
            sound.step(&actions, &[true; 5], b.outputs());
            if a.truncated[3] {
                divergences += 1;
                sick.reset(&[false, false, false, true, false], &[None; 5], a.outputs());
            }
            for row in [0, 1, 2, 4] {
                assert!(a.row(row) == b.row(row));
            }
        }
        assert!(a.observation.iter().all(|value| value.is_finite()));
    }
    assert_eq!(divergences, 2, "one for each number of threads");
}

#[test]
fn sizes_are_checked_by_name() {
    let error = |n, threads| Batch::<PlanarRobot>::new(&short_field(), n, threads).unwrap_err().field;
    assert_eq!(error(0, 1), "num_envs");
    assert_eq!(error(1, 5000), "num_threads");
    assert!(Batch::<PlanarRobot>::new(&short_field(), 1, 0).unwrap().num_threads() >= 1);
}
