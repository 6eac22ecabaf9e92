//! Laws of what differs from robot to robot and from episode to episode.

use snake_core::batch::{Batch, Outputs};
use snake_core::control::{ControlLaw, ControllerConfig};
use snake_core::environment::rng::Rng;
use snake_core::environment::*;
use snake_core::noise::NoiseConfig;
use snake_core::robot::{PerLink, RobotConfig};

fn field(randomization: Randomization) -> EnvConfig {
    EnvConfig { task: Task::FIELD, randomization, ..EnvConfig::default() }
}

fn everything() -> Randomization {
    Randomization {
        friction: [0.5, 1.5],
        anisotropy: [0.8, 1.25],
        mass: [0.8, 1.2],
        torque_limit: [0.5, 1.0],
        reference_rate: Some(10.0),
        reference_delay: [0.05, 0.15],
        noise: NoiseConfig { joint_angle: 0.01, velocity: 0.05, heading: 0.01, ..NoiseConfig::default() },
        peg_error: 0.02,
        backlash: [0.0, 0.08],
        stribeck: [0.0, 0.3],
    }
}

/// Steps robot `seed` under its own actions; returns its poses.
fn poses(config: &EnvConfig, steps: usize) -> Vec<f64> {
    let mut environment = <Environment>::new(config).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(3), &mut observation);
    let mut stream = Rng::new(1, 1);
    for _ in 0..steps {
        let action: Vec<f64> = (0..environment.action_size()).map(|_| stream.around_zero(1.0)).collect();
        environment.step(&action, &mut observation);
    }
    environment.state().pose.iter().flat_map(|pose| [pose.x, pose.y, pose.z]).collect()
}

/// A factor drawn from a range of one value is the same as a robot built so.
fn assert_same_motion(randomization: Randomization, built: impl FnOnce(&mut EnvConfig)) {
    let mut config = field(Randomization::default());
    built(&mut config);
    let (drawn, built) = (poses(&field(randomization), 60), poses(&config, 60));
    for (a, b) in drawn.iter().zip(&built) {
        // The factors multiply in another order: rounding differs in the last digit, and contacts amplify it.
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
    assert_ne!(drawn, poses(&field(Randomization::default()), 60));
}

#[test]
fn a_factor_on_friction_is_another_ground() {
    let randomization = Randomization { friction: [1.5; 2], anisotropy: [0.5; 2], ..Randomization::default() };
    assert_same_motion(randomization, |config| config.friction = Some([0.3, 0.15]));
}

#[test]
fn a_factor_on_mass_is_a_heavier_robot() {
    let heavy = |config: &mut EnvConfig| {
        let RobotConfig { mass, inertia, .. } = &mut config.robot;
        (*mass, *inertia) = (PerLink::Same(1.5 * 7.5 / 11.0), PerLink::Same(1.5 * 1.32e-3));
    };
    assert_same_motion(Randomization { mass: [1.5; 2], ..Randomization::default() }, heavy);
}

#[test]
fn a_factor_on_the_torque_limit_is_a_weaker_motor() {
    let weak = |config: &mut EnvConfig| {
        config.controller = ControllerConfig { torque_limit: Some(2.0), ..ControllerConfig::default() };
    };
    assert_same_motion(Randomization { torque_limit: [0.2; 2], ..Randomization::default() }, weak);
}

#[test]
fn drawn_backlash_is_that_of_a_looser_robot() {
    let loose = |config: &mut EnvConfig| config.robot.backlash = 0.08.into();
    assert_same_motion(Randomization { backlash: [0.08; 2], ..Randomization::default() }, loose);
}

#[test]
fn a_drop_of_friction_drawn_is_another_ground() {
    let slippery = |config: &mut EnvConfig| config.stribeck.drop = 0.3;
    assert_same_motion(Randomization { stribeck: [0.3; 2], ..Randomization::default() }, slippery);
}

/// What is drawn comes on top, within what there can be, and where the system can have it.
#[test]
fn play_and_drops_that_no_plant_can_have_are_refused_by_name() {
    let play = Randomization { backlash: [0.0, 0.1], ..Randomization::default() };
    let drop = Randomization { stribeck: [0.0, 0.5], ..Randomization::default() };
    let refused = |randomization, change: fn(&mut EnvConfig)| {
        let mut config = field(randomization);
        change(&mut config);
        <Environment>::new(&config).map(drop_result).unwrap_err().field
    };
    assert_eq!(refused(play, |config| config.controller.law = ControlLaw::Io), "randomization.backlash");
    assert_eq!(refused(play, |config| config.robot.backlash = 1.5.into()), "randomization.backlash");
    assert_eq!(refused(drop, |config| config.stribeck.drop = 0.6), "randomization.stribeck");
}

fn drop_result<M: RobotModel>(_: Environment<M>) {}

#[test]
fn a_delay_shifts_the_joint_references_in_time() {
    let references = |randomization: Randomization| {
        let config = EnvConfig { task: Task::FREE, start_jitter: 0.0, randomization, ..EnvConfig::default() };
        let mut environment = <Environment>::new(&config).unwrap();
        let mut observation = vec![0.0; environment.observation_size()];
        environment.reset(Some(0), &mut observation);
        let mut step = |_| {
            environment.step(&[0.5, 1.0, 0.0, 0.3], &mut observation);
            let mut angles = [0.0; 10];
            environment.reference().angles((0..angles.len()).map(|joint| (joint, 0)), &mut angles);
            angles[4]
        };
        (0..30).map(&mut step).collect::<Vec<f64>>()
    };
    let prompt = references(Randomization::default());
    let late = references(Randomization { reference_delay: [0.15; 2], ..Randomization::default() });
    assert!(late[..3].iter().all(|angle| *angle == late[0]), "nothing has arrived yet");
    for (prompt, late) in prompt.iter().zip(&late[3..]) {
        assert!((prompt - late).abs() < 1e-12);
    }
}

#[test]
fn noise_is_seen_and_not_felt() {
    let noise = NoiseConfig { joint_angle: 0.05, joint_rate: 0.1, velocity: 0.1, ..NoiseConfig::default() };
    let noisy = Randomization { noise, peg_error: 0.05, ..Randomization::default() };
    assert_eq!(poses(&field(noisy), 40), poses(&field(Randomization::default()), 40));

    let mut environments = [noisy, Randomization::default()].map(|one| <Environment>::new(&field(one)).unwrap());
    let mut seen = environments.each_ref().map(|environment| vec![0.0; environment.observation_size()]);
    let mut largest = 0.0f64;
    for seed in 0..50 {
        for (environment, seen) in environments.iter_mut().zip(&mut seen) {
            environment.reset(Some(seed), seen);
        }
        // Joint angles come first, in quarter turns.
        let errors = seen[0][..10].iter().zip(&seen[1][..10]).map(|(a, b)| f64::from(a - b).abs());
        largest = errors.fold(largest, f64::max);
    }
    let amplitude = 0.05 / std::f64::consts::FRAC_PI_2;
    assert!((0.95 * amplitude..1.0001 * amplitude).contains(&largest), "{largest} of {amplitude}");
}

#[test]
fn randomised_robots_do_not_depend_on_their_neighbours() {
    let config = EnvConfig { max_episode_steps: 20, ..field(everything()) };
    let run = |rows: usize| {
        let mut batch = <Batch>::new(&config, rows, 1).unwrap();
        let mut observation = vec![0.0; rows * batch.observation_size()];
        let (mut reward, mut signals) = (vec![0.0; rows], vec![0.0; batch.signals().len() * rows]);
        let (mut terminated, mut truncated) = (vec![false; rows], vec![false; rows]);
        macro_rules! out {
            () => {
                Outputs {
                    observation: &mut observation,
                    reward: &mut reward,
                    terminated: &mut terminated,
                    truncated: &mut truncated,
                    signals: &mut signals,
                }
            };
        }
        let seeds: Vec<_> = (0..rows as u64).map(Some).collect();
        batch.reset(&vec![true; rows], &seeds, out!());
        for step in 0..20 {
            let size = batch.action_size();
            let actions: Vec<f64> = (0..rows * size).map(|k| ((k % size + step) as f64).sin()).collect();
            batch.step(&actions, &vec![true; rows], out!());
        }
        let saved: Vec<EnvironmentState> = (0..rows).map(|row| batch.save(row)).collect();
        (observation, saved)
    };
    let ((few, alone), (many, all)) = (run(3), run(11));
    assert_eq!(few, many[..few.len()]);
    assert_eq!(alone, all[..3]);
}

#[test]
fn a_saved_state_of_a_randomised_robot_continues_bit_for_bit() {
    let config = field(everything());
    let mut environments = [0, 1].map(|_| <Environment>::new(&config).unwrap());
    let [first, second] = &mut environments;
    let mut observations = [vec![0.0; first.observation_size()], vec![0.0; first.observation_size()]];
    let [one, other] = &mut observations;
    first.reset(Some(5), one);
    second.reset(Some(6), other);
    first.set_difficulty(0.9).unwrap();
    for _ in 0..15 {
        first.step(&[0.3, 0.5, -0.2, 0.1], one);
    }
    second.restore(&first.save()).unwrap();
    for step in 0..20 {
        let action = [0.5, 0.1 * f64::from(step), 0.0, -0.3];
        assert_eq!(first.step(&action, one), second.step(&action, other), "step {step}");
        assert_eq!(one, other);
    }
    first.reset(None, one);
    second.reset(None, other);
    assert_eq!(first.save(), second.save(), "the next episode has the same difficulty");
}

#[test]
fn a_new_difficulty_counts_from_the_next_episode_on() {
    let mut environment = <Environment>::new(&field(Randomization::default())).unwrap();
    let mut observation = vec![0.0; environment.observation_size()];
    environment.reset(Some(4), &mut observation);
    let before = environment.pegs().to_vec();
    environment.set_difficulty(1.0).unwrap();
    assert_eq!(before, environment.pegs());
    environment.reset(Some(4), &mut observation);
    let hard = EnvConfig { difficulty: 1.0, ..EnvConfig::default() };
    let mut other = <Environment>::new(&hard).unwrap();
    other.reset(Some(4), &mut observation);
    assert_eq!(environment.pegs(), other.pegs());
    for bad in [-0.1, 1.1, f64::NAN] {
        assert_eq!(environment.set_difficulty(bad).unwrap_err().field, "difficulty");
    }
}
