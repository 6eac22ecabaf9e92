//! Laws of the environment on the spatial model: what agents may rely on.

use std::f64::consts::{FRAC_PI_2, PI};

use snake_core::environment::rng::Rng;
use snake_core::environment::*;
use snake_core::gait::{CardanTarget, Reference};
use snake_core::spatial::{Spatial, joint_angle};
use snake_core::stepping::Model;

const MODES: [ActionMode; 5] =
    [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques];

/// The action that rolls on open ground (T 7.4): amplitude 10 degrees, phase shift zero.
const ROLLING: [f64; 6] = [-2.0 / 3.0, 0.0, 1.0, 0.0, 0.0, 0.0];

fn config(task: Task) -> EnvConfig {
    EnvConfig { model: ModelKind::Spatial, task, ..EnvConfig::default() }
}

/// An environment and room for its observation.
struct Run {
    environment: Environment<SpatialRobot>,
    observation: Vec<f32>,
}

impl Run {
    fn new(config: &EnvConfig, seed: u64) -> Self {
        let mut environment = Environment::<SpatialRobot>::new(config).unwrap();
        let mut observation = vec![0.0; environment.observation_size()];
        environment.reset(Some(seed), &mut observation);
        Self { environment, observation }
    }

    fn step(&mut self, action: &[f64]) -> Outcome {
        self.environment.step(action, &mut self.observation)
    }

    /// Repeats one action; returns how many solves stayed unconverged.
    fn hold(&mut self, action: &[f64], steps: usize) -> u32 {
        let mut unconverged = 0;
        for _ in 0..steps {
            self.step(action);
            unconverged += self.environment.summary().unconverged;
        }
        unconverged
    }

    fn random_action(&self, stream: &mut Rng) -> Vec<f64> {
        (0..self.environment.action_size()).map(|_| stream.around_zero(1.2)).collect()
    }

    fn centre(&self) -> nalgebra::Vector2<f64> {
        self.environment.model().motion().position
    }

    fn block(&self, name: &str) -> &[f32] {
        let blocks = self.environment.observation_blocks();
        let block = blocks.iter().find(|block| block.row.name == name).unwrap();
        &self.observation[block.start..block.start + block.size()]
    }
}

#[test]
fn sidewinding_as_a_constant_action_carries_the_robot_towards_its_goal_at_ten_centimetres_a_second() {
    let mut run = Run::new(&EnvConfig { start_jitter: 0.0, ..config(Task::FREE) }, 0);
    run.hold(&[0.0; 6], 100);
    let (before, unconverged) = (run.centre(), run.hold(&[0.0; 6], 180));
    let way = run.centre() - before;
    // (T 7.5.2) has 10.5 cm/s at 93 degrees to the body; 180 periods are two of the gait.
    let speed = way.norm() / 9.0;
    assert!((0.095..0.115).contains(&speed), "{speed} m/s along {way:?}");
    assert!(way.y.atan2(way.x).abs() < 0.15, "{way:?} is not the way to the goal");
    assert_eq!((unconverged, run.environment.model().overbent()), (0, 0));
}

#[test]
fn lateral_rolling_as_a_constant_action_turns_the_robot_about_its_axis() {
    let mut run = Run::new(&EnvConfig { start_jitter: 0.0, corridor_half_width: 5.0, ..config(Task::FREE) }, 0);
    run.hold(&ROLLING, 100);
    let before = run.centre();
    let (mut turned, mut last) = (0.0, run.environment.model().attitude().roll);
    for _ in 0..100 {
        run.step(&ROLLING);
        let roll = run.environment.model().attitude().roll;
        turned += (roll - last + 3.0 * PI).rem_euclid(2.0 * PI) - PI;
        last = roll;
    }
    let speed = (run.centre() - before).norm() / 5.0;
    assert!(turned.abs() > 2.0 * PI, "turned by {turned} rad in 5 s");
    // The gait's 80 degrees a second on a radius of 5.25 cm.
    assert!((0.06..0.08).contains(&speed), "{speed} m/s");
}

#[test]
fn the_ground_carries_the_weight_of_a_resting_robot_and_its_sensor_measures_gravity_downwards() {
    let mut run = Run::new(&EnvConfig { action_mode: ActionMode::Joints, ..config(Task::FREE) }, 1);
    // The actions that hold the posture of the start.
    let posture: Vec<f64> = run.block("reference").iter().map(|angle| f64::from(*angle) * FRAC_PI_2).collect();
    let entries = run.environment.action_entries();
    let action: Vec<f64> = entries.iter().zip(posture).map(|(entry, angle)| entry.normalised(angle)).collect();
    run.hold(&action, 10);
    let model = run.environment.model();
    let carried: f64 = model.normal_force().sum();
    let weight = model.robot().total_mass() * model.robot().gravity;
    assert!((carried / weight - 1.0).abs() < 1e-6, "{carried} N of {weight} N");
    assert!((model.height() - 0.0525).abs() < 1e-4, "{} m", model.height());
    for (felt, down) in run.block("gravity").iter().zip([0.0, 0.0, -1.0]) {
        assert!((felt - down).abs() < 1e-3);
    }
}

#[test]
fn references_stay_within_a_right_angle_and_their_rates_are_derivatives() {
    for task in [Task::FREE, Task::FIELD] {
        for action_mode in MODES {
            let mut run = Run::new(&EnvConfig { action_mode, ..config(task) }, 3);
            let mut stream = Rng::new(5, 0);
            for k in 0..60 {
                // Extremes of every entry for a while, then anything.
                let action: Vec<f64> =
                    run.random_action(&mut stream).iter().map(|a| if k < 40 { a.signum() } else { *a }).collect();
                run.step(&action);
                let generator = &run.environment.model().reference;
                let time = run.environment.model().simulation.state().time + 0.01;
                for joint in 0..10 {
                    let at = |t: f64| generator.target(joint, t);
                    let (h, CardanTarget { yaw, pitch }) = (1e-5, at(time));
                    assert!(yaw.angle.abs() <= FRAC_PI_2 + 1e-9 && pitch.angle.abs() <= FRAC_PI_2 + 1e-9);
                    let slope = (at(time + h).pitch.angle - at(time - h).pitch.angle) / (2.0 * h);
                    assert!((slope - pitch.rate).abs() < 1e-6, "{slope} and {}", pitch.rate);
                    let slope = (at(time + h).pitch.rate - at(time - h).pitch.rate) / (2.0 * h);
                    assert!((slope - pitch.acceleration).abs() < 1e-4, "{slope} and {}", pitch.acceleration);
                }
            }
        }
    }
}

#[test]
fn ten_thousand_random_steps_stay_finite_and_count_every_miss() {
    let mut stream = Rng::new(11, 0);
    let (mut unconverged, mut diverged) = (0, 0);
    for (k, task) in [Task::FREE, Task::FIELD, Task::COURSE, Task::MAZE].into_iter().enumerate() {
        let action_mode = MODES[k % MODES.len()];
        let mut run = Run::new(&EnvConfig { action_mode, max_episode_steps: 300, ..config(task) }, k as u64);
        for _ in 0..RANDOM_STEPS / 4 {
            let action = run.random_action(&mut stream);
            let outcome = run.step(&action);
            let summary = *run.environment.summary();
            assert!(outcome.reward.is_finite() && outcome.signals.iter().all(|value| value.is_finite()));
            assert!(run.observation.iter().all(|value| value.is_finite()));
            // A stage that is not certified is a miss.
            assert!(summary.unconverged > 0 || summary.residual <= CERTIFIED, "{summary:?}");
            unconverged += summary.unconverged;
            diverged += u32::from(summary.diverged);
            if outcome.terminated || outcome.truncated {
                run.environment.reset(None, &mut run.observation);
            }
        }
    }
    println!("{RANDOM_STEPS} random steps: {unconverged} unconverged, {diverged} divergences");
    assert_eq!(diverged, 0);
    assert!(f64::from(unconverged) < 1e-3 * f64::from(RANDOM_STEPS), "{unconverged} unconverged");
}

const RANDOM_STEPS: u32 = 10_000;

/// What the judge lets pass by default \[m/s\].
const CERTIFIED: f64 = Spatial::ACCURACY.tolerance;

#[test]
fn starts_rest_on_the_ground_clear_of_pegs_and_on_their_references() {
    for task in Task::ALL {
        for action_mode in MODES.into_iter().filter(|mode| *mode != ActionMode::Torques) {
            for seed in 0..5 {
                let run = Run::new(&EnvConfig { action_mode, ..config(task) }, seed);
                let model = run.environment.model();
                assert!(model.simulation.min_gap() > -1e-12, "{task:?}, {}", model.simulation.min_gap());
                if ["pipe", "climb"].contains(&task.family().name) {
                    // They press on what they are wound around.
                    continue;
                }
                let pose = &model.simulation.state().pose;
                let mut reference = [0.0; 20];
                model.reference.angles(model.robot().axis_list(), &mut reference);
                for (j, angle) in reference.chunks(2).enumerate() {
                    let error = joint_angle(&pose[j], &pose[j + 1]) - nalgebra::Vector2::new(angle[0], angle[1]);
                    assert!(error.norm() < 1e-12, "{task:?}, {action_mode:?}: {error:?}");
                }
            }
        }
    }
}

#[test]
fn a_restored_environment_goes_on_bit_for_bit() {
    for task in [Task::FREE, Task::COURSE] {
        let mut run = Run::new(&EnvConfig { action_mode: ActionMode::Residual, ..config(task) }, 2);
        let mut stream = Rng::new(1, 1);
        let actions: Vec<_> = (0..60).map(|_| run.random_action(&mut stream)).collect();
        actions[..30].iter().for_each(|action| {
            run.step(action);
        });
        let mut twin = Run::new(&EnvConfig { action_mode: ActionMode::Residual, ..config(task) }, 9);
        twin.environment.restore(&run.environment.save()).unwrap();
        for action in &actions[30..] {
            assert_eq!(run.step(action), twin.step(action));
            assert_eq!(run.observation, twin.observation);
            assert!(run.environment.save() == twin.environment.save());
        }
    }
}

#[test]
fn a_robot_of_the_other_model_is_refused() {
    let error = Environment::<SpatialRobot>::new(&EnvConfig::default()).unwrap_err();
    assert_eq!(error.field, "model");
    let mut io = config(Task::FREE);
    io.controller.law = snake_core::control::ControlLaw::Io;
    assert_eq!(Environment::<SpatialRobot>::new(&io).unwrap_err().field, "controller.law");
}
