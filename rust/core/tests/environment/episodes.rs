//! Laws of the environment: what agents may rely on.

use proptest::prelude::*;
use snake_core::control::ControllerConfig;
use snake_core::environment::rng::Rng;
use snake_core::environment::signal::signals_of;
use snake_core::environment::*;
use snake_core::robot::{PerLink, RobotConfig};
use snake_core::stepping::ImplicitConfig;

/// The families of the planar model.
fn tasks() -> impl Iterator<Item = Task> {
    Task::ALL.into_iter().filter(|task| task.family().model == ModelKind::Planar)
}

const MODES: [ActionMode; 5] =
    [ActionMode::Gait, ActionMode::Joints, ActionMode::Residual, ActionMode::Velocities, ActionMode::Torques];

fn config(task: Task) -> EnvConfig {
    EnvConfig { task, ..EnvConfig::default() }
}

/// An environment and room for its observation.
struct Run {
    environment: Environment,
    observation: Vec<f32>,
}

impl Run {
    fn new(config: &EnvConfig, seed: u64) -> Self {
        let mut environment = Environment::<PlanarRobot>::new(config).unwrap();
        let mut observation = vec![0.0; environment.observation_size()];
        environment.reset(Some(seed), &mut observation);
        Self { environment, observation }
    }

    fn step(&mut self, action: &[f64]) -> Outcome {
        self.environment.step(action, &mut self.observation)
    }

    /// Repeats one action until the episode ends or `steps` are done.
    fn hold(&mut self, action: &[f64], steps: usize) -> Outcome {
        let mut outcome = self.environment.outcome();
        for _ in 0..steps {
            outcome = self.step(action);
            if outcome.terminated || outcome.truncated {
                break;
            }
        }
        outcome
    }

    fn random_action(&self, stream: &mut Rng) -> Vec<f64> {
        (0..self.environment.action_size()).map(|_| stream.around_zero(1.0)).collect()
    }
}

#[test]
fn the_gait_of_the_thesis_reaches_the_goal_of_the_course() {
    let mut run = Run::new(&EnvConfig { start_jitter: 0.0, ..config(Task::COURSE) }, 0);
    let outcome = run.hold(&[0.0; 4], 600);
    let summary = *run.environment.summary();
    assert!(summary.is_success && outcome.terminated, "{summary:?}");
    // (T 7.5.3) finds 0.162 m/s; starting from rest costs a few per cent of twelve seconds.
    assert!((0.15..0.1633).contains(&summary.speed), "{} m/s", summary.speed);
    assert_eq!(summary.jam_ratio, 0.0);
}

#[test]
fn orthotropic_ground_carries_the_gait_forward_and_a_reversed_wave_back() {
    let distance = |frequency: f64| {
        let mut run = Run::new(&config(Task::FREE), 3);
        run.hold(&[0.0, frequency, 0.0, 0.0], 200);
        run.environment.summary().distance
    };
    assert!(distance(0.0) > 0.3, "{}", distance(0.0));
    assert!(distance(-1.0) < -0.1, "-40 degrees a second: {}", distance(-1.0));
}

#[test]
fn a_positive_offset_turns_the_head_right_and_a_negative_one_left() {
    let heading = |offset: f64| {
        let mut run = Run::new(&EnvConfig { start_jitter: 0.0, ..config(Task::FREE) }, 0);
        run.hold(&[0.0, 0.5, 0.0, offset], 150);
        run.environment.summary().heading_error
    };
    let (right, left) = (heading(0.3), heading(-0.3));
    assert!(right < -0.3 && left > 0.3, "right {right}, left {left} rad after 7.5 s");
}

#[test]
fn a_failed_episode_has_a_reason() {
    let mut run = Run::new(&EnvConfig { corridor_half_width: 0.1, ..config(Task::FREE) }, 0);
    let outcome = run.hold(&[0.0, 0.5, 0.0, 0.5], 600);
    assert!(outcome.terminated && run.environment.summary().left_corridor);

    let mut run = Run::new(&EnvConfig { max_episode_steps: 7, ..config(Task::FIELD) }, 0);
    for step in 1..=7 {
        let outcome = run.step(&[0.0; 4]);
        assert_eq!((outcome.terminated, outcome.truncated), (false, step == 7));
    }
}

#[test]
fn the_start_never_penetrates_and_rests_on_its_reference() {
    for task in tasks() {
        for action_mode in MODES.into_iter().filter(|mode| *mode != ActionMode::Torques) {
            for seed in 0..20 {
                let config = EnvConfig { action_mode, difficulty: seed as f64 / 19.0, ..config(task) };
                let run = Run::new(&config, seed);
                let environment = &run.environment;
                assert!(environment.simulation().min_gap() > 0.0, "{task:?}, seed {seed}");
                assert!(environment.simulation().kinetic_energy() == 0.0);
                let mut references = [0.0; 10];
                environment.reference().angles((0..references.len()).map(|joint| (joint, 0)), &mut references);
                for (joint, reference) in references.into_iter().enumerate() {
                    assert!((reference - environment.state().joint_angle(joint)).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn no_start_diverges() {
    let mut stream = Rng::new(0, 0);
    for task in tasks() {
        let mut run = Run::new(&config(task), 0);
        for seed in 0..100 {
            run.environment.reset(Some(seed), &mut run.observation);
            let action = run.random_action(&mut stream);
            run.hold(&action, 2);
            assert!(!run.environment.summary().diverged, "{task:?}, seed {seed}, action {action:?}");
        }
    }
}

#[test]
fn observations_stay_in_bounds_and_none_is_constant() {
    for task in tasks() {
        for action_mode in MODES {
            let mut run = Run::new(&EnvConfig { action_mode, ..config(task) }, 1);
            let size = run.observation.len();
            let (mut low, mut high) = (vec![f32::INFINITY; size], vec![f32::NEG_INFINITY; size]);
            let mut stream = Rng::new(1, 2);
            for episode in 0..3 {
                for _ in 0..100 {
                    let action = run.random_action(&mut stream);
                    let outcome = run.step(&action);
                    assert!(outcome.reward.is_finite() && outcome.signals.iter().all(|value| value.is_finite()));
                    for ((low, high), value) in low.iter_mut().zip(&mut high).zip(&run.observation) {
                        (*low, *high) = (low.min(*value), high.max(*value));
                    }
                    if outcome.terminated || outcome.truncated {
                        break;
                    }
                }
                run.environment.reset(Some(episode), &mut run.observation);
            }
            for block in run.environment.observation_blocks() {
                for (i, element) in block.elements.iter().enumerate() {
                    let name = &element.name;
                    let (low, high) = (f64::from(low[block.start + i]), f64::from(high[block.start + i]));
                    assert!(low >= -block.row.bound && high <= block.row.bound, "{task:?} {} {name}", block.row.name);
                    let may_be_still = block.row.name == "contact_force" || block.row.name == "pegs";
                    assert!(high > low || may_be_still, "{task:?} {} {name} is always {low}", block.row.name);
                }
            }
        }
    }
}

#[test]
fn most_of_a_moving_robots_observation_lies_between_minus_one_and_one() {
    for task in tasks() {
        let mut run = Run::new(&config(task), 2);
        let (mut inside, mut all) = (0, 0);
        for _ in 0..150 {
            run.step(&[0.2, 0.5, 0.1, 0.0]);
            inside += run.observation.iter().filter(|value| value.abs() <= 1.0).count();
            all += run.observation.len();
        }
        assert!(f64::from(inside as u32) > 0.95 * f64::from(all as u32), "{task:?}: {inside} of {all}");
    }
}

#[test]
fn the_reward_is_the_sum_of_the_terms_reported() {
    let mut run = Run::new(&config(Task::FIELD), 4);
    let mut stream = Rng::new(4, 0);
    let signals = signals_of::<PlanarRobot>();
    for _ in 0..50 {
        let action = run.random_action(&mut stream);
        let outcome = run.step(&action);
        let terms = signals.iter().zip(outcome.signals).filter(|(signal, _)| signal.name.starts_with("reward_"));
        let sum: f64 = terms.map(|(_, value)| value).sum();
        assert!((outcome.reward - sum).abs() < 1e-15);
    }
}

#[test]
fn weights_scale_their_terms_and_nothing_else() {
    let mut plain = Run::new(&config(Task::FIELD), 4);
    let reward_weights = RewardWeights::default().with("energy", 1.0);
    let mut thrifty = Run::new(&EnvConfig { reward_weights, ..config(Task::FIELD) }, 4);
    for _ in 0..20 {
        plain.step(&[0.5; 4]);
        thrifty.step(&[0.5; 4]);
        let (a, b) = (plain.environment.summary(), thrifty.environment.summary());
        assert_eq!((a.distance, a.energy), (b.distance, b.energy));
        assert_eq!(b.reward.get("energy"), Some(-b.positive_work));
        assert_eq!(a.reward.get("progress"), b.reward.get("progress"));
    }
}

#[test]
fn a_saved_state_continues_bit_for_bit_in_another_environment() {
    for task in tasks() {
        for action_mode in MODES {
            let config = EnvConfig { action_mode, ..config(task) };
            let (mut first, mut second) = (Run::new(&config, 5), Run::new(&config, 6));
            let mut stream = Rng::new(0, 0);
            for _ in 0..30 {
                let action = first.random_action(&mut stream);
                first.step(&action);
            }
            second.environment.restore(&first.environment.save()).unwrap();
            for step in 0..30 {
                let action = first.random_action(&mut stream);
                assert_eq!(first.step(&action), second.step(&action), "{task:?} {action_mode:?} step {step}");
                assert_eq!(first.observation, second.observation);
            }
            first.environment.reset(None, &mut first.observation);
            second.environment.reset(None, &mut second.observation);
            assert_eq!(first.environment.save(), second.environment.save(), "the next episode is the same too");
        }
    }
}

#[test]
fn a_state_of_another_shape_is_refused() {
    let state = Run::new(&config(Task::FREE), 0).environment.save();
    let mut other = Run::new(&EnvConfig { action_mode: ActionMode::Joints, ..config(Task::FREE) }, 0);
    let error = other.environment.restore(&state).unwrap_err();
    assert_eq!(error.field, "state");
}

/// Bytes of a stranger must not lead out of a list.
#[test]
fn a_state_that_names_a_contact_which_the_scene_does_not_have_is_refused() {
    let mut run = Run::new(&config(Task::COURSE), 0);
    run.hold(&[0.0; 4], 5);
    let saved = serde_json::to_value(run.environment.save()).unwrap();
    for (field, index) in [("link", 11), ("obstacle", 40), ("feature", 1)] {
        let mut state = saved.clone();
        state["model"]["simulation"]["warm_start"]["near"]["pairs"][0][field] = serde_json::json!(index);
        let error = run.environment.restore(&serde_json::from_value(state).unwrap()).unwrap_err();
        assert_eq!(error.field, "state", "{field}");
    }
    run.environment.restore(&serde_json::from_value(saved).unwrap()).unwrap();
}

#[test]
fn a_reset_leaves_nothing_of_the_episode_before() {
    for task in tasks() {
        let (mut fresh, mut used) = (Run::new(&config(task), 8), Run::new(&config(task), 9));
        used.hold(&[0.3, 1.0, -0.2, 0.1], 40);
        used.environment.reset(Some(8), &mut used.observation);
        assert_eq!(fresh.observation, used.observation);
        for _ in 0..20 {
            assert_eq!(fresh.step(&[0.1; 4]), used.step(&[0.1; 4]), "{task:?}");
        }
    }
}

#[test]
fn episodes_of_a_seed_differ_and_come_back_with_the_seed() {
    let mut run = Run::new(&config(Task::FIELD), 5);
    let first = run.environment.pegs().to_vec();
    run.environment.reset(None, &mut run.observation);
    let second = run.environment.pegs().to_vec();
    assert_ne!(first, second);
    run.environment.reset(Some(5), &mut run.observation);
    assert_eq!(first, run.environment.pegs());
    run.environment.reset(None, &mut run.observation);
    assert_eq!(second, run.environment.pegs());
}

#[test]
fn a_diverging_robot_is_flagged_and_its_observation_finite() {
    let mut run = Run::new(&config(Task::COURSE), 0);
    run.hold(&[0.0; 4], 5);
    let mut state = serde_json::to_value(run.environment.save()).unwrap();
    state["model"]["simulation"]["state"]["twist"][3][0] = serde_json::json!(1e300);
    run.environment.restore(&serde_json::from_value(state).unwrap()).unwrap();
    let outcome = run.step(&[0.0; 4]);
    assert!(!outcome.terminated && outcome.truncated && run.environment.summary().diverged);
    assert!(outcome.reward.is_finite() && outcome.signals.iter().all(|value| value.is_finite()));
    assert!(run.observation.iter().all(|value| value.is_finite()));
    let again = run.environment.reset(Some(0), &mut run.observation);
    assert!(!again.truncated);
    run.hold(&[0.0; 4], 5);
    assert!(!run.environment.summary().diverged);
}

#[test]
fn robots_of_other_sizes_have_environments_too() {
    let double = RobotConfig {
        length: PerLink::Same(0.244),
        contact_half_length: PerLink::Same(0.0786),
        radius: PerLink::Same(0.105),
        ..RobotConfig::default()
    };
    let short = RobotConfig { links: 7, ..RobotConfig::default() };
    for (robot, task) in [(double, Task::FIELD), (short.clone(), Task::COURSE), (short, Task::FIELD)] {
        let mut run = Run::new(&EnvConfig { robot, goal_distance: 1.0, ..config(task) }, 0);
        assert!(run.environment.simulation().min_gap() > 0.0);
        assert!(!run.hold(&[0.0; 4], 40).terminated);
    }
}

#[test]
fn every_field_of_the_configuration_is_checked_by_name() {
    let good = EnvConfig::default();
    let weights = |progress: f64| RewardWeights::default().with("progress", progress);
    let controller = |kp: f64| ControllerConfig { kp, ..ControllerConfig::default() };
    let robot = |radius: f64| RobotConfig { radius: PerLink::Same(radius), ..RobotConfig::default() };
    let integrator = |order: u32| ImplicitConfig { order, ..ImplicitConfig::default() };
    let perturbation = |removed, moved| Perturbation { removed, moved: vec![moved], ..Perturbation::default() };
    let bad = [
        ("nearest_pegs", EnvConfig { nearest_pegs: 0, ..good.clone() }),
        ("control_period", EnvConfig { control_period: f64::NAN, ..good.clone() }),
        ("max_episode_steps", EnvConfig { max_episode_steps: 0, ..good.clone() }),
        ("goal_distance", EnvConfig { goal_distance: -1.0, ..good.clone() }),
        ("corridor_half_width", EnvConfig { corridor_half_width: f64::INFINITY, ..good.clone() }),
        ("goal_radius", EnvConfig { goal_radius: 2.0, task: Task::MAZE, ..good.clone() }),
        ("push_points", EnvConfig { push_points: 5, ..good.clone() }),
        ("turn", EnvConfig { turn: 1.6, ..good.clone() }),
        ("perturbation.removed", EnvConfig { perturbation: perturbation(9, (3, 0.0, 0.0)), ..good.clone() }),
        (
            "perturbation.moved[0]",
            EnvConfig { perturbation: perturbation(0, (3, 0.179, 0.056)), task: Task::PERTURBED, ..good.clone() },
        ),
        ("difficulty", EnvConfig { difficulty: 1.1, ..good.clone() }),
        ("start_jitter", EnvConfig { start_jitter: -0.1, ..good.clone() }),
        ("friction[1]", EnvConfig { friction: Some([0.2, -0.2]), ..good.clone() }),
        ("reward_weights.progress", EnvConfig { reward_weights: weights(f64::NAN), ..good.clone() }),
        ("controller.kp", EnvConfig { controller: controller(-1.0), ..good.clone() }),
        ("integrator.order", EnvConfig { integrator: integrator(3), ..good.clone() }),
        ("robot.radius", EnvConfig { robot: robot(-0.1), ..good.clone() }),
        ("robot.radius", EnvConfig { robot: robot(0.06), task: Task::COURSE, ..good.clone() }),
    ];
    for (field, config) in bad {
        let error = Environment::<PlanarRobot>::new(&config).unwrap_err();
        assert_eq!(error.field, field);
        assert!(!error.value.is_empty() && !error.expected.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn actions_beyond_their_range_act_as_the_nearest_ones_within(
        seed in 0..100u64, action in prop::collection::vec(-5.0..5.0f64, 4),
    ) {
        let (mut wild, mut tame) = (Run::new(&config(Task::FREE), seed), Run::new(&config(Task::FREE), seed));
        let clipped: Vec<f64> = action.iter().map(|value| value.clamp(-1.0, 1.0)).collect();
        for _ in 0..3 {
            prop_assert_eq!(wild.step(&action), tame.step(&clipped));
            prop_assert_eq!(&wild.observation, &tame.observation);
        }
    }
}
