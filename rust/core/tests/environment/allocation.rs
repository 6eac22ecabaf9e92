//! A step allocates nothing.

use snake_core::environment::{
    ActionMode, EnvConfig, Environment, ModelKind, PlanarRobot, RobotModel, SpatialRobot, Task,
};

use snake_test_support::allocation::REQUESTS;

#[test]
fn stepping_an_environment_does_not_allocate() {
    for task in Task::ALL {
        for action_mode in [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities] {
            let config = EnvConfig { task, action_mode, ..EnvConfig::default() };
            if task.family().model == ModelKind::Planar {
                step_without_allocating::<PlanarRobot>(&config);
            }
            // A robot that falls off its pole lands with more contacts than there is room for, and so does one that curls
            // up in its pipe.
            let curls = task == Task::PIPE && action_mode == ActionMode::Velocities;
            if task != Task::CLIMB && !curls {
                step_without_allocating::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..config });
            }
        }
        if task.family().model == ModelKind::Spatial {
            continue;
        }
        // In 3D torques that are held curl the robot up until it has more contacts than there is room for.
        step_without_allocating::<PlanarRobot>(&EnvConfig {
            task,
            action_mode: ActionMode::Torques,
            ..EnvConfig::default()
        });
    }
    let named = ["accelerometer", "gyro", "motor_torque", "touch", "touch_side", "range"].map(String::from);
    let config = EnvConfig { task: Task::COURSE, observation_blocks: Some(named.to_vec()), ..EnvConfig::default() };
    step_without_allocating::<PlanarRobot>(&config);
    step_without_allocating::<SpatialRobot>(&EnvConfig { model: ModelKind::Spatial, ..config });
}

fn step_without_allocating<M: RobotModel>(config: &EnvConfig) {
    let mut environment = Environment::<M>::new(config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    let action = vec![0.2; environment.action_size()];
    environment.reset(Some(1), &mut observation);
    let start = environment.save();
    // The first steps may reserve workspace that the rest re-uses.
    for _ in 0..20 {
        environment.step(&action, &mut observation);
    }
    let before = REQUESTS.get();
    for _ in 0..100 {
        environment.step(&action, &mut observation);
    }
    assert_eq!(REQUESTS.get() - before, 0, "{:?}, {:?}, {:?}", M::KIND, config.task, config.action_mode);
    // Nor do those after a state was restored, which keeps the room.
    environment.restore(&start).unwrap();
    let before = REQUESTS.get();
    for _ in 0..120 {
        environment.step(&action, &mut observation);
    }
    assert_eq!(REQUESTS.get() - before, 0, "{:?}, {:?}, {:?}", M::KIND, config.task, config.action_mode);
}
