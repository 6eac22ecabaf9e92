//! How deep links may be in pegs and in each other, whatever the action.

use snake_core::environment::rng::Rng;
use snake_core::environment::{ActionMode, EnvConfig, Environment, PlanarRobot, Task};

/// Deepest overlap at the ends of random control periods, and the periods that ended with a flagged robot.
fn crawl(config: &EnvConfig, seed: u64, periods: usize) -> (f64, usize) {
    let mut environment = Environment::<PlanarRobot>::new(config).expect("a valid configuration");
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(seed), &mut observation);
    let mut stream = Rng::new(seed, 1);
    let (mut deepest, mut flagged) = (0.0_f64, 0);
    for _ in 0..periods {
        let action: Vec<f64> = (0..environment.action_size()).map(|_| stream.around_zero(1.0).signum()).collect();
        let outcome = environment.step(&action, &mut observation);
        let simulation = environment.simulation();
        deepest = deepest.max(-simulation.min_gap()).max(-simulation.self_gap());
        flagged += usize::from(environment.summary().diverged);
        if outcome.terminated || outcome.truncated {
            environment.reset(None, &mut observation);
        }
    }
    (deepest, flagged)
}

#[test]
fn no_action_pushes_links_more_than_a_millimetre_into_anything() {
    for action_mode in
        [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques]
    {
        for (seed, task) in [Task::COURSE, Task::MAZE, Task::FIELD].into_iter().enumerate() {
            let config = EnvConfig { task, action_mode, difficulty: 1.0, ..EnvConfig::default() };
            let (deepest, flagged) = crawl(&config, seed as u64, 400);
            assert!(deepest < 1e-3, "{action_mode:?} {task:?}: {deepest} m");
            assert_eq!(flagged, 0, "{action_mode:?} {task:?}");
        }
    }
}
