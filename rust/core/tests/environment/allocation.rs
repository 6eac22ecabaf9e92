//! A step allocates nothing.

use snake_core::environment::{
    ActionMode, EnvConfig, Environment, ModelKind, PlanarRobot, RobotModel, SpatialRobot, Task,
};

use snake_test_support::allocation::REQUESTS;

#[test]
fn stepping_an_environment_does_not_allocate() {
    let modes =
        [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques];
    for (task, action_mode) in Task::ALL.into_iter().flat_map(|task| modes.map(|mode| (task, mode))) {
        let config = EnvConfig { task, action_mode, ..EnvConfig::default() };
        if task.family().model == ModelKind::Planar {
            step_without_allocating::<PlanarRobot>(&config, STEPS / 6);
        }
        // In 3D a robot that falls off its pole, or curls up, has ever more contacts until the end.
        let curls_up =
            action_mode == ActionMode::Torques || (task, action_mode) == (Task::PIPE, ActionMode::Velocities);
        let reserving = if task == Task::CLIMB || curls_up { STEPS } else { STEPS / 6 };
        step_without_allocating::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..config }, reserving);
    }
    let named = ["accelerometer", "gyro", "motor_torque", "touch", "touch_side", "range"].map(String::from);
    let config = EnvConfig { task: Task::COURSE, observation_blocks: Some(named.to_vec()), ..EnvConfig::default() };
    step_without_allocating::<PlanarRobot>(&config, STEPS / 6);
    step_without_allocating::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..config }, STEPS / 6);
}

/// The first `reserving` steps may reserve workspace that the rest re-uses, as those after a restored state do.
fn step_without_allocating<M: RobotModel>(config: &EnvConfig, reserving: usize) {
    let mut environment = Environment::<M>::new(config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    let action = vec![0.2; environment.action_size()];
    environment.reset(Some(1), &mut observation);
    let start = environment.save();
    let mut requests = |environment: &mut Environment<M>, steps| {
        let before = REQUESTS.get();
        for _ in 0..steps {
            environment.step(&action, &mut observation);
        }
        REQUESTS.get() - before
    };
    requests(&mut environment, reserving);
    let later = requests(&mut environment, STEPS - reserving);
    environment.restore(&start).unwrap();
    let restored = requests(&mut environment, STEPS);
    assert_eq!((later, restored), (0, 0), "{:?}, {:?}, {:?}", M::KIND, config.task, config.action_mode);
}

/// Control periods of a run.
const STEPS: usize = 120;
